"""How the service is."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable

from pydantic import BaseModel, ConfigDict
from sqlalchemy.exc import SQLAlchemyError

from service.db import revisions
from service.db.engine import sqlite_note
from service.queue.core import SOLVER_VERSION, Service
from solver.jit.compiler_process import told

_PROBE_SECONDS = 2.0


class Readiness(BaseModel):
    """Whether the service takes jobs and answers, and what it still starts, and no more."""

    model_config = ConfigDict(frozen=True)

    ready: bool
    starting: str | None = None


class Health(Readiness):
    """How the service is.

    Attributes
    ----------
    trouble : list of str
        Why not.
    notes : list of str
        What its keeper should know although it works.
    """

    trouble: list[str]
    notes: list[str]
    version: str
    database: str
    database_version: str
    revision: str
    workers: int
    workers_ready: int
    workers_busy: int
    jobs: dict[str, int]


Look = Callable[[Service], Readiness]


class Probe:
    """Looks how the service is, in a thread of its own: whatever else hangs, the answer comes in time.

    Parameters
    ----------
    service : Service
        Looked at.
    seconds : float
        Time after which a database that has not answered is called away [s].
    """

    def __init__(self, service: Service, seconds: float = _PROBE_SECONDS) -> None:
        self._service = service
        self._seconds = seconds
        self._looks: dict[Look, asyncio.Future[Readiness]] = {}

    async def detailed(self) -> Readiness:
        """How the service is; without details if the database does not answer."""
        return await self._looked(check)

    async def brief(self) -> Readiness:
        """Whether the service takes and runs jobs."""
        return await self._looked(readiness)

    async def _looked(self, look: Look) -> Readiness:
        loop = asyncio.get_running_loop()
        found = self._looks.get(look)
        if found is None:
            found = self._looks[look] = loop.create_future()
            found.add_done_callback(lambda _: self._looks.pop(look, None))
            # No pool: a look that hangs must neither keep others out nor hold up the end of the process.
            told = (look, loop, found)
            threading.Thread(target=self._look, args=told, name="stickslip probe", daemon=True).start()
        try:
            return await asyncio.wait_for(asyncio.shield(found), self._seconds)
        except TimeoutError:
            return unanswered(self._service, self._seconds) if look is check else Readiness(ready=False)

    def _look(self, look: Look, loop: asyncio.AbstractEventLoop, found: asyncio.Future[Readiness]) -> None:
        result = look(self._service)

        def tell() -> None:
            if not found.done():
                found.set_result(result)

        if not loop.is_closed():
            loop.call_soon_threadsafe(tell)


def unanswered(service: Service, seconds: float) -> Health:
    """What is known of a service whose database does not answer."""
    words = f"the database does not answer within {seconds:g} s"
    return _health(service, [words], {}, "unknown")


def check(service: Service) -> Health:
    """Look at database, queue and workers."""
    trouble: list[str] = []
    counts: dict[str, int] = {}
    version = "unknown"
    try:
        version = service.database.version()
        counts = {state.value: number for state, number in service.jobs.count().items()}
        trouble += filter(None, [service.database.trouble(service.settings.least_free_bytes)])
    except (SQLAlchemyError, OSError) as error:
        trouble.append(f"the database does not answer: {type(error).__name__}")
    return _health(service, trouble, counts, version)


def _health(service: Service, trouble: list[str], counts: dict[str, int], version: str) -> Health:
    trouble = list(trouble)
    if not service.queue.alive:
        trouble.append("the queue takes no jobs")
    workers = service.queue.status()
    if not workers.ready and not service.compiling:
        trouble.append(workers.trouble or "the worker processes are starting")
    notes = [
        sqlite_note() if service.database.exclusive else None,
        workers.trouble if workers.ready else None,
    ]
    return Health(
        ready=not trouble, starting=_starting(service), trouble=trouble,
        notes=[note for note in notes if note is not None], version=SOLVER_VERSION,
        database=service.database.backend, database_version=version, revision=revisions.head_revision(),
        workers=workers.workers, workers_ready=workers.ready, workers_busy=workers.busy, jobs=counts,
    )  # fmt: skip


def readiness(service: Service) -> Readiness:
    """Look at database, queue and workers, without counting anything: anybody may ask for this."""
    try:
        if service.database.trouble(service.settings.least_free_bytes) is not None:
            return Readiness(ready=False)
    except (SQLAlchemyError, OSError):
        return Readiness(ready=False)
    up = service.compiling or service.queue.status().ready > 0
    return Readiness(ready=service.queue.alive and up, starting=_starting(service))


def _starting(service: Service) -> str | None:
    """Say what is being started, as the page shows it; None when all is there."""
    if not service.compiling:
        return None
    return f"Being compiled, once for this version: {told()}. Until then curves take longer and jobs wait."
