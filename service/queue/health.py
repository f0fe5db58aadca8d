"""How the service is."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field
from sqlalchemy.exc import SQLAlchemyError

from service.db import revisions
from service.db.engine import sqlite_note
from service.queue.core import SOLVER_VERSION, Service
from solver.jit.compiler_process import missing, told

_PROBE_SECONDS = 2.0
_MOST_NAMED = 3
"""Workers that are told apart; more are one part."""


class Part(BaseModel):
    """A part of the service, and how far its start is; what is not known is left out."""

    name: str
    state: Literal["waits", "compiles", "ready"]
    done: int | None = Field(default=None, description="Kernels that are compiled.")
    of: int | None = Field(default=None, description="Kernels that the first start of a version compiles.")
    seconds_left: float | None = Field(default=None, description="At the pace of those compiled so far.")


class Readiness(BaseModel):
    """Whether the service takes jobs and answers, and what it still starts, and no more."""

    model_config = ConfigDict(frozen=True)

    ready: bool
    starting: str | None = None
    parts: list[Part] = []


class Health(Readiness):
    """How the service is."""

    trouble: list[str] = Field(description="Why not.")
    notes: list[str] = Field(description="What its keeper should know although it works.")
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
        ready=not trouble, starting=_starting(service), parts=parts(service), trouble=trouble,
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
    ready = service.queue.alive and up
    return Readiness(ready=ready, starting=_starting(service), parts=parts(service))


def _starting(service: Service) -> str | None:
    """Say what is being started, as the page shows it; None when all is there."""
    if not service.compiling:
        return None
    return f"Being compiled, once for this version: {told()}. Until then curves take longer and jobs wait."


def parts(service: Service) -> list[Part]:
    """Say of each part of the service how far its start is."""
    status, compiling = service.queue.status(), service.compiling and missing()
    names, ready = [f"Worker {i + 1}" for i in range(status.workers)], status.ready
    if status.workers > _MOST_NAMED:
        names, ready = [f"{status.workers} workers"], int(ready == status.workers)
    found = [Part(name="Service and store", state="ready")]
    for i, name in enumerate(names):
        if compiling and i == 0:
            left, far = service.compiler.look(), service.compiler
            found.append(Part(name=name, state="compiles", done=far.done, of=far.of, seconds_left=left))
        else:
            found.append(Part(name=name, state="ready" if i < ready else "waits"))
    curves = service.previews.ready > 0 and not service.compiling
    return [*found, Part(name="Live curves", state="ready" if curves else "waits")]
