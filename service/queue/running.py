"""Attempts that run here, and who waits for a job: callbacks of threads and of event loops alike."""

from __future__ import annotations

import enum
import logging
import secrets
import threading
from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

from service.db.repositories import Attempt
from service.jobs.outputs import Best, Point
from service.settings.traces import Open


class StopReason(enum.Enum):
    """Why an attempt was told to stop."""

    CANCEL = "its cancel was asked for"
    TIME = "it ran too long"
    LEASE = "the job is not ours any more"
    SHUTDOWN = "the service stops"


@dataclass(slots=True)
class Running:
    """An attempt that an executor has; `unwritten` if its row does not know its best design yet."""

    attempt: Attempt
    started: float
    written: float
    fraction: float = 0.0
    points: int = 0
    best: Best | None = None
    unwritten: bool = False
    span: Open | None = None
    stop: StopReason | None = None
    tag: str = field(default_factory=lambda: secrets.token_hex(4))
    found: list[Point] = field(default_factory=list)


@dataclass(frozen=True, slots=True, kw_only=True)
class Live:
    """How far an attempt is that runs here, newer than its row.

    Attributes
    ----------
    tag : str
        Of this run alone; another one has found other points.
    attempt : int
        Which attempt at the job it is.
    fraction, points : float, int
        Share of its path, points computed.
    best : table or None
        The best design so far, if its kind tells one.
    found : list of (value, amplitude)
        The points of its branch so far, if its kind tells them; grows while it runs.
    """

    tag: str
    attempt: int
    fraction: float
    points: int
    best: Best | None
    found: Sequence[Point]


log = logging.getLogger("stickslip.queue")

# More than can end while the answer of one that was just accepted is on its way.
_LATELY = 4096

Listener = Callable[["Event"], None]
EVERY = ""
"""In place of the id of a job: of all of them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """Something happened to a job; `ended` also when it went back to the queue, look at its row."""

    job_id: str
    ended: bool
    fraction: float = 0.0
    points: int = 0


class Waiters:
    """Listeners by job. They are called from the service's threads and must not block."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._listeners: dict[str, list[Listener]] = {}
        self._lately: OrderedDict[str, None] = OrderedDict()
        self.relay: Callable[[str], None] | None = None
        """Told of every job that ended here, for those who wait at other services."""

    @contextmanager
    def listening(self, job_id: str, listener: Listener) -> Iterator[None]:
        """Call `listener` for every event of the job, or of `EVERY` one, inside the block."""
        with self._lock:
            self._listeners.setdefault(job_id, []).append(listener)
        try:
            yield
        finally:
            with self._lock:
                left = [known for known in self._listeners[job_id] if known is not listener]
                if left:
                    self._listeners[job_id] = left
                else:
                    del self._listeners[job_id]

    def progress(self, job_id: str, fraction: float, points: int) -> None:
        """The job got this far."""
        self._tell(job_id, Event(job_id=job_id, ended=False, fraction=fraction, points=points))

    def ended(self, job_id: str) -> None:
        """The job's state changed, here."""
        self.ended_elsewhere(job_id)
        if self.relay is not None:
            self.relay(job_id)

    def ended_elsewhere(self, job_id: str) -> None:
        """The job's state changed, perhaps at another service."""
        with self._lock:
            self._lately[job_id] = None
            if len(self._lately) > _LATELY:
                self._lately.popitem(last=False)
        self._tell(job_id, Event(job_id=job_id, ended=True))

    def ended_lately(self, job_id: str) -> bool:
        """Whether the job's state changed before somebody could listen; it may be forgotten, see its row."""
        with self._lock:
            return job_id in self._lately

    def wake_all(self) -> None:
        """The service stops: nobody should wait any longer."""
        with self._lock:
            ids = [job_id for job_id in self._listeners if job_id != EVERY] or [EVERY]
        for job_id in ids:
            self._tell(job_id, Event(job_id=job_id, ended=True))

    def _tell(self, job_id: str, event: Event) -> None:
        with self._lock:
            listeners = [*self._listeners.get(job_id, ()), *self._listeners.get(EVERY, ())]
        for listener in listeners:
            try:
                listener(event)
            except Exception:
                log.exception("job %s: a listener failed", job_id)
