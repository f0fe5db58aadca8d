"""The convex subproblem of the minimax search, built once with CVXPY and solved with new numbers each time.

    minimise   Σ t_g + ½ |R d|² + penalty · s
    subject to aᵢ + gᵢᵀ d ≤ t_g(i)      every competing row i of what is minimised, in groups g
               bⱼ + hⱼᵀ d ≤ s, s ≥ 0    every limited row j, as relative excess over its bound
               low ≤ d ≤ high           bounds and trust region

d is the step in scaled variables, RᵀR is a quasi-Newton matrix of the Lagrangian. The rows are padded to a
fixed number, so that the problem is compiled once for each shape and kept for the whole process.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass
from functools import lru_cache

import cvxpy
import numpy as np

from optim.model import PENALTY, Model
from optim.variables import Real

_BLOCK = 12  # rows are padded to multiples of it
_LOCK = threading.Lock()  # a problem keeps its numbers in itself


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """A solved subproblem.

    Attributes
    ----------
    step : (n,) array
        In scaled variables.
    predicted : float
        Merit of the linear model at the step.
    multipliers : (m,) array
        Of the objective rows; those of a group sum to 1.
    limit_multipliers : (c,) array
        Of the limited rows.
    """

    step: Real
    predicted: float
    multipliers: Real
    limit_multipliers: Real


def solve_subproblem(model: Model, root: Real, low: Real, high: Real) -> Step | None:
    """Solve the subproblem of a model; None if the conic solver did not reach optimality.

    Parameters
    ----------
    model : rows of the present design.
    root : (n, n) R; low, high : (n,) limits of the step.
    """
    groups = np.unique(model.groups)
    shape = tuple(_padded(int((model.groups == g).sum())) for g in groups)
    with _LOCK:
        return _subproblem(model.z.size, shape, _padded(model.excess.size)).solve(model, root, low, high)


def _padded(count: int) -> int:
    return -(-count // _BLOCK) * _BLOCK


@lru_cache(maxsize=32)
def _subproblem(n: int, shape: tuple[int, ...], limited: int) -> _Subproblem:
    return _Subproblem(n, shape, limited)


class _Subproblem:
    """The parametrised problem for n variables, so many rows in each group, so many limited rows."""

    def __init__(self, n: int, shape: tuple[int, ...], limited: int) -> None:
        self._d, self._t, self._s = cvxpy.Variable(n), cvxpy.Variable(len(shape)), cvxpy.Variable(nonneg=True)
        self._heights = [cvxpy.Parameter(m) for m in shape]
        self._slopes = [cvxpy.Parameter((m, n)) for m in shape]
        self._root, self._low, self._high = cvxpy.Parameter((n, n)), cvxpy.Parameter(n), cvxpy.Parameter(n)
        self._rows = [
            a + g @ self._d <= self._t[i]
            for i, (a, g) in enumerate(zip(self._heights, self._slopes, strict=True))
        ]
        constraints = [*self._rows, self._low <= self._d, self._d <= self._high]
        objective = cvxpy.sum(self._t) + 0.5 * cvxpy.sum_squares(self._root @ self._d)
        self._limited = limited
        if limited:
            self._excess, self._excess_slopes = cvxpy.Parameter(limited), cvxpy.Parameter((limited, n))
            self._limit_row = self._excess + self._excess_slopes @ self._d <= self._s
            constraints.append(self._limit_row)
            objective = objective + PENALTY * self._s
        self._problem = cvxpy.Problem(cvxpy.Minimize(objective), constraints)

    def solve(self, model: Model, root: Real, low: Real, high: Real) -> Step | None:
        """Solve with the numbers of a model."""
        places = [np.flatnonzero(model.groups == g) for g in np.unique(model.groups)]
        spread = [np.resize(mine, a.size) for mine, a in zip(places, self._heights, strict=True)]
        for some, a, g in zip(spread, self._heights, self._slopes, strict=True):
            a.value, g.value = model.heights[some], model.slopes[some]
        c = model.excess.size
        if self._limited:
            again = np.resize(np.arange(c), self._limited)
            self._excess.value, self._excess_slopes.value = model.excess[again], model.excess_slopes[again]
        self._root.value, self._low.value, self._high.value = root, low, high
        try:
            self._problem.solve(solver=cvxpy.CLARABEL, warm_start=False)
        except cvxpy.SolverError:
            return None
        if self._problem.status not in (cvxpy.OPTIMAL, cvxpy.OPTIMAL_INACCURATE) or self._d.value is None:
            return None
        step = np.clip(np.asarray(self._d.value, dtype=np.float64), low, high)
        heights = model.heights + model.slopes @ step
        predicted = sum(float(heights[mine].max()) for mine in places)
        multipliers, limit_multipliers = np.zeros(model.heights.size), np.zeros(c)
        for some, row in zip(spread, self._rows, strict=True):
            np.add.at(multipliers, some, np.maximum(np.asarray(row.dual_value, dtype=np.float64), 0.0))
        if self._limited:
            duals = np.maximum(np.asarray(self._limit_row.dual_value, dtype=np.float64), 0.0)
            np.add.at(limit_multipliers, again, duals)
            predicted += PENALTY * max(float((model.excess + model.excess_slopes @ step).max()), 0.0)
        return Step(
            step=step, predicted=predicted, multipliers=multipliers, limit_multipliers=limit_multipliers
        )
