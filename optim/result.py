"""What a design search returns."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

from optim.model import Conditions
from optim.problem import Method, Problem
from optim.rows import UNITS, Evaluation, Quantity, Row
from solver.branch import Branch
from solver.shown import Shown, Summary

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from solver.dataset import Dataset
    from solver.plots.style import Into


SAME_HEIGHT = 1e-5  # relative distance within which rows count as equally high
AT_LIMIT = 1e-4  # relative distance from a bound within which a limited row holds the design


class DesignStatus(Enum):
    """How a search ended; the value is a sentence a user can act on."""

    OPTIMAL = "What is minimised can not be lowered further."
    AT_BOUND = (
        "What is minimised can not be lowered further within the bounds, and a variable lies on a bound that "
        "holds the design: wider bounds would do better."
    )
    KINK = (
        "The search could not improve the design, but the first-order conditions do not hold there: the "
        "response has a kink at this design, or more harmonics are needed."
    )
    FLAT = (
        "The peak does not depend on these variables (no friction, or contacts that never slip): "
        "choose others."
    )
    INFEASIBLE = (
        "No design within the bounds keeps all limits; the one that breaks them least is given, with what "
        "each limit would have to be: relax one of those, or allow wider bounds."
    )
    NO_RESPONSE = (
        "The frequency response could not be computed over the whole band for any design tried: "
        "use more harmonics or a narrower band."
    )
    NOT_TRACKED = (
        "The peaks could not be followed over the whole range; the best design seen is given: use the method "
        "minimax, or a narrower range."
    )
    TOO_MANY = "The largest number of responses was used up before the search settled: allow more."
    STOPPED = "The search was stopped by the caller."


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignPeak:
    """A peak of the response of a design: max|x| of the observed DOF [m] and its frequency [Hz]."""

    value: float
    at: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Basin:
    """A local optimum.

    Attributes
    ----------
    values : mapping
        Variable name to value.
    peak : float
        Highest peak [m].
    objective : float
        What is minimised.
    settled, feasible : bool
        Whether the first-order conditions hold and the limits are kept there.
    proven : bool
        Whether a response there was computed, so that no peak is higher than `peak`. A further basin of the
        tracked peak is solved for along the peaks that were followed: it is at least that high.
    """

    values: Mapping[str, float]
    peak: float
    objective: float
    settled: bool
    feasible: bool
    proven: bool


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class DesignResult(Shown):
    """The best design found.

    Attributes
    ----------
    problem : Problem
        What was asked.
    method : Method
        How the optimum was found.
    status : DesignStatus
        How the search ended.
    evaluation : Evaluation or None
        Rows and responses of the optimum.
    conditions : Conditions or None
        First-order conditions there.
    basins : tuple of Basin
        Every local optimum found, best first.
    history : tuple of Evaluation
        Every design evaluated, in order; the optimum is among them (of a tracked peak the optimum alone).
    evaluations : int
        Frequency responses computed.
    work : float
        What the search cost in all, in frequency responses.
    seconds : float
        Time in all.
    """

    problem: Problem
    method: Method
    status: DesignStatus
    evaluation: Evaluation | None
    conditions: Conditions | None
    basins: tuple[Basin, ...]
    history: tuple[Evaluation, ...]
    evaluations: int
    work: float
    seconds: float

    @property
    def scene(self) -> str:
        """Name of the scene."""
        return self.problem.scene.name

    @property
    def optimum(self) -> Mapping[str, float]:
        """Variable name to value; empty when no design could be evaluated."""
        return {} if self.evaluation is None else dict(self.evaluation.values)

    @property
    def reached(self) -> bool:
        """Whether the goal was reached."""
        return self.status in (DesignStatus.OPTIMAL, DesignStatus.AT_BOUND)

    @property
    def peak(self) -> DesignPeak | None:
        """The highest peak of the optimum."""
        if self.evaluation is None or not self.evaluation.peaks:
            return None
        return DesignPeak(value=self.evaluation.peaks[0].value, at=self.evaluation.peaks[0].at_hz)

    @property
    def band_hz(self) -> float | None:
        """Width of the widest resonance band of the optimum [Hz]."""
        band = None if self.evaluation is None else self.evaluation.band
        return None if band is None else band.value

    @property
    def limit(self) -> float | None:
        """Amplitude at which the band is measured [m]."""
        if self.evaluation is None or self.evaluation.band is None:
            return None
        branches = [r.branch for r in self.evaluation.responses if r.case == self.evaluation.band.case]
        return None if branches[0].band is None else branches[0].band.limit

    @property
    def optimality(self) -> float:
        """Largest component of the gradient of the Lagrangian, relative objective per scaled variable."""
        return math.nan if self.conditions is None else self.conditions.residual

    @property
    def multipliers(self) -> tuple[float, ...]:
        """Of the active peaks; they sum to 1."""
        if self.conditions is None:
            return ()
        return tuple(x for row, x in self.conditions.rows if row.quantity is Quantity.PEAK and x > 1e-6)

    @property
    def active(self) -> tuple[str, ...]:
        """What holds the optimum in place, in words: equally high peaks, bounds, limits."""
        if self.evaluation is None or not self.evaluation.rows:
            return ()
        held = [row.what for row in _highest(self.evaluation)]
        for variable in self.problem.variables:
            value = self.evaluation.values[variable.name]
            for bound, name in ((variable.low, "lower"), (variable.high, "upper")):
                if abs(value - bound) <= 1e-9 * max(abs(bound), 1e-300):
                    held.append(f"{name} bound of {variable.name}")
        return (*held, *(limit_words(row) for row in self.evaluation.rows if at_limit(row)))

    @property
    def broken(self) -> tuple[Row, ...]:
        """The limited rows that the design does not keep, worst first."""
        if self.evaluation is None:
            return ()
        rows = [row for row in self.evaluation.rows if row.bound is not None and row.value > row.bound]
        return tuple(sorted(rows, key=lambda row: -row.excess(1.0)))

    @property
    def sweeps(self) -> tuple[Branch, ...]:
        """Every frequency response computed, those of the optimum last."""
        return tuple(branch for _, branch in self._responses())

    @property
    def sweep_values(self) -> tuple[Mapping[str, float], ...]:
        """The designs of `sweeps`, in the same order."""
        return tuple(values for values, _ in self._responses())

    def _responses(self) -> list[tuple[Mapping[str, float], Branch]]:
        others = [evaluation for evaluation in self.history if evaluation is not self.evaluation]
        last = [] if self.evaluation is None else [self.evaluation]
        return [(e.values, response.branch) for e in [*others, *last] for response in e.responses]

    def summary(self) -> Summary:
        """What is most worth knowing, in words and with units."""
        from optim.summaries import of_design

        return of_design(self)

    def to_dataset(self) -> Dataset:
        """A design that was tried a row, the optimum marked."""
        from optim.datasets import design_dataset

        return design_dataset(self)

    def plot(self, ax: Into = None) -> Figure:
        """Draw the response of the optimum; `ax`: axes to draw into, else a new figure."""
        from optim.plots.designs import design_figure

        return design_figure(self, ax=ax)

    def to_json(self) -> dict[str, object]:
        """Return the result as one JSON object."""
        peak, evaluation = self.peak, self.evaluation
        peaks = () if evaluation is None else evaluation.peaks
        return {
            "scene": self.scene,
            "method": self.method.value,
            "optimum": dict(self.optimum),
            "peak": None if peak is None else {"value": peak.value, "at": peak.at},
            "peaks": [{"value": p.value, "at": p.at_hz, "case": p.case} for p in peaks],
            "band_hz": self.band_hz,
            "limit": self.limit,
            "bands": [] if evaluation is None else _bands(evaluation),
            "objective": None if evaluation is None or not evaluation.rows else evaluation.objective,
            "rows": [] if evaluation is None else [_row(row) for row in evaluation.rows],
            "evaluations": self.evaluations,
            "newton_iterations": sum(branch.newton_iterations for branch in self.sweeps),
            "tried": [
                {"values": dict(e.values), "peak": e.peaks[0].value, "at": e.peaks[0].at_hz}
                for e in self.history
                if e.good and e.peaks
            ],
            "basins": [_basin(basin) for basin in self.basins],
            "seconds": self.seconds,
            "work": _number(self.work),
            "active": list(self.active),
            "optimality": _number(self.optimality),
            "multipliers": list(self.multipliers),
            "conditions": None if self.conditions is None else _conditions(self.conditions),
            "broken": [{**_row(row), "by": row.value - (row.bound or 0.0)} for row in self.broken],
            "reached": self.reached,
            "status": self.status.value,
        }


def at_limit(row: Row) -> bool:
    """Return whether a limited row holds a design in place."""
    if row.bound is None:
        return False
    return row.value >= row.bound - AT_LIMIT * (abs(row.bound) or 1.0)


def limit_words(row: Row) -> str:
    """Return the limit of a row in words."""
    words = {
        Quantity.PEAK: "peak limit",
        Quantity.BAND: "band limit",
        Quantity.FORBIDDEN: "limit in a forbidden range",
        Quantity.FRICTION_WORK: "friction work limit",
        Quantity.SEPARATION: "separation limit",
    }
    where = "" if row.quantity in (Quantity.BAND, Quantity.PEAK) else f" ({row.what})"
    return f"{words[row.quantity]} of {row.bound:g} {UNITS[row.quantity]}{where}"


def _highest(evaluation: Evaluation) -> list[Row]:
    """Return the rows that are equally high, of every quantity that is minimised."""
    found: list[Row] = []
    for quantity in Quantity:
        rows = [row for row in evaluation.of(quantity) if row.weight > 0.0]
        top = max((row.weight * row.value for row in rows), default=0.0)
        found += [row for row in rows if row.weight * row.value >= top * (1.0 - SAME_HEIGHT)]
    return found


def _bands(evaluation: Evaluation) -> list[dict[str, object]]:
    """Return where the resonance band of each case lies; the first response of a case is that of its band."""
    first: dict[str, Branch] = {}
    for response in evaluation.responses:
        first.setdefault(response.case, response.branch)
    return [
        {
            "case": case, "limit": branch.band.limit, "width_hz": branch.band.width,
            "intervals_hz": [list(interval) for interval in branch.band.intervals],
        }
        for case, branch in first.items()
        if branch.band is not None
    ]  # fmt: skip


def _row(row: Row) -> dict[str, object]:
    return {
        "quantity": row.quantity.value, "case": row.case, "what": row.what, "value": row.value,
        "unit": UNITS[row.quantity], "at": _number(row.at_hz), "bound": row.bound, "weight": row.weight,
    }  # fmt: skip


def _basin(basin: Basin) -> dict[str, object]:
    return {
        "values": dict(basin.values), "peak": basin.peak, "objective": basin.objective,
        "settled": basin.settled, "feasible": basin.feasible, "proven": basin.proven,
    }  # fmt: skip


def _conditions(found: Conditions) -> dict[str, object]:
    return {
        "residual": _number(found.residual),
        "violation": found.violation,
        "rows": [
            {"what": row.what, "case": row.case, "quantity": row.quantity.value, "multiplier": x}
            for row, x in found.rows
        ],
        "bounds": [{"variable": name, "side": side, "multiplier": x} for name, side, x in found.bounds],
    }


def _number(value: float) -> float | None:
    """Return a float that JSON can carry (null for NaN)."""
    return value if math.isfinite(value) else None
