"""The best of a catalogue: discrete options, such as dampers or materials, by enumeration with bounds.

Options are looked at one by one; what is left is a design in the continuous variables, or one evaluation.
What an option cannot fall below is known without a response where its mass is minimised: it is linear, so its
least over the bounds is at their ends. An option whose least weighted mass alone is no better than the best
design so far is cut off: it cannot be the best, as every other term of the objective is positive.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any

from optim.criteria.evaluation import evaluate
from optim.criteria.mass import MASS
from optim.problem.checks import DesignError
from optim.methods.linearised import KEPT
from optim.problem.cases import refuse_displaced
from optim.problem.design_problem import Problem, pose
from optim.problem.variables import NOTHING, parameter_values
from optim.problem.checks import Method
from optim.results.design_result import DesignResult, DesignStatus
from optim.results.design_result import CatalogueOption, OptionStatus
from optim.search import solve_problem
from solver.errors import Place, at
from solver.jit.timer import clock
from solver.results.told import Piece
from solver.results.watch import OnProgress, ShouldStop
from solver.scene.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class CatalogueResult(Piece):
    """All options of a catalogue, best first; those cut off or without a design behind them."""

    options: Annotated[tuple[CatalogueOption, ...], "Best first."]
    design: Annotated[
        DesignResult, "The first of them as a design, the values of the option among those of its optimum."
    ]
    seconds: Annotated[float, "Time taken [s]."]

    @property
    def best(self) -> CatalogueOption | None:
        """The best option that keeps all limits; None if there is none."""
        first = self.options[0]
        return first if first.status is OptionStatus.FEASIBLE else None


def catalogue(
    scene: Scene, options: Mapping[str, Mapping[str, float]], *, on_progress: OnProgress = None,
    should_stop: ShouldStop = None, **problem: Any,
) -> CatalogueResult:  # fmt: skip
    """Find the best of several options, each with its best design.

    Parameters
    ----------
    scene : what is designed.
    options : name to values of parameter paths.
    on_progress : called with (share done, responses of the option so far).
    should_stop : asked between responses and within them.
    problem : the keys of `design`. ``variables={}`` leaves nothing but the options to choose: each is
        evaluated once.

    Raises
    ------
    SettingError, SceneError, DesignError
        A bad option, or a bad key of the problem.
    """
    begun = clock()
    posed = check_options(scene, options, problem)
    bounds = {name: _least(each) for name, each in posed.items()}
    found: list[tuple[CatalogueOption, DesignResult | None]] = []
    best = float("inf")
    for count, name in enumerate(sorted(posed, key=lambda one: bounds[one])):
        design, status = None, OptionStatus.STOPPED
        if bounds[name] >= best:
            status = OptionStatus.CUT
        elif not found or should_stop is None or not should_stop():
            design = _searched(posed[name], _share(on_progress, count, len(posed)), should_stop)
            status = _status(design)
        option = _option(name, status, design, bounds[name])
        if status is OptionStatus.FEASIBLE:
            best = min(best, option.objective)
        found.append((option, design))
    order = list(OptionStatus)
    found.sort(key=lambda pair: (order.index(pair[0].status), pair[0].objective))
    ranked = tuple(option for option, _ in found)
    first = next((o, design) for o, design in found if design is not None)
    effort = [design for _, design in found if design is not None]
    whole = replace(
        _with_option(first[1], options[first[0].name]), options=ranked,
        evaluations=sum(one.evaluations for one in effort), work=sum(one.work for one in effort),
        seconds=clock() - begun,
    )  # fmt: skip
    if any(option.status is OptionStatus.STOPPED for option in ranked):
        whole = replace(whole, status=DesignStatus.STOPPED)
    return CatalogueResult(options=ranked, design=whole, seconds=whole.seconds)


def check_options(
    scene: Scene, options: Mapping[str, Mapping[str, float]], problem: Mapping[str, Any]
) -> dict[str, Problem]:
    """Return the problem of each option.

    Raises
    ------
    SettingError, SceneError, DesignError
        A bad option, or a bad key of the problem.
    """
    if not options:
        raise DesignError("options", dict(options), "must have at least one name with values")
    posed: dict[str, Problem] = {}
    for name, values in options.items():
        with at("options", name):
            here = scene.with_values(values)
        posed[name] = pose(here, **with_variables(problem))
        if problem.get("variables") == {}:
            posed[name] = replace(posed[name], variables=())
        where: Place = ("options", name)
        for variable in posed[name].variables:
            refuse_displaced(here, values, variable.paths, (variable.low, variable.high), where)
        for case in posed[name].cases:
            for path, value in case.own.items():
                refuse_displaced(here, values, (path,), (value,), where, f"is set by the case {case.name}")
    return posed


def with_variables(problem: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keys of a problem with a variable that stands for none where ``variables`` is empty."""
    return dict(problem) | ({"variables": NOTHING} if problem.get("variables") == {} else {})


def _share(on_progress: OnProgress, count: int, of: int) -> OnProgress:
    """Return what hears of the progress of one option among several."""
    if on_progress is None:
        return None
    return lambda share, done: on_progress((count + share) / of, done)


def _with_option(design: DesignResult, option: Mapping[str, float]) -> DesignResult:
    """Return a design whose values are those of its option too."""
    told = {
        id(one): replace(one, values={**option, **one.values})
        for one in (*design.history, *([design.evaluation] if design.evaluation else []))
    }
    evaluation = None if design.evaluation is None else told[id(design.evaluation)]
    return replace(design, evaluation=evaluation, history=tuple(told[id(one)] for one in design.history))


def _least(problem: Problem) -> float:
    """Return what the objective cannot fall below: the least weighted mass over the bounds."""
    weight = problem.weights.get(MASS, 0.0)
    if weight == 0.0:
        return 0.0
    low = {one.name: one.low for one in problem.variables}
    lightest = problem.scene.with_values(parameter_values(problem.variables, low))
    return weight * sum(body.mass for body in lightest.bodies)


def _searched(problem: Problem, on_progress: OnProgress, should_stop: ShouldStop) -> DesignResult:
    """Return the best design of an option; of one without variables its only one."""
    if problem.variables:
        return solve_problem(problem, on_progress=on_progress, should_stop=should_stop)
    begun = clock()
    only = evaluate(problem, {}, gradients=False, should_stop=should_stop)
    stopped = not only.good and should_stop is not None and should_stop()
    kept = only.good and only.violation(problem.scales) <= KEPT
    status = DesignStatus.OPTIMAL if kept else DesignStatus.INFEASIBLE
    if not only.good:
        status = DesignStatus.STOPPED if stopped else DesignStatus.NO_RESPONSE
    return DesignResult(
        problem=problem, method=Method.AUTO, status=status, evaluation=only if only.good else None,
        conditions=None, basins=(), history=(only,), evaluations=only.computed, work=float(only.computed),
        seconds=clock() - begun,
    )  # fmt: skip


def _status(found: DesignResult) -> OptionStatus:
    """Return what became of an option that was searched."""
    if found.evaluation is None or not found.evaluation.good:
        return OptionStatus.STOPPED if found.status is DesignStatus.STOPPED else OptionStatus.UNKNOWN
    kept = found.evaluation.violation(found.problem.scales) <= KEPT
    return OptionStatus.FEASIBLE if kept else OptionStatus.INFEASIBLE


def _option(name: str, status: OptionStatus, design: DesignResult | None, least: float) -> CatalogueOption:
    """Return an option as it is told."""
    only = None if design is None else design.evaluation
    return CatalogueOption(
        name=name, status=status, least=least,
        objective=float("inf") if only is None else only.objective_told,
        values={} if only is None else dict(only.values),
    )  # fmt: skip
