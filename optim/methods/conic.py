"""What the convex subproblems of `optim.methods.subproblem` and `optim.robust.search` share: numbers of order
one, one solver.

Steps are in units of the radius and rows in units of what they change by within it, counted from the largest:
the conic solver's tolerances are absolute, and steps become as small as 1e-9.
"""

from __future__ import annotations

import math
import warnings
from abc import ABC, abstractmethod
from dataclasses import dataclass

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Numbers:
    """The numbers of a model for one radius, all of order one.

    Attributes
    ----------
    heights, slopes : (m,), (m, n) arrays
        Objective rows below the largest of their group.
    excess, excess_slopes : (c,), (c, n) arrays
        Limited rows below the largest excess, or below 0 if all limits are kept.
    share, price : float
        Factors of the objective and of the penalty.
    least : float
        Where the penalty begins.
    root : (n, n) array
        R.
    low, high : (n,) arrays
        Bounds of the variables, within a box of the radius.
    """

    model: Model
    radius: float
    heights: Real
    slopes: Real
    excess: Real
    excess_slopes: Real
    share: float
    price: float
    least: float
    root: Real
    low: Real
    high: Real

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
