"""What is known of unknowns after measurements: samples with a diagnosis, intervals, evidence."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from typing import Annotated, ClassVar

import numpy as np

from solver.arrays import FloatOrNaN, Real
from solver.results.base import Drawn
from solver.results.told import Piece
from solver.results.base import Data, Views

LEVEL = 0.9
_SCENARIOS = 32


class PosteriorStatus(Enum):
    """How it ended; the value is a sentence a user can act on."""

    SAMPLED = "The samples follow the posterior, as far as their diagnosis tells."
    MODEL_DOUBTFUL = (
        "The samples follow the posterior of a model that does not describe the data: see the warning. No "
        "intervals are given."
    )
    UNRELIABLE = (
        "The diagnosis of the samples failed, so none are given: take more draws, narrower bounds or priors, "
        "or more data."
    )
    LOST = (
        "At the optimum, or at places next to it, a point measured was not reached, so the posterior is not "
        "known: try more harmonics, or leave these points out of the data."
    )
    NO_FIT = "There is no fit to begin with: see `identify`."
    STOPPED = "It was stopped."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Marginal(Piece):
    """One number with what is known of it."""

    name: Annotated[str, "What it is of."]
    unit: Annotated[str, "Of the value."]
    mean: Annotated[FloatOrNaN, "Posterior mean."]
    sd: Annotated[FloatOrNaN, "Posterior standard deviation."]
    interval: Annotated[tuple[FloatOrNaN, FloatOrNaN], "Holds it with a probability of 90 %."]

    @classmethod
    def of(cls, name: str, unit: str, draws: Real, level: float = LEVEL) -> Marginal:
        """Return that of draws, (m,); NaN of none."""
        if not draws.size:
            return cls(name=name, unit=unit, mean=math.nan, sd=math.nan, interval=(math.nan, math.nan))
        # By (m + 1) p: as much as wanted lies between them on average, however few draws there are.
        low, high = np.quantile(draws, [0.5 - 0.5 * level, 0.5 + 0.5 * level], method="weibull").tolist()
        return cls(
            name=name, unit=unit, mean=float(draws.mean()), sd=float(draws.std()), interval=(low, high)
        )

    @property
    def low(self) -> float:
        """Lower end of the interval."""
        return self.interval[0]

    @property
    def high(self) -> float:
        """Upper end of it."""
        return self.interval[1]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Posterior(Drawn):
    """The posterior of unknowns."""

    VIEWS: ClassVar = Views("stickslip.lab.posterior", "tables:told", "pictures:drawn")
    DATA: ClassVar = Data(
        "posterior", {"parameter=marginals": "parameter=name mean sd low high", "draw parameter": "samples"},
        "sampler", rows=("draw",),
    )  # fmt: skip
    JSON: ClassVar = (
        "scene reached status marginals log_evidence log_evidence_error sampler pareto_k r_hat effective"
        " misfit noise names samples evaluations seconds"
    )

    scene: Annotated[str, "Its name."]
    status: Annotated[PosteriorStatus, "How it ended."]
    names: Annotated[tuple[str, ...], "The unknowns."]
    marginals: Annotated[tuple[Marginal, ...], "Of each."]
    samples: Annotated[Real, "Draws of equal weight, in the units of the unknowns, (draws, n)."]
    log_evidence: Annotated[FloatOrNaN, "ln p(data | model), of noise in proportion as the fit has it."]
    log_evidence_error: Annotated[FloatOrNaN, "Its standard error."]
    sampler: Annotated[str, "``importance`` or ``nuts``."]
    pareto_k: Annotated[FloatOrNaN, "Of the weights; above 0.7 they are not trusted."]
    r_hat: Annotated[FloatOrNaN, "Largest of the chains; NaN of importance sampling."]
    effective: Annotated[FloatOrNaN, "Independent draws that the samples are worth."]
    misfit: Annotated[str, "Why the model does not describe the data; empty if it does."]
    noise: Annotated[FloatOrNaN, "Relative noise of the fit."]
    scaled: Annotated[Real, "The draws scaled to the bounds, (draws, n)."]
    evaluations: Annotated[int, "Evaluations of all runs."]
    seconds: Annotated[float, "Time taken [s]."]

    @property
    def uncertain(self) -> list[dict[str, float]]:
        """Scenarios for a robust design: at most 32 of the draws; none unless they can be used."""
        kept = self.samples[:_SCENARIOS] if self.reached else self.samples[:0]
        return [dict(zip(self.names, row, strict=True)) for row in kept.tolist()]

    def interval(self, name: str, level: float = LEVEL) -> tuple[float, float]:
        """Return the ends that hold an unknown with a probability, as much below as above."""
        draws = self.samples[:, self.names.index(name)] if self.reached else np.zeros(0)
        return Marginal.of(name, "", draws, level).interval
