"""What every list shares: conditions with an index that leads, ranges, keyset pages and their cursors."""

from __future__ import annotations

import base64
import binascii
import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any
from urllib.parse import urlencode

from pydantic import BaseModel
from sqlalchemy import Column, ColumnElement, Connection, Select, func, literal, select, tuple_
from sqlalchemy.orm import InstrumentedAttribute
from sqlalchemy.sql import operators
from sqlalchemy.sql.elements import BinaryExpression, UnaryExpression
from sqlalchemy.sql.operators import custom_op

from service.db.postgresql import WITH_VALUES
from service.errors import InvalidRequestError

Range = tuple[float | None, float | None]
Position = tuple[float | None, str]

FEW = 2000
_FEW_OF_AN_OWNER = 5000
_FAR_FEWER = 4.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Condition:
    """A condition on rows, in two forms: the ids that meet it, and whether a row does."""

    ids: Select[Any]
    holds: ColumnElement[bool]
    few: Annotated[int, "Up to so many rows it leads a query (see `met`)."] = FEW
    apart: Annotated[bool, "It is about rows of another table."] = False


def plain_conditions(
    identity: InstrumentedAttribute[Any], found: Sequence[ColumnElement[bool]]
) -> list[Condition]:
    """Conditions on the columns of the table itself."""
    return [Condition(ids=select(identity).where(holds), holds=holds) for holds in found]


def owner_condition(
    connection: Connection, identity: InstrumentedAttribute[Any], column: InstrumentedAttribute[str],
    owner: str | None, *, leads: bool,
) -> list[Condition]:  # fmt: skip
    """The condition that rows are an owner's; none for everybody's (None).

    `leads` says whether nothing else names an index: the one of the owner, in the order of the ids, is then
    the way. Else SQLite must not take it: without statistics it holds every equality for rare, and would sort
    all rows of an owner who has most of them. An owner of few rows leads all the same (see `met`).
    """
    if owner is None:
        return []
    holds = column == owner
    if connection.dialect.name == "sqlite" and not leads:
        holds = aside(holds)
    ids = select(identity).where(column == owner)
    return [Condition(ids=ids, holds=holds, few=_FEW_OF_AN_OWNER)]


def met(
    connection: Connection,
    query: Select[Any],
    identity: InstrumentedAttribute[str],
    conditions: Sequence[Condition],
) -> Select[Any]:
    """The query with every condition, led by one that few rows meet if there is one.

    Without such a one the rows are read in the order of the ids, which finds a page of those that many rows
    meet after a few of them.

    SQLite does not know how many rows a condition leaves and would read the whole table in the order of
    the ids for four rows of a rare kind. So each condition with an index is counted first, up to
    `few` rows, which its index answers in well under a millisecond. PostgreSQL keeps statistics and knows,
    if it plans with the values (`WITH_VALUES`). Only what another table leaves of the rows it
    guesses badly, and reads ten thousand in order for a page of two thousand.
    """
    sqlite = connection.dialect.name == "sqlite"
    query = query.execution_options(**{WITH_VALUES: True})
    asked = (one for one in conditions if sqlite or one.apart)
    lead = fewest(connection, asked)
    for condition in conditions:
        holds = condition.holds
        if condition is lead:
            holds = identity.in_(first(condition.ids))
        elif sqlite and lead is None and getattr(holds, "operator", None) is not operators.eq:
            # An index of the column and the ids serves an equality alone in the order of the ids.
            holds = aside(holds)
        query = query.where(holds)
    return query


def first(ids: Select[Any]) -> Select[Any]:
    """The same ids, of which PostgreSQL too begins."""
    leading = ids.cte("leading").prefix_with("MATERIALIZED", dialect="postgresql")
    return select(leading.c[0])


def aside(holds: ColumnElement[bool]) -> ColumnElement[bool]:
    """The condition such that SQLite does not take the index of its column (see `unindexed`)."""
    if not isinstance(holds, BinaryExpression) or not isinstance(holds.left, Column):
        return holds
    same = holds._clone()
    same.left = unindexed(holds.left)
    return same


def unindexed(column: Any) -> UnaryExpression[Any]:
    """A column with the unary plus of SQLite's documentation: the value as it is, but no index is taken.

    Of numbers PostgreSQL takes it the same way.
    """
    return UnaryExpression(column, operator=custom_op("+"), type_=column.type)


def fewest(connection: Connection, conditions: Iterable[Condition]) -> Condition | None:
    """The first condition that no more rows than its `few` meet, or a later one that far fewer do.

    Counting costs a part of what reading does: after the first, no more rows are counted than pay.
    """
    found: Condition | None = None
    least = math.inf
    for one in conditions:
        most = int(min(one.few, least / _FAR_FEWER))
        bounded = one.ids.limit(most + 1).subquery()
        counted = select(func.count()).select_from(bounded).execution_options(**{WITH_VALUES: True})
        count = connection.execute(counted).scalar_one()
        if count <= most:
            found, least = one, count
    return found


def within(column: InstrumentedAttribute[Any], bounds: Range) -> list[ColumnElement[bool]]:
    """The conditions of a range, each end None for open."""
    low, high = bounds
    if low is not None and high is not None:
        return [column.between(low, high)]
    if low is not None:
        return [column >= low]
    return [] if high is None else [column <= high]


def ordered(
    query: Select[Any], keys: Sequence[InstrumentedAttribute[Any]], *, descending: bool,
    after: Sequence[Any] | None,
) -> Select[Any]:  # fmt: skip
    """Order by columns, the last of which tells all rows apart, and go on behind their values `after`."""
    query = query.order_by(*(key.desc() if descending else key.asc() for key in keys))
    if after is None:
        return query
    here, there = tuple_(*keys), tuple_(*(literal(item) for item in after))
    return query.where(here < there if descending else here > there)


def encode(value: float | None, row_id: str) -> str:
    """The position behind a row: its sort value (None if sorted by id alone) and its id."""
    return base64.urlsafe_b64encode(json.dumps([value, row_id]).encode()).decode().rstrip("=")


_MOST = 2**62  # of whole numbers, which databases hold


def decode(cursor: str) -> Position:
    """The position of a cursor (InvalidRequestError if this service did not make it)."""
    try:
        padded = cursor + "=" * (-len(cursor) % 4)
        value, row_id = json.loads(base64.urlsafe_b64decode(padded.encode("ascii")))
        number = value is None or (isinstance(value, int | float) and math.isfinite(value))
    except (ValueError, TypeError, OverflowError, binascii.Error, RecursionError) as error:
        raise refused(cursor) from error
    large = isinstance(value, int) and abs(value) > _MOST
    if not number or large or isinstance(value, bool) or not isinstance(row_id, str):
        raise refused(cursor)
    return value, row_id


def next_link(path: str, query: BaseModel, value: float | None, row_id: str) -> str:
    """The link to the page behind a row: what was asked, but with that row's position."""
    given = query.model_dump(exclude_defaults=True, exclude={"cursor"}, mode="json")
    words = {key: str(item).lower() if isinstance(item, bool) else item for key, item in given.items()}
    return f"{path}?" + urlencode({**words, "cursor": encode(value, row_id)}, doseq=True)


def refused(cursor: str) -> InvalidRequestError:
    """The error of a cursor that is none of this service."""
    return InvalidRequestError.of(
        ("cursor",), "must come from the `next` link of a page", cursor[:80], source="query"
    )
