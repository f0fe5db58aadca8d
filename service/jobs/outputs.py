"""What the computation of a job is given and gives: progress, pieces, sweeps, designs, failures."""

from __future__ import annotations

import enum
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, NamedTuple, Protocol

from service.jobs.stored_figures import (
    RECORDS,
    STATUS,
    DesignRecord,
    FigureValue,
    KindRecord,
    StoredRecord,
    SweepRecord,
    figures,
)
from service.jobs.strict_json import JsonText
from solver.errors import Issue

Best = Mapping[str, Any]
"""The best design so far, as JSON (`optim.results.design_result`)."""
Point = tuple[float, float]
"""Value of what is swept and amplitude [m]."""
OnProgress = Callable[[float, int], None]
ShouldStop = Callable[[], bool]


class Report(NamedTuple):
    """How far an attempt is: share of the path, points computed, what is new of its branch, best design."""

    fraction: float
    points: int
    found: tuple[Point, ...] = ()
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

    def __call__(self, *_: object, **__: object) -> None:
        """Say nothing."""

    found = best = __call__


@dataclass(frozen=True, slots=True, kw_only=True)
class ResultPiece:
    """A piece of what an unfinished job has computed, with the SHA-256 of its bytes in hexadecimal."""

    part: int
    sha256: str
    data: bytes


@dataclass(frozen=True, slots=True, kw_only=True)
class Pace:
    """How often a worker tells what, and how it logs.

    Attributes
    ----------
    progress_seconds : least time between two reports of an attempt [s].
    checkpoint_seconds : least time between two checkpoints of an attempt [s].
    checkpoint_bytes : most that a job keeps for later attempts.
    log_level, log_format : as in `service.settings.logs.configure`.
    traces : as in `service.settings.traces.configure`.
    """

    progress_seconds: float
    checkpoint_seconds: float
    checkpoint_bytes: int
    log_level: str = "INFO"
    log_format: str = "text"
    traces: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class JobOutput:
    """What a run gives back."""

    result: Annotated[dict[str, Any], "JSON, with the keys of the command's ``--json``."]
    sweeps: Annotated[tuple[SweepRecord, ...], "Every branch computed on the way."] = ()
    encoded: Annotated[
        JsonText | None,
        "The result as it is stored, if the worker has encoded it already; `result` is then empty.",
    ] = None
    figures: Annotated[tuple[FigureValue, ...], "The figures of a result that is encoded."] = ()
    alone: Annotated[Mapping[str, Any], "What of such a result is compared with another's."] = field(
        default_factory=dict
    )
    design: Annotated[DesignRecord | None, "The design, if the job was to find one."] = None
    shortfall: Annotated[
        str | None,
        "If the computation did not reach its goal: the status, a sentence that says what to try. The job "
        "then fails with it; result and sweeps are kept.",
    ] = None

    def records(self, kind: str, scene_name: str | None, scene_hash: str | None) -> list[StoredRecord]:
        """Return what is stored of it beside its sweeps: the design, or the figures of the result.

        What a kind of sweeps or designs computes is told by those.
        """
        if self.design is not None or kind in RECORDS:
            return [] if self.design is None else [self.design]
        told = self.figures or tuple(figures(self.result))
        status = next((one.label for one in told if one.name == STATUS), self.shortfall or "")
        values = tuple(one for one in told if one.name != STATUS)
        return [
            KindRecord(of=kind, scene_name=scene_name, scene_hash=scene_hash, status=status, values=values)
        ]


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
