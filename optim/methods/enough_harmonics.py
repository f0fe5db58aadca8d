"""By which measure, and with how many harmonics, the peak of a design is known well enough to call it best.

The measure is max|x|, or half peak to peak in all cases as soon as the mean of the peak of one is free:
max|x| then depends on the history, and a minimum of it is none. What is minimised is what the result is
judged by.
"""

from __future__ import annotations

from dataclasses import replace

from optim.criteria.evaluation import evaluate
from optim.criteria.rows import Evaluation
from optim.problem.problem import Method, Problem
from optim.results.design import DesignResult, DesignStatus
from optim.results.doubts import WELL_KNOWN, doubt_of
from optim.results.json import known_parts
from solver.results.known import HALF_PEAK_TO_PEAK
from solver.results.watch import ShouldStop
from solver.scene.scene import Scene

CLAIMS = (DesignStatus.OPTIMAL, DesignStatus.AT_BOUND, DesignStatus.APPROXIMATE)
MOST_HARMONICS = 60  # beyond that a design is not looked at with more
HOPELESS = 2.0  # times what is well known: doubts foretold above it are not looked at
_RUNGS = 4  # times the harmonics asked for, at most: more of them cost more than a search was asked to
_FEW = 12  # harmonics that a search may have though it was asked for fewer


def well_known(problem: Problem, evaluation: Evaluation) -> bool:
    """Return whether the highest peak of a design is known within 5 %."""
    return doubt_in(problem, evaluation) <= WELL_KNOWN


def doubt_in(problem: Problem, evaluation: Evaluation) -> float:
    """Return the share by which the highest peak of a design may be higher."""
    return doubt_of(evaluation, {case.name: case.weight for case in problem.cases})


def honest(result: DesignResult) -> DesignResult:
    """Return a result that claims an optimum only if its highest peak is known, by what was minimised."""
    result = result.with_errors()
    problem, evaluation = result.problem, result.evaluation
    if result.status not in CLAIMS or evaluation is None:
        return result
    if well_known(problem, evaluation) and _by_its_measure(problem, evaluation) is problem:
        return result
    return replace(result, status=DesignStatus.NOT_KNOWN)


def with_enough(result: DesignResult, should_stop: ShouldStop) -> tuple[Problem | None, list[Evaluation]]:
    """Return the problem to solve instead of one whose end is doubtful, and the evaluations that told so.

    A response or two at the optimum tell how many harmonics it needs, so that at most one search follows.

    Returns
    -------
    (problem, evaluations); None where measure and harmonics are right, or more harmonics do not help.
    """
    evaluation, tried = result.evaluation, list[Evaluation]()
    if result.status not in (*CLAIMS, DesignStatus.INFEASIBLE) or evaluation is None:
        return None, tried
    problem = _by_its_measure(result.problem, evaluation)
    measured = replace(problem, start=dict(result.optimum)) if problem is not result.problem else None
    if well_known(problem, evaluation):
        return measured, tried
    doubt, harmonics = doubt_in(problem, evaluation), 2 * problem.harmonics
    most = max(_RUNGS * problem.harmonics, _FEW)
    while harmonics <= min(most, MOST_HARMONICS) and not (should_stop is not None and should_stop()):
        more = replace(problem, harmonics=harmonics)
        found = evaluate(more, result.optimum, gradients=False, should_stop=should_stop)
        tried.append(found)
        if found.good and well_known(more, found):
            return replace(more, start=dict(result.optimum)), tried
        if found.good:
            # From one doubling to the next a doubt falls by the same factor, if it falls.
            left = doubt_in(more, found)
            if left * min(left / doubt, 1.0) > HOPELESS * WELL_KNOWN:
                break
            doubt = left
        harmonics *= 2
    return measured, tried


def _by_its_measure(problem: Problem, evaluation: Evaluation) -> Problem:
    """Return the problem with half peak to peak in all cases where the mean of the peak of one is free."""
    free = any(known.measure == HALF_PEAK_TO_PEAK for _, known in known_parts(evaluation))
    if not free or all(case.scene.observe.centred for case in problem.cases):
        return problem
    cases = tuple(replace(case, scene=_half_peak_to_peak(case.scene)) for case in problem.cases)
    method = Method.AUTO if problem.method is Method.TRACKED else problem.method
    return replace(problem, cases=cases, method=method)


def _half_peak_to_peak(scene: Scene) -> Scene:
    observe = scene.observe.model_copy(update={"measure": HALF_PEAK_TO_PEAK})
    return scene.model_copy(update={"observe": observe})
