"""What a design by a performance curve is worth: the curve beside the exact response at its optimum."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from solver.results.told import Piece


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class CurveCheck(Piece):
    """The peak of the performance curve at its optimum, beside exact ones."""

    JSON: ClassVar = (
        "mode shared curves synthesised corrected exact estimate error tolerance suffices holds curve_seconds"
        " correction_seconds response_seconds seconds_saved"
    )

    mode: Annotated[int, "Number of the mode that the curve is of."]
    shared: Annotated[bool, "One curve served all designs, because forces, loads and motions grow together."]
    curves: Annotated[int, "Curves followed."]
    synthesised: Annotated[float, "Peak of the curve at its optimum [m]."]
    corrected: Annotated[
        float,
        "What the whole balance next to the synthesised motion makes of it [m]; NaN if that was not found.",
    ]
    exact: Annotated[float, "Highest peak of the whole response [m]; NaN if it could not be computed."]
    tolerance: Annotated[float, "Relative error up to which the curve suffices."]
    curve_seconds: Annotated[float, "What the search on curves took [s]."]
    correction_seconds: Annotated[float, "What the correction took [s]."]
    response_seconds: Annotated[float, "What the whole response took [s]."]
    exact_responses: Annotated[float, "The work of an exact search, in whole responses, at least."]

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

    def to_json(self) -> dict[str, Any]:
        """Return it as a JSON object."""
        return self._json(holds=math.isfinite(self.error) and self.holds)
