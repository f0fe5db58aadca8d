"""The answer of a study of accuracy: what `solver.studies.convergence` returns."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Annotated, ClassVar

from solver.arrays import FloatOrNaN
from solver.results.base import Drawn
from solver.results.told import Piece
from solver.results.views import Views

if TYPE_CHECKING:
    from solver.continuation.branch import Branch


class AccuracyStatus(Enum):
    """How a study ended; the value is a sentence a user can act on."""

    COMPLETED = "Every way that converges was measured."
    STOPPED = "The study was stopped by the caller: it has no rows, none was timed to the end."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class AccuracyRow(Piece):
    """One way to compute one point."""

    harmonics: Annotated[int, "Highest harmonic kept."]
    evaluator: Annotated[str, "Of the contact forces: ``closed form`` or ``sampled``."]
    samples: Annotated[int, "In a period; 0 in closed form."]
    max_abs: Annotated[float, "The amplitude [m]."]
    error: Annotated[float, "|max_abs − reference| [m]."]
    milliseconds: Annotated[float, "Median processor time of Newton's method from a neighbour [ms]."]
    iterations: Annotated[int, "Newton iterations of it."]
    residual: Annotated[float, "Relative residual left."]
    pareto: Annotated[bool, "No other row is both at least as accurate and at least as fast."] = False


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class AccuracyStudy(Drawn):
    """Rows of `accuracy_study` with what they are measured against."""

    VIEWS: ClassVar = Views("solver.views", "of_accuracy", "accuracy_dataset", "accuracy:accuracy_figure")
    JSON: ClassVar = (
        "scene frequency_hz reference reference_harmonics reference_error rows completed=reached status"
    )

    scene: Annotated[str, "Name of the scene."]
    frequency_hz: Annotated[float, "Excitation frequency [Hz]."]
    reference: Annotated[FloatOrNaN, "max|x| with `reference_harmonics` harmonics in closed form [m]."]
    reference_harmonics: Annotated[int, "Highest harmonic of the reference."]
    reference_error: Annotated[FloatOrNaN, "Its estimated error [m]; errors below it are not known."]
    rows: Annotated[
        tuple[AccuracyRow, ...], "Closed form first, then by samples, without ways that did not converge."
    ]
    branch: Annotated[Branch | None, "The sweep that found the highest peak; None if given the frequency."]
    status: Annotated[AccuracyStatus, "How it ended."]

    @property
    def reached(self) -> bool:
        """Whether no way was left out."""
        return self.status is AccuracyStatus.COMPLETED
