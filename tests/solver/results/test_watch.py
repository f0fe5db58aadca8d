"""Ctrl-C ends a computation with what it has so far; a second one ends it at once."""

import _thread
import signal
import threading
from collections.abc import Iterator

import numpy as np
import pytest

import optim
import solver
from solver.continuation.branch import BranchStatus
from solver.results.watch import stopped_by_interrupt


@pytest.fixture(autouse=True)
def _interrupts_as_in_a_program() -> Iterator[None]:
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_a_sweep_ends_with_its_points_so_far() -> None:
    def interrupt(share: float, _: int) -> None:
        if share > 0.3 and signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
            signal.raise_signal(signal.SIGINT)

    found = solver.sweep("two-dof", "frequency", 0.5, 2.0, on_progress=interrupt)
    assert found.status is BranchStatus.STOPPED
    assert len(found.values) > 5
    assert found.values[-1] < 2.0
    assert np.isfinite(found.amplitude).all()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_design_ends_with_the_best_so_far(capsys: pytest.CaptureFixture[str]) -> None:
    def interrupt(_: object) -> None:
        if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
            signal.raise_signal(signal.SIGINT)

    variables = {"damper.N0": (20.0, 300.0), "damper.kt": (10.0, 100.0)}
    found = optim.design("two-dof", variables=variables, harmonics=3, on_best=interrupt)
    assert found.status is optim.DesignStatus.STOPPED
    assert not found.reached
    assert found.peak is not None
    assert "ends with the best so far" in capsys.readouterr().err


def test_a_second_one_ends_at_once() -> None:
    def interrupt(*_: float) -> None:
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        solver.sweep("two-dof", "frequency", 0.5, 2.0, on_progress=interrupt)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_program_that_stops_computations_itself_is_let_alone() -> None:
    with pytest.raises(KeyboardInterrupt):
        solver.sweep(
            "two-dof", "frequency", 0.5, 2.0, should_stop=lambda: False,
            on_progress=lambda *_: signal.raise_signal(signal.SIGINT),
        )  # fmt: skip
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with stopped_by_interrupt() as should_stop:
        assert should_stop is None
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN


def test_other_threads_are_let_alone() -> None:
    given: list[object] = []

    def run() -> None:
        with stopped_by_interrupt() as should_stop:
            given.append(should_stop)

    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    assert given == [None]


def test_a_command_prints_what_it_has(capsys: pytest.CaptureFixture[str]) -> None:
    from service.cli import main

    timer = threading.Timer(1.5, _thread.interrupt_main)
    timer.start()
    asked = ["mistuning", "bladed-disk", "--of", "tip", "--samples", "9000", "--harmonics", "1"]
    assert main([*asked, "--spread", "0.03"]) == 1
    timer.join()
    out, err = capsys.readouterr()
    assert "spread 0.03 of tip" in out
    assert "stopped by the caller" in err
