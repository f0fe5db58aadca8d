"""The convex subproblem of the minimax search, and what it shares with that of `optim.robust.search`.

Steps are in units of the radius and rows in units of what they change by within it, counted from the largest:
the conic solver's tolerances are absolute, and steps become as small as 1e-9.
"""

from __future__ import annotations

import math
import threading
import warnings
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated

import cvxpy
import numpy as np
from numpy.typing import NDArray

from optim.criteria.linearised import Model
from optim.problem.variables import Real

Index = NDArray[np.intp]

_LEAST = 1e-14  # unit of rows that do not change, relative to their size
_STEEP = 1e6  # times the change of the objective, the most a penalty may change by


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """A solved subproblem."""

    step: Annotated[Real, "In scaled variables, (n,)."]
    predicted: Annotated[float, "Merit of the linear model at the step."]
    multipliers: Annotated[Real, "Of the objective rows, (m,); those of a group sum to 1."]
    limit_multipliers: Annotated[Real, "Of the limited rows, (c,)."]


@dataclass(frozen=True, slots=True, kw_only=True)
class Numbers:
    """The numbers of a model for one radius, all of order one."""

    model: Model
    radius: float
    heights: Annotated[Real, "Objective rows below the largest of their group, (m,)."]
    slopes: Annotated[Real, "Their slopes, (m, n)."]
    excess: Annotated[Real, "Limited rows below the largest excess, or below 0 if all limits are kept, (c,)."]
    excess_slopes: Annotated[Real, "Their slopes, (c, n)."]
    share: Annotated[float, "Factor of the objective."]
    price: Annotated[float, "That of the penalty."]
    least: Annotated[float, "Where the penalty begins."]
    root: Annotated[Real, "R, (n, n)."]
    low: Annotated[Real, "Lower bounds of the variables, within a box of the radius, (n,)."]
    high: Annotated[Real, "Upper ones, (n,)."]

    def step(self, d: Real, duals: Real, rows: Index, limit_duals: Real, limited: Index) -> Step:
        """Return the step of a solution.

        Parameters
        ----------
        d : (n,) the step in units of the radius.
        duals : of the objective rows of the programme; rows : which row of the model each is.
        limit_duals, limited : likewise of the limited rows.
        """
        model = self.model
        step = self.radius * np.clip(d, self.low, self.high)
        multipliers, limit_multipliers = np.zeros(model.heights.size), np.zeros(model.excess.size)
        np.add.at(multipliers, rows, np.maximum(duals, 0.0) / self.share)
        if self.price > 0.0:
            np.add.at(limit_multipliers, limited, model.penalty * np.maximum(limit_duals, 0.0) / self.price)
        return Step(
            step=step, predicted=model.predicted(step), multipliers=multipliers,
            limit_multipliers=limit_multipliers,
        )  # fmt: skip


def numbers_of(model: Model, root: Real, radius: float) -> Numbers:
    """Return the numbers of a model; `root` is R (n, n), `radius` that of the trust region."""
    far = -3.0 * model.z.size  # a row that far below the largest can not reach it within the radius
    unit = max(radius * float(np.abs(model.slopes).max(initial=0.0)), _LEAST)
    limit_unit = max(radius * float(np.abs(model.excess_slopes).max(initial=0.0)), _LEAST)
    tops = np.array([model.heights[model.groups == g].max() for g in model.groups])
    # What the objective changes by counts as 1, unless the penalty changes by far more. Limits that do not
    # change hold nothing.
    changing = limit_unit > _LEAST
    whole = max(unit, model.penalty * limit_unit / _STEEP) if changing else unit
    return Numbers(
        model=model, radius=radius, heights=np.maximum((model.heights - tops) / unit, far),
        slopes=radius / unit * model.slopes,
        excess=np.maximum((model.excess - model.violation) / limit_unit, far),
        excess_slopes=radius / limit_unit * model.excess_slopes, share=unit / whole,
        price=model.penalty * limit_unit / whole if changing else 0.0,
        least=max(-model.violation / limit_unit, 2.0 * far), root=radius / math.sqrt(whole) * root,
        low=np.maximum(-model.z / radius, -1.0), high=np.minimum((1.0 - model.z) / radius, 1.0),
    )  # fmt: skip


class LimitRows:
    """The limited rows of a programme: excess + slopes · d ≤ s, s ≥ least, at a price of s."""

    def __init__(self, count: int, d: cvxpy.Variable) -> None:
        self._count = count
        self._s, self._least = cvxpy.Variable(), cvxpy.Parameter()
        self._excess, self._slopes = cvxpy.Parameter(count), cvxpy.Parameter((count, d.size))
        self._price = cvxpy.Parameter(nonneg=True)
        self._row = self._excess + self._slopes @ d <= self._s
        self.constraints = [self._row, self._least <= self._s]
        self.penalty = self._price * self._s

    def fill(self, numbers: Numbers) -> Index:
        """Set the numbers; return which limited row of the model each row here is."""
        again = np.resize(np.arange(numbers.excess.size), self._count)
        self._excess.value, self._slopes.value = numbers.excess[again], numbers.excess_slopes[again]
        self._least.value, self._price.value = numbers.least, numbers.price
        return again

    def duals(self) -> Real:
        """Return the multipliers of the rows."""
        return duals_of(self._row)


class Programme(ABC):
    """A convex programme for the step d, posed once and solved with the numbers of many models."""

    def __init__(self, n: int) -> None:
        self._d = cvxpy.Variable(n)
        self._root, self._low, self._high = cvxpy.Parameter((n, n)), cvxpy.Parameter(n), cvxpy.Parameter(n)
        self._share = cvxpy.Parameter(nonneg=True)

    def _pose(self, objective: cvxpy.Expression, constraints: list[cvxpy.Constraint], limited: int) -> None:
        """Make the programme of its own part, the bounds and so many limited rows."""
        self._limits = LimitRows(limited, self._d) if limited else None
        constraints = [*constraints, self._low <= self._d, self._d <= self._high]
        if self._limits is not None:
            constraints += self._limits.constraints
            objective = objective + self._limits.penalty
        self._problem = cvxpy.Problem(cvxpy.Minimize(objective), constraints)

    @abstractmethod
    def _fill(self, numbers: Numbers, places: list[Index]) -> Index:
        """Set the objective rows, given which rows each group has; return which row of the model each is."""

    @abstractmethod
    def _duals(self) -> Real:
        """Return the multipliers of the objective rows."""

    def solve(self, model: Model, root: Real, radius: float) -> Step | None:
        """Solve with the numbers of a model; None if the conic solver did not reach optimality."""
        numbers = numbers_of(model, root, radius)
        rows = self._fill(numbers, [np.flatnonzero(model.groups == g) for g in np.unique(model.groups)])
        again = np.zeros(0, dtype=np.intp) if self._limits is None else self._limits.fill(numbers)
        self._share.value, self._root.value = numbers.share, numbers.root
        self._low.value, self._high.value = numbers.low, numbers.high
        if not solved(self._problem, self._d):
            return None
        return numbers.step(
            np.asarray(self._d.value, dtype=np.float64), self._duals(), rows,
            np.zeros(0) if self._limits is None else self._limits.duals(), again,
        )  # fmt: skip


def padded(count: int, block: int) -> int:
    """Return the number of rows, a multiple of a block, that many rows are padded to."""
    return -(-count // block) * block


def solved(problem: cvxpy.Problem, d: cvxpy.Variable) -> bool:
    """Run the conic solver; return whether it reached optimality, if only to a reduced accuracy."""
    try:
        with warnings.catch_warnings():
            # The status says it, and the trust region judges the step by the true response.
            warnings.filterwarnings("ignore", message="Solution may be inaccurate")
            problem.solve(solver=cvxpy.CLARABEL, warm_start=False)
    except cvxpy.SolverError:
        return False
    return problem.status in (cvxpy.OPTIMAL, cvxpy.OPTIMAL_INACCURATE) and d.value is not None


def duals_of(row: cvxpy.Constraint) -> Real:
    """Return the multipliers of some rows."""
    return np.asarray(row.dual_value, dtype=np.float64)


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
    """The subproblem of the minimax search for n variables, so many rows in each group and limited rows.

        minimise   Σ t_g + ½ |R d|² + penalty · s
        subject to aᵢ + gᵢᵀ d ≤ t_g(i)      every competing row i of what is minimised, in groups g
                   bⱼ + hⱼᵀ d ≤ s, s ≥ 0    every limited row j, as relative excess over its bound
                   low ≤ d ≤ high           bounds and trust region

    d is the step in scaled variables, RᵀR the convex part of the Hessian of the Lagrangian. The rows are
    padded to a fixed number, so that the problem is compiled once for each shape and kept for the process.
    """

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
