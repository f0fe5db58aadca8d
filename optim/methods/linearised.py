"""First-order models of designs in scaled variables, their optimality conditions, where a local search ended.

Objective rows are relative to a scale, so that 1 is the height of the design a search began with; limited
rows are relative excesses over their bounds.

Between the designs looked at Taylor models of the nearest ones say what is known. A look begins with corners,
middles and a Sobol sequence. Every design looked at has its rows with their slopes. Between designs each of
the nearest ones predicts the number by its own rows, positive ones along exponentials (Shepard's inverse-
distance weights of Taylor models: Franke, Nielson, Int. J. Numer. Methods Eng. 15 (1980) 1691,
doi:10.1002/nme.1620151110); where these predictions differ, little is known. A place is worth a look where
the mean less a few times the spread may beat the best design (lower confidence bound: Cox, John, in
Multidisciplinary Design Optimization, SIAM 1997, p. 105).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from scipy.optimize import nnls

from optim.criteria.constraint_rows import DesignEvaluation
from optim.criteria.criterion import Criterion, CriterionRow
from optim.problem.design_problem import Method, Problem
from optim.problem.variables import BoundedVariable, Real, scaled, slopes
from optim.results.design_result import Conditions, DesignResult, DesignStatus, LocalOptimum

PENALTY = 1e4  # the largest exact penalty on the largest relative excess over a bound
ACTIVE = 1e-6  # relative distance from the largest row, or from its bound, within which a row is active
AT_BOUND = 1e-12  # scaled distance within which a variable is on its bound


@dataclass(frozen=True, slots=True, kw_only=True)
class Model:
    """Rows of one design in scaled variables z; m objective rows in groups, c limited rows."""

    z: Annotated[Real, "The design, (n,)."]
    rows: Annotated[tuple[CriterionRow, ...], "The m objective rows."]
    heights: Annotated[Real, "Weighted values relative to the scale, (m,)."]
    slopes: Annotated[Real, "Their derivatives by z, (m, n)."]
    groups: Annotated[
        Real, "Rows of one group are maximised over, the maxima of the groups are added, (m,) of int."
    ]
    limited: Annotated[tuple[CriterionRow, ...], "The c limited rows."]
    excess: Annotated[Real, "Relative excess over the bounds, (c,)."]
    excess_slopes: Annotated[Real, "Their derivatives by z, (c, n)."]
    by_z: Annotated[Real, "First derivatives of the variables by z, (n,)."]
    bends: Annotated[Real, "Second ones, (n,)."]
    unit: Annotated[float, "The objective that counts as 1."]
    units: Annotated[Real, "What each excess is relative to, (c,)."]
    penalty: Annotated[float, "On the largest excess, in what a search decreases."] = PENALTY

    def second(self, i: int) -> Real | None:
        """Return the second derivatives of objective row `i` by z, (n, n); None where they do not exist."""
        row = self.rows[i]
        return self._by_z_twice(row, row.weight / self.unit)

    def limited_second(self, j: int) -> Real | None:
        """Return those of the relative excess of limited row `j`."""
        return self._by_z_twice(self.limited[j], 1.0 / self.units[j])

    def _by_z_twice(self, row: CriterionRow, factor: float) -> Real | None:
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
    evaluation: DesignEvaluation,
    variables: Sequence[BoundedVariable],
    scale: float,
    scales: Mapping[Criterion, float],
) -> Model:
    """Return the model of a good evaluation.

    Parameters
    ----------
    evaluation : the design.
    variables : their scaling.
    scale : the objective of the design that counts as 1; where that is 0 a unit of it does.
    scales : what an excess over a bound of 0 is relative to, of every criterion in order.
    """
    by_z, n, scale = slopes(variables, evaluation.values), len(variables), scale or 1.0
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


def conditions(
    model: Model, variables: Sequence[BoundedVariable], *, feasibility: bool = False
) -> Conditions:
    """Return the multipliers that leave the least gradient of the Lagrangian.

    Non-negative least squares for Σ λᵢ gᵢ + Σ μⱼ gⱼ + bounds = 0 over the active rows, Σ λᵢ = 1 by group.

    Parameters
    ----------
    feasibility : judge the largest excess as what is minimised (for a design that cannot keep its limits).
    """
    kept: list[tuple[CriterionRow, Real, int]] = []
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


def bounds_held(z: Real, variables: Sequence[BoundedVariable]) -> list[tuple[str, str, Real]]:
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
    kept: list[tuple[CriterionRow, Real, int]], held: list[tuple[str, str, Real]], model: Model
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


ROUNDING = 1e-9  # relative, of a row between two evaluations
SAME = 0.2  # share of the change of slope by which the trapezoidal rule may miss a row that is the same


def with_cuts(model: Model, others: Iterable[Model], reach: float) -> Model:
    """Return a model with the rows of other designs that it does not have itself, as cuts.

    A peak that is about to appear, the trough of the motion that is about to become larger than its crest: at
    a design nothing tells of them, and a step that meets them fails however short it is. Their linearisations
    at the nearby designs where they were seen are kept as rows, lowered by how far they miss the present
    design, as in bundle methods for nonconvex functions: Kiwiel, Methods of Descent for Nondifferentiable
    Optimization (Springer 1985), section 3.2.

    Parameters
    ----------
    model : of the present design.
    others : models of designs evaluated before.
    reach : scaled distance up to which they are used.
    """
    mine = _Lines(model.rows, model.heights, model.slopes)
    limits = _Lines(model.limited, model.excess, model.excess_slopes)
    groups, units = list(model.groups), list(model.units)
    for other in others:
        back = model.z - other.z
        if not 0.0 < np.abs(back).max() <= reach:
            continue
        for i, row in enumerate(other.rows):
            top = model.heights[model.groups == other.groups[i]].max()
            if mine.take(row, other.heights[i], other.slopes[i], back, top):
                groups.append(other.groups[i])
        for j, row in enumerate(other.limited):
            if limits.take(row, other.excess[j], other.excess_slopes[j], back, model.excess.max()):
                units.append(other.units[j])
    return replace(
        model, rows=tuple(mine.rows), heights=np.array(mine.values), slopes=mine.table(model.z.size),
        groups=np.array(groups), limited=tuple(limits.rows), excess=np.array(limits.values),
        excess_slopes=limits.table(model.z.size), units=np.array(units),
    )  # fmt: skip


class _Lines:
    """Rows with their values and slopes at the present design."""

    def __init__(self, rows: tuple[CriterionRow, ...], values: Real, slopes: Real) -> None:
        self.rows, self.values, self.slopes = list(rows), list(values), list(slopes)
        self._own = len(rows)

    def table(self, n: int) -> Real:
        """Return the slopes, (rows, n)."""
        return np.array(self.slopes).reshape(-1, n)

    def take(self, row: CriterionRow, value: float, slope: Real, back: Real, top: float) -> bool:
        """Add a row seen `back` from here as a cut, unless one of the present design is the same."""
        if self._known(row, value, slope, back):
            return False
        self.rows.append(row)
        self.slopes.append(slope)
        # Never above what the present design shows.
        self.values.append(float(top - abs(top - (value + slope @ back))))
        return True

    def _known(self, row: CriterionRow, value: float, slope: Real, back: Real) -> bool:
        """Return whether the trapezoidal rule leads from the row there to one here: they are one."""
        for mine, its, here in zip(
            self.rows[: self._own], self.slopes[: self._own], self.values[: self._own], strict=True
        ):
            if (mine.quantity, mine.case) != (row.quantity, row.case):
                continue
            missed = abs(here - value - 0.5 * float((its + slope) @ back))
            if missed <= SAME * abs(0.5 * float((its - slope) @ back)) + ROUNDING * abs(value):
                return True
        return False


Evaluate = Callable[[Mapping[str, float]], DesignEvaluation]
ModelOf = Callable[[DesignEvaluation], Model]

KKT_TOLERANCE = 1e-3  # relative objective per scaled variable
KEPT = 1e-6  # relative excess over a bound up to which it counts as kept
FLAT_SLOPE = 1e-9  # relative objective per scaled variable below which there is nothing to choose


@dataclass(frozen=True, slots=True, kw_only=True)
class Local:
    """Where a local search ended."""

    evaluation: Annotated[DesignEvaluation, "The best design."]
    merit: Annotated[float, "Its objective, with the penalty on the limits it does not keep."]
    settled: Annotated[
        bool,
        "Whether the first-order conditions hold: of the objective, or, if limits are not kept, of the "
        "largest excess over them.",
    ]
    feasible: Annotated[bool, "Whether the limits are kept."]
    conditions: Annotated[Conditions, "Multipliers and residual."]
    standing: Annotated[tuple[float, float], "What designs are compared by; see `standing`."]
    at_a_jump: Annotated[bool, "Whether what is minimised jumps there: nothing nearer is lower."] = False

    @property
    def rank(self) -> tuple[tuple[float, float], bool]:
        """What ends are compared by, the best first: of equal ones a settled one."""
        return self.standing, not self.settled

    @property
    def optimum(self) -> LocalOptimum:
        """It as results tell it."""
        return optimum_at(self.evaluation, settled=self.settled, feasible=self.feasible)


def optimum_at(evaluation: DesignEvaluation, *, settled: bool, feasible: bool) -> LocalOptimum:
    """Return a design whose responses were computed as a local optimum."""
    return LocalOptimum(
        values=dict(evaluation.values), peak=evaluation.peaks[0].value, objective=evaluation.objective_told,
        settled=settled, feasible=feasible, proven=True,
    )  # fmt: skip


def standing(model: Model) -> tuple[float, float]:
    """Return what designs are compared by: the excess over the limits that are not kept, then the objective.

    No penalty is large enough for every limit: a design that keeps all of them goes before any that does not.
    """
    violation = model.violation
    return (0.0 if violation <= KEPT else violation), model.objective


def ended(here: DesignEvaluation, model: Model, variables: Sequence[BoundedVariable]) -> Local:
    """Return the end of a search at a design."""
    feasible = model.violation <= KEPT
    found = conditions(model, variables, feasibility=not feasible)
    return Local(
        evaluation=here, merit=model.merit, settled=found.residual <= KKT_TOLERANCE, feasible=feasible,
        conditions=found, standing=standing(model),
    )  # fmt: skip


HELD = 1e-7  # multiplier of a bound, relative objective per scaled variable, from which it holds the design


def settled_status(found: Conditions) -> DesignStatus:
    """Return whether a settled design is held by the bound of a variable."""
    held = any(multiplier > HELD for _, _, multiplier in found.bounds)
    return DesignStatus.AT_BOUND if held else DesignStatus.OPTIMAL


def of_one(
    problem: Problem, method: Method, status: DesignStatus, evaluation: DesignEvaluation | None, **more: Any
) -> DesignResult:  # fmt: skip
    """Return the result of a method without a local search; its optimum is judged like that of any."""
    found = None
    if evaluation is not None and evaluation.good:
        model = model_of(evaluation, problem.variables, evaluation.objective, problem.scales)
        found = conditions(model, problem.variables)
        status = settled_status(found) if status is DesignStatus.OPTIMAL else status
    history = () if evaluation is None else (evaluation,)
    return DesignResult(
        problem=problem, method=method, status=status, evaluation=evaluation, conditions=found,
        history=history, **more,
    )  # fmt: skip


def is_flat(model: Model) -> bool:
    """Return whether no row depends on any variable."""
    both = np.concatenate([model.slopes.reshape(-1), model.excess_slopes.reshape(-1)])
    return bool(np.all(np.abs(both) <= FLAT_SLOPE))


def of_limits(model: Model) -> Model:
    """Return the model whose objective is the largest relative excess over a limit, counted from 1."""
    rows = tuple(
        replace(row, weight=model.unit / unit)
        for row, unit in zip(model.limited, model.units.tolist(), strict=True)
    )
    return replace(
        without_limits(model), rows=rows, heights=1.0 + model.excess, slopes=model.excess_slopes,
        groups=np.zeros(model.excess.size),
    )  # fmt: skip


def without_limits(model: Model) -> Model:
    """Return the model of what is minimised alone."""
    none = np.zeros(0)
    return replace(model, limited=(), excess=none, excess_slopes=np.zeros((0, model.z.size)), units=none)


LocalSearch = Callable[[Evaluate, tuple[BoundedVariable, ...], DesignEvaluation, ModelOf], Local]


LOOKS_ONE = 17  # designs of a look with one variable
LOOKS_EACH = 12  # and for each variable with more, besides corners and middles
MOST_CORNERS = 32
NEAREST = 2  # designs a variable, and two more, whose models predict a place
DOUBT = 1.0  # spreads by which a prediction may be too high
MOST_GROWTH = 3.0  # exponent at most
CANDIDATES = 256  # places a variable that are compared, one variable: all of them in steps


def places(n: int, known: int = 0) -> Real:
    """Return the places of a look, (k, n), of the unit box: bounds included.

    The middle; the middles of the faces, with two variables those of the edges; the corners where all
    variables have one bound; a Sobol sequence between them, shorter by so many places as are `known` between
    the bounds already; the other corners, of many variables only those next to these two.
    """
    if n == 1:
        return np.linspace(0.0, 1.0, LOOKS_ONE)[:, None]
    middle = np.full((1, n), 0.5)
    faces = np.repeat(middle, 2 * n, axis=0)
    for i in range(n):
        faces[2 * i, i], faces[2 * i + 1, i] = 0.0, 1.0
    between = quasi_random(n, LOOKS_EACH * n)
    # The first place of the sequence is a corner, the second the middle.
    ends = corners(n)
    return np.vstack([middle, faces, ends[:2], between[2 + known :], ends[2:]])


def quasi_random(n: int, least: int, seed: int | None = None) -> Real:
    """Return the first places of a Sobol sequence in the unit box, (count, n); scrambled if it has a seed.

    They are `least`, or more: balanced are powers of two.
    """
    from scipy.stats import qmc  # takes half a second to load, and a design of one variable needs none

    count = 2 ** max(math.ceil(math.log2(least)), 0)
    return np.asarray(qmc.Sobol(n, scramble=seed is not None, seed=seed).random(count))


def corners(n: int) -> Real:
    """Return corners of the unit box, (k, n), the two where all variables have one bound first.

    Of many variables those that differ from these in one.
    """
    others = np.vstack([np.eye(n), 1.0 - np.eye(n)])
    if 2**n <= MOST_CORNERS:
        others = np.array(list(itertools.product((0.0, 1.0), repeat=n)))[1:-1]
    return np.vstack([np.ones(n), np.zeros(n), others])


@dataclass(frozen=True, slots=True, kw_only=True)
class Taylor:
    """First-order model of a number: Σ over groups of the largest row, a price on the largest limited row."""

    place: Annotated[Real, "Where it was looked at, (n,)."]
    groups: Annotated[tuple[tuple[Real, Real], ...], "Rows with their slopes."]
    limited: Annotated[tuple[Real, Real] | None, "Relative excesses over bounds."] = None
    price: Annotated[float, "On the largest excess above 0."] = 0.0

    @property
    def value(self) -> float:
        """The number here."""
        limited = 0.0 if self.limited is None else self.price * max(float(self.limited[0].max()), 0.0)
        return limited + sum(float(values.max()) for values, _ in self.groups)

    def at(self, places: Real) -> Real:
        """Return the predictions at (k, n) places."""
        steps = places - self.place
        total = np.zeros(len(places))
        for values, rises in self.groups:
            total += _grown(values, steps @ rises.T).max(axis=1)
        if self.limited is not None:
            excess, rises = self.limited
            total += self.price * np.maximum(_grown(1.0 + excess, steps @ rises.T).max(axis=1) - 1.0, 0.0)
        return total


def _grown(values: Real, changes: Real) -> Real:
    """Return rows after first-order changes (k, m): along exponentials where they are positive."""
    positive = values > 0.0
    safe = np.where(positive, values, 1.0)
    exponents = np.clip(changes / safe, -MOST_GROWTH, MOST_GROWTH)
    grown: Real = np.where(positive, safe * np.exp(exponents), values + changes)
    return grown


def taylor_of(model: Model, *, feasibility: bool = False) -> Taylor:
    """Return the model of a design's merit, or of its largest excess."""
    if feasibility:
        return Taylor(place=model.z, groups=((1.0 + model.excess, model.excess_slopes),))
    groups = tuple(
        (model.heights[model.groups == g], model.slopes[model.groups == g]) for g in np.unique(model.groups)
    )
    limited = (model.excess, model.excess_slopes) if model.excess.size else None
    return Taylor(place=model.z, groups=groups, limited=limited, price=model.penalty)


def candidates(n: int, seed: int) -> Real:
    """Return places of the unit box that are compared, (k, n); other ones for another seed."""
    if n == 1:
        return np.linspace(0.0, 1.0, 2 * CANDIDATES + 1)[:, None]
    places = quasi_random(n, CANDIDATES * n, seed)
    # A share of them on the faces: the best design often lies on one.
    faces = np.arange(0, len(places), 4)
    places[faces, faces // 4 % n] = (faces // 4 // n) % 2
    return np.asarray(places)


def promising(
    models: Sequence[Taylor], places: Real, enough: float, apart: float, most: int, *, above: bool = False,
    doubt: float = DOUBT,
) -> list[Real]:  # fmt: skip
    """Return the places where a number may be below (above) `enough`, the most promising first.

    Parameters
    ----------
    models : of the places looked at.
    places : (k, n) candidates.
    enough : the number to be beaten.
    apart : least distance, the largest over the coordinates, from what was looked at and from each other.
    most : how many.
    above : what is looked for is larger than `enough`.
    doubt : spreads by which a prediction may be too high.
    """
    known = np.array([model.place for model in models])
    far = np.abs(places[:, None, :] - known).max(axis=2)
    places = places[far.min(axis=1) >= apart]
    if not len(places):
        return []
    mean, spread = predicted(models, known, places)
    low = (-mean if above else mean) - doubt * spread
    chosen: list[Real] = []
    for i in np.argsort(low):
        if low[i] >= (-enough if above else enough) or len(chosen) >= most:
            break
        if all(np.abs(places[i] - other).max() >= apart for other in chosen):
            chosen.append(places[i])
    return chosen


def predicted(models: Sequence[Taylor], known: Real, places: Real) -> tuple[Real, Real]:
    """Return the mean of the predictions of the nearest models at (k, n) places, and their spread."""
    distance = np.linalg.norm(places[:, None, :] - known, axis=2)
    count = min(NEAREST * known.shape[1] + 2, len(models))
    nearest = np.argpartition(distance, count - 1, axis=1)[:, :count]
    weights = 1.0 / np.maximum(np.take_along_axis(distance, nearest, axis=1), 1e-9) ** (known.shape[1] + 2)
    weights /= weights.sum(axis=1, keepdims=True)
    predicted = np.zeros(nearest.shape)
    for j, model in enumerate(models):
        which = nearest == j
        rows = np.flatnonzero(which.any(axis=1))
        if rows.size:
            predicted[which] = model.at(places[rows])
    mean = (weights * predicted).sum(axis=1)
    return mean, np.sqrt((weights * (predicted - mean[:, None]) ** 2).sum(axis=1))
