"""Times that are reported have no compiling in them."""

import time
from typing import Any

import pytest
from numba.core import event

import solver.jit.cache  # noqa: F401 - it listens to the compiler
from solver.jit.timer import clock


def test_the_clock_stands_still_while_something_is_compiled() -> None:
    nothing: dict[str, Any] = {"dispatcher": None}
    begun, at = time.perf_counter(), clock()
    with event.trigger_event("numba:compile", data=nothing):
        with event.trigger_event("numba:compile", data=nothing):
            time.sleep(0.2)
        time.sleep(0.1)
    compiled = time.perf_counter() - begun
    time.sleep(0.1)
    passed, told = time.perf_counter() - begun, clock() - at
    assert told == pytest.approx(passed - compiled, abs=1e-2)
    assert told >= 0.1
