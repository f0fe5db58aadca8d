"""A long job that is interrupted goes on from what it kept, and computes what it would have computed."""

import multiprocessing as mp
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import timedelta
from functools import cache
from hashlib import sha256
from typing import Any

import numpy as np
import pytest
from private_kinds import PRIVATE
from service_helpers import PATIENCE, MakeSettings, settings_of, until
from sqlalchemy import func, select, update

import solver
from service.db.clock import utc_now
from service.db.engine import Database
from service.db.models import Checkpoint, JobState
from service.db.repositories import Attempt, JobRepository, NewJob
from service.jobs.checkpoints import Checkpoints, KeptPieces, UnusableError, packed, unpacked
from service.jobs.job_parts import PartStoppedError
from service.jobs.kinds import SHIPPED
from service.jobs.outputs import FailureKind, JobFailure, JobOutput, Pace, ResultPiece, ShouldStop, Silent
from service.queue.core import Service

DISK = solver.annulus(solver.load_scene("bladed-disk")).to_dict()
SWEEP = {"scene": DISK, "from": 500, "to": 900, "harmonics": 13}
MAP = {"scene": "two-dof", "parameter": "damper.N0", "from": 60, "to": 160, "steps": 20, "frequencies": 3000,
       "ridge": False, "harmonics": 3}  # fmt: skip
REQUEST = "e" * 64
SLOW = {"slow-sweep": ("sweep", SWEEP), "slow-map": ("map", MAP)}


@pytest.fixture
def make_settings(url: str) -> MakeSettings:
    """Makes the settings of a service on either database, whose jobs keep what they have all the time."""
    make = settings_of(url)
    return lambda **values: make(**{"checkpoint_seconds": 0.05, "grace_seconds": 2.0, **values})


@contextmanager
def running(make_settings: MakeSettings) -> Iterator[Service]:
    service = Service(make_settings(), PRIVATE)
    service.start()
    try:
        yield service
    finally:
        service.stop()


class _Nowhere:
    """Scenes by name, of those shipped only."""

    def scene_body(self, name: str) -> Any:
        return solver.load_scene(name).to_dict()


@cache
def expected(name: str) -> JobOutput:
    """What the job computes without an interruption, in this process."""
    return run_here(name, Checkpoints.none(), lambda: False)


def timeless(value: Any) -> Any:
    """Without the time things took."""
    if isinstance(value, dict):
        return {key: timeless(one) for key, one in value.items() if key != "seconds"}
    return [timeless(one) for one in value] if isinstance(value, list) else value


def kept(database: Database, job_id: str) -> list[tuple[int, int]]:
    """Part and attempt of every piece that a job keeps."""
    query = select(Checkpoint.part, Checkpoint.attempt).where(Checkpoint.job_id == job_id)
    with database.reading() as connection:
        return [tuple(row) for row in connection.execute(query.order_by(Checkpoint.part))]


def is_what_it_would_have_been(service: Service, job_id: str, name: str) -> None:
    found, whole = service.results(job_id), expected(name)
    assert timeless(found.result) == timeless(whole.result)
    assert len(found.sweeps) == len(whole.sweeps)
    for row, record in zip(found.sweeps, whole.sweeps, strict=True):
        stored = service.stored.arrays(row.id)
        assert stored.keys() == record.arrays.keys()
        for array in stored:
            np.testing.assert_array_equal(stored[array].array(), record.arrays[array].array())
    with service.database.reading() as connection:
        assert connection.execute(select(func.count()).select_from(Checkpoint)).scalar_one() == 0


@pytest.mark.parametrize(
    ("url", "name"),
    [
        ("postgresql", "slow-sweep"),
        pytest.param("sqlite", "slow-sweep", marks=pytest.mark.long),
        pytest.param("sqlite", "slow-map", marks=pytest.mark.long),
        pytest.param("postgresql", "slow-map", marks=pytest.mark.long),
    ],
    indirect=["url"],
)
def test_a_killed_child_is_followed_by_one_that_goes_on(make_settings: MakeSettings, name: str) -> None:
    with running(make_settings) as service:
        job = service.submit({**SLOW[name][1], "kind": name})[0].id
        until(lambda: len(kept(service.database, job)) >= 3)
        before = service.job(job)
        assert before.progress > 0.0
        seen: list[float] = []
        done = threading.Event()
        watcher = threading.Thread(target=watch, args=(service, job, seen, done))
        watcher.start()
        os.kill(next(p.pid for p in mp.active_children() if p.name == "stickslip worker"), signal.SIGKILL)
        row = service.wait(job, PATIENCE)
        done.set()
        watcher.join()
        assert (row.state, row.attempt) == (JobState.SUCCESSFUL, 2)
        assert min(seen) > 0.5 * before.progress, "the progress does not begin anew"
        is_what_it_would_have_been(service, job, name)


def watch(service: Service, job: str, seen: list[float], done: threading.Event) -> None:
    while not done.wait(0.01):
        live = service.queue.live(job)
        seen.append(service.job(job).progress if live is None else live.fraction)


@pytest.mark.long
@pytest.mark.parametrize("name", SLOW)
def test_a_stopped_service_leaves_what_its_jobs_have_to_the_next(
    make_settings: MakeSettings, name: str
) -> None:
    with running(make_settings) as service:
        job = service.submit({**SLOW[name][1], "kind": name})[0].id
        until(lambda: len(kept(service.database, job)) >= 2)
    with running(make_settings) as service:
        row = service.job(job)
        assert row.progress > 0.0
        assert row.attempt <= 1, "an orderly stop costs no attempt"
        before = kept(service.database, job)
        assert len(before) >= 2
        assert service.wait(job, PATIENCE).state is JobState.SUCCESSFUL
        is_what_it_would_have_been(service, job, name)


def run_here(name: str, checkpoints: Checkpoints, should_stop: ShouldStop) -> JobOutput:
    """Run a kind in this process, as a worker does."""
    kind, body = SHIPPED[SLOW[name][0]], SLOW[name][1]
    spec = kind.resolve(kind.request.model_validate(body), _Nowhere()).spec
    return SHIPPED.runs()[kind.name](spec, Silent(), should_stop, checkpoints)


def stopped_midway(name: str) -> list[ResultPiece]:
    """What a run keeps that is stopped after some stretches or parts."""
    sent: list[KeptPieces] = []
    calls = iter(range(100))
    with suppress(PartStoppedError):
        run_here(name, Checkpoints("a", [], sent.append, pace(), REQUEST), lambda: next(calls) >= 4)
    return [one for message in sent for one in message.pieces]


@pytest.mark.parametrize("name", SLOW)
def test_a_run_goes_on_from_what_another_kept(name: str) -> None:
    kept_before = stopped_midway(name)
    assert len(kept_before) >= 1
    sent: list[KeptPieces] = []
    again = run_here(name, Checkpoints("a", kept_before, sent.append, pace(), REQUEST), lambda: False)
    assert timeless(again.result) == timeless(expected(name).result)
    new = [one.part for message in sent for one in message.pieces]
    assert new
    assert not set(new) & {one.part for one in kept_before}, "nothing is computed twice"


@pytest.mark.few(2)
@pytest.mark.parametrize("name", SLOW)
def test_what_cannot_be_used_is_not(name: str, caplog: pytest.LogCaptureFixture) -> None:
    good = stopped_midway(name)
    foreign = packed(0, {"walk": np.zeros(3)}, REQUEST)
    for bad in (foreign, ResultPiece(part=0, sha256="0" * 64, data=good[0].data)):
        caplog.clear()
        sent: list[KeptPieces] = []
        found = [bad, *good[1:]]
        output = run_here(name, Checkpoints("a", found, sent.append, pace(), REQUEST), lambda: False)
        assert timeless(output.result) == timeless(expected(name).result)
        assert caplog.text.count("job a begins anew, its checkpoint cannot be used: ") == 1
        assert [message.anew for message in sent] == [True] + [False] * (len(sent) - 1)


def test_the_beginning_of_another_branch_is_not_used(caplog: pytest.LogCaptureFixture) -> None:
    good = stopped_midway("slow-sweep")
    kind = SHIPPED["sweep"]
    body = {**SWEEP, "set": {"shroud.N0": 90.0}, "from": 590}
    spec = kind.resolve(kind.request.model_validate(body), _Nowhere()).spec
    found = Checkpoints("a", good, lambda _kept: None, pace(), REQUEST)
    output = SHIPPED.runs()["sweep"](spec, Silent(), lambda: False, found)
    whole = kind.run(spec, Silent(), lambda: False)
    assert timeless(output.result) == timeless(whole.result)
    assert "must be the beginning of the same branch" in caplog.text


def test_a_branch_is_not_followed_from_that_of_another_request(caplog: pytest.LogCaptureFixture) -> None:
    """Its last point may well solve the equations here: the digest tells that the rest does not belong."""
    good = stopped_midway("slow-sweep")
    kind = SHIPPED["sweep"]
    spec = kind.resolve(kind.request.model_validate({**SWEEP, "from": 510}), _Nowhere()).spec
    found = Checkpoints("a", good, lambda _kept: None, pace(), "f" * 64)
    output = SHIPPED.runs()["sweep"](spec, Silent(), lambda: False, found)
    assert timeless(output.result) == timeless(kind.run(spec, Silent(), lambda: False).result)
    assert min(output.sweeps[0].arrays["parameter"].array()) >= 510.0
    assert "piece 0 is of another request" in caplog.text


def test_a_checkpoint_damaged_in_the_database_is_replaced(
    database: Database, caplog: pytest.LogCaptureFixture
) -> None:
    """It is handed out as it is: who uses it compares the checksums, and what is kept next replaces it."""
    jobs, later = JobRepository(database), utc_now() + timedelta(seconds=60)
    jobs.submit(new_job(), queue_limit=10)
    attempt = claimed(jobs)
    assert jobs.keep(attempt, [piece(0), piece(1)], 0.5, 7, later)
    assert jobs.release(attempt)
    with database.writing() as connection:
        connection.execute(update(Checkpoint).where(Checkpoint.part == 1).values(data=b"something else"))
    again = claimed(jobs)
    assert [one.part for one in again.saved] == [0, 1]

    def keep(message: KeptPieces) -> None:
        assert jobs.keep(again, message.pieces, 0.1, 1, later, anew=message.anew)

    checkpoints = Checkpoints(again.job_id, again.saved, keep, pace(), REQUEST)
    assert checkpoints.found() == {}
    assert f"job {attempt.job_id} begins anew, its checkpoint cannot be used: piece 1 does" in caplog.text
    checkpoints.add(0, {"values": np.zeros(2)})
    assert [part for part, _ in kept(database, attempt.job_id)] == [0]


def new_job() -> NewJob:
    return NewJob(
        kind="sweep",
        request={},
        spec={},
        spec_hash="0" * 64,
        request_hash="0" * 64,
        max_attempts=2,
        fresh=True,
    )


def claimed(jobs: JobRepository, owner: str = "one") -> Attempt:
    attempt = jobs.claim(owner, utc_now() + timedelta(seconds=60))
    assert attempt is not None
    return attempt


def piece(part: int) -> ResultPiece:
    return packed(part, {"values": np.arange(part + 3.0)}, REQUEST)


ENDS = {
    "succeed": lambda jobs, attempt: jobs.succeed(attempt, JobOutput(result={})),
    "fail": lambda jobs, attempt: jobs.fail(attempt, JobFailure(kind=FailureKind.GOAL, detail="no")),
    "dismiss": lambda jobs, attempt: jobs.dismiss(attempt),
    "cancel": lambda jobs, attempt: jobs.release(attempt) and jobs.cancel(attempt.job_id),
    "lose": lambda jobs, attempt: (
        jobs.lose(attempt, "died") and jobs.lose(claimed(jobs), "died again").failed
    ),
}


@pytest.mark.parametrize("end", ENDS)
def test_what_was_kept_is_gone_when_the_job_ends(database: Database, end: str) -> None:
    jobs = JobRepository(database)
    jobs.submit(new_job(), queue_limit=10)
    attempt = claimed(jobs)
    assert (attempt.saved, attempt.progress, attempt.points) == ((), 0.0, 0)
    assert jobs.keep(attempt, [piece(0), piece(1)], 0.5, 7, utc_now() + timedelta(seconds=60))
    assert kept(database, attempt.job_id) == [(0, 1), (1, 1)]
    assert ENDS[end](jobs, attempt)
    assert kept(database, attempt.job_id) == []


@pytest.mark.parametrize("way", ["release", "lose", "abandon"])
def test_what_was_kept_waits_for_the_next_attempt(database: Database, way: str) -> None:
    jobs = JobRepository(database)
    for _ in range(2):
        jobs.submit(new_job(), queue_limit=10)
    attempt, other = claimed(jobs), claimed(jobs)
    until_then = utc_now() - timedelta(seconds=1)
    assert jobs.keep(attempt, [piece(0)], 0.25, 3, until_then)
    assert jobs.report(attempt, 0.5, 9, until_then)
    assert jobs.report(other, 0.75, 9, until_then)
    if way == "abandon":
        assert jobs.recover_abandoned("two").accepted == 2
    else:
        for one in (attempt, other):
            assert jobs.release(one) if way == "release" else jobs.lose(one, "died").accepted
    rows = [jobs.get(one.job_id) for one in (attempt, other)]
    assert [(row.progress, row.points) for row in rows if row is not None] == [(0.5, 9), (0.0, 0)]
    again, without = claimed(jobs, "two"), claimed(jobs, "two")
    assert (again.saved, again.progress, again.points) == ((piece(0),), 0.5, 9)
    assert (without.saved, without.progress, without.points) == ((), 0.0, 0)
    assert not jobs.keep(attempt, [piece(1)], 0.9, 9, until_then), "it owns the job no more"
    assert jobs.keep(again, [piece(1)], 0.6, 10, until_then)
    assert [part for part, _ in kept(database, again.job_id)] == [0, 1]
    assert jobs.keep(again, [piece(0)], 0.1, 1, until_then, anew=True)
    assert [part for part, _ in kept(database, again.job_id)] == [0]


def pace(**values: Any) -> Pace:
    return Pace(**{"progress_seconds": 0.1, "checkpoint_seconds": 0.0, "checkpoint_bytes": 10**9, **values})


def test_a_job_keeps_no_more_than_it_may(caplog: pytest.LogCaptureFixture) -> None:
    sent: list[KeptPieces] = []
    checkpoints = Checkpoints("a", [piece(0)], sent.append, pace(checkpoint_bytes=10_000), REQUEST)
    for part in range(1, 50):
        checkpoints.add(part, {"values": np.zeros(100)})
    stored = sum(len(one.data) for message in sent for one in message.pieces)
    assert 5_000 < stored <= 10_000
    assert not checkpoints.due()
    assert caplog.text.count("keeps no more") == 1
    nothing = Checkpoints("a", [], sent.append, pace(checkpoint_bytes=0), REQUEST)
    nothing.add(0, {"values": np.zeros(1)})
    assert not nothing.due()


def test_pieces_are_sent_when_it_is_time_or_the_run_is_stopped() -> None:
    sent: list[KeptPieces] = []
    checkpoints = Checkpoints("a", [], sent.append, pace(checkpoint_seconds=1000.0), REQUEST)
    checkpoints.add(0, {"values": np.zeros(2)})
    checkpoints.add(1, {"values": np.zeros(2)})
    assert sent == []
    checkpoints.flush()
    checkpoints.flush()
    assert [[one.part for one in message.pieces] for message in sent] == [[0, 1]]
    assert not sent[0].anew
    checkpoints.begin_anew("it is another's")
    checkpoints.add(0, {"values": np.ones(2)})
    checkpoints.flush()
    assert sent[1].anew


def test_pieces_are_numbers_of_this_version(monkeypatch: pytest.MonkeyPatch) -> None:
    one = packed(3, {"a": np.arange(4.0), "b": np.array([1, 2])}, REQUEST)
    arrays = unpacked(one, REQUEST)
    np.testing.assert_array_equal(arrays["a"], np.arange(4.0))
    assert set(arrays) == {"a", "b"}
    with pytest.raises(ValueError, match="Object arrays cannot be saved"):
        packed(0, {"a": np.array([object()])}, REQUEST)
    with pytest.raises(UnusableError, match="piece 3 does not match its checksum"):
        unpacked(ResultPiece(part=3, sha256="0" * 64, data=one.data), REQUEST)
    with pytest.raises(UnusableError, match="piece 3 is of another request"):
        unpacked(one, "f" * 64)
    garbage = b"PK\x03\x04 no archive"
    with pytest.raises(UnusableError, match="cannot be read"):
        unpacked(ResultPiece(part=0, sha256=sha256(garbage).hexdigest(), data=garbage), REQUEST)
    monkeypatch.setattr("service.jobs.checkpoints.version", lambda _name: "99.0")
    with pytest.raises(UnusableError, match="of another version"):
        unpacked(one, REQUEST)
