"""The filters of a list of designs: from the words of a request to a query of the repository."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from service.db.models import NOBODY
from service.db.repositories import DESIGN_SORTS, DesignFilter, DesignRepository, DesignRow
from service.queue import cursors
from service.schemas.answers import DesignAnswer, DesignDetail, DesignPage
from service.settings.settings import Settings

if TYPE_CHECKING:
    from service.queue.core import WholeDesign

Bound = Annotated[float | None, Field(ge=-1e30, le=1e30)]
Name = Annotated[str | None, Field(max_length=500)]
Sort = Literal[
    "created", "-created", "objective", "-objective", "peak", "-peak", "peak_at", "-peak_at", "band", "-band",
    "work", "-work", "seconds", "-seconds",
]  # fmt: skip

_RANGES = {
    "objective": "objective", "peak": "peak", "peak_at": "peak_at", "band": "band_hz", "work": "work",
    "seconds": "seconds",
}  # fmt: skip
_EQUAL = {
    "owner": "owner",
    "scene": "scene_name", "scene_hash": "scene_hash", "method": "method", "robust": "robust",
    "reached": "reached", "feasible": "feasible", "harmonics": "harmonics",
}  # fmt: skip


class DesignQuery(BaseModel):
    """Which designs to list. `…_min` and `…_max` are inclusive; `-` before a sort means largest first."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True)

    owner: Name = Field(default=None, description="For keys with the scope admin: whose.")
    scene: Name = None
    scene_hash: Name = None
    variable: Name = Field(default=None, description="Name of a variable it must have.")
    value_min: Bound = Field(default=None, description="Of the best value of `variable`, or of any.")
    value_max: Bound = None
    method: Name = None
    robust: bool | None = None
    reached: bool | None = None
    feasible: bool | None = None
    harmonics: Annotated[int | None, Field(ge=0, le=10**9)] = None
    objective_min: Bound = None
    objective_max: Bound = None
    peak_min: Bound = Field(default=None, description="Of the highest peak [m].")
    peak_max: Bound = None
    peak_at_min: Bound = Field(default=None, description="Of the frequency of the highest peak [Hz].")
    peak_at_max: Bound = None
    band_min: Bound = Field(default=None, description="Of the width of the resonance band [Hz].")
    band_max: Bound = None
    work_min: Bound = None
    work_max: Bound = None
    seconds_min: Bound = None
    seconds_max: Bound = None
    sort: Sort = "-created"
    limit: int = Field(default=100, ge=1, le=10_000)
    cursor: str | None = Field(default=None, max_length=500)

    def to_filter(self, sees: str | None = NOBODY) -> DesignFilter:
        """The query of the repository; of what belongs to `sees`, or to everybody (None)."""
        equal = {column: getattr(self, name) for name, column in _EQUAL.items()}
        return DesignFilter(
            owner=sees,
            equal={column: value for column, value in equal.items() if value is not None},
            ranges={column: self._range(name) for name, column in _RANGES.items()},
            variable=self.variable,
            value=(self.value_min, self.value_max),
            sort=self.sort.removeprefix("-"),
            descending=self.sort.startswith("-"),
        )

    def _range(self, name: str) -> tuple[float | None, float | None]:
        return getattr(self, f"{name}_min"), getattr(self, f"{name}_max")


def design_page(
    repository: DesignRepository, query: DesignQuery, settings: Settings, sees: str | None = NOBODY
) -> DesignPage:
    """A page of designs and the link to the next one.

    Raises
    ------
    InvalidRequestError
        If the cursor is not one of this service.
    """
    limit = min(query.limit, settings.page_limit)
    after = None if query.cursor is None else cursors.decode(query.cursor)
    rows = repository.page(query.to_filter(sees), limit + 1, after)
    shown, more = rows[:limit], len(rows) > limit
    return DesignPage(
        items=DesignAnswer.of_rows(shown, repository),
        next=_next_link(query, shown[-1]) if more else None,
    )


def design_detail(found: WholeDesign, repository: DesignRepository) -> DesignDetail:
    """The answer for a whole design."""
    variables = repository.variables([found.row.job_id])[found.row.job_id]
    return DesignDetail(
        **DesignDetail.values(found.row, variables), problem=found.job.request or {}, result=found.result
    )


def _next_link(query: DesignQuery, last: DesignRow) -> str:
    column = query.sort.removeprefix("-")
    value = getattr(last, _RANGES[column]) if column in DESIGN_SORTS else None
    return cursors.next_link("/v1/designs", query, value, last.job_id)
