"""What an adapter and the scorer say to each other: a line of JSON for each question, one for each answer.

An adapter is a file with `NEEDS` (what pip is to install into its environment), `RUNGS` (settings from cheap
to dear) and `solve(case, rung) -> {"value": …}`; `estimate` of the error and `points` may stand beside. What
it does not offer raises NotOfferedError, whose words are shown. It runs in an environment of its own,
NumPy among it; `case_model`, `single_response` and `measured` are for who wants matrices.
"""

from __future__ import annotations

import contextlib
import importlib.util
import json
import math
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

WHAT, INSTANTS = ("amplitude", "half-peak-to-peak"), 16384


def _loaded() -> Any:
    """Return `frictionbench.model`, loaded by its path: an adapter has no other package."""
    where = Path(__file__).parents[1] / "model.py"
    spec = importlib.util.spec_from_file_location("frictionbench_model", where)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


MODEL = _loaded()
NotOfferedError = MODEL.NotOfferedError


def case_model(case: dict[str, Any]) -> Any:
    """Return `frictionbench.model.model` of a case."""
    return MODEL.model(case)


def single_response(case: dict[str, Any], *, highest: int = 1, gaps: bool = True) -> Any:
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
    """Answer questions until there are no more; each is solved once to warm up, and then timed."""
    for line in sys.stdin:
        asked = json.loads(line)
        answer: dict[str, Any]
        try:
            with contextlib.redirect_stdout(sys.stderr):
                begun = time.process_time()
                answer = solve(asked["case"], asked["rung"])
                first = time.process_time() - begun
                if first < asked["again_below"]:
                    begun = time.process_time()
                    answer = solve(asked["case"], asked["rung"])
                    first = min(first, time.process_time() - begun)
                answer = {"seconds": first, **answer}
        except NotImplementedError as error:
            answer = {"not_offered": str(error)}
        except Exception as error:  # noqa: BLE001 - a failure is a result
            answer = {"failed": f"{type(error).__name__}: {error}"[:300]}
        print(json.dumps(answer), flush=True)
