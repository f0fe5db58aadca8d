"""The posterior density of the unknowns of a fit, with its exact gradient.

Noise is normal, in proportion to what the fit says of each observation. Where its level is not known it has
the prior 1/level and is integrated out: of ν observations (less what a run fits besides) with S the sum of
squared residuals in proportion, ∫ ∏ N(r_i; 0, σ s_i) dσ/σ = ½ Γ(ν/2) (S/2)^(−ν/2) ∏ (√(2π) s_i)⁻¹, so that
a linear model has the Student intervals of its least squares. Unknowns are uniform in their scaled z within
bounds, times their priors. The coordinates x are those in which that is standard normal, z = Φ(x): a
direction the data do not tell is normal there, and bounds are nowhere near.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy.special import gammaln, ndtr, ndtri

from optim.identification.fit import LocalFit, Runs
from optim.identification.fit import Unknowns
from optim.problem.variables import Real

_LOG_2_PI = math.log(2.0 * math.pi)
_EDGE = 1e-6  # scaled distance from a bound at which a search begins
_MOST_ROUNDS, _SETTLED = 40, 1e-2  # of Newton's method to the mode, in standard deviations
_PLACES = 4001  # of the integral of a prior over the bounds


@dataclass(frozen=True, slots=True, kw_only=True)
class At:
    """The density at a place."""

    log: Annotated[float, "Logarithm of it; −∞ where a point that counts was not reached."]
    slope: Annotated[Real, "Its gradient, (n,)."]
    curvature: Annotated[Real, "Of Gauss and Newton, positive definite, (n, n)."]


class Target:
    """The logarithm of the density, ln p(data | x) + ln N(x; 0, 1), all constants kept.

    Parameters
    ----------
    runs : data and models.
    best : the fit, which gives proportions of the noise and the points that count.
    level : relative noise if it was given.

    Attributes
    ----------
    lost : places asked for at which a point that counts was not reached.
    """

    def __init__(self, runs: Runs, best: LocalFit, level: float | None) -> None:
        self._runs, self._plain, self._active, self.lost = runs, runs.without_slopes(), best.active, 0
        _, known = runs.noise(best.fitted.values, level)
        kept = best.active
        self._known = known[kept]
        self._sd = np.where(known, best.sd, best.sd / best.level)[kept]
        self._observed = runs.observations[kept]
        besides = sum(
            run.FITTED_BESIDES
            for run, part in zip(runs.runs, runs.slices, strict=True)
            if not known[part].all()
        )
        free = int((~self._known).sum())
        self._nu = max(free - besides, 1) if free else 0
        constant = -float(np.sum(np.log(self._sd))) - 0.5 * self._sd.size * _LOG_2_PI
        if free:
            constant += float(gammaln(0.5 * self._nu)) + 0.5 * self._nu * math.log(2.0) - math.log(2.0)
        self._constant = constant - log_prior_mass(runs.unknowns)
        self._begin = best.fitted.z

    @property
    def dimensions(self) -> int:
        """Number of unknowns."""
        return len(self._runs.unknowns)

    def scaled(self, x: Real) -> Real:
        """Return z of x."""
        return np.asarray(ndtr(x))

    @property
    def evaluations(self) -> int:
        """Evaluations of all runs."""
        return self._runs.evaluations + self._plain.evaluations

    def log(self, x: Real) -> float:
        """Return the logarithm of the density at (n,)."""
        return self._at(x, self._plain).log

    def at(self, x: Real) -> At:
        """Return the density at (n,)."""
        return self._at(x, self._runs)

    def _at(self, x: Real, runs: Runs) -> At:
        z, n = self.scaled(x), x.size
        found = runs.at(z)
        nothing = At(log=-math.inf, slope=np.zeros(n), curvature=np.eye(n))
        if not found.reached[self._active].all():
            self.lost += 1
            return nothing
        rest = (found.values[self._active] - self._observed) / self._sd
        rows = found.jacobian[self._active] / self._sd[:, None]
        free = float(np.sum(rest[~self._known] ** 2))
        weights = np.where(self._known, 1.0, self._nu / max(free, 1e-300))
        prior, prior_rows = self._runs.unknowns.prior_rows(z)
        log = self._constant - 0.5 * float(np.sum(rest[self._known] ** 2) + prior @ prior + x @ x)
        log -= 0.5 * n * _LOG_2_PI + (0.5 * self._nu * math.log(max(free, 1e-300)) if self._nu else 0.0)
        by_x = np.exp(-0.5 * x * x) / math.sqrt(2.0 * math.pi)
        slope = -((weights * rest) @ rows + prior @ prior_rows) * by_x - x
        J, P = rows * by_x, prior_rows * by_x
        return At(log=log, slope=slope, curvature=J.T @ (weights[:, None] * J) + P.T @ P + np.eye(n))

    def mode(self) -> tuple[Real, Real] | None:
        """Return the mode next to the fit and the covariance of its curvature; None if there is none."""
        x = np.asarray(ndtri(np.clip(self._begin, _EDGE, 1.0 - _EDGE)))
        here = self.at(x)
        for _ in range(_MOST_ROUNDS):
            step = np.linalg.solve(here.curvature, here.slope)
            if not math.isfinite(here.log) or float(step @ here.slope) < _SETTLED**2:
                break
            share = 1.0
            while share > 1e-4 and not (there := self.at(x + share * step)).log > here.log:
                share *= 0.5
            if not there.log > here.log:
                break
            x, here = x + share * step, there
        return (x, np.asarray(np.linalg.inv(here.curvature), np.float64)) if math.isfinite(here.log) else None


def log_prior_mass(unknowns: Unknowns) -> float:
    """Return ln ∫ exp(−½ ((v(z) − mean)/sd)²) dz over the bounds, of all priors."""
    total, n = 0.0, len(unknowns)
    for i, variable in enumerate(unknowns.variables):
        prior = unknowns.priors.get(variable.name)
        if prior is None:
            continue
        ends = np.clip(
            [prior.mean - 12.0 * prior.sd, prior.mean + 12.0 * prior.sd], variable.low, variable.high
        )
        low, high = (variable.inside(float(end)) for end in ends)
        z = np.full((_PLACES, n), 0.5)
        z[:, i] = np.linspace(low, high, _PLACES)
        values = np.array([unknowns.values(one)[i] for one in z])
        density = np.exp(-0.5 * ((values - prior.mean) / prior.sd) ** 2)
        total += math.log(max(float(np.trapezoid(density, z[:, i])), 1e-300))
    return total
