"""The convex subproblem of the minimax search, built once with CVXPY and solved with new numbers each time.

    minimise   Σ t_g + ½ |R d|² + penalty · s
    subject to aᵢ + gᵢᵀ d ≤ t_g(i)      every competing row i of what is minimised, in groups g
               bⱼ + hⱼᵀ d ≤ s, s ≥ 0    every limited row j, as relative excess over its bound
               low ≤ d ≤ high           bounds and trust region

d is the step in scaled variables, RᵀR is a quasi-Newton matrix of the Lagrangian. The rows are padded to a
fixed number, so that the problem is compiled once for each shape and kept for the whole process.
"""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass
from functools import lru_cache

import cvxpy
import numpy as np

from optim.model import PENALTY, Model
from optim.variables import Real

_BLOCK = 12  # rows are padded to multiples of it
_LEAST = 1e-14  # unit of rows that do not change, relative to their size
_STEEP = 1e6  # times the change of the objective, the most a penalty may change by in the cone programme
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


def solve_subproblem(model: Model, root: Real, radius: float) -> Step | None:
    """Solve the subproblem of a model; None if the conic solver did not reach optimality.

    Parameters
    ----------
    model : rows of the present design.
    root : (n, n) R.
    radius : of the trust region, in each scaled variable.
    """
    groups = np.unique(model.groups)
    shape = tuple(_padded(int((model.groups == g).sum())) for g in groups)
    with _LOCK:
        return _subproblem(model.z.size, shape, _padded(model.excess.size)).solve(model, root, radius)


def _padded(count: int) -> int:
    return -(-count // _BLOCK) * _BLOCK


@lru_cache(maxsize=32)
def _subproblem(n: int, shape: tuple[int, ...], limited: int) -> _Subproblem:
    return _Subproblem(n, shape, limited)


class _Subproblem:
    """The parametrised problem for n variables, so many rows in each group, so many limited rows.

    Steps are in units of the radius and rows in units of what they change by within it, counted from the
    largest: the conic solver's tolerances are absolute, and steps become as small as 1e-9.
    """

    def __init__(self, n: int, shape: tuple[int, ...], limited: int) -> None:
        self._d, self._t = cvxpy.Variable(n), cvxpy.Variable(len(shape))
        self._heights = [cvxpy.Parameter(m) for m in shape]
        self._slopes = [cvxpy.Parameter((m, n)) for m in shape]
        self._root, self._low, self._high = cvxpy.Parameter((n, n)), cvxpy.Parameter(n), cvxpy.Parameter(n)
        self._rows = [
            a + g @ self._d <= self._t[i]
            for i, (a, g) in enumerate(zip(self._heights, self._slopes, strict=True))
        ]
        constraints = [*self._rows, self._low <= self._d, self._d <= self._high]
        self._share = cvxpy.Parameter(nonneg=True)
        objective = self._share * cvxpy.sum(self._t) + 0.5 * cvxpy.sum_squares(self._root @ self._d)
        self._limited = limited
        if limited:
            self._s, self._least = cvxpy.Variable(), cvxpy.Parameter()
            self._excess, self._excess_slopes = cvxpy.Parameter(limited), cvxpy.Parameter((limited, n))
            self._price = cvxpy.Parameter(nonneg=True)
            self._limit_row = self._excess + self._excess_slopes @ self._d <= self._s
            constraints += [self._limit_row, self._least <= self._s]
            objective = objective + self._price * self._s
        self._problem = cvxpy.Problem(cvxpy.Minimize(objective), constraints)

    def solve(self, model: Model, root: Real, radius: float) -> Step | None:
        """Solve with the numbers of a model."""
        far = -3.0 * model.z.size  # a row that far below the largest can not reach it within the radius
        unit = max(radius * float(np.abs(model.slopes).max(initial=0.0)), _LEAST)
        places = [np.flatnonzero(model.groups == g) for g in np.unique(model.groups)]
        spread = [np.resize(mine, a.size) for mine, a in zip(places, self._heights, strict=True)]
        for some, a, g in zip(spread, self._heights, self._slopes, strict=True):
            below = (model.heights[some] - model.heights[some].max()) / unit
            a.value, g.value = np.maximum(below, far), radius / unit * model.slopes[some]
        again = np.resize(np.arange(model.excess.size), self._limited)
        if self._limited:
            limit_unit = max(radius * float(np.abs(model.excess_slopes).max(initial=0.0)), _LEAST)
            below = (model.excess[again] - model.violation) / limit_unit
            self._excess.value = np.maximum(below, far)
            self._excess_slopes.value = radius / limit_unit * model.excess_slopes[again]
            self._least.value = max(-model.violation / limit_unit, 2.0 * far)
        else:
            limit_unit = _LEAST
        # What the objective changes by counts as 1, unless the penalty changes by far more.
        whole = max(unit, PENALTY * limit_unit / _STEEP)
        self._share.value, self._root.value = unit / whole, radius / math.sqrt(whole) * root
        if self._limited:
            self._price.value = PENALTY * limit_unit / whole
        self._low.value = np.maximum(-model.z / radius, -1.0)
        self._high.value = np.minimum((1.0 - model.z) / radius, 1.0)
        if not self._solved():
            return None
        step = radius * np.clip(
            np.asarray(self._d.value, dtype=np.float64), self._low.value, self._high.value
        )
        multipliers, limit_multipliers = np.zeros(model.heights.size), np.zeros(model.excess.size)
        for some, row in zip(spread, self._rows, strict=True):
            np.add.at(
                multipliers,
                some,
                np.maximum(np.asarray(row.dual_value, dtype=np.float64), 0.0) * whole / unit,
            )
        if self._limited and limit_unit > _LEAST:  # rows that do not change hold nothing
            duals = np.maximum(np.asarray(self._limit_row.dual_value, dtype=np.float64), 0.0)
            np.add.at(limit_multipliers, again, duals * whole / limit_unit)
        return Step(
            step=step, predicted=model.predicted(step), multipliers=multipliers,
            limit_multipliers=limit_multipliers,
        )  # fmt: skip

    def _solved(self) -> bool:
        """Run the conic solver; return whether it reached optimality."""
        try:
            self._problem.solve(solver=cvxpy.CLARABEL, warm_start=False)
        except cvxpy.SolverError:
            return False
        return self._problem.status in (cvxpy.OPTIMAL, cvxpy.OPTIMAL_INACCURATE) and self._d.value is not None
