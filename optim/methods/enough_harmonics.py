"""By which measure, and with how many harmonics, the peak of a design is known well enough to call it best.

The measure is max|x|, or half peak to peak in all cases as soon as the mean of the peak of one is free:
max|x| then depends on the history, and a minimum of it is none. What is minimised is what the result is
judged by.
"""

from __future__ import annotations

from dataclasses import replace

from optim.criteria.constraint_rows import DesignEvaluation
from optim.criteria.evaluation import evaluate
from optim.problem.design_problem import Method, Problem
from optim.results.design_result import DesignResult, DesignStatus
from optim.results.doubts import WELL_KNOWN, doubt_of
from solver.balance.balance import build
from solver.balance.kernels.output import HALF_RANGE, MAX_ABS
from solver.balance.workspace import Workspace
from solver.continuation.branch import Branch
from solver.continuation.extrema.error_estimate import ErrorEstimator
from solver.linear.condensation import loose_ports
from solver.response.solution import MEAN_UNDETERMINED
from solver.results.known import HALF_PEAK_TO_PEAK, Known
from solver.results.watch import ShouldStop
from solver.studies.peaks.peak_lines import fitted

CLAIMS = (DesignStatus.OPTIMAL, DesignStatus.AT_BOUND, DesignStatus.APPROXIMATE)
MOST_HARMONICS = 60  # beyond that a design is not looked at with more
HOPELESS = 2.0  # times what is well known: doubts foretold above it are not looked at
_RUNGS = 4  # times the harmonics asked for, at most: more of them cost more than a search was asked to
NO_MEAN = 1e-6  # share by which max|x| is above half peak to peak where there is no mean
_AMID = (0.5, 0.75, 0.25)  # shares of the range where the first response is looked for
_FEW = 24  # harmonics that a search may have though it was asked for fewer


def well_known(problem: Problem, evaluation: DesignEvaluation) -> bool:
    """Return whether the highest peak of a design is known within 5 %."""
    return doubt_in(problem, evaluation) <= WELL_KNOWN


def doubt_in(problem: Problem, evaluation: DesignEvaluation) -> float:
    """Return the share by which the highest peak of a design may be higher."""
    parts = [(case, _sized(b)) for case, b in evaluation.over_bands.items() if b.peak is not None]
    return doubt_of(parts, {case.name: case.weight for case in problem.cases})


def _sized(branch: Branch) -> Known:
    """Return `Branch.known` as far as measure, value and error.

    Where half peak to peak is observed these do not depend on what else the balance has at the peak, of
    which a search takes longer than the response where contacts alone hold a part.
    """
    if branch.peak is None or not branch.balance.scene.observe.centred:
        return branch.known
    return Known(
        measure=HALF_PEAK_TO_PEAK, peak_half_peak_to_peak=branch.peak.value,
        half_peak_to_peak_error=branch.error_estimate,
    )  # fmt: skip


def _doubt_at_peaks(problem: Problem, evaluation: DesignEvaluation) -> float:
    """Return that share with the harmonics of a problem, by the peaks of a response with fewer.

    Each is solved for where it stands, without a response: no less is left in doubt of one. 0 where that
    finds nothing.
    """
    parts = []
    for case, branch in evaluation.over_bands.items():
        peak = branch.peaks[0]
        balance = build(
            branch.balance.scene, "frequency", harmonics=problem.harmonics, frequency_hz=None,
            effects=branch.balance.effects,
        )  # fmt: skip
        workspace, p = Workspace.of(balance), balance.parameter.inside(peak.at)
        there = workspace.solve_from(p, fitted(peak.solution, branch.balance.system.ks, balance))
        measures = workspace.measure(there.u, p) if there.converged else None
        if measures is None:
            return 0.0
        error = ErrorEstimator(workspace).at(there.u, p, across=peak.interior)
        known = replace(
            _sized(branch), peak_max_abs=float(measures.values[MAX_ABS]), error_estimate=error.max_abs,
            peak_half_peak_to_peak=float(measures.values[HALF_RANGE]),
            half_peak_to_peak_error=error.half_peak_to_peak,
        )  # fmt: skip
        parts.append((case, known))
    return doubt_of(parts, {case.name: case.weight for case in problem.cases})


def only_if_known(result: DesignResult) -> DesignResult:
    """Return a result that claims an optimum only if its highest peak and what limits it are known."""
    result = result.with_errors()
    problem, evaluation = result.problem, result.evaluation
    if result.status not in CLAIMS or evaluation is None:
        return result
    known = well_known(problem, evaluation) and not evaluation.open
    if known and _by_its_measure(problem, evaluation) is problem:
        return result
    return replace(result, status=DesignStatus.NOT_KNOWN)


def most_harmonics(asked: int) -> int:
    """Return how many harmonics a search may have that was asked for some."""
    return min(max(_RUNGS * asked, _FEW), MOST_HARMONICS)


def with_enough(
    result: DesignResult, most: int, should_stop: ShouldStop
) -> tuple[Problem | None, list[DesignEvaluation]]:
    """Return the problem to solve instead of one whose end is doubtful, and the evaluations that told so.

    A response or two at the optimum tell how many harmonics it needs, up to `most`.

    Returns
    -------
    (problem, evaluations); None where measure and harmonics are right, or more harmonics do not help.
    """
    evaluation, tried = result.evaluation, list[DesignEvaluation]()
    if result.status not in (*CLAIMS, DesignStatus.INFEASIBLE) or evaluation is None:
        return None, tried
    problem, start = result.problem, dict(result.optimum)
    measured = _by_its_measure(problem, evaluation)
    otherwise = None if measured is problem else replace(measured, start=start)
    if well_known(problem, evaluation):
        return otherwise, tried
    doubt, harmonics = doubt_in(problem, evaluation), 2 * problem.harmonics
    last = evaluation
    while harmonics <= most and not (should_stop is not None and should_stop()):
        more = replace(problem, harmonics=harmonics)
        left = _doubt_at_peaks(more, last) if tried else 0.0
        if left <= WELL_KNOWN:
            found = evaluate(more, start, gradients=False, should_stop=should_stop, before=last)
            tried.append(found)
            if found.good and well_known(more, found):
                # With too few harmonics a mean may seem free that is not.
                return replace(_by_its_measure(more, found), start=start), tried
            if otherwise is not None and found.good and _by_its_measure(more, found) is not more:
                # A mean that is free with twice the harmonics is free: by the right measure the optimum may
                # lie elsewhere, and it is that one whose harmonics count.
                return otherwise, tried
            last, left = (found, doubt_in(more, found)) if found.good else (last, doubt)
        # From one doubling to the next a doubt falls by the same factor, if it falls; not among the first
        # harmonics, of which one may meet a resonance that those before it do not.
        if 2 * harmonics > _FEW and left * min(left / doubt, 1.0) > HOPELESS * WELL_KNOWN:
            break
        doubt, harmonics = left, 2 * harmonics
    return otherwise, tried


def by_first_response(
    problem: Problem, should_stop: ShouldStop
) -> tuple[Problem, tuple[DesignEvaluation, ...]]:
    """Return the problem by the measure that a response amid the range asks for, and what was looked at.

    Where contacts alone hold a part its mean is free at nearly every design: what a search by max|x| finds
    would be searched for again by half peak to peak. Elsewhere no response is computed.
    """
    floats = any(loose_ports(case.scene)[0].size for case in problem.cases)
    if not floats or problem.keeps_measure or problem.method not in (Method.AUTO, Method.MINIMAX):
        return problem, ()
    starts = [{one.name: one.outside(share) for one in problem.variables} for share in _AMID]
    tried = list[DesignEvaluation]()
    for start in starts if problem.start is None else [dict(problem.start), *starts]:
        found = evaluate(problem, start, gradients=False, errors=False, should_stop=should_stop)
        tried.append(found)
        if found.good:
            return _by_its_measure(problem, found), tuple(tried)
    return problem, tuple(tried)


def mean_is_free(evaluation: DesignEvaluation) -> bool:
    """Return whether the mean of the peak of a design is free and not zero, in one of its cases."""
    return any(
        MEAN_UNDETERMINED in known.flags
        and not known.peak_max_abs <= known.peak_half_peak_to_peak * (1.0 + NO_MEAN)
        for _, known in evaluation.known_parts
    )


def by_the_better_known(before: DesignResult, after: DesignResult) -> DesignResult:
    """Return the result after a change of measure, or before it where max|x| alone is known well enough."""
    old, new = before.evaluation, after.evaluation
    if old is None or (new is not None and well_known(after.problem, new)):
        return after
    parts = [known for _, known in old.known_parts]
    if not all(max(known.relative, known.relative_max_abs) <= WELL_KNOWN for known in parts):
        return after
    return replace(before, problem=replace(before.problem, keeps_measure=True))


def _by_its_measure(problem: Problem, evaluation: DesignEvaluation) -> Problem:
    """Return the problem with half peak to peak in all cases where the mean of the peak of one is free.

    Where the peak has no mean both measures are the same, and the problem stays as it is.
    """
    if problem.keeps_measure or all(case.scene.observe.centred for case in problem.cases):
        return problem
    parts = [known for _, known in evaluation.known_parts if known.measure == HALF_PEAK_TO_PEAK]
    if all(known.peak_max_abs <= known.value * (1.0 + NO_MEAN) for known in parts):
        return problem
    measured = {"measure": HALF_PEAK_TO_PEAK}
    scenes = [
        case.scene.model_copy(update={"observe": case.scene.observe.model_copy(update=measured)})
        for case in problem.cases
    ]
    cases = tuple(replace(case, scene=scene) for case, scene in zip(problem.cases, scenes, strict=True))
    method = Method.AUTO if problem.method is Method.TRACKED else problem.method
    return replace(problem, cases=cases, method=method)
