"""`stickslip identify`: parameters of a scene from measured responses and hysteresis loops."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.commands.report import SUFFIXES, write
from service.cli.failures import end
from service.cli.options import inputs
from service.cli.options import shared as options
from service.cli.options.numeric import amount, count
from service.cli.output_files import Outputs
from service.cli.progress import bar
from service.rendering.tables import identify as tables
from service.rendering.tables.text import show
from solver.scene.descriptions import DISK_LOAD

if TYPE_CHECKING:
    from optim import Identification

Data = Annotated[
    list[str],
    typer.Argument(
        metavar="DATA...",
        help=f"Files of measurements (.csv, .parquet, .uff); FILE:{DISK_LOAD}=200,dof=tip gives conditions.",
    ),
]
Unknown = Annotated[
    list[str],
    typer.Option(
        "--unknown", metavar="PATH LO HI", help="A parameter looked for and its bounds; repeatable."
    ),
]
Priors = Annotated[
    list[str] | None,
    typer.Option(
        "--prior", metavar="PATH MEAN SD", help="What was known of an unknown before the data; repeatable."
    ),
]
Scaling = Annotated[
    list[str] | None,
    typer.Option(
        "--scaling", metavar="PATH=HOW", help="Scale an unknown linear or logarithmic; by its bounds."
    ),
]
NoiseLevel = Annotated[
    float | None,
    amount("--noise", "R", "Noise relative to the amplitude, 0.02 for 2 %; found from the data if left out."),
]
Robust = Annotated[bool, typer.Option("--robust", help="Let outliers weigh less (Huber).")]
Candidates = Annotated[
    list[str] | None,
    typer.Option(
        "--candidate", metavar="PATH=V,V,…",
        help="Values a condition could have in the next measurement; repeatable, all combinations count.",
    ),
]  # fmt: skip
Starts = Annotated[int, count("--starts", "N", "Places within the bounds that are tried.")]
Seed = Annotated[int, count("--seed", "N", "Of those places.")]
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


def identify(
    name: options.Scene,
    data: Data,
    unknown: Unknown,
    prior: Priors = None,
    scaling: Scaling = None,
    values: options.Values = None,
    noise: NoiseLevel = None,
    robust: Robust = False,
    candidate: Candidates = None,
    harmonics: options.Harmonics = 11,
    starts: Starts = 16,
    seed: Seed = 0,
    uncertain: Uncertain = None,
    report: Report = None,
    plot: options.Plot = None,
    out: options.Out = None,
    as_json: options.Json = False,
) -> None:
    """Find parameters from measured responses and hysteresis loops.

    Least squares over whole responses, from many starts: estimates with 95 % intervals, what the data do not
    tell, and which measurement would tell most.
    """
    outputs = Outputs.asked(plot, out)
    problem = inputs.output_path("--uncertain", uncertain, (".toml",))
    told = inputs.output_path("--report", report, SUFFIXES)
    scene = inputs.scene(name, values)
    bounds = inputs.bounds("--unknown", unknown)
    known = inputs.bounds("--prior", prior or (), "MEAN SD")
    import optim

    with bar("identify", "places") as on_progress:
        found = optim.identify(
            scene, data, bounds, scaling=inputs.words_by_path("--scaling", scaling or ()), priors=known,
            noise=noise, robust=robust,
            candidates=inputs.lists_by_path("--candidate", candidate) if candidate else None,
            harmonics=harmonics, starts=starts, seed=seed, on_progress=on_progress,
        )  # fmt: skip
    outputs.write(found, found.plot if found.fitted else None)
    if problem is not None and found.fitted:
        _write(problem, name, inputs.settings(values), found)
    if told is not None:
        from service.rendering.report.sections import Designed

        write(Designed(scene=scene, problem={"harmonics": harmonics}, result=found.to_json()), told)
    show(found.to_json(), tables.report, as_json=as_json)
    end(found.reached, found.status.value)


def _write(file: Path, name: str, given: dict[str, float], found: Identification) -> None:
    """Write the scene with its estimates as a design problem with what is left uncertain."""
    from solver.scene.toml import toml_text

    there = Path(name)
    scene = os.path.relpath(there.absolute(), file.absolute().parent) if there.is_file() else name
    head = (
        "Identified parameters, uncertain as the data leave them:",
        f"stickslip design --problem {file.name} --variable PATH LO HI",
    )
    body = {"scene": scene, "set": {**given, **found.values}, "uncertain": found.uncertain}
    file.write_text(toml_text(body, head), encoding="utf-8")
