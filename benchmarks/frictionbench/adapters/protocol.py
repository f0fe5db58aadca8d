"""What an adapter and the scorer say to each other: a line of JSON for each question, one for each answer.

An adapter is a file with `NEEDS` (what pip is to install into its environment), `RUNGS` (settings from cheap
to dear) and `solve(case, rung) -> {"value": …}`; an `estimate` of the error may stand beside. What it does
not offer raises NotOfferedError, whose words are shown. It runs in an environment of its own, NumPy among it,
in a folder with copies of this file, of the adapter and of `benchmarks.frictionbench.model` alone;
`case_model`, `single_response` and `measured` are for who wants matrices.
"""

from __future__ import annotations

import contextlib
import json
import math
import sys
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.frictionbench.model import Model, NotOfferedError, model

WHAT, INSTANTS = ("amplitude", "half-peak-to-peak"), 16384


def case_model(case: dict[str, Any]) -> Model:
    """Return `frictionbench.model.model` of a case."""
    return model(case)


def single_response(case: dict[str, Any], *, highest: int = 1, gaps: bool = True) -> Model:
    """Return the model of a case that most codes can solve: one response under constant loads.

    Raises
    ------
    NotOfferedError
        It is another, or has forces above order `highest`, or gaps where the code has none.
    """
    m, asked = case_model(case), case["asked"]
    for why, holds in (
        ("the adapter asks it for one response alone", asked["what"] in WHAT and "which" not in asked),
        ("it has no friction whose load varies", not any(row.N1 or row.kn for row in m.rows)),
        ("it has no rigid friction", not any(math.isinf(row.kt) for row in m.rows)),
        ("the adapter knows no gap of it", gaps or not any(row.law == "gap" for row in m.rows)),
        (f"forces go to order {highest}", all(k <= highest for *_, k in m.loads)),
    ):
        if not holds:
            raise NotOfferedError(why)
    return m


def measured(case: dict[str, Any], blocks: np.ndarray) -> float:
    """Return what is asked of a motion by its mean, cosines and sines [c0, c1, s1, c2, …] (2H + 1,)."""
    spectrum = np.zeros(INSTANTS // 2 + 1, complex)
    spectrum[0], spectrum[1 : len(blocks) // 2 + 1] = blocks[0], 0.5 * (blocks[1::2] - 1j * blocks[2::2])
    moved = np.fft.irfft(spectrum, INSTANTS) * INSTANTS
    high, low = float(moved.max()), float(moved.min())
    return max(abs(high), abs(low)) if case["asked"]["what"] == "amplitude" else 0.5 * (high - low)


def serve(solve: Callable[[dict[str, Any], dict[str, Any]], dict[str, Any]]) -> None:
    """Answer questions until there are no more; who asks takes the time."""
    for line in sys.stdin:
        asked = json.loads(line)
        answer: dict[str, Any]
        try:
            with contextlib.redirect_stdout(sys.stderr):
                answer = solve(asked["case"], asked["rung"])
        except NotImplementedError as error:
            answer = {"not_offered": str(error)}
        except Exception as error:  # noqa: BLE001 - a failure is a result
            answer = {"failed": f"{type(error).__name__}: {error}"}
        print(json.dumps({**answer, "mark": asked["mark"]}), flush=True)
