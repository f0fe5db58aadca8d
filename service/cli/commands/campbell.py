"""`stickslip campbell`: where the orders of a running speed meet the resonances of a scene."""

from __future__ import annotations

from typing import Annotated

import typer

from service.cli.failures import end
from service.cli.options import inputs
from service.cli.options import shared as options
from service.cli.options.numeric import count
from service.cli.output_files import Outputs
from service.cli.progress import bar
from service.rendering.tables import campbell as campbell_reports
from service.rendering.tables.text import show

Speeds = Annotated[
    tuple[float, float], typer.Option("--speeds", metavar="LO HI", help="Running speeds [1/min].")
]
Orders = Annotated[
    list[int] | None,
    count(
        "--order",
        "N",
        "Excitations a revolution, repeatable; in a cyclic scene the engine order. The scene's own, or "
        "1, if left out.",
    ),
]
Limit = Annotated[
    float | None,
    typer.Option(
        "--limit", metavar="A", parser=inputs.number,
        help="Amplitude [m] that counts as resonance; peak/√2 of each order if left out.",
    ),
]  # fmt: skip
BandHz = Annotated[
    tuple[float, float] | None,
    typer.Option(
        "--band", metavar="LO HI",
        help="Frequencies looked at [Hz]; the scene's band and those of the running speeds if left out.",
    ),
]  # fmt: skip


def campbell(
    name: options.Scene,
    speeds: Speeds,
    order: Orders = None,
    values: options.Values = None,
    limit: Limit = None,
    band: BandHz = None,
    harmonics: options.Harmonics = 11,
    plot: options.Plot = None,
    out: options.Out = None,
    as_json: options.Json = False,
) -> None:
    """Find the speeds at which orders of the running speed meet resonances.

    The peaks are those of the response with friction; natural frequencies with all contacts stuck and all
    open are given beside them.
    """
    import optim

    outputs = Outputs.asked(plot, out)
    scene = inputs.scene(name, values)
    with bar("campbell") as on_progress:
        diagram = optim.campbell_diagram(
            scene, speeds_rpm=speeds, orders=order, limit=limit, band_hz=band, harmonics=harmonics,
            on_progress=on_progress,
        )  # fmt: skip
    drawn = any(one.branch.values.size for one in diagram.orders)
    outputs.write(diagram, diagram.plot if drawn else None)
    show(diagram.to_json(), campbell_reports.diagram, as_json=as_json)
    end(diagram.completed, diagram.status.value)
