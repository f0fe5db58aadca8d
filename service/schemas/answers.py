"""What the service answers, over HTTP and embedded alike: lists and how they are asked for, events, laws."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Generic, Protocol, Self, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from service.db import pagination
from service.db.models import JobState, StoredScene
from service.db.pagination import Position
from service.db.repositories import JobRow, ResultRepository
from service.jobs.stored_figures import DESIGN, SWEEP, DesignRecord, Quantity, StoredRecord, SweepRecord
from service.settings.settings import Settings
from solver.contacts.laws.law_registry import DEFAULT, laws
from solver.results.told import ResultTable, Summary
from solver.scene.json_schema import scene_schema
from solver.scene.toml import shipped_text

if TYPE_CHECKING:
    from service.queue.core import Results, WholeDesign
    from service.queue.running import Live


BEST = (
    "The best design that a search knew last, of a `design`: values, peak, objective, feasible, verified, "
    "words, evaluations."
)


_NONE = object()


class AnswerModel(BaseModel):
    """Root of the answers."""

    model_config = ConfigDict(frozen=True)

    @classmethod
    def _from(cls, row: object, **more: Any) -> Self:
        """The answer with `more`, and with every other field that the row has under the same name."""
        same = ((name, getattr(row, name, _NONE)) for name in cls.model_fields if name not in more)
        return cls(**{name: value for name, value in same if value is not _NONE}, **more)


AnswerT = TypeVar("AnswerT", bound=AnswerModel)


class Page(AnswerModel, Generic[AnswerT]):
    """A page of a list."""

    items: list[AnswerT]
    next: str | None = Field(description="Link to the next page; null on the last one.")


class JobAnswer(AnswerModel):
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
    def of(cls, row: JobRow, live: Live | None = None, **more: Any) -> Self:
        """The answer for a row, with progress that is newer than the row if there is any, and with `more`."""
        progress, best = (row.progress, row.best) if live is None else (live.fraction, live.best)
        source = row.result_of or row.id
        links = {
            "self": f"/v1/jobs/{row.id}",
            "results": f"/v1/jobs/{row.id}/results",
            "scene": f"/v1/jobs/{row.id}/scene",
            "sweeps": f"/v1/sweeps?job={source}",
        }
        if row.kind == "design":
            links["design"] = f"/v1/designs/{source}"
        return cls._from(
            row, status=row.state, progress=progress, points=(live or row).points, scene=row.scene_name,
            best=None if best is None else dict(best), links=links | more.pop("links", {}), **more,
        )  # fmt: skip


class KindAnswer(AnswerModel):
    """A kind of job."""

    name: str
    summary: str
    body: dict[str, Any] = Field(description="JSON Schema of the body of `POST /v1/jobs`, with examples.")
    result: dict[str, Any] | None = Field(description="JSON Schema of the result; null for any object.")


class KindList(AnswerModel):
    """All kinds of job."""

    items: list[KindAnswer]


class JobPage(Page[JobAnswer]):
    """A page of jobs, newest first."""


class Peak(AnswerModel):
    """The largest amplitude of a branch and where it is."""

    value: float
    at: float


class StoredAnswer(AnswerModel):
    """What the answers for a stored sweep and a stored design share."""

    @classmethod
    def _stored(cls, record: SweepRecord | DesignRecord, **more: Any) -> Self:
        """The answer with what both have: the scene, and a peak with its place."""
        peak = None
        if record.peak is not None and record.peak_at is not None:
            peak = Peak(value=record.peak, at=record.peak_at)
        return cls._from(record, scene=record.scene_name, peak=peak, **more)


class ContactAnswer(AnswerModel):
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
    def of(cls, row: SweepRecord, **more: Any) -> Self:
        """The answer for a sweep."""
        return cls._stored(
            row, job=row.job_id, from_=row.from_value, to=row.to_value,
            contacts={contact.name: ContactAnswer._from(contact) for contact in row.contacts},
            links={"self": f"/v1/sweeps/{row.id}", "job": f"/v1/jobs/{row.job_id}"}, **more,
        )  # fmt: skip


class SweepDetail(SweepAnswer):
    """A stored sweep with its arrays, as nested lists."""

    arrays: dict[str, list[Any]]

    @classmethod
    def load(cls, row: SweepRecord, repository: ResultRepository) -> Self:
        """The sweep with its arrays."""
        arrays = {name: _listed(array.array()) for name, array in repository.arrays(row.id).items()}
        return cls.of(row, arrays=arrays)


class SweepPage(Page[SweepAnswer]):
    """A page of sweeps."""


class JobScene(AnswerModel):
    """The scene of a job, as it is computed."""

    job: str
    scene: dict[str, Any]


class ResultsHead(AnswerModel):
    """What a job computed, without it."""

    job: str
    status: JobState


class ResultsAnswer(ResultsHead):
    """What a job computed."""

    result: dict[str, Any]
    sweeps: list[SweepAnswer]

    @classmethod
    def of(cls, results: Results) -> Self:
        """The answer for the results of a job."""
        sweeps = [SweepAnswer.of(one) for one in results.sweeps]
        return cls(job=results.job.id, status=results.job.state, result=results.result, sweeps=sweeps)


class ToldAnswer(AnswerModel):
    """What people read of a result, as the command prints it: names with their values, and tables."""

    blocks: list[Summary | ResultTable]


class VariableAnswer(AnswerModel):
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
    def of(cls, row: DesignRecord, **more: Any) -> Self:
        """The answer for a design."""
        links = {
            "self": f"/v1/designs/{row.job_id}",
            "job": f"/v1/jobs/{row.job_id}",
            "sweeps": f"/v1/sweeps?job={row.job_id}",
        }
        variables = {one.name: VariableAnswer._from(one) for one in row.variables}
        return cls._stored(row, variables=variables, links=links, **more)


class DesignDetail(DesignAnswer):
    """A stored design with its problem and the whole result of its job."""

    problem: dict[str, Any] = Field(description="What was asked: the body of the request.")
    result: dict[str, Any]

    @classmethod
    def whole(cls, found: WholeDesign) -> Self:
        """The answer for a design with its job."""
        return cls.of(found.row, problem=found.job.request or {}, result=found.result)


class DesignPage(Page[DesignAnswer]):
    """A page of designs."""


class QuantityAnswer(AnswerModel):
    """What a figure is."""

    unit: str = Field(description="Empty if it has none, or one that the result says.")
    description: str


class StoredResult(AnswerModel):
    """A stored result with its figures."""

    id: str
    of: str
    owner: str
    job: str
    scene: str | None
    scene_hash: str | None
    status: str = Field(description="How the computation ended.")
    created: datetime
    figures: dict[str, bool | int | float | str] = Field(description="Numbers, truths and words by name.")
    links: dict[str, str]

    @classmethod
    def of_record(cls, record: StoredRecord, known: Mapping[str, Quantity]) -> Self:
        """The answer for a record; of its figures those that are known."""
        places = {SWEEP: f"/v1/sweeps/{record.id}", DESIGN: f"/v1/designs/{record.id}"}
        own = places.get(record.of, f"/v1/jobs/{record.job_id}/results")
        stored = ((one.name, one.label or one.value) for one in record.figures() if one.name in known)
        return cls._from(
            record, job=record.job_id, scene=record.scene_name,
            figures={name: known[name].of(value) for name, value in stored},
            links={"self": own, "job": f"/v1/jobs/{record.job_id}"},
        )  # fmt: skip


class ResultPage(Page[StoredResult]):
    """A page of results of one kind."""

    quantities: dict[str, QuantityAnswer] = Field(description="What the figures are, by name.")


class FinishedJob(JobAnswer):
    """A finished job with what it computed, as answered to those who waited for it."""

    result: dict[str, Any] | None
    sweeps: list[SweepAnswer]


class SceneAnswer(AnswerModel):
    """A scene in a list."""

    owner: str = Field(description="Whose it is; a shipped scene is everybody's.")
    name: str
    shipped: bool
    title: str | None = Field(description="What a shipped scene is, in a line.")
    scene_hash: str
    created: datetime | None
    links: dict[str, str]

    @classmethod
    def of(cls, row: StoredScene, **more: Any) -> Self:
        """The answer for a scene."""
        title = (
            shipped_text(row.name).removeprefix("# ").partition(":")[0].partition("\n")[0]
            if row.shipped
            else None
        )
        return cls._from(row, title=title, links={"self": f"/v1/scenes/{row.name}"}, **more)


class SceneDetail(SceneAnswer):
    """A scene with its tables."""

    scene: dict[str, Any]


class SceneList(Page[SceneAnswer]):
    """A page of the scenes."""


def _listed(array: NDArray[Any]) -> list[Any]:
    """Nested lists; null where a number is not finite."""
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        finite = np.isfinite(array)
        array = array.astype(object)
        array[~finite] = None
    listed: list[Any] = array.tolist()
    return listed


END, PARTIAL, PROGRESS = "end", "partial", "progress"


class JobProgress(AnswerModel):
    """Data of the event `progress`."""

    status: JobState
    attempt: int
    progress: float = Field(description="Fraction of the path, 0 to 1.")
    points: int = Field(description="Points computed so far.")
    best: dict[str, Any] | None = Field(default=None, description=BEST)


class JobPoints(AnswerModel):
    """Data of the event `partial`."""

    attempt: int
    start: int = Field(description="Number of the first of these points; what was there from it on is void.")
    points: list[tuple[float, float]] = Field(description="Value of what is swept, amplitude [m].")


EventData = JobProgress | JobPoints | JobAnswer
_MODELS: dict[str, type[JobProgress] | type[JobPoints] | type[JobAnswer]] = {
    PROGRESS: JobProgress,
    PARTIAL: JobPoints,
    END: JobAnswer,
}


@dataclass(frozen=True, slots=True)
class Told:
    """An event as it came through a stream; `data` is None for a comment or an unknown event."""

    data: EventData | None
    id: str | None


def told(lines: Iterable[str]) -> Iterator[Told]:
    """Read a stream of events line by line, as the HTML standard says.

    Comments are passed on as signs of life.
    """
    fields: dict[str, str] = {}
    for line in lines:
        if line.startswith(":"):
            yield Told(None, None)
        elif line:
            name, _, value = line.partition(":")
            value = value.removeprefix(" ")
            fields[name] = f"{fields[name]}\n{value}" if name == "data" and name in fields else value
        elif fields:
            yield _read(fields)
            fields = {}


def _read(fields: dict[str, str]) -> Told:
    model = _MODELS.get(fields.get("event", ""))
    if model is None or "data" not in fields:
        return Told(None, fields.get("id"))
    data: Any = json.loads(fields["data"])
    return Told(model.model_validate(data), fields.get("id"))


Limit = Annotated[int, Field(ge=1, le=10_000)]
Cursor = Annotated[str | None, Field(max_length=500)]


class AskedModel(BaseModel):
    """Root of what is asked: no other keys, no number that is not finite."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True)


class ListQuery(AskedModel):
    """What to list; the fields stand in the queries themselves, in the order of the reference."""

    path: ClassVar[str]
    """Of the list."""

    if TYPE_CHECKING:  # fields of every query, each where its list has them
        limit: int
        cursor: str | None


class Numbered(Protocol):
    """A row with an id; ids sort by time."""

    @property
    def id(self) -> Any:
        """Its id, a str."""


RowT = TypeVar("RowT")
NumberedT = TypeVar("NumberedT", bound=Numbered)


def page_of(
    query: ListQuery,
    settings: Settings,
    read: Callable[[int, Position | None], Sequence[RowT]],
    position: Callable[[RowT], Position],
) -> tuple[Sequence[RowT], str | None]:
    """The rows of a page and the link to the next one, None on the last.

    InvalidRequestError if the cursor is not one of this service.

    Parameters
    ----------
    read : finds so many rows at most, those behind a position if there is one.
    position : where a page that ends with a row goes on.
    """
    limit = min(query.limit, settings.page_limit)
    rows = read(limit + 1, None if query.cursor is None else pagination.decode(query.cursor))
    if len(rows) <= limit:
        return rows, None
    return rows[:limit], pagination.next_link(query.path, query, *position(rows[limit - 1]))


def newest(
    query: ListQuery, settings: Settings, read: Callable[[int, str | None], Sequence[NumberedT]]
) -> tuple[Sequence[NumberedT], str | None]:
    """As `page_of`, newest first: `read` finds rows older than the one of an id, if there is one."""
    return page_of(
        query, settings, lambda most, after: read(most, after and after[1]), lambda row: (None, row.id)
    )


class SpanAnswer(AnswerModel):
    """What a slider of a parameter covers."""

    low: float
    high: float
    of: str | None = Field(
        description="The parameter of whose absolute value both ends are multiples; null: they are values."
    )
    logarithmic: bool


class LawParameter(AnswerModel):
    """A parameter of a contact law: `CONTACT.name` is its path in a scene."""

    name: str
    symbol: str
    unit: str = Field(description="Empty of a pure number.")
    words: str
    otherwise: list[str] | None = Field(
        description="The parameters whose product it is where a scene leaves it out; null: it is not there."
    )
    slider: SpanAnswer | None


class LawAnswer(AnswerModel):
    """A contact law."""

    name: str
    default: bool = Field(description="Whether a contact that names no law has this one.")
    parameters: list[LawParameter]


class LawList(AnswerModel):
    """All contact laws."""

    items: list[LawAnswer]


def law_list() -> LawList:
    """Return every law of this process, with what the schema of scenes says of its parameters."""
    defined = scene_schema()["$defs"]
    items = []
    for word, law in laws().items():
        keys = defined[law.__name__]["properties"]
        parameters = [
            LawParameter(
                name=key, symbol=quantity.symbol or key, unit=quantity.unit,
                words=keys[key].get("description", ""),
                otherwise=None if quantity.otherwise is None else list(quantity.otherwise),
                slider=None if (span := quantity.span(key)) is None else SpanAnswer(**asdict(span)),
            )
            for key, quantity in law.PARAMETERS.items()
        ]  # fmt: skip
        items.append(LawAnswer(name=word, default=word == DEFAULT, parameters=parameters))
    return LawList(items=items)
