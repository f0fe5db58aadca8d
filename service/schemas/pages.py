"""What all lists share: how they are asked for, and a page of what is found."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Protocol, TypeVar

from pydantic import BaseModel, ConfigDict, Field

from service.db import pagination
from service.db.pagination import Position
from service.settings.settings import Settings

Limit = Annotated[int, Field(ge=1, le=10_000)]
Cursor = Annotated[str | None, Field(max_length=500)]


class AskedModel(BaseModel):
    """Root of what is asked: no other keys, no number that is not finite."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True)


class ListQuery(AskedModel):
    """What to list; the fields stand in the queries themselves, in the order of the reference."""

    path: ClassVar[str]
    """Of the list."""

    if TYPE_CHECKING:  # fields of every query, each where its list has them
        limit: int
        cursor: str | None


class Numbered(Protocol):
    """A row with an id; ids sort by time."""

    @property
    def id(self) -> Any:
        """Its id, a str."""


RowT = TypeVar("RowT")
NumberedT = TypeVar("NumberedT", bound=Numbered)


def page_of(
    query: ListQuery,
    settings: Settings,
    read: Callable[[int, Position | None], Sequence[RowT]],
    position: Callable[[RowT], Position],
) -> tuple[Sequence[RowT], str | None]:
    """The rows of a page and the link to the next one, None on the last.

    Parameters
    ----------
    read : finds so many rows at most, those behind a position if there is one.
    position : where a page that ends with a row goes on.

    Raises
    ------
    InvalidRequestError
        If the cursor is not one of this service.
    """
    limit = min(query.limit, settings.page_limit)
    rows = read(limit + 1, None if query.cursor is None else pagination.decode(query.cursor))
    if len(rows) <= limit:
        return rows, None
    return rows[:limit], pagination.next_link(query.path, query, *position(rows[limit - 1]))


def newest(
    query: ListQuery, settings: Settings, read: Callable[[int, str | None], Sequence[NumberedT]]
) -> tuple[Sequence[NumberedT], str | None]:
    """As `page_of`, newest first: `read` finds rows older than the one of an id, if there is one."""
    return page_of(
        query, settings, lambda most, after: read(most, after and after[1]), lambda row: (None, row.id)
    )
