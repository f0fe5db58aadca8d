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
from optim.methods.conic import Index, Numbers, Programme, Step, duals_of, padded
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
        cone = _cone(model.z.size, groups.size, padded(most, _BLOCK), padded(model.excess.size, _BLOCK))
        return cone.solve(model, root, radius)


@lru_cache(maxsize=32)
def _cone(n: int, groups: int, rows: int, limited: int) -> _Cone:
    return _Cone(n, groups, rows, limited)


class _Cone(Programme):
    """The parametrised problem for n variables, so many rows in each group, so many limited rows."""

    def __init__(self, n: int, groups: int, rows: int, limited: int) -> None:
        super().__init__(n)
        t, w = cvxpy.Variable(groups), cvxpy.Variable()
        self._heights, self._slopes = cvxpy.Parameter(groups * rows), cvxpy.Parameter((groups * rows, n))
        self._rows_each = rows
        owner = np.repeat(np.eye(groups), rows, axis=0)
        self._row = self._heights + self._slopes @ self._d <= owner @ t
        curved = cvxpy.hstack([math.sqrt(2.0) * (self._root @ self._d), w - 1.0])
        cones = [cvxpy.SOC(w + 1.0, curved), cvxpy.SOC(cvxpy.Constant(1.0), self._d)]
        self._pose(self._share * cvxpy.sum(t) + w, [self._row, *cones], limited)

    def _fill(self, numbers: Numbers, places: list[Index]) -> Index:
        spread = np.concatenate([np.resize(mine, self._rows_each) for mine in places])
        self._heights.value, self._slopes.value = numbers.heights[spread], numbers.slopes[spread]
        return spread

    def _duals(self) -> Real:
        return duals_of(self._row)
