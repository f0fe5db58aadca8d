"""Peaks of a sweep as near as its points are: those of max|x|, and those that it hides.

Where a normal load varies the motion is lopsided, and max|x| is the larger of two curves over the frequency.
A peak of the other one is no peak of max|x|, but a parameter may make it one: it is worth following, and a
sweep shows it for nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from solver.balance.kernels.output import HIGH, HIGH_SLOPE, LOW, LOW_SLOPE, MAX_ABS
from solver.continuation.branch import Branch
from solver.jit.fourier import Real

_CURVES = ((HIGH, HIGH_SLOPE, 1.0), (LOW, LOW_SLOPE, -1.0))
_HIDDEN = 1e-9  # relative distance below max|x| from which a curve is hidden


@dataclass(frozen=True, slots=True, kw_only=True)
class Rival:
    """A peak, as near as the points of the branch are."""

    value: Annotated[float, "The higher of the two points it lies between [m]."]
    omega: Annotated[float, "rad/s."]
    solution: Annotated[Real, "Slip motions there [m], (n_unknowns,)."]
    sign: Annotated[float, "1 for a peak of max x, −1 for one of −min x."]


def rivals(branch: Branch) -> list[Rival]:
    """Return the hidden peaks of a branch over the frequency, highest first."""
    return _crests(branch.solutions, branch.measures, hidden=True)


def crests(solutions: Real, measures: Real) -> list[Rival]:
    """Return the peaks of max|x| between points of a walk over the frequency, highest first.

    Parameters
    ----------
    solutions : (P, n_unknowns + 1) slip motions [m] and ω [rad/s].
    measures : (P, MEASURES) columns named in `solver.balance.kernels.output`.
    """
    return _crests(solutions, measures, hidden=False)


def _crests(solutions: Real, measures: Real, *, hidden: bool) -> list[Rival]:
    """Return the peaks of max x and of −min x that the larger of the two hides, or those it does not."""
    found = []
    for value, slope, sign in _CURVES:
        rising, falling = measures[:-1, slope], measures[1:, slope]
        wanted = (measures[:, value] < (1.0 - _HIDDEN) * measures[:, MAX_ABS]) == hidden
        for left in np.flatnonzero((rising > 0.0) & (falling <= 0.0) & wanted[:-1] & wanted[1:]):
            share = rising[left] / (rising[left] - falling[left])
            between = (1.0 - share) * solutions[left] + share * solutions[left + 1]
            height = float(measures[left : left + 2, value].max())
            found.append(
                Rival(value=height, omega=float(between[-1]), solution=between[:-1].copy(), sign=sign)
            )
    return sorted(found, key=lambda rival: -rival.value)
