"""The tracked peak as a method: one variable, the highest peak of one case, exact to 1e-8."""

from __future__ import annotations

import math
from collections.abc import Callable

from optim.criteria.constraint_rows import CaseResponse, DesignEvaluation
from optim.criteria.evaluation import Judge, effects_of, evaluate, ranges_of
from optim.criteria.peak_criterion import PEAK
from optim.methods.afterwards import of_one
from optim.problem.design_problem import Method, Problem
from optim.results.design_parts import PEAKS_OPEN, VERIFIED, BestSoFar, LocalOptimum, OnBest
from optim.results.design_result import DesignResult, DesignStatus
from solver.continuation.branch import Branch
from solver.jit.timer import clock
from solver.results.watch import OnProgress, ShouldStop
from solver.studies.peaks.minimise_peak import least_peak
from solver.studies.peaks.track_results import LeastPeak, TrackStatus

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
    begun = clock()
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
        evaluations=found.sweeps + int(extra), work=found.work + extra, seconds=clock() - begun,
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
    judge = Judge(problem=problem, case=case, gradients=True)
    rows = judge.rows(found.branch, ranges_of(problem, case)[0])
    response = CaseResponse(case=case.name, branch=found.branch)
    return DesignEvaluation(values={variable.name: found.at}, responses=(response,), rows=tuple(rows))
