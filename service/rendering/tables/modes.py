"""What people read of a nonlinear mode, given as the JSON object a program reads."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from service.rendering.tables.text import print_pairs, print_table
from solver.results import units

_MOST_ROWS = 40


def report(found: Mapping[str, Any]) -> None:
    """Amplitude, frequency, damping ratio and states of the contacts, a point a row, thinned to a page."""
    of = "" if found["nodal_diameter"] is None else f", nodal diameter {found['nodal_diameter']}"
    title = f"{found['scene']}, mode {found['mode']}{of}, {found['n_harmonics']} harmonics"
    count = len(found["amplitude"])
    if count:
        rows = [_row(found, i) for i in _thinned(count)]
        heads = ["a [√kg m]", f"max |{found['dof']}|", "frequency [Hz]", "damping ratio", "contacts"]
        print_table(title, heads, rows, right="0123")
    pairs = [("points", f"{count}, {found['newton_iterations']} Newton iterations")]
    pairs.append(("time", units.duration(found["seconds"])))
    print_pairs("" if count else title, pairs)


def _row(found: Mapping[str, Any], i: int) -> list[str]:
    names, states = found["contacts"], found["states"][i]
    same = len(set(states)) == 1
    said = states[0] if same else ", ".join(f"{n}: {s}" for n, s in zip(names, states, strict=True))
    return [
        f"{found['amplitude'][i]:.4g}",
        units.length(found["max_abs"][i]),
        f"{found['frequency'][i]:.6g}",
        f"{found['damping_ratio'][i]:.5g}",
        said if states else "none",
    ]


def _thinned(count: int) -> list[int]:
    """Some points, the first and the last among them."""
    if count <= _MOST_ROWS:
        return list(range(count))
    return sorted({round(k * (count - 1) / (_MOST_ROWS - 1)) for k in range(_MOST_ROWS)})
