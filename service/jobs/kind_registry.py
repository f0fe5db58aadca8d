"""What a kind of job is: a request model, a resolution of it, a function that computes, and its view.

A new kind is one module in `service.jobs.kinds` and one entry in its registry, or a module elsewhere that the
setting `kinds` names; queue, database, HTTP, command and documentation know kinds only through this contract.
A kind whose work can be divided says so by a `service.jobs.job_parts.Division`.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, Protocol

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from service.errors import InvalidRequestError
from service.jobs.strict_json import validated
from solver.errors import Shown
from solver.results.told import Block, Summary

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from service.jobs.checkpoints import Checkpoints
    from service.jobs.job_parts import Division
    from service.jobs.outputs import JobOutput, Progress, Run, ShouldStop


Json = Mapping[str, Any]


class PeakPlace(Protocol):
    """The highest peak of a stored sweep."""

    @property
    def at(self) -> float:
        """Value of the parameter."""

    @property
    def value(self) -> float:
        """Amplitude [m]."""


class StoredSweep(Protocol):
    """What is drawn of a stored sweep, without its arrays."""

    @property
    def id(self) -> str:
        """By which it is read."""

    @property
    def points(self) -> int:
        """How many points it has."""

    @property
    def peak(self) -> PeakPlace | None:
        """The highest peak, if there is one."""


class StoredCurve(StoredSweep, Protocol):
    """What is drawn of a stored sweep with its arrays."""

    @property
    def scene(self) -> str:
        """Name of the scene."""

    @property
    def parameter(self) -> str:
        """Path of the parameter."""

    @property
    def limit(self) -> float | None:
        """Amplitude that bounds the resonance band [m]."""

    @property
    def arrays(self) -> Mapping[str, Sequence[Any]]:
        """Name to values."""


ReadSweep = Callable[[str], StoredCurve]
"""Gives a stored sweep with its arrays."""
Draw = Callable[[Json, Sequence[StoredSweep], ReadSweep], "Figure"]
"""From a result, the sweeps stored with it and the way to their arrays, to a picture."""


class NothingToDrawError(Exception):
    """A result without anything a picture could show; the message says why."""


PrintedResult = Summary
"""What is printed of a result: a title, and names with their values."""
Tell = Callable[[Json], Summary | Iterable[Block]]
"""From a result to what is printed of it: names with values, and tables."""


@dataclass(frozen=True, slots=True, kw_only=True)
class KindView:
    """What people see of a kind; all of it has a plain default.

    Attributes
    ----------
    result : what a job computes, for the documentation; Markdown.
    sweeps : which sweeps it stores; empty for none.
    keys : in place of the list of its keys, where they are described elsewhere.
    flags : options of ``stickslip submit KIND`` that are not called as the key: key to ``--option``.
    tell : what is printed of a result; its numbers and words, by their keys, if left out.
    draw : the picture of a result, NothingToDrawError if it has none; the stored sweep with the peak of the
        result if left out.
    """

    result: str = ""
    sweeps: str = ""
    keys: str = ""
    flags: Mapping[str, str] = field(default_factory=dict)
    tell: Tell | None = None
    draw: Draw | None = None


LONGEST_NAME, LONGEST_NOTES, LONGEST_TAG, MOST_TAGS = 200, 10_000, 50, 20
_LINES = frozenset("\n\r\t")
# Of Unicode: control, lone halves, ends of lines and paragraphs, and those that nobody sees, which hide or
# turn round what stands beside them and make two names look the same.
_UNSEEN = ("Cc", "Cs", "Cf", "Zl", "Zp")


def _refuse(text: str, allowed: frozenset[str]) -> None:
    for character in text:
        if unicodedata.category(character) in _UNSEEN and character not in allowed:
            words = "besides tabs and ends of lines" if allowed else "and be one line"
            raise ValueError(f"must hold no control characters {words}, it has U+{ord(character):04X}")


def _one_line(text: str) -> str:
    _refuse(text, frozenset())
    return text.strip()


def _lines(text: str) -> str:
    _refuse(text, _LINES)
    return text


def _some(text: str) -> str:
    if not text:
        raise ValueError("must hold more than spaces")
    return text


RunName = Annotated[str, Field(max_length=LONGEST_NAME), AfterValidator(_one_line)]
ProjectName = Annotated[
    str, Field(min_length=1, max_length=LONGEST_NAME), AfterValidator(_one_line), AfterValidator(_some)
]
Notes = Annotated[str, Field(max_length=LONGEST_NOTES), AfterValidator(_lines)]
Tag = Annotated[
    str, Field(min_length=1, max_length=LONGEST_TAG), AfterValidator(_one_line), AfterValidator(_some)
]
Tags = Annotated[
    tuple[Tag, ...], Field(max_length=MOST_TAGS), AfterValidator(lambda tags: tuple(sorted(set(tags))))
]


class JobRequest(BaseModel):
    """What every kind of job takes; the models of the kinds derive from it."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True, validate_by_name=True)

    fresh: bool = Field(
        default=False, strict=True, description="Compute again even if a stored result exists."
    )
    priority: int = Field(
        default=0, strict=True, ge=-100, le=100, description="Of one's own jobs, higher ones run first."
    )
    max_seconds: float | None = Field(
        default=None, strict=True, ge=0.01, le=1e7,
        description="Longest time an attempt may take [s]; at most, and if left out, that of the service.",
    )  # fmt: skip
    # What is said of the run is no part of what is computed: a dump of the model leaves it out.
    project: str | None = Field(
        default=None, max_length=36, exclude=True, description="Id of the project the run belongs to."
    )
    name: RunName = Field(default="", exclude=True, description="Name of the run, to be found again by.")
    notes: Notes = Field(default="", exclude=True, description="Notes on the run.")
    tags: Tags = Field(default=(), exclude=True, description="Words the run is marked with.")


class Flag(NamedTuple):
    """How the option of a key is written, what stands for its value, where key and type do not say it, and
    words that a shell offers."""

    name: str = ""
    metavar: str = ""
    words: tuple[str, ...] = ()


KIND = "kind"
ABOUT_THE_RUN = ("project", "name", "notes", "tags")
ABOUT_THE_JOB = ("fresh", "priority", "max_seconds", *ABOUT_THE_RUN)


class SceneSource(Protocol):
    """Where the scenes that requests name come from."""

    def scene_body(self, name: str) -> Mapping[str, object] | None:
        """Tables and lists of a shipped or stored scene, or None."""

    def with_uploads(self, body: Mapping[str, object]) -> Mapping[str, object]:
        """A scene with what its uploads hold in place of their ids."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Resolved:
    """A request with everything looked up: what a worker computes, from this alone.

    Attributes
    ----------
    spec : JSON; equal specs of one kind give equal results.
    scene_name, scene_hash : of the scene as computed, for lists and filters.
    """

    spec: dict[str, Any]
    scene_name: str | None = None
    scene_hash: str | None = None


RunOn = Callable[[Mapping[str, Any], "Progress", "ShouldStop", "Checkpoints"], "JobOutput"]
WarmUp = Callable[[], None]
Resolve = Callable[[Any, SceneSource], Resolved]

_NAME = re.compile(r"[a-z][a-z0-9-]{0,31}")


@dataclass(frozen=True, slots=True, kw_only=True)
class JobKind:
    """A kind of job.

    `request`, `resolve` and `run` are sent to processes by name: they stand at the top level of a module.

    Attributes
    ----------
    name : as in ``"kind": …`` of a request: small letters, digits and hyphens, at most 32.
    summary : one line for people.
    request : validates what was asked; its docstring and the `examples` of its schema are those of the API.
    resolve : from request to spec; raises InvalidRequestError for what does not fit or is too large. What
        comes by HTTP is resolved in a process with limits (`service.jobs.answering`), to which the service
        sends the scenes and uploads that are asked for.
    run : from spec to output; raises SolverError for what is wrong for good. Runs in a worker.
    parts : how the work is divided, if it can be; `run` is then ``parts.run``, which computes them one after
        the other.
    run_on : `run` with a fourth argument, `service.jobs.checkpoints.Checkpoints`: keeps what it has, and goes
        on from what an earlier attempt kept. Divided kinds need none: their parts are kept.
    result : the schema of the result, or what makes it when it is asked for; None for any JSON object.
    view : what people see of it.

    Raises
    ------
    ValueError
        If the name cannot be one.
    """

    name: str
    summary: str
    request: type[JobRequest]
    resolve: Resolve
    run: Run
    parts: Division | None = None
    run_on: RunOn | None = None
    result: type[BaseModel] | Callable[[], type[BaseModel]] | None = None
    view: KindView = field(default_factory=KindView)

    @property
    def answers(self) -> type[BaseModel] | None:
        """The schema of the result; None for any JSON object."""
        return self.result if self.result is None or isinstance(self.result, type) else self.result()

    def __post_init__(self) -> None:
        if not _NAME.fullmatch(self.name):
            raise ValueError(
                f"`name` must be small letters, digits and hyphens, 1 to 32 from a letter on, "
                f"got {self.name!r}"
            )


def request_in(body: Mapping[str, Any], model: type[JobRequest]) -> JobRequest:
    """What a body asks of a kind (InvalidRequestError lists what is wrong)."""
    return validated(model, {key: value for key, value in body.items() if key != KIND})


def asked_of(body: JobRequest, model: type[JobRequest]) -> JobRequest:
    """What a body that was checked with its kind asks of that kind: `request_in` without checking again."""
    values = {name: getattr(body, name) for name in model.model_fields}
    return model.model_construct(body.model_fields_set & values.keys(), **values)


def no_warm_up() -> None:
    """For kinds that need none."""


class Registry:
    """The kinds of job a service knows, and what its workers do before they take the first one.

    Parameters
    ----------
    kinds : the kinds.
    warm_up : loads and compiles what the kinds need; sent to workers by name, as their `run` is.
    """

    def __init__(self, kinds: Iterable[JobKind], warm_up: WarmUp = no_warm_up) -> None:
        self._kinds = {kind.name: kind for kind in kinds}
        self.warm_up = warm_up

    def __getitem__(self, name: str) -> JobKind:
        return self._kinds[name]

    def __iter__(self) -> Iterator[JobKind]:
        return iter(self._kinds.values())

    def __len__(self) -> int:
        return len(self._kinds)

    def __contains__(self, name: object) -> bool:
        return name in self._kinds

    def named_in(self, body: Mapping[str, Any]) -> JobKind:
        """The kind that a body names (InvalidRequestError if it names none of these)."""
        if KIND not in body:
            raise InvalidRequestError.of((KIND,), "is missing")
        name = body[KIND]
        if not isinstance(name, str) or name not in self._kinds:
            known = ", ".join(self._kinds)
            raise InvalidRequestError.of((KIND,), f"must be one of {known}", Shown(f"{name!r:.80}"))
        return self._kinds[name]

    def tell_of(self, name: str) -> Tell | None:
        """What puts results of a kind in words, if there is such a kind and it says it."""
        return self._kinds[name].view.tell if name in self._kinds else None

    def extended(self, *kinds: JobKind) -> Registry:
        """This registry with further kinds."""
        return Registry([*self, *kinds], self.warm_up)

    def runs(self) -> dict[str, RunOn]:
        """The functions workers call, by kind; sent by name."""
        return {kind.name: _run_on(kind) for kind in self}


def _run_on(kind: JobKind) -> RunOn:
    # Imported here: what keeps the work of a kind knows jobs.
    from service.jobs.checkpoints import FromTheStart, RunParts

    if kind.run_on is not None:
        return kind.run_on
    return FromTheStart(kind.run) if kind.parts is None else RunParts(kind.parts)
