"""The filters of a list of sweeps: from the words of a request to a query of the repository."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from service.db.models import NOBODY
from service.db.repositories import SWEEP_SORTS, SweepFilter, SweepRepository, SweepRow
from service.queue import cursors
from service.schemas.answers import SweepAnswer, SweepPage
from service.settings.settings import Settings

Bound = Annotated[float | None, Field(ge=-1e30, le=1e30)]
Name = Annotated[str | None, Field(max_length=210)]
Count = Annotated[int | None, Field(ge=0, le=10**9)]
Sort = Literal[
    "created", "-created", "peak", "-peak", "peak_at", "-peak_at", "band_hz", "-band_hz",
    "points", "-points", "harmonics", "-harmonics", "seconds", "-seconds",
]  # fmt: skip

_RANGES = ("peak", "peak_at", "band_hz", "points", "seconds")
_CONTACT_RANGES = ("N0", "N1", "kt", "mu")
_EQUAL = {
    "owner": "owner",
    "scene": "scene_name",
    "scene_hash": "scene_hash",
    "parameter": "parameter",
    "harmonics": "harmonics",
    "job": "job_id",
    "completed": "completed",
}


class SweepQuery(BaseModel):
    """Which sweeps to list. `…_min` and `…_max` are inclusive; `-` before a sort means largest first."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True)

    owner: Name = Field(default=None, description="For keys with the scope admin: whose.")
    scene: Name = None
    scene_hash: Name = None
    parameter: Name = None
    harmonics: Count = None
    job: Name = None
    completed: bool | None = None
    peak_min: Bound = None
    peak_max: Bound = None
    peak_at_min: Bound = None
    peak_at_max: Bound = None
    band_hz_min: Bound = None
    band_hz_max: Bound = None
    points_min: Count = None
    points_max: Count = None
    seconds_min: Bound = None
    seconds_max: Bound = None
    contact: Name = Field(default=None, description="The contact N0_min and so on are about; any if unset.")
    N0_min: Bound = None
    N0_max: Bound = None
    N1_min: Bound = None
    N1_max: Bound = None
    kt_min: Bound = None
    kt_max: Bound = None
    mu_min: Bound = None
    mu_max: Bound = None
    sort: Sort = "-created"
    limit: int = Field(default=100, ge=1, le=10_000)
    cursor: str | None = Field(default=None, max_length=500)

    def to_filter(self, sees: str | None = NOBODY) -> SweepFilter:
        """The query of the repository; of what belongs to `sees`, or to everybody (None)."""
        equal = {column: getattr(self, name) for name, column in _EQUAL.items()}
        return SweepFilter(
            owner=sees,
            equal={column: value for column, value in equal.items() if value is not None},
            ranges={name: self._range(name) for name in _RANGES},
            contact_ranges={n: self._range(n) for n in _CONTACT_RANGES if self._range(n) != (None, None)},
            contact=self.contact,
            sort=self.sort.removeprefix("-"),
            descending=self.sort.startswith("-"),
        )

    def _range(self, name: str) -> tuple[float | None, float | None]:
        return getattr(self, f"{name}_min"), getattr(self, f"{name}_max")


def sweep_page(
    repository: SweepRepository, query: SweepQuery, settings: Settings, sees: str | None = NOBODY
) -> SweepPage:
    """A page of sweeps and the link to the next one.

    Raises
    ------
    InvalidRequestError
        If the cursor is not one of this service.
    """
    limit = min(query.limit, settings.page_limit)
    after = None if query.cursor is None else cursors.decode(query.cursor)
    rows = repository.page(query.to_filter(sees), limit + 1, after)
    shown, more = rows[:limit], len(rows) > limit
    return SweepPage(
        items=SweepAnswer.of_rows(shown, repository),
        next=_next_link(query, shown[-1]) if more else None,
    )


def _next_link(query: SweepQuery, last: SweepRow) -> str:
    name = query.sort.removeprefix("-")
    value = getattr(last, name) if name in SWEEP_SORTS else None
    return cursors.next_link("/v1/sweeps", query, value, last.id)
