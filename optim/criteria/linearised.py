"""First-order model of a design in scaled variables, and the optimality conditions it has to meet.

Objective rows are relative to a scale, so that 1 is the height of the design a search began with; limited
rows are relative excesses over their bounds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from optim.criteria.criterion import Criterion, Row
from optim.criteria.rows import Evaluation
from optim.problem.variables import Real, Variable, scaled, slopes

PENALTY = 1e4  # the largest exact penalty on the largest relative excess over a bound
ACTIVE = 1e-6  # relative distance from the largest row, or from its bound, within which a row is active
AT_BOUND = 1e-12  # scaled distance within which a variable is on its bound


@dataclass(frozen=True, slots=True, kw_only=True)
class Model:
    """Rows of one design in scaled variables z; m objective rows in groups, c limited rows.

    Attributes
    ----------
    z : (n,) array
        The design.
    rows : tuple of Row
        The m objective rows.
    heights, slopes : (m,), (m, n) arrays
        Weighted values relative to the scale, and their derivatives by z.
    groups : (m,) array of int
        Rows of one group are maximised over, the maxima of the groups are added.
    limited : tuple of Row
        The c limited rows.
    excess, excess_slopes : (c,), (c, n) arrays
        Relative excess over the bounds.
    by_z, bends : (n,) arrays
        First and second derivatives of the variables by z.
    unit : float
        The objective that counts as 1.
    units : (c,) array
        What each excess is relative to.
    penalty : float
        On the largest excess, in what a search decreases.
    """

    z: Real
    rows: tuple[Row, ...]
    heights: Real
    slopes: Real
    groups: Real
    limited: tuple[Row, ...]
    excess: Real
    excess_slopes: Real
    by_z: Real
    bends: Real
    unit: float
    units: Real
    penalty: float = PENALTY

    def second(self, i: int) -> Real | None:
        """Return the second derivatives of objective row `i` by z, (n, n); None where they do not exist."""
        row = self.rows[i]
        return self._by_z_twice(row, row.weight / self.unit)

    def limited_second(self, j: int) -> Real | None:
        """Return those of the relative excess of limited row `j`."""
        return self._by_z_twice(self.limited[j], 1.0 / self.units[j])

    def _by_z_twice(self, row: Row, factor: float) -> Real | None:
        if row.second is None:
            return None
        by_values = row.second()
        twice = factor * (by_values * np.outer(self.by_z, self.by_z) + np.diag(row.gradient * self.bends))
        return twice if np.all(np.isfinite(twice)) else None

    @property
    def objective(self) -> float:
        """Sum over the groups of the largest row."""
        return float(sum(self.heights[self.groups == g].max() for g in np.unique(self.groups)))

    @property
    def violation(self) -> float:
        """Largest relative excess over a bound, 0 if all are kept."""
        return max(float(self.excess.max(initial=0.0)), 0.0)

    @property
    def merit(self) -> float:
        """What a search decreases: the objective with the exact penalty on the limits."""
        return self.objective + self.penalty * self.violation

    def predicted(self, step: Real) -> float:
        """Return the merit after a step (n,) if every row were linear."""
        heights, excess = self.heights + self.slopes @ step, self.excess + self.excess_slopes @ step
        objective = sum(float(heights[self.groups == g].max()) for g in np.unique(self.groups))
        return objective + self.penalty * max(float(excess.max(initial=0.0)), 0.0)

    @property
    def smooth(self) -> bool:
        """Whether every slope exists."""
        return bool(np.all(np.isfinite(self.slopes)) and np.all(np.isfinite(self.excess_slopes)))


def model_of(
    evaluation: Evaluation, variables: Sequence[Variable], scale: float, scales: Mapping[Criterion, float]
) -> Model:
    """Return the model of a good evaluation.

    Parameters
    ----------
    evaluation : the design.
    variables : their scaling.
    scale : the objective of the design that counts as 1.
    scales : what an excess over a bound of 0 is relative to, of every criterion in order.
    """
    by_z, n = slopes(variables, evaluation.values), len(variables)
    rows = tuple(row for row in evaluation.rows if row.weight > 0.0)
    limited = tuple(row for row in evaluation.rows if row.bound is not None)
    groups = list(scales)
    units = [row.unit_of(scales[row.quantity]) for row in limited]
    return Model(
        z=scaled(variables, evaluation.values), rows=rows,
        heights=np.array([row.weight * row.value / scale for row in rows]),
        slopes=np.array([row.weight * row.gradient * by_z / scale for row in rows]).reshape(-1, n),
        groups=np.array([groups.index(row.quantity) for row in rows], dtype=np.float64), limited=limited,
        excess=np.array([row.excess(scales[row.quantity]) for row in limited]),
        excess_slopes=np.array(
            [row.gradient * by_z / unit for row, unit in zip(limited, units, strict=True)]
        ).reshape(-1, n),
        by_z=by_z, bends=np.array([v.bend(evaluation.values[v.name]) for v in variables]), unit=scale,
        units=np.array(units),
    )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Conditions:
    """The Karush-Kuhn-Tucker conditions of a design: which rows hold it, with which force.

    Attributes
    ----------
    rows : tuple of (Row, float)
        Active rows with their multipliers: objective rows of one quantity sum to 1; those of limited rows say
        by how much of the objective's scale the optimum falls for a relative relief of the bound.
    bounds : tuple of (str, str, float)
        Variable, ``lower`` or ``upper``, and multiplier, of the variables on a bound.
    residual : float
        Largest component of the gradient of the Lagrangian, relative objective per scaled variable.
    violation : float
        Largest relative excess over a bound.
    """

    rows: tuple[tuple[Row, float], ...]
    bounds: tuple[tuple[str, str, float], ...]
    residual: float
    violation: float


def conditions(model: Model, variables: Sequence[Variable], *, feasibility: bool = False) -> Conditions:
    """Return the multipliers that leave the least gradient of the Lagrangian.

    Non-negative least squares for Σ λᵢ gᵢ + Σ μⱼ gⱼ + bounds = 0 over the active rows, Σ λᵢ = 1 by group.

    Parameters
    ----------
    feasibility : judge the largest excess as what is minimised (for a design that cannot keep its limits).
    """
    kept: list[tuple[Row, Real, int]] = []
    if feasibility:
        top = model.excess.max(initial=0.0)
        near = np.flatnonzero(model.excess >= top - ACTIVE * max(1.0, abs(top)))
        kept = [(model.limited[i], model.excess_slopes[i], 0) for i in near]
    else:
        for g in np.unique(model.groups):
            mine = np.flatnonzero(model.groups == g)
            top = model.heights[mine].max()
            near = mine[model.heights[mine] >= top - ACTIVE * abs(top)]
            kept += [(model.rows[i], model.slopes[i], int(g)) for i in near]
        kept += [
            (row, slope, -1)
            for row, slope, excess in zip(model.limited, model.excess_slopes, model.excess, strict=True)
            if abs(excess) <= ACTIVE
        ]
    held = bounds_held(model.z, variables)
    return _multipliers(kept, held, model)


def bounds_held(z: Real, variables: Sequence[Variable]) -> list[tuple[str, str, Real]]:
    """Return the variables on a bound with the outward direction."""
    held = []
    for i, variable in enumerate(variables):
        unit = np.zeros(z.size)
        if z[i] <= AT_BOUND:
            unit[i] = -1.0
            held.append((variable.name, "lower", unit))
        elif z[i] >= 1.0 - AT_BOUND:
            unit[i] = 1.0
            held.append((variable.name, "upper", unit))
    return held


def _multipliers(
    kept: list[tuple[Row, Real, int]], held: list[tuple[str, str, Real]], model: Model
) -> Conditions:
    """Solve for the multipliers of active rows and bounds."""
    columns = [slope for _, slope, _ in kept] + [unit for _, _, unit in held]
    matrix = np.array(columns).reshape(-1, model.z.size).T
    if not np.all(np.isfinite(matrix)):
        return Conditions(rows=(), bounds=(), residual=float("nan"), violation=model.violation)
    weight = 1e3 * max(1.0, np.abs(matrix).max(initial=0.0))
    groups = sorted({g for _, _, g in kept if g >= 0})
    sums = np.zeros((len(groups), matrix.shape[1]))
    for line, g in enumerate(groups):
        sums[line, [i for i, (_, _, mine) in enumerate(kept) if mine == g]] = weight
    target = np.append(np.zeros(model.z.size), np.full(len(groups), weight))
    solution, _ = nnls(np.vstack([matrix, sums]), target)
    residual = float(np.abs(matrix @ solution).max(initial=0.0))
    rows = tuple((row, float(x)) for (row, _, _), x in zip(kept, solution, strict=False))
    bounds = tuple(
        (name, side, float(x)) for (name, side, _), x in zip(held, solution[len(kept) :], strict=True)
    )
    return Conditions(rows=rows, bounds=bounds, residual=residual, violation=model.violation)
