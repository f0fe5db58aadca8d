"""What people read of tracked peaks and maps, given as the JSON object a program reads."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from solver.results.known import Measured, known_pairs
from solver.results.told import Block, ResultTable, Summary
from solver.results.units import duration, hertz, length, number, quantity, shown_unit, span
from solver.scene.parameter_paths import parameter
from solver.views.tables.responses import proved, title_over

Json = Mapping[str, Any]
Pairs = list[tuple[str, str]]
ON_THE_GRID = "resonances narrower than the grid are not on it: the tracked peaks, or a sweep, have them"


def track(found: Json) -> Iterator[Block]:
    """The highest peak over a parameter: both ends, the exchanges, the least."""
    pairs = [
        *Measured.of_result(found).pairs,
        *_ridge(found),
        *_plateau(found),
        *_sure(found),
        *proved(found.get("certificates") or ()),
    ]
    pairs.append(("points", f"{len(found['parameter'])}, {found['sweeps']} sweeps"))
    pairs.append(("time", duration(found["seconds"])))
    yield Summary(title_over(found), pairs)


def response_map(found: Json) -> Iterator[Block]:
    """The size of a map, its highest amplitude, and its ridge."""
    path = found["parameter_path"]
    known = [
        (value, frequency, at)
        for at, row in zip(found["parameter"], found["amplitude"], strict=True)
        for frequency, value in zip(found["frequency"], row, strict=True)
        if value is not None
    ]
    size = f"{len(found['parameter'])} × {len(found['frequency'])}"
    worst = number(found["largest_residual"], 2)
    pairs = [("points", f"{size}, {len(known)} solved, largest residual {worst}")]
    pairs += Measured.of_result(found).pairs
    if known:
        value, frequency, at = max(known)
        place = f"{hertz(frequency)}, {path} {parameter(path, at)}"
        pairs.append(("highest of the grid", f"{length(value)} at {place}"))
    if found["ridge"] is not None:
        pairs += [*_ridge(found["ridge"]), *_plateau(found["ridge"])]
    else:
        pairs.append(("note", ON_THE_GRID))
    pairs += _sure(found if "measure" in found else found["ridge"] or {})
    pairs.append(("time", duration(found["seconds"])))
    yield Summary(title_over(found), pairs)


def margin(found: Json) -> Iterator[Block]:
    """What each damper allows, and the stress of each over the excitation."""
    level, unit = found["level"], found["level_unit"]
    what = "stress" if found["judged_by"] == "utilisation" else "amplitude"
    title = f"{found['scene']}, excitation from {span(level[0], level[-1], unit)}"
    pairs = [("time", duration(found["seconds"]))]
    if found["judged_by"] == "amplitude" and all(one is None for row in found["used"] for one in row):
        pairs.insert(0, ("note", "nothing says what is allowed: give stresses a material, or a limit"))
    endless = {
        (d, i)
        for d, (stresses, shares) in enumerate(zip(found["stress"], found["used"], strict=True))
        for i, (stress, share) in enumerate(zip(stresses, shares, strict=True))
        if found["judged_by"] == "utilisation" and stress is not None and share is None
    }
    if endless:
        pairs.insert(0, ("note", "the share is infinite where the mean stress alone reaches the strength"))
    yield Summary(f"{title}, {found['n_harmonics']} harmonics", pairs)
    allowed = [
        (
            one["name"], _ends(one, unit), one["row"] or "–",
            "–" if one["at_hz"] is None else hertz(one['at_hz']),
            "–" if one["value"] is None else quantity(one['value'], found['unit']),
        )
        for one in found["allowed"]
    ]  # fmt: skip
    yield ResultTable("Excitation allowed", ("damper", "allowed", "by", "at", what), allowed)
    names = [one["name"] for one in found["allowed"]]
    sizes = (abs(one or 0.0) for row in found["stress"] for one in row)
    shown = shown_unit(max(sizes, default=0.0), found["unit"])
    of_stress = ("stress", f"{what} [{shown.name}]", shown.per_one)
    for key, title, per_one in (of_stress, ("used", "share of what is allowed", 1.0)):
        rows = [
            (
                number(each),
                *(
                    number(per_one * one) if one is not None
                    else "infinite" if key == "used" and (d, i) in endless else "–"
                    for d, one in enumerate(row)
                ),
            )
            for i, (each, *row) in enumerate(zip(level, *found[key], strict=True))
        ]  # fmt: skip
        yield ResultTable(title, (f"excitation [{unit}]", *names), rows)


def _ends(one: Json, unit: str) -> str:
    if one["allowed"] is not None:
        return quantity(one["allowed"], unit)
    return {"below": "less than the range", "above": "more than the range"}.get(one["end"], "not known")


def _ridge(found: Json) -> Pairs:
    path, best = found["parameter_path"], found["optimum"]
    pairs: Pairs = []
    for name, at in (("first peak", 0), ("last peak", -1)):
        if found["peak"]:
            value, frequency = found["peak"][at], found["frequency"][at]
            pairs.append((name, f"{length(value)} at {hertz(frequency)}"))
    for exchange in found["exchanges"]:
        height = length(exchange["peak"])
        pairs.append(("exchange", f"at {parameter(path, exchange['at'])}, both {height}"))
    if best["at"] is not None:
        held = ", ".join(hertz(peak["frequency"]) for peak in best["active"])
        height = length(best["peak"])
        pairs.append(("least peak", f"{height} at {path} = {parameter(path, best['at'])} ({held})"))
    return pairs


def _plateau(found: Json) -> Pairs:
    """How far other values of the parameter are as good."""
    path, best = found["parameter_path"], found["optimum"]
    if best.get("plateau") is None:
        return []
    low, high = (parameter(path, end) for end in best["plateau"])
    return [("as good", f"{low} to {high}"), ("chosen by", best["chosen_by"])]


def _sure(found: Json) -> Pairs:
    """How well the peaks are known; of an earlier version, why a higher one may hide between points."""
    older = [("warning", f"a response may have a higher peak. {why}") for why in found.get("peaks_open", ())]
    return known_pairs(found) if "measure" in found else older
