"""Newton steps in units of the unknowns, and how far equations are from solved; see `corrector`."""

from __future__ import annotations

import math

import numpy as np

from solver.jit.fourier import Index, Real
from solver.jit.lapack import back_substitute, factorise
from solver.jit.separate import apart


@apart
def scaled_step(J: Real, rhs: Real, columns: Real, scaled: Real, pivots: Index) -> bool:
    """Solve J δ = rhs in units `columns` of the unknowns, rows brought to one size; δ in place of `rhs`.

    Returns
    -------
    False, with `rhs` meaningless, if J is singular or something is not finite.
    """
    m = rhs.size
    for i in range(m):
        largest = 0.0
        for j in range(m):
            value = J[i, j] * columns[j]
            scaled[i, j] = value
            largest = max(largest, abs(value))
            if not math.isfinite(value):
                return False
        factor = 1.0 if largest == 0.0 else 1.0 / largest
        for j in range(m):
            scaled[i, j] *= factor
        rhs[i] *= factor
    if factorise(scaled, m, pivots) == 0.0:
        return False
    back_substitute(scaled, m, pivots, rhs)
    for i in range(m):
        rhs[i] *= columns[i]
        if not math.isfinite(rhs[i]):
            return False
    return True


@apart
def relative_residual(
    residual: Real, rough: Real, y: Real, size: int, a: float, lag: float, cancelled: float
) -> float:
    """Return the largest residual, each relative to what it is a difference of; NaN if one is.

    Parameters
    ----------
    rough : (size,) size that a residual of each motion is rounding of, times `cancelled` at least.
    a : amplitude; lag : what the residual of the phase is relative to.
    """
    motion, worst = 1e-300, 0.0
    for i in range(size):
        motion = max(motion, abs(y[i]))
    for i in range(size):
        share = abs(residual[i]) / max(motion, cancelled * rough[i])
        if not share <= worst:
            worst = share
    q = max(math.hypot(y[size], y[size + 1]), a)
    for share in (
        abs(residual[size]) / q, abs(residual[size + 1]) / q, abs(residual[size + 2]) / max(lag, 1e-300),
        abs(residual[size + 3]),
    ):  # fmt: skip
        if not share <= worst:
            worst = share
    return worst if math.isfinite(worst) else np.inf
