"""What an accuracy study finds."""

from __future__ import annotations
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Annotated, ClassVar
from solver.arrays import FloatOrNaN
from solver.results.base import Drawn
from solver.results.told import Piece
from solver.results.base import Data, Views

if TYPE_CHECKING:
    from solver.continuation.branch import Branch


class AccuracyStatus(Enum):
    """How a study ended; the value is a sentence a user can act on."""

    COMPLETED = "Every way that converges was measured."
    STOPPED = "The study was stopped by the caller: it has no rows, none was timed to the end."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class AccuracyRow(Piece):
    """One way to compute one point."""

    harmonics: Annotated[int, "Highest harmonic kept; 0 of the exact solution."]
    evaluator: Annotated[str, "Of the contact forces: ``closed form``, ``sampled`` or ``exact``."]
    samples: Annotated[int, "In a period; 0 if there are none."]
    max_abs: Annotated[float, "The amplitude [m]."]
    error: Annotated[float, "|max_abs − reference|; of the exact solution its estimated error [m]."]
    milliseconds: Annotated[
        float, "Median processor time of Newton's method from a neighbour; exact: from the balance [ms]."
    ]
    iterations: Annotated[int, "Newton iterations of it."]
    residual: Annotated[float, "Relative residual left."]
    pareto: Annotated[bool, "No other row is both at least as accurate and at least as fast."] = False


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class AccuracyStudy(Drawn):
    """Rows of `accuracy_study` with what they are measured against."""

    VIEWS: ClassVar = Views("stickslip.lab.accuracy", "tables:accuracy", "pictures:accuracy_figure")
    DATA: ClassVar = Data(
        "accuracy", {"way=rows": "harmonics evaluator samples max_abs error milliseconds iterations"
         " residual pareto"}, "frequency_hz reference reference_harmonics reference_error",
    )  # fmt: skip
    JSON: ClassVar = (
        "scene frequency_hz reference reference_harmonics reference_error rows completed=reached status"
    )

    scene: Annotated[str, "Name of the scene."]
    frequency_hz: Annotated[float, "Excitation frequency [Hz]."]
    reference: Annotated[FloatOrNaN, "max|x|, exact or with `reference_harmonics` harmonics [m]."]
    reference_harmonics: Annotated[int, "Highest harmonic of the reference; 0: it is exact."]
    reference_error: Annotated[FloatOrNaN, "Its estimated error [m]; errors below it are not known."]
    rows: Annotated[
        tuple[AccuracyRow, ...], "Closed form, then by samples, last exact, without ways that gave nothing."
    ]
    branch: Annotated[Branch | None, "The sweep that found the highest peak; None if given the frequency."]
    status: Annotated[AccuracyStatus, "How it ended."]
