"""With how many harmonics the peak of a design is known well enough to call the design the best."""

from __future__ import annotations

from dataclasses import replace

from optim.criteria.evaluation import evaluate
from optim.criteria.rows import Evaluation
from optim.problem.problem import Problem
from optim.results.design import DesignResult, DesignStatus
from optim.results.doubts import WELL_KNOWN, doubt_of
from solver.results.watch import ShouldStop

CLAIMS = (DesignStatus.OPTIMAL, DesignStatus.AT_BOUND, DesignStatus.APPROXIMATE)
MOST_HARMONICS = 60  # beyond that a design is not looked at with more
WORSE = 2.0  # times the doubt that twice the harmonics leave, from which still more do not mend it
_RUNGS = 4  # times the harmonics asked for, at most: more of them cost more than a search was asked to
_FEW = 12  # harmonics that a search may have though it was asked for fewer


def well_known(problem: Problem, evaluation: Evaluation) -> bool:
    """Return whether the highest peak of a design is known within 5 %."""
    return doubt_in(problem, evaluation) <= WELL_KNOWN


def doubt_in(problem: Problem, evaluation: Evaluation) -> float:
    """Return the share by which the highest peak of a design may be higher."""
    return doubt_of(evaluation, {case.name: case.weight for case in problem.cases})


def honest(result: DesignResult) -> DesignResult:
    """Return a result that claims an optimum only if its highest peak is known."""
    result = result.with_errors()
    claims = result.status in CLAIMS and result.evaluation is not None
    if claims and not well_known(result.problem, result.evaluation):  # type: ignore[arg-type]
        return replace(result, status=DesignStatus.NOT_KNOWN)
    return result


def with_enough(result: DesignResult, should_stop: ShouldStop) -> tuple[Problem | None, list[Evaluation]]:
    """Return the problem to solve instead of one whose end is doubtful, and the evaluations that told so.

    A response or two at the optimum tell how many harmonics it needs, so that at most one search follows.

    Returns
    -------
    (problem, evaluations); None where the harmonics are enough, or more of them do not help.
    """
    problem, evaluation, tried = result.problem, result.evaluation, list[Evaluation]()
    if (
        result.status not in (*CLAIMS, DesignStatus.INFEASIBLE)
        or evaluation is None
        or well_known(problem, evaluation)
    ):
        return None, tried
    doubt, harmonics = doubt_in(problem, evaluation), 2 * problem.harmonics
    most = max(_RUNGS * problem.harmonics, _FEW)
    while harmonics <= min(most, MOST_HARMONICS) and not (should_stop is not None and should_stop()):
        more = replace(problem, harmonics=harmonics)
        found = evaluate(more, result.optimum, gradients=False, should_stop=should_stop)
        tried.append(found)
        if found.good and well_known(more, found):
            return replace(more, start=dict(result.optimum)), tried
        if found.good and doubt_in(more, found) > WORSE * doubt:
            break
        harmonics *= 2
    return None, tried
