"""Every command, as help lists them; a further one is a function and a line here.

They are imported when they are called: `stickslip --help` reads the table, and nothing else.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from operator import itemgetter
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from service.cli.failures import REPORTED, report
from service.cli.options.inputs import join_words
from service.jobs.names import home_of
from solver.first_use import on_demand
from solver.lab import LAB, is_there

STUDY = "study"


@dataclass(frozen=True, slots=True)
class CommandEntry:
    """A command in the table."""

    name: Annotated[str, "As the user writes it."]
    home: Annotated[
        str,
        'Module of `service.cli` and function, ``"commands.scene_commands.scenes"``, or the whole name of '
        "one in the lab; `STUDY` for that of a study.",
    ]
    summary: Annotated[str, "The first line of the function's docstring, which `--help` shows."]
    keyed: Annotated[bool, "It talks to a service, and takes ``--url`` and ``--key-file``."] = False
    group: Annotated[bool, "What stands there is the class of a group, not a function."] = False

    def command(self) -> Deferred:
        """Return it as help lists it."""
        return (DeferredGroup if self.group else Deferred)(self)

    def function(self) -> Any:
        """Import the module and return what stands there."""
        if self.home == STUDY:
            from service.cli.study_command import command_of
            from service.jobs.study import study_named

            return command_of(study_named(self.name))
        module, _, name = self.home.rpartition(".")
        return on_demand(f"{module if module.startswith(LAB) else f'service.cli.{module}'}:{name}")

    def is_there(self) -> bool:
        """Whether the folder of the lab it stands in is there, if it stands in one."""
        return is_there(home_of(self.name) if self.home == STUDY else self.home)


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
            if isinstance(entry, CommandEntry) and not entry.is_there():
                continue
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


_RUNS = "commands.client.run_commands"
DATABASE = (
    CommandEntry("upgrade", "commands.service.upgrade", "Bring a database to this version's revision."),
    CommandEntry(
        "backup", "commands.service.backup", "Copy a database to a file, also while a service uses it."
    ),
    CommandEntry(
        "check", "commands.service.check", "Read a database from end to end and say what is wrong with it."
    ),
    CommandEntry(
        "prune", "commands.service.prune", "Delete old jobs with their results and sweeps, and old uploads."
    ),
)  # fmt: skip

KEYS = (
    CommandEntry("create", "commands.service.create", "Make a key and print it, this once."),
    CommandEntry(
        "list", "commands.service.show",
        "List the keys, also those that work no more. What opens the door is not kept, and not shown.",
    ),
    CommandEntry(
        "rotate", "commands.service.rotate",
        "Give a key another secret and print it, this once; the old one ends within a second.",
    ),
    CommandEntry("revoke", "commands.service.revoke", "End a key, within a second in every service."),
)  # fmt: skip

RUNS = (
    CommandEntry("list", f"{_RUNS}.show", "List the runs, newest first.", keyed=True),
    CommandEntry("change", f"{_RUNS}.change", "Change project, name, notes or tags of a run.", keyed=True),
    CommandEntry("delete", f"{_RUNS}.delete", "Put a run in the bin.", keyed=True),
    CommandEntry("restore", f"{_RUNS}.restore", "Take a run out of the bin.", keyed=True),
    CommandEntry("compare", f"{_RUNS}.compare", "Say what differs between two runs.", keyed=True),
    CommandEntry("share", f"{_RUNS}.share", "Make a link to a run that needs no key.", keyed=True),
)

PROJECTS = (
    CommandEntry("list", f"{_RUNS}.show_projects", "List the projects, newest first.", keyed=True),
    CommandEntry("create", f"{_RUNS}.create_project", "Make a project and print its id.", keyed=True),
    CommandEntry("change", f"{_RUNS}.change_project", "Change name or notes of a project.", keyed=True),
    CommandEntry("delete", f"{_RUNS}.delete_project", "Put a project in the bin; its runs stay.", keyed=True),
    CommandEntry("restore", f"{_RUNS}.restore_project", "Take a project out of the bin.", keyed=True),
)

COMMANDS = {
    "Start here": (
        CommandEntry(
            "new", "stickslip.lab.templates.commands.new",
            "Write a commented scene to begin with: a template, or a copy of a shipped scene.",
        ),
        CommandEntry("sweep", STUDY, "Follow the response over a parameter."),
        CommandEntry("design", "commands.design_commands.design", "Find the best damper."),
        CommandEntry(
            "serve", "commands.service.serve", "Serve the page and the REST API, and work off its queue."
        ),
    ),
    "Compute": (
        CommandEntry("plan", STUDY, "Say which effects a scene calls for, and why."),
        CommandEntry("solve", STUDY, "Compute one periodic response, or look for all of them."),
        CommandEntry(
            "map", STUDY, "Map the response over frequency and a parameter, with the ridge of its peaks."
        ),
        CommandEntry("march", STUDY, "March in time until the motion repeats."),
        CommandEntry("transient", STUDY, "Run through a range of frequencies in time."),
        CommandEntry("quasi-periodic", STUDY, "Find the response to two frequencies that are no multiples."),
        CommandEntry(
            "wear", STUDY,
            "Follow what friction wears off the contacts over hours, and the response meanwhile.",
        ),
        CommandEntry("accuracy", STUDY, "Measure what accuracy costs."),
        CommandEntry(
            "sensitivities", STUDY,
            "Say what matters: per cent of the peaks and the band for one per cent of each parameter.",
        ),
        CommandEntry("peaks", STUDY, "Track the highest peak over a parameter."),
    ),
    "Design": (
        CommandEntry(
            "pareto", "commands.design_commands.pareto", "Find the front of peak against resonance band."
        ),
        CommandEntry(
            "margin", STUDY,
            "Draw the stress over the excitation for several dampers, and the excitation each allows.",
        ),
        CommandEntry(
            "identify", "commands.design_commands.identify",
            "Find parameters from measured responses and hysteresis loops.",
        ),
        CommandEntry(
            "posterior", "stickslip.lab.posterior.commands.posterior",
            "Sample what is known of parameters after measurements.",
        ),
    ),
    "Disks and modes": (
        CommandEntry(
            "campbell", STUDY, "Find the speeds at which orders of the running speed meet resonances."
        ),
        CommandEntry(
            "interference", STUDY,
            "Draw natural frequencies over the nodal diameter, with the engine orders that meet them.",
        ),
        CommandEntry("mistuning", STUDY, "Study disks whose blades are not quite equal."),
        CommandEntry("worst-mistuning", STUDY, "Find the worst mistuning of a disk within bounds."),
        CommandEntry("modes", STUDY, "Follow a mode's frequency and damping over its amplitude."),
        CommandEntry(
            "controlled", STUDY,
            "Follow the response over the frequency with one amplitude held, as rigs do.",
        ),
    ),
    "Scenes and files": (
        CommandEntry("scenes", "commands.scene_commands.scenes", "List the shipped scenes."),
        CommandEntry(
            "import", "commands.import_matrices.import_scene", "Make a scene of matrices or modes in files.",
        ),
        CommandEntry(
            "export", "stickslip.lab.exports.commands.export",
            "Write a scene for other programs: equations for MATLAB, a unit for co-simulation (FMI 2.0).",
        ),
        CommandEntry(
            "schema", "commands.scene_commands.schema",
            "Print the JSON Schema of scene files, design problems or jobs, for editors.",
        ),
        CommandEntry(
            "report", "commands.client.job_commands.report",
            "Write the report of a design or an identification that the service computed.", keyed=True,
        ),
        CommandEntry(
            "check-proof", "stickslip.lab.proofs.commands.check_proof",
            "Check the proofs in a file that `solve`, `peaks`, `design` or `modes --certify --json` wrote.",
        ),
        CommandEntry(
            "demo", "stickslip.lab.demo.commands.demo", "Run the main job end to end, with pictures."
        ),
    ),
    "Service": (
        CommandEntry("worker", "commands.service.worker", "Work off a queue without HTTP."),
        CommandEntry(
            "submit", "commands.client.submit.SubmitGroup", "Hand a job to a running service.", group=True
        ),
        CommandEntry(
            "watch", "commands.client.job_commands.watch", "Follow a job until it has ended.", keyed=True
        ),
        CommandEntry(
            "results", "commands.client.job_commands.results",
            "Print what a job computed, or list the stored designs.", keyed=True,
        ),
        CommandEntry(
            "mcp", "stickslip.lab.mcp.commands.mcp", "Let a language model use a running service.", keyed=True
        ),
        CommandGroup("runs", "Name, find, compare and delete runs of a service.", RUNS),
        CommandGroup("projects", "Gather runs in projects.", PROJECTS),
        CommandGroup("db", "Look after the database.", DATABASE),
        CommandGroup("keys", "Make and end keys to the service.", KEYS),
    ),
}  # fmt: skip

TOP = {entry.name: entry for entries in COMMANDS.values() for entry in entries}


_app = typer.Typer(
    cls=LazyGroup,
    name="stickslip",
    help="Design friction dampers: periodic responses, continuation, and the best normal load.",
    rich_markup_mode=None,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(version("stickslip"))
        raise typer.Exit


@_app.callback()
def _root(
    _version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_print_version, is_eager=True)
    ] = False,
) -> None: ...


def command(asked: str = "") -> LazyGroup:
    """Return `stickslip` with every command under it, each imported when it is used.

    `asked`: the command that is used: what is no command of the package may be a study of another one.
    """
    root = typer.main.get_command(_app)
    if not isinstance(root, LazyGroup):
        raise TypeError(f"typer made {type(root).__name__} of the application")
    for heading, entries in COMMANDS.items():
        root.add(heading, entries)
    if os.environ.get("STICKSLIP_KINDS") and asked not in root.commands:
        from service.cli.study_command import add_others

        add_others(root)
    return root


def run(arguments: Sequence[str] | None) -> int:
    """Run the command and return its exit status."""
    given = sys.argv[1:] if arguments is None else arguments
    # The commands have bars of their own, and what a service computes is watched elsewhere.
    os.environ.setdefault("STICKSLIP_PROGRESS", "0")
    try:
        command(given[0] if given else "")(args=join_words(given), prog_name="stickslip")
    except REPORTED as error:
        return report(error)
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else 0
    return 0
