"""`design`: the best damper of a scene, found in stages (`STAGES`)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Unpack

import numpy as np

from optim.criteria.constraint_rows import DesignEvaluation
from optim.criteria.evaluation import evaluate
from optim.methods.enough_harmonics import (
    by_first_response,
    by_the_better_known,
    mean_is_free,
    most_harmonics,
    only_if_known,
    well_known,
    with_enough,
)
from optim.methods.evaluator import DesignSearch, SearchStoppedError, Tally
from optim.methods.global_search import GlobalSearch
from optim.methods.linearised import FLAT_SLOPE, Local, LocalSearch, settled_status
from optim.methods.plateau import with_plateau
from optim.problem.design_problem import Limit, Method, Problem, pose
from optim.problem.problem_keys import OPTIONS, ROBUST, DesignKeys, keywords
from optim.results.design_result import SAME_PLACE, DesignResult, DesignStatus, LocalOptimum, OnBest
from solver.continuation.branch import BranchStatus
from solver.jit.timer import clock
from solver.lab import from_lab
from solver.results.watch import OnProgress, ShouldStop, shows_progress
from solver.scene.scene import Scene

if TYPE_CHECKING:
    from optim.problem.keyword_types import DesignKeywords

SAME_HEIGHT = 1e-9  # relative, of two levels that are one


@shows_progress("design")
@keywords(DesignKeys, without=(OPTIONS, *ROBUST))
def design(
    scene: Scene,
    *,
    limits: Sequence[Limit] = (),
    on_progress: OnProgress = None,
    should_stop: ShouldStop = None,
    on_best: OnBest = None,
    **problem: Unpack[DesignKeywords],
) -> DesignResult:
    """Choose parameters within bounds so that the highest peak over the scene's band is least.

    Parameters
    ----------
    scene : the scene; `observe` says which DOF and which band.
    limits : bounds with types, in place of the keys `max_peak` and its like.
    on_progress : called with (share done, evaluations so far).
    should_stop : asked between responses and within them.
    on_best : called with every design that is better than those before, while the search goes on.
    **problem : the keys of a problem.

    Returns
    -------
    The best design with everything tried on the way; look at its status.

    Raises
    ------
    SettingError, SceneError, DesignError
        Bad paths, bounds, cases, limits or start.
    TypeError
        An argument that is no key.
    """
    posed = pose(scene, limits, **problem)
    return solve_problem(posed, on_progress=on_progress, should_stop=should_stop, on_best=on_best)


def solve_problem(
    problem: Problem,
    *,
    on_progress: OnProgress = None,
    should_stop: ShouldStop = None,
    on_best: OnBest = None,
) -> DesignResult:
    """Search the best design of a problem, stage by stage; see `design`."""
    begun = clock()
    nothing = DesignResult(
        problem=problem, method=problem.method, status=DesignStatus.NO_RESPONSE, evaluation=None,
        conditions=None, basins=(), history=(), evaluations=0, work=0.0,
    )  # fmt: skip
    seen = Seen(
        asked=problem, tally=Tally(on_progress), should_stop=should_stop, on_best=on_best, found=nothing
    )
    for stage in STAGES:
        problem, seen = stage(problem, seen)
    if seen.found.evaluation is not None:
        seen.tally.tell(1.0)
    return replace(seen.found, seconds=clock() - begun)


@dataclass(frozen=True, slots=True, kw_only=True)
class Seen:
    """What the stages before have seen, and who hears of it."""

    asked: Annotated[Problem, "As it was asked."]
    tally: Annotated[Tally, "Counts what all stages look at."]
    should_stop: ShouldStop
    on_best: OnBest
    found: Annotated[DesignResult, "The best so far, with every design looked at and what that cost."]
    guess: Annotated[
        tuple[DesignEvaluation, ...], "The response that asks for another measure, until that is settled."
    ] = ()
    more: Annotated[tuple[DesignEvaluation, ...], "Optima with more harmonics than those searched with."] = ()
    moved: Annotated[bool, "Whether the harmonics of the present optimum are still to be judged."] = True
    level: Annotated[Problem | None, "By which the optimum was last looked at for its plateau."] = None


Stage = Callable[[Problem, Seen], tuple[Problem, Seen]]


def first_look(problem: Problem, seen: Seen) -> tuple[Problem, Seen]:
    """Look at a response amid the range: by which measure is the problem to be solved?"""
    measured, told = by_first_response(problem, seen.should_stop)
    cost = sum(one.computed for one in told)
    found = replace(seen.found, history=told, evaluations=cost, work=float(cost))
    return measured, replace(seen, found=found, guess=told if measured is not problem else ())


def search(problem: Problem, seen: Seen) -> tuple[Problem, Seen]:
    """Search by the method; by the measure asked for where the mean of the best is not free, or none is."""
    found = _searched(problem, seen.found, seen)
    free = found.evaluation is not None and mean_is_free(found.evaluation)
    if seen.guess and not free and found.status is not DesignStatus.STOPPED:
        return seen.asked, replace(seen, found=_as_asked(found, seen), guess=())
    return problem, replace(seen, found=found)


def enough_harmonics(problem: Problem, seen: Seen) -> tuple[Problem, Seen]:
    """Search again, by the right measure and with more harmonics, as long as the optimum asks for them.

    Each search begins from what the one before has seen.
    """
    if not seen.moved:
        return problem, seen
    found, before, more = seen.found.with_errors(), None, list[DesignEvaluation]()
    while True:
        better, tried = with_enough(found, most_harmonics(seen.asked.harmonics), seen.should_stop)
        more += tried
        cost = sum(one.computed for one in tried)
        found = replace(found, evaluations=found.evaluations + cost, work=found.work + cost)
        if better is None:
            break
        told = (one for one in tried if one.harmonics == better.harmonics)  # its responses serve again
        again = _searched(better, replace(found, history=(*found.history, *told)), seen)
        if again.status is DesignStatus.STOPPED:
            found = replace(found, status=DesignStatus.STOPPED)
            break
        if again.evaluation is None or not again.evaluation.good:
            break
        before = found if better.cases is not found.problem.cases else before
        found = again.with_errors()
    if before is not None:  # the measure is another one
        found = by_the_better_known(before, found)
    end = found.evaluation
    # Where the mean of the end is free a minimum of max|x| is none, however well it were known.
    if seen.guess and end is not None and not (_known(found) or mean_is_free(end)):
        asked = _as_asked(found, seen)
        if asked.evaluation is not None and asked.status is not DesignStatus.STOPPED:
            found = by_the_better_known(asked.with_errors(), found)
    return found.problem, replace(seen, found=found, more=tuple(more), guess=(), moved=False)


def plateau(problem: Problem, seen: Seen) -> tuple[Problem, Seen]:
    """Look how far other designs are as good, choose among them, and check optima with more harmonics."""
    if problem is seen.level or problem.method is Method.PERFORMANCE_CURVE:  # a curve stands for one design
        return problem, seen
    found = with_plateau(seen.found, seen.should_stop, seen.tally.further, seen.more)
    # What is chosen of a plateau may be known less well than what was found on it.
    moved = found.optimum != seen.found.optimum
    return problem, replace(seen, found=found, moved=moved, level=problem)


def doubts(problem: Problem, seen: Seen) -> tuple[Problem, Seen]:
    """Claim an optimum only of what is known, and say where nothing damps."""
    found = only_if_known(seen.found)
    followed = problem.method is Method.PERFORMANCE_CURVE
    if found.status is DesignStatus.NO_RESPONSE and not followed and _undamped(found, seen.should_stop):
        found = replace(found, status=DesignStatus.UNDAMPED)
    return problem, replace(seen, found=found)


STAGES: tuple[Stage, ...] = (
    first_look,  # by which measure to search
    search,  # the best design by the method
    enough_harmonics,  # the best by the right measure, with the harmonics that it needs
    plateau,  # how far others are as good, and which of them is chosen
    enough_harmonics,  # where another one was chosen
    plateau,  # where that one needed another measure or more harmonics
    doubts,  # what may be claimed of it
)
"""How a design is found: each stage takes the problem and what the ones before have seen, and adds to it."""


def _known(found: DesignResult) -> bool:
    """Return whether a design is known by its measure, has none to know, or its search was stopped."""
    if found.evaluation is None or found.status is DesignStatus.STOPPED:
        return True
    return well_known(found.problem, found.evaluation)


def _undamped(found: DesignResult, should_stop: ShouldStop) -> bool:
    """Return whether responses end at a resonance without damping: of designs tried, or amid the range."""
    problem = found.problem
    middle = {variable.name: variable.outside(0.5) for variable in problem.variables}
    tried = found.history or (evaluate(problem, middle, gradients=False, should_stop=should_stop),)
    ends = {response.branch.status for one in tried for response in one.responses}
    return BranchStatus.UNDAMPED in ends


def _as_asked(found: DesignResult, seen: Seen) -> DesignResult:
    """Return the end of a search by the measure asked for, from what another one has seen."""
    history = (*seen.guess, *found.looked_at, *found.history)
    return _searched(seen.asked, replace(found, looked_at=(), history=history), seen)


def _searched(problem: Problem, before: DesignResult, seen: Seen) -> DesignResult:
    """Return the end of a search from what the one before has seen, which is counted in."""
    found = _by_method(problem, before, seen)
    return replace(found, evaluations=found.evaluations + before.evaluations, work=found.work + before.work)


def _by_method(problem: Problem, before: DesignResult, seen: Seen) -> DesignResult:
    """Return the best design by the method of a problem, which is loaded when it is needed."""
    on_progress, should_stop = seen.tally.after(before.evaluations), seen.should_stop
    if problem.method is Method.PERFORMANCE_CURVE:
        from optim.methods.performance_curve import curve_optimum

        return curve_optimum(problem, on_progress=on_progress, should_stop=should_stop)
    from optim.methods.peak_tracking import tracked_optimum, tracked_starts

    tracked = None
    if problem.method in (Method.AUTO, Method.TRACKED) and problem.why_not_tracked is None:
        tracked = tracked_optimum(
            problem, on_progress=on_progress, should_stop=should_stop, on_best=seen.on_best
        )
        if problem.method is Method.TRACKED or tracked.status is not DesignStatus.NOT_TRACKED:
            return tracked
    known = (*before.looked_at, *before.history)
    evaluator = DesignSearch(problem, on_progress, should_stop, on_best=seen.on_best, before=known)
    starts, proven = tracked_starts(evaluator, tracked)
    if proven is not None:
        return proven
    same = before.problem.cases is problem.cases  # by another measure nothing is known but responses
    whole = GlobalSearch(evaluator, local_search_of(problem.method), before.looked_at if same else ())
    try:
        status = whole.run([*starts, *(dict(basin.values) for basin in before.basins[1:] if same)])
        status = status or judge(min(whole.found, key=lambda end: end.standing), finished=whole.finished)
    except SearchStoppedError as stop:
        status = stop.status
        if status is DesignStatus.TOO_MANY and whole.found:
            status = DesignStatus.LOCAL
    return _result(evaluator, whole, status)


def local_search_of(method: Method) -> LocalSearch:
    """Return the local search of a method."""
    if method is Method.IPOPT:
        found: LocalSearch = from_lab("ipopt.ipopt_search:ipopt_search")
        return found
    from optim.methods.minimax import thorough_search

    return thorough_search


def judge(best: Local, *, finished: bool = True) -> DesignStatus:
    """Return how a search ended from the best end of its local searches.

    Parameters
    ----------
    finished : whether the look over the whole range came to its end without a better design.
    """
    if not finished:
        return DesignStatus.LOCAL
    if not best.feasible:
        return DesignStatus.INFEASIBLE
    return settled_status(best.conditions) if best.settled else DesignStatus.KINK


def _result(evaluator: DesignSearch, whole: GlobalSearch, status: DesignStatus) -> DesignResult:
    """Put the result together; after a stop the best design so far stands in it."""
    best = min(whole.found, key=lambda local: local.standing, default=None)
    good = min(evaluator.good(), key=evaluator.merit, default=None)
    responses = evaluator.scouted + sum(e.computed for e in evaluator.history)
    return DesignResult(
        problem=evaluator.problem,
        method=Method.IPOPT if evaluator.problem.method is Method.IPOPT else Method.MINIMAX, status=status,
        evaluation=best.evaluation if best else good, conditions=best.conditions if best else None,
        basins=_basins(evaluator, whole.found), looked_at=whole.looked_at, history=tuple(evaluator.history),
        evaluations=responses, work=float(responses),
    )  # fmt: skip


def _basins(evaluator: DesignSearch, found: list[Local]) -> tuple[LocalOptimum, ...]:
    """Return the local optima that differ, best first."""
    basins: list[LocalOptimum] = []
    places: list[list[float]] = []
    level: list[float] = []  # what is minimised where it does not change: one plateau is one optimum
    for local in sorted(found, key=lambda local: local.standing):
        z = [variable.inside(local.evaluation.values[variable.name]) for variable in evaluator.variables]
        if any(math.dist(z, other) <= SAME_PLACE for other in places):
            continue
        height = local.evaluation.objective
        model = evaluator.model(local.evaluation)
        held = model.heights >= model.heights.max(initial=0.0) * (1.0 - SAME_HEIGHT)
        if np.all(np.abs(model.slopes[held]) <= FLAT_SLOPE):
            if any(abs(height - other) <= SAME_HEIGHT * abs(height) for other in level):
                continue
            level.append(height)
        places.append(z)
        basins.append(local.optimum)
    return tuple(basins)
