"""The stored designs: written with their job's result, listed by what people filter by."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from datetime import datetime

from sqlalchemy import ColumnElement, Connection, insert, select
from sqlalchemy.orm import InstrumentedAttribute

from service.db.engine import Database
from service.db.models import NOBODY, Design, DesignVariable
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
from service.db.repositories.rows import DesignRow
from service.jobs.outputs import DesignRecord, VariableValues

__all__ = ["DESIGN_SORTS", "DesignFilter", "DesignRepository", "DesignRow", "insert_design"]

_COLUMNS = [getattr(Design, item.name) for item in fields(DesignRow)]
_VARIABLE_NAMES = [item.name for item in fields(VariableValues)]

DESIGN_SORTS: dict[str, InstrumentedAttribute[float | None] | InstrumentedAttribute[float]] = {
    "objective": Design.objective,
    "peak": Design.peak,
    "peak_at": Design.peak_at,
    "band": Design.band_hz,
    "work": Design.work,
    "seconds": Design.seconds,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignFilter:
    """Which designs to list; every condition must hold.

    Attributes
    ----------
    owner : str or None
        Whose; None for everybody's.
    equal : mapping
        Column name to value: scene_name, scene_hash, method, robust, reached, feasible, harmonics.
    ranges : mapping
        Column name to (lowest, highest), each None for open: objective, peak, peak_at, band_hz, work,
        seconds.
    variable : str or None
        Name of a variable it must have; None for any.
    value : (lowest, highest)
        Of the best value of that variable.
    sort : str
        ``created`` (by the time the job was handed in) or a key of DESIGN_SORTS; designs that have no such
        value are left out.
    descending : bool
        Largest or newest first.
    """

    owner: str | None = NOBODY
    equal: Mapping[str, object] = field(default_factory=dict)
    ranges: Mapping[str, Range] = field(default_factory=dict)
    variable: str | None = None
    value: Range = (None, None)
    sort: str = "created"
    descending: bool = True


class DesignRepository:
    """Designs of one database."""

    def __init__(self, database: Database) -> None:
        self._db = database

    def page(self, wanted: DesignFilter, limit: int, after: Position | None = None) -> list[DesignRow]:
        """A page of designs; `after` is the sort value and id of the last one of the page before."""
        with self._db.reading() as connection:
            column = DESIGN_SORTS.get(wanted.sort)
            conditions = _conditions(wanted)
            leads = column is None and not wanted.equal
            conditions += owner_condition(connection, Design.job_id, Design.owner, wanted.owner, leads=leads)
            query = met(connection, select(*_COLUMNS), Design.job_id, conditions, column)
            query = ordered(query, Design.job_id, column, descending=wanted.descending, after=after)
            return [DesignRow(**row) for row in connection.execute(query.limit(limit)).mappings()]

    def get(self, design_id: str) -> DesignRow | None:
        """The design, or None."""
        query = select(*_COLUMNS).where(Design.job_id == design_id)
        with self._db.reading() as connection:
            row = connection.execute(query).mappings().one_or_none()
        return None if row is None else DesignRow(**row)

    def variables(self, design_ids: Sequence[str]) -> dict[str, list[VariableValues]]:
        """The variables of several designs, by design."""
        columns = [getattr(DesignVariable, name) for name in _VARIABLE_NAMES]
        query = (
            select(DesignVariable.design_id, *columns)
            .where(DesignVariable.design_id.in_(design_ids))
            .order_by(DesignVariable.design_id, DesignVariable.position)
        )
        found: dict[str, list[VariableValues]] = {design_id: [] for design_id in design_ids}
        with self._db.reading() as connection:
            for row in connection.execute(query):
                values = {name: getattr(row, name) for name in _VARIABLE_NAMES}
                found[row.design_id].append(VariableValues(**values))
        return found


def insert_design(
    connection: Connection, job_id: str, design: DesignRecord, created: datetime, owner: str = NOBODY
) -> None:
    """Write the design of a job inside the transaction that writes its result; `owner` is the job's."""
    values = {item.name: getattr(design, item.name) for item in fields(DesignRecord)}
    variables: tuple[VariableValues, ...] = values.pop("variables")
    connection.execute(insert(Design).values(job_id=job_id, owner=owner, created=created, **values))
    rows = [
        {"design_id": job_id, "position": position} | {name: getattr(one, name) for name in _VARIABLE_NAMES}
        for position, one in enumerate(variables)
    ]
    if rows:
        connection.execute(insert(DesignVariable), rows)


def _conditions(wanted: DesignFilter) -> list[Condition]:
    found: list[ColumnElement[bool]] = []
    for name, value in wanted.equal.items():
        found.append(getattr(Design, name) == value)
    for name, bounds in wanted.ranges.items():
        found.extend(within(getattr(Design, name), bounds))
    conditions = plain_conditions(Design.job_id, found)
    if wanted.variable is not None or wanted.value != (None, None):
        conditions.append(_variable_condition(wanted))
    return conditions


def _variable_condition(wanted: DesignFilter) -> Condition:
    """True for a design one of whose variables has the name and a value in the range."""
    found = [] if wanted.variable is None else [DesignVariable.name == wanted.variable]
    found.extend(within(DesignVariable.value, wanted.value))
    ids = select(DesignVariable.design_id).where(*found)
    holds = ids.where(DesignVariable.design_id == Design.job_id).correlate(Design).exists()
    return Condition(ids=ids, holds=holds)
