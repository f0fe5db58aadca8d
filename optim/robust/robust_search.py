"""The searches behind `robust_design`: cutting sets for the worst case, sample averages for the others.

Every design is evaluated in every scenario once, counted, and stopped when asked.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Annotated, Any

from optim.criteria.constraint_rows import DesignEvaluation
from optim.criteria.peak_criterion import PEAK
from optim.methods.evaluator import SearchStoppedError, stop_if_asked
from optim.methods.linearised import KEPT, Local, Model, is_flat, of_limits, quasi_random
from optim.methods.minimax import REMEMBERED, minimax_search
from optim.problem.checks import Aim
from optim.problem.design_problem import Problem
from optim.problem.uncertainty_set import Scenario, UncertainSet
from optim.problem.variables import BoundedVariable, scaled, unscaled
from optim.results.design_result import NOMINAL, SAME_PLACE, BestSoFar, DesignResult, DesignStatus, OnBest
from optim.results.doubts import WELL_KNOWN
from optim.robust.robust_result import Cut, RobustStatus
from optim.robust.scenarios import Outcome, aim_model, known_in, number_of, outcome, together
from optim.robust.worst_case import MOST_BESIDES, Aspect, Finding, UnknownScenarioError, pessimise
from solver.results.known import Known, worst_of
from solver.results.spread import Ahead

MOST_RESPONSES = 20_000
USUAL = 200.0  # responses of a usual search; what is left is not known beforehand
OVER = {
    Aim.WORST_CASE: "Its peak is the highest of the {count} scenarios so far; others may be worse.",
    Aim.MEAN: "Best by the mean of {count} samples; its peak is the highest of them.",
    Aim.QUANTILE: "Best by the quantile of {count} samples; its peak is the highest of them.",
}

Key = tuple[tuple[float, ...], Scenario, bool, int]  # the last one: harmonics


class RobustSearch:
    """A problem over its uncertainty; keeps every outcome."""

    def __init__(
        self, problem: Problem, uncertain: UncertainSet, aim: Aim, quantile: float,
        on_progress: Callable[[float, int], None] | None = None,
        should_stop: Callable[[], bool] | None = None, on_best: OnBest = None,
    ) -> None:  # fmt: skip
        self.problem, self.uncertain, self.aim, self.quantile = problem, uncertain, aim, quantile
        self.scales = problem.scales
        self.responses = 0
        self._on_progress, self._should_stop = on_progress, should_stop
        self._outcomes: dict[Key, Outcome] = {}
        self._sure: dict[Key, Known] = {}
        self._ahead: Ahead[Key, Outcome] = Ahead(should_stop)
        self._on_best = on_best
        self._known: tuple[tuple[int, int], tuple[float, float]] | None = (
            None  # over what, standing of the best
        )
        self._scale = 0.0
        self.most_harmonics = 0  # up to which a doubtful design is looked for again with twice as many

    @property
    def variables(self) -> tuple[BoundedVariable, ...]:
        """What may be chosen."""
        return self.problem.variables

    @property
    def designs(self) -> int:
        """Designs tried."""
        return len({key[0] for key in self._outcomes})

    @property
    def scale(self) -> float:
        """The objective that counts as 1: that of the first design whose objective is not 0."""
        return self._scale or 1.0

    def outcome(self, values: Mapping[str, float], scenario: Scenario, *, gradients: bool = True) -> Outcome:
        """Return a design in a scenario.

        Raises
        ------
        StoppedError
            The caller asked to stop, or the responses are used up.
        """
        key = self._key(values, scenario, gradients)
        if (known := self._known_outcome(key)) is not None:
            return known
        stop_if_asked(self._should_stop)
        if self.responses >= MOST_RESPONSES:
            raise SearchStoppedError(DesignStatus.TOO_MANY)
        found = self._ahead.take(key) or outcome(
            self.problem, values, scenario, gradients=gradients, should_stop=self._should_stop
        )
        if not found.good:
            stop_if_asked(self._should_stop)
        self._outcomes[key] = found
        self.count(found.responses)
        return found

    def ahead(self, asked: Iterable[tuple[Mapping[str, float], Scenario]], *, gradients: bool = True) -> None:
        """Compute designs in scenarios that will be asked for, where there are others to do so."""
        calls = {self._key(values, scenario, gradients): (values, scenario) for values, scenario in asked}
        unknown = {key: call for key, call in calls.items() if self._known_outcome(key) is None}
        self._ahead.compute(partial(outcome, self.problem, gradients=gradients), unknown)

    def pessimise(
        self, values: Mapping[str, float], aspect: Aspect, known: Sequence[Scenario], **more: Any
    ) -> Finding:  # fmt: skip
        """Return the worst scenario of a design in one aspect; see `optim.robust.worst_case.pessimise`."""
        return pessimise(
            partial(self.outcome, values), self.uncertain, aspect, known,
            ahead=lambda scenarios: self.ahead((values, scenario) for scenario in scenarios), **more,
        )  # fmt: skip

    def look(
        self, values: Mapping[str, float], aspect: Aspect, known: Sequence[Scenario],
        samples: Sequence[Outcome],
    ) -> Finding:  # fmt: skip
        """Return the worst scenario of a design, from a look at the whole set that begins with samples."""
        ranked = sorted((one for one in samples if one.good), key=lambda found: -aspect.worst(found.rows))
        besides = [found.scenario for found in ranked[:MOST_BESIDES]]
        return self.pessimise(values, aspect, known, besides=besides, thorough=True)

    def _key(self, values: Mapping[str, float], scenario: Scenario, gradients: bool) -> Key:
        place = tuple(values[variable.name] for variable in self.variables)
        return place, scenario, gradients, self.problem.harmonics

    def _known_outcome(self, key: Key) -> Outcome | None:
        place, scenario, _, harmonics = key
        with_slopes = self._outcomes.get((place, scenario, True, harmonics))
        return with_slopes or self._outcomes.get(key)

    def known(self, values: Mapping[str, float], scenario: Scenario) -> Known:
        """Return how well the highest peak of a design in a scenario is known."""
        key = self._key(values, scenario, gradients=False)
        if key not in self._sure:
            self._sure[key] = known_in(self.problem, values, scenario, self._should_stop)
            self.count(len(self.problem.cases))
        return self._sure[key]

    def needs_more_harmonics(self, best: Local, scenarios: Sequence[Scenario]) -> bool:
        """Return whether a design has to be looked for again with twice the harmonics, and can be."""
        if 2 * self.problem.harmonics > self.most_harmonics or _ended(best) is not RobustStatus.OPTIMAL:
            return False
        worst = [scenarios[number_of(row) - 1] for row in best.evaluation.peaks[:1]]
        parts = [self.known(best.evaluation.values, one) for one in dict.fromkeys((Scenario(), *worst))]
        return best.evaluation.open or not worst_of(parts).relative <= WELL_KNOWN

    def count(self, responses: int) -> None:
        """Count responses and report them."""
        self.responses += responses
        if self._on_progress is not None:
            self._on_progress(self.responses / (self.responses + USUAL), self.responses)

    def evaluation(self, values: Mapping[str, float], scenarios: Sequence[Scenario]) -> DesignEvaluation:
        """Return a design over several scenarios."""
        found: list[Outcome] = []
        self.ahead((values, scenario) for scenario in scenarios)
        for scenario in scenarios:
            found.append(self.outcome(values, scenario))
            if not found[-1].good:
                break
        evaluation = together(values, found)
        if not self._scale and evaluation.good:
            self._scale = evaluation.objective
        return evaluation

    def model(self, evaluation: DesignEvaluation, count: int) -> Model:
        """Return the model of a good evaluation over `count` scenarios."""
        return aim_model(self.aim, self.quantile, count, self.variables, self.scale, self.scales)(evaluation)

    def improve(self, values: Mapping[str, float], scenarios: Sequence[Scenario]) -> Local | None:
        """Return the end of the master problem's search from a design; None if that can not be evaluated."""
        begin = self.evaluation(values, scenarios)
        if not begin.good:
            return None
        found = self._searched(begin, scenarios, 0)
        # Cuts help at kinks, but with many scenarios a row bent over a long step passes for one of its own;
        # rows of scenarios that a quantile leaves out must not come back as cuts at all.
        if not found.settled and self.aim is not Aim.QUANTILE:
            again = self._searched(found.evaluation, scenarios, REMEMBERED)
            found = min(found, again, key=lambda local: local.rank)
        if not found.feasible:
            # What is minimised may lead out of limits that can be kept, to an end that breaks them.
            kept = self._searched(begin, scenarios, 0, of=of_limits, enough=1.0 + KEPT).evaluation
            if self.model(kept, len(scenarios)).violation <= KEPT:
                found = self._searched(kept, scenarios, 0, strict=True)
        self._tell(found, len(scenarios))
        return found

    def nominal(self, best: BestSoFar) -> None:
        """Hear of the search without the uncertainty."""
        if self._on_best is not None:
            self._on_best(replace(best, verified=False, words=NOMINAL))

    def _tell(self, local: Local, scenarios: int) -> None:
        """Tell of a design that is better over the same scenarios, or is the first over more of them."""
        if self._on_best is None or not local.evaluation.good:
            return
        over = scenarios, self.problem.harmonics
        if self._known is not None and self._known[0] == over and self._known[1] <= local.standing:
            return
        self._known = over, local.standing
        peaks = local.evaluation.peaks
        self._on_best(
            BestSoFar(
                values=dict(local.evaluation.values), peak=peaks[0].value if peaks else math.nan,
                objective=self.objective(local, scenarios), feasible=local.feasible, verified=False,
                words=OVER[self.aim].format(count=scenarios), evaluations=self.designs,
            )
        )  # fmt: skip

    def _searched(
        self, begin: DesignEvaluation, scenarios: Sequence[Scenario], remembered: int,
        of: Callable[[Model], Model] = lambda model: model, **more: Any,
    ) -> Local:  # fmt: skip
        """Return the end of the minimax search over scenarios that keeps so many designs' rows as cuts."""
        return minimax_search(
            lambda there: self.evaluation(there, scenarios), self.variables, begin,
            lambda evaluation: of(self.model(evaluation, len(scenarios))), ball=True, remembered=remembered,
            **more,
        )  # fmt: skip

    def objective(self, local: Local, count: int) -> float:
        """Return what was minimised at a design over `count` scenarios, in its own unit."""
        return self.model(local.evaluation, count).objective * self.scale

    def aspects(self) -> tuple[Aspect, ...]:
        """Return every number whose worst case counts: what is minimised first, then what is limited."""
        minimised = [
            Aspect(quantity=quantity, limited=False)
            for quantity, weight in self.problem.weights.items()
            if weight > 0.0
        ]
        return (
            *minimised,
            *(Aspect(quantity=q, limited=True, unit=self.scales[q]) for q in self.problem.limits),
        )


CLOSED = (
    1e-6  # relative excess of the worst scenario found over the master problem's, up to which it is solved
)
MOST_CUTS = 40
AT_ONCE = 2  # scenarios that join the master problem for one aspect
CLOUD = 0.05  # distance of ξ within which two scenarios are one place
FAR_APART = 1e-2  # scaled distance from which two starts are two
COARSE_ONE = 9  # designs of the coarse stage with one variable
COARSE_EACH = 6  # and for each variable with more
FEW = 8  # samples that the starts of a sampled search are judged by


@dataclass(slots=True, kw_only=True)
class SearchProgress:
    """What a search knows at any time."""

    cuts: Annotated[list[Cut], "The scenarios of the master problem, without multipliers."] = field(
        default_factory=list
    )
    best: Annotated[Local | None, "The best design so far."] = None
    gap: Annotated[
        float, "Relative excess of the worst scenario found over the worst of the master problem."
    ] = math.nan
    finished: Annotated[
        bool, "Whether the look over the whole uncertainty behind the gap came to its end."
    ] = False

    @property
    def scenarios(self) -> list[Scenario]:
        """Those of the master problem."""
        return [cut.scenario for cut in self.cuts]

    def add(self, found: Outcome, exceeds: float) -> bool:
        """Add a scenario to the master problem unless it is there."""
        if found.scenario in self.scenarios:
            return False
        row = found.highest(PEAK)
        self.cuts.append(_cut(found.scenario, math.nan if row is None else row.value, exceeds))
        return True

    def weighed(self) -> tuple[Cut, ...]:
        """Return the scenarios with the force they hold the best design with."""
        force = dict.fromkeys(range(len(self.cuts)), 0.0)
        if self.best is not None:
            for row, multiplier in self.best.conditions.rows:
                place = number_of(row) - 1
                force[place] = force.get(place, 0.0) + multiplier
        return tuple(replace(cut, multiplier=force[i]) for i, cut in enumerate(self.cuts))


def _cut(scenario: Scenario, peak: float = math.nan, exceeds: float = math.nan) -> Cut:
    return Cut(scenario=scenario, peak=peak, exceeds=exceeds, multiplier=0.0)


def cutting_sets(
    search: RobustSearch, nominal: DesignResult, drawn: Sequence[Scenario], progress: SearchProgress
) -> RobustStatus:
    """Minimise the worst case; `progress` is kept up to date, and begun from where it is given.

    Raises
    ------
    StoppedError, UnknownScenarioError
        The caller asked to stop; a scenario could not be computed.
    """
    if progress.best is None:
        first = dict(nominal.optimum) if nominal.optimum else _coarse(search.problem)[0]
        for scenario in search.uncertain.middle():
            progress.add(search.outcome(first, scenario), math.nan)
        if nominal.evaluation is not None and nominal.evaluation.good:
            for outcomes, _ in _worse(search, nominal.optimum, progress, ()):
                for found in outcomes:
                    progress.add(found, math.nan)
    starts = _starts(search, nominal, progress, progress.scenarios)
    basins, ended = _locals(search, starts, progress.scenarios)
    if ended is not None:
        return ended
    known = dict.fromkeys(range(len(basins)), len(progress.scenarios))
    for _ in range(MOST_CUTS):
        place = min(range(len(basins)), key=lambda i: basins[i].standing)
        if known[place] < len(progress.scenarios):
            again = search.improve(basins[place].evaluation.values, progress.scenarios)
            basins[place], known[place] = again or basins[place], len(progress.scenarios)
            if min(basin.standing for basin in basins) < basins[place].standing:
                continue
        progress.best = basins[place]
        # What has too few harmonics only ranks designs: over the whole set it is not looked at.
        for looked in ((), drawn):
            worse = _worse(search, basins[place].evaluation.values, progress, looked)
            progress.gap = max((gap for _, gap in worse), default=math.nan)
            if progress.gap > CLOSED:
                break
            if not looked and search.needs_more_harmonics(basins[place], progress.scenarios):
                return RobustStatus.NOT_KNOWN
        if progress.gap <= CLOSED:
            ended = _ended(basins[place])
            open_look = ended is RobustStatus.OPTIMAL and not progress.finished
            return RobustStatus.LOCAL if open_look else ended
        added = [progress.add(found, gap) for outcomes, gap in worse for found in outcomes]
        if not any(added):
            return RobustStatus.NOT_CLOSED
    return RobustStatus.NOT_CLOSED


def _worse(
    search: RobustSearch, values: Mapping[str, float], progress: SearchProgress, drawn: Sequence[Scenario]
) -> list[tuple[list[Outcome], float]]:
    """Return for every aspect the scenarios worse than the master's, and by how much the worst of them is."""
    here = search.evaluation(values, progress.scenarios)
    found = []
    progress.finished = True
    for aspect in search.aspects():
        master = aspect.worst(here.rows)
        finding = search.pessimise(values, aspect, progress.scenarios)
        if drawn and _excess(aspect, finding.value, master) <= CLOSED and not search.uncertain.finite:
            inside = [scenario for scenario in drawn if search.uncertain.inside_of(scenario)]
            search.ahead((values, scenario) for scenario in inside)
            samples = [search.outcome(values, scenario) for scenario in inside]
            finding = search.look(values, aspect, progress.scenarios, samples)
        progress.finished = progress.finished and finding.finished
        worse = [o for o in finding.outcomes if _excess(aspect, aspect.worst(o.rows), master) > CLOSED]
        # The worst scenarios that differ: a climb ends in a cloud of them.
        kept: list[Outcome] = []
        for one in worse:
            there = one.scenario
            same = [
                other.scenario for other in kept if there.xi and other.scenario.given_disk == there.given_disk
            ]
            if len(kept) < AT_ONCE and all(math.dist(other.xi, there.xi) >= CLOUD for other in same):
                kept.append(one)
        found.append((kept, _excess(aspect, finding.value, master)))
    return found


def _excess(aspect: Aspect, worst: float, master: float) -> float:
    """Return by how much the worst exceeds the master's: relative, or of a kept limit the part above it."""
    if aspect.limited:
        return max(worst, 0.0) - max(master, 0.0)
    return (worst - master) / abs(master) if master else worst - master


def sampled(
    search: RobustSearch, nominal: DesignResult, drawn: Sequence[Scenario], progress: SearchProgress
) -> RobustStatus:
    """Minimise the mean or a quantile over the drawn scenarios; `progress` is kept up to date.

    The starts are judged, and improved, with a few of the samples first.
    """
    few = list(drawn[:FEW])
    basins, ended = _locals(search, _starts(search, nominal, progress, few), few)
    if ended is not None:
        return ended
    progress.cuts = [_cut(scenario) for scenario in drawn]
    progress.best = best = min(basins, key=lambda basin: basin.standing)
    if search.needs_more_harmonics(best, few):
        return RobustStatus.NOT_KNOWN
    starts = [best.evaluation.values, *([nominal.optimum] if nominal.optimum else [])]
    begin = min(
        (e for values in starts if (e := search.evaluation(values, drawn)).good),
        key=lambda evaluation: search.model(evaluation, len(drawn)).merit, default=None,
    )  # fmt: skip
    local = None if begin is None else search.improve(begin.values, drawn)
    if local is None:
        return RobustStatus.UNKNOWN_SCENARIO
    progress.best = local
    return _ended(local)


def _starts(
    search: RobustSearch, nominal: DesignResult, progress: SearchProgress, scenarios: Sequence[Scenario]
) -> list[DesignEvaluation]:
    """Return designs over the whole range, or the best one known, evaluated over some scenarios."""
    first = [dict(nominal.optimum)] if nominal.optimum else []
    given = first + [dict(basin.values) for basin in nominal.basins] + _coarse(search.problem)
    if progress.best is not None:
        given = [dict(progress.best.evaluation.values)]
    search.ahead((values, scenario) for values in given for scenario in scenarios)
    seen = [search.evaluation(values, scenarios) for values in given]
    if nominal.optimum and not any(evaluation.good for evaluation in seen):
        for scenario in scenarios:
            if not search.outcome(nominal.optimum, scenario).good:
                raise UnknownScenarioError(scenario)
    return [evaluation for evaluation in seen if evaluation.good]


def _locals(
    search: RobustSearch, starts: Sequence[DesignEvaluation], scenarios: Sequence[Scenario]
) -> tuple[list[Local], RobustStatus | None]:
    """Return the local optima from the best starts that lie apart; or how the search ends without one."""
    if not starts:
        return [], RobustStatus.NO_RESPONSE
    if all(is_flat(search.model(evaluation, len(scenarios))) for evaluation in starts):
        return [], RobustStatus.FLAT
    places: list[list[float]] = []
    found: list[Local] = []
    # With one variable only the lowest of each valley.
    merits = {id(evaluation): search.model(evaluation, len(scenarios)).merit for evaluation in starts}
    kept = list(starts)
    if len(search.variables) == 1:
        # From the sides of a valley the same optimum would be found again.
        kept.sort(key=lambda evaluation: evaluation.values[search.variables[0].name])
        line = [math.inf, *(merits[id(e)] for e in kept), math.inf]
        kept = [e for i, e in enumerate(kept) if line[i] >= line[i + 1] <= line[i + 2]]
    for begin in sorted(kept, key=lambda evaluation: merits[id(evaluation)]):
        z = [variable.inside(begin.values[variable.name]) for variable in search.variables]
        if len(places) < search.problem.basins and all(math.dist(z, other) > FAR_APART for other in places):
            places.append(z)
            if (local := search.improve(begin.values, scenarios)) is not None:
                end, *ends = (scaled(search.variables, one.evaluation.values) for one in (local, *found))
                if all(math.dist(end, other) > SAME_PLACE for other in ends):
                    found.append(local)
    return found, None


def _ended(best: Local) -> RobustStatus:
    if not best.feasible:
        return RobustStatus.INFEASIBLE
    return RobustStatus.OPTIMAL if best.settled else RobustStatus.KINK


def _coarse(problem: Problem) -> list[dict[str, float]]:
    """Return the designs a robust search starts from: even in scaled variables, the start first."""
    n = len(problem.variables)
    if n == 1:
        points = [[i / (COARSE_ONE - 1.0)] for i in range(COARSE_ONE)]
    else:
        points = quasi_random(n, COARSE_EACH * n).tolist()
    designs = [unscaled(problem.variables, point) for point in points]
    start = None if problem.start is None else dict(problem.start)
    return [start, *designs] if start is not None and start not in designs else designs
