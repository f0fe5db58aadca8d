"""`stickslip controlled`: responses over the frequency at a held amplitude."""

from __future__ import annotations

from typing import Annotated

import typer

from service.cli.failures import end
from service.cli.options import inputs
from service.cli.options import shared as options
from service.cli.options.numeric import amount
from service.cli.output_files import Outputs
from service.cli.progress import bar
from service.rendering.tables import modes as tables
from service.rendering.tables.text import show

Amplitude = Annotated[float, amount("--amplitude", "A", "Amplitude of harmonic 1 that is held [m].")]
Start = Annotated[float | None, amount("--from", "F", "First frequency [Hz]; the scene's band if left out.")]
Stop = Annotated[float | None, amount("--to", "F", "Last frequency [Hz].")]
Dof = Annotated[
    str | None, typer.Option("--dof", metavar="NAME", help="Whose amplitude; what the scene observes.")
]
NoStability = Annotated[
    bool, typer.Option("--no-stability", help="Leave out whether responses are stable: faster.")
]


def controlled(
    name: options.Scene,
    amplitude: Amplitude,
    start: Start = None,
    stop: Stop = None,
    dof: Dof = None,
    no_stability: NoStability = False,
    values: options.Values = None,
    harmonics: options.Harmonics = 11,
    plot: options.Plot = None,
    out: options.Out = None,
    as_json: options.Json = False,
) -> None:
    """Follow the response over the frequency with one amplitude held, as rigs do.

    It says which force that takes, and what the contacts do.
    """
    import solver

    outputs = Outputs.asked(plot, out)
    scene = inputs.scene(name, values)
    with bar("controlled") as on_progress:
        found = solver.held_amplitude(
            scene, amplitude, start=start, stop=stop, dof=dof, harmonics=harmonics,
            stability=False if no_stability else None, on_progress=on_progress,
        )  # fmt: skip
    outputs.write(found, found.plot if found.frequency_hz.size else None)
    show(found.to_json(), tables.held, as_json=as_json)
    end(found.completed, found.status.value)
