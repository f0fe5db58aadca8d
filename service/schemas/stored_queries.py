"""What the lists of stored sweeps and designs share: from the words of a request to a page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, ClassVar

from pydantic import BaseModel, ConfigDict, Field

from service.db.models import NOBODY
from service.db.pagination import Range
from service.db.repositories.owned import RowT
from service.db.repositories.stored import Filter, Part, StoredRepository
from service.queue import cursors
from service.settings.settings import Settings

Bound = Annotated[float | None, Field(ge=-1e30, le=1e30)]


class StoredQuery(BaseModel):
    """Which rows to list; the fields stand in the queries themselves, in the order of the reference."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True)

    path: ClassVar[str]
    """Of the list."""
    equal: ClassVar[Mapping[str, str]]
    """Filter to the column that must have its value."""
    ranges: ClassVar[Mapping[str, str]]
    """Filter, without its ``_min`` and ``_max``, to the column it is about."""
    part: ClassVar[str]
    """Filter by the name of a part."""
    part_ranges: ClassVar[Mapping[str, str]]
    """As `ranges`, of the parts."""

    if TYPE_CHECKING:  # fields of every query, each where its list has them
        sort: str
        limit: int
        cursor: str | None

    def to_filter(self, sees: str | None = NOBODY) -> Filter:
        """The query of the repository; of what belongs to `sees`, or to everybody (None)."""
        equal = {column: getattr(self, name) for name, column in self.equal.items()}
        of_parts = {column: self._range(name) for name, column in self.part_ranges.items()}
        return Filter(
            owner=sees,
            equal={column: value for column, value in equal.items() if value is not None},
            ranges={column: self._range(name) for name, column in self.ranges.items()},
            part=getattr(self, self.part),
            of=getattr(self, "of", None),
            part_ranges={column: bounds for column, bounds in of_parts.items() if bounds != (None, None)},
            sort=self.sort.removeprefix("-"),
            descending=self.sort.startswith("-"),
        )

    def _range(self, name: str) -> Range:
        return getattr(self, f"{name}_min"), getattr(self, f"{name}_max")


def rows_of_page(
    repository: StoredRepository[RowT, Part], query: StoredQuery, settings: Settings, sees: str | None
) -> tuple[list[RowT], str | None]:
    """Return the rows of a page and the link to the next one, None on the last.

    Raises
    ------
    InvalidRequestError
        If the cursor is not one of this service.
    """
    limit = min(query.limit, settings.page_limit)
    after = None if query.cursor is None else cursors.decode(query.cursor)
    wanted = query.to_filter(sees)
    rows = repository.page(wanted, limit + 1, after)
    if len(rows) <= limit:
        return rows, None
    shown = rows[:limit]
    return shown, cursors.next_link(query.path, query, *repository.position(shown[-1], wanted.sort))
