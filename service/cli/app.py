"""The commands put together, and the way from an error to an exit status."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from typing import Annotated

import typer

from service.cli.commands import campbell as campbell_command
from service.cli.commands import database as database_commands
from service.cli.commands import design as design_commands
from service.cli.commands import import_matrices as import_command
from service.cli.commands import jobs as submit_commands
from service.cli.commands import keys as key_commands
from service.cli.commands import mistuning as mistuning_command
from service.cli.commands import report as report_command
from service.cli.commands import schema as schema_command
from service.cli.commands import sensitivities as sensitivity_command
from service.cli.commands import service as service_commands
from service.cli.commands import solver as solver_commands
from service.cli.commands import submit_studies
from service.cli.commands import track as track_commands
from service.cli.failures import REPORTED, report
from service.cli.options.inputs import join_words
from service.cli.options.keyed import keyed

app = typer.Typer(
    name="stickslip",
    help="Design friction dampers: periodic responses, continuation, and the best normal load.",
    rich_markup_mode=None,
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)
_database = typer.Typer(help="Look after the database.", no_args_is_help=True, rich_markup_mode=None)
_keys = typer.Typer(help="Make and end keys to the service.", no_args_is_help=True, rich_markup_mode=None)
_submit = typer.Typer(help="Hand a job to a running service.", no_args_is_help=True, rich_markup_mode=None)

_ALONE: tuple[Callable[..., None], ...] = (
    solver_commands.scenes, solver_commands.plan, solver_commands.solve, solver_commands.sweep,
    solver_commands.accuracy, design_commands.design, design_commands.pareto,
    sensitivity_command.sensitivities, solver_commands.march, service_commands.demo, service_commands.serve,
    service_commands.worker, keyed(submit_commands.watch), keyed(submit_commands.results),
)  # fmt: skip
_SUBMITTED: tuple[Callable[..., None], ...] = (
    submit_commands.design, submit_commands.pareto, submit_commands.sweep, submit_commands.solve,
    submit_commands.march, submit_studies.peaks, submit_studies.accuracy,
    submit_studies.campbell, submit_studies.mistuning,
)  # fmt: skip

for _command in _ALONE:
    app.command()(_command)
app.command(name="peaks")(track_commands.peaks)
app.command(name="map")(track_commands.response_map)
app.command()(campbell_command.campbell)
app.command()(mistuning_command.mistuning)
for _command in _SUBMITTED:
    _submit.command()(keyed(_command))
_submit.command(name="map")(keyed(submit_studies.response_map))
_keys.command()(key_commands.create)
_keys.command(name="list")(key_commands.show)
_keys.command()(key_commands.rotate)
_keys.command()(key_commands.revoke)
_database.command()(service_commands.upgrade)
_database.command()(database_commands.backup)
_database.command()(database_commands.check)
_database.command()(database_commands.prune)
app.command()(schema_command.schema)
app.command()(report_command.report)
app.command("import")(import_command.import_scene)
app.add_typer(_submit, name="submit")
app.add_typer(_database, name="db")
app.add_typer(_keys, name="keys")


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(version("stickslip"))
        raise typer.Exit


@app.callback()
def _root(
    _version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_print_version, is_eager=True)
    ] = False,
) -> None: ...


@_database.callback()
def _database_root() -> None: ...


def run(arguments: Sequence[str] | None) -> int:
    """Run the command and return its exit status."""
    given = sys.argv[1:] if arguments is None else arguments
    try:
        app(args=join_words(given), prog_name="stickslip")
    except REPORTED as error:
        return report(error)
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else 0
    return 0
