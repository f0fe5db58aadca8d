"""The service itself, without HTTP: what the routes, the embedded handle and the tests call."""

from __future__ import annotations

import json
import logging
import math
import re
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from queue import Empty, SimpleQueue
from typing import Any

from service.auth.allowances import Storage, highest_priority, share
from service.auth.callers import KEYLESS, Caller
from service.db import revisions
from service.db.clock import Clock
from service.db.engine import Database
from service.db.models import JobState
from service.db.postgresql import ACCEPTED, CANCEL, ENDED, LIVE, WATCH, Notices
from service.db.repositories import (
    JobRepository,
    JobRow,
    NewJob,
    ResultRepository,
    SceneRepository,
    UploadRepository,
)
from service.db.repositories.owned import KeyRepository, Projects, StorageRepository, visible
from service.db.repositories.run_repository import Runs, RunWords, Shares
from service.errors import ConflictError, InvalidRequestError, JobFailedError, NotFoundError
from service.jobs import answering
from service.jobs.answering import Prepared, prepared
from service.jobs.kind_registry import ABOUT_THE_RUN, JobRequest, Registry, request_in
from service.jobs.outputs import OnProgress
from service.jobs.stored_figures import DESIGN, SWEEP, DesignRecord, SweepRecord
from service.queue.lanes import Lanes
from service.queue.meters import Meters
from service.queue.queue import JobQueue
from service.queue.retention import Retention
from service.queue.running import Elsewhere, Event, Live, Waiters
from service.queue.scene_store import SceneStore
from service.settings import traces
from service.settings.kinds import registry_of
from service.settings.settings import Settings
from service.uploads.uploads import Uploads
from service.workers.executors import executor_of
from service.workers.warm_pool import Answers, Previews
from solver.jit import compiler_process

log = logging.getLogger("stickslip.service")

SOLVER_VERSION = version("stickslip")

_LOOK_AGAIN_SECONDS = 2.0
FIRST_KERNELS = 200
"""About so many are compiled before a worker begins; which ones is found on the way."""
_LEAST_KERNELS = 5
"""Seen compiled before it is said how long the rest takes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Results:
    """What a finished job left; `text` is the JSON of its result."""

    job: JobRow
    text: str
    sweeps: list[SweepRecord]

    @property
    def result(self) -> dict[str, Any]:
        """The result."""
        found: dict[str, Any] = json.loads(self.text)
        return found


@dataclass(slots=True)
class Compiler:
    """How far the process is that compiles, by what was seen of it."""

    done: int = 0
    of: int = FIRST_KERNELS
    first: tuple[int, float] | None = None

    def look(self) -> float | None:
        """Look anew; the seconds that the rest takes at the pace seen so far, None while it is unknown."""
        found, now = re.match(r"(\d+) of (\d+)", compiler_process.told()), time.monotonic()
        if found:
            self.done, self.of = int(found[1]), max(self.of, int(found[2]))
            self.first = self.first or (self.done, now)
        before, since = self.first or (0, now)
        if self.done - before < _LEAST_KERNELS or self.done >= self.of:
            return None
        return (self.of - self.done) * (now - since) / (self.done - before)


@dataclass(frozen=True, slots=True, kw_only=True)
class WholeDesign:
    """A stored design with the job that found it and the result of that job."""

    row: DesignRecord
    job: JobRow
    result: dict[str, Any]


class Service:
    """Database, queue and workers of one service.

    What it is asked for by an id is a NotFoundError where there is none that the caller may see.

    Parameters
    ----------
    settings : its settings.
    registry : the kinds of job it runs; those shipped and those of the setting `kinds` if not given.
    now : its clock (see `JobRepository`).
    """

    def __init__(
        self, settings: Settings, registry: Registry | None = None, now: Clock | None = None
    ) -> None:
        self.settings = settings
        self.registry = registry_of(settings.kinds) if registry is None else registry
        self.database = Database(
            settings.database, settings.database_connections, settings.database_seconds, settings.arrays
        )
        self.jobs = JobRepository(self.database, now)
        self.stored = ResultRepository(self.database)
        self.keys = KeyRepository(self.database)
        self.storage = Storage(StorageRepository(self.database), settings)
        self.uploads = Uploads(UploadRepository(self.database), settings, self.storage)
        self.scenes = SceneStore(SceneRepository(self.database), self.uploads)
        self.runs = Runs(self.database, self.jobs.now, settings.bin_days)
        self.projects = Projects(self.database, self.jobs.now, settings.bin_days)
        self.shares = Shares(self.database, self.runs, self.jobs.now)
        self.waiters = Waiters()
        self.meters = Meters()
        self.lanes = Lanes(settings.database_seconds, self.meters)
        self.previews = Previews(settings.preview_seconds, memory_bytes=settings.answer_memory_bytes)
        self.answers = Answers(
            answering.runs(self.registry, self.previews.registry), answering.warm_up, settings
        )
        self.queue = JobQueue(
            self.jobs, executor_of(settings, self.registry), settings, self.waiters, self.meters
        )
        self.retention = Retention(self.database, settings, self.jobs.now)
        self._elsewhere: Elsewhere | None = None
        self._notices = None if self.database.exclusive else self._make_notices()
        self.stopping = threading.Event()
        self.compiling = False
        """Whether workers wait for their kernels, and what somebody waits for is interpreted."""
        self.compiler = Compiler()
        self._open = False

    def _make_notices(self) -> Notices:
        made = Notices(
            self.database.own_connection, self.queue.wake,
            {
                ENDED: self.waiters.ended_elsewhere, CANCEL: self.queue.cancel_running,
                WATCH: lambda text: elsewhere.watched(text),
                LIVE: lambda text: elsewhere.told(text),
            },
        )  # fmt: skip
        ask, tell = partial(made.tell, WATCH), partial(made.tell, LIVE)
        elsewhere = Elsewhere(self.waiters, self.queue.live, ask, tell)
        self._elsewhere = elsewhere
        self.waiters.relay = partial(made.tell, ENDED)
        return made

    def open(self) -> None:
        """Lock SQLite's file and check or make the tables; nothing happens if that was done before.

        Raises
        ------
        DatabaseInUseError
            If another service has the file.
        WrongRevisionError
            If the tables are not this version's.
        DatabaseError
            If the database cannot be used.
        ConfigurationError
            If there are to be traces and their extra is not installed.
        """
        if self._open:
            return
        traces.configure(on=self.settings.traces)
        self.database.acquire()
        try:
            revisions.prepare(self.settings.database)
        except BaseException:
            self.database.close()
            raise
        self._open = True

    def start(self) -> None:
        """Open the database, start queue and workers; `open` lists the errors."""
        self.open()
        self.compiling = compiler_process.missing()
        if self.compiling:
            compiler_process.begin()
            # What this process loads, and does not compute with, waits for nobody.
            compiler_process.interpret()
        try:
            self.queue.start()
        except BaseException:
            self.database.close()
            raise
        self.retention.start()
        if self._notices is not None and self._elsewhere is not None:
            self._elsewhere.start()
            self._notices.start()
        log.info("database %s, %d workers", self.database.name, self.settings.workers)

    def stop(self) -> None:
        """End the workers, give running jobs back to the queue, close the database."""
        self.stop_waiting()
        self.previews.close()
        self.answers.close()
        self.retention.stop()
        self.queue.stop()
        if self._notices is not None and self._elsewhere is not None:
            self._elsewhere.stop()
            self._notices.stop()
        self.database.close()
        traces.flush()
        self._open = False

    def stop_waiting(self) -> None:
        """End every request that waits for a job."""
        self.stopping.set()
        self.waiters.wake_all()

    def submit(
        self, body: Mapping[str, Any], idempotency_key: str | None = None, caller: Caller = KEYLESS,
        checked: tuple[JobRequest, Prepared] | None = None,
    ) -> tuple[JobRow, bool]:  # fmt: skip
        """Accept a job of the caller's; whether it is new, and not made before under its idempotency key.

        Parameters
        ----------
        checked : what the body asks for and was resolved to, beside this process if it is a stranger's.

        Raises
        ------
        InvalidRequestError
            Lists everything that is wrong with the body.
        IdempotencyError, QueueFullError, TooManyRequestsError
            See `JobRepository.submit`.
        """
        kind = self.registry.named_in(body)
        request, found = checked or (request_in(body, kind.request), None)
        seconds = self._seconds_limit(request, caller)
        most = highest_priority(caller, self.settings)
        if request.priority > most:
            raise InvalidRequestError.of(
                ("priority",), f"must be at most {most} with this key", request.priority
            )
        self.storage.require(caller)
        if found is None:
            memory, work = self.settings.worker_memory_bytes or None, caller.limits.work
            source = self.scenes.of(caller)
            found = prepared(
                kind.resolve, request, body, source, work=work, memory=memory, version=SOLVER_VERSION
            )
        new = NewJob(
            kind=kind.name, request=dict(body), spec=found.spec, spec_hash=found.spec_hash,
            request_hash=found.request_hash, max_attempts=self.settings.max_attempts,
            scene_name=found.scene_name, scene_hash=found.scene_hash, priority=request.priority,
            fresh=request.fresh, idempotency_key=idempotency_key, owner=caller.owner, seconds_limit=seconds,
            trace=traces.current(),
            words=RunWords(**{name: getattr(request, name) for name in ABOUT_THE_RUN}),
        )  # fmt: skip
        waiting = None if caller.key_id is None else share(caller, self.settings, "waiting")
        row, inserted = self.jobs.submit(new, self.settings.queue_limit, waiting)
        self.waiters.progress(row.id, row.progress, row.points)
        if row.state is JobState.ACCEPTED:
            self.queue.wake()
            if self._notices is not None:
                self._notices.tell(ACCEPTED)
        return row, inserted

    def _seconds_limit(self, request: JobRequest, caller: Caller) -> float | None:
        """The longest time an attempt may take, if the request or the key says so [s]."""
        asked, of_key = request.max_seconds, caller.limits.seconds
        most = min(self.settings.job_seconds, of_key or math.inf)
        if asked is not None and asked > most:
            whose = "the key's limit" if most == of_key else "the service's own limit"
            raise InvalidRequestError.of(
                ("max_seconds",), f"must be at most {most:g}, which is {whose}", asked
            )
        return asked if asked is not None else of_key

    def job(self, job_id: str, caller: Caller = KEYLESS) -> JobRow:
        """The job."""
        return visible(self.jobs.get(job_id), caller.sees, f"there is no job {job_id!r}")

    def sweep(self, sweep_id: str, caller: Caller = KEYLESS) -> SweepRecord:
        """A stored sweep."""
        found: SweepRecord | None = self.stored.get(sweep_id, SWEEP)
        return visible(found, caller.sees, f"there is no sweep {sweep_id!r}")

    def live(self, job_id: str) -> Live | None:
        """How far a job is that somebody watches, newer than its row, whichever service runs it."""
        here = self.queue.live(job_id)
        return here if here is not None or self._elsewhere is None else self._elsewhere.live(job_id)

    def dismiss(self, job_id: str, caller: Caller = KEYLESS) -> JobRow:
        """Cancel a job. A running one ends within the grace; the row given back may say `running` still.

        ConflictError if it ended before.
        """
        self.job(job_id, caller)
        row = visible(self.jobs.cancel(job_id), caller.sees, f"there is no job {job_id!r}")
        if row.state in (JobState.SUCCESSFUL, JobState.FAILED):
            raise ConflictError(f"job {job_id} ended before ({row.state.value}), there is nothing to dismiss")
        if row.state is JobState.RUNNING:
            self.queue.cancel_running(job_id)
            if self._notices is not None:
                self._notices.tell(CANCEL, job_id)
        else:
            self.waiters.ended(job_id)
        return row

    def scene_of(self, job_id: str, caller: Caller = KEYLESS) -> dict[str, Any]:
        """The scene of a job as it is computed: with its values set, and what its uploads held.

        NotFoundError if it has no scene.
        """
        scene: dict[str, Any] | None = self.jobs.spec(self.job(job_id, caller).id).get("scene")
        if scene is None:
            raise NotFoundError(f"job {job_id} has no scene")
        return scene

    def results(self, job_id: str, caller: Caller = KEYLESS) -> Results:
        """What a job computed; of a failed one, what it computed all the same.

        ConflictError if it has not ended, or was dismissed; JobFailedError if it failed and computed nothing.
        """
        row = self.job(job_id, caller)
        source = row.result_of or row.id
        text = self.jobs.result_text(source)
        if text is not None:
            return Results(job=row, text=text, sweeps=self.stored.of_job(source))
        if row.state is JobState.FAILED:
            error = row.error or {}
            raise JobFailedError(f"job {job_id} failed: {error.get('detail', 'for no known reason')}", error)
        if row.state is JobState.DISMISSED:
            raise ConflictError(f"job {job_id} was dismissed, it has no results")
        raise ConflictError(f"job {job_id} is {row.state.value}, it has no results yet")

    def design(self, design_id: str, caller: Caller = KEYLESS) -> WholeDesign:
        """A stored design; the id of a later job that asked for the same names it too."""
        missing = f"there is no design {design_id!r}"
        asked = visible(self.jobs.get(design_id), caller.sees, missing)
        job = asked if asked.result_of is None else self.jobs.get(asked.result_of)
        row = None if job is None else self.stored.get(job.id, DESIGN)
        result = None if row is None else self.jobs.result(row.job_id)
        if job is None or row is None or result is None:
            raise NotFoundError(missing)
        return WholeDesign(row=row, job=job, result=result)

    def wait(
        self, job_id: str, timeout: float | None = None, on_progress: OnProgress | None = None,
        caller: Caller = KEYLESS,
    ) -> JobRow:  # fmt: skip
        """Wait in this thread until a job has ended, the time [s] is over or the service stops."""
        events: SimpleQueue[Event] = SimpleQueue()
        end = math.inf if timeout is None else time.monotonic() + timeout
        with self.waiters.listening(job_id, events.put):
            row = self.job(job_id, caller)
            while not (row.state.finished or self.stopping.is_set() or time.monotonic() >= end):
                try:
                    event = events.get(timeout=max(0.0, min(end - time.monotonic(), _LOOK_AGAIN_SECONDS)))
                except Empty:
                    row = self.job(job_id, caller)
                    continue
                if event.ended:
                    row = self.job(job_id, caller)
                elif on_progress is not None:
                    on_progress(event.fraction, event.points)
        return row
