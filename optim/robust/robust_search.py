"""Evaluations of a robust search: every design in every scenario once, counted, and stopped when asked."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from optim.criteria.constraint_rows import DesignEvaluation
from optim.methods.evaluator import SearchStoppedError
from optim.methods.linearised import KEPT, Local, Model, of_limits
from optim.methods.minimax import REMEMBERED, minimax_search
from optim.problem.checks import Aim
from optim.problem.design_problem import Problem
from optim.problem.uncertainty_set import Scenario, UncertainSet
from optim.problem.variables import BoundedVariable
from optim.results.design_result import NOMINAL, BestSoFar, DesignStatus, OnBest
from optim.robust.scenarios import Outcome, aim_model, known_in, outcome, together
from optim.robust.worst_case import Aspect, Finding, pessimise
from solver.results.known import Known
from solver.results.spread import Ahead

MOST_RESPONSES = 20_000
USUAL = 200.0  # responses of a usual search; what is left is not known beforehand
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
        self.scales = problem.scales
        self.responses = 0
        self._on_progress, self._should_stop = on_progress, should_stop
        self._outcomes: dict[Key, Outcome] = {}
        self._ahead: Ahead[Key, Outcome] = Ahead(should_stop)
        self._on_best = on_best
        self._known: tuple[tuple[int, int], tuple[float, float]] | None = (
            None  # over what, standing of the best
        )
        self._scale = 0.0

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
        """The objective that counts as 1: that of the first design whose objective is not 0."""
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

    def pessimise(
        self, values: Mapping[str, float], aspect: Aspect, known: Sequence[Scenario], **more: Any
    ) -> Finding:  # fmt: skip
        """Return the worst scenario of a design in one aspect; see `optim.robust.worst_case.pessimise`."""
        return pessimise(
            partial(self.outcome, values), self.uncertain, aspect, known,
            ahead=lambda scenarios: self.ahead((values, scenario) for scenario in scenarios), **more,
        )  # fmt: skip

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
        if not self._scale and evaluation.good:
            self._scale = evaluation.objective
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
        if not found.feasible:
            # What is minimised may lead out of limits that can be kept, to an end that breaks them.
            kept = self._searched(begin, scenarios, 0, of=of_limits, enough=1.0 + KEPT).evaluation
            if self.model(kept, len(scenarios)).violation <= KEPT:
                found = self._searched(kept, scenarios, 0, strict=True)
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

    def _searched(
        self, begin: DesignEvaluation, scenarios: Sequence[Scenario], remembered: int,
        of: Callable[[Model], Model] = lambda model: model, **more: Any,
    ) -> Local:  # fmt: skip
        """Return the end of the minimax search over scenarios that keeps so many designs' rows as cuts."""
        return minimax_search(
            lambda there: self.evaluation(there, scenarios), self.variables, begin,
            lambda evaluation: of(self.model(evaluation, len(scenarios))), ball=True, remembered=remembered,
            **more,
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
            *(Aspect(quantity=q, limited=True, unit=self.scales[q]) for q in self.problem.limits),
        )
