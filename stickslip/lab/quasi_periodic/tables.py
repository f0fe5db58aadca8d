"""Quasi-periodic responses in words."""

from __future__ import annotations

from typing import Any
from collections.abc import Iterator, Mapping
from solver.results import units
from solver.results.told import Block, ResultTable, Summary

Json = Mapping[str, Any]


def _torus_curve(found: Json) -> Iterator[Block]:
    """The responses to two base frequencies over the first of them."""
    keys = ("max_abs", "rms", "first_amplitude", "second_amplitude", "error_estimate")
    rows = []
    for i, hertz in enumerate(found["frequency_hz"]):
        sizes = ["" if found[key][i] is None else units.length(found[key][i]) for key in keys]
        note = "repeats" if found["repeats"][i] else "" if found["known"][i] else "not known well"
        rows.append((units.number(hertz), *sizes, note))
    heads = ("frequency [Hz]", "max|x|", "root mean square", "at the first", "at the second", "± error", "")
    yield ResultTable(f"{found['scene']} with {units.hertz(found['second_hz'])}", heads, rows)
    yield Summary("", [("time", units.duration(found["seconds"]))])


def quasi_periodic(found: Json) -> Iterator[Block]:
    """What the response to two base frequencies is, or a curve of such responses."""
    if isinstance(found["frequency_hz"], list):
        yield from _torus_curve(found)
        return
    first, second = units.number(found["frequency_hz"]), units.number(found["second_hz"])
    pairs = []
    if found["max_abs"] is not None:
        pairs += [
            ("max|x|", units.length(found["max_abs"])),
            ("half peak to peak", units.length(found["half_peak_to_peak"])),
            ("root mean square", units.length(found["rms"])),
            (f"amplitude at {first} Hz", units.length(found["first_amplitude"])),
            (f"amplitude at {second} Hz", units.length(found["second_amplitude"])),
        ]
        if found["error_estimate"] is not None:
            share = found["error_estimate"] / found["half_peak_to_peak"]
            pairs.append(("estimated error", f"{units.number(100.0 * share, 2)} %"))
        between = " and ".join(f"{p} : {q}" for p, q in found["turns"])
        pairs.append(("repeats after turns" if found["repeats"] else "between turns", between))
    pairs += [(name, state) for name, state in found["contacts"].items()]
    pairs += [("flags", ", ".join(found["flags"]))] if found["flags"] else []
    pairs.append(("time", units.duration(found["seconds"])))
    yield Summary(f"{found['scene']} at {first} and {second} Hz", pairs)
