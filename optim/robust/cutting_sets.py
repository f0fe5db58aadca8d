"""The searches behind `robust_design`: cutting sets for the worst case, sample averages for the others."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated

from optim.criteria.constraint_rows import DesignEvaluation
from optim.criteria.peak_criterion import PEAK
from optim.methods.linearised import Local, is_flat
from optim.methods.surrogate import quasi_random
from optim.problem.design_problem import Problem
from optim.problem.uncertainty_set import Scenario
from optim.problem.variables import scaled, unscaled
from optim.results.design_result import SAME_PLACE, DesignResult
from optim.robust.robust_result import Cut, RobustStatus
from optim.robust.robust_search import RobustSearch
from optim.robust.scenarios import Outcome, number_of
from optim.robust.worst_case import MOST_BESIDES, Aspect, Finding, UnknownScenarioError

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
    """Minimise the worst case; `progress` is kept up to date.

    Raises
    ------
    StoppedError, UnknownScenarioError
        The caller asked to stop; a scenario could not be computed.
    """
    for scenario in search.uncertain.middle():
        progress.add(search.outcome(_first(search, nominal), scenario), math.nan)
    if nominal.evaluation is not None and nominal.evaluation.good:
        for outcomes, _ in _worse(search, nominal.optimum, progress, ()):
            for found in outcomes:
                progress.add(found, math.nan)
    basins, ended = _locals(search, _starts(search, nominal, progress.scenarios), progress.scenarios)
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
        worse = _worse(search, basins[place].evaluation.values, progress, drawn)
        progress.gap = max((gap for _, gap in worse), default=math.nan)
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
            finding = _checked(search, values, aspect, progress, drawn)
        progress.finished = progress.finished and finding.finished
        worse = [o for o in finding.outcomes if _excess(aspect, aspect.worst(o.rows), master) > CLOSED]
        found.append((_distinct(worse), _excess(aspect, finding.value, master)))
    return found


def _distinct(worse: Sequence[Outcome]) -> list[Outcome]:
    """Return the worst scenarios that differ: a climb ends in a cloud of them."""
    kept: list[Outcome] = []
    for found in worse:
        here = found.scenario
        same = [other.scenario for other in kept if here.xi and other.scenario.given_disk == here.given_disk]
        if len(kept) < AT_ONCE and all(math.dist(other.xi, here.xi) >= CLOUD for other in same):
            kept.append(found)
    return kept


def _checked(
    search: RobustSearch, values: Mapping[str, float], aspect: Aspect, progress: SearchProgress,
    drawn: Sequence[Scenario],
) -> Finding:  # fmt: skip
    """Return the worst scenarios again, looking at the whole set and climbing from the worst drawn ones."""
    inside = [scenario for scenario in drawn if search.uncertain.inside_of(scenario)]
    search.ahead((values, scenario) for scenario in inside)
    asked = [search.outcome(values, scenario) for scenario in inside]
    ranked = sorted((o for o in asked if o.good), key=lambda found: -aspect.worst(found.rows))
    besides = [found.scenario for found in ranked[:MOST_BESIDES]]
    return search.pessimise(values, aspect, progress.scenarios, besides=besides, thorough=True)


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
    basins, ended = _locals(search, _starts(search, nominal, few), few)
    if ended is not None:
        return ended
    progress.cuts = [_cut(scenario) for scenario in drawn]
    best = min(basins, key=lambda basin: basin.standing)
    starts = [best.evaluation.values] + ([dict(nominal.optimum)] if nominal.optimum else [])
    begin = min(
        (e for values in starts if (e := search.evaluation(values, drawn)).good),
        key=lambda evaluation: search.model(evaluation, len(drawn)).merit, default=None,
    )  # fmt: skip
    local = None if begin is None else search.improve(begin.values, drawn)
    if local is None:
        return RobustStatus.UNKNOWN_SCENARIO
    progress.best = local
    return _ended(local)


def _first(search: RobustSearch, nominal: DesignResult) -> dict[str, float]:
    """Return the nominal optimum, or else the first design of the coarse stage."""
    return dict(nominal.optimum) if nominal.optimum else _coarse(search.problem)[0]


def _starts(
    search: RobustSearch, nominal: DesignResult, scenarios: Sequence[Scenario]
) -> list[DesignEvaluation]:
    """Return designs over the whole range, evaluated over some scenarios: a coarse stage of its own."""
    given = [dict(basin.values) for basin in nominal.basins] + _coarse(search.problem)
    if nominal.optimum:
        given.insert(0, dict(nominal.optimum))
    search.ahead((values, scenario) for values in given for scenario in scenarios)
    seen = [search.evaluation(values, scenarios) for values in given]
    if nominal.optimum and not any(evaluation.good for evaluation in seen):
        for scenario in scenarios:
            if not search.outcome(nominal.optimum, scenario).good:
                raise UnknownScenarioError(scenario)
    return [evaluation for evaluation in seen if evaluation.good]


def _valleys(search: RobustSearch, seen: Sequence[DesignEvaluation], count: int) -> list[DesignEvaluation]:
    """Return the designs to search from, best first; with one variable only the lowest of each valley."""
    merits = {id(evaluation): search.model(evaluation, count).merit for evaluation in seen}
    kept = list(seen)
    if len(search.variables) == 1:
        # From the sides of a valley the same optimum would be found again.
        kept.sort(key=lambda evaluation: evaluation.values[search.variables[0].name])
        line = [math.inf, *(merits[id(e)] for e in kept), math.inf]
        kept = [e for i, e in enumerate(kept) if line[i] >= line[i + 1] <= line[i + 2]]
    return sorted(kept, key=lambda evaluation: merits[id(evaluation)])


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
    for begin in _valleys(search, starts, len(scenarios)):
        z = [variable.inside(begin.values[variable.name]) for variable in search.variables]
        if len(places) < search.problem.basins and all(math.dist(z, other) > FAR_APART for other in places):
            places.append(z)
            local = search.improve(begin.values, scenarios)
            if local is not None and all(_apart(search, local, other) for other in found):
                found.append(local)
    return found, None


def _apart(search: RobustSearch, one: Local, other: Local) -> bool:
    """Return whether two local optima are two."""
    places = [scaled(search.variables, local.evaluation.values) for local in (one, other)]
    return math.dist(*places) > SAME_PLACE


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
        points = quasi_random(n, 2 ** math.ceil(math.log2(COARSE_EACH * n))).tolist()
    designs = [unscaled(problem.variables, point) for point in points]
    start = None if problem.start is None else dict(problem.start)
    return [start, *designs] if start is not None and start not in designs else designs
