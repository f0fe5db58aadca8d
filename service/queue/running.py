"""Attempts that run here, and who waits for a job: callbacks of threads and of event loops alike.

Of jobs that another service of the same PostgreSQL database runs, those hear who watch them here: who watches
says so to all services now and then, with how many points of the branch are known; the one that runs the job
then tells what else it has, and what is new as it comes, in notices (`service.db.postgresql`). Of what nobody
watches at another service nothing is told.
"""

from __future__ import annotations

import enum
import json
import logging
import secrets
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
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
    tag : of this run alone; another one has found other points.
    attempt : which attempt at the job it is.
    fraction, points : share of its path, points computed.
    best : the best design so far, if its kind tells one.
    found : the points of its branch so far, if its kind tells them; grows while it runs.
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


ASK_SECONDS = 5.0
_SOON_SECONDS = 1.0  # while nothing is known
_WATCHED_SECONDS = 3.0 * ASK_SECONDS
_MOST_BYTES = 7000  # of a notice, of which PostgreSQL takes 8000
_POINTS_OF_A_NOTICE = 100


@dataclass(slots=True)
class _Known:
    """A job of another service that is watched here."""

    asked: float
    told: float = 0.0
    live: Live | None = None


@dataclass(slots=True)
class _FollowedJob:
    """A job that runs here: until when others want to hear of it, and how many of its points they know."""

    until: float
    tag: str
    points: int


class Elsewhere:
    """What services tell each other of running jobs.

    Parameters
    ----------
    waiters : told of what comes from other services; tells what happens here.
    here : how far a job is that runs here; None of another.
    ask, tell : send to all other services that a job is watched here, and what is known of one that runs
        here.
    """

    def __init__(
        self, waiters: Waiters, here: Callable[[str], Live | None], ask: Callable[[str], None],
        tell: Callable[[str], None],
    ) -> None:  # fmt: skip
        self._waiters, self._here = waiters, here
        self._ask, self._tell = ask, tell
        self._lock = threading.Lock()
        self._known: dict[str, _Known] = {}
        self._watched: dict[str, _FollowedJob] = {}
        self._listening = ExitStack()

    def start(self) -> None:
        """Begin to tell others."""
        self._listening.enter_context(self._waiters.listening(EVERY, self._happened))

    def stop(self) -> None:
        """End."""
        self._listening.close()

    def live(self, job_id: str) -> Live | None:
        """How far a job is that is watched here; None until its service has told, and if it is silent."""
        now = time.monotonic()
        with self._lock:
            known = self._known.get(job_id)
            if known is None:
                old = [one for one, each in self._known.items() if now - each.asked > _WATCHED_SECONDS]
                for one in old:
                    del self._known[one]
                known = self._known[job_id] = _Known(asked=now - ASK_SECONDS)
            live = known.live if now - known.told < _WATCHED_SECONDS else None
            due = now - known.asked >= (_SOON_SECONDS if live is None else ASK_SECONDS)
            if due:
                known.asked = now
        if due:
            self._ask(json.dumps([job_id, *(("", 0) if live is None else (live.tag, len(live.found)))]))
        return live

    def watched(self, text: str) -> None:
        """From another service: somebody watches a job there, and knows so many points of its branch."""
        job_id, tag, points = json.loads(text)
        live = self._here(job_id)
        if live is None:
            return
        count = points if tag == live.tag else 0
        with self._lock:
            before = self._watched.get(job_id)
            if before is not None and before.tag == live.tag:
                count = min(count, before.points)
            self._watched[job_id] = _FollowedJob(time.monotonic() + _WATCHED_SECONDS, live.tag, count)
        self._say(job_id)

    def told(self, text: str) -> None:
        """From another service: how far a job is, with points of its branch from a number on."""
        job_id, tag, attempt, fraction, points, best, start, found = json.loads(text)
        with self._lock:
            known = self._known.get(job_id)
            if known is None:
                return
            before = known.live
            so_far: list[Point] = list(before.found) if before is not None and before.tag == tag else []
            if start > len(so_far):
                known.asked = 0.0  # some were missed: they are asked for when it is looked at next
                return
            more = [(float(value), float(amplitude)) for value, amplitude in found]
            known.told = time.monotonic()
            known.live = Live(
                tag=tag, attempt=attempt, fraction=fraction, points=points, best=best,
                found=[*so_far[:start], *more, *so_far[start + len(more) :]],
            )  # fmt: skip
        self._waiters.progress(job_id, fraction, points)

    def _happened(self, event: Event) -> None:
        """From the waiters: a job went on, or ended, wherever it runs."""
        if event.ended:
            with self._lock:
                self._watched.pop(event.job_id, None)
                self._known.pop(event.job_id, None)
        elif event.job_id in self._watched:
            self._say(event.job_id)

    def _say(self, job_id: str) -> None:
        live = self._here(job_id)
        if live is None:
            return
        with self._lock:
            watched = self._watched.get(job_id)
            if watched is None or watched.until < time.monotonic():
                self._watched.pop(job_id, None)
                return
            if watched.tag != live.tag:
                watched.tag, watched.points = live.tag, 0
            start, found = watched.points, list(live.found)
            watched.points = len(found)
        for begin in range(start, max(len(found), start + 1), _POINTS_OF_A_NOTICE):
            self._tell(_notice(job_id, live, begin, found[begin : begin + _POINTS_OF_A_NOTICE]))


def _notice(job_id: str, live: Live, start: int, found: list[Point]) -> str:
    """Points from number `start` on; with the best design if there is room for it, else its row has it."""
    about = (job_id, live.tag, live.attempt, live.fraction, live.points)
    text = json.dumps([*about, None if live.best is None else dict(live.best), start, found])
    return text if len(text) <= _MOST_BYTES else json.dumps([*about, None, start, found])
