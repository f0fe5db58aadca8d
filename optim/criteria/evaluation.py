"""Evaluating a design: the responses of all its cases and the rows they give, with gradients."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from optim.criteria.constraint_rows import CaseResponse, DesignEvaluation
from optim.criteria.criterion import Criterion, CriterionRow, Judged, criteria
from optim.criteria.peak_criterion import PEAK
from optim.problem.cases import LoadCase
from optim.problem.design_problem import Problem
from optim.problem.variables import parameter_values
from solver.balance.balance import build
from solver.balance.simplifications import Effects
from solver.continuation.branch import Branch
from solver.continuation.branches.observation import observing
from solver.continuation.branches.sweep import LOST_FROM_HERE, sweep
from solver.continuation.stretches import Course
from solver.continuation.walk import ContinuationSettings
from solver.results.watch import ShouldStop
from solver.scene.scene import Scene
from solver.scene.scene_harmonics import even_harmonics_reason
from solver.studies.peaks.peak_lines import fitted

# A usual response has 80 to 800 points, and no criterion looks at peaks below this share of the highest.
SETTINGS = ContinuationSettings(most_points=4000, unfinished_peaks=False, competes=0.5)


def evaluate(
    problem: Problem, values: Mapping[str, float], *, gradients: bool = True, errors: bool = True,
    should_stop: ShouldStop = None, before: DesignEvaluation | None = None, most: float = math.inf,
) -> DesignEvaluation:  # fmt: skip
    """Compute everything a design is judged by.

    Parameters
    ----------
    problem : what is judged.
    values : the design, variable name to value.
    gradients : compute them (otherwise they are NaN).
    errors : look for low peaks too, and estimate errors; `DesignEvaluation.with_errors` does it later if not.
    should_stop : asked while the responses are computed.
    before : the same design by another measure, whose responses serve here, or with other harmonics, whose
        responses begin where these do.
    most : of what is minimised; a design that comes to more is looked at no further.

    Returns
    -------
    The evaluation; without rows if a response does not cover its range, for whatever reason.
    """
    responses: list[CaseResponse] = []
    rows: list[CriterionRow] = []
    for case in problem.cases:
        known = [response.branch for response in responses if response.case == case.served_by]
        earlier = [] if before is None else [one.branch for one in before.responses if one.case == case.name]
        highest = most / max(problem.weights[PEAK] * case.weight, 1e-300)
        settings = replace(SETTINGS, errors=errors, highest=highest)
        settings = replace(settings, competes=0.0) if errors else settings
        found = _case(problem, case, values, known, earlier, gradients, settings, should_stop)
        responses += found[0]
        rows += found[1]
        if not all(response.branch.reached for response in found[0]):
            return DesignEvaluation(values=dict(values), responses=tuple(responses), rows=())
    return DesignEvaluation(values=dict(values), responses=tuple(responses), rows=tuple(rows))


def _case(
    problem: Problem, case: LoadCase, values: Mapping[str, float], known: Sequence[Branch],
    earlier: Sequence[Branch], gradients: bool, settings: ContinuationSettings, should_stop: ShouldStop,
) -> tuple[list[CaseResponse], list[CriterionRow]]:  # fmt: skip
    """Compute the responses and rows of one case."""
    here = case.scene.with_values(parameter_values(problem.variables, values))
    effects = effects_of(problem, here)
    responses: list[CaseResponse] = []
    rows: list[CriterionRow] = []
    for i, over in enumerate(ranges_of(problem, case)):
        there = known[i] if known else earlier[i] if i < len(earlier) else None
        shared = there is not None and there.balance.n_harmonics == problem.harmonics
        if there is not None and shared:
            branch = there
            if there.reached:
                branch = observing(
                    there, here.observe.dof, measure=here.observe.measure, limit=problem.limit,
                    errors=settings.errors,
                )  # fmt: skip
        else:
            ends = over.hertz or here.observe.band
            for start, stop in (ends, ends[::-1]):  # without a beginning `sweep` goes to the other end itself
                branch = sweep(
                    here, start=start, stop=stop, harmonics=problem.harmonics, limit=problem.limit,
                    settings=settings, effects=effects, should_stop=should_stop,
                    course=None if there is None else _begin(problem, here, effects, there, stop < start),
                )  # fmt: skip
                if there is None or branch.status not in LOST_FROM_HERE:
                    break
        responses.append(CaseResponse(case=case.name, branch=branch, shared=shared))
        rows += rows_of(problem, case, branch, over, gradients=gradients)
    return responses, rows


def _begin(problem: Problem, scene: Scene, effects: Effects, branch: Branch, down: bool) -> Course | None:
    """Return where a response begins, by that of the same design with other harmonics."""
    if not len(branch.solutions):
        return None
    balance = build(scene, "frequency", harmonics=problem.harmonics, frequency_hz=None, effects=effects)
    nearest = 0 if (branch.values[0] <= branch.values[-1]) != down else -1
    return Course(guess=fitted(branch.solutions[nearest, :-1], branch.balance.system.ks, balance))


def effects_of(problem: Problem, scene: Scene) -> Effects:
    """Return what has to be computed for the slopes: those by a load's variation need the even harmonics."""
    return Effects(even_harmonics=even_harmonics_reason(scene, problem.paths) is not None)


class Range(NamedTuple):
    """A response that is judged: its frequencies [Hz], None for the band, and what it is judged by."""

    hertz: tuple[float, float] | None
    criteria: tuple[Criterion, ...]


def ranges_of(problem: Problem, case: LoadCase) -> tuple[Range, ...]:
    """Return what responses a case needs: that over the band first, then those beyond it."""
    every, limits = criteria(), problem.limits
    of_band = [
        one
        for one in every
        if one.ranges is None
        and (one.always or problem.weights.get(one, 0.0) > 0.0 or limits.get(one) is not None)
    ]
    beyond = [
        Range(hertz, (one,))
        for one in every
        if one.ranges is not None and limits.get(one) is not None
        for hertz in one.ranges(limits.get(one), case)
    ]
    return (Range(None, tuple(of_band)), *beyond)


def rows_of(
    problem: Problem, case: LoadCase, branch: Branch, over: Range, *, gradients: bool = True
) -> list[CriterionRow]:
    """Return the rows of a response over a range; none unless it covers it and has a peak.

    Parameters
    ----------
    gradients : compute them (otherwise they are NaN).
    """
    if not branch.reached or not branch.peaks:
        return []
    judged = Judged(problem=problem, case=case, branch=branch, gradients=gradients, hertz=over.hertz)
    return [row for criterion in over.criteria for row in criterion.rows(judged)]
