"""The convex subproblem of the minimax search, built once with CVXPY and solved with new numbers each time.

    minimise   t + ½ |R d|² + weight · s
    subject to aᵢ + gᵢᵀ d ≤ t           every competing peak i
               b + gᵇᵀ d ≤ limit + s    the resonance band, if it is limited
               low ≤ d ≤ high           bounds and trust region

d is the step in scaled variables, peaks are relative to the first highest one, RᵀR is a quasi-Newton matrix
of the Lagrangian. The rows are padded to a fixed number, so that the problem is compiled once.
"""

from __future__ import annotations

from dataclasses import dataclass

import cvxpy
import numpy as np

from optim.scaling import Real

ROWS = 12
SLACK_WEIGHT = 100.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """A solved subproblem.

    Attributes
    ----------
    step : (n,) array
        In scaled variables.
    predicted : float
        Model value t + weight·s at the step, without the quadratic term.
    peak_multipliers : (n_rows,) array
        Of the peak rows; they sum to 1.
    band_multiplier : float
        Of the band row.
    """

    step: Real
    predicted: float
    peak_multipliers: Real
    band_multiplier: float


class Subproblem:
    """The parametrised problem for `n` variables."""

    def __init__(self, n: int, *, limited_band: bool) -> None:
        self._n = n
        self._limited = limited_band
        self._d = cvxpy.Variable(n)
        self._t = cvxpy.Variable()
        self._s = cvxpy.Variable(nonneg=True)
        self._heights = cvxpy.Parameter(ROWS)
        self._slopes = cvxpy.Parameter((ROWS, n))
        self._root = cvxpy.Parameter((n, n))
        self._low = cvxpy.Parameter(n)
        self._high = cvxpy.Parameter(n)
        self._band = cvxpy.Parameter()
        self._band_slope = cvxpy.Parameter(n)
        self._peak_rows = self._heights + self._slopes @ self._d <= self._t
        self._band_row = self._band + self._band_slope @ self._d <= self._s
        rows = [self._peak_rows, self._low <= self._d, self._d <= self._high]
        objective = self._t + 0.5 * cvxpy.sum_squares(self._root @ self._d)
        if limited_band:
            rows.append(self._band_row)
            objective = objective + SLACK_WEIGHT * self._s
        self._problem = cvxpy.Problem(cvxpy.Minimize(objective), rows)

    def solve(
        self, heights: Real, slopes: Real, root: Real, low: Real, high: Real, band: float, band_slope: Real
    ) -> Step | None:
        """Solve for new numbers; None if the conic solver did not reach optimality.

        Parameters
        ----------
        heights : (m,) relative peak heights, m ≤ `ROWS`; slopes : (m, n) by the scaled variables.
        root : (n, n) R; low, high : (n,) limits of the step.
        band : (width − limit)/limit of the band, and its slope (n,); ignored without a band limit.
        """
        m = heights.size
        padded = np.resize(np.arange(m), ROWS)
        padded[m:] = 0
        self._heights.value, self._slopes.value = heights[padded], slopes[padded]
        self._root.value, self._low.value, self._high.value = root, low, high
        self._band.value, self._band_slope.value = band, band_slope
        self._problem.solve(solver=cvxpy.CLARABEL, warm_start=False)
        if self._problem.status not in (cvxpy.OPTIMAL, cvxpy.OPTIMAL_INACCURATE) or self._d.value is None:
            return None
        step = np.clip(np.asarray(self._d.value, dtype=np.float64), low, high)
        multipliers = np.maximum(np.asarray(self._peak_rows.dual_value, dtype=np.float64), 0.0)
        shared = np.array([multipliers[padded == i].sum() for i in range(m)])
        predicted = float((heights + slopes @ step).max())
        band_multiplier = 0.0
        if self._limited:
            predicted += SLACK_WEIGHT * max(float(band + band_slope @ step), 0.0)
            band_multiplier = float(np.asarray(self._band_row.dual_value))
        return Step(
            step=step, predicted=predicted, peak_multipliers=shared / max(shared.sum(), 1e-300),
            band_multiplier=band_multiplier,
        )  # fmt: skip
