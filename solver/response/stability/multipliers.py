"""Floquet multipliers of a periodic response, and what they say of it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Annotated, Any, ClassVar

import numpy as np

from solver.arrays import Complex
from solver.results.base import Drawn, Views
from solver.results.known import Stable, Verdict

GROWS = 1e-9  # a multiplier's modulus beyond 1 that is more than rounding
REAL = 1e-7  # imaginary part, relative to the modulus, that counts as none
NEUTRAL = 1e-7  # of the largest modulus beside 1: nothing is said to grow or to die out so slowly
_DIES_OUT = "the largest Floquet multiplier is {:.4g}: perturbations die out"
_BESIDE_ONE = "the largest Floquet multiplier is 1 to within {:.0e}: nothing is said to grow or to die out"
_GROWS = "{} (largest Floquet multiplier {:.4g}): the motion does not stay as it is"


class Growth(Enum):
    """How a perturbation grows, if one does; the value is what a user reads."""

    NONE = "no perturbation grows"
    FOLD = "a real multiplier is above 1: beyond a fold, or where another branch leaves this one"
    PERIOD_DOUBLING = "a real multiplier is below -1: the motion goes over to twice the period"
    TORUS = "a pair of complex multipliers is beyond 1: a second frequency grows (Neimark-Sacker)"


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Stability(Drawn):
    """Whether small perturbations of a periodic response die out."""

    VIEWS: ClassVar = Views("solver.views", "of_stability", "of_stability", "stability_dataset")
    JSON: ClassVar = "stable growth radius neutral multipliers frequency_hz seconds"

    multipliers: Annotated[
        Complex,
        "Floquet multipliers, largest modulus first, without the neutral ones. Contacts that slip leave "
        "zeros: friction forgets.",
    ]
    neutral: Annotated[
        int,
        "Multipliers that are 1 by construction and left out: one for the slider of each contact that "
        "sticks all the time (its residual force is history), one for each displacement that nothing "
        "resists.",
    ]
    growth: Annotated[Growth, "The kind of the largest multiplier, if it is beyond the unit circle."]
    frequency_hz: Annotated[float, "Of the response [Hz]."]
    seconds: Annotated[float, "What it took."]

    @property
    def radius(self) -> float:
        """Largest modulus of the multipliers that are not neutral."""
        return float(np.abs(self.multipliers).max(initial=0.0))

    @property
    def stable(self) -> bool:
        """Whether no perturbation grows."""
        return self.growth is Growth.NONE

    def to_json(self) -> dict[str, Any]:
        """Return the answer as one JSON object; multipliers as [real, imaginary]."""
        return self._json(multipliers=np.stack([self.multipliers.real, self.multipliers.imag], axis=1))


def growth_of(multipliers: Complex) -> Growth:
    """Return how a perturbation grows, from the multipliers with the largest modulus first."""
    if multipliers.size == 0 or abs(multipliers[0]) <= 1.0 + GROWS:
        return Growth.NONE
    largest = complex(multipliers[0])
    if abs(largest.imag) > REAL * abs(largest):
        return Growth.TORUS
    return Growth.FOLD if largest.real > 0.0 else Growth.PERIOD_DOUBLING


def verdict_of(found: Stability) -> Verdict:
    """Return what the multipliers of a response say."""
    radius = found.radius
    if abs(radius - 1.0) <= NEUTRAL and len(found.multipliers):
        return Verdict(stable=Stable.NOT_KNOWN, ground=_BESIDE_ONE.format(NEUTRAL))
    if radius > 1.0 + GROWS:
        return Verdict(stable=Stable.NO, ground=_GROWS.format(found.growth.value, radius))
    return Verdict(stable=Stable.YES, ground=_DIES_OUT.format(radius))
