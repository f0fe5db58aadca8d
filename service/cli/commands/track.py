"""`stickslip map`: the response over frequency and a parameter."""

from __future__ import annotations

from typing import Annotated

import typer

from service.cli import completion
from service.cli.failures import end
from service.cli.options import inputs
from service.cli.options import shared as options
from service.cli.options.numeric import amount, count
from service.cli.output_files import Outputs
from service.cli.progress import bar
from service.rendering.tables import track as track_reports
from service.rendering.tables.text import show
from solver.scene.examples import DISK_LOAD

Followed = Annotated[
    str,
    typer.Option(
        "--parameter", metavar="PATH", help=f"What changes, for example {DISK_LOAD}.",
        autocompletion=completion.paths,
    ),
]  # fmt: skip
Start = Annotated[float, amount("--from", "A", "Start of the range.")]
Stop = Annotated[float, amount("--to", "B", "End of the range.")]
Steps = Annotated[int, count("--steps", "N", "Values of the parameter.")]
Frequencies = Annotated[int, count("--frequencies", "N", "Frequencies over the band.")]

NoRidge = Annotated[
    bool, typer.Option("--no-ridge", help="Do not track the peaks: faster, and for contacts of every law.")
]


def response_map(
    name: options.Scene,
    parameter: Followed,
    start: Start,
    stop: Stop,
    steps: Steps = 60,
    frequencies: Frequencies = 400,
    values: options.Values = None,
    harmonics: options.Harmonics = 11,
    no_ridge: NoRidge = False,
    plot: options.Plot = None,
    out: options.Out = None,
    as_json: options.Json = False,
) -> None:
    """Map the response over frequency and a parameter, with the ridge of its peaks."""
    import numpy as np

    import solver

    outputs = Outputs.asked(plot, out)
    scene = inputs.scene(name, values)
    with inputs.path_of("--parameter"), bar("map") as on_progress:
        found = solver.response_map(
            scene, parameter, start, stop, steps=steps, frequencies=frequencies, harmonics=harmonics,
            ridge=not no_ridge, on_progress=on_progress,
        )  # fmt: skip
    outputs.write(found, found.plot if np.isfinite(found.amplitude).any() else None)
    show(found.to_json(), track_reports.response_map, as_json=as_json)
    end(found.completed, found.status.value)
