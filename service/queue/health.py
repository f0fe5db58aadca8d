"""How the service is."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict
from sqlalchemy.exc import SQLAlchemyError

from service.db import revisions
from service.db.engine import sqlite_note
from service.queue.core import SOLVER_VERSION, Service


class Readiness(BaseModel):
    """Whether the service takes and runs jobs, and no more."""

    model_config = ConfigDict(frozen=True)

    ready: bool


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


def check(service: Service) -> Health:
    """Look at database, queue and workers."""
    trouble: list[str] = []
    counts: dict[str, int] = {}
    version = "unknown"
    try:
        version = service.database.version()
        counts = {state.value: number for state, number in service.jobs.count().items()}
    except SQLAlchemyError as error:
        trouble.append(f"the database does not answer: {type(error).__name__}")
    if not service.queue.alive:
        trouble.append("the queue takes no jobs")
    workers = service.queue.status()
    if not workers.ready:
        trouble.append(workers.trouble or "the worker processes are starting")
    notes = [
        sqlite_note() if service.database.exclusive else None,
        workers.trouble if workers.ready else None,
    ]
    return Health(
        ready=not trouble,
        trouble=trouble,
        notes=[note for note in notes if note is not None],
        version=SOLVER_VERSION,
        database=service.database.backend,
        database_version=version,
        revision=revisions.head_revision(),
        workers=workers.workers,
        workers_ready=workers.ready,
        workers_busy=workers.busy,
        jobs=counts,
    )


def readiness(service: Service) -> Readiness:
    """Look at database, queue and workers, without counting anything: anybody may ask for this."""
    try:
        service.database.version()
    except SQLAlchemyError:
        return Readiness(ready=False)
    return Readiness(ready=service.queue.alive and service.queue.status().ready > 0)
