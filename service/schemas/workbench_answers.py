"""Projects, runs and links to them: what is asked, what may be changed, what the service answers."""

from __future__ import annotations

from dataclasses import asdict
from datetime import UTC, datetime
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import AfterValidator, AwareDatetime, BaseModel, Field

from service.db.models import JobState, Project, Share
from service.db.repositories.run_repository import RunFilter, RunRow
from service.jobs.kind_registry import LONGEST_TAG, MOST_TAGS, Notes, ProjectName, RunName, Tags
from service.queue.running import Live
from service.schemas.answers import AnswerModel, AskedModel, Cursor, JobAnswer, Limit, ListQuery, Page, Peak

_REVISION = "Counts the changes; the `ETag`, for `If-Match` of a change."
_DELETED = "When it was put in the bin; null outside of it."


class PendingReport(AnswerModel):
    """A report that is not there yet."""

    job_id: str
    status: Literal["computing", "making"] = Field(description="The job itself, or its report.")


class RunAnswer(JobAnswer):
    """A run: a job with what is said of it."""

    project: str | None = Field(description="Id of the project it belongs to.")
    name: str
    notes: str
    tags: list[str]
    sweeps: int = Field(description="How many sweeps are stored with it: GET /v1/sweeps?of=ID lists them.")
    revision: int = Field(description=_REVISION)
    changed: datetime | None = Field(description="When that was; null if nothing was ever said of it.")
    deleted: datetime | None = Field(description=_DELETED)

    @classmethod
    def of_run(cls, row: RunRow, live: Live | None = None) -> Self:
        """The answer for a row, with progress that is newer than the row if there is any."""
        job, about = f"/v1/jobs/{row.job.id}", f"/v1/runs/{row.job.id}"
        said = {name: getattr(row, name) for name in ("sweeps", "revision", "changed", "deleted")}
        links = {"self": about, "job": job, "shares": f"{about}/shares"}
        return cls.of(row.job, live, links=links, **asdict(row.words), **said)


class RunPage(Page[RunAnswer]):
    """A page of runs, newest first."""


class ProjectAnswer(AnswerModel):
    """A project."""

    id: str
    owner: str
    name: str
    notes: str
    runs: int = Field(description="How many runs are in it, without those in the bin.")
    created: datetime
    changed: datetime
    revision: int = Field(description=_REVISION)
    deleted: datetime | None = Field(description=_DELETED)
    links: dict[str, str]

    @classmethod
    def of(cls, row: Project) -> Self:
        """The answer for a row."""
        links = {"self": f"/v1/projects/{row.id}", "runs": f"/v1/runs?project={row.id}"}
        return cls._from(row, links=links)


class ProjectPage(Page[ProjectAnswer]):
    """A page of projects, newest first."""


class ShareAnswer(AnswerModel):
    """A link to a run that needs no key, without its token."""

    id: str
    run: str
    created: datetime
    expires: datetime | None

    @classmethod
    def of(cls, row: Share, **more: Any) -> Self:
        """The answer for a row."""
        return cls._from(row, run=row.job_id, **more)


class NewShareAnswer(ShareAnswer):
    """A link that was just made; its token is told this once."""

    token: str
    link: str = Field(description="Of the run, below the address of the service.")


class ShareList(AnswerModel):
    """The links to a run, oldest first."""

    items: list[ShareAnswer]


class ShareQuery(ListQuery):
    """Which links to list."""

    path: ClassVar[str] = "/v1/shares"

    limit: Limit = 100
    cursor: Cursor = None


class SharePage(Page[ShareAnswer]):
    """A page of links, newest first."""


_SAID = ("project", "name", "notes", "tags")


class SharedRun(AnswerModel):
    """A run as a link shows it: what was asked and how it ended."""

    id: str
    kind: str
    status: str
    progress: float
    scene: str | None
    name: str
    notes: str
    tags: list[str]
    created: datetime
    started: datetime | None
    finished: datetime | None
    error: dict[str, Any] | None
    request: dict[str, Any] | None

    @classmethod
    def of(cls, row: RunRow) -> Self:
        """The answer for a row."""
        job, words = row.job, row.words
        # Neither its project is shared nor what was said of it before.
        request = {key: value for key, value in (job.request or {}).items() if key not in _SAID}
        return cls._from(
            job, status=job.state.value, scene=job.scene_name, name=words.name, notes=words.notes,
            tags=list(words.tags), request=request,
        )  # fmt: skip


class InputDifference(AnswerModel):
    """An input that two runs do not share; null where it is not given."""

    path: str = Field(description="`damper.N0` for a value of a contact, else the keys joined by dots.")
    part: str = Field(description="`scene`, or `settings` for what the kind takes besides.")
    a: Any
    b: Any


class Figure(AnswerModel):
    """A figure of the results of two runs; null where a run has none."""

    name: str
    a: float | str | bool | None
    b: float | str | bool | None


class Comparison(AnswerModel):
    """Two runs side by side."""

    a: RunAnswer
    b: RunAnswer
    inputs: list[InputDifference] = Field(description="What differs, as it was computed.")
    more_inputs: int = Field(description="How many more differ than are listed.")
    results: list[Figure] = Field(description="The main figures of both, equal ones too.")


class SmallCurve(AnswerModel):
    """A response in few points: the highest amplitude [m] of each stretch, and the frequency [Hz] there."""

    sweep: str = Field(description="Id of the stored sweep.")
    frequency_hz: list[float]
    amplitude: list[float]


class RunSummary(AnswerModel):
    """What was asked of a run and what came out, in figures; null where there is none."""

    id: str
    request: dict[str, Any] | None
    values: dict[str, float | None] = Field(
        description="At the optimum, else those that were identified or set."
    )
    peak: Peak | None = Field(
        description="The highest peak [m] and its frequency [Hz]; of a robust design the worst."
    )
    worst: bool = Field(description="Whether that is the worst of uncertain cases.")
    band_hz: float | None
    error_estimate: float | None = Field(description="Of the highest peak [m].")
    harmonics: int | None
    found: list[str] = Field(
        description="What else there is to say: how many optima, modes, designs of a front."
    )
    curve: SmallCurve | None


Text = Annotated[
    str | None, Field(min_length=1, max_length=200, description="In the name or the notes, in any case.")
]
Binned = Annotated[bool, Field(description="Those in the bin in place of those outside.")]
Whose = Annotated[str | None, Field(max_length=100, description="For keys with the scope admin: whose.")]
ProjectId = Annotated[str, Field(min_length=1, max_length=36)]
OneTag = Annotated[str, Field(min_length=1, max_length=LONGEST_TAG)]


def _in_the_calendar(when: datetime) -> datetime:
    try:
        return when.astimezone(UTC)
    except OverflowError as error:
        raise ValueError("must be from 0001-01-01 to 9999-12-31 in UTC") from error


Time = Annotated[AwareDatetime | None, AfterValidator(lambda when: when and _in_the_calendar(when))]


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
    created_after: Time = Field(default=None, description="Handed in then or later.")
    created_before: Time = Field(default=None, description="Handed in earlier.")
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


class RunChanges(AskedModel):
    """What is to be changed of a run; what is left out stays as it is."""

    project: ProjectId | None = Field(default=None, description="Id of a project; null for none.")
    name: RunName = ""
    notes: Notes = ""
    tags: Tags = Field(default=(), description="In place of those it has.")


class NewProject(AskedModel):
    """A project to be made."""

    name: ProjectName
    notes: Notes = ""


class ProjectChanges(AskedModel):
    """What is to be changed of a project; what is left out stays as it is."""

    name: ProjectName = "-"
    notes: Notes = ""


class NewLink(AskedModel):
    """A link to be made."""

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
