"""`stickslip identify`: parameters of a scene from measured responses and loops."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli.commands.report import SUFFIXES, write
from service.cli.failures import refused
from service.cli.options import inputs
from service.cli.study_command import Keys, Outputs, give, watched
from service.jobs.studies.identify_study import Identify
from solver.scene.descriptions import DISK_LOAD

if TYPE_CHECKING:
    from service.jobs.study import Answer
    from solver.scene.scene import Scene

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


Report = Annotated[
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
    scene = inputs.scene(name, values)
    asked = {"data": data, **_KEYS.read(given)}
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
    {"column": Columns, "uncertain": Uncertain, "report": Report},
    doc=Identify.__doc__,
)


def write_problem(file: Path, name: str, values: dict[str, float], uncertain: Any) -> None:
    """Write the scene with values as a design problem with what is left uncertain."""
    from solver.scene.toml import toml_text

    there = Path(name)
    scene = os.path.relpath(there.absolute(), file.absolute().parent) if there.is_file() else name
    head = (
        "Identified parameters, uncertain as the data leave them:",
        f"stickslip design --problem {file.name} --variable PATH LO HI",
    )
    body = {"scene": scene, "set": values, "uncertain": uncertain}
    file.write_text(toml_text(body, head), encoding="utf-8")
