"""Where what is minimised does not change along a variable: the interval, and what to choose within it.

A sharp number would be one of many as good: the ends are found by bisection, and within them the next peak
is made least, then the resonance band, then the variable itself.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from optim.criteria.constraint_rows import DesignEvaluation
from optim.criteria.criterion import CriterionRow
from optim.criteria.evaluation import evaluate
from optim.criteria.peak_criterion import PEAK
from optim.methods.enough_harmonics import MOST_HARMONICS
from optim.methods.evaluator import DesignSearch, SearchStoppedError, stop_if_asked
from optim.methods.linearised import KEPT, KKT_TOLERANCE, conditions, model_of, optimum_at, settled_status
from optim.problem.design_problem import Method, Problem
from optim.problem.variables import BoundedVariable, parameter_values
from optim.results.design_result import Checked, DesignResult, DesignStatus, LocalOptimum
from optim.results.doubts import DOUBTFUL, open_peaks
from solver.continuation.bracketing import least_between, level_up_to
from solver.response.solve import solve
from solver.results.watch import ShouldStop

LEVEL = 1e-6  # relative change below which what is minimised counts as constant
STEP = 0.01  # scaled, to the first designs that are compared
END = 1e-8  # scaled, to which the ends of a plateau are known
SAME = 1e-12  # relative, of numbers of two responses that are one
PLACES = 9  # designs on a plateau that the next criterion is compared at
PRECISE = 1e-7  # scaled, to which its least place is known
BROAD = 1e-5  # scaled width from which the next criterion is level too

MOST_CHECKED = 4
MOST_AGAIN = 4  # times that a plateau is looked for, each but the last at a better design met on the way

Along = Callable[[float], DesignEvaluation]
TieBreak = Callable[[DesignEvaluation], float | None]
Tick = Callable[[], None]


def nothing() -> None:
    """Do nothing: for a caller that does not count."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignPlateau:
    """What is as good as an optimum, and the design chosen of it."""

    intervals: Annotated[
        Mapping[str, tuple[float, float]], "Along each variable that has one, the others as chosen."
    ]
    evaluation: Annotated[DesignEvaluation, "The design chosen."]
    chosen_by: Annotated[str, "The criterion it was chosen by."]
    better: Annotated[
        DesignEvaluation | None,
        "A design met on the way that is better than the optimum: then that was none.",
    ]
    responses: Annotated[int, "Frequency responses computed."]


def plateau_of(result: DesignResult, should_stop: ShouldStop, tick: Tick = nothing) -> DesignPlateau | None:
    """Return the plateau an optimum lies on; None if it is sharp in every variable. Every design ticks.

    Raises
    ------
    StoppedError
        The caller asked to stop.
    """
    problem, best = result.problem, result.evaluation
    if best is None:
        return None
    level = _Level(problem, best, should_stop, tick)
    here, chosen_by = best, ""
    for variable in problem.variables:
        if level.may_be_level(here, variable):
            found = level.chosen(here, variable)
            if found is not None:
                here, chosen_by = found[0], chosen_by or found[1]
            if level.better is not None:
                break
    if level.better is None and not chosen_by:
        return None
    if level.better is not None:
        better = level.exact(level.better.values)
        return DesignPlateau(
            intervals={}, evaluation=best, chosen_by="", better=better, responses=level.responses
        )
    intervals = {v.name: level.interval(here, v) for v in problem.variables}
    here = here if here is best else level.exact(here.values)
    return DesignPlateau(
        intervals={name: found for name, found in intervals.items() if found is not None}, evaluation=here,
        chosen_by=chosen_by, better=None, responses=level.responses,
    )  # fmt: skip


class _Level:
    """Designs as good as an optimum."""

    def __init__(self, problem: Problem, best: DesignEvaluation, should_stop: ShouldStop, tick: Tick) -> None:
        self._problem, self._should_stop, self._tick = problem, should_stop, tick
        self._scales = problem.scales
        self._enough = best.objective * (1.0 + LEVEL)
        self._allowed = max(best.violation(self._scales), KEPT)
        self._found: dict[tuple[str, float], tuple[float, float]] = {}
        self._known: dict[tuple[str, tuple[float, ...]], dict[float, DesignEvaluation]] = {}
        self._lower = best.objective * (1.0 - LEVEL)
        self.better: DesignEvaluation | None = None
        self.responses = 0

    def exact(self, values: Mapping[str, float]) -> DesignEvaluation:
        """Return a design with gradients."""
        return self._evaluated(values, gradients=True)

    def _evaluated(self, values: Mapping[str, float], *, gradients: bool = False) -> DesignEvaluation:
        stop_if_asked(self._should_stop)
        found = evaluate(
            self._problem, values, gradients=gradients, errors=False, should_stop=self._should_stop
        )  # fmt: skip
        self.responses += found.computed
        self._tick()
        if found.good and found.objective < self._lower and self._good(found):
            self.better, self._lower = found, found.objective
        return found

    def _good(self, there: DesignEvaluation) -> bool:
        """Return whether a design is as good as the optimum."""
        return (
            there.good and there.objective <= self._enough and there.violation(self._scales) <= self._allowed
        )

    def may_be_level(self, here: DesignEvaluation, variable: BoundedVariable) -> bool:
        """Return whether the amplitude at the highest peak stays when a variable moves to a side.

        Necessary for a plateau, and one solved frequency instead of a response: most optima end here.
        """
        i = self._problem.variables.index(variable)
        slope = abs(variable.slope(here.values[variable.name]))
        held = [
            row
            for row in here.highest(LEVEL)
            if not abs(row.gradient[i]) * slope > LEVEL * abs(row.value)
        ]  # fmt: skip
        return any(self._stays(here, variable, row, side) for row in held for side in (-STEP, STEP))

    def _stays(
        self, here: DesignEvaluation, variable: BoundedVariable, row: CriterionRow, side: float
    ) -> bool:
        z = variable.inside(here.values[variable.name]) + side
        if not 0.0 <= z <= 1.0:
            return False
        if row.quantity is not PEAK:
            return True
        case = next(case for case in self._problem.cases if case.name == row.case)
        values = {**here.values, variable.name: variable.outside(z)}
        scene = case.scene.with_values(parameter_values(self._problem.variables, values))
        there = solve(scene, frequency_hz=row.at_hz, harmonics=self._problem.harmonics)
        # Where it did not converge the responses decide.
        amplitude = there.half_peak_to_peak if scene.observe.centred else there.max_abs
        return not abs(amplitude - row.value) > LEVEL * abs(row.value)

    def _along(self, here: DesignEvaluation, variable: BoundedVariable) -> Along:
        """Return what evaluates designs along a variable, each once."""
        others = tuple(value for name, value in here.values.items() if name != variable.name)
        known = self._known.setdefault((variable.name, others), {})
        known.setdefault(variable.inside(here.values[variable.name]), here)

        def along(z: float) -> DesignEvaluation:
            if z not in known:
                known[z] = self._evaluated({**here.values, variable.name: variable.outside(z)})
            return known[z]

        return along

    def interval(self, here: DesignEvaluation, variable: BoundedVariable) -> tuple[float, float] | None:
        """Return the interval of a variable in which designs are as good; None if it is none."""
        z = variable.inside(here.values[variable.name])
        known = [(low, high) for (name, _), (low, high) in self._found.items() if name == variable.name]
        found = next((pair for pair in known if pair[0] <= z <= pair[1]), None)
        if found is None or len(self._problem.variables) > 1:
            if not self.may_be_level(here, variable):
                return None
            found = _ends(self._along(here, variable), self._good, z, (0.0, 1.0))
        if found[1] - found[0] < STEP:
            return None
        self._found[variable.name, z] = found
        return variable.outside(found[0]), variable.outside(found[1])

    def chosen(
        self, here: DesignEvaluation, variable: BoundedVariable
    ) -> tuple[DesignEvaluation, str] | None:
        """Return the design chosen on the plateau along a variable, and by what; None if there is none."""
        along, z = self._along(here, variable), variable.inside(here.values[variable.name])
        low, high = _ends(along, self._good, z, (0.0, 1.0))
        if high - low < STEP:
            return None
        self._found[variable.name, z] = low, high
        held = here.highest(LEVEL)[0]
        criteria: dict[str, TieBreak] = {
            "the next highest peak": lambda there: _next_peak(self._problem, there, held),
            "the resonance band": lambda there: None if there.band is None else there.band.value,
        }
        for words, criterion in criteria.items():
            least = _least(along, criterion, low, high)
            if least is None:
                continue
            best, enough = least
            low, high = _ends(along, _at_most(criterion, enough), best, (low, high))
            if high - low <= BROAD:
                return along(best), words
        return along(low), f"the least {variable.name}"


def _at_most(criterion: TieBreak, enough: float) -> Callable[[DesignEvaluation], bool]:
    """Return whether a criterion is no larger than what counts as its least."""

    def kept(there: DesignEvaluation) -> bool:
        value = criterion(there)
        return value is not None and value <= enough

    return kept


def _same(one: DesignEvaluation, other: DesignEvaluation) -> bool:
    """Return whether two designs have the same responses: no number of them tells one from the other.

    So it is along the load of a contact that sticks everywhere.
    """
    if not (one.good and other.good) or len(one.rows) != len(other.rows):
        return False
    return all(
        abs(there.value - here.value) <= SAME * abs(here.value) and there.what == here.what
        for here, there in zip(one.rows, other.rows, strict=True)
    ) and all(
        [peak.at for peak in here.branch.peaks] == [peak.at for peak in there.branch.peaks]
        for here, there in zip(one.responses, other.responses, strict=True)
    )


def _ends(
    along: Along, good: Callable[[DesignEvaluation], bool], z: float, within: tuple[float, float]
) -> tuple[float, float]:
    """Return how far designs are good on both sides of a place, by doubled steps and bisection.

    Where the first step and the bound have the same responses as the place, so has what is between.
    """
    ends = []
    for bound, sign in ((within[0], -1.0), (within[1], 1.0)):
        first = max(z - STEP, bound) if sign < 0.0 else min(z + STEP, bound)
        if z != bound and _same(along(z), along(first)) and _same(along(z), along(bound)):
            ends.append(bound)
            continue
        ends.append(level_up_to(lambda place: good(along(place)), z, bound, STEP, END))
    return ends[0], ends[1]


def _least(along: Along, criterion: TieBreak, low: float, high: float) -> tuple[float, float] | None:
    """Return where a criterion is least and what counts as that; None where it is not known or level."""
    if _same(along(low), along(high)) and _same(along(low), along(0.5 * (low + high))):
        return None
    places = np.linspace(low, high, PLACES)
    values = [criterion(along(float(z))) for z in places]
    known = [value for value in values if value is not None]
    if len(known) < len(values) or max(known) - min(known) <= LEVEL * abs(max(known)):
        return None
    i = int(np.argmin(known))
    best, least = float(places[i]), known[i]
    bounds = float(places[max(i - 1, 0)]), float(places[min(i + 1, PLACES - 1)])
    found = least_between(lambda z: z, lambda z: criterion(along(z)) or 0.0, *bounds, PRECISE, 500, 0.0)
    if found is not None and (there := criterion(along(found)) or 0.0) < least:
        best, least = found, there
    return best, least + LEVEL * 1e-3 * abs(least)


def _next_peak(problem: Problem, there: DesignEvaluation, held: CriterionRow) -> float | None:
    """Return the highest weighted peak of all responses besides the one that holds the optimum."""
    weights = {case.name: case.weight for case in problem.cases}
    seen: set[str] = set()
    others: list[float] = []
    for response in there.responses:
        if response.case in seen:
            continue  # of a forbidden range
        seen.add(response.case)
        for peak in response.branch.peaks:
            mine = response.case == held.case and abs(peak.at - held.at_hz) <= LEVEL * abs(held.at_hz)
            if not mine:
                others.append(weights[response.case] * peak.value)
    return max(others, default=None)


def with_plateau(
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
    found = result
    stopped = result.status in (DesignStatus.STOPPED, DesignStatus.NO_RESPONSE)
    if result.evaluation is not None and result.evaluation.good and not stopped:
        try:
            found = _checked(_level(found, should_stop, tick).with_errors(), should_stop, tick, more)
        except SearchStoppedError:
            found = replace(found, status=DesignStatus.STOPPED)
    claims = found.status in (DesignStatus.OPTIMAL, DesignStatus.AT_BOUND)
    if claims and found.evaluation is not None and open_peaks(found.evaluation):
        return replace(found, status=DesignStatus.LOCAL)  # a higher peak may hide in its responses
    return found


def _level(result: DesignResult, should_stop: ShouldStop, tick: Tick) -> DesignResult:
    """Return a result with the plateau its optimum lies on, at the design chosen of it."""
    if result.status is DesignStatus.FLAT:
        return replace(result, plateau={v.name: (v.low, v.high) for v in result.problem.variables})
    for _ in range(MOST_AGAIN):
        plateau = plateau_of(result, should_stop, tick)
        if plateau is None:
            return result
        if plateau.better is None:
            evaluation = plateau.evaluation
            status: DesignStatus = result.status
            model = model_of(
                evaluation, result.problem.variables, evaluation.objective, result.problem.scales
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
        result = _improved(result, plateau.better, should_stop, tick)
    return result


def _improved(
    result: DesignResult, begin: DesignEvaluation, should_stop: ShouldStop, tick: Tick
) -> DesignResult:
    """Return a result after a local search from a better design that was met beside a plateau."""
    from optim.methods.minimax import thorough_search  # loads CVXPY, which most designs need not

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

    def on_it(basin: LocalOptimum) -> bool:
        """Along its variables within the plateau, elsewhere at its place."""
        ends = {name: (value, value) for name, value in chosen.values.items()} | dict(plateau.intervals)
        here = ((value, *ends[name]) for name, value in basin.values.items())
        return all(low * (1.0 - 1e-3) <= value <= high * (1.0 + 1e-3) for value, low, high in here)

    first = optimum_at(chosen, settled=True, feasible=all(basin.feasible for basin in result.basins[:1]))
    others = [
        basin
        for basin in result.basins[1:]
        if basin.objective > chosen.objective * (1.0 + 1e-6) or not on_it(basin)
    ]
    return (first, *others)


def _checked(
    result: DesignResult, should_stop: ShouldStop, tick: Tick, more: Sequence[DesignEvaluation]
) -> DesignResult:
    """Return a result with its local optima computed again where the harmonics may be too few."""
    few = result.problem.harmonics
    if result.evaluation is None or 2 * few > MOST_HARMONICS or result.status is DesignStatus.FLAT:
        return result
    if not any(known.relative > DOUBTFUL for _, known in result.evaluation.known_parts):
        return result
    problem = replace(result.problem, harmonics=2 * few)
    designs = [result.optimum, *(dict(basin.values) for basin in result.basins[1:MOST_CHECKED])]
    checked, responses = [], 0
    for values in designs:
        stop_if_asked(should_stop)
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
                feasible=good and found.violation(problem.scales) <= KEPT,
            )
        )  # fmt: skip
    return replace(
        result, checked=tuple(checked), evaluations=result.evaluations + responses,
        work=result.work + responses,
    )  # fmt: skip
