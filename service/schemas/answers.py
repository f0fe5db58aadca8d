"""What the service answers, over HTTP and embedded alike."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import asdict
from datetime import datetime
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from service.db.models import Design, JobState, Scene, Sweep
from service.db.repositories import JobRow, SweepRepository
from service.db.repositories.stored import StoredRepository
from service.jobs.arrays import decode
from service.jobs.outputs import ContactValues, Told, VariableValues

if TYPE_CHECKING:
    from service.queue.core import Results


# What an answer has under the name of its column; a peak stands there with its place.
_COLUMNS: dict[type[Any], frozenset[str]] = {
    table: frozenset(table.__mapper__.columns.keys()) - {"peak"} for table in (Sweep, Design)
}


BEST = (
    "The best design that a search knew last, of a `design`: values, peak, objective, feasible, verified, "
    "words, evaluations."
)


class Answer(BaseModel):
    """Root of the answers."""

    model_config = ConfigDict(frozen=True)


class JobAnswer(Answer):
    """A job."""

    id: str
    owner: str = Field(description="Whom it belongs to; empty if it was made without a key.")
    kind: str
    status: JobState
    progress: float = Field(description="Fraction of the path, 0 to 1.")
    points: int = Field(description="Points computed so far.")
    best: dict[str, Any] | None = Field(default=None, description=BEST)
    scene: str | None
    priority: int
    attempt: int
    max_attempts: int
    cancel_requested: bool
    created: datetime
    started: datetime | None
    finished: datetime | None
    result_of: str | None = Field(description="The earlier job whose stored result answers this one.")
    error: dict[str, Any] | None = Field(description="Why it failed: type, detail, issues.")
    request: dict[str, Any] | None = Field(description="What was asked; null in lists.")
    links: dict[str, str]

    @classmethod
    def of(cls, row: JobRow, live: Told | None = None) -> Self:
        """The answer for a row, with progress that is newer than the row if there is any."""
        progress, points, best = live or (row.progress, row.points, row.best)
        source = row.result_of or row.id
        links = {
            "self": f"/v1/jobs/{row.id}",
            "results": f"/v1/jobs/{row.id}/results",
            "scene": f"/v1/jobs/{row.id}/scene",
            "sweeps": f"/v1/sweeps?job={source}",
        }
        if row.kind == "design":
            links["design"] = f"/v1/designs/{source}"
        return cls(
            id=row.id,
            owner=row.owner,
            kind=row.kind,
            status=row.state,
            progress=progress,
            points=points,
            best=None if best is None else dict(best),
            scene=row.scene_name,
            priority=row.priority,
            attempt=row.attempt,
            max_attempts=row.max_attempts,
            cancel_requested=row.cancel_requested,
            created=row.created,
            started=row.started,
            finished=row.finished,
            result_of=row.result_of,
            error=row.error,
            request=row.request,
            links=links,
        )


class KindAnswer(Answer):
    """A kind of job."""

    name: str
    summary: str
    body: dict[str, Any] = Field(description="JSON Schema of the body of `POST /v1/jobs`, with examples.")
    result: dict[str, Any] | None = Field(description="JSON Schema of the result; null for any object.")


class KindList(Answer):
    """All kinds of job."""

    items: list[KindAnswer]


class JobPage(Answer):
    """A page of jobs, newest first."""

    items: list[JobAnswer]
    next: str | None = Field(description="Link to the next page; null on the last one.")


class Peak(Answer):
    """The largest amplitude of a branch and where it is."""

    value: float
    at: float


class StoredAnswer(Answer, ABC):
    """What the answers for a stored sweep and a stored design share."""

    @classmethod
    def shared(cls, row: Sweep | Design) -> dict[str, Any]:
        """The fields that both have: what is named like its column, the scene, and a peak with its place."""
        peak = None
        if row.peak is not None and row.peak_at is not None:
            peak = Peak(value=row.peak, at=row.peak_at)
        columns = _COLUMNS[type(row)]
        same = {name: getattr(row, name) for name in cls.model_fields if name in columns}
        return {**same, "scene": row.scene_name, "peak": peak}

    @classmethod
    @abstractmethod
    def values(cls, row: Any, parts: Sequence[Any]) -> dict[str, Any]:
        """The fields of the answer for a row with its parts."""

    @classmethod
    def of_rows(cls, rows: Sequence[Any], repository: StoredRepository[Any, Any]) -> list[Self]:
        """The answers for several rows."""
        parts = repository.parts([row.key for row in rows])
        return [cls(**cls.values(row, parts[row.key])) for row in rows]


class ContactAnswer(Answer):
    """Values of a contact during a sweep; null where the value was swept."""

    kt: float | None
    mu: float | None
    N0: float | None
    N1: float | None
    N1_phase: float | None


class SweepAnswer(StoredAnswer):
    """A stored sweep."""

    model_config = ConfigDict(frozen=True, validate_by_name=True, serialize_by_alias=True)

    id: str
    owner: str
    job: str
    scene: str
    scene_hash: str
    parameter: str
    from_: float = Field(alias="from")
    to: float
    frequency_hz: float | None
    excitation_amplitude: float | None
    harmonics: int
    points: int
    peak: Peak | None
    limit: float | None
    band_hz: float | None
    error_estimate: float | None = Field(
        default=None, description="Of the highest peak [m]; null if it was stored by an earlier version."
    )
    peaks_known: bool | None = Field(
        default=None,
        description="Whether it is known that no higher peak hides between two points; null if it was stored "
        "by an earlier version.",
    )
    newton_iterations: int
    rejected_steps: int
    seconds: float
    completed: bool
    status: str
    created: datetime
    contacts: dict[str, ContactAnswer]
    links: dict[str, str]

    @classmethod
    def values(cls, row: Sweep, contacts: Sequence[ContactValues]) -> dict[str, Any]:
        """The fields of the answer for a row."""
        return {
            **cls.shared(row),
            "job": row.job_id,
            "from_": row.from_value,
            "to": row.to_value,
            "contacts": {contact.name: _contact(contact) for contact in contacts},
            "links": {"self": f"/v1/sweeps/{row.id}", "job": f"/v1/jobs/{row.job_id}"},
        }


class SweepDetail(SweepAnswer):
    """A stored sweep with its arrays, as nested lists."""

    arrays: dict[str, list[Any]]

    @classmethod
    def load(cls, row: Sweep, repository: SweepRepository) -> Self:
        """The sweep of a row."""
        stored = repository.arrays(row.id)
        return cls(
            **cls.values(row, repository.parts([row.id])[row.id]),
            arrays={name: _listed(decode(array)) for name, array in stored.items()},
        )


class SweepPage(Answer):
    """A page of sweeps."""

    items: list[SweepAnswer]
    next: str | None = Field(description="Link to the next page; null on the last one.")


class JobScene(Answer):
    """The scene of a job, as it is computed."""

    job: str
    scene: dict[str, Any]


class ResultsHead(Answer):
    """What a job computed, without it."""

    job: str
    status: JobState


class ResultsAnswer(ResultsHead):
    """What a job computed."""

    result: dict[str, Any]
    sweeps: list[SweepAnswer]

    @classmethod
    def of(cls, results: Results, repository: SweepRepository) -> Self:
        """The answer for the results of a job."""
        return cls(
            job=results.job.id,
            status=results.job.state,
            result=results.result,
            sweeps=SweepAnswer.of_rows(results.sweeps, repository),
        )


class VariableAnswer(Answer):
    """A variable of a design: its best value, null if no design could be computed, and its bounds."""

    value: float | None
    low: float
    high: float


class DesignAnswer(StoredAnswer):
    """A stored design; its id is that of its job."""

    id: str
    owner: str
    scene: str
    scene_hash: str
    method: str
    robust: bool = Field(description="Whether it is the best in the worst case of uncertain parameters.")
    reached: bool = Field(description="Whether the goal was reached.")
    feasible: bool = Field(description="Whether it keeps every limit.")
    status: str
    objective: float | None
    peak: Peak | None
    limit: float | None
    band_hz: float | None
    harmonics: int
    evaluations: int
    work: float | None = Field(description="What the search cost, in frequency responses.")
    seconds: float
    created: datetime
    variables: dict[str, VariableAnswer]
    links: dict[str, str]

    @classmethod
    def values(cls, row: Design, variables: Sequence[VariableValues]) -> dict[str, Any]:
        """The fields of the answer for a row."""
        return {
            **cls.shared(row),
            "id": row.job_id,
            "variables": {v.name: VariableAnswer(value=v.value, low=v.low, high=v.high) for v in variables},
            "links": {
                "self": f"/v1/designs/{row.job_id}",
                "job": f"/v1/jobs/{row.job_id}",
                "sweeps": f"/v1/sweeps?job={row.job_id}",
            },
        }


class DesignDetail(DesignAnswer):
    """A stored design with its problem and the whole result of its job."""

    problem: dict[str, Any] = Field(description="What was asked: the body of the request.")
    result: dict[str, Any]


class DesignPage(Answer):
    """A page of designs."""

    items: list[DesignAnswer]
    next: str | None = Field(description="Link to the next page; null on the last one.")


class FinishedJob(JobAnswer):
    """A finished job with what it computed, as answered to those who waited for it."""

    result: dict[str, Any] | None
    sweeps: list[SweepAnswer]


class SceneAnswer(Answer):
    """A scene in a list."""

    owner: str = Field(description="Whose it is; a shipped scene is everybody's.")
    name: str
    shipped: bool
    scene_hash: str
    created: datetime | None
    links: dict[str, str]

    @classmethod
    def of(cls, scene: Scene) -> Self:
        """The answer for a scene."""
        return cls(**cls.values(scene))

    @classmethod
    def values(cls, scene: Scene) -> dict[str, Any]:
        """The fields of the answer for a scene."""
        return {
            "owner": scene.owner,
            "name": scene.name,
            "shipped": scene.shipped,
            "scene_hash": scene.scene_hash,
            "created": scene.created,
            "links": {"self": f"/v1/scenes/{scene.name}"},
        }


class SceneDetail(SceneAnswer):
    """A scene with its tables."""

    scene: dict[str, Any]

    @classmethod
    def of_whole(cls, scene: Scene) -> Self:
        """The answer for a scene."""
        return cls(**cls.values(scene), scene=dict(scene.body))


class SceneList(Answer):
    """A page of the scenes."""

    items: list[SceneAnswer]
    next: str | None = Field(description="Link to the next page; null on the last one.")


def _listed(array: NDArray[Any]) -> list[Any]:
    """Nested lists; null where a number is not finite."""
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        finite = np.isfinite(array)
        array = array.astype(object)
        array[~finite] = None
    listed: list[Any] = array.tolist()
    return listed


def _contact(contact: ContactValues) -> ContactAnswer:
    values = asdict(contact)
    del values["name"]
    return ContactAnswer(**values)
