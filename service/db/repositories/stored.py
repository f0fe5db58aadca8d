"""The stored sweeps and designs, written with their job's result: rows with parts (contacts, variables)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from datetime import datetime
from typing import Any, Generic, TypeVar

from sqlalchemy import Connection, bindparam, func, insert, select
from sqlalchemy.orm import InstrumentedAttribute

from service.db.engine import Database
from service.db.models import NOBODY, Design, DesignVariable, Job, Sweep, SweepArray, SweepContact
from service.db.pagination import (
    FEW,
    Condition,
    Position,
    Range,
    met,
    ordered,
    owner_condition,
    plain_conditions,
    within,
)
from service.db.repositories.owned import Rows, RowT
from service.db.repositories.runs import in_the_bin
from service.jobs.ids import new_id
from service.jobs.outputs import ContactValues, DesignRecord, StoredArray, SweepRecord, VariableValues

Part = TypeVar("Part")
Column = InstrumentedAttribute[Any]
CREATED = "created"


@dataclass(frozen=True, slots=True, kw_only=True)
class Filter:
    """Which rows to list; every condition must hold.

    Attributes
    ----------
    owner : str or None
        Whose; None for everybody's.
    equal : mapping
        Column name to value.
    ranges : mapping
        Column name to (lowest, highest), each None for open.
    part : str or None
        Name of a part it must have; None for any.
    part_ranges : mapping
        Column name of the parts to (lowest, highest); one part must meet all of them.
    of : str or None
        With the run of this job, be it that an earlier job computed them; None for any.
    sort : str
        ``created`` (by the time the job was handed in) or a sort of the table; rows that have no such value
        are left out.
    descending : bool
        Largest or newest first.
    """

    owner: str | None = NOBODY
    equal: Mapping[str, object] = field(default_factory=dict)
    ranges: Mapping[str, Range] = field(default_factory=dict)
    part: str | None = None
    part_ranges: Mapping[str, Range] = field(default_factory=dict)
    of: str | None = None
    sort: str = CREATED
    descending: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class Parts(Generic[Part]):
    """The table of the parts of rows.

    Attributes
    ----------
    table : mapped class
        With ``name`` and ``position``.
    of : column
        The id of the row a part belongs to.
    values : type
        Dataclass of what is read of it.
    few : int
        Up to so many rows a condition on parts leads a query, see `service.db.pagination.met`.
    apart : bool
        Whether PostgreSQL is asked too how many there are.
    """

    table: Any
    of: Column
    values: type[Part]
    few: int = FEW
    apart: bool = False


class StoredRepository(Rows[RowT], Generic[RowT, Part]):
    """Rows of one table, whose ids sort by time, with their parts.

    Parameters
    ----------
    database : where they are.
    sorts : word to the column it sorts by.
    parts : their table.
    """

    def __init__(self, database: Database, sorts: Mapping[str, Column], parts: Parts[Part]) -> None:
        super().__init__(database)
        self._sorts, self._parts = sorts, parts
        self._table: Any = self.table
        self._part_names = [one.name for one in fields(parts.values)]  # type: ignore[arg-type]
        self._select_parts = (
            select(parts.of, *(getattr(parts.table, name) for name in self._part_names))
            .where(parts.of.in_(bindparam("owners", expanding=True)))
            .order_by(parts.of, parts.table.position)
        )

    def page(self, wanted: Filter, limit: int, after: Position | None = None) -> list[RowT]:
        """A page of rows; `after` is the sort value and id of the last one of the page before.

        Those of runs in the bin are left out, unless it is their run that is asked for.
        """
        with self._db.reading() as connection:
            column = self._sorts.get(wanted.sort)
            conditions = self._conditions(wanted)
            leads = column is None and not wanted.equal and wanted.of is None
            owner: Column = self._table.owner
            conditions += owner_condition(connection, self._identity, owner, wanted.owner, leads=leads)
            query = met(connection, self._select, self._identity, conditions, column)
            if "job_id" not in wanted.equal and wanted.of is None:
                query = query.where(~in_the_bin(self._table.job_id))
            query = ordered(query, self._identity, column, descending=wanted.descending, after=after)
            return self._read(connection, query.limit(limit))

    def position(self, row: RowT, sort: str) -> Position:
        """Where a page that ends with this row goes on, sorted by this word."""
        column = self._sorts.get(sort)
        return None if column is None else getattr(row, column.key), getattr(row, self._identity.key)

    def parts(self, row_ids: Sequence[str]) -> dict[str, list[Part]]:
        """The parts of several rows, by row."""
        found: dict[str, list[Part]] = {row_id: [] for row_id in row_ids}
        with self._db.reading() as connection:
            for row_id, *values in connection.execute(self._select_parts, {"owners": list(row_ids)}):
                found[row_id].append(
                    self._parts.values(**dict(zip(self._part_names, values, strict=True)))
                )  # fmt: skip
        return found

    def _conditions(self, wanted: Filter) -> list[Condition]:
        found = [getattr(self._table, name) == value for name, value in wanted.equal.items()]
        if wanted.of is not None:
            source = select(func.coalesce(Job.result_of, Job.id)).where(Job.id == wanted.of)
            found.append(self._table.job_id == source.scalar_subquery())
        for name, bounds in wanted.ranges.items():
            found.extend(within(getattr(self._table, name), bounds))
        conditions = plain_conditions(self._identity, found)
        if wanted.part is not None or wanted.part_ranges:
            conditions.append(self._part_condition(wanted))
        return conditions

    def _part_condition(self, wanted: Filter) -> Condition:
        """True for a row one of whose parts has the name and all the values."""
        parts = self._parts
        found = [] if wanted.part is None else [parts.table.name == wanted.part]
        for name, bounds in wanted.part_ranges.items():
            found.extend(within(getattr(parts.table, name), bounds))
        ids = select(parts.of).where(*found)
        holds = ids.where(parts.of == self._identity).correlate(self._table).exists()
        return Condition(ids=ids, holds=holds, few=parts.few, apart=parts.apart)


def part_rows(owner: Mapping[str, str], parts: Sequence[Any]) -> list[dict[str, object]]:
    """Return the rows to insert for the parts of a row, in order.

    Parameters
    ----------
    owner : the column of its id, and the id.
    """
    return [
        {**owner, "position": position, **{one.name: getattr(part, one.name) for one in fields(part)}}
        for position, part in enumerate(parts)
    ]


_SWEEP_FIELDS = [item.name for item in fields(SweepRecord) if item.name not in ("contacts", "arrays")]
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
        connection.execute(_INSERT, about | {name: getattr(sweep, name) for name in _SWEEP_FIELDS})
        contacts = part_rows({"sweep_id": sweep_id}, sweep.contacts)
        arrays = [
            {"sweep_id": sweep_id, "name": name, "sha256": stored.sha256, "data": stored.data}
            for name, stored in sweep.arrays.items()
        ]
        if contacts:
            connection.execute(_INSERT_CONTACTS, contacts)
        if arrays:
            connection.execute(_INSERT_ARRAYS, arrays)


_DESIGN_FIELDS = [item.name for item in fields(DesignRecord) if item.name != "variables"]
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
    values = {name: getattr(design, name) for name in _DESIGN_FIELDS}
    connection.execute(insert(Design).values(job_id=job_id, owner=owner, created=created, **values))
    rows = part_rows({"design_id": job_id}, design.variables)
    if rows:
        connection.execute(insert(DesignVariable), rows)
