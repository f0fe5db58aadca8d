"""The master problem of a robust search: a second-order cone programme, built once with CVXPY.

    minimise   Σ t_g + w + penalty · s
    subject to aᵢ + gᵢᵀ d ≤ t_g(i)             every competing row i of every scenario, in groups g
               bⱼ + hⱼᵀ d ≤ s, s ≥ least       every limited row j, as relative excess over its bound
               ‖(√2 R d, w − 1)‖ ≤ w + 1       that is ½ |R d|² ≤ w
               ‖d‖ ≤ 1                         trust region
               low ≤ d ≤ high                  bounds

d is the step in scaled variables, in units of the radius, and rows are in the units of `optim.methods.conic`;
RᵀR is the convex part of the Hessian of the Lagrangian. With the many scenarios of a mean every scenario is a
group of its own; the number of rows in a group is padded, so that a problem is compiled once for each shape
and kept for the whole process.
"""

from __future__ import annotations

import math
import threading
from functools import lru_cache

import cvxpy
import numpy as np

from optim.criteria.linearised import Model
from optim.methods.conic import LimitRows, Step, duals_of, numbers_of, solved
from optim.problem.variables import Real

_BLOCK = 4  # rows are padded to multiples of it
_LOCK = threading.Lock()  # a problem keeps its numbers in itself


def solve_cone(model: Model, root: Real, radius: float) -> Step | None:
    """Solve the master problem of a model; None if the conic solver did not reach optimality.

    Parameters
    ----------
    model : rows of the present design.
    root : (n, n) R.
    radius : of the trust region, in scaled variables.
    """
    groups = np.unique(model.groups)
    most = max(int((model.groups == g).sum()) for g in groups)
    with _LOCK:
        cone = _cone(model.z.size, groups.size, _padded(most), _padded(model.excess.size))
        return cone.solve(model, root, radius)


def _padded(count: int) -> int:
    return -(-count // _BLOCK) * _BLOCK


@lru_cache(maxsize=32)
def _cone(n: int, groups: int, rows: int, limited: int) -> _Cone:
    return _Cone(n, groups, rows, limited)


class _Cone:
    """The parametrised problem for n variables, so many rows in each group, so many limited rows."""

    def __init__(self, n: int, groups: int, rows: int, limited: int) -> None:
        self._d, self._t, self._w = cvxpy.Variable(n), cvxpy.Variable(groups), cvxpy.Variable()
        self._heights, self._slopes = cvxpy.Parameter(groups * rows), cvxpy.Parameter((groups * rows, n))
        self._root, self._low, self._high = cvxpy.Parameter((n, n)), cvxpy.Parameter(n), cvxpy.Parameter(n)
        self._rows_each = rows
        owner = np.repeat(np.eye(groups), rows, axis=0)
        self._row = self._heights + self._slopes @ self._d <= owner @ self._t
        curved = cvxpy.hstack([math.sqrt(2.0) * (self._root @ self._d), self._w - 1.0])
        constraints = [
            self._row, cvxpy.SOC(self._w + 1.0, curved), cvxpy.SOC(cvxpy.Constant(1.0), self._d),
            self._low <= self._d, self._d <= self._high,
        ]  # fmt: skip
        self._share = cvxpy.Parameter(nonneg=True)
        objective = self._share * cvxpy.sum(self._t) + self._w
        self._limits = LimitRows(limited, self._d) if limited else None
        if self._limits is not None:
            constraints += self._limits.constraints
            objective = objective + self._limits.penalty
        self._problem = cvxpy.Problem(cvxpy.Minimize(objective), constraints)

    def solve(self, model: Model, root: Real, radius: float) -> Step | None:
        """Solve with the numbers of a model."""
        numbers = numbers_of(model, root, radius)
        places = [np.flatnonzero(model.groups == g) for g in np.unique(model.groups)]
        spread = np.concatenate([np.resize(mine, self._rows_each) for mine in places])
        self._heights.value, self._slopes.value = numbers.heights[spread], numbers.slopes[spread]
        again = np.zeros(0, dtype=np.intp) if self._limits is None else self._limits.fill(numbers)
        self._share.value, self._root.value = numbers.share, numbers.root
        self._low.value, self._high.value = numbers.low, numbers.high
        if not solved(self._problem, self._d):
            return None
        return numbers.step(
            np.asarray(self._d.value, dtype=np.float64), duals_of(self._row), spread,
            np.zeros(0) if self._limits is None else self._limits.duals(), again,
        )  # fmt: skip
