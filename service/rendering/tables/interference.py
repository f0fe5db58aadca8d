"""What people read of an interference diagram, given as the JSON object a program reads."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from service.rendering.tables.text import print_pairs, print_table
from solver.results import units

_DIRECTIONS = {"standing": "", "both": "", "forward": " forward", "backward": " backward"}
MISSING = "the sector was not reduced for nodal diameters {}: reduce it for all with --engine-order 1"


def diagram(found: Mapping[str, Any]) -> None:
    """The frequencies at each nodal diameter, and the orders that meet them."""
    rows = [
        (
            f"{point['diameter']}{_DIRECTIONS[point['wave']]}",
            _listed(point["open_hz"]),
            _listed(point["stuck_hz"]),
        )
        for point in found["diameters"]
    ]
    title = f"{found['scene']}, {found['sectors']} sectors"
    print_table(title, ("nodal diameter", "all open [Hz]", "all stuck [Hz]"), rows, right="012")
    if found["speed_rpm"] is not None:
        _crossings(found)
    pairs = []
    if found["missing"]:
        pairs.append(("warning", MISSING.format(", ".join(map(str, found["missing"])))))
    pairs.append(("time", units.duration(found["seconds"])))
    print_pairs("", pairs)


def _crossings(found: Mapping[str, Any]) -> None:
    rows = [
        (
            str(one["order"]), f"{one['frequency_hz']:.6g}",
            f"{one['diameter']}{'' if one['wave'] == 'standing' else ' ' + one['wave']}", str(one["family"]),
            f"{one['open_hz']:.6g} to {one['stuck_hz']:.6g}",
            "meets it" if one["inside"] else f"{100.0 * one['margin']:.3g} % away",
        )
        for one in found["crossings"]
    ]  # fmt: skip
    title = f"orders within {100.0 * found['within']:g} % of a family at {found['speed_rpm']:g} rpm"
    names = ("order", "frequency [Hz]", "nodal diameter", "family", "open to stuck [Hz]", "")
    print_table(title, names, rows, right="0134")


def _listed(values: list[float]) -> str:
    return "  ".join(f"{value:9.2f}" for value in values) or "none"
