"""The command of a study: its options are its keys; it computes here, and writes files beside that."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import typer
from typer.core import TyperGroup

from service.cli.failures import end, refused
from service.cli.options import inputs
from service.cli.options import parameters as options
from service.cli.options.inputs import output_path
from service.cli.options.key_options import KeyOption, key_options
from service.cli.options.parameters import keyword, with_parameters
from service.cli.progress import bar
from service.errors import InputError
from service.jobs.study import Answer, Study, Watch, Writable
from service.rendering.text import print_json, print_told, told
from solver.errors import SettingError
from solver.first_use import on_demand
from solver.jit.compiler_process import cost, prepare
from solver.results.watch import stopped_by_interrupt

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from solver.scene.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True)
class Outputs:
    """Where a picture and the numbers go, if anywhere."""

    picture: Path | None
    file: Path | None

    @classmethod
    def asked(cls, plot: str | None, out: str | None) -> Self:
        """Check both options before the work begins.

        InputError for a suffix that has no writer, or a folder that is not there.
        """
        if plot is None and out is None:
            return cls(picture=None, file=None)
        from solver.views.io import SUFFIXES as FILES
        from solver.views.plots import SUFFIXES as PICTURES

        return cls(picture=output_path("--plot", plot, PICTURES), file=output_path("--out", out, FILES))

    def write(
        self, result: Writable, draw: Callable[[], Figure] | None, *, scene: Scene | None = None
    ) -> None:  # fmt: skip
        """Write what was asked for.

        Parameters
        ----------
        result : what was computed.
        draw : makes its picture; None where there is nothing to draw.
        scene : of a result that does not know its own.
        """
        if self.picture is None and self.file is None:
            return
        from dataclasses import replace

        from solver.views.io import save, scene_attributes

        data = result.to_dataset()
        if scene is not None and "scene" not in data.attributes:
            data = replace(data, attributes={**data.attributes, **scene_attributes(scene)})
        if self.picture is not None and draw is not None:
            from solver.views.plots import html

            html.save(draw(), self.picture, data)
        if self.file is not None:
            save(data, self.file)


def add_others(group: TyperGroup) -> None:
    """Add the commands of the studies that the setting `kinds` names."""
    from service.jobs.common.problem_requests import ProblemRequest
    from service.jobs.kinds import studies
    from service.settings.kinds import registry_here

    for name, study in studies(registry_here()).items():
        if name in group.commands:
            continue
        made = command_of
        if issubclass(study, ProblemRequest):
            made = on_demand("service.cli.commands.design_commands:command_of_problem")
        alone = typer.Typer(add_completion=False, rich_markup_mode=None)
        alone.command(name)(made(study))
        group.add_command(typer.main.get_command(alone))


@dataclass(frozen=True, slots=True)
class Keys:
    """The keys of a study as options of a command."""

    study: type[Study]
    made: Mapping[str, KeyOption]
    flags: Mapping[str, str]

    @classmethod
    def of(cls, study: type[Study], *but: str) -> Keys:
        """Return them, without some that the command takes otherwise."""
        options_ = {one.name: one for one in key_options(study.as_kind(), None, free=True)}
        made = {name: options_[name] for name in study.own_keys() if name not in but}
        flags = {word: one.flag for name, one in made.items() for word in (name, one.key)}
        return cls(study, made, {**flags, "path": flags.get("parameter", "--set")})

    def read(self, given: Mapping[str, Any], scene: Scene) -> dict[str, Any]:
        """Return the keys that were given, numbers of parameters in the units of a scene."""
        read = {name: one.in_body(given[one.parameter.name]) for name, one in self.made.items()}
        with self.named():
            return {
                name: inputs.in_units(value, scene, (name,))
                for name, value in read.items()
                if value is not None
            }

    @contextmanager
    def named(self) -> Iterator[None]:
        """Name options in what is refused inside."""
        try:
            yield
        except SettingError as error:
            raise refused([error.issue], self.flags) from error

    def command(
        self, function: Callable[..., None], before: Mapping[str, Any], behind: Mapping[str, Any], *,
        doc: str | None,
    ) -> Callable[..., None]:  # fmt: skip
        """Return a function as a command: scene, what comes `before`, keys, what comes `behind`."""
        drawn = {"plot": options.Plot} if self.study.drawn() else {}
        listed = [
            keyword("name", options.Scene),
            *(keyword(name, annotation) for name, annotation in before.items()),
            *(one.parameter for one in self.made.values()),
            keyword("values", options.Values, None),
            keyword("without", options.Without, None),
            *(keyword(name, one, None) for name, one in {**behind, **drawn, "out": options.Out}.items()),
            keyword("as_json", options.Json, False),
        ]

        def command(**given: Any) -> None:
            function(**given)

        command.__doc__ = doc
        return with_parameters(command, listed)


@contextmanager
def watched(study: type[Study]) -> Iterator[Watch]:
    """Who watches a study that computes here: a bar, and Ctrl-C, which ends it with what it has so far."""
    with bar(study.NAME, study.COUNTED) as on_progress, stopped_by_interrupt() as should_stop:
        yield Watch(on_progress, should_stop)


def command_of(study: type[Study]) -> Callable[..., None]:
    """Return the command of a study, with an option for each key."""
    keys = Keys.of(study)

    def compute(
        name: str, values: list[str] | None, without: list[str] | None, out: str | None, as_json: bool,
        plot: str | None = None, **given: Any,
    ) -> None:  # fmt: skip
        outputs = Outputs.asked(plot, out)
        scene = inputs.scene(name, values, without)
        asked = study.completed(scene, keys.read(given, scene))
        prepare(lambda: cost(study.NAME, scene, asked))
        if wrong := study.model_construct(**asked).issues(scene):
            raise refused(wrong, keys.flags)
        with keys.named(), watched(study) as watch:
            answer = study.compute(scene, asked, watch)
        give(study, answer, outputs, scene, as_json=as_json)

    return keys.command(compute, {}, {}, doc=study.__doc__)


def give(study: type[Study], answer: Answer, outputs: Outputs, scene: Scene, *, as_json: bool) -> None:
    """Write and print what was found; status 1 if the goal was not reached."""
    if answer.result is not None:
        draw = answer.plot if study.drawn() and not study.empty(answer.json) else None
        outputs.write(answer.result, draw, scene=scene)
    elif answer.reached and outputs.file is not None:
        raise InputError(f"`--out`: what `{study.NAME}` finds is no table, take --json")
    if as_json:
        print_json(answer.json)
    else:
        print_told(told(study.NAME, answer.json, study.tell()))
    end(answer.reached, answer.status)
