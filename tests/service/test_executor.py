"""Worker processes and the attempts that wait in their pipes."""

import os
import signal
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path

import psutil
import pytest
from private_kinds import PRIVATE, IterationRequest, as_it_is
from service_helpers import PATIENCE, pids, until

from service.db.clock import utc_now
from service.db.repositories import Attempt
from service.jobs.outputs import Report, ResultPiece
from service.settings.settings import load_settings
from service.workers import processes
from service.workers.executor import Finished, Lost, Outcome, Stopped
from service.workers.executors import LocalExecutor
from service.workers.slot import MOST_AHEAD


class Heard:
    """What an executor said."""

    def __init__(self) -> None:
        self.ends: list[tuple[str, Outcome]] = []
        self.lock = threading.Lock()

    def reported(self, attempt: Attempt, report: Report) -> None:
        """Nothing is kept."""

    def kept(self, attempt: Attempt, pieces: Sequence[ResultPiece], *, anew: bool) -> None:
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
    return Attempt(
        job_id=name, kind=kind, spec=spec, attempt=1, max_attempts=3, lease_owner="me", created=utc_now()
    )


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


@pytest.mark.long
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


@pytest.mark.long
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


@pytest.mark.long
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


def fork_servers() -> list[psutil.Process]:
    """What the processes of this one are forked off."""
    return [
        child
        for child in psutil.Process().children()
        if child.status() != psutil.STATUS_ZOMBIE and "forkserver" in " ".join(child.cmdline())
    ]


def runs(pid: int) -> bool:
    """Whether a process runs; one that ended and was not collected yet does not."""
    try:
        return bool(psutil.Process(pid).status() != psutil.STATUS_ZOMBIE)
    except psutil.NoSuchProcess:
        return False


@pytest.fixture
def forked(monkeypatch: pytest.MonkeyPatch) -> None:
    """Processes are forked off one, whatever settings earlier tests started the first with."""
    if sys.platform != "linux":
        pytest.skip("processes are forked off one on Linux only")
    monkeypatch.setattr(processes, "_settings_of_the_first", None)


@pytest.mark.long
@pytest.mark.usefixtures("forked")
def test_workers_whose_fork_server_is_killed_compute_on_and_are_ended(heard: Heard, tmp_path: Path) -> None:
    """Another start, which makes a new fork server, looks at all of them: they are not taken for dead."""
    pace = load_settings().pace
    busy, idle, later = (
        LocalExecutor(PRIVATE.runs(), PRIVATE.warm_up, workers=1, grace_seconds=0.1, pace=pace)
        for _ in range(3)
    )
    ours = {child.pid for child in psutil.Process().children(recursive=True)}
    with ExitStack() as stack:
        for one in (busy, idle):
            one.start(heard)
            stack.callback(one.close)
        until(lambda: busy.status().ready and idle.status().ready)
        (source,) = fork_servers()
        workers = {child.pid for child in source.children()} - ours
        assert len(workers) == 2
        long = attempt("long", 600.0, "deaf", pid_file=str(tmp_path / "long"))
        busy.submit(long)
        idle.submit(attempt("short", 1.0, pid_file=str(tmp_path / "short")))
        until(lambda: pids(tmp_path / "long") and pids(tmp_path / "short"))
        source.kill()
        until(lambda: source not in fork_servers())
        later.start(heard)
        stack.callback(later.close)
        until(lambda: later.status().ready)
        assert source not in fork_servers(), "there is a new one"
        until(lambda: heard.of("short"))
        assert isinstance(heard.of("short"), Finished), "it went on"
        assert heard.of("long") is None
        assert busy.status().busy == 1
        busy.stop_attempt(long)
        until(lambda: heard.of("long"))
        assert isinstance(heard.of("long"), Lost)
        assert not any(runs(pid) for pid in pids(tmp_path / "long")), "lost means that nobody computes it"
        until(lambda: busy.status().ready)
        busy.submit(attempt("again"))
        until(lambda: heard.of("again"))
    assert not any(runs(pid) for pid in workers), "closing ends those too that an older one was the parent of"


@pytest.mark.long
@pytest.mark.usefixtures("forked")
def test_a_process_is_started_though_the_fork_server_dies_at_it(tmp_path: Path) -> None:
    processes.start(os.getpid, (), "first").join()
    (source,) = fork_servers()
    source.suspend()
    done = threading.Event()

    def begin() -> None:
        process = processes.start((tmp_path / "made").touch, (), "second")
        process.join()
        assert process.status() == 0
        process.close()
        done.set()

    thread = threading.Thread(target=begin)
    thread.start()
    time.sleep(0.2)  # it waits for the number of its process, which nobody will tell it
    source.kill()
    thread.join(PATIENCE)
    assert done.is_set()
    assert (tmp_path / "made").exists()
