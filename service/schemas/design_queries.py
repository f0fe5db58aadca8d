"""The filters of a list of designs: from the words of a request to a query of the repository."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field

from service.db.models import NOBODY
from service.db.repositories import DesignRepository
from service.schemas.answers import DesignAnswer, DesignDetail, DesignPage
from service.schemas.pages import Cursor, Limit
from service.schemas.stored_queries import Bound, StoredQuery, rows_of_page
from service.settings.settings import Settings

if TYPE_CHECKING:
    from service.queue.core import WholeDesign

Name = Annotated[str | None, Field(max_length=500)]
Sort = Literal[
    "created", "-created", "objective", "-objective", "peak", "-peak", "peak_at", "-peak_at", "band", "-band",
    "work", "-work", "seconds", "-seconds",
]  # fmt: skip


class DesignQuery(StoredQuery):
    """Which designs to list. `…_min` and `…_max` are inclusive; `-` before a sort means largest first."""

    path: ClassVar[str] = "/v1/designs"
    equal: ClassVar[Mapping[str, str]] = {
        "owner": "owner",
        "scene": "scene_name", "scene_hash": "scene_hash", "method": "method", "robust": "robust",
        "reached": "reached", "feasible": "feasible", "harmonics": "harmonics",
    }  # fmt: skip
    ranges: ClassVar[Mapping[str, str]] = {
        "objective": "objective", "peak": "peak", "peak_at": "peak_at", "band": "band_hz", "work": "work",
        "seconds": "seconds",
    }  # fmt: skip
    part: ClassVar[str] = "variable"
    part_ranges: ClassVar[Mapping[str, str]] = {"value": "value"}

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
    limit: Limit = 100
    cursor: Cursor = None


def design_page(
    repository: DesignRepository, query: DesignQuery, settings: Settings, sees: str | None = NOBODY
) -> DesignPage:
    """A page and the link to the next one (InvalidRequestError if the cursor is not of this service)."""
    rows, following = rows_of_page(repository, query, settings, sees)
    return DesignPage(items=DesignAnswer.of_rows(rows, repository), next=following)


def design_detail(found: WholeDesign, repository: DesignRepository) -> DesignDetail:
    """The answer for a whole design."""
    variables = repository.parts([found.row.job_id])[found.row.job_id]
    return DesignDetail.of(found.row, variables, problem=found.job.request or {}, result=found.result)
