"""What the computation of a job is given and gives: progress, pieces, sweeps, designs, failures."""

from __future__ import annotations

import enum
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol, Self

from service.jobs.strict_json import JsonText
from solver.errors import Issue

Best = Mapping[str, Any]
"""The best design so far, as JSON (`optim.results.best_so_far`)."""
Point = tuple[float, float]
"""Value of what is swept and amplitude [m]."""
OnProgress = Callable[[float, int], None]
ShouldStop = Callable[[], bool]


class Told(NamedTuple):
    """How far an attempt is: share of its path, points computed, the best design so far."""

    fraction: float
    points: int
    best: Best | None = None


class Progress(Protocol):
    """What a run says on its way; its methods cost next to nothing and may be called at any rate."""

    def __call__(self, fraction: float, points: int) -> None:
        """So far it got: share of its path, points computed."""

    def found(self, points: Sequence[Point]) -> None:
        """The next points of the branch it follows; they go with the next report."""

    def best(self, found: Best) -> None:
        """The best design so far; it goes with the next report."""


class Silent:
    """Progress that nobody watches."""

    def __call__(self, fraction: float, points: int) -> None:
        """Say nothing."""

    def found(self, points: Sequence[Point]) -> None:
        """Say nothing."""

    def best(self, found: Best) -> None:
        """Say nothing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactValues:
    """The values of a contact during a sweep; None where the value is swept or its law has none."""

    name: str
    kt: float | None
    mu: float | None
    N0: float | None
    N1: float | None
    N1_phase: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredArray:
    """An array as it is stored: npy bytes and their SHA-256 in hexadecimal."""

    sha256: str
    data: bytes


@dataclass(frozen=True, slots=True, kw_only=True)
class Piece:
    """A piece of what an unfinished job has computed, with the SHA-256 of its bytes in hexadecimal."""

    part: int
    sha256: str
    data: bytes


@dataclass(frozen=True, slots=True, kw_only=True)
class Pace:
    """How often a worker tells what, and how it logs.

    Attributes
    ----------
    progress_seconds : float
        Least time between two reports of an attempt [s].
    checkpoint_seconds : float
        Least time between two checkpoints of an attempt [s].
    checkpoint_bytes : int
        Most that a job keeps for later attempts.
    log_level, log_format : str
        As in `service.settings.logs.configure`.
    """

    progress_seconds: float
    checkpoint_seconds: float
    checkpoint_bytes: int
    log_level: str = "INFO"
    log_format: str = "text"


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepRecord:
    """A branch to be stored: the columns people filter by, and its parts.

    Attributes
    ----------
    intermediate : bool
        Whether it was computed on the way to another result, rather than being what was asked for.
    """

    scene_name: str
    scene_hash: str
    parameter: str
    from_value: float
    to_value: float
    frequency_hz: float | None
    excitation_amplitude: float | None
    harmonics: int
    points: int
    peak: float | None
    peak_at: float | None
    limit: float | None
    band_hz: float | None
    newton_iterations: int
    rejected_steps: int
    seconds: float
    completed: bool
    status: str
    error_estimate: float | None = None
    peaks_known: bool | None = None
    intermediate: bool = False
    contacts: tuple[ContactValues, ...] = ()
    arrays: Mapping[str, StoredArray] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class VariableValues:
    """A variable of a design: its best value (None if no design could be computed) and its bounds."""

    name: str
    value: float | None
    low: float
    high: float


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignRecord:
    """A design to be stored: the columns people filter by, and its parts."""

    scene_name: str
    scene_hash: str
    method: str
    robust: bool
    reached: bool
    feasible: bool
    status: str
    objective: float | None
    peak: float | None
    peak_at: float | None
    limit: float | None
    band_hz: float | None
    harmonics: int
    evaluations: int
    work: float | None
    seconds: float
    variables: tuple[VariableValues, ...] = ()


class Found(Protocol):
    """A result of a computation."""

    @property
    def status(self) -> enum.Enum:
        """How it ended; the value is a sentence that says what to try."""

    def to_json(self) -> dict[str, Any]:
        """The result as JSON."""


@dataclass(frozen=True, slots=True, kw_only=True)
class JobOutput:
    """What a run gives back.

    Attributes
    ----------
    result : dict
        JSON, with the keys of the command's ``--json``.
    sweeps : tuple of SweepRecord
        Every branch computed on the way.
    design : DesignRecord or None
        The design, if the job was to find one.
    shortfall : str or None
        If the computation did not reach its goal: the status, a sentence that says what to try. The job
        then fails with it; result and sweeps are kept.
    encoded : JsonText or None
        The result as it is stored, if the worker has encoded it already; `result` is then empty.
    """

    result: dict[str, Any]
    sweeps: tuple[SweepRecord, ...] = ()
    encoded: JsonText | None = None
    design: DesignRecord | None = None
    shortfall: str | None = None

    @classmethod
    def of(
        cls, found: Found, *, reached: bool, sweeps: tuple[SweepRecord, ...] = (),
        design: DesignRecord | None = None,
    ) -> Self:  # fmt: skip
        """Return the output of a computation that says of itself how it ended.

        Parameters
        ----------
        found : its result.
        reached : whether that is what was asked for.
        sweeps, design : to be stored.
        """
        shortfall = None if reached else str(found.status.value)
        return cls(result=found.to_json(), sweeps=sweeps, design=design, shortfall=shortfall)


class FailureKind(enum.StrEnum):
    """Why a job failed."""

    SCENE = "scene"
    SETTING = "setting"
    GOAL = "goal-not-reached"
    WORKER_LOST = "worker-lost"
    TIME_LIMIT = "time-limit"
    MEMORY_LIMIT = "memory-limit"
    INTERNAL = "internal"


@dataclass(frozen=True, slots=True, kw_only=True)
class JobFailure:
    """Why a job failed, as its row keeps it."""

    kind: FailureKind
    detail: str
    issues: tuple[Issue, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """The error of a job, as JSON."""
        body: dict[str, Any] = {"type": self.kind.value, "detail": self.detail}
        if self.issues:
            body["issues"] = [{"pointer": issue.pointer, "detail": issue.said()} for issue in self.issues]
        return body


Run = Callable[[Mapping[str, Any], Progress, ShouldStop], JobOutput]
