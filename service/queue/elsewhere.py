"""How far jobs are that another service of the same PostgreSQL database runs, for those who watch them here.

Who watches says so to all services now and then, with how many points of the branch are known; the one that
runs the job then tells what else it has, and what is new as it comes, in notices (`service.db.pg_notify`). Of
what nobody watches at another service nothing is told.
"""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass

from service.jobs.outputs import Point
from service.queue.running import EVERY, Event, Live, Waiters

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
    waiters : Waiters
        Told of what comes from other services; tells what happens here.
    here : callable
        How far a job is that runs here; None of another.
    ask, tell : callable
        Send to all other services that a job is watched here, and what is known of one that runs here.
    """

    def __init__(
        self,
        waiters: Waiters,
        here: Callable[[str], Live | None],
        ask: Callable[[str], None],
        tell: Callable[[str], None],
    ) -> None:
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
