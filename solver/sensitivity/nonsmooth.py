"""The derivative of a peak by parameters, also where its top is a corner.

At a smooth maximum over the frequency the slope by ω is 0, so the derivative by a parameter is the partial
one (envelope theorem). Where a contact changes its state at the very top, two smooth pieces meet there at
ω_k(p), a⁻ rising and a⁺ falling: a⁻(ω_k(p), p) = a⁺(ω_k(p), p) gives

    dω_k/dp = −(a⁺_p − a⁻_p)/(a⁺_ω − a⁻_ω),   dA/dp = a⁻_p + a⁻_ω dω_k/dp.

A partial derivative of either side alone may be far off. Both sides are taken at solutions beside the corner,
at two distances, and extrapolated to it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Annotated

import numpy as np

from solver.balance.balance import Balance
from solver.balance.workspace import Workspace
from solver.continuation.branch import Peak
from solver.jit.fourier import Real
from solver.results.told import Piece
from solver.sensitivity.gradient import Sensitivities

SMOOTH = 1e-6  # slope da/dω · ω/a below which a peak is a smooth maximum
BESIDE = 1e-6  # distance of the nearer solutions from a corner, relative to its frequency
FAR = 1e-2  # relative change of the motion beyond which a solution beside lies on another branch


class PeakKind(Enum):
    """What a peak is over the frequency; the value is a sentence about its derivative."""

    SMOOTH = "A smooth maximum: the derivative is that at a fixed frequency."
    END = "An end of the band: the derivative is that at this frequency."
    CORNER = "A contact changes its state at the top: the derivative is that of the corner."
    UNRESOLVED = (
        "The solution is not at a maximum, or nothing was found beside it: the derivative is that at a fixed "
        "frequency."
    )


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class PeakGradient(Piece):
    """The derivatives of a peak."""

    value: Annotated[float, "max|x| at the peak [m]."]
    gradient: Annotated[Real, "d peak / dp [m per unit]; NaN where the balance is singular, (n_paths,)."]
    drift: Annotated[
        Real, "d frequency / dp [Hz per unit] of an end or a corner; NaN of the others, (n_paths,)."
    ]
    kind: Annotated[PeakKind, "What the derivative is."]


def peak_gradient(sensitivities: Sensitivities, peak: Peak) -> PeakGradient:
    """Return the derivatives of a peak of the response that `sensitivities` belongs to.

    Parameters
    ----------
    sensitivities : of the balance and the paths.
    peak : one of the branch, as `solver.sweep` returns them.
    """
    here = sensitivities.gradient(peak.solution, peak.at)
    kind, gradient, drift = (
        PeakKind.UNRESOLVED,
        here.by_parameters,
        np.full(len(sensitivities.paths), math.nan),
    )
    if not peak.interior:
        kind, drift = PeakKind.END, np.zeros(len(sensitivities.paths))
    elif abs(here.by_frequency) * peak.at <= SMOOTH * here.value:
        kind = PeakKind.SMOOTH
    elif math.isfinite(here.by_frequency):

        def slopes(u: Real, at_hz: float) -> tuple[float, Real]:
            found = sensitivities.gradient(u, at_hz)
            return found.by_frequency, found.by_parameters

        corner = corner_slopes(sensitivities.balance, peak.at, peak.solution, slopes)
        if corner is not None:
            kind, (gradient, drift) = PeakKind.CORNER, corner
    return PeakGradient(value=here.value, gradient=gradient, drift=drift, kind=kind)


def corner_slopes(
    balance: Balance, at_hz: float, solution: Real, slopes: Callable[[Real, float], tuple[float, Real]],
    sign: float = 1.0,
) -> Real | None:  # fmt: skip
    """Return the derivatives of height and frequency of a corner, (2, n_paths), extrapolated to it.

    None where nothing is found beside it, or no corner.

    Parameters
    ----------
    slopes : by the frequency and by the parameters, at a solution and its frequency [Hz].
    sign : 1 where the height rises before the corner and falls behind it, −1 where it does the reverse.
    """
    found = []
    for distance in (BESIDE, 2.0 * BESIDE):
        sides = []
        for way in (-1.0, 1.0):
            there = at_hz * (1.0 + way * distance)
            solved = Workspace.of(balance).solve_from(2.0 * math.pi * there, solution)
            change = np.abs(solved.u - solution).max(initial=0.0)
            if not solved.converged or change > FAR * np.abs(solution).max(initial=0.0):
                return None
            sides.append(slopes(solved.u, there))
        (rise, left), (fall, right) = sides
        if not sign * rise > 0.0 > sign * fall:
            return None
        drift = -(right - left) / (fall - rise)
        found.append(np.array([left + rise * drift, drift]))
    return np.asarray(2.0 * found[0] - found[1])
