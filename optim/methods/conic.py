"""The convex subproblem of the minimax search.

Steps are in units of the radius and rows in units of what they change by within it, counted from the largest:
the conic solver's tolerances are absolute, and steps become as small as 1e-9.
"""

from __future__ import annotations

import math
import threading
import warnings
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated

import cvxpy
import numpy as np

from optim.criteria.linearised import Model
from optim.problem.variables import Real

_LEAST = 1e-14  # unit of rows that do not change, relative to their size
_STEEP = 1e6  # times the change of the objective, the most a penalty may change by
_BLOCKS = {False: 12, True: 4}  # rows are padded to multiples of it; by whether the trust region is round
_LOCK = threading.Lock()  # a problem keeps its numbers in itself


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """A solved subproblem."""

    step: Annotated[Real, "In scaled variables, (n,)."]
    predicted: Annotated[float, "Merit of the linear model at the step."]
    multipliers: Annotated[Real, "Of the objective rows, (m,); those of a group sum to 1."]
    limit_multipliers: Annotated[Real, "Of the limited rows, (c,)."]


def solve_subproblem(model: Model, root: Real, radius: float, *, ball: bool) -> Step | None:
    """Solve the subproblem of a model; None if the conic solver did not reach optimality.

    Parameters
    ----------
    model : rows of the present design.
    root : (n, n) R.
    radius : of the trust region, in scaled variables.
    ball : whether that is round, otherwise it is a box.
    """
    groups, block = np.unique(model.groups), _BLOCKS[ball]
    most = max(int((model.groups == g).sum()) for g in groups)
    rows, limited = (-(-count // block) * block for count in (most, model.excess.size))
    with _LOCK:
        return _subproblem(model.z.size, groups.size, rows, limited, ball).solve(model, root, radius)


@lru_cache(maxsize=64)
def _subproblem(n: int, groups: int, rows: int, limited: int, ball: bool) -> _Subproblem:
    return _Subproblem(n, groups, rows, limited, ball)


class _Subproblem:
    """The subproblem for n variables, so many groups with so many rows in each, and so many limited rows.

        minimise   Σ t_g + ½ |R d|² + penalty · s
        subject to aᵢ + gᵢᵀ d ≤ t_g(i)         every competing row i of what is minimised, in groups g
                   bⱼ + hⱼᵀ d ≤ s, s ≥ least   every limited row j, as relative excess over its bound
                   low ≤ d ≤ high              bounds and trust region
                   ‖d‖ ≤ 1                     trust region, where it is round

    d is the step in scaled variables, in units of the radius, RᵀR the convex part of the Hessian of the
    Lagrangian. With the many scenarios of a mean every scenario is a group of its own. The rows are padded to
    a fixed number, so that the problem is compiled once for each shape and kept for the process.
    """

    def __init__(self, n: int, groups: int, rows: int, limited: int, ball: bool) -> None:
        self._each, self._limited = rows, limited
        self._d, t = cvxpy.Variable(n), cvxpy.Variable(groups)
        share, root = cvxpy.Parameter(nonneg=True, name="share"), cvxpy.Parameter((n, n), name="root")
        self._rows = self._row(
            "heights", "slopes", groups * rows, np.repeat(np.eye(groups), rows, axis=0) @ t
        )
        objective = share * cvxpy.sum(t) + 0.5 * cvxpy.sum_squares(root @ self._d)
        low, high = cvxpy.Parameter(n, name="low"), cvxpy.Parameter(n, name="high")
        constraints = [self._rows, low <= self._d, self._d <= high]
        if ball:
            constraints.append(cvxpy.SOC(cvxpy.Constant(1.0), self._d))
        if limited:
            s, price = cvxpy.Variable(), cvxpy.Parameter(nonneg=True, name="price")
            self._limits = self._row("excess", "excess_slopes", limited, s)
            constraints += [self._limits, cvxpy.Parameter(name="least") <= s]
            objective = objective + price * s
        self._problem = cvxpy.Problem(cvxpy.Minimize(objective), constraints)

    def _row(self, values: str, slopes: str, count: int, most: cvxpy.Expression) -> cvxpy.Constraint:
        given, by = cvxpy.Parameter(count, name=values), cvxpy.Parameter((count, self._d.size), name=slopes)
        return given + by @ self._d <= most

    def solve(self, model: Model, root: Real, radius: float) -> Step | None:
        """Solve with the numbers of a model; None if the conic solver did not reach optimality."""
        places = [np.flatnonzero(model.groups == g) for g in np.unique(model.groups)]
        rows = np.concatenate([np.resize(mine, self._each) for mine in places])
        limited = np.resize(np.arange(model.excess.size), self._limited)
        far = -3.0 * model.z.size  # a row that far below the largest can not reach it within the radius
        unit = max(radius * float(np.abs(model.slopes).max(initial=0.0)), _LEAST)
        limit_unit = max(radius * float(np.abs(model.excess_slopes).max(initial=0.0)), _LEAST)
        tops = np.array([model.heights[model.groups == g].max() for g in model.groups])
        # What the objective changes by counts as 1, unless the penalty changes by far more. Limits that do
        # not change hold nothing.
        changing = limit_unit > _LEAST
        whole = max(unit, model.penalty * limit_unit / _STEEP) if changing else unit
        share, price = unit / whole, model.penalty * limit_unit / whole if changing else 0.0
        low, high = np.maximum(-model.z / radius, -1.0), np.minimum((1.0 - model.z) / radius, 1.0)
        numbers = {
            "heights": np.maximum((model.heights - tops) / unit, far)[rows],
            "slopes": (radius / unit * model.slopes)[rows],
            "excess": np.maximum((model.excess - model.violation) / limit_unit, far)[limited],
            "excess_slopes": (radius / limit_unit * model.excess_slopes)[limited],
            "least": max(-model.violation / limit_unit, 2.0 * far), "share": share, "price": price,
            "root": radius / math.sqrt(whole) * root, "low": low, "high": high,
        }  # fmt: skip
        for name, parameter in self._problem.param_dict.items():
            parameter.value = numbers[name]
        if not self._solved():
            return None
        step = radius * np.clip(np.asarray(self._d.value, dtype=np.float64), low, high)
        multipliers, limit_multipliers = np.zeros(model.heights.size), np.zeros(model.excess.size)
        np.add.at(multipliers, rows, np.maximum(self._rows.dual_value, 0.0) / share)
        if price > 0.0:
            duals = np.maximum(self._limits.dual_value, 0.0)
            np.add.at(limit_multipliers, limited, model.penalty * duals / price)
        return Step(
            step=step, predicted=model.predicted(step), multipliers=multipliers,
            limit_multipliers=limit_multipliers,
        )  # fmt: skip

    def _solved(self) -> bool:
        """Run the conic solver; return whether it reached optimality, if only to a reduced accuracy."""
        try:
            with warnings.catch_warnings():
                # The status says it, and the trust region judges the step by the true response.
                warnings.filterwarnings("ignore", message="Solution may be inaccurate")
                self._problem.solve(solver=cvxpy.CLARABEL, warm_start=False)
        except cvxpy.SolverError:
            return False
        optimal = self._problem.status in (cvxpy.OPTIMAL, cvxpy.OPTIMAL_INACCURATE)
        return optimal and self._d.value is not None
