"""The tracked peak as a method: one variable, the highest peak of one case, exact to 1e-8.

With limits or several cases the tracked optimum of each case without limits is begun from; where that of a
single case keeps all limits it is the optimum with them as well, and as well proven.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from optim.criteria.constraint_rows import CaseResponse, DesignEvaluation
from optim.criteria.evaluation import effects_of, evaluate, ranges_of, rows_of
from optim.criteria.peak_criterion import PEAK
from optim.methods.evaluator import DesignSearch, SearchStoppedError
from optim.methods.linearised import of_one
from optim.problem.design_problem import Method, Problem
from optim.results.design_result import (
    PEAKS_OPEN,
    VERIFIED,
    BestSoFar,
    DesignResult,
    DesignStatus,
    LocalOptimum,
    OnBest,
)
from solver.continuation.branch import Branch
from solver.results.watch import OnProgress, ShouldStop
from solver.studies.peaks.minimise_peak import least_peak
from solver.studies.peaks.track_results import LeastPeak, TrackStatus

MOST_CASES = 4
_OPTIMAL = (DesignStatus.OPTIMAL, DesignStatus.AT_BOUND)
_STATUS = {
    TrackStatus.TRACKED: DesignStatus.OPTIMAL,
    TrackStatus.AT_BOUND: DesignStatus.OPTIMAL,
    TrackStatus.PLATEAU: DesignStatus.OPTIMAL,
    TrackStatus.FLAT: DesignStatus.FLAT,
    TrackStatus.NO_RESPONSE: DesignStatus.NO_RESPONSE,
    TrackStatus.UNDAMPED: DesignStatus.NO_RESPONSE,  # `solve_problem` looks at what was tried
    TrackStatus.STOPPED: DesignStatus.STOPPED,
    TrackStatus.GAPS: DesignStatus.NOT_TRACKED,
    TrackStatus.UNPROVEN: DesignStatus.NOT_TRACKED,
    TrackStatus.OTHER_BRANCH: DesignStatus.NOT_TRACKED,
    TrackStatus.WORK_USED_UP: DesignStatus.NOT_TRACKED,
}


def tracked_optimum(
    problem: Problem,
    *,
    on_progress: OnProgress = None,
    should_stop: ShouldStop = None,
    on_best: OnBest = None,
) -> DesignResult:
    """Find the least highest peak by following the peaks over the variable; see `solver.least_peak`.

    Parameters
    ----------
    problem : one whose `why_not_tracked` is None.
    on_progress : called with (share done, frequency responses so far).
    should_stop : asked between sweeps.
    on_best : told of every response that is the lowest so far.
    """
    case, variable = problem.cases[0], problem.variables[0]
    first = None if problem.start is None else problem.start[variable.name]
    effects = effects_of(problem, case.scene)
    found = least_peak(
        case.scene, variable.paths[0], variable.low, variable.high, harmonics=problem.harmonics, first=first,
        basins=problem.basins, effects=effects, on_progress=on_progress, should_stop=should_stop,
        on_look=None if on_best is None else _Lowest(problem, on_best),
    )  # fmt: skip
    basins = tuple(
        LocalOptimum(
            values={variable.name: basin.at}, peak=basin.peak,
            objective=basin.peak * problem.weights[PEAK] * case.weight, settled=basin.solved,
            proven=basin.proven,
            feasible=True,
        )
        for basin in found.basins
    )  # fmt: skip
    evaluation = _evaluation(problem, found)
    extra = float(evaluation is not None and problem.limit is not None)
    return of_one(
        problem, Method.TRACKED, _STATUS[found.status], evaluation, basins=basins,
        evaluations=found.sweeps + int(extra), work=found.work + extra,
    )  # fmt: skip


class _Lowest:
    """Tells of the lowest of the responses that a tracked peak looks at."""

    def __init__(self, problem: Problem, on_best: Callable[[BestSoFar], None]) -> None:
        self._problem, self._on_best = problem, on_best
        self._least, self._looks = math.inf, 0

    def __call__(self, value: float, branch: Branch) -> None:
        """Hear of a response."""
        self._looks += 1
        if branch.peak is None or branch.peak.value >= self._least:
            return
        peak = self._least = branch.peak.value
        known = branch.peak_certificate.known
        self._on_best(
            BestSoFar(
                values={self._problem.variables[0].name: value}, peak=peak,
                objective=peak * self._problem.weights[PEAK] * self._problem.cases[0].weight, feasible=True,
                verified=known, words=VERIFIED if known else PEAKS_OPEN, evaluations=self._looks,
            )
        )  # fmt: skip


def _evaluation(problem: Problem, found: LeastPeak) -> DesignEvaluation | None:
    """Return the rows of the optimum, from the response that proves it where that has the limit asked for."""
    case, variable = problem.cases[0], problem.variables[0]
    if found.branch is None or not found.branch.reached:
        return None
    if problem.limit is not None:
        return evaluate(problem, {variable.name: found.at})
    rows = rows_of(problem, case, found.branch, ranges_of(problem, case)[0])
    response = CaseResponse(case=case.name, branch=found.branch)
    return DesignEvaluation(values={variable.name: found.at}, responses=(response,), rows=tuple(rows))


def tracked_starts(
    search: DesignSearch, plain: DesignResult | None
) -> tuple[list[dict[str, float]], DesignResult | None]:
    """Return designs to begin from: the one asked for, and the optima of single cases without limits.

    With them comes the optimum of a single case without limits, if it keeps them all. Tracking is counted by
    `search`. `plain`: what tracking the problem itself came to, where that was tried.
    """
    problem = search.problem
    starts = [] if problem.start is None else [dict(problem.start)]
    if problem.method is not Method.AUTO or len(problem.cases) > MOST_CASES:
        return starts, None
    singles = [
        replace(problem, cases=(case,), limits={}, start=None, limit=None)
        for case in problem.cases
        if problem.peak_alone
    ]
    for one in (single for single in singles if single.why_not_tracked is None):
        tracked = plain or tracked_optimum(one, on_progress=search.tracking, should_stop=search.should_stop)
        search.tracked(tracked.evaluations)
        starts += [dict(basin.values) for basin in tracked.basins]
        if len(problem.cases) == 1 and tracked.status in _OPTIMAL and starts:
            proven = _kept(search, tracked)
            if proven is not None:
                return starts, proven
    return starts, None


def _kept(search: DesignSearch, tracked: DesignResult) -> DesignResult | None:
    """Return the tracked optimum with the rows of its limits if it keeps them all."""
    if tracked.evaluation is None:
        return None
    try:
        evaluation = search(tracked.evaluation.values)
    except SearchStoppedError:
        return None
    if not evaluation.good or evaluation.violation(search.scales) > 0.0:
        return None
    responses = evaluation.computed
    return of_one(
        search.problem, Method.TRACKED, DesignStatus.OPTIMAL, evaluation, basins=tracked.basins,
        evaluations=tracked.evaluations + responses, work=tracked.work + responses,
    )  # fmt: skip
