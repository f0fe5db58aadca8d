"""`stickslip campbell`: where the orders of a running speed meet the resonances of a scene."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import typer

from service import units
from service.cli import inputs, options
from service.cli.failures import FELL_SHORT
from service.cli.inputs import whole_number
from service.cli.output import print_json, print_pairs, print_table
from service.cli.progress import bar
from service.plots import SUFFIXES

Speeds = Annotated[
    tuple[float, float], typer.Option("--speeds", metavar="LO HI", help="Running speeds [1/min].")
]
Orders = Annotated[
    list[int] | None,
    typer.Option(
        "--order", metavar="N", parser=whole_number,
        help="Excitations a revolution, repeatable; in a cyclic scene the engine order. The scene's own, or "
        "1, if left out.",
    ),
]  # fmt: skip
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
    as_json: options.Json = False,
) -> None:
    """Find the speeds at which orders of the running speed meet resonances.

    The peaks are those of the response with friction; natural frequencies with all contacts stuck and all
    open are given beside them.
    """
    import optim

    picture = inputs.output_path("--plot", plot, SUFFIXES)
    scene = inputs.scene(name, values)
    with bar("campbell") as on_progress:
        diagram = optim.campbell_diagram(
            scene, speeds_rpm=speeds, orders=order, limit=limit, band_hz=band, harmonics=harmonics,
            on_progress=on_progress,
        )  # fmt: skip
    if picture is not None and any(one.branch.values.size for one in diagram.orders):
        from service.plots.campbell import campbell_figure
        from service.plots.style import save

        save(campbell_figure(diagram), picture)
    if as_json:
        print_json(diagram.to_json())
    else:
        _show(diagram.to_json())
    if not diagram.completed:
        typer.echo(f"stickslip: {diagram.status.value}", err=True)
        raise typer.Exit(FELL_SHORT)


def _show(found: Mapping[str, Any]) -> None:
    """The crossings, and what every order does at running speeds."""
    low, high = found["speeds_rpm"][0]
    title = f"{found['scene']}, {low:g} to {high:g} rpm, {found['n_harmonics']} harmonics"
    rows = [
        (
            str(order["order"]), f"{crossing['speed_rpm']:.6g}", f"{crossing['frequency_hz']:.6g}",
            units.length(crossing["amplitude"]),
            "running speed" if crossing["inside"] else f"{100.0 * crossing['margin']:.3g} % away",
        )
        for order in found["orders"]
        for crossing in order["crossings"]
    ]  # fmt: skip
    print_table(title, ("order", "crossing [rpm]", "peak [Hz]", "amplitude", ""), rows, right="0123")
    pairs = []
    for order in found["orders"]:
        pairs.append((f"order {order['order']}", _running(order)))
        for what, name in (("stuck_hz", "all stuck"), ("open_hz", "all open")):
            pairs.append((f"  {name}", ", ".join(f"{value:.5g}" for value in order[what]) + " Hz"))
    words = {True: "no", False: "yes", None: "unknown"}[found["clear"]]
    what = "a peak" if found["limit"] is None else f"more than {units.length(found['limit'])}"
    pairs.append((f"{what} at a running speed", words))
    pairs.append(("time", units.duration(found["seconds"])))
    print_pairs("", pairs)


def _running(order: Mapping[str, Any]) -> str:
    """What one order does at running speeds, in words."""
    highest = order["highest_running"]
    text = "no response at running speeds"
    if highest is not None:
        text = f"at most {units.length(highest['amplitude'])}, at {highest['speed_rpm']:.6g} rpm"
    over = ", ".join(f"{low:.6g} to {high:.6g}" for low, high in order["exceeded_running_rpm"])
    if over:
        text += f"; above {units.length(order['limit'])} from {over} rpm"
    return text
