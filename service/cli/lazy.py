"""Commands that are imported when they are called: `stickslip --help` reads a table, and nothing else."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from operator import itemgetter
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from solver.results.views import on_demand

STUDY = "study"


@dataclass(frozen=True, slots=True)
class CommandEntry:
    """A command in the table.

    Attributes
    ----------
    name : str
        As the user writes it.
    home : str
        Module of `service.cli` and function, ``"commands.scenes.scenes"``; `STUDY` for that of a study.
    summary : str
        The first line of the function's docstring, which `--help` shows.
    keyed : bool
        It talks to a service, and takes ``--key-file``.
    group : bool
        What stands there is the class of a group, not a function.
    """

    name: str
    home: str
    summary: str
    keyed: bool = False
    group: bool = False

    def command(self) -> Deferred:
        """Return it as help lists it."""
        return (DeferredGroup if self.group else Deferred)(self)

    def function(self) -> Any:
        """Import the module and return what stands there."""
        if self.home == STUDY:
            from service.cli.study_command import command_named

            return command_named(self.name)
        module, _, name = self.home.rpartition(".")
        return on_demand(f"service.cli.{module}:{name}")


@dataclass(frozen=True, slots=True)
class CommandGroup:
    """A command in the table that only has commands under it."""

    name: str
    summary: str
    entries: Sequence[CommandEntry]

    def command(self) -> LazyGroup:
        """Return it with its commands."""
        made = LazyGroup(name=self.name, help=self.summary, no_args_is_help=True, rich_markup_mode=None)
        made.add("Commands", self.entries)
        return made


class Deferred(TyperCommand):
    """Name and summary of a command whose module is not imported yet."""

    def __init__(self, entry: CommandEntry) -> None:
        super().__init__(entry.name, help=entry.summary, rich_markup_mode=None)
        self.entry = entry

    def load(self) -> Any:
        """Import the module and return the command with its arguments and options."""
        command = self.entry.function()
        if self.entry.keyed:
            from service.cli.options.parameters import keyed

            command = keyed(command)
        # Typer makes a plain command of an application that has a single one.
        alone = typer.Typer(add_completion=False, rich_markup_mode=None)
        alone.command(self.entry.name)(command)
        return typer.main.get_command(alone)


class DeferredGroup(Deferred):
    """Name and summary of a group whose class is not imported yet; its entry names the class."""

    def load(self) -> Any:
        """Import the module and return the group."""
        made = self.entry.function()
        return made(
            name=self.entry.name, help=self.entry.summary, no_args_is_help=True, rich_markup_mode=None
        )


class LazyGroup(TyperGroup):
    """A group whose commands are loaded when they are looked up to be run or completed."""

    def add(self, heading: str, entries: Iterable[CommandEntry | CommandGroup]) -> None:
        """Add commands, which help lists below a heading, in their order."""
        for entry in entries:
            self.add_command(entry.command())
            self.headings[entry.name] = heading

    @cached_property
    def headings(self) -> dict[str, str]:
        """The heading of each command; those of studies from outside have none."""
        return {}

    def format_commands(self, _ctx: Any, formatter: Any) -> None:
        """Write the commands below their headings."""
        widest = max(map(len, self.commands))
        rows = [
            (
                self.headings.get(name, "Further studies"),
                name,
                command.get_short_help_str(formatter.width - 6 - widest),
            )
            for name, command in self.commands.items()
        ]
        for heading, listed in groupby(rows, key=itemgetter(0)):
            with formatter.section(heading):
                formatter.write_dl([(name.ljust(widest), summary) for _, name, summary in listed])

    def get_params(self, ctx: Any) -> Any:
        """Return the options; flags that are not given are False: to look at None, Typer imports pydantic."""
        options = super().get_params(ctx)
        for option in options:
            if getattr(option, "is_flag", False) and option.default is None:
                option.default = False
        return options

    def resolve_command(self, ctx: Any, args: Any) -> Any:
        """Return the name of the command asked for, the command, loaded, and the arguments left."""
        name, command, rest = super().resolve_command(ctx, args)
        if isinstance(command, Deferred):
            command = command.load()
            self.add_command(command)
        return name, command, rest
