"""`stickslip interference`: natural frequencies of a disk over the nodal diameter, with the engine orders."""

from __future__ import annotations

from typing import Annotated

from service.cli.failures import end
from service.cli.options import inputs
from service.cli.options import shared as options
from service.cli.options.numeric import amount, count
from service.cli.output_files import Outputs
from service.cli.progress import bar
from service.rendering.tables import interference as tables
from service.rendering.tables.text import show

Speed = Annotated[
    float | None,
    amount("--speed", "RPM", "Speed of rotation [1/min]; the scene's own, and without one no orders."),
]
Orders = Annotated[
    list[int] | None,
    count(
        "--order", "N", "Excitations a revolution, repeatable; all that reach the frequencies if left out."
    ),
]
Families = Annotated[int, count("--families", "N", "How many natural frequencies at each nodal diameter.")]
UpTo = Annotated[float | None, amount("--up-to", "HZ", "Families that begin above are left out.")]
Within = Annotated[
    float,
    amount("--within", "S", "Distance of an order from a family, relative to its frequency, that counts."),
]


def interference(
    name: options.Scene,
    speed: Speed = None,
    order: Orders = None,
    families: Families = 6,
    up_to: UpTo = None,
    within: Within = 0.05,
    values: options.Values = None,
    plot: options.Plot = None,
    out: options.Out = None,
    as_json: options.Json = False,
) -> None:
    """Draw natural frequencies over the nodal diameter, with the engine orders that meet them.

    Each with all contacts open and all stuck: friction moves a resonance between the two.
    """
    import solver

    outputs = Outputs.asked(plot, out)
    scene = inputs.scene(name, values)
    with bar("interference", "nodal diameters") as on_progress:
        diagram = solver.interference_diagram(
            scene, speed_rpm=speed, orders=order, families=families, up_to_hz=up_to, within=within,
            on_progress=on_progress,
        )  # fmt: skip
    outputs.write(diagram, diagram.plot if any(point.open_hz for point in diagram.points) else None)
    show(diagram.to_json(), tables.diagram, as_json=as_json)
    end(diagram.completed, diagram.status.value)
