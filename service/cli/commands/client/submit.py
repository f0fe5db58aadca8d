"""`stickslip submit KIND` for every kind there is: options of its local command, and of its other keys."""

from __future__ import annotations

import json
from collections.abc import Container, Sequence
from typing import TYPE_CHECKING, Any

import typer
from typer.core import TyperCommand, TyperGroup

from optim.problem.problem_keys import options as key_options_of
from service.cli.commands.client.job_commands import hand_in, scene_of
from service.cli.options import inputs, problem_inputs
from service.cli.options import parameters as options
from service.cli.options.key_options import SCENE, KeyOption, key_options, options_of
from service.cli.options.parameters import Command, keyed, keyword, with_parameters
from service.cli.options.problem_inputs import FLAGS, ProblemFlags, takes_problem
from service.cli.table import TOP, CommandEntry
from service.errors import InputError
from service.jobs.kind_registry import ABOUT_THE_JOB, JobKind
from service.settings.kinds import registry_here

if TYPE_CHECKING:
    import inspect

    from service.client.client import Client
    from service.jobs.common.problem_requests import ProblemRequest


class SubmitGroup(TyperGroup):
    """The group `submit`: a command for every kind of job there is, made when it is asked for."""

    def list_commands(self, ctx: Any) -> list[str]:
        """The names of the kinds."""
        self._fill()
        return super().list_commands(ctx)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Name and summary of a kind; None if there is none of this name."""
        self._fill()
        return super().get_command(ctx, cmd_name)

    def resolve_command(self, ctx: Any, args: Any) -> Any:
        """The name of the kind asked for, its command, and the arguments left."""
        name, _, rest = super().resolve_command(ctx, args)
        if name is None:
            return name, None, rest
        return name, command_of(registry_here()[name]), rest

    def _fill(self) -> None:
        if not self.commands:
            for kind in registry_here():
                self.add_command(TyperCommand(kind.name, help=kind.summary, rich_markup_mode=None))


_DATA, _COLUMN = "key_data", "--column"


def command_of(kind: JobKind) -> Any:
    """The command that submits a job of a kind."""
    alone = typer.Typer(add_completion=False, rich_markup_mode=None)
    entry = TOP.get(kind.name)  # computes here what the kind computes on a service, if there is one
    take = keyed(submission(kind, entry.function() if isinstance(entry, CommandEntry) else None))
    alone.command(kind.name, help=f"{kind.summary}\n\nSubmitted as a job.")(take)
    return typer.main.get_command(alone)


def submission(kind: JobKind, local: Command | None) -> Command:
    """The function of a command that submits a job of a kind.

    Parameters
    ----------
    kind : what is submitted.
    local : the command that computes the same here; its options are reused.
    """
    from service.jobs.common.problem_requests import ProblemRequest

    made = key_options(kind, local)
    if issubclass(kind.request, ProblemRequest):
        known = None if local is None else options_of(local)
        own = [one for one in made if _beside_a_problem(one, ProblemRequest.model_fields, known)]
        return _of_a_problem(kind, kind.request, own)

    columns = None if local is None else options_of(local).get(_COLUMN)

    def submit(
        client: Client, name: str | None = None, wait: bool = False, as_json: bool = False,
        column: list[str] | None = None, **given: Any,
    ) -> None:  # fmt: skip
        if columns is not None:
            given[_DATA] = _tables(str(name), given[_DATA], column)
        body = {one.key: one.in_body(given[one.parameter.name]) for one in made}
        scene = {} if name is None else {SCENE: scene_of(name)}
        told = {key: value for key, value in body.items() if value is not None}
        hand_in(client, {"kind": kind.name, **scene, **told}, wait=wait, as_json=as_json)

    about_scene = [keyword("name", options.Scene)] if SCENE in kind.request.model_fields else []
    of_data = [] if columns is None else [columns]
    return _with_options(submit, [*about_scene, *(one.parameter for one in made), *of_data])


def _tables(name: str, data: str, columns: Sequence[str] | None) -> str:
    """Return what stands behind `--data` as JSON: it may be a file of measurements."""
    if data.lstrip().startswith(("[", "{")):
        if columns:
            raise InputError(f"`{_COLUMN}` is for a file: `--data` has its columns in JSON here")
        return data
    from optim.identification.reading import job_tables

    return json.dumps(job_tables(inputs.scene(name, None), [data], columns or ()))


def _beside_a_problem(option: KeyOption, of_problems: Container[str], known: Container[str] | None) -> bool:
    """Whether an option stands beside those of every problem; further keys are for the problem file."""
    if option.key in ABOUT_THE_JOB:
        return True
    return option.key not in of_problems and (known is None or option.flag in known)


def _of_a_problem(kind: JobKind, model: type[ProblemRequest], own: Sequence[KeyOption]) -> Command:
    """As `submission`, of a design problem: described by options, by a file, or by both."""
    keys = key_options_of(kind.request)
    taken = {"--set", *(one.flag for one in keys.values())}
    beside = [one for one in own if one.flag not in taken]

    def submit(
        client: Client, flags: ProblemFlags, name: str | None = None, wait: bool = False,
        as_json: bool = False, **given: Any,
    ) -> None:  # fmt: skip
        further = {one.key: (one.flag, one.in_body(given[one.parameter.name])) for one in beside}
        told = problem_inputs.description(name, flags, kind.name, **further)
        problem_inputs.checked(told, model)
        body = {"kind": kind.name, **problem_inputs.body_to_submit(told)}
        hand_in(client, body, wait=wait, as_json=as_json)

    parameters = [
        keyword(FLAGS, ProblemFlags),
        keyword("name", options.AnyScene, None),
        *(one.parameter for one in beside),
    ]
    return takes_problem(keys)(_with_options(submit, parameters))


def _with_options(command: Command, parameters: Sequence[inspect.Parameter]) -> Command:
    """The command with these parameters, and those that every submission has."""
    ending = [keyword("wait", options.Wait, False), keyword("as_json", options.Json, False)]
    return with_parameters(command, [*parameters, *ending])
