"""The list of stored designs, which `stickslip results` prints when no job is named."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli.commands.client import told
from service.cli.options.inputs import amount, count
from service.errors import InputError
from service.rendering.tables.text import print_json, print_table
from solver.results import units
from solver.scene.parameter_paths import parameter

if TYPE_CHECKING:
    from service.client.client import Client

_OPTIONS = {"peak_max": "--peak-max", "band_max": "--band-max", "limit": "--count"}

OfScene = Annotated[
    str | None, typer.Option("--scene", metavar="NAME", help="Designs of this scene; for the list.")
]
OfVariable = Annotated[
    str | None, typer.Option("--variable", metavar="PATH", help="Designs that chose it; for the list.")
]
PeakMax = Annotated[
    float | None,
    amount("--peak-max", "A", "Highest peak at most [m]; for the list."),
]
BandMax = Annotated[
    float | None,
    amount("--band-max", "HZ", "Band at most [Hz]; for the list."),
]
Reached = Annotated[
    bool | None,
    typer.Option(
        "--reached/--missed", help="Whether the goal was reached; for the list.", show_default=False
    ),
]
Sort = Annotated[
    str | None,
    typer.Option(
        "--sort", metavar="KEY",
        help="created, objective, peak, peak_at, band, work or seconds, largest first with - before it; "
        "-created.",
    ),
]  # fmt: skip
Count = Annotated[
    int | None,
    count("--count", "N", f"At most so many; {told.MOST}."),
]


def refuse_filters(filters: Mapping[str, Any]) -> None:
    """Refuse the filters of the list beside a job."""
    for name, value in filters.items():
        if value is not None:
            option = _OPTIONS.get(name, f"--{name}")
            raise InputError(f"`{option}` is for the list of stored designs, leave JOB out; got {value!r}")


def listed(client: Client, filters: Mapping[str, Any]) -> dict[str, Any]:
    """The stored designs that meet the filters of ``GET /v1/designs``."""
    others = {name: value for name, value in filters.items() if name != "limit"}
    found = told.listed(client.designs, filters["limit"], **others)
    return {"items": [one.model_dump(mode="json") for one in found]}


def show(found: Mapping[str, Any], *, as_json: bool) -> None:
    """Print the list."""
    if as_json:
        print_json(found)
        return
    rows = [
        (
            one["id"],
            one["scene"],
            ", ".join(_chosen(name, variable["value"]) for name, variable in one["variables"].items()),
            "" if one["peak"] is None else units.length(one["peak"]["value"]),
            "" if one["band_hz"] is None else f"{units.number(one['band_hz'])} Hz",
            "yes" if one["reached"] else "no",
        )
        for one in found["items"]
    ]
    print_table("Stored designs", ("id", "scene", "design", "peak", "band", "reached"), rows, right="34")


def _chosen(name: str, value: float | None) -> str:
    return name if value is None else f"{name} = {parameter(name, value)}"
