"""The best of a catalogue: discrete options, such as dampers or materials, by enumeration with bounds.

Options are looked at one by one; what is left is a design in the continuous variables, or one evaluation.
What an option cannot fall below is known without a response where its mass is minimised: it is linear, so its
least over the bounds is at their ends. An option whose least weighted mass alone is no better than the best
design so far is cut off: it cannot be the best, as every other term of the objective is positive.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum
from typing import Annotated, Any

from optim.criteria.evaluation import evaluate, natural_scales
from optim.criteria.mass import MASS
from optim.errors import DesignError
from optim.methods.kkt import KEPT
from optim.problem.problem import Problem, pose
from optim.problem.variables import parameter_values
from optim.search import solve_problem
from solver.errors import at
from solver.results.told import Piece
from solver.results.watch import ShouldStop
from solver.scene.parameter_paths import AMPLITUDE
from solver.scene.scene import Scene


class OptionStatus(Enum):
    """What became of an option; the value is a sentence."""

    FEASIBLE = "It keeps all limits."
    INFEASIBLE = "No design of it keeps all limits."
    CUT = "Its mass alone is no better than the best design of another option."
    UNKNOWN = "No design of it could be computed: use more harmonics or a narrower band."
    STOPPED = "Stopped by the caller before it was looked at."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class CatalogueOption(Piece):
    """One option of a catalogue."""

    name: Annotated[str, "As it was given."]
    status: Annotated[OptionStatus, "What became of it."]
    objective: Annotated[float, "Of its best design; inf without one."]
    least: Annotated[float, "What its objective cannot fall below, by its mass alone."]
    values: Annotated[Mapping[str, float], "Variable to value of its best design; empty without variables."]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class CatalogueResult(Piece):
    """All options of a catalogue, best first; those cut off or without a design behind them."""

    options: Annotated[tuple[CatalogueOption, ...], "Best first."]
    seconds: Annotated[float, "Time taken [s]."]

    @property
    def best(self) -> CatalogueOption | None:
        """The best option that keeps all limits; None if there is none."""
        first = self.options[0]
        return first if first.status is OptionStatus.FEASIBLE else None


def catalogue(
    scene: Scene, options: Mapping[str, Mapping[str, float]], *, should_stop: ShouldStop = None,
    **problem: Any,
) -> CatalogueResult:  # fmt: skip
    """Find the best of several options, each with its best design.

    Parameters
    ----------
    scene : what is designed.
    options : name to values of parameter paths.
    should_stop : asked between responses and within them.
    problem : the keys of `design`. ``variables={}`` leaves nothing but the options to choose: each is
        evaluated once.

    Raises
    ------
    SettingError, SceneError, DesignError
        A bad option, or a bad key of the problem.
    """
    begun = time.perf_counter()
    if not options:
        raise DesignError("options", dict(options), "must have at least one name with values")
    posed = {name: _posed(scene, name, values, problem) for name, values in options.items()}
    bounds = {name: _least(each) for name, each in posed.items()}
    found: list[CatalogueOption] = []
    best = float("inf")
    for name in sorted(posed, key=lambda one: bounds[one]):
        if should_stop is not None and should_stop():
            status, objective, values = OptionStatus.STOPPED, float("inf"), dict[str, float]()
        elif bounds[name] >= best:
            status, objective, values = OptionStatus.CUT, float("inf"), {}
        else:
            status, objective, values = _searched(posed[name], should_stop)
        if status is OptionStatus.FEASIBLE:
            best = min(best, objective)
        found.append(
            CatalogueOption(name=name, status=status, objective=objective, least=bounds[name], values=values)
        )
    order = list(OptionStatus)
    found.sort(key=lambda one: (order.index(one.status), one.objective))
    return CatalogueResult(options=tuple(found), seconds=time.perf_counter() - begun)


def _posed(scene: Scene, name: str, values: Mapping[str, float], problem: Mapping[str, Any]) -> Problem:
    """Return the problem of one option; without variables one that has none."""
    with at("options", name):
        here = scene.with_values(values)
    if problem.get("variables") != {}:
        return pose(here, **problem)
    # What stands there is left out again.
    return replace(pose(here, **{**problem, "variables": {AMPLITUDE: (1.0, 2.0)}}), variables=())


def _least(problem: Problem) -> float:
    """Return what the objective cannot fall below: the least weighted mass over the bounds."""
    weight = problem.weights.get(MASS, 0.0)
    if weight == 0.0:
        return 0.0
    low = {one.name: one.low for one in problem.variables}
    lightest = problem.scene.with_values(parameter_values(problem.variables, low))
    return weight * sum(body.mass for body in lightest.bodies)


def _searched(
    problem: Problem, should_stop: ShouldStop
) -> tuple[OptionStatus, float, dict[str, float]]:  # fmt: skip
    """Return how an option ends, and its best design."""
    evaluation, values = None, dict[str, float]()
    if problem.variables:
        found = solve_problem(problem, should_stop=should_stop)
        evaluation, problem = found.evaluation, found.problem
    else:
        evaluation = evaluate(problem, {}, gradients=False, errors=False, should_stop=should_stop)
    if evaluation is None or not evaluation.good:
        return OptionStatus.UNKNOWN, float("inf"), values
    kept = evaluation.violation(natural_scales(problem)) <= KEPT
    status = OptionStatus.FEASIBLE if kept else OptionStatus.INFEASIBLE
    return status, evaluation.objective, dict(evaluation.values)
