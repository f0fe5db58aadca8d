"""Worker processes and the attempts that wait in their pipes."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest
from private_kinds import PRIVATE, IterationRequest, as_it_is
from service_helpers import pids, until

from service.db.repositories import Attempt
from service.jobs.outputs import Piece, Point
from service.settings.settings import load_settings
from service.workers.base import Finished, Lost, Outcome, Stopped
from service.workers.local import LocalExecutor
from service.workers.slot import MOST_AHEAD


class Heard:
    """What an executor said."""

    def __init__(self) -> None:
        self.ends: list[tuple[str, Outcome]] = []
        self.lock = threading.Lock()

    def progress(self, attempt: Attempt, fraction: float, points: int) -> None:
        """Nothing is kept."""

    def found(self, attempt: Attempt, points: Sequence[Point]) -> None:
        """Nothing is kept."""

    def kept(self, attempt: Attempt, pieces: Sequence[Piece], *, anew: bool) -> None:
        """Nothing is kept."""

    def ended(self, attempt: Attempt, outcome: Outcome) -> None:
        with self.lock:
            self.ends.append((attempt.job_id, outcome))

    def room(self) -> None:
        """The tests ask."""

    def of(self, job_id: str) -> Outcome | None:
        found = [outcome for known, outcome in self.ends if known == job_id]
        assert len(found) <= 1, "an attempt ends once"
        return found[0] if found else None


def attempt(
    name: str,
    seconds: float = 0.0,
    kind: str = "iteration",
    *,
    pid_file: str | None = None,
    padding: str = "",
) -> Attempt:
    asked = IterationRequest(size=5, seconds=seconds, pid_file=pid_file)
    spec = {**as_it_is(asked, None).spec, "padding": padding}
    return Attempt(job_id=name, kind=kind, spec=spec, attempt=1, max_attempts=3, lease_owner="me")


@pytest.fixture
def heard() -> Heard:
    return Heard()


@pytest.fixture
def executor(heard: Heard) -> Iterator[LocalExecutor]:
    """One process that has done a few short attempts, so that others may wait in its pipe."""
    made = LocalExecutor(
        PRIVATE.runs(), PRIVATE.warm_up, workers=1, grace_seconds=1.0, pace=load_settings().pace
    )
    made.start(heard)
    until(lambda: made.status().ready)
    for number in range(2000):
        made.submit(attempt(f"first {number}"))
        until(lambda number=number: heard.of(f"first {number}"))
        if made.free() == 1 + MOST_AHEAD:
            break
    yield made
    made.close()


def test_attempts_wait_in_the_pipe_and_end_in_order(executor: LocalExecutor, heard: Heard) -> None:
    names = [f"short {number}" for number in range(1 + MOST_AHEAD)]
    padding = ["", "x" * 300_000]  # what is large is sent when its turn has come, in a thread of its own
    for number, name in enumerate(names):
        executor.submit(attempt(name, padding=padding[number % 2]))
    assert executor.free() == 0, "until half of them are done"
    until(lambda: heard.of(names[-1]))
    assert [job for job, _ in heard.ends[-len(names) :]] == names
    assert all(isinstance(heard.of(name), Finished) for name in names)
    executor.submit(attempt("one"))
    for _ in range(2 * MOST_AHEAD):
        executor.submit(attempt("too many"))
        if heard.ends[-1][0] == "too many":
            break
    assert isinstance(heard.ends[-1][1], Stopped), "it goes back to the queue"
    heard.ends.clear()


def test_what_waits_behind_a_long_attempt_goes_back_to_the_queue(
    executor: LocalExecutor, heard: Heard
) -> None:
    executor.submit(attempt("long", 600.0))
    for number in range(3):
        executor.submit(attempt(f"behind {number}"))
    until(lambda: heard.of("behind 2"))
    assert [heard.of(f"behind {number}") for number in range(3)] == [Stopped()] * 3
    assert heard.of("long") is None
    assert executor.free() == 0
    executor.stop_attempt(attempt("long", 600.0))
    assert heard.of("long") is None, "another attempt is meant"


@pytest.mark.parametrize("kind", ["iteration", "deaf"])
def test_an_attempt_that_waits_can_be_stopped(executor: LocalExecutor, heard: Heard, kind: str) -> None:
    first, second, third = attempt("first", 0.15), attempt("second", 600.0, kind), attempt("third")
    for one in (first, second, third):
        executor.submit(one)
    executor.stop_attempt(second)
    until(lambda: heard.of("second") and heard.of("third"))
    assert isinstance(heard.of("first"), Finished)
    killed = kind == "deaf"
    assert isinstance(heard.of("second"), Lost if killed else Stopped)
    assert isinstance(heard.of("third"), Stopped if killed else Finished)


def test_a_process_that_dies_costs_the_attempt_it_computed_alone(
    executor: LocalExecutor, heard: Heard, tmp_path: Path
) -> None:
    file = tmp_path / "pids"
    for number in range(4):
        executor.submit(attempt(f"job {number}", 0.2, pid_file=str(file)))
    until(lambda: pids(file))
    os.kill(pids(file)[0], signal.SIGKILL)
    until(lambda: heard.of("job 3"))
    assert isinstance(heard.of("job 0"), Lost)
    assert [heard.of(f"job {number}") for number in (1, 2, 3)] == [Stopped()] * 3
    assert len(pids(file)) == 1, "the others did not begin"
    until(lambda: executor.status().ready)
    executor.submit(attempt("after"))
    until(lambda: heard.of("after"))


def test_closing_gives_back_what_waits(executor: LocalExecutor, heard: Heard) -> None:
    for number in range(4):
        executor.submit(attempt(f"job {number}", 600.0))
    begun = time.monotonic()
    executor.close()
    assert time.monotonic() - begun < 60.0, "the first alone would take 600 s"
    assert [heard.of(f"job {number}") for number in range(4)] == [Stopped()] * 4
