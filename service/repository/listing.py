"""What every list shares: conditions with an index that leads, keyset pages, ranges."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import ColumnElement, Connection, Select, func, literal, select, tuple_
from sqlalchemy.orm import InstrumentedAttribute

Range = tuple[float | None, float | None]
Position = tuple[float | None, str]

_FEW = 2000


@dataclass(frozen=True, slots=True, kw_only=True)
class Condition:
    """A condition on rows, in two forms: the ids that meet it, and whether a row does."""

    ids: Select[str]
    holds: ColumnElement[bool]


def plain_conditions(
    identity: InstrumentedAttribute[str], found: Sequence[ColumnElement[bool]]
) -> list[Condition]:
    """Conditions on the columns of the table itself."""
    return [Condition(ids=select(identity).where(holds), holds=holds) for holds in found]


def met(
    connection: Connection,
    query: Select[Any],
    identity: InstrumentedAttribute[str],
    conditions: Sequence[Condition],
) -> Select[Any]:
    """The query with every condition, on SQLite led by one that few rows meet if there is one.

    SQLite does not know how many rows a condition leaves and would read the whole table in the order of
    the ids for four rows with a low peak. So each condition with an index is counted up to `_FEW`
    first, which its index answers in well under a millisecond. PostgreSQL keeps statistics and knows.
    """
    lead = None
    if connection.dialect.name == "sqlite":
        lead = next((condition for condition in conditions if _is_few(connection, condition)), None)
    for condition in conditions:
        query = query.where(identity.in_(condition.ids) if condition is lead else condition.holds)
    return query


def _is_few(connection: Connection, condition: Condition) -> bool:
    bounded = condition.ids.limit(_FEW + 1).subquery()
    return connection.execute(select(func.count()).select_from(bounded)).scalar_one() <= _FEW


def within(column: InstrumentedAttribute[Any], bounds: Range) -> list[ColumnElement[bool]]:
    """The conditions of a range, each end None for open."""
    low, high = bounds
    if low is not None and high is not None:
        return [column.between(low, high)]
    if low is not None:
        return [column >= low]
    return [] if high is None else [column <= high]


def ordered(
    query: Select[Any],
    identity: InstrumentedAttribute[str],
    column: InstrumentedAttribute[Any] | None,
    *,
    descending: bool,
    after: Position | None,
) -> Select[Any]:
    """Order by a column (None: by id alone, which is the time), then by id, and go on behind `after`.

    Rows without a value in the column are left out.
    """
    keys = [identity] if column is None else [column, identity]
    query = query.order_by(*(key.desc() if descending else key.asc() for key in keys))
    if column is not None:
        query = query.where(column.is_not(None))
    if after is None:
        return query
    value, row_id = after
    here = tuple_(*keys)
    there = tuple_(*(literal(item) for item in ((row_id,) if column is None else (value, row_id))))
    return query.where(here < there if descending else here > there)
