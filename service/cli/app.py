"""The commands put together, and the way from an error to an exit status."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from typing import Annotated

import typer

from service.cli.failures import REPORTED, report
from service.cli.options.inputs import join_words
from service.cli.table import COMMANDS, LazyGroup

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

    Parameters
    ----------
    asked : the command that is used: what is no command of the package may be a study of another one.
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
