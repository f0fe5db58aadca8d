"""The commands that look for values: a design problem by options, a file or both, or measurements."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from optim.problem.problem_keys import options as key_options
from service.cli.commands.client.job_commands import SUFFIXES, write
from service.cli.failures import refused
from service.cli.options import inputs, problem_inputs
from service.cli.options import parameters as options
from service.cli.options.problem_inputs import ProblemFlags, takes_problem
from service.cli.study_command import Keys, Outputs, give, watched
from service.jobs.common.problem_requests import ProblemRequest
from service.jobs.studies.design_study import Design
from service.jobs.studies.identify_study import Identify
from service.jobs.studies.pareto_study import Pareto
from solver.scene.descriptions import DISK_LOAD

if TYPE_CHECKING:
    from service.jobs.study import Answer
    from solver.scene.scene import Scene


Report = Annotated[
    str | None, typer.Option("--report", metavar="F", help="Write a design report: .html or .pdf.")
]


def command_of_problem(study: type[ProblemRequest]) -> Callable[..., None]:
    """Return the command of a study that poses a design problem."""

    def command(
        flags: ProblemFlags,
        name: options.AnyScene = None,
        without: options.Without = None,
        plot: options.Plot = None,
        out: options.Out = None,
        report: Report = None,
        as_json: options.Json = False,
    ) -> None:
        told = problem_inputs.description(name, flags, study.NAME)
        outputs = Outputs.asked(plot, out)
        page = inputs.output_path("--report", report, SUFFIXES)
        scene, given = problem_inputs.posed(told, study, without)
        with told.named(), watched(study) as watch:
            answer = study.compute(scene, given, watch)
        if page is not None:
            from service.rendering.report.sections import Designed

            write(Designed(scene=scene, problem=given, result=answer.json), page)
        give(study, answer, outputs, scene, as_json=as_json)

    command.__doc__ = study.__doc__
    return takes_problem(key_options(study))(command)


design, pareto = command_of_problem(Design), command_of_problem(Pareto)


Data = Annotated[
    list[str],
    typer.Argument(
        metavar="DATA...",
        help=f"Files of measurements (.csv, .parquet, .uff); FILE:{DISK_LOAD}=200,dof=tip gives conditions.",
    ),
]
Columns = Annotated[
    list[str] | None,
    typer.Option(
        "--column", metavar="HEAD=KEY:UNIT",
        help='What a column of a rig\'s export is, such as "Weg [µm]=amplitude:um"; repeatable. Then the '
        "others are left out, and any separator, decimal commas and lines above the headings are read.",
    ),
]  # fmt: skip
Uncertain = Annotated[
    str | None,
    typer.Option(
        "--uncertain", metavar="F",
        help="Write a problem file (.toml) for `design --problem F`: the scene with the estimates, uncertain "
        "as the data leave them.",
    ),
]  # fmt: skip


FitReport = Annotated[
    str | None,
    typer.Option(
        "--report", metavar="F",
        help="Write a report: .html or .pdf. The fit over the data, intervals, correlations, what is not "
        "told, what to measure next.",
    ),
]  # fmt: skip


def _identify(
    name: str,
    data: list[str],
    column: list[str] | None,
    values: list[str] | None,
    without: list[str] | None,
    plot: str | None,
    out: str | None,
    uncertain: str | None,
    report: str | None,
    as_json: bool,
    **given: Any,
) -> None:
    outputs = Outputs.asked(plot, out)
    problem = inputs.output_path("--uncertain", uncertain, (".toml",))
    told = inputs.output_path("--report", report, SUFFIXES)
    scene = inputs.scene(name, values, without)
    asked = {"data": data, **_KEYS.read(given, scene)}
    answer = computed(_KEYS, scene, asked, column)
    found: Any = answer.result
    if problem is not None and found.fitted:
        write_problem(problem, name, {**inputs.settings(values), **found.values}, found.uncertain)
    if told is not None:
        from service.rendering.report.sections import Designed

        harmonics = {"harmonics": asked.get("harmonics", Identify.model_fields["harmonics"].default)}
        write(Designed(scene=scene, problem=harmonics, result=answer.json), told)
    give(Identify, answer, outputs, scene, as_json=as_json)


def computed(keys: Keys, scene: Scene, asked: dict[str, Any], columns: list[str] | None) -> Answer:
    """Compute what is asked of files."""
    study = keys.study
    asked = study.completed(scene, asked)
    if wrong := study.model_construct(**asked).issues(scene):
        raise refused(wrong, keys.flags)
    with keys.named(), watched(study) as watch:
        if columns:
            from optim.identification.reading import with_columns

            asked = {**asked, "data": with_columns(scene, asked["data"], columns)}
        return study.compute(scene, asked, watch)


_KEYS = Keys.of(Identify, "data")
identify = _KEYS.command(
    _identify,
    {"data": Data},
    {"column": Columns, "uncertain": Uncertain, "report": FitReport},
    doc=Identify.__doc__,
)


def write_problem(file: Path, name: str, values: dict[str, float], uncertain: Any) -> None:
    """Write the scene with values as a design problem with what is left uncertain."""
    from solver.scene.toml import found_scene, toml_text

    there = Path(found_scene(name))
    scene = os.path.relpath(there.absolute(), file.absolute().parent) if there.is_file() else name
    head = (
        "Identified parameters, uncertain as the data leave them:",
        f"stickslip design --problem {file.name} --variable PATH LO HI",
    )
    body = {"scene": scene, "set": values, "uncertain": uncertain}
    file.write_text(toml_text(body, head), encoding="utf-8")
