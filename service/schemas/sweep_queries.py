"""The filters of a list of sweeps: from the words of a request to a query of the repository."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from service.db.models import NOBODY
from service.db.repositories import SweepRepository
from service.schemas.answers import SweepAnswer, SweepPage
from service.schemas.pages import Cursor, Limit
from service.schemas.stored_queries import Bound, StoredQuery, rows_of_page
from service.settings.settings import Settings

Name = Annotated[str | None, Field(max_length=210)]
Count = Annotated[int | None, Field(ge=0, le=10**9)]
Sort = Literal[
    "created", "-created", "peak", "-peak", "peak_at", "-peak_at", "band_hz", "-band_hz",
    "points", "-points", "harmonics", "-harmonics", "seconds", "-seconds",
]  # fmt: skip


class SweepQuery(StoredQuery):
    """Which sweeps to list. `…_min` and `…_max` are inclusive; `-` before a sort means largest first."""

    path: ClassVar[str] = "/v1/sweeps"
    equal: ClassVar[Mapping[str, str]] = {
        "owner": "owner",
        "scene": "scene_name",
        "scene_hash": "scene_hash",
        "parameter": "parameter",
        "harmonics": "harmonics",
        "job": "job_id",
        "completed": "completed",
        "intermediate": "intermediate",
    }
    ranges: ClassVar[Mapping[str, str]] = {
        name: name for name in ("peak", "peak_at", "band_hz", "points", "seconds")
    }
    part: ClassVar[str] = "contact"
    part_ranges: ClassVar[Mapping[str, str]] = {name: name for name in ("N0", "N1", "kt", "mu")}

    owner: Name = Field(default=None, description="For keys with the scope admin: whose.")
    scene: Name = None
    scene_hash: Name = None
    parameter: Name = None
    harmonics: Count = None
    job: Name = None
    of: Name = Field(
        default=None, description="With the run of this id; also if an earlier one computed them for it."
    )
    completed: bool | None = None
    intermediate: bool | None = Field(
        default=None, description="Whether it was computed on the way to another result; both if left out."
    )
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
    limit: Limit = 100
    cursor: Cursor = None


def sweep_page(
    repository: SweepRepository, query: SweepQuery, settings: Settings, sees: str | None = NOBODY
) -> SweepPage:
    """A page and the link to the next one (InvalidRequestError if the cursor is not of this service)."""
    rows, following = rows_of_page(repository, query, settings, sees)
    return SweepPage(items=SweepAnswer.of_rows(rows, repository), next=following)
