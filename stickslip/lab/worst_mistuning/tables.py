"""The worst mistuning in words."""

from __future__ import annotations
from collections.abc import Iterator, Mapping
from typing import Any
from solver.results.units import duration, hertz, length, number, quantity
from solver.results.known import Measured
from solver.results.known import note_pairs
from solver.results.told import Block, ResultTable, Summary


def worst_mistuning(found: Mapping[str, Any]) -> Iterator[Block]:
    """The worst pattern with the bounds beside it, and intentional patterns, the best first."""
    worst, limit = found["worst"], found["rms"]
    size = f"factors of {', '.join(found['of'])} within ± {100.0 * found['within']:g} %"
    size += "" if limit is None else f", {100.0 * limit:g} % rms"
    pairs = []
    if found["tuned_peak"] is not None:
        height = length(found["tuned_peak"])
        pairs.append(
            (
                f"tuned, {Measured.of_result(found).name}",
                f"{height} at {hertz(found['tuned_at_hz'])}",
            )
        )
    if worst is not None:
        place = f"blade {worst['blade']} at {hertz(worst['at_hz'])}"
        pairs.append(("worst", f"{number(worst['magnification'])}: {length(worst['peak'])}, {place}"))
        pairs.append(("  its factors", ", ".join(f"{factor:.4f}" for factor in worst["factors"])))
    pairs += _residual(found.get("residual"))
    pairs.append(("Whitehead's bound", number(found["whitehead"])))
    bounds = (("Martel's bound", "martel"), ("bound by the power at this frequency", "power_bound"))
    pairs += [(name, number(found[key])) for name, key in bounds if found[key] is not None]
    climbs = found["climbs"] or found["starts"]
    pairs.append(("climbs", f"{climbs}, of which {found['alike']} ended at the same height"))
    if found["climbed"]:
        pairs.append(("responses solved", str(found["climbed"])))
    pairs += note_pairs(found)
    pairs.append(("time", duration(found["seconds"])))
    yield Summary(f"{found['scene']}, contacts {found['contacts']}, {size}", pairs)
    if found["patterns"]:
        yield _patterns(found)


def _residual(found: Mapping[str, Any] | None) -> list[tuple[str, str]]:
    """The worst with forces left in contacts that stick."""
    if found is None:
        return []
    place = f"blade {found['blade']} at {hertz(found['at_hz'])}, {length(found['without'])} without"
    height = length(found["peak"])
    forces = zip(found["contacts"], found["tractions"], strict=True)
    return [
        ("with forces left in contacts", f"{number(found['magnification'])}: {height}, {place}"),
        ("  its factors", ", ".join(f"{factor:.4f}" for factor in found["factors"])),
        ("  its forces", ", ".join(f"{name} {quantity(force, 'N')}" for name, force in forces)),
    ]  # fmt: skip


def _patterns(found: Mapping[str, Any]) -> ResultTable:
    rows = [
        (
            one["pattern"], number(one['disk']['magnification']), number(one['disk']['at_hz']),
            "" if one["worst"] is None else number(one['worst']['magnification']),
        )
        for one in found["patterns"]
    ]  # fmt: skip
    title = f"intentional patterns, ± {100.0 * found['detuning']:g} %, the best first"
    return ResultTable(title, ("pattern", "magnification", "at [Hz]", "with the worst mistuning"), rows)
