"""What identification gives: estimates with how sure they are, the fit over the data, what comes next."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from solver.arrays import FloatOrNaN, Real
from solver.results.base import Drawn, Views
from solver.results.told import Piece

if TYPE_CHECKING:
    from optim.identification.information import Candidate, Untold


class IdentifyStatus(Enum):
    """How an identification ended; the value is a sentence a user can act on."""

    KNOWN = "The data tell every unknown."
    UNTOLD = (
        "The fit is the best found, but the data do not tell every unknown: see what they do not tell, "
        "and which "
        "measurement would."
    )
    MODEL_DOUBTFUL = (
        "The fit is the best found, but what it leaves over is not noise: see the warning. No intervals are "
        "given; mend the scene or the data, or look for another parameter as well."
    )
    LEFT_OUT = (
        "The fit is the best found, but at some points measured no response was found; they do not count: "
        "try more "
        "harmonics, or leave them out of the data."
    )
    NOT_CONVERGED = "The search did not come to its end: try more starts, narrower bounds or priors."
    NO_START = (
        "At no place within the bounds were most of the points reached: try other bounds, more harmonics "
        "or fewer "
        "points."
    )
    STOPPED = "It was stopped."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Estimate(Piece):
    """An unknown with how sure it is; bounds in place of an interval where the data do not tell it."""

    JSON: ClassVar = "name unit value standard_error interval told at_bound bounds"

    name: Annotated[str, "Parameter path, or several that share the value."]
    unit: Annotated[str, "Of the value."]
    value: Annotated[float, "The estimate."]
    standard_error: Annotated[FloatOrNaN, "Its standard error; NaN where the data do not tell it."]
    interval: Annotated[tuple[float, float], "Of 95 %; the bounds where the data do not tell it."]
    told: Annotated[
        bool,
        "Whether data and priors tell more of it than its bounds; of a model that is doubtful they do not.",
    ]
    at_bound: Annotated[bool, "Whether it lies on one of them."]
    low: Annotated[float, "Its lower bound."]
    high: Annotated[float, "Its upper bound."]

    @property
    def bounds(self) -> tuple[float, float]:
        """Both of them."""
        return self.low, self.high


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class NotReached(Piece):
    """Points of a run at which no response was found."""

    run: Annotated[str, "What it is called."]
    at: Annotated[tuple[float, ...], "x of each, as the run has it."]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Identification(Drawn):
    """Parameters identified from measurements."""

    VIEWS: ClassVar = Views(
        "optim.views", "studies:identification", "figures:identification_figure", "identification_dataset"
    )
    JSON: ClassVar = (
        "scene reached status estimates values covariance correlation noise reduced_chi2 misfit untold"
        " correlated candidates runs not_reached uncertain other_optima starts agreeing evaluations"
        " n_harmonics=harmonics seconds"
    )

    scene: Annotated[str, "Its name."]
    status: Annotated[IdentifyStatus, "How it ended."]
    estimates: Annotated[tuple[Estimate, ...], "The unknowns."]
    covariance: Annotated[
        Real, "Of the estimates, in their units; along what the data do not tell that of the bounds, (n, n)."
    ]
    correlation: Annotated[Real, "The same without units, (n, n)."]
    noise: Annotated[FloatOrNaN, "Relative noise found, or given; NaN where each row has its own."]
    reduced_chi2: Annotated[
        FloatOrNaN,
        "Mean square of the residuals over the noise; about 1 where the model describes the data and the "
        "noise was given, 1 by construction where it was not.",
    ]
    misfit: Annotated[
        str,
        "Why the model does not describe the data, see `optim.identification.model_check`: residuals that "
        "hang together or that something held fixed would explain, above the noise given, or larger than "
        "measurements scatter; else empty. No unknown is then told.",
    ]
    untold: Annotated[tuple[Untold, ...], "Directions that the data do not tell."]
    correlated: Annotated[tuple[tuple[str, str, float], ...], "Names hardly kept apart, with correlation."]
    candidates: Annotated[tuple[Candidate, ...], "Further measurements, the most telling first."]
    runs: Annotated[
        tuple[Mapping[str, Any], ...], "Data, fit and standard deviation of the fit of each run as curves."
    ]
    not_reached: Annotated[tuple[NotReached, ...], "Points at which no response was found."]
    uncertain: Annotated[
        Mapping[str, Any], "For the key `uncertain` of a robust design; empty if there is no fit."
    ]
    values: Annotated[Mapping[str, float], "Parameter path to value, for `Scene.with_values`."]
    other_optima: Annotated[
        tuple[Mapping[str, float], ...],
        "Values at further local optima of the first look, with `misfit` relative to the best.",
    ]
    starts: Annotated[int, "Places tried."]
    agreeing: Annotated[int, "Searches that ended at the same place."]
    evaluations: Annotated[int, "Evaluations of all runs."]
    harmonics: Annotated[int, "Highest harmonic kept."]
    seconds: Annotated[float, "Time taken [s]."]

    @property
    def fitted(self) -> bool:
        """Whether there is a fit at all."""
        return bool(self.estimates)

    def to_json(self) -> dict[str, Any]:
        """Return everything as one JSON object."""
        pairs = [{"names": [a, b], "correlation": share} for a, b, share in self.correlated]
        return self._json(correlated=pairs)
