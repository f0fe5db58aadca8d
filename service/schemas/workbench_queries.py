"""What is asked of projects and runs: the filters of their lists, and what may be changed of them."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

from pydantic import AwareDatetime, BaseModel, ConfigDict, Field

from service.db.models import JobState
from service.db.repositories.projects import Projects
from service.db.repositories.runs import RunFilter, Runs
from service.jobs.run_words import LONGEST_TAG, MOST_TAGS, Notes, ProjectName, RunName, Tags
from service.queue import cursors
from service.schemas.workbench_answers import ProjectAnswer, ProjectPage, RunAnswer, RunPage
from service.settings.settings import Settings

_CHANGES = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
Limit = Annotated[int, Field(ge=1, le=10_000)]
Cursor = Annotated[str | None, Field(max_length=500)]
Text = Annotated[
    str | None, Field(min_length=1, max_length=200, description="In the name or the notes, in any case.")
]
Binned = Annotated[bool, Field(description="Those in the bin in place of those outside.")]
Whose = Annotated[str | None, Field(max_length=100, description="For keys with the scope admin: whose.")]
ProjectId = Annotated[str, Field(min_length=1, max_length=36)]
OneTag = Annotated[str, Field(min_length=1, max_length=LONGEST_TAG)]


class RunQuery(BaseModel):
    """Which runs to list."""

    model_config = ConfigDict(extra="forbid", frozen=True)
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
        return RunFilter(
            owner=sees, of_owner=self.owner, states=self.status, kind=self.kind, scene=self.scene,
            project=self.project, tags=self.tag, text=self.text, after=self.created_after,
            before=self.created_before, deleted=self.deleted,
        )  # fmt: skip


class ProjectQuery(BaseModel):
    """Which projects to list."""

    model_config = ConfigDict(extra="forbid", frozen=True)
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


def run_page(runs: Runs, query: RunQuery, settings: Settings, sees: str | None, live: Any) -> RunPage:
    """A page of runs and the link to the next one.

    Parameters
    ----------
    live : the progress of a job that runs here, by its id; None of others.

    Raises
    ------
    InvalidRequestError
        If the cursor is not one of this service.
    """
    size = min(query.limit, settings.page_limit)
    before = None if query.cursor is None else cursors.decode(query.cursor)[1]
    rows = runs.page(query.to_filter(sees), size + 1, before)
    following = None
    if len(rows) > size:
        following = cursors.next_link(query.path, query, None, rows[size - 1].job.id)
    items = [RunAnswer.of_run(row, live(row.job.id)) for row in rows[:size]]
    return RunPage(items=items, next=following)


def project_page(
    projects: Projects, query: ProjectQuery, settings: Settings, sees: str | None
) -> ProjectPage:
    """A page of projects and the link to the next one; errors as of `run_page`."""
    size = min(query.limit, settings.page_limit)
    before = None if query.cursor is None else cursors.decode(query.cursor)[1]
    rows = projects.page(
        size + 1, before, owner=sees, text=query.text, deleted=query.deleted
    )  # fmt: skip
    following = None
    if len(rows) > size:
        following = cursors.next_link(query.path, query, None, rows[size - 1].id)
    return ProjectPage(items=[ProjectAnswer.of(row) for row in rows[:size]], next=following)
