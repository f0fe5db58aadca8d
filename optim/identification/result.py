"""What identification gives: estimates with how sure they are, the fit over the data, what comes next."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, ClassVar

from optim.identification.information import Untold
from optim.identification.next_measurement import Candidate
from optim.problem.variables import Real
from solver.results.base import Drawn
from solver.results.told import json_number
from solver.results.views import Views


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


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """An unknown.

    Attributes
    ----------
    name : str
        Parameter path, or several that share the value.
    unit : str
    value : float
    standard_error : float
        NaN where the data do not tell it.
    interval : (float, float)
        Of 95 %; the bounds where the data do not tell it.
    told : bool
        Whether data and priors tell more of it than its bounds; of a model that is doubtful they do not.
    at_bound : bool
        Whether it lies on one of them.
    low, high : float
        Its bounds.
    """

    name: str
    unit: str
    value: float
    standard_error: float
    interval: tuple[float, float]
    told: bool
    at_bound: bool
    low: float
    high: float


@dataclass(frozen=True, slots=True, kw_only=True)
class NotReached:
    """Points of a run at which no response was found: (x of each as the run has it)."""

    run: str
    at: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Identification(Drawn):
    """Parameters identified from measurements.

    Attributes
    ----------
    scene : str
        Its name.
    status : IdentifyStatus
    estimates : tuple of Estimate
    covariance, correlation : (n, n) arrays
        Of the estimates, in their units; along what the data do not tell that of the bounds.
    noise : float
        Relative level of the noise found, or given; NaN where every row has its own.
    reduced_chi2 : float
        Mean square of the residuals over the noise; about 1 where the model describes the data and the noise
        was given, 1 by construction where it was not.
    misfit : str
        Why the model does not describe the data, see `optim.identification.model_check`: residuals that hang
        together or that something held fixed would explain, above the noise given, or larger than
        measurements scatter; else empty. No unknown is then told.
    untold : tuple of Untold
    correlated : tuple of (name, name, correlation)
    candidates : tuple of Candidate
        Further measurements, the most telling first.
    runs : tuple of mappings
        Data, fit and standard deviation of the fit of each run as curves.
    not_reached : tuple of NotReached
    uncertain : mapping
        For the key `uncertain` of a robust design; empty if there is no fit.
    values : mapping
        Parameter path to value, for `Scene.with_values`.
    other_optima : tuple of mappings
        Values at further local optima of the first look, with `misfit` relative to the best.
    starts, agreeing, evaluations : int
        Places tried, searches that ended at the same place, evaluations of all runs.
    """

    scene: str
    status: IdentifyStatus
    estimates: tuple[Estimate, ...]
    covariance: Real
    correlation: Real
    noise: float
    reduced_chi2: float
    misfit: str
    untold: tuple[Untold, ...]
    correlated: tuple[tuple[str, str, float], ...]
    candidates: tuple[Candidate, ...]
    runs: tuple[Mapping[str, Any], ...]
    not_reached: tuple[NotReached, ...]
    uncertain: Mapping[str, Any]
    values: Mapping[str, float]
    other_optima: tuple[Mapping[str, float], ...]
    starts: int
    agreeing: int
    evaluations: int
    harmonics: int
    seconds: float

    VIEWS: ClassVar = Views(
        "optim.views", "of_identification", "identification_dataset", "identification:identification_figure"
    )

    @property
    def reached(self) -> bool:
        """Whether there is a fit of all points that tells every unknown."""
        return self.status is IdentifyStatus.KNOWN

    @property
    def fitted(self) -> bool:
        """Whether there is a fit at all."""
        return bool(self.estimates)

    def to_json(self) -> dict[str, Any]:
        """Return everything as one JSON object."""
        return {
            "scene": self.scene, "reached": self.reached, "status": self.status.value,
            "estimates": [_estimate(one) for one in self.estimates],
            "values": dict(self.values),
            "covariance": self.covariance.tolist(), "correlation": self.correlation.tolist(),
            "noise": json_number(self.noise), "reduced_chi2": json_number(self.reduced_chi2),
            "misfit": self.misfit,
            "untold": [
                {"names": list(one.names), "direction": list(one.direction), "words": one.words}
                for one in self.untold
            ],
            "correlated": [{"names": [a, b], "correlation": share} for a, b, share in self.correlated],
            "candidates": [
                {
                    "conditions": dict(one.conditions), "like": one.like, "gain": json_number(one.gain),
                    "tells": one.tells, "factor": json_number(one.factor),
                }
                for one in self.candidates
            ],
            "runs": [dict(run) for run in self.runs],
            "not_reached": [{"run": one.run, "at": list(one.at)} for one in self.not_reached],
            "uncertain": dict(self.uncertain),
            "other_optima": [dict(one) for one in self.other_optima],
            "starts": self.starts, "agreeing": self.agreeing, "evaluations": self.evaluations,
            "n_harmonics": self.harmonics, "seconds": self.seconds,
        }  # fmt: skip


def _estimate(one: Estimate) -> dict[str, Any]:
    return {
        "name": one.name, "unit": one.unit, "value": one.value,
        "standard_error": json_number(one.standard_error),
        "interval": list(one.interval), "told": one.told, "at_bound": one.at_bound,
        "bounds": [one.low, one.high],
    }  # fmt: skip
