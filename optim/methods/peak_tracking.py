"""The tracked peak as a method: one variable, the highest peak of one case, exact to 1e-8."""

from __future__ import annotations

from dataclasses import dataclass

from optim.criteria.evaluation import Judge, effects_of, evaluate, ranges_of
from optim.criteria.peak import PEAK
from optim.criteria.rows import Evaluation, Response
from optim.problem.problem import Problem
from optim.results.basins import Basin
from optim.results.design import DesignStatus
from solver.results.watch import OnProgress, ShouldStop
from solver.studies.peaks.minimise_peak import least_peak
from solver.studies.peaks.results import LeastPeak, TrackStatus

_STATUS = {
    TrackStatus.TRACKED: DesignStatus.OPTIMAL,
    TrackStatus.AT_BOUND: DesignStatus.OPTIMAL,
    TrackStatus.PLATEAU: DesignStatus.OPTIMAL,
    TrackStatus.FLAT: DesignStatus.FLAT,
    TrackStatus.NO_RESPONSE: DesignStatus.NO_RESPONSE,
    TrackStatus.STOPPED: DesignStatus.STOPPED,
    TrackStatus.GAPS: DesignStatus.NOT_TRACKED,
    TrackStatus.UNPROVEN: DesignStatus.NOT_TRACKED,
    TrackStatus.OTHER_BRANCH: DesignStatus.NOT_TRACKED,
    TrackStatus.WORK_USED_UP: DesignStatus.NOT_TRACKED,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Tracked:
    """What the tracked peak found.

    Attributes
    ----------
    status : DesignStatus
        How it ended.
    evaluation : Evaluation or None
        The optimum, or the best seen.
    basins : tuple of Basin
        The local minima met, best first.
    sweeps : int
        Frequency responses computed.
    work : float
        Everything, in frequency responses.
    """

    status: DesignStatus
    evaluation: Evaluation | None
    basins: tuple[Basin, ...]
    sweeps: int
    work: float


def tracked_optimum(
    problem: Problem, *, on_progress: OnProgress = None, should_stop: ShouldStop = None
) -> Tracked:
    """Find the least highest peak by following the peaks over the variable; see `solver.least_peak`.

    Parameters
    ----------
    problem : one whose `why_not_tracked` is None.
    on_progress : called with (share done, frequency responses so far).
    should_stop : asked between sweeps.
    """
    case, variable = problem.cases[0], problem.variables[0]
    first = None if problem.start is None else problem.start[variable.name]
    effects = effects_of(problem, case.scene)
    found = least_peak(
        case.scene, variable.paths[0], variable.low, variable.high, harmonics=problem.harmonics, first=first,
        basins=problem.basins, effects=effects, on_progress=on_progress, should_stop=should_stop,
    )  # fmt: skip
    basins = tuple(
        Basin(
            values={variable.name: basin.at}, peak=basin.peak,
            objective=basin.peak * problem.weights[PEAK] * case.weight, settled=basin.solved,
            proven=basin.proven,
            feasible=True,
        )
        for basin in found.basins
    )  # fmt: skip
    evaluation = _evaluation(problem, found)
    extra = float(evaluation is not None and problem.limit is not None)
    return Tracked(
        status=_STATUS[found.status],
        evaluation=evaluation,
        basins=basins,
        sweeps=found.sweeps + int(extra),
        work=found.work + extra,
    )


def _evaluation(problem: Problem, found: LeastPeak) -> Evaluation | None:
    """Return the rows of the optimum, from the response that proves it where that has the limit asked for."""
    case, variable = problem.cases[0], problem.variables[0]
    if found.branch is None or not found.branch.completed:
        return None
    if problem.limit is not None:
        return evaluate(problem, {variable.name: found.at})
    judge = Judge(problem=problem, case=case, gradients=True)
    rows = judge.rows(found.branch, ranges_of(problem, case)[0])
    response = Response(case=case.name, branch=found.branch)
    return Evaluation(values={variable.name: found.at}, responses=(response,), rows=tuple(rows))
