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
from optim.methods.conic import LimitRows, Step, duals_of, numbers_of, solved
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
    shape = tuple(_padded(int((model.groups == g).sum())) for g in groups)
    with _LOCK:
        return _subproblem(model.z.size, shape, _padded(model.excess.size)).solve(model, root, radius)


def _padded(count: int) -> int:
    return -(-count // _BLOCK) * _BLOCK


@lru_cache(maxsize=32)
def _subproblem(n: int, shape: tuple[int, ...], limited: int) -> _Subproblem:
    return _Subproblem(n, shape, limited)


class _Subproblem:
    """The parametrised problem for n variables, so many rows in each group, so many limited rows."""

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
        self._limits = LimitRows(limited, self._d) if limited else None
        if self._limits is not None:
            constraints += self._limits.constraints
            objective = objective + self._limits.penalty
        self._problem = cvxpy.Problem(cvxpy.Minimize(objective), constraints)

    def solve(self, model: Model, root: Real, radius: float) -> Step | None:
        """Solve with the numbers of a model."""
        numbers = numbers_of(model, root, radius)
        places = [np.flatnonzero(model.groups == g) for g in np.unique(model.groups)]
        spread = [np.resize(mine, a.size) for mine, a in zip(places, self._heights, strict=True)]
        for some, a, g in zip(spread, self._heights, self._slopes, strict=True):
            a.value, g.value = numbers.heights[some], numbers.slopes[some]
        again = np.zeros(0, dtype=np.intp) if self._limits is None else self._limits.fill(numbers)
        self._share.value, self._root.value = numbers.share, numbers.root
        self._low.value, self._high.value = numbers.low, numbers.high
        if not solved(self._problem, self._d):
            return None
        return numbers.step(
            np.asarray(self._d.value, dtype=np.float64),
            np.concatenate([duals_of(row) for row in self._rows]), np.concatenate(spread),
            np.zeros(0) if self._limits is None else self._limits.duals(), again,
        )  # fmt: skip
