"""An accuracy study in words."""

from __future__ import annotations

from typing import Any
from collections.abc import Iterator, Mapping
from solver.results import units
from solver.results.told import Block, ResultTable, Summary

Json = Mapping[str, Any]

_ACCURACY_COLUMNS = ("", "harmonics", "contact forces", "max|x|", "error", "ms", "iterations")


def accuracy(found: Json) -> Iterator[Block]:
    """Error against time, the rows nothing beats marked."""
    size = found["reference"]
    rows = [
        (
            "*" if row["pareto"] else "",
            str(row["harmonics"] or ""),
            row["evaluator"] if row["samples"] == 0 else f"{row['samples']} samples",
            units.length(row["max_abs"]),
            units.number(row["error"] / size, 2) if size > 0.0 else "",
            units.number(row["milliseconds"], 3),
            str(row["iterations"]),
        )
        for row in found["rows"]
    ]
    title = f"{found['scene']} at {units.hertz(found['frequency_hz'])}: {units.length(size)}"
    if found["reference_error"] is not None:
        by = found["reference_harmonics"]
        way = f"with {by} harmonics" if by else "exact"
        title += f" {way}, to {units.length(found['reference_error'])}"
    yield ResultTable(title, _ACCURACY_COLUMNS, rows)
    yield Summary("", [("*", "nothing else here is both as accurate and as fast")])
