"""What is looked at once a search has ended: the plateau of its optimum, whether harmonics were enough."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from optim.criteria.constraint_rows import DesignEvaluation
from optim.criteria.evaluation import evaluate, natural_scales
from optim.criteria.linearised import Conditions, conditions, model_of
from optim.methods.enough_harmonics import MOST_HARMONICS
from optim.methods.evaluator import DesignSearch, SearchStoppedError
from optim.methods.kkt import KEPT, KKT_TOLERANCE, optimum_at
from optim.methods.plateau import DesignPlateau, Tick, nothing, plateau_of
from optim.problem.design_problem import Method, Problem
from optim.results.design_parts import Checked, LocalOptimum
from optim.results.design_result import DesignResult, DesignStatus
from optim.results.doubts import DOUBTFUL, open_peaks
from optim.results.json import known_parts
from solver.jit.timer import clock
from solver.results.watch import ShouldStop

HELD = 1e-7  # multiplier of a bound, relative objective per scaled variable, from which it holds the design
MOST_CHECKED = 4
MOST_AGAIN = 3  # times that a plateau leads to a better design


def settled_status(found: Conditions) -> DesignStatus:
    """Return whether a settled design is held by the bound of a variable."""
    held = any(multiplier > HELD for _, _, multiplier in found.bounds)
    return DesignStatus.AT_BOUND if held else DesignStatus.OPTIMAL


def of_one(
    problem: Problem, method: Method, status: DesignStatus, evaluation: DesignEvaluation | None, **more: Any
) -> DesignResult:  # fmt: skip
    """Return the result of a method without a local search; its optimum is judged like that of any."""
    found = None
    if evaluation is not None and evaluation.good:
        model = model_of(evaluation, problem.variables, evaluation.objective, natural_scales(problem))
        found = conditions(model, problem.variables)
        status = settled_status(found) if status is DesignStatus.OPTIMAL else status
    history = () if evaluation is None else (evaluation,)
    return DesignResult(
        problem=problem, method=method, status=status, evaluation=evaluation, conditions=found,
        history=history, **more,
    )  # fmt: skip


def looked_after(
    result: DesignResult, should_stop: ShouldStop, tick: Tick = nothing, more: Sequence[DesignEvaluation] = ()
) -> DesignResult:
    """Return a result with its plateau and its check by more harmonics; as far as the caller lets it.

    Parameters
    ----------
    result : of a search.
    should_stop : asked between responses.
    tick : called after every design looked at.
    more : evaluations with more harmonics that are known already.
    """
    begun = clock()
    found = result
    stopped = result.status in (DesignStatus.STOPPED, DesignStatus.NO_RESPONSE)
    if result.evaluation is not None and result.evaluation.good and not stopped:
        try:
            found = _checked(_level(found, should_stop, tick).with_errors(), should_stop, tick, more)
        except SearchStoppedError:
            found = replace(found, status=DesignStatus.STOPPED)
    return replace(_proven(found), seconds=result.seconds + clock() - begun)


def _proven(result: DesignResult) -> DesignResult:
    """Return a result that claims an optimum only if no higher peak may hide in the responses of it."""
    claims = result.status in (DesignStatus.OPTIMAL, DesignStatus.AT_BOUND)
    if claims and result.evaluation is not None and open_peaks(result.evaluation):
        return replace(result, status=DesignStatus.LOCAL)
    return result


def _level(
    result: DesignResult, should_stop: ShouldStop, tick: Tick, again: int = MOST_AGAIN
) -> DesignResult:
    """Return a result with the plateau its optimum lies on, at the design chosen of it."""
    if result.evaluation is None:
        return result
    if result.status is DesignStatus.FLAT:
        return replace(result, plateau={v.name: (v.low, v.high) for v in result.problem.variables})
    plateau = plateau_of(result.problem, result.evaluation, should_stop, tick)
    if plateau is None:
        return result
    if plateau.better is not None:
        improved = _improved(result, plateau.better, should_stop, tick)
        return _level(improved, should_stop, tick, again - 1) if again > 0 else improved
    evaluation = plateau.evaluation
    status: DesignStatus = result.status
    model = model_of(
        evaluation, result.problem.variables, evaluation.objective, natural_scales(result.problem)
    )
    found = conditions(model, result.problem.variables, feasibility=model.violation > KEPT)
    if status in (DesignStatus.OPTIMAL, DesignStatus.AT_BOUND, DesignStatus.KINK):
        settled = found.residual <= KKT_TOLERANCE
        status = settled_status(found) if settled else status
    history = result.history if evaluation is result.evaluation else (*result.history, evaluation)
    if evaluation is not result.evaluation and len(result.history) == 1:
        history = (evaluation,)
    return replace(
        result, status=status, evaluation=evaluation, conditions=found, history=history,
        basins=_merged(result, plateau), plateau=plateau.intervals, chosen_by=plateau.chosen_by,
        evaluations=result.evaluations + plateau.responses, work=result.work + plateau.responses,
    )  # fmt: skip


def _improved(
    result: DesignResult, begin: DesignEvaluation, should_stop: ShouldStop, tick: Tick
) -> DesignResult:
    """Return a result after a local search from a better design that was met beside a plateau."""
    from optim.methods.minimax import thorough_search

    search = DesignSearch(result.problem, lambda _share, _count: tick(), should_stop)
    search.keep(begin)
    local = thorough_search(search, search.variables, begin, search.model)
    status = result.status
    if status in (DesignStatus.OPTIMAL, DesignStatus.AT_BOUND, DesignStatus.KINK):
        status = settled_status(local.conditions) if local.settled else DesignStatus.KINK
    responses = sum(one.computed for one in search.history)
    return replace(
        result, method=Method.MINIMAX, status=status, evaluation=local.evaluation,
        conditions=local.conditions,
        basins=(local.optimum, *result.basins), history=(*result.history, *search.history),
        evaluations=result.evaluations + responses, work=result.work + responses,
    )  # fmt: skip


def _merged(result: DesignResult, plateau: DesignPlateau) -> tuple[LocalOptimum, ...]:
    """Return the local optima with those of one plateau as one, at the design chosen."""
    chosen = plateau.evaluation
    first = optimum_at(chosen, settled=True, feasible=all(basin.feasible for basin in result.basins[:1]))
    others = [
        basin
        for basin in result.basins[1:]
        if basin.objective > chosen.objective * (1.0 + 1e-6) or not _on(plateau, basin, chosen)
    ]
    return (first, *others)


def _on(plateau: DesignPlateau, basin: LocalOptimum, chosen: DesignEvaluation) -> bool:
    """Return whether a basin lies on a plateau: along its variables within it, elsewhere at its place."""
    for name, value in basin.values.items():
        low, high = plateau.intervals.get(name, (chosen.values[name], chosen.values[name]))
        if not low * (1.0 - 1e-3) <= value <= high * (1.0 + 1e-3):
            return False
    return True


def _checked(
    result: DesignResult, should_stop: ShouldStop, tick: Tick, more: Sequence[DesignEvaluation]
) -> DesignResult:
    """Return a result with its local optima computed again where the harmonics may be too few."""
    few = result.problem.harmonics
    if result.evaluation is None or 2 * few > MOST_HARMONICS or result.status is DesignStatus.FLAT:
        return result
    if not any(known.relative > DOUBTFUL for _, known in known_parts(result.evaluation)):
        return result
    problem = replace(result.problem, harmonics=2 * few)
    designs = [result.optimum, *(dict(basin.values) for basin in result.basins[1:MOST_CHECKED])]
    checked, responses = [], 0
    for values in designs:
        if should_stop is not None and should_stop():
            raise SearchStoppedError(DesignStatus.STOPPED)
        same = (one for one in more if one.values == values and one.harmonics == problem.harmonics)
        found = next(same, None)
        if found is None:
            seen = (one for one in (result.evaluation, *result.history) if one.values == values)
            found = evaluate(
                problem, values, gradients=False, errors=False, should_stop=should_stop,
                before=next(seen, None),
            )  # fmt: skip
            responses += found.computed
            tick()
        good = found.good and bool(found.peaks)
        checked.append(
            Checked(
                values=dict(values), harmonics=2 * few, peak=found.peaks[0].value if good else math.nan,
                objective=found.objective_told if good else math.nan,
                feasible=good and found.violation(natural_scales(problem)) <= KEPT,
            )
        )  # fmt: skip
    return replace(
        result, checked=tuple(checked), evaluations=result.evaluations + responses,
        work=result.work + responses,
    )  # fmt: skip
