"""The command of a study: its options are its keys, and it computes here."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Any

import typer
from typer.core import TyperGroup

from optim.errors import DesignError
from service.cli.failures import end
from service.cli.options import inputs
from service.cli.options import shared as options
from service.cli.options.key_options import as_options, key_options
from service.cli.output_files import Outputs
from service.cli.progress import bar
from service.errors import InputError, InvalidRequestError
from service.jobs.study import Answer, Study, Watch
from service.rendering.plain import print_result
from service.rendering.tables.text import show
from solver.errors import Issue, SettingError

if TYPE_CHECKING:
    from solver.scene.scene import Scene


def command_named(name: str) -> Callable[..., None]:
    """Return the command of a study that comes with the service."""
    study: type[Study] = import_module(f"service.jobs.studies.{name}").STUDY
    return command_of(study)


def add_others(group: TyperGroup) -> None:
    """Add the commands of the studies that the setting `kinds` names."""
    from service.settings.kinds import registry_here

    for kind in registry_here():
        if issubclass(kind.request, Study) and kind.name not in group.commands:
            alone = typer.Typer(add_completion=False, rich_markup_mode=None)
            alone.command(kind.name)(command_of(kind.request))
            group.add_command(typer.main.get_command(alone))


def command_of(study: type[Study]) -> Callable[..., None]:
    """Return the command of a study, with an option for each key."""
    own = study.own_keys()
    made = {one.name: one for one in key_options(study.as_kind(), None)}
    flags = {word: made[name].flag for name in own for word in (name, made[name].key)}
    flags["path"] = flags.get("parameter", "--set")

    def command(
        name: str, values: list[str] | None, out: str | None, as_json: bool, plot: str | None = None,
        **given: Any,
    ) -> None:  # fmt: skip
        outputs = Outputs.asked(plot, out)
        scene = inputs.scene(name, values)
        read = {key: made[key].in_body(given[made[key].parameter.name]) for key in own}
        asked = {key: value for key, value in read.items() if value is not None}
        wrong = [as_options(one.message, flags) for one in study.model_construct(**asked).issues(scene)]
        if wrong:
            raise InvalidRequestError([Issue(pointer="", message=one) for one in wrong])
        try:
            with bar(study.NAME, study.COUNTED) as on_progress:
                answer = study.compute(scene, asked, Watch(on_progress))
        except (SettingError, DesignError) as error:
            raise InputError(as_options(str(error), flags)) from error
        give(study, answer, outputs, scene, as_json=as_json)

    listed = [
        _keyword("name", options.Scene), *(made[key].parameter for key in own),
        _keyword("values", options.Values, None),
        *([_keyword("plot", options.Plot, None)] if study.drawn() else []),
        _keyword("out", options.Out, None), _keyword("as_json", options.Json, False),
    ]  # fmt: skip
    command.__doc__ = study.__doc__
    command.__signature__ = inspect.Signature(listed)  # type: ignore[attr-defined]
    command.__annotations__ = {one.name: one.annotation for one in listed}
    return command


def give(study: type[Study], answer: Answer, outputs: Outputs, scene: Scene, *, as_json: bool) -> None:
    """Write and print what was found; status 1 if the goal was not reached."""
    if answer.result is not None:
        draw = answer.plot if study.drawn() and not study.empty(answer.json) else None
        outputs.write(answer.result, draw, scene=scene)
    elif answer.reached and outputs.file is not None:
        raise InputError(f"`--out`: what `{study.NAME}` finds is no table, take --json")
    show(answer.json, partial(print_result, study.NAME), as_json=as_json)
    end(answer.reached, answer.status)


def _keyword(name: str, annotation: Any, default: Any = inspect.Parameter.empty) -> inspect.Parameter:
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)
