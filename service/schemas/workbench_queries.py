"""What is asked of projects and runs: the filters of their lists, and what may be changed of them."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

from pydantic import AwareDatetime, BaseModel, ConfigDict, Field

from service.db.models import JobState
from service.db.repositories.runs import RunFilter
from service.jobs.registry import LONGEST_TAG, MOST_TAGS, Notes, ProjectName, RunName, Tags
from service.schemas.pages import Cursor, Limit, ListQuery

_CHANGES = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
Text = Annotated[
    str | None, Field(min_length=1, max_length=200, description="In the name or the notes, in any case.")
]
Binned = Annotated[bool, Field(description="Those in the bin in place of those outside.")]
Whose = Annotated[str | None, Field(max_length=100, description="For keys with the scope admin: whose.")]
ProjectId = Annotated[str, Field(min_length=1, max_length=36)]
OneTag = Annotated[str, Field(min_length=1, max_length=LONGEST_TAG)]


class RunQuery(ListQuery):
    """Which runs to list."""

    path: ClassVar[str] = "/v1/runs"

    owner: Whose = None
    status: list[JobState] = Field(
        default=[], max_length=len(JobState), description="In this state; repeated: in one of these."
    )
    kind: str | None = Field(default=None, max_length=32)
    scene: str | None = Field(default=None, max_length=200)
    project: ProjectId | None = Field(default=None, description="In the project of this id.")
    tag: list[OneTag] = Field(
        default=[], max_length=MOST_TAGS, description="Marked with it; repeated: with all of them."
    )
    text: Text = None
    created_after: AwareDatetime | None = Field(default=None, description="Handed in then or later.")
    created_before: AwareDatetime | None = Field(default=None, description="Handed in earlier.")
    deleted: Binned = False
    limit: Limit = 100
    cursor: Cursor = None

    def to_filter(self, sees: str | None) -> RunFilter:
        """The query of the repository; of what belongs to `sees`, or to everybody (None)."""
        return RunFilter(sees=sees, **self.model_dump(exclude={"limit", "cursor"}))


class ProjectQuery(ListQuery):
    """Which projects to list."""

    path: ClassVar[str] = "/v1/projects"

    text: Text = None
    deleted: Binned = False
    limit: Limit = 100
    cursor: Cursor = None


class RunChanges(BaseModel):
    """What is to be changed of a run; what is left out stays as it is."""

    model_config = _CHANGES

    project: ProjectId | None = Field(default=None, description="Id of a project; null for none.")
    name: RunName = ""
    notes: Notes = ""
    tags: Tags = Field(default=(), description="In place of those it has.")


class NewProject(BaseModel):
    """A project to be made."""

    model_config = _CHANGES

    name: ProjectName
    notes: Notes = ""


class ProjectChanges(BaseModel):
    """What is to be changed of a project; what is left out stays as it is."""

    model_config = _CHANGES

    name: ProjectName = "-"
    notes: Notes = ""


class NewLink(BaseModel):
    """A link to be made."""

    model_config = _CHANGES

    days: float | None = Field(
        default=None,
        strict=True,
        ge=0.001,
        le=36_500.0,
        description="After which it ends; never if left out.",
    )


def changes_of(asked: BaseModel) -> dict[str, Any]:
    """What a request changes: the keys that were given."""
    return {name: getattr(asked, name) for name in asked.model_fields_set}
