"""Evaluations of a robust search: every design in every scenario once, counted, and stopped when asked."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache, partial

import cvxpy
import numpy as np

from optim.criteria.evaluation import natural_scales
from optim.criteria.linearised import Model
from optim.criteria.rows import DesignEvaluation
from optim.methods.conic import Index, Numbers, Programme, Step, duals_of, padded
from optim.methods.evaluator import SearchStoppedError
from optim.methods.kkt import Local
from optim.methods.minimax import REMEMBERED, minimax_search
from optim.problem.problem import Problem
from optim.problem.uncertainty_set import Scenario, UncertainSet
from optim.problem.variables import BoundedVariable, Real
from optim.problem.words import Aim
from optim.results.design import DesignStatus
from optim.results.parts import NOMINAL, BestSoFar, OnBest
from optim.robust.scenarios import Outcome, aim_model, known_in, outcome, together
from optim.robust.worst_case import Asking, Aspect
from solver.results.known import Known
from solver.results.spread import Ahead

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
    """The second-order cone programme for n variables, so many rows in each group, so many limited rows.

        minimise   Σ t_g + w + penalty · s
        subject to aᵢ + gᵢᵀ d ≤ t_g(i)             every competing row i of every scenario, in groups g
                   bⱼ + hⱼᵀ d ≤ s, s ≥ least       every limited row j, as relative excess over its bound
                   ‖(√2 R d, w − 1)‖ ≤ w + 1       that is ½ |R d|² ≤ w
                   ‖d‖ ≤ 1                         trust region
                   low ≤ d ≤ high                  bounds

    d is the step in scaled variables, in units of the radius, and rows are in the units of
    `optim.methods.conic`; RᵀR is the convex part of the Hessian of the Lagrangian. With the many scenarios of
    a mean every scenario is a group of its own; the number of rows in a group is padded, so that a problem is
    compiled once for each shape and kept for the whole process.
    """

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


MOST_RESPONSES = 20_000
USUAL = 200.0  # responses of a usual search; what is left is not known beforehand
EUCLIDEAN = 2.0
OVER = {
    Aim.WORST_CASE: "Its peak is the highest of the {count} scenarios so far; others may be worse.",
    Aim.MEAN: "Best by the mean of {count} samples; its peak is the highest of them.",
    Aim.QUANTILE: "Best by the quantile of {count} samples; its peak is the highest of them.",
}

Key = tuple[tuple[float, ...], Scenario, bool, int]  # the last one: harmonics


class RobustSearch:
    """A problem over its uncertainty; keeps every outcome."""

    def __init__(
        self, problem: Problem, uncertain: UncertainSet, aim: Aim, quantile: float,
        on_progress: Callable[[float, int], None] | None = None,
        should_stop: Callable[[], bool] | None = None, on_best: OnBest = None,
    ) -> None:  # fmt: skip
        self.problem, self.uncertain, self.aim, self.quantile = problem, uncertain, aim, quantile
        self.scales = natural_scales(problem)
        self.responses = 0
        self._on_progress, self._should_stop = on_progress, should_stop
        self._outcomes: dict[Key, Outcome] = {}
        self._ahead: Ahead[Key, Outcome] = Ahead(should_stop)
        self._on_best = on_best
        self._known: tuple[tuple[int, int], tuple[float, float]] | None = (
            None  # over what, standing of the best
        )
        self._scale: float | None = None

    @property
    def variables(self) -> tuple[BoundedVariable, ...]:
        """What may be chosen."""
        return self.problem.variables

    @property
    def designs(self) -> int:
        """Designs tried."""
        return len({key[0] for key in self._outcomes})

    @property
    def scale(self) -> float:
        """The objective that counts as 1: that of the first design."""
        return self._scale or 1.0

    def outcome(self, values: Mapping[str, float], scenario: Scenario, *, gradients: bool = True) -> Outcome:
        """Return a design in a scenario.

        Raises
        ------
        StoppedError
            The caller asked to stop, or the responses are used up.
        """
        key = self._key(values, scenario, gradients)
        if (known := self._known_outcome(key)) is not None:
            return known
        if self._should_stop is not None and self._should_stop():
            raise SearchStoppedError(DesignStatus.STOPPED)
        if self.responses >= MOST_RESPONSES:
            raise SearchStoppedError(DesignStatus.TOO_MANY)
        found = self._ahead.take(key) or outcome(
            self.problem, values, scenario, gradients=gradients, should_stop=self._should_stop
        )
        if not found.good and self._should_stop is not None and self._should_stop():
            raise SearchStoppedError(DesignStatus.STOPPED)
        self._outcomes[key] = found
        self.count(found.responses)
        return found

    def ahead(self, asked: Iterable[tuple[Mapping[str, float], Scenario]], *, gradients: bool = True) -> None:
        """Compute designs in scenarios that will be asked for, where there are others to do so."""
        calls = {self._key(values, scenario, gradients): (values, scenario) for values, scenario in asked}
        unknown = {key: call for key, call in calls.items() if self._known_outcome(key) is None}
        self._ahead.compute(partial(outcome, self.problem, gradients=gradients), unknown)

    def asking(self, values: Mapping[str, float]) -> Asking:
        """Return what asks for a design in scenarios."""
        return Asking(
            lambda scenario: self.outcome(values, scenario),
            lambda scenarios: self.ahead((values, scenario) for scenario in scenarios),
        )

    def _key(self, values: Mapping[str, float], scenario: Scenario, gradients: bool) -> Key:
        place = tuple(values[variable.name] for variable in self.variables)
        return place, scenario, gradients, self.problem.harmonics

    def _known_outcome(self, key: Key) -> Outcome | None:
        place, scenario, _, harmonics = key
        with_slopes = self._outcomes.get((place, scenario, True, harmonics))
        return with_slopes or self._outcomes.get(key)

    def known(self, values: Mapping[str, float], scenario: Scenario) -> Known:
        """Return how well the highest peak of a design in a scenario is known."""
        found = known_in(self.problem, values, scenario, self._should_stop)
        self.count(len(self.problem.cases))
        return found

    def count(self, responses: int) -> None:
        """Count responses and report them."""
        self.responses += responses
        if self._on_progress is not None:
            self._on_progress(self.responses / (self.responses + USUAL), self.responses)

    def evaluation(self, values: Mapping[str, float], scenarios: Sequence[Scenario]) -> DesignEvaluation:
        """Return a design over several scenarios."""
        found: list[Outcome] = []
        self.ahead((values, scenario) for scenario in scenarios)
        for scenario in scenarios:
            found.append(self.outcome(values, scenario))
            if not found[-1].good:
                break
        evaluation = together(values, found)
        if self._scale is None and evaluation.good:
            self._scale = evaluation.objective or 1.0
        return evaluation

    def model(self, evaluation: DesignEvaluation, count: int) -> Model:
        """Return the model of a good evaluation over `count` scenarios."""
        return aim_model(self.aim, self.quantile, count, self.variables, self.scale, self.scales)(evaluation)

    def improve(self, values: Mapping[str, float], scenarios: Sequence[Scenario]) -> Local | None:
        """Return the end of the master problem's search from a design; None if that can not be evaluated."""
        begin = self.evaluation(values, scenarios)
        if not begin.good:
            return None
        found = self._searched(begin, scenarios, 0)
        # Cuts help at kinks, but with many scenarios a row bent over a long step passes for one of its own;
        # rows of scenarios that a quantile leaves out must not come back as cuts at all.
        if not found.settled and self.aim is not Aim.QUANTILE:
            again = self._searched(found.evaluation, scenarios, REMEMBERED)
            found = min(found, again, key=lambda local: (local.standing, not local.settled))
        self._tell(found, len(scenarios))
        return found

    def nominal(self, best: BestSoFar) -> None:
        """Hear of the search without the uncertainty."""
        if self._on_best is not None:
            self._on_best(replace(best, verified=False, words=NOMINAL))

    def _tell(self, local: Local, scenarios: int) -> None:
        """Tell of a design that is better over the same scenarios, or is the first over more of them."""
        if self._on_best is None or not local.evaluation.good:
            return
        over = scenarios, self.problem.harmonics
        if self._known is not None and self._known[0] == over and self._known[1] <= local.standing:
            return
        self._known = over, local.standing
        peaks = local.evaluation.peaks
        self._on_best(
            BestSoFar(
                values=dict(local.evaluation.values), peak=peaks[0].value if peaks else math.nan,
                objective=self.objective(local, scenarios), feasible=local.feasible, verified=False,
                words=OVER[self.aim].format(count=scenarios), evaluations=self.designs,
            )
        )  # fmt: skip

    def _searched(self, begin: DesignEvaluation, scenarios: Sequence[Scenario], remembered: int) -> Local:
        """Return the end of the minimax search over scenarios that keeps so many designs' rows as cuts."""
        return minimax_search(
            lambda there: self.evaluation(there, scenarios), self.variables, begin,
            lambda evaluation: self.model(evaluation, len(scenarios)), solve=solve_cone, norm=EUCLIDEAN,
            remembered=remembered,
        )  # fmt: skip

    def objective(self, local: Local, count: int) -> float:
        """Return what was minimised at a design over `count` scenarios, in its own unit."""
        return self.model(local.evaluation, count).objective * self.scale

    def aspects(self) -> tuple[Aspect, ...]:
        """Return every number whose worst case counts: what is minimised first, then what is limited."""
        minimised = [
            Aspect(quantity=quantity, limited=False)
            for quantity, weight in self.problem.weights.items()
            if weight > 0.0
        ]
        return (
            *minimised,
            *(Aspect(quantity=q, limited=True, unit=self.scales[q]) for q in self.problem.limits.read),
        )
