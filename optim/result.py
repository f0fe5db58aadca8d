"""What a design search returns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

from optim.criteria import Criteria
from solver.branch import Branch


class DesignStatus(Enum):
    """How a search ended; the value is a sentence a user can act on."""

    OPTIMAL = "The highest peak can not be lowered further within the bounds."
    KINK = (
        "The search could not improve the design, but the first-order conditions do not hold there: the "
        "response has a kink at this design, or more harmonics are needed."
    )
    FLAT = (
        "The peak does not depend on these variables (no friction, or contacts that never slip): "
        "choose others."
    )
    BAND_INFEASIBLE = (
        "No design within the bounds keeps the band below its limit; the one with the narrowest band is "
        "given: allow a wider band, a higher amplitude limit, or wider bounds."
    )
    NO_RESPONSE = (
        "The frequency response could not be computed over the whole band for any design tried: "
        "use more harmonics or a narrower band."
    )
    TOO_MANY = "The largest number of responses was used up before the search settled: allow more."
    STOPPED = "The search was stopped by the caller."


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignPeak:
    """A peak of the response of a design: max|x| of the observed DOF [m] and its frequency [Hz]."""

    value: float
    at: float


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignResult:
    """The best design found.

    Attributes
    ----------
    status : DesignStatus
        How the search ended.
    optimum : mapping
        Parameter path to value; empty when no design could be evaluated.
    criteria : Criteria or None
        Peaks and band of the optimum with their gradients.
    active : tuple of str
        What holds the optimum in place: peaks at the same height, bounds, the band limit.
    optimality : float
        Norm of the projected gradient of the Lagrangian, relative peak per scaled variable.
    multipliers : tuple of float
        Of the active peaks; they sum to 1.
    history : tuple of Criteria
        Every design evaluated, in order; the optimum is among them.
    """

    scene: str
    status: DesignStatus
    optimum: Mapping[str, float]
    criteria: Criteria | None
    active: tuple[str, ...]
    optimality: float
    multipliers: tuple[float, ...]
    history: tuple[Criteria, ...]
    seconds: float

    @property
    def reached(self) -> bool:
        """Whether the goal was reached."""
        return self.status is DesignStatus.OPTIMAL

    @property
    def peak(self) -> DesignPeak | None:
        """The highest peak of the optimum."""
        if self.criteria is None or not self.criteria.peaks:
            return None
        return DesignPeak(value=self.criteria.peaks[0].value, at=self.criteria.peaks[0].at)

    @property
    def band_hz(self) -> float | None:
        """Width of the resonance band of the optimum [Hz]."""
        return None if self.criteria is None or self.criteria.band is None else self.criteria.band.width

    @property
    def limit(self) -> float | None:
        """Amplitude at which the band is measured [m]."""
        return None if self.criteria is None or self.criteria.band is None else self.criteria.band.limit

    @property
    def evaluations(self) -> int:
        """Frequency responses computed."""
        return len(self.history)

    @property
    def sweeps(self) -> tuple[Branch, ...]:
        """Every frequency response computed, the one of the optimum last."""
        others = [criteria for criteria in self.history if criteria is not self.criteria]
        return tuple(criteria.branch for criteria in (*others, *([self.criteria] if self.criteria else [])))

    @property
    def sweep_values(self) -> tuple[Mapping[str, float], ...]:
        """The designs of `sweeps`, in the same order."""
        others = [criteria for criteria in self.history if criteria is not self.criteria]
        return tuple(criteria.values for criteria in (*others, *([self.criteria] if self.criteria else [])))

    def to_json(self) -> dict[str, object]:
        """Return the result as one JSON object."""
        peak, criteria = self.peak, self.criteria
        return {
            "scene": self.scene,
            "optimum": dict(self.optimum),
            "peak": None if peak is None else {"value": peak.value, "at": peak.at},
            "peaks": [] if criteria is None else [{"value": p.value, "at": p.at} for p in criteria.peaks],
            "band_hz": self.band_hz,
            "limit": self.limit,
            "evaluations": self.evaluations,
            "newton_iterations": sum(criteria.branch.newton_iterations for criteria in self.history),
            "tried": [
                {"values": dict(c.values), "peak": c.peaks[0].value, "at": c.peaks[0].at}
                for c in self.history
                if c.good
            ],
            "seconds": self.seconds,
            "active": list(self.active),
            "optimality": self.optimality,
            "multipliers": list(self.multipliers),
            "reached": self.reached,
            "status": self.status.value,
        }
