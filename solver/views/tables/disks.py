"""What people read of disks: interference diagrams and mistuned disks, given as JSON."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from solver.results import units
from solver.results.known import known_pairs
from solver.results.measures import Measured
from solver.results.order_statistics import quantile_words
from solver.results.told import Block, ResultTable, Summary

_DIRECTIONS = {"standing": "", "both": "", "forward": " forward", "backward": " backward"}
MISSING = "the sector was not reduced for nodal diameters {}: reduce it for all with --engine-order 1"


def interference(found: Mapping[str, Any]) -> Iterator[Block]:
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
    yield ResultTable(title, ("nodal diameter", "all open [Hz]", "all stuck [Hz]"), rows)
    if found["speed_rpm"] is not None:
        yield _crossings(found)
    pairs = []
    if found["missing"]:
        pairs.append(("warning", MISSING.format(", ".join(map(str, found["missing"])))))
    pairs.append(("time", units.duration(found["seconds"])))
    yield Summary("", pairs)


def _crossings(found: Mapping[str, Any]) -> ResultTable:
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
    return ResultTable(title, names, rows)


def _listed(values: list[float]) -> str:
    return "  ".join(f"{value:9.2f}" for value in values) or "none"


def _errors(found: Mapping[str, Any]) -> str:
    """How well the mean is known: by the error of the peaks, and as that of a few disks of all."""
    by_peaks, by_disks = found.get("mean_error"), found.get("standard_error")
    of_peaks = "" if by_peaks is None else f", known to {by_peaks:.2g} by the error of the peaks"
    return of_peaks + ("" if by_disks is None else f", standard error {by_disks:.2g} by the number of disks")


def mistuning(found: Mapping[str, Any]) -> Iterator[Block]:
    """The amplitude magnification over the disks, and the worst of them."""
    disks, tuned, worst = found["samples"], found["tuned"], found["worst"]
    title = f"{found['scene']}, {len(disks)} disks, spread {found['spread']:g} of {', '.join(found['of'])}"
    pairs = []
    if tuned["peak"] is not None:
        height = units.length(tuned["peak"])
        pairs.append((f"tuned, {Measured.of_result(found).name}", f"{height} at {tuned['at_hz']:.6g} Hz"))
    if found["mean"] is not None:
        pairs.append(("magnification", f"{found['mean']:.4g} in the mean{_errors(found)}"))
        if found["deviation"] is not None:
            pairs.append(("  deviation of the disks", f"{found['deviation']:.2g}"))
    pairs += [
        (f"  {100.0 * quantile['share']:g} % below", quantile_words(quantile, "magnification", "disks"))
        for quantile in found["quantiles"]
    ]
    if worst is not None:
        blade, factors = worst["worst_blade"], ", ".join(f"{factor:.4f}" for factor in worst["factors"])
        place = f"blade {blade} at {worst['at_hz'][blade]:.6g} Hz"
        error = worst.get("magnification_error")
        known = "" if error is None else f" ± {error:.2g}"
        pairs.append(
            ("worst", f"{worst['magnification']:.4g}{known}: {units.length(worst['largest'])}, {place}")
        )
        pairs.append(("  its disk", f"seed {worst['seed']}, factors {factors}"))
    pairs += known_pairs(found)
    pairs.append(("time", units.duration(found["seconds"])))
    yield Summary(f"{title}, {found['n_harmonics']} harmonics", pairs)
