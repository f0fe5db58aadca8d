"""`design`: the best damper of a scene."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Unpack

import numpy as np

from optim.criteria.constraint_rows import DesignEvaluation
from optim.criteria.evaluation import evaluate
from optim.methods.afterwards import looked_after, settled_status
from optim.methods.eased import Eased
from optim.methods.enough_harmonics import (
    by_first_response,
    by_the_better_known,
    honest,
    mean_is_free,
    most_harmonics,
    well_known,
    with_enough,
)
from optim.methods.evaluator import DesignSearch, SearchStoppedError, Tally
from optim.methods.global_look import WholeRange
from optim.methods.kkt import FLAT_SLOPE, Local, LocalSearch
from optim.problem.design_problem import Method, Problem, pose
from optim.problem.problem_keys import OPTIONS, ROBUST, DesignKeys, keywords
from optim.problem.typed import Limit, with_limits
from optim.results.design_parts import SAME_PLACE, LocalOptimum, OnBest
from optim.results.design_result import DesignResult, DesignStatus
from solver.continuation.branch import BranchStatus
from solver.jit.timer import clock
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
    posed = pose(scene, **with_limits(problem, limits))
    return solve_problem(posed, on_progress=on_progress, should_stop=should_stop, on_best=on_best)


def solve_problem(
    problem: Problem,
    *,
    on_progress: OnProgress = None,
    should_stop: ShouldStop = None,
    on_best: OnBest = None,
) -> DesignResult:
    """Search the best design of a problem; see `design`."""
    tally = Tally(on_progress)
    measured, told = by_first_response(problem, should_stop)
    found = _solved(measured, tally.searching, should_stop, on_best, told=told)

    def by_max_abs() -> DesignResult:
        """Search by what was asked for, from what the other measure has seen."""
        seen = (*told, *found.looked_at, *found.history)
        asked = _solved(problem, tally.again(found.evaluations), should_stop, on_best, told=seen)
        return _counted(asked, found.evaluations)

    if measured is not problem and not _free_at_its_best(found):
        # The best design has a mean of its own, or there is none.
        measured, found = problem, by_max_abs()
    found = _counted(found, sum(one.computed for one in told))
    most = most_harmonics(problem.harmonics)
    found, more = _with_enough_harmonics(found, most, tally, should_stop, on_best)
    if measured is not problem and not _known_by(found):
        asked = by_max_abs()
        if asked.evaluation is not None and asked.status is not DesignStatus.STOPPED:
            found = by_the_better_known(asked.with_errors(), found)
    if problem.method is Method.PERFORMANCE_CURVE:
        return honest(found)  # it stands for no other design
    chosen = looked_after(found, should_stop, tally.further, more)
    if chosen.optimum != found.optimum:
        # What is chosen of a plateau may be known less well than what was found on it.
        found, more = _with_enough_harmonics(chosen, most, tally, should_stop, on_best)
        again = found.problem is not chosen.problem
        chosen = looked_after(found, should_stop, tally.further, more) if again else found
    found = honest(chosen)
    if found.status is DesignStatus.NO_RESPONSE and _undamped(found, should_stop):
        found = replace(found, status=DesignStatus.UNDAMPED)
    if found.evaluation is not None:
        tally.tell(1.0)
    return found


def _free_at_its_best(found: DesignResult) -> bool:
    """Return whether the mean is free at what a search by half peak to peak has found, or it was stopped."""
    if found.status is DesignStatus.STOPPED:
        return True
    return found.evaluation is not None and mean_is_free(found.evaluation)


def _known_by(found: DesignResult) -> bool:
    """Return whether a design is known by its measure, has none to know, or its search was stopped."""
    if found.evaluation is None or found.status is DesignStatus.STOPPED:
        return True
    return well_known(found.problem, found.evaluation)


def _counted(found: DesignResult, responses: int) -> DesignResult:
    """Return a result with the responses computed before it."""
    return replace(found, evaluations=found.evaluations + responses, work=found.work + responses)


def _undamped(found: DesignResult, should_stop: ShouldStop) -> bool:
    """Return whether responses end at a resonance without damping: of designs tried, or amid the range."""
    problem = found.problem
    middle = {variable.name: variable.outside(0.5) for variable in problem.variables}
    tried = found.history or (evaluate(problem, middle, gradients=False, should_stop=should_stop),)
    ends = {response.branch.status for one in tried for response in one.responses}
    return BranchStatus.UNDAMPED in ends


def _with_enough_harmonics(
    found: DesignResult, most: int, tally: Tally, should_stop: ShouldStop, on_best: OnBest
) -> tuple[DesignResult, list[DesignEvaluation]]:
    """Search again, by the right measure and with more harmonics, as long as the optimum asks for them.

    Each search begins from what the one before has seen. With the result come the evaluations of optima
    with more harmonics.
    """
    found = found.with_errors()
    problem, tried = with_enough(found, most, should_stop)
    responses = sum(one.computed for one in tried)
    found = _counted(found, responses)
    if problem is None:
        return found, tried
    same = problem.cases is found.problem.cases
    told = tuple(one for one in tried if one.harmonics == problem.harmonics)  # its responses serve again
    seen = replace(found, history=(*found.history, *told))
    again = _solved(problem, tally.again(found.evaluations), should_stop, on_best, seen)
    if again.status is DesignStatus.STOPPED:
        return replace(found, status=DesignStatus.STOPPED), tried
    if again.evaluation is None or not again.evaluation.good:
        return found, tried
    again = replace(
        again, evaluations=again.evaluations + found.evaluations, work=again.work + found.work,
        seconds=again.seconds + found.seconds,
    )  # fmt: skip
    again, more = _with_enough_harmonics(again, most, tally, should_stop, on_best)
    return again if same else by_the_better_known(found, again), [*tried, *more]


def _solved(
    problem: Problem, on_progress: OnProgress, should_stop: ShouldStop, on_best: OnBest,
    before: DesignResult | None = None, told: Sequence[DesignEvaluation] = (),
) -> DesignResult:  # fmt: skip
    """Search the best design of a problem by its method.

    `before`: of a search before with less known; `told`: designs whose responses serve again.
    """
    if problem.method is Method.PERFORMANCE_CURVE:
        from optim.methods.performance_curve import curve_optimum

        return curve_optimum(problem, on_progress=on_progress, should_stop=should_stop)
    begun = clock()
    tracked = None
    trackable = problem.method in (Method.AUTO, Method.TRACKED) and problem.why_not_tracked is None
    if trackable:
        from optim.methods.peak_tracking import tracked_optimum

        tracked = tracked_optimum(problem, on_progress=on_progress, should_stop=should_stop, on_best=on_best)
        if problem.method is Method.TRACKED or tracked.status is not DesignStatus.NOT_TRACKED:
            return tracked
    earlier = told if before is None else (*before.looked_at, *before.history)
    search = DesignSearch(problem, on_progress, should_stop, on_best=on_best, before=earlier)
    eased = Eased.of(search, tracked)
    if eased.proven is not None:
        return replace(eased.proven, seconds=clock() - begun)
    found: list[Local] = []
    if before is not None and before.problem.cases is not problem.cases:
        before = None  # by another measure nothing is known but responses
    seen = () if before is None else before.looked_at
    whole = WholeRange(search, local_search_of(problem.method), found, seen)
    others = () if before is None else [dict(basin.values) for basin in before.basins[1:]]
    try:
        status = _search(whole, found, [*eased.starts, *others])
    except SearchStoppedError as stop:
        status = stop.status
        if status is DesignStatus.TOO_MANY and found:
            status = DesignStatus.LOCAL
    return _result(search, whole, status, begun)


def _search(whole: WholeRange, found: list[Local], starts: Sequence[Mapping[str, float]]) -> DesignStatus:
    """Look at the whole range and search locally from the best of it."""
    flat = whole.run(starts)
    if flat is None:
        return DesignStatus.NO_RESPONSE
    if flat:
        return DesignStatus.FLAT
    return judge(min(found, key=lambda local: local.standing), finished=whole.finished)


def local_search_of(method: Method) -> LocalSearch:
    """Return the local search of a method; CasADi and CVXPY are loaded when they are needed."""
    if method is Method.IPOPT:
        from optim.methods.ipopt import ipopt_search

        return ipopt_search
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
    if not best.settled:
        return DesignStatus.KINK
    return settled_status(best.conditions)


def basins_of(search: DesignSearch, found: list[Local]) -> tuple[LocalOptimum, ...]:
    """Return the local optima that differ, best first."""
    basins: list[LocalOptimum] = []
    places: list[list[float]] = []
    level: list[float] = []  # what is minimised where it does not change: one plateau is one optimum
    for local in sorted(found, key=lambda local: local.standing):
        z = [variable.inside(local.evaluation.values[variable.name]) for variable in search.variables]
        if any(math.dist(z, other) <= SAME_PLACE for other in places):
            continue
        height = local.evaluation.objective
        if _is_level(search, local):
            if any(abs(height - other) <= SAME_HEIGHT * abs(height) for other in level):
                continue
            level.append(height)
        places.append(z)
        basins.append(local.optimum)
    return tuple(basins)


def _is_level(search: DesignSearch, local: Local) -> bool:
    """Return whether what is minimised does not change near an end."""
    model = search.model(local.evaluation)
    held = model.heights >= model.heights.max(initial=0.0) * (1.0 - SAME_HEIGHT)
    return bool(np.all(np.abs(model.slopes[held]) <= FLAT_SLOPE))


def _result(search: DesignSearch, whole: WholeRange, status: DesignStatus, begun: float) -> DesignResult:
    """Put the result together; after a stop the best design so far stands in it."""
    best = min(whole.found, key=lambda local: local.standing, default=None)
    evaluation = best.evaluation if best else min(search.good(), key=search.merit, default=None)
    method = Method.IPOPT if search.problem.method is Method.IPOPT else Method.MINIMAX
    responses = search.scouted + sum(e.computed for e in search.history)
    return DesignResult(
        problem=search.problem, method=method, status=status, evaluation=evaluation,
        conditions=None if best is None else best.conditions, basins=basins_of(search, whole.found),
        looked_at=whole.looked_at, history=tuple(search.history), evaluations=responses,
        work=float(responses), seconds=clock() - begun,
    )  # fmt: skip
