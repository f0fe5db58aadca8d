"""Least squares over all runs, with noise that the fit tells, and outliers that weigh less.

The noise of an observation is in proportion to what the model says, not to what was measured: small readings
would else weigh too much, and amplitudes come out too low. Proportion and level are therefore found anew
between rounds of Gauss-Newton (iteratively reweighted least squares). Outliers: Huber's loss with the level
of the noise from the median of the residuals (Huber, Robust Statistics, 1981, sections 7.7 and 7.8).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from optim.identification.fit.evaluation import Fitted, Runs
from optim.problem.variables import Real

HUBER = 1.345  # standard deviations from which a residual weighs less: 95 % efficient without outliers
FIRST_LEVEL = 0.03  # relative noise assumed before any fit has shown it
LEAST_LEVEL = 1e-9  # of relative noise: data without any, made by the model itself
_MOST_ROUNDS = 6
_SETTLED = 0.02  # standard errors by which a round may move an unknown once all has settled
_MOST_EVALUATIONS = 60
_NORMAL = 1.4826  # standard deviation over the median of |residual| of a normal distribution
_EDGE = 1e-9  # scaled distance from a bound at which a search begins


@dataclass(frozen=True, slots=True, kw_only=True)
class Noise:
    """What is known of the noise, and how residuals count.

    Attributes
    ----------
    level : float or None
        Relative standard deviation; None where the residuals shall tell.
    robust : bool
        Whether outliers weigh less.
    """

    level: float | None
    robust: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class LocalFit:
    """A local optimum.

    Attributes
    ----------
    fitted : Fitted
        The predictions there.
    sd : (N,) array
        Standard deviation of every observation.
    level : float
        By which noise of unknown level was found to be in proportion; 1 if all is known.
    active : (N,) array of bool
        The observations that counted: those reached.
    cost : float
        Half the sum of the losses, priors included.
    converged : bool
    """

    fitted: Fitted
    sd: Real
    level: float
    active: np.ndarray
    cost: float
    converged: bool

    def residuals(self, observations: Real) -> Real:
        """Return (predicted − measured)/sd of what counted."""
        rest: Real = (self.fitted.values - observations) / self.sd
        return np.asarray(rest[self.active], np.float64)


def fit(runs: Runs, z: Real, noise: Noise, *, rounds: int = _MOST_ROUNDS) -> LocalFit:
    """Find a local optimum from scaled unknowns."""
    sd, known = runs.noise(runs.observations, noise.level)
    level = 1.0 if known.all() else FIRST_LEVEL
    for turn in range(rounds):
        weights = np.where(known, sd, level * sd)
        found = _search(runs, z, weights, noise.robust)
        moved = np.inf if turn == 0 else _moved(found, found.fitted.z - z)
        z, before = found.fitted.z, level
        filled = np.where(found.active, found.fitted.values, runs.observations)
        sd, known = runs.noise(filled, noise.level)
        level = before if known.all() else _level(runs, found, sd, known, robust=noise.robust)
        if moved < _SETTLED and abs(level - before) < 1e-2 * before:
            break
        if level <= LEAST_LEVEL:
            break
    final = np.where(known, sd, level * sd)
    return LocalFit(
        fitted=found.fitted, sd=final, level=level, active=found.active, cost=found.cost,
        converged=found.converged,
    )  # fmt: skip


def _level(runs: Runs, found: LocalFit, sd: Real, known: np.ndarray, *, robust: bool) -> float:
    """Return the level of the noise that is not known, from what a fit left over."""
    counted = found.active & ~known
    rest = ((found.fitted.values - runs.observations) / sd)[counted]
    share = rest.size / max(rest.size - len(runs.unknowns), 1)
    if robust:
        return max(_NORMAL * float(np.median(np.abs(rest))) * math.sqrt(share), LEAST_LEVEL)
    return max(float(np.sqrt(np.mean(rest**2) * share)), LEAST_LEVEL)


def _moved(found: LocalFit, step: Real) -> float:
    """Return how far a round moved, in standard errors."""
    rows = found.fitted.jacobian[found.active] / found.sd[found.active, None]
    return float(np.linalg.norm(rows @ step) / np.sqrt(step.size))


def _search(runs: Runs, z: Real, sd: Real, robust: bool) -> LocalFit:
    """Run Gauss-Newton with a trust region under given weights; points not reached at its start are left out.

    A trial that loses a point is no number, so that the trust region shrinks: no point leaves on the way.
    """
    # Loaded here: the words of a description need no search.
    from scipy.optimize import least_squares

    start = np.clip(z, _EDGE, 1.0 - _EDGE)
    active = runs.at(start).reached.copy()
    n_data, target, weights = int(active.sum()), runs.observations[active], sd[active]

    def residuals(x: Real) -> Real:
        found = runs.at(x)
        data = (found.values[active] - target) / weights
        data = np.where(found.reached[active], data, np.nan)
        return np.concatenate([data, runs.unknowns.prior_rows(x)[0]])

    def jacobian(x: Real) -> Real:
        rows = runs.at(x).jacobian[active] / weights[:, None]
        return np.concatenate([rows, runs.unknowns.prior_rows(x)[1]])

    def loss(squares: Real) -> Real:
        return np.stack(_huber(squares, n_data if robust else 0))

    found = least_squares(
        residuals, start, jac=jacobian, bounds=(0.0, 1.0), method="trf", loss=loss if robust else "linear",
        ftol=1e-10, xtol=1e-10, gtol=1e-10, max_nfev=_MOST_EVALUATIONS,
    )  # fmt: skip
    return LocalFit(
        fitted=runs.at(np.asarray(found.x)), sd=sd, level=1.0, active=active, cost=float(found.cost),
        converged=bool(found.status > 0),
    )  # fmt: skip


def _huber(squares: Real, count: int) -> tuple[Real, Real, Real]:
    """Return Huber's loss of squared residuals with two derivatives, from place `count` on the plain one."""
    value, slope, bend = squares.copy(), np.ones_like(squares), np.zeros_like(squares)
    far = np.flatnonzero(squares[:count] > HUBER**2)
    size = np.sqrt(squares[far])
    value[far] = 2.0 * HUBER * size - HUBER**2
    slope[far], bend[far] = HUBER / size, -0.5 * HUBER / size**3
    return value, slope, bend
