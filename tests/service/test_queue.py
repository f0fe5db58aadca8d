"""Jobs survive the death of workers; what is cancelled stops; nobody writes what is not theirs."""

import os
import signal
import time
from pathlib import Path

import pytest
from private_kinds import PRIVATE, cannot_warm_up
from service_helpers import PATIENCE, MakeSettings, pids, promptly, settings_of, until
from sqlalchemy import update

from service.client.embedded import EmbeddedService
from service.db.models import Job, JobState
from service.errors import ConflictError, JobFailedError, QueueFullError
from service.jobs.kind_registry import Registry
from service.queue.core import Service
from service.queue.health import check


@pytest.fixture
def make_settings(url: str) -> MakeSettings:
    """Makes the settings of a service on either database."""
    return settings_of(url)


def gone(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return True
    return False


def test_a_job_runs_and_keeps_its_result(lasting: EmbeddedService) -> None:
    seen: list[tuple[float, int]] = []
    job, begin = lasting.submit("iteration", {"seconds": 0.5, "sweeps": 2}), time.monotonic()
    done = lasting.wait(job, on_progress=lambda fraction, points: seen.append((fraction, points)))
    elapsed = time.monotonic() - begin
    assert done.status is JobState.SUCCESSFUL
    assert done.attempt == 1
    assert done.progress == 1.0
    results = lasting.results(job)
    assert results.result["eigenvalue"] > 0.0
    assert [sweep.peak.value for sweep in results.sweeps] == pytest.approx(
        [results.result["eigenvalue"] + index for index in range(2)]
    )
    assert seen == sorted(seen)
    assert 2 <= len(seen) <= 10 * elapsed + 2, "progress at most ten times a second"


@pytest.mark.few(keep=("postgresql",))
def test_a_killed_worker_costs_an_attempt_and_the_job_is_done_once(
    embedded: EmbeddedService, tmp_path: Path
) -> None:
    file = tmp_path / "pids"
    job = embedded.submit("iteration", {"seconds": 0.6, "sweeps": 1, "pid_file": str(file)})
    until(lambda: pids(file))
    os.kill(pids(file)[0], signal.SIGKILL)
    done = embedded.wait(job, timeout=PATIENCE)
    assert (done.status, done.attempt) == (JobState.SUCCESSFUL, 2)
    assert len(pids(file)) == 2
    assert len(embedded.sweeps(job=job)) == 1


@pytest.mark.few(2)
def test_a_job_that_loses_every_worker_fails_with_the_reason(
    embedded: EmbeddedService, tmp_path: Path
) -> None:
    file = tmp_path / "pids"
    job = embedded.submit("iteration", {"seconds": 20.0, "pid_file": str(file)})
    for attempt in range(3):
        until(lambda attempt=attempt: len(pids(file)) > attempt)
        os.kill(pids(file)[attempt], signal.SIGKILL)
    done = embedded.wait(job, timeout=PATIENCE)
    assert (done.status, done.attempt) == (JobState.FAILED, 3)
    assert done.error["type"] == "worker-lost"
    assert "signal 9 (SIGKILL" in done.error["detail"]
    assert "attempt 3 of 3" in done.error["detail"]
    with pytest.raises(JobFailedError, match="SIGKILL"):
        embedded.results(job)
    after = embedded.wait(embedded.submit("iteration", {}), timeout=PATIENCE)
    assert after.status is JobState.SUCCESSFUL, "the next job gets a new worker"


# One that obeys stops long before it would be killed, one that does not is killed after 0.3 s.
@pytest.mark.few(3)
@pytest.mark.parametrize(
    ("kind", "grace", "within", "killed"), [("iteration", 30.0, 0.3, False), ("deaf", 0.3, 1.0, True)]
)
def test_a_cancelled_job_stops_within_a_second(
    make_settings: MakeSettings, tmp_path: Path, kind: str, grace: float, within: float, killed: bool
) -> None:
    def trial() -> float:
        file = tmp_path / "pids"
        file.unlink(missing_ok=True)
        job = embedded.submit(kind, {"seconds": 600.0, "pid_file": str(file)})
        until(lambda: pids(file))
        asked = time.monotonic()
        after = embedded.dismiss(job)
        took = time.monotonic() - asked
        assert after.status is JobState.DISMISSED
        assert after.cancel_requested
        assert gone(pids(file)[0]) == killed, "a worker that obeys is kept warm"
        with pytest.raises(ConflictError, match="dismissed"):
            embedded.results(job)
        return took

    with EmbeddedService(make_settings(grace_seconds=grace), PRIVATE) as embedded:
        promptly(trial, within)


def test_a_waiting_job_is_dismissed_at_once_and_an_ended_one_not(lasting: EmbeddedService) -> None:
    blocker = lasting.submit("iteration", {"seconds": 30.0})
    waiting = lasting.submit("iteration", {"seed": 11})
    assert lasting.dismiss(waiting).status is JobState.DISMISSED
    assert lasting.dismiss(waiting).status is JobState.DISMISSED, "twice is once"
    assert lasting.dismiss(blocker).status is JobState.DISMISSED
    done = lasting.submit("iteration", {"seed": 12})
    lasting.wait(done)
    with pytest.raises(ConflictError, match="ended before"):
        lasting.dismiss(done)


def test_higher_priority_first_then_in_order(lasting: EmbeddedService) -> None:
    blocker = lasting.submit("iteration", {"seconds": 60.0})
    until(lambda: lasting.job(blocker).status is JobState.RUNNING)
    # Several are taken at the same instant and wait in the pipe of one worker: they end one after the other.
    short = {"seconds": 0.05}
    low = lasting.submit("iteration", {"seed": 1, "priority": -1, **short})
    first = lasting.submit("iteration", {"seed": 2, **short})
    second = lasting.submit("iteration", {"seed": 3, **short})
    high = lasting.submit("iteration", {"seed": 4, "priority": 5, **short})
    lasting.dismiss(blocker)
    ended = {job: lasting.wait(job, timeout=PATIENCE).finished for job in (low, first, second, high)}
    assert sorted(ended, key=ended.__getitem__) == [high, first, second, low]


@pytest.mark.parametrize(
    ("kind", "error", "words"),
    [
        ("bad-scene", "scene", "`mu` must be >= 0"),
        ("bad-setting", "setting", "`harmonics` must be at least 1"),
        ("broken", "internal", "ZeroDivisionError"),
        ("unsendable", "internal", "unexpected"),
        ("not-json", "internal", "int64 is not JSON serializable"),
        ("falls-short", "goal-not-reached", "raise `limit`"),
    ],
)
def test_a_deterministic_error_is_not_tried_again(
    lasting: EmbeddedService, kind: str, error: str, words: str
) -> None:
    done = lasting.wait(lasting.submit(kind, {"sweeps": 1}), timeout=PATIENCE)
    assert (done.status, done.attempt) == (JobState.FAILED, 1)
    assert done.error["type"] == error
    assert words in done.error["detail"]
    if kind == "bad-scene":
        assert done.error["issues"][0]["pointer"] == "/contacts/0/mu"
    if kind == "falls-short":
        kept = lasting.results(done.id)
        assert kept.status is JobState.FAILED
        assert kept.result["eigenvalue"] > 0.0
        assert len(kept.sweeps) == 1


def test_numbers_that_are_not_finite_are_null(lasting: EmbeddedService) -> None:
    job = lasting.submit("not-finite", {})
    lasting.wait(job, timeout=PATIENCE)
    assert lasting.results(job).result == {"mean": None, "list": [None, 1.0]}


@pytest.mark.few(2)
def test_memory_that_runs_out_is_tried_again(make_settings: MakeSettings) -> None:
    """Without a limit: another attempt may find more of it free."""
    with EmbeddedService(make_settings(worker_memory_bytes=0), PRIVATE) as service:
        done = service.wait(service.submit("out-of-memory", {}), timeout=PATIENCE)
    assert (done.status, done.attempt) == (JobState.FAILED, 3)
    assert "ran out of memory" in done.error["detail"]


@pytest.mark.few(2)
def test_a_worker_that_meets_its_memory_limit_fails_the_job_and_goes_on(make_settings: MakeSettings) -> None:
    with EmbeddedService(make_settings(worker_memory_bytes=100_000_000), PRIVATE) as service:
        small = service.wait(service.submit("allocate", {"size": 500}), timeout=PATIENCE)
        large = service.wait(service.submit("allocate", {"size": 500, "seed": 200}), timeout=PATIENCE)
        after = service.wait(service.submit("allocate", {"size": 400}), timeout=PATIENCE)
        pids = [service.results(done.id).result["pid"] for done in (small, after)]
    assert (large.status, large.attempt) == (JobState.FAILED, 1)
    assert large.error["type"] == "memory-limit"
    assert "100 MB" in large.error["detail"]
    assert pids[0] == pids[1], "the same process computes what comes after"


@pytest.mark.few(2)
def test_a_job_that_takes_too_long_fails(make_settings: MakeSettings) -> None:
    with EmbeddedService(make_settings(job_seconds=0.3), PRIVATE) as service:
        done = service.wait(service.submit("deaf", {"seconds": 60.0}), timeout=PATIENCE)
    assert done.status is JobState.FAILED
    assert done.error["type"] == "time-limit"
    assert "0.3 s" in done.error["detail"]


@pytest.mark.few(2)
def test_workers_compute_with_one_thread_and_this_process_keeps_its_own(
    make_settings: MakeSettings, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    with EmbeddedService(make_settings(), PRIVATE) as service:
        job = service.submit("threads", {})
        service.wait(job)
        assert set(service.results(job).result.values()) == {"1"}
    assert os.environ["OMP_NUM_THREADS"] == "7"
    assert "MKL_NUM_THREADS" not in os.environ


@pytest.mark.few(keep=("postgresql",))
def test_stopping_gives_running_jobs_back_without_an_attempt(
    make_settings: MakeSettings, tmp_path: Path
) -> None:
    file = tmp_path / "pids"
    spec = {"seconds": 1.0, "pid_file": str(file)}
    with EmbeddedService(make_settings(), PRIVATE) as service:
        jobs = [service.submit(kind, spec) for kind in ("deaf", "iteration")]
        until(lambda: pids(file))
    assert all(gone(pid) for pid in pids(file))
    with EmbeddedService(make_settings(), PRIVATE) as service:
        done = [service.wait(job, timeout=PATIENCE) for job in jobs]
    assert [(job.status, job.attempt) for job in done] == [(JobState.SUCCESSFUL, 1)] * 2


@pytest.mark.few(2)
def test_a_worker_killed_while_idle_costs_nothing(embedded: EmbeddedService, tmp_path: Path) -> None:
    file = tmp_path / "pids"
    embedded.wait(embedded.submit("iteration", {"pid_file": str(file)}))
    os.kill(pids(file)[0], signal.SIGKILL)
    until(lambda: gone(pids(file)[0]))
    time.sleep(0.05)
    done = embedded.wait(embedded.submit("iteration", {"seed": 1}), timeout=PATIENCE)
    assert (done.status, done.attempt) == (JobState.SUCCESSFUL, 1)


def test_a_spec_computed_before_is_answered_at_once(lasting: EmbeddedService, tmp_path: Path) -> None:
    file = tmp_path / "pids"
    spec = {"pid_file": str(file), "sweeps": 1}
    first = lasting.submit("iteration", spec)
    lasting.wait(first)
    again = lasting.submit("iteration", spec)
    job = lasting.job(again)
    assert (job.status, job.result_of) == (JobState.SUCCESSFUL, first)
    assert lasting.results(again).result == lasting.results(first).result
    assert [s.id for s in lasting.results(again).sweeps] == [s.id for s in lasting.results(first).sweeps]
    fresh = lasting.submit("iteration", {**spec, "fresh": True})
    assert lasting.wait(fresh).result_of is None
    assert len(pids(file)) == 2


def test_a_job_may_take_less_time_than_the_service_allows(lasting: EmbeddedService) -> None:
    job = lasting.submit("deaf", {"seconds": 60.0, "max_seconds": 0.3})
    done = lasting.wait(job, timeout=PATIENCE)
    assert (done.status, done.attempt) == (JobState.FAILED, 1), "what took too long is not tried again"
    assert done.error is not None
    assert done.error["type"] == "time-limit"
    assert "longer than the 0.3 s" in done.error["detail"]


@pytest.mark.few(keep=("postgresql",))
def test_a_lease_is_renewed_while_a_silent_job_runs(make_settings: MakeSettings) -> None:
    settings = make_settings(lease_seconds=1.5, progress_seconds=60.0)
    with EmbeddedService(settings, PRIVATE) as service:
        done = service.wait(service.submit("deaf", {"seconds": 2.1}), timeout=PATIENCE)
    assert (done.status, done.attempt) == (JobState.SUCCESSFUL, 1)


@pytest.mark.few(keep=("postgresql",))
def test_an_attempt_whose_job_was_taken_is_stopped_and_writes_nothing(make_settings: MakeSettings) -> None:
    service = Service(make_settings(), PRIVATE)
    service.start()
    try:
        job, _ = service.submit({"kind": "iteration", "seconds": 60.0, "sweeps": 1})
        until(lambda: service.job(job.id).state is JobState.RUNNING)
        with service.database.writing() as connection:
            connection.execute(update(Job).values(lease_owner="another", attempt=7, progress=0.25))
        until(lambda: service.queue.status().busy == 0)
        row = service.job(job.id)
        assert (row.state, row.attempt, row.progress) == (JobState.RUNNING, 7, 0.25)
        assert service.jobs.result(job.id) is None
    finally:
        service.stop()


@pytest.mark.few(2)
def test_a_full_queue_takes_no_more(make_settings: MakeSettings) -> None:
    with EmbeddedService(make_settings(queue_limit=2), PRIVATE) as service:
        blocker = service.submit("iteration", {"seconds": 30.0})
        until(lambda: service.job(blocker).status is JobState.RUNNING)
        known = service.submit("iteration", {"seed": 1}, idempotency_key="known")
        service.submit("iteration", {"seed": 2})
        with pytest.raises(QueueFullError, match="2 jobs wait already"):
            service.submit("iteration", {"seed": 3})
        assert service.submit("iteration", {"seed": 1}, idempotency_key="known") == known


@pytest.mark.few(2)
def test_workers_that_do_not_come_up_are_told(make_settings: MakeSettings) -> None:
    service = Service(make_settings(), Registry(PRIVATE, warm_up=cannot_warm_up))
    service.start()
    try:
        until(lambda: service.queue.status().trouble)
        health = check(service)
        assert not health.ready
        assert "ended with status 1 before it was ready" in health.trouble[0]
    finally:
        service.stop()
