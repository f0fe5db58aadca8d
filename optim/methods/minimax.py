"""Trust-region search for the design whose largest row is least, subject to limits on others.

Each step solves a convex subproblem at the present design: every competing peak, every band is a row, so an
exchange of the highest peak is nothing special. The curvature between exchanges is that of the Lagrangian:
exact where every row that pulls has second derivatives, else a damped BFGS matrix. Reference: Conn, Gould,
Toint, Trust-Region Methods (SIAM 2000), chapter 14, and Powell's damping (Math. Program. 14 (1978) 224).

In the subproblem steps are in units of the radius and rows in units of what they change by within it, counted
from the largest: the conic solver's tolerances are absolute, and steps become as small as 1e-9.
"""

from __future__ import annotations

import math
import threading
import warnings
from collections import deque
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Annotated

import cvxpy
import numpy as np

from optim.criteria.constraint_rows import DesignEvaluation, nearest
from optim.criteria.criterion import CriterionRow
from optim.methods.linearised import KEPT, PENALTY, Evaluate, Local, Model, ModelOf, ended, with_cuts
from optim.problem.variables import BoundedVariable, Real, snapped, unscaled

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


FIRST_RADIUS = 0.2
LARGEST_RADIUS = 0.5
SMALLEST_RADIUS = 1e-9
STATIONARY = 1e-11  # predicted relative decrease below which a design is optimal
MOST_STEPS = 40
JUMP, AT_A_JUMP = 5.0, 1e-5  # a rise over what slopes tell; relative decrease up to which nothing is gained
FIRST_PENALTY = 1.0  # times the objective: far above the multipliers, it makes limits that bend too steep
STRONGER = 10.0  # factor of a penalty that leaves limits broken
ENOUGH = 1e-4  # share of the predicted decrease from which a step is taken
REMEMBERED = 8  # designs whose rows are kept as cuts
CUTS_REACH = 10.0  # times the radius, as far as cuts reach
SAME_DESIGN = 1e-5  # scaled distance within which the rows of another design tell of the optimum
NOTHING = 1e-9  # multipliers below it are rounding of the conic solver


def minimax_search(
    evaluate: Evaluate, variables: tuple[BoundedVariable, ...], begin: DesignEvaluation, model_of: ModelOf, *,
    ball: bool = False, remembered: int = REMEMBERED, enough: float = -np.inf, strict: bool = False,
) -> Local:  # fmt: skip
    """Improve a design until no first-order decrease is left.

    Parameters
    ----------
    evaluate : the rows of a design, with gradients.
    variables : the design variables.
    begin : a good evaluation to start from.
    model_of : the model of an evaluation.
    ball : whether the trust region is round, otherwise it is a box.
    remembered : designs whose rows are kept as cuts.
    enough : merit from which on nothing better is looked for.
    strict : whether no step leaves the limits that the design to begin from keeps, however much is gained.
    """
    n = len(variables)
    here, model = begin, model_of(begin)
    first = PENALTY if strict else min(FIRST_PENALTY * abs(model.objective) or PENALTY, PENALTY)
    model = replace(model, penalty=first)
    hessian, radius = np.zeros((n, n)), FIRST_RADIUS
    seen: deque[Model] = deque(maxlen=remembered)
    jump = False
    for _ in range(MOST_STEPS):
        known = with_cuts(model, seen, CUTS_REACH * radius)
        step = solve_subproblem(known, _root(hessian), radius, ball=ball)
        if step is None:
            break
        if _too_weak(model, step):
            model = replace(model, penalty=min(STRONGER * model.penalty, PENALTY))
            continue
        decrease = model.merit - step.predicted
        if decrease <= STATIONARY * model.merit or radius <= SMALLEST_RADIUS:
            break
        trial = evaluate(unscaled(variables, snapped(model.z + step.step)))
        if not trial.good:
            radius *= 0.25
            continue
        fresh = replace(model_of(trial), penalty=model.penalty)
        moved = fresh.z - model.z
        ratio = (model.merit - fresh.merit) / max(decrease - 0.5 * float(moved @ hessian @ moved), 1e-300)
        if fresh.smooth:
            hessian = _curvature(model, fresh, _pulls(known, step), hessian, accepted=ratio > ENOUGH)
            seen.append(model if ratio > ENOUGH else fresh)
        size = float(np.linalg.norm(step.step, 2 if ball else np.inf))
        jump = decrease <= AT_A_JUMP * model.merit and _jumps(model, fresh, size)
        if jump:
            break
        if ratio > 0.75 and size > 0.9 * radius:
            radius = min(2.0 * radius, LARGEST_RADIUS)
        elif ratio < 0.25:
            radius = 0.5 * size if ratio > 0.0 else 0.25 * size
        if ratio > ENOUGH and fresh.smooth:
            here, model = trial, fresh
            if model.merit <= enough:
                break
    end = ended(here, replace(with_cuts(model, seen, SAME_DESIGN), penalty=PENALTY), variables)
    return replace(end, at_a_jump=jump)


def _jumps(model: Model, fresh: Model, size: float) -> bool:
    """Return whether what is minimised rises over a step by far more than any row tells at either end."""
    ahead, back = (
        replace(one, heights=one.heights + sign * size * np.abs(one.slopes).sum(axis=1)).objective
        for one, sign in ((model, JUMP), (fresh, -JUMP))
    )
    return ahead < fresh.objective and model.objective < back


def _too_weak(model: Model, step: Step) -> bool:
    """Return whether the penalty is what leaves limits broken: they pull as hard as it lets them."""
    pull = float(step.limit_multipliers.sum())
    left = float((model.excess + model.excess_slopes @ step.step).max(initial=0.0))
    return left > KEPT and pull >= 0.99 * model.penalty and model.penalty < PENALTY


def thorough_search(
    evaluate: Evaluate, variables: tuple[BoundedVariable, ...], begin: DesignEvaluation, model_of: ModelOf,
    enough: float = -np.inf, *, strict: bool = False,
) -> Local:  # fmt: skip
    """Improve a design with cuts, and go on without them where that does not settle.

    A row bent over a long step may pass for a new one and hold a search where nothing is.
    """
    found = minimax_search(evaluate, variables, begin, model_of, enough=enough, strict=strict)
    if found.settled or found.at_a_jump or found.merit <= enough:
        return found
    again = minimax_search(
        evaluate, variables, found.evaluation, model_of, remembered=0, enough=enough, strict=strict
    )
    return min(found, again, key=lambda local: local.rank)


def _curvature(
    model: Model, fresh: Model, pulls: list[tuple[CriterionRow, float]], hessian: Real, *, accepted: bool
) -> Real:
    """Return the Hessian of the Lagrangian for the next step: exact where the solver has it, else updated.

    Only its convex part serves; a step that was not taken leaves the design, and so the exact Hessian of it.
    """
    exact = _exact(fresh if accepted else model, pulls)
    if exact is not None:
        # The nearest positive semidefinite matrix.
        values, vectors = np.linalg.eigh(exact)
        convex: Real = (vectors * np.maximum(values, 0.0)) @ vectors.T
        return convex
    # The damped BFGS update; the first one scales the matrix.
    s = fresh.z - model.z
    y = _gradient(fresh, pulls) - _gradient(model, pulls)
    curvature = float(s @ y)
    if not np.any(hessian):
        if curvature <= 0.0 or not np.any(s):
            return hessian
        return np.eye(s.size) * curvature / float(s @ s)
    Bs = hessian @ s
    quadratic = float(s @ Bs)
    if quadratic <= 0.0:
        return hessian
    if curvature < 0.2 * quadratic:
        theta = 0.8 * quadratic / (quadratic - curvature)
        y = theta * y + (1.0 - theta) * Bs
        curvature = float(s @ y)
    updated: Real = hessian - np.outer(Bs, Bs) / quadratic + np.outer(y, y) / curvature
    return updated


def _exact(model: Model, pulls: list[tuple[CriterionRow, float]]) -> Real | None:
    """Return the Hessian of the Lagrangian whose multipliers belong to rows of another design."""
    total = np.zeros((model.z.size, model.z.size))
    for row, multiplier in pulls:
        limited = row.weight == 0.0
        near = nearest(row, model.limited if limited else model.rows)
        second = None if near is None else model.limited_second(near) if limited else model.second(near)
        if second is None:
            return None
        total += multiplier * second
    return total


def _gradient(model: Model, pulls: list[tuple[CriterionRow, float]]) -> Real:
    """Return the gradient of the Lagrangian whose multipliers belong to rows of another design."""
    total = np.zeros(model.z.size)
    for row, multiplier in pulls:
        near = nearest(row, model.limited if row.weight == 0.0 else model.rows)
        if near is not None:
            total += multiplier * (model.excess_slopes if row.weight == 0.0 else model.slopes)[near]
    return total


def _pulls(model: Model, step: Step) -> list[tuple[CriterionRow, float]]:
    """Return the rows that hold a step, with their multipliers."""
    found = [(row, float(x)) for row, x in zip(model.rows, step.multipliers, strict=True) if x > NOTHING]
    limits = zip(model.limited, step.limit_multipliers, strict=True)
    return found + [(replace(row, weight=0.0), float(x)) for row, x in limits if x > NOTHING]


def _root(hessian: Real) -> Real:
    """Return R with RᵀR = hessian."""
    values, vectors = np.linalg.eigh(hessian)
    root: Real = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
    return root
