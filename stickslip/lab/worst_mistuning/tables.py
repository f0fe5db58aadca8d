"""The worst mistuning in words."""

from __future__ import annotations
from collections.abc import Iterator, Mapping
from typing import Any
from solver.results import units
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
        height = units.length(found["tuned_peak"])
        pairs.append(
            (f"tuned, {Measured.of_result(found).name}", f"{height} at {found['tuned_at_hz']:.6g} Hz")
        )
    if worst is not None:
        place = f"blade {worst['blade']} at {worst['at_hz']:.6g} Hz"
        pairs.append(("worst", f"{worst['magnification']:.4g}: {units.length(worst['peak'])}, {place}"))
        pairs.append(("  its factors", ", ".join(f"{factor:.4f}" for factor in worst["factors"])))
    pairs += _residual(found.get("residual"))
    pairs.append(("Whitehead's bound", f"{found['whitehead']:.4g}"))
    bounds = (("Martel's bound", "martel"), ("bound by the power at this frequency", "power_bound"))
    pairs += [(name, f"{found[key]:.4g}") for name, key in bounds if found[key] is not None]
    climbs = found["climbs"] or found["starts"]
    pairs.append(("climbs", f"{climbs}, of which {found['alike']} ended at the same height"))
    if found["climbed"]:
        pairs.append(("responses solved", str(found["climbed"])))
    pairs += note_pairs(found)
    pairs.append(("time", units.duration(found["seconds"])))
    yield Summary(f"{found['scene']}, contacts {found['contacts']}, {size}", pairs)
    if found["patterns"]:
        yield _patterns(found)


def _residual(found: Mapping[str, Any] | None) -> list[tuple[str, str]]:
    """The worst with forces left in contacts that stick."""
    if found is None:
        return []
    place = f"blade {found['blade']} at {found['at_hz']:.6g} Hz, {units.length(found['without'])} without"
    height = units.length(found["peak"])
    forces = zip(found["contacts"], found["tractions"], strict=True)
    return [
        ("with forces left in contacts", f"{found['magnification']:.4g}: {height}, {place}"),
        ("  its factors", ", ".join(f"{factor:.4f}" for factor in found["factors"])),
        ("  its forces", ", ".join(f"{name} {force:.4g} N" for name, force in forces)),
    ]  # fmt: skip


def _patterns(found: Mapping[str, Any]) -> ResultTable:
    rows = [
        (
            one["pattern"], f"{one['disk']['magnification']:.4g}", f"{one['disk']['at_hz']:.6g}",
            "" if one["worst"] is None else f"{one['worst']['magnification']:.4g}",
        )
        for one in found["patterns"]
    ]  # fmt: skip
    title = f"intentional patterns, ± {100.0 * found['detuning']:g} %, the best first"
    return ResultTable(title, ("pattern", "magnification", "at [Hz]", "with the worst mistuning"), rows)
