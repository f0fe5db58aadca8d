"""Wear over life in words."""

from __future__ import annotations

from typing import Any
from collections.abc import Iterator, Mapping
from solver.results.units import duration, hertz, length, number, quantity
from solver.results.told import Block, ResultTable, Summary
from solver.scene.parameter_paths import parameter

Json = Mapping[str, Any]
Pairs = list[tuple[str, str]]


def _reached(hours: float) -> str:
    return f"reached after {quantity(hours, 'h')}" if hours > 0.0 else "exceeded from the beginning"


def _force(value: float | None) -> str:
    return "" if value is None else quantity(value, "N")


def wear_life(found: Json) -> Iterator[Block]:
    """What contacts lose over hours, and what the response comes to."""
    hours, amplitude, pairs = found["hours"], found["amplitude"], _chosen(found.get("chosen"))
    where = "at the highest peak" if found["at_peak"] else "at given frequencies"
    if hours:
        for name, at in (("max|x| at the beginning", 0), (f"after {quantity(hours[-1], 'h')}", -1)):
            pairs.append((name, f"{length(amplitude[at])} at {hertz(found['frequency_hz'][at])}"))
        pairs.append(
            (
                "largest",
                f"{length(found['highest'])} after {quantity(found['highest_hours'], 'h')}",
            )
        )
    if found["limit"] is not None:
        met = found["hours_to_limit"]
        said = "not reached" if met is None else _reached(met)
        pairs.append((f"limit {length(found['limit'])}", said))
    used, met = found.get("used", ()), found.get("hours_to_margin")
    if met is not None or any(one is not None for one in used):
        # Beside a margin that is known, null is a mean stress that leaves nothing.
        first, last = ("infinite" if one is None else number(one, 4) for one in (used[0], used[-1]))
        share = f"{first} at the beginning, {last} at the end"
        pairs.append(("of the stress allowed", share))
        pairs.append(("margin 1", "kept" if met is None else _reached(met)))
    for one in found["switches"]:
        pairs.append(("another peak is highest", f"from {quantity(one, 'h')} on"))
    if found["ended_by"]:
        pairs.append(("ended by", found["ended_by"]))
    pairs.append(("steps", f"{found['steps']}, {found['responses']} responses"))
    pairs.append(("time", duration(found["seconds"])))
    yield Summary(f"{found['scene']}, wear {where}", pairs)
    if hours:
        of_each = (found[key] for key in ("contacts", "depths", "loads", "power"))
        rows = [
            (
                name, length(depth[-1]), _force(load[0]), _force(load[-1]),
                quantity(power[0], "W"), quantity(power[-1], "W"),
            )
            for name, depth, load, power in zip(*of_each, strict=True)
        ]  # fmt: skip
        heads = ("contact", "depth", "N0 at first", "at last", "power at first", "at last")
        yield ResultTable("Contacts", heads, rows)
    if found["paths"]:
        columns = [found[f"{name}_slopes"] for name in ("end", "highest", "limit", "margin")]
        slopes = [
            (path, *("" if one is None else number(one) for one in each))
            for path, *each in zip(found["paths"], *columns, strict=True)
        ]
        by = ("by", "of the last amplitude", "of the largest", "of the time to the limit", "to margin 1")
        yield ResultTable("Derivatives", by, slopes)


def _chosen(found: Json | None) -> list[tuple[str, str]]:
    """What was chosen for the life, and the worst amplitude with it."""
    if found is None:
        return []
    if found["at"] is None:
        return [("chosen", found["status"])]
    worst = f"{length(found['worst'])} at worst, {length(found['first'])} when new"
    return [
        (found["parameter"], quantity(found["at"], found["unit"])),
        ("chosen", worst),
    ]


def least_worn_peak(found: Json) -> Iterator[Block]:
    """The best value of a parameter for contacts that wear."""
    pairs: Pairs = []
    if found["at"] is not None:
        pairs.append(("best", f"{found['parameter']} = {parameter(found['parameter'], found['at'])}"))
        when = f"after {quantity(found['worst_hours'], 'h')}"
        pairs.append(("worst amplitude", f"{length(found['worst'])} {when}"))
        pairs.append(("before anything is worn", length(found["first"])))
    pairs += [("lives looked at", str(len(found["looked_at"]))), ("time", duration(found["seconds"]))]
    yield Summary(f"{found['scene']}, least amplitude of worn contacts", pairs)
