"""`stickslip mistuning`: the blades of many disks that are not quite equal, against the tuned disk."""

from __future__ import annotations

from typing import Annotated

import typer

from service.cli.failures import end
from service.cli.options import inputs
from service.cli.options import shared as options
from service.cli.options.numeric import amount, count
from service.cli.output_files import Outputs
from service.cli.progress import bar
from service.rendering.tables import mistuning as tables
from service.rendering.tables.text import show

Parts = Annotated[
    list[str],
    typer.Option(
        "--of", metavar="NAME",
        help="What has factors, repeatable: springs, dashpots and masses by name, or DOFs.",
    ),
]  # fmt: skip
Spread = Annotated[float, amount("--spread", "S", "Standard deviation of the factors.")]
Samples = Annotated[int, count("--samples", "N", "How many disks.")]
Seed = Annotated[
    int,
    count("--seed", "N", "Of the first disk; those of the others follow."),
]
Dof = Annotated[
    str | None,
    typer.Option("--dof", metavar="DOF", help="DOF of one sector; the observed one if left out."),
]


def mistuning(
    name: options.Scene,
    of: Parts,
    spread: Spread = 0.02,
    samples: Samples = 100,
    seed: Seed = 1,
    dof: Dof = None,
    start: options.From = None,
    stop: options.To = None,
    values: options.Values = None,
    harmonics: options.Harmonics = 11,
    plot: options.Plot = None,
    out: options.Out = None,
    as_json: options.Json = False,
) -> None:
    """Study disks whose blades are not quite equal.

    Of each disk the highest peak of every blade, and how much higher it is than that of the tuned disk.
    """
    import solver

    outputs = Outputs.asked(plot, out)
    scene = inputs.scene(name, values)
    with bar("mistuning", "disks") as on_progress:
        study = solver.mistuning_study(
            scene, of=of, spread=spread, samples=samples, seed=seed, dof=dof, start=start, stop=stop,
            harmonics=harmonics, on_progress=on_progress,
        )  # fmt: skip
    outputs.write(study, study.plot if study.worst is not None else None, scene=scene)
    show(study.to_json(), tables.report, as_json=as_json)
    end(study.completed, study.status.value)
