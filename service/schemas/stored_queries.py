"""What the lists of stored sweeps and designs share: from the words of a request to a page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Annotated, ClassVar

from pydantic import Field

from service.db.models import NOBODY
from service.db.pagination import Range
from service.db.repositories.owned import RowT
from service.db.repositories.stored import Filter, Part, StoredRepository
from service.schemas.pages import ListQuery, page_of
from service.settings.settings import Settings

Bound = Annotated[float | None, Field(ge=-1e30, le=1e30)]


class StoredQuery(ListQuery):
    """Which rows to list; the fields stand in the queries themselves, in the order of the reference."""

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
) -> tuple[Sequence[RowT], str | None]:
    """The rows of a page and the link to the next one; `page_of` lists the errors."""
    wanted = query.to_filter(sees)
    position = partial(repository.position, sort=wanted.sort)
    return page_of(query, settings, partial(repository.page, wanted), position)
