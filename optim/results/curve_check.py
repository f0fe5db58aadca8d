"""What a design by a performance curve is worth: the curve beside the exact response at its optimum."""

from __future__ import annotations

import math
from dataclasses import dataclass

from solver.results.told import json_number


@dataclass(frozen=True, slots=True, kw_only=True)
class CurveCheck:
    """The peak of the performance curve at its optimum, beside exact ones.

    Attributes
    ----------
    mode : int
        Number of the mode that the curve is of.
    shared : bool
        One curve served all designs, because forces, loads and motions grow together.
    curves : int
        Curves followed.
    synthesised : float
        Peak of the curve at its optimum [m].
    corrected : float
        What the whole balance next to the synthesised motion makes of it [m]; NaN if that was not found.
    exact : float
        Highest peak of the whole response [m]; NaN if it could not be computed.
    tolerance : float
        Relative error up to which the curve suffices.
    curve_seconds, correction_seconds, response_seconds : float
        What the search on curves, the correction, and the whole response took [s].
    exact_responses : float
        The work of an exact search, in whole responses, at least.
    """

    mode: int
    shared: bool
    curves: int
    synthesised: float
    corrected: float
    exact: float
    tolerance: float
    curve_seconds: float
    correction_seconds: float
    response_seconds: float
    exact_responses: float

    @property
    def estimate(self) -> float:
        """Relative error of the curve's peak by the correction, without a whole response; NaN if unknown."""
        return self.synthesised / self.corrected - 1.0

    @property
    def error(self) -> float:
        """Relative error of the curve's peak."""
        return self.synthesised / self.exact - 1.0

    @property
    def suffices(self) -> bool:
        """Whether the estimate alone says that the curve suffices."""
        return abs(self.estimate) <= self.tolerance

    @property
    def holds(self) -> bool:
        """Whether the curve is as good as asked for, by the whole response."""
        return abs(self.error) <= self.tolerance

    @property
    def seconds_saved(self) -> float:
        """Time [s] saved against an exact search of the least work; below 0 if that had been quicker."""
        spent = self.curve_seconds + self.correction_seconds + self.response_seconds
        return self.exact_responses * self.response_seconds - spent

    def to_json(self) -> dict[str, object]:
        """Return it as a JSON object."""
        return {
            "mode": self.mode, "shared": self.shared, "curves": self.curves,
            "synthesised": json_number(self.synthesised), "corrected": json_number(self.corrected),
            "exact": json_number(self.exact), "estimate": json_number(self.estimate),
            "error": json_number(self.error),
            "tolerance": self.tolerance, "suffices": self.suffices,
            "holds": math.isfinite(self.error) and self.holds,
            "curve_seconds": self.curve_seconds, "correction_seconds": self.correction_seconds,
            "response_seconds": self.response_seconds, "seconds_saved": json_number(self.seconds_saved),
        }  # fmt: skip
