"""The stored sweeps: written with their job's result, listed by what people filter by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from datetime import datetime
from typing import Any

from sqlalchemy import Connection, bindparam, insert, select
from sqlalchemy.orm import InstrumentedAttribute

from service.db.engine import Database
from service.db.models import NOBODY, Sweep, SweepArray, SweepContact
from service.db.repositories.stored import Parts, StoredRepository, part_rows
from service.jobs.ids import new_id
from service.jobs.outputs import ContactValues, StoredArray, SweepRecord

__all__ = ["SWEEP_SORTS", "SweepRepository", "insert_sweeps"]

_OWN_FIELDS = [item.name for item in fields(SweepRecord) if item.name not in ("contacts", "arrays")]
# Built once: building a statement costs more than running it.
_TABLES = Sweep.metadata.tables
_INSERT = insert(_TABLES["sweep"])
_INSERT_CONTACTS = insert(_TABLES["sweep_contact"])
_INSERT_ARRAYS = insert(_TABLES["sweep_array"])
# Of 100 000 sweeps: so many ids are read and sorted in the time in which a page of more is found in order.
_FEW_OF_CONTACTS = 3000

SWEEP_SORTS: dict[str, InstrumentedAttribute[Any]] = {
    "peak": Sweep.peak,
    "peak_at": Sweep.peak_at,
    "band_hz": Sweep.band_hz,
    "points": Sweep.points,
    "harmonics": Sweep.harmonics,
    "seconds": Sweep.seconds,
}


class SweepRepository(StoredRepository[Sweep, ContactValues]):
    """Sweeps of one database; their parts are the contacts."""

    table = Sweep

    def __init__(self, database: Database) -> None:
        parts = Parts(
            table=SweepContact, of=SweepContact.sweep_id, values=ContactValues, few=_FEW_OF_CONTACTS,
            apart=True,
        )  # fmt: skip
        super().__init__(database, SWEEP_SORTS, parts)
        self._of_job = self._select.where(Sweep.job_id == bindparam("job")).order_by(Sweep.position)

    def of_job(self, job_id: str) -> list[Sweep]:
        """The sweeps of a job in the order they were computed."""
        return self._all(self._of_job, {"job": job_id})

    def arrays(self, sweep_id: str) -> dict[str, StoredArray]:
        """The arrays of a sweep, by name."""
        query = select(SweepArray.name, SweepArray.sha256, SweepArray.data).where(
            SweepArray.sweep_id == sweep_id
        )
        with self._db.reading() as connection:
            return {
                row.name: StoredArray(sha256=row.sha256, data=row.data) for row in connection.execute(query)
            }


def insert_sweeps(
    connection: Connection, job_id: str, sweeps: Sequence[SweepRecord], created: datetime, owner: str = NOBODY
) -> None:
    """Write the sweeps of a job inside the transaction that writes its result; `owner` is the job's."""
    for position, sweep in enumerate(sweeps):
        sweep_id = new_id()
        about = {"id": sweep_id, "job_id": job_id, "position": position, "created": created, "owner": owner}
        connection.execute(_INSERT, about | {name: getattr(sweep, name) for name in _OWN_FIELDS})
        contacts = part_rows({"sweep_id": sweep_id}, sweep.contacts)
        arrays = [
            {"sweep_id": sweep_id, "name": name, "sha256": stored.sha256, "data": stored.data}
            for name, stored in sweep.arrays.items()
        ]
        if contacts:
            connection.execute(_INSERT_CONTACTS, contacts)
        if arrays:
            connection.execute(_INSERT_ARRAYS, arrays)
