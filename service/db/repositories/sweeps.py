"""The stored sweeps: written with their job's result, listed by what people filter by."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from datetime import datetime

from sqlalchemy import ColumnElement, Connection, Select, bindparam, insert, select
from sqlalchemy.orm import InstrumentedAttribute

from service.db.engine import Database
from service.db.models import NOBODY, Sweep, SweepArray, SweepContact
from service.db.repositories.pagination import (
    Condition,
    Position,
    Range,
    met,
    ordered,
    owner_condition,
    plain_conditions,
    within,
)
from service.db.repositories.rows import SweepRow
from service.jobs.ids import new_id
from service.jobs.outputs import ContactValues, StoredArray, SweepRecord

__all__ = ["SWEEP_SORTS", "SweepFilter", "SweepRepository", "SweepRow", "insert_sweeps"]

_COLUMNS = [getattr(Sweep, item.name) for item in fields(SweepRow)]
_OWN_FIELDS = [item.name for item in fields(SweepRecord) if item.name not in ("contacts", "arrays")]
_CONTACT_FIELDS = [item.name for item in fields(ContactValues)]
# Built once: building a statement costs more than running it.
_TABLES = Sweep.metadata.tables
_INSERT = insert(_TABLES["sweep"])
_INSERT_CONTACTS = insert(_TABLES["sweep_contact"])
_INSERT_ARRAYS = insert(_TABLES["sweep_array"])
_OF_JOB = select(*_COLUMNS).where(Sweep.job_id == bindparam("job")).order_by(Sweep.position)
_CONTACTS = (
    select(SweepContact.sweep_id, *(getattr(SweepContact, name) for name in _CONTACT_FIELDS))
    .where(SweepContact.sweep_id.in_(bindparam("sweeps", expanding=True)))
    .order_by(SweepContact.sweep_id, SweepContact.position)
)
# Of 100 000 sweeps: so many ids are read and sorted in the time in which a page of more is found in order.
_FEW_OF_CONTACTS = 3000
_CONTACT_COLUMNS: dict[str, InstrumentedAttribute[float | None]] = {
    "kt": SweepContact.kt,
    "mu": SweepContact.mu,
    "N0": SweepContact.N0,
    "N1": SweepContact.N1,
}

SWEEP_SORTS: dict[str, InstrumentedAttribute[float | None] | InstrumentedAttribute[float]] = {
    "peak": Sweep.peak,
    "peak_at": Sweep.peak_at,
    "band_hz": Sweep.band_hz,
    "points": Sweep.points,
    "harmonics": Sweep.harmonics,
    "seconds": Sweep.seconds,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepFilter:
    """Which sweeps to list; every condition must hold.

    Attributes
    ----------
    owner : str or None
        Whose; None for everybody's.
    equal : mapping
        Column name to value: scene_name, scene_hash, parameter, harmonics, job_id, completed.
    ranges : mapping
        Column name to (lowest, highest), each None for open: peak, peak_at, band_hz, points, seconds.
    contact_ranges : mapping
        ``kt``, ``mu``, ``N0`` or ``N1`` to (lowest, highest); one contact must meet all of them.
    contact : str or None
        Name of that contact; None for any.
    sort : str
        ``created`` or a key of SWEEP_SORTS; sweeps that have no such value are left out.
    descending : bool
        Largest or newest first.
    """

    owner: str | None = NOBODY
    equal: Mapping[str, object] = field(default_factory=dict)
    ranges: Mapping[str, Range] = field(default_factory=dict)
    contact_ranges: Mapping[str, Range] = field(default_factory=dict)
    contact: str | None = None
    sort: str = "created"
    descending: bool = True


class SweepRepository:
    """Sweeps of one database."""

    def __init__(self, database: Database) -> None:
        self._db = database

    def page(self, wanted: SweepFilter, limit: int, after: Position | None = None) -> list[SweepRow]:
        """A page of sweeps; `after` is the sort value and id of the last one of the page before."""
        with self._db.reading() as connection:
            query = _query(connection, wanted, after).limit(limit)
            return [SweepRow(**row) for row in connection.execute(query).mappings()]

    def get(self, sweep_id: str) -> SweepRow | None:
        """The sweep, or None."""
        with self._db.reading() as connection:
            row = connection.execute(select(*_COLUMNS).where(Sweep.id == sweep_id)).mappings().one_or_none()
        return None if row is None else SweepRow(**row)

    def of_job(self, job_id: str) -> list[SweepRow]:
        """The sweeps of a job in the order they were computed."""
        with self._db.reading() as connection:
            return [SweepRow(**row) for row in connection.execute(_OF_JOB, {"job": job_id}).mappings()]

    def contacts(self, sweep_ids: Sequence[str]) -> dict[str, list[ContactValues]]:
        """The contact values of several sweeps, by sweep."""
        found: dict[str, list[ContactValues]] = {sweep_id: [] for sweep_id in sweep_ids}
        with self._db.reading() as connection:
            for sweep_id, *values in connection.execute(_CONTACTS, {"sweeps": list(sweep_ids)}):
                found[sweep_id].append(ContactValues(**dict(zip(_CONTACT_FIELDS, values, strict=True))))
        return found

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
        contacts = [
            {"sweep_id": sweep_id, "position": index}
            | {name: getattr(contact, name) for name in _CONTACT_FIELDS}
            for index, contact in enumerate(sweep.contacts)
        ]
        arrays = [
            {"sweep_id": sweep_id, "name": name, "sha256": stored.sha256, "data": stored.data}
            for name, stored in sweep.arrays.items()
        ]
        if contacts:
            connection.execute(_INSERT_CONTACTS, contacts)
        if arrays:
            connection.execute(_INSERT_ARRAYS, arrays)


def _query(connection: Connection, wanted: SweepFilter, after: Position | None) -> Select[tuple[object, ...]]:
    """The query of a page."""
    query: Select[tuple[object, ...]] = select(*_COLUMNS)
    column = SWEEP_SORTS.get(wanted.sort)
    conditions = _conditions(wanted)
    leads = column is None and not wanted.equal
    conditions += owner_condition(connection, Sweep.id, Sweep.owner, wanted.owner, leads=leads)
    query = met(connection, query, Sweep.id, conditions, column)
    return ordered(query, Sweep.id, column, descending=wanted.descending, after=after)


def _conditions(wanted: SweepFilter) -> list[Condition]:
    found: list[ColumnElement[bool]] = []
    for name, value in wanted.equal.items():
        found.append(getattr(Sweep, name) == value)
    for name, bounds in wanted.ranges.items():
        found.extend(within(getattr(Sweep, name), bounds))
    conditions = plain_conditions(Sweep.id, found)
    if wanted.contact is not None or wanted.contact_ranges:
        conditions.append(_contact_condition(wanted))
    return conditions


def _contact_condition(wanted: SweepFilter) -> Condition:
    """True for a sweep one of whose contacts has the name and all the values."""
    found = [] if wanted.contact is None else [SweepContact.name == wanted.contact]
    for name, bounds in wanted.contact_ranges.items():
        found.extend(within(_CONTACT_COLUMNS[name], bounds))
    ids = select(SweepContact.sweep_id).where(*found)
    holds = ids.where(SweepContact.sweep_id == Sweep.id).correlate(Sweep).exists()
    return Condition(ids=ids, holds=holds, few=_FEW_OF_CONTACTS, apart=True)
