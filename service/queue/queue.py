"""The queue: takes waiting jobs from the database, has them run, writes what became of them.

One thread decides (`_loop`); outcomes are written by the executor's threads. The database row is the
truth: every write of a running job is guarded by its attempt, so that whoever lost a job cannot write it.
"""

from __future__ import annotations

import logging
import math
import os
import secrets
import socket
import threading
import time
from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from datetime import datetime, timedelta

from service.db.repositories import Attempt, JobRepository
from service.jobs.outputs import FailureKind, JobFailure, JobOutput, Report, ResultPiece
from service.queue.meters import Meters
from service.queue.running import Live, Running, StopReason, Waiters
from service.settings import logs, traces
from service.settings.settings import Settings
from service.workers.executor import Executor, ExecutorStatus, Failed, Finished, Lost, Outcome, Stopped

log = logging.getLogger("stickslip.queue")

_TROUBLE_SECONDS = 1.0
# Progress is told here as it comes. For other services and the time after a crash it is written: at most once
# a second of each job, and ten times a second of all that run here.
_WRITE_SECONDS, _WRITES_A_SECOND = 1.0, 10.0
_MOST_POINTS = 50_000


def _about(attempt: Attempt, seconds: float | None = None) -> AbstractContextManager[None]:
    """Put an attempt on the lines that are logged inside the block."""
    return logs.about(
        job=attempt.job_id, kind=attempt.kind, attempt=attempt.attempt, owner=attempt.owner or None,
        seconds=seconds,
    )  # fmt: skip


class JobQueue:
    """The running queue of one service.

    Parameters
    ----------
    jobs : where the jobs are.
    executor : what runs them.
    settings : lease, poll and time limit.
    waiters : told of progress and of every job that ends.
    meters : told how long jobs wait and run.
    """

    def __init__(
        self, jobs: JobRepository, executor: Executor, settings: Settings, waiters: Waiters, meters: Meters
    ) -> None:
        self._meters = meters
        self.owner = f"{socket.gethostname()}:{os.getpid()}:{secrets.token_hex(4)}"
        self._jobs = jobs
        self._executor = executor
        self._settings = settings
        self._waiters = waiters
        self._running: dict[str, Running] = {}
        self._lock = threading.Lock()
        self._claiming = threading.Lock()
        self._wake = threading.Event()
        self._stopping = False
        self._next_upkeep = 0.0
        self._thread = threading.Thread(target=self._loop, name="stickslip queue", daemon=True)

    def start(self) -> None:
        """Take back what a dead owner left running, start the workers and the queue."""
        self._jobs.keep_time()
        recovered = self._jobs.recover_abandoned(self.owner)
        if recovered.total:
            log.warning(
                "an earlier service ended while jobs ran: %d wait again, %d failed, %d dismissed",
                recovered.accepted,
                recovered.failed,
                recovered.dismissed,
            )
        self._executor.start(self)
        self._thread.start()

    def stop(self) -> None:
        """Stop taking jobs, end those that run within the grace and give them back to the queue."""
        self._stopping = True
        self._wake.set()
        if self._thread.ident is not None:
            self._thread.join()
        with self._lock:
            running = list(self._running.values())
        for entry in running:
            entry.stop = entry.stop or StopReason.SHUTDOWN
            with _about(entry.attempt):
                log.info("job %s is told to stop: %s", entry.attempt.job_id, entry.stop.value)
        self._executor.close()

    def wake(self) -> None:
        """A job was added, or something else happened that the queue should look at."""
        self._wake.set()

    def cancel_running(self, job_id: str) -> None:
        """Stop the job if it runs here; its row says already that its cancel was asked for."""
        with self._claiming, self._lock:
            entry = self._running.get(job_id)
        if entry is not None:
            self._ask_to_stop(entry, StopReason.CANCEL)

    def live(self, job_id: str) -> Live | None:
        """How far a job is that runs here, newer than its row."""
        with self._lock:
            entry = self._running.get(job_id)
        if entry is None:
            return None
        return Live(
            tag=entry.tag, attempt=entry.attempt.attempt, fraction=entry.fraction, points=entry.points,
            best=entry.best, found=entry.found,
        )  # fmt: skip

    def status(self) -> ExecutorStatus:
        """How the workers are."""
        return self._executor.status()

    @property
    def alive(self) -> bool:
        """Whether the queue takes jobs."""
        return self._thread.is_alive() and not self._stopping

    def reported(self, attempt: Attempt, report: Report) -> None:
        """From the executor: remember and pass on how far an attempt got; write it now and then."""
        entry = self._entry(attempt)
        if entry is None:
            return
        entry.found.extend(report.found[: _MOST_POINTS - len(entry.found)])
        if report.best is not None:
            entry.best, entry.unwritten = report.best, True
        if self._stopping:
            return
        entry.fraction, entry.points = fraction, points = report[:2]
        now = time.monotonic()
        pause = max(_WRITE_SECONDS, len(self._running) / _WRITES_A_SECOND)
        if now - entry.written < min(pause, self._settings.lease_seconds / 3.0):
            self._waiters.progress(attempt.job_id, fraction, points)
            return
        entry.written = now
        try:
            owned = self._jobs.report(attempt, fraction, points, self._lease_until(), entry.best)
            entry.unwritten = False
        except Exception:
            log.exception("job %s: its progress could not be written", attempt.job_id)
            return
        if owned:
            self._waiters.progress(attempt.job_id, fraction, points)
        else:
            self._ask_to_stop(entry, StopReason.LEASE)

    def kept(self, attempt: Attempt, pieces: Sequence[ResultPiece], *, anew: bool) -> None:
        """From the executor: store pieces for a later attempt, also while the service stops."""
        entry = self._entry(attempt)
        if entry is None:
            return
        fraction, points, until = entry.fraction, entry.points, self._lease_until()
        try:
            owned = self._jobs.keep(attempt, pieces, fraction, points, until, anew=anew)
        except Exception:
            log.exception("job %s: its checkpoint could not be written", attempt.job_id)
            return
        # The report that counts what is kept comes next, and is written as well.
        entry.written = -math.inf
        if not owned:
            self._ask_to_stop(entry, StopReason.LEASE)

    def ended(self, attempt: Attempt, outcome: Outcome) -> None:
        """From the executor: write what became of an attempt.

        If that cannot be written, the lease is not renewed any more and the job is taken back when it
        runs out.
        """
        entry = self._entry(attempt)
        seconds = None if entry is None else round(time.monotonic() - entry.started, 3)
        if seconds is not None:
            self._meters.ran.labels(attempt.kind, type(outcome).__name__.lower()).observe(seconds)
        try:
            with _about(attempt, seconds):
                if entry is not None and entry.unwritten and not isinstance(outcome, Finished):
                    # Of a design that was stopped it is all there is.
                    self._jobs.report(attempt, entry.fraction, entry.points, self._lease_until(), entry.best)
                self._conclude(attempt, outcome, None if entry is None else entry.stop)
        except Exception:
            log.exception("job %s: its outcome could not be written, it will be tried again", attempt.job_id)
        finally:
            with self._lock:
                # Given back, the job may run here again by now, as another attempt.
                if entry is not None and self._running.get(attempt.job_id) is entry:
                    del self._running[attempt.job_id]
            if entry is not None and entry.span is not None:
                entry.span.end(outcome=type(outcome).__name__.lower())
            self._waiters.ended(attempt.job_id)
            self._wake.set()

    def room(self) -> None:
        """From the executor: an attempt may be taken."""
        self._wake.set()

    def _entry(self, attempt: Attempt) -> Running | None:
        with self._lock:
            entry = self._running.get(attempt.job_id)
        return entry if entry is not None and entry.attempt == attempt else None

    def _lease_until(self) -> datetime:
        return self._jobs.now() + timedelta(seconds=self._settings.lease_seconds)

    def _ask_to_stop(self, entry: Running, reason: StopReason) -> None:
        entry.stop = entry.stop or reason
        with _about(entry.attempt):
            log.info("job %s is told to stop: %s", entry.attempt.job_id, entry.stop.value)
        self._executor.stop_attempt(entry.attempt)

    def _conclude(self, attempt: Attempt, outcome: Outcome, stop: StopReason | None) -> None:
        """Write an outcome, seen in the light of why the attempt was told to stop, if it was."""
        match outcome:
            case Finished(output) if stop is not StopReason.CANCEL:
                self._conclude_finished(attempt, output)
            case Failed(failure) if stop is not StopReason.CANCEL:
                self._note(attempt, "failed", written=self._jobs.fail(attempt, failure))
            case Stopped() | Lost() | Finished() | Failed() if stop is not None:
                self._conclude_stopped(attempt, stop)
            case Lost(reason):
                log.warning("job %s, attempt %d: %s", attempt.job_id, attempt.attempt, reason)
                self._jobs.lose(attempt, reason)
            case _:
                self._note(attempt, "given back", written=self._jobs.release(attempt))

    def _conclude_finished(self, attempt: Attempt, output: JobOutput) -> None:
        if output.shortfall is not None:
            failure = JobFailure(kind=FailureKind.GOAL, detail=output.shortfall)
            self._note(attempt, "did not reach its goal", written=self._jobs.fail(attempt, failure, output))
        elif self._jobs.succeed(attempt, output):
            log.info("job %s, attempt %d: successful", attempt.job_id, attempt.attempt)
        else:
            self._note(attempt, "dismissed", written=self._jobs.dismiss(attempt))

    def _conclude_stopped(self, attempt: Attempt, stop: StopReason) -> None:
        match stop:
            case StopReason.CANCEL:
                self._note(attempt, "dismissed", written=self._jobs.dismiss(attempt))
            case StopReason.SHUTDOWN:
                self._note(attempt, "given back", written=self._jobs.release(attempt))
            case StopReason.TIME:
                limit = self._seconds_of(attempt)
                failure = JobFailure(
                    kind=FailureKind.TIME_LIMIT,
                    detail=f"the computation took longer than the {limit:g} s one attempt may take",
                )
                self._note(attempt, "took too long", written=self._jobs.fail(attempt, failure))
            case StopReason.LEASE:
                self._note(attempt, "stopped", written=False)

    def _note(self, attempt: Attempt, what: str, *, written: bool) -> None:
        if written:
            log.info("job %s, attempt %d: %s", attempt.job_id, attempt.attempt, what)
        else:
            self._meters.lost.labels("own").inc()
            log.warning(
                "job %s, attempt %d lost its lease and wrote nothing", attempt.job_id, attempt.attempt
            )

    def _loop(self) -> None:
        """Until stopped: hand out jobs while there is room, keep the leases, look at the time."""
        while not self._stopping:
            self._wake.clear()
            try:
                while not self._stopping and self._take_some():
                    pass
                self._upkeep()
            except Exception:
                log.exception("the queue met an error and goes on")
                time.sleep(_TROUBLE_SECONDS)
            self._wake.wait(self._patience())

    def _take_some(self) -> bool:
        """Claim as many jobs as the executor takes and have them run; whether there may be more."""
        free = self._executor.free()
        if free <= 0:
            return False
        with self._claiming:
            attempts = self._jobs.claim_several(self.owner, self._lease_until(), free)
            now = time.monotonic()
            entries = [self._begun(one, now) for one in attempts]
            with self._lock:
                self._running.update((entry.attempt.job_id, entry) for entry in entries)
        for entry in entries:
            self._submit(entry)
            if entry.attempt.attempt == 1:
                waited = (self._jobs.now() - entry.attempt.created).total_seconds()
                self._meters.waited.labels(entry.attempt.kind).observe(max(waited, 0.0))
        return len(attempts) == free

    @staticmethod
    def _begun(attempt: Attempt, now: float) -> Running:
        span = traces.begin(
            "attempt", attempt.trace, job=attempt.job_id, kind=attempt.kind, attempt=attempt.attempt
        )
        if span is not None:
            attempt = replace(attempt, trace=span.carried)
        return Running(
            attempt=attempt, started=now, written=now, fraction=attempt.progress, points=attempt.points,
            span=span,
        )  # fmt: skip

    def _submit(self, entry: Running) -> None:
        attempt = entry.attempt
        with _about(attempt):
            words = "job %s (%s), attempt %d of %d"
            log.info(words, attempt.job_id, attempt.kind, attempt.attempt, attempt.max_attempts)
        self._executor.submit(attempt)
        if entry.stop is not None:
            # Told to stop before the executor had it.
            self._executor.stop_attempt(attempt)
        self._waiters.progress(attempt.job_id, attempt.progress, attempt.points)

    def _patience(self) -> float:
        """Time until something must be looked at without being woken [s]."""
        patience = min(self._settings.poll_seconds, self._settings.lease_seconds / 3.0)
        with self._lock:
            ends = [entry.started + self._seconds_of(entry.attempt) for entry in self._running.values()]
        return min(patience, max(min(ends, default=math.inf) - time.monotonic(), 0.01))

    def _seconds_of(self, attempt: Attempt) -> float:
        """The longest time an attempt may take [s]: the job's limit, never more than the service's."""
        own = attempt.seconds_limit
        return self._settings.job_seconds if own is None else min(own, self._settings.job_seconds)

    def _upkeep(self) -> None:
        """Renew leases, take back expired ones, stop what runs too long."""
        now = time.monotonic()
        with self._lock:
            running = list(self._running.values())
        for entry in running:
            if entry.stop is None and now - entry.started > self._seconds_of(entry.attempt):
                self._ask_to_stop(entry, StopReason.TIME)
        if now < self._next_upkeep:
            return
        self._next_upkeep = now + min(self._settings.lease_seconds / 3.0, self._settings.poll_seconds)
        self._jobs.keep_time()
        by_attempt = {id(entry.attempt): entry for entry in running}
        for lost in self._jobs.renew([entry.attempt for entry in running], self._lease_until()):
            self._ask_to_stop(by_attempt[id(lost)], StopReason.LEASE)
        cancelled = self._jobs.cancelled(self.owner) if running else ()
        for entry in running:
            if entry.stop is None and entry.attempt.job_id in cancelled:
                self._ask_to_stop(entry, StopReason.CANCEL)
        expired = self._jobs.recover_expired([entry.attempt.job_id for entry in running]).total
        if expired:
            log.warning("jobs whose lease ran out were taken back")
            self._meters.lost.labels("taken back").inc(expired)
            self._wake.set()
