"""The commands over a parameter and the frequency at once: peaks and map."""

from __future__ import annotations

from typing import Annotated

import typer

from service.cli import completion
from service.cli.failures import end
from service.cli.options import inputs
from service.cli.options import shared as options
from service.cli.options.inputs import number, whole_number
from service.cli.output_files import Outputs
from service.cli.progress import bar
from service.rendering.tables import track as track_reports
from service.rendering.tables.text import show

Followed = Annotated[
    str,
    typer.Option(
        "--parameter", metavar="PATH", help="What changes, for example shroud.N0.",
        autocompletion=completion.paths,
    ),
]  # fmt: skip
Start = Annotated[float, typer.Option("--from", metavar="A", parser=number, help="Start of the range.")]
Stop = Annotated[float, typer.Option("--to", metavar="B", parser=number, help="End of the range.")]
Checks = Annotated[
    int,
    typer.Option(
        "--checks", metavar="N", parser=whole_number,
        help="Sweeps between the ends that look for peaks nothing has followed.",
    ),
]  # fmt: skip
Steps = Annotated[
    int, typer.Option("--steps", metavar="N", parser=whole_number, help="Values of the parameter.")
]
Frequencies = Annotated[
    int, typer.Option("--frequencies", metavar="N", parser=whole_number, help="Frequencies over the band.")
]

NoRidge = Annotated[
    bool, typer.Option("--no-ridge", help="Do not track the peaks: faster, and for contacts of every law.")
]


def peaks(
    name: options.Scene,
    parameter: Followed,
    start: Start,
    stop: Stop,
    values: options.Values = None,
    checks: Checks = 3,
    harmonics: options.Harmonics = 11,
    plot: options.Plot = None,
    out: options.Out = None,
    as_json: options.Json = False,
) -> None:
    """Track the highest peak over a parameter.

    With exact derivatives; sweeps check that no peak was missed, and the least highest peak is found.
    """
    import solver

    outputs = Outputs.asked(plot, out)
    scene = inputs.scene(name, values)
    with inputs.path_of("--parameter"), bar("peaks", "sweeps") as on_progress:
        track = solver.track_peak(
            scene, parameter, start, stop, harmonics=harmonics, checks=checks, on_progress=on_progress
        )
    outputs.write(track, track.plot if track.parameter.size else None)
    show(track.to_json(), track_reports.track, as_json=as_json)
    end(track.completed, track.status.value)


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
