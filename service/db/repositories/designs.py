"""The stored designs: written with their job's result, listed by what people filter by."""

from __future__ import annotations

from dataclasses import fields
from datetime import datetime
from typing import Any

from sqlalchemy import Connection, insert
from sqlalchemy.orm import InstrumentedAttribute

from service.db.engine import Database
from service.db.models import NOBODY, Design, DesignVariable
from service.db.repositories.stored import Parts, StoredRepository, part_rows
from service.jobs.outputs import DesignRecord, VariableValues

__all__ = ["DESIGN_SORTS", "DesignRepository", "insert_design"]

_OWN_FIELDS = [item.name for item in fields(DesignRecord) if item.name != "variables"]
DESIGN_SORTS: dict[str, InstrumentedAttribute[Any]] = {
    "objective": Design.objective,
    "peak": Design.peak,
    "peak_at": Design.peak_at,
    "band": Design.band_hz,
    "work": Design.work,
    "seconds": Design.seconds,
}


class DesignRepository(StoredRepository[Design, VariableValues]):
    """Designs of one database; their parts are the variables."""

    table = Design

    def __init__(self, database: Database) -> None:
        parts = Parts(table=DesignVariable, of=DesignVariable.design_id, values=VariableValues)
        super().__init__(database, DESIGN_SORTS, parts)


def insert_design(
    connection: Connection, job_id: str, design: DesignRecord, created: datetime, owner: str = NOBODY
) -> None:
    """Write the design of a job inside the transaction that writes its result; `owner` is the job's."""
    values = {name: getattr(design, name) for name in _OWN_FIELDS}
    connection.execute(insert(Design).values(job_id=job_id, owner=owner, created=created, **values))
    rows = part_rows({"design_id": job_id}, design.variables)
    if rows:
        connection.execute(insert(DesignVariable), rows)
