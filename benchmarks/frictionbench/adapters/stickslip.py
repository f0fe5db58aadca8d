"""This project; it runs in the environment of the command."""

from __future__ import annotations

from typing import Any

from protocol import serve

from benchmarks.frictionbench import scenes

NEEDS: tuple[str, ...] = ()
RUNGS = [
    {"harmonics": 7},
    {"harmonics": 21},
    {"harmonics": 61},
    {"harmonics": 161},
    {"harmonics": 41, "exact": True},
]


def solve(case: dict[str, Any], rung: dict[str, Any]) -> dict[str, Any]:
    """Return the answer of `benchmarks.frictionbench.scenes`."""
    rigid = any(one.get("kt") == "inf" for one in case["contacts"])
    exact = bool(rung.get("exact")) and not rigid
    return scenes.answer(case, rung["harmonics"], exact)


if __name__ == "__main__":
    serve(solve)
