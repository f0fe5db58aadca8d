"""What the data tell: information matrix, covariance, standard errors, and directions they do not tell.

All is in unknowns scaled to their bounds, 0 to 1. What a uniform distribution over the bounds is uncertain
by, 1/√12, is the measure: a direction along which the data leave more than that open, they do not tell.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from optim.identification.fit.evaluation import Runs
from optim.identification.fit.least_squares import HUBER, LocalFit
from optim.problem.variables import Real

UNIFORM = 1.0 / math.sqrt(12.0)
_TINY = 1e-12  # of the largest eigenvalue, below which information is rounding


@dataclass(frozen=True, slots=True, kw_only=True)
class Information:
    """What data and priors tell of the scaled unknowns.

    Attributes
    ----------
    data : (n, n) array
        Information matrix of the data, Jᵀ J in standard deviations of the noise.
    prior : (n, n) array
        That of the priors.
    degrees : int
        Degrees of freedom of the noise level; 0 where it was given.
    reduced_chi2 : float
        Mean square of the residuals in standard deviations, over the degrees of freedom.
    """

    data: Real
    prior: Real
    degrees: int
    reduced_chi2: float

    @property
    def total(self) -> Real:
        """Of data and priors together."""
        return self.data + self.prior

    def covariance(self) -> Real:
        """Return the covariance, (n, n); along what nothing tells, that of the bounds."""
        spread, vectors = self._principal()
        return np.asarray(vectors * np.minimum(spread, UNIFORM) ** 2 @ vectors.T)

    def standard_errors(self) -> Real:
        """Return the standard deviation of each unknown, (n,), large without end where nothing tells it."""
        spread, vectors = self._principal()
        return np.asarray(np.sqrt((vectors * spread) ** 2 @ np.ones(spread.size)))

    def _principal(self) -> tuple[Real, Real]:
        """Return standard deviations along the principal directions, worst first, and these as columns."""
        values, vectors = np.linalg.eigh(self.total)
        floor = max(_TINY * float(values[-1]), 1e-300)
        return np.asarray(1.0 / np.sqrt(np.maximum(values, floor))), np.asarray(vectors, np.float64)

    def weak(self) -> tuple[tuple[float, Real], ...]:
        """Return the directions the data do not tell, (standard deviation, unit vector), worst first."""
        spread, vectors = self._principal()
        return tuple((float(spread[i]), vectors[:, i]) for i in range(spread.size) if spread[i] > UNIFORM)

    def quantile(self) -> float:
        """Return the factor of a standard error in a 95 % interval."""
        if not self.degrees:
            return 1.959963984540054
        from scipy.stats import t

        return float(t.ppf(0.975, self.degrees))


def information(runs: Runs, found: LocalFit, *, robust: bool, level_known: bool) -> Information:
    """Return what the data tell at an optimum."""
    rest = found.residuals(runs.observations)
    rows = found.fitted.jacobian[found.active] / found.sd[found.active, None]
    n, p = rest.size, len(runs.unknowns)
    free = max(n - p, 1)
    efficiency = 1.0
    if robust:
        # Huber (1981), eq. 7.6.13: cov = K² [Σψ²/(n − p)]/[mean ψ']² (JᵀJ)⁻¹, K = 1 + p/n (1 − m)/m.
        inside = float(np.mean(np.abs(rest) <= HUBER))
        psi = np.clip(rest, -HUBER, HUBER)
        correction = 1.0 + p / n * (1.0 - inside) / inside if inside > 0.0 else math.inf
        efficiency = inside**2 * free / (correction**2 * max(float(np.sum(psi**2)), 1e-300))
    _, prior_rows = runs.unknowns.prior_rows(found.fitted.z)
    return Information(
        data=efficiency * rows.T @ rows, prior=prior_rows.T @ prior_rows, degrees=0 if level_known else free,
        reduced_chi2=float(np.sum(rest**2)) / free,
    )  # fmt: skip
