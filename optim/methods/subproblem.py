"""The convex subproblem of the minimax search, built once with CVXPY and solved with new numbers each time.

    minimise   Σ t_g + ½ |R d|² + penalty · s
    subject to aᵢ + gᵢᵀ d ≤ t_g(i)      every competing row i of what is minimised, in groups g
               bⱼ + hⱼᵀ d ≤ s, s ≥ 0    every limited row j, as relative excess over its bound
               low ≤ d ≤ high           bounds and trust region

d is the step in scaled variables, RᵀR the convex part of the Hessian of the Lagrangian. The rows are padded
to a fixed number, so that the problem is compiled once for each shape and kept for the whole process.
"""

from __future__ import annotations

import threading
from functools import lru_cache

import cvxpy
import numpy as np

from optim.criteria.linearised import Model
from optim.methods.conic import Index, Numbers, Programme, Step, duals_of, padded
from optim.problem.variables import Real

_BLOCK = 12  # rows are padded to multiples of it
_LOCK = threading.Lock()  # a problem keeps its numbers in itself


def solve_subproblem(model: Model, root: Real, radius: float) -> Step | None:
    """Solve the subproblem of a model; None if the conic solver did not reach optimality.

    Parameters
    ----------
    model : rows of the present design.
    root : (n, n) R.
    radius : of the trust region, in each scaled variable.
    """
    groups = np.unique(model.groups)
    shape = tuple(padded(int((model.groups == g).sum()), _BLOCK) for g in groups)
    with _LOCK:
        return _subproblem(model.z.size, shape, padded(model.excess.size, _BLOCK)).solve(model, root, radius)


@lru_cache(maxsize=32)
def _subproblem(n: int, shape: tuple[int, ...], limited: int) -> _Subproblem:
    return _Subproblem(n, shape, limited)


class _Subproblem(Programme):
    """The parametrised problem for n variables, so many rows in each group, so many limited rows."""

    def __init__(self, n: int, shape: tuple[int, ...], limited: int) -> None:
        super().__init__(n)
        t = cvxpy.Variable(len(shape))
        self._heights = [cvxpy.Parameter(m) for m in shape]
        self._slopes = [cvxpy.Parameter((m, n)) for m in shape]
        self._rows = [
            a + g @ self._d <= t[i] for i, (a, g) in enumerate(zip(self._heights, self._slopes, strict=True))
        ]
        curved = 0.5 * cvxpy.sum_squares(self._root @ self._d)
        self._pose(self._share * cvxpy.sum(t) + curved, self._rows, limited)

    def _fill(self, numbers: Numbers, places: list[Index]) -> Index:
        spread = [np.resize(mine, a.size) for mine, a in zip(places, self._heights, strict=True)]
        for some, a, g in zip(spread, self._heights, self._slopes, strict=True):
            a.value, g.value = numbers.heights[some], numbers.slopes[some]
        return np.concatenate(spread)

    def _duals(self) -> Real:
        return np.concatenate([duals_of(row) for row in self._rows])
