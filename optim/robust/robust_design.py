"""`robust_design`: the best damper when not everything is known.

Worst case: cutting sets (Mutapcic, Boyd, Optim. Methods Softw. 24:3 (2009) 381, doi
10.1080/10556780802712889). A master problem over the scenarios so far gives a design and a lower bound; the
worst scenario of that design (`optim.robust.worst_case`) gives an upper bound and joins the master problem,
until both agree. The problem is not convex: several basins of the master problem are kept, and the one with
the least value is worked on, which that of the others can only exceed when they get more scenarios too.

Mean and quantile: sample average approximation with common random numbers (Shapiro, Dentcheva, Ruszczyński,
Lectures on Stochastic Programming, SIAM 2009, chapter 5): the same samples for every design.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Unpack

from optim.criteria.criterion import CriterionRow
from optim.criteria.peak_criterion import BAND, PEAK
from optim.methods.enough_harmonics import most_harmonics
from optim.methods.evaluator import SearchStoppedError
from optim.methods.linearised import KEPT
from optim.problem.checks import Aim, DesignError, Method, share, whole, word
from optim.problem.design_problem import Limit, pose
from optim.problem.problem_keys import FEWEST_SAMPLES, OPTIONS, QUANTILE, SEED, DesignKeys, keywords
from optim.problem.uncertainty_input import check_settings, read_uncertain
from optim.problem.uncertainty_set import Scenario
from optim.results.design_result import DesignResult, DesignStatus, OnBest
from optim.results.doubts import WELL_KNOWN
from optim.robust.robust_result import RobustResult, RobustStatus, Side, Spread
from optim.robust.robust_search import CLOSED, RobustSearch, SearchProgress, cutting_sets, sampled
from optim.robust.scenarios import Outcome, rank_of
from optim.robust.worst_case import Aspect, UnknownScenarioError
from optim.search import solve_problem
from solver.jit.timer import clock
from solver.results.known import worst_of
from solver.results.watch import OnProgress, ShouldStop, shows_progress
from solver.scene.scene import Scene

if TYPE_CHECKING:
    from optim.problem.keyword_types import DesignKeywords


def side_of(
    search: RobustSearch,
    values: Mapping[str, float],
    drawn: Sequence[Scenario],
    scenarios: Sequence[Scenario],
) -> Side:
    """Return a design over the uncertainty.

    Parameters
    ----------
    search : what is judged, and over what.
    values : the design.
    drawn : the samples.
    scenarios : that may be the worst.
    """
    nominal = search.outcome(values, Scenario(), gradients=False)
    slopes = not search.uncertain.finite  # the search for the worst begins from them
    search.ahead([(values, scenario) for scenario in drawn], gradients=slopes)
    samples = [search.outcome(values, scenario, gradients=slopes) for scenario in drawn]
    peaks = [found.highest(PEAK) if found.good else None for found in samples]
    worst: Outcome | None = None
    unknown: Scenario | None = None
    try:
        worst = search.look(
            values, Aspect(quantity=PEAK, limited=False, plain=True), scenarios, samples
        ).worst
    except UnknownScenarioError as error:
        unknown = error.scenario
    peak, band = nominal.highest(PEAK), nominal.highest(BAND)
    places = [Scenario()] if worst is None else [Scenario(), worst.scenario]
    known = worst_of(search.known(values, scenario) for scenario in dict.fromkeys(places))
    return Side(
        values=dict(values), peak=math.nan if peak is None else peak.value,
        at_hz=math.nan if peak is None else peak.at_hz, band_hz=math.nan if band is None else band.value,
        worst=worst, spread=Spread(peaks=tuple(math.nan if row is None else row.value for row in peaks)),
        feasible=unknown is None and _feasible(search, values, samples, scenarios), unknown=unknown,
        known=known,
    )  # fmt: skip


def _feasible(
    search: RobustSearch, values: Mapping[str, float], samples: Sequence[Outcome], known: Sequence[Scenario]
) -> bool:
    """Return whether the limits are kept in every scenario tried, with a quantile in its share of samples."""
    excess = [_excess(search, found.rows) for found in samples]
    if search.aim is Aim.QUANTILE:
        return sorted(excess)[rank_of(search.quantile, len(excess)) - 1] <= KEPT
    excess += [_excess(search, search.outcome(values, scenario).rows) for scenario in known]
    return max(excess, default=-math.inf) <= KEPT


def _excess(search: RobustSearch, rows: Sequence[CriterionRow]) -> float:
    return max((row.excess(search.scales[row.quantity]) for row in rows), default=math.inf)


SAMPLES = {Aim.WORST_CASE: 32, Aim.MEAN: 64, Aim.QUANTILE: 64}


@shows_progress("robust design")
@keywords(DesignKeys, without=(OPTIONS,))
def robust_design(
    scene: Scene,
    *,
    uncertain: object,
    aim: str | Aim = Aim.WORST_CASE,
    quantile: float = QUANTILE,
    samples: int | None = None,
    seed: int = SEED,
    limits: Sequence[Limit] = (),
    on_progress: OnProgress = None,
    should_stop: ShouldStop = None,
    on_best: OnBest = None,
    **problem: Unpack[DesignKeywords],
) -> RobustResult:
    """Choose parameters so that the peak is least over an uncertainty, and compare with the nominal optimum.

    Parameters
    ----------
    scene : the scene; `observe` says which DOF and which band.
    uncertain : what is not known, see `optim.problem.uncertainty_input.read_uncertain`.
    aim : ``worst-case``, ``mean`` or ``quantile`` of what is minimised. Limits are kept in every scenario,
        with a quantile in that share of the samples that is minimised over.
    quantile : the share of the samples, for the aim of that name.
    samples : how many scenarios are drawn: for the mean and quantiles shown, and minimised with these aims;
        64, of a worst case 32 if left out.
    seed : of the random numbers.
    limits : bounds with types, in place of the keys `max_peak` and its like.
    on_progress : called with (share done, responses so far).
    should_stop : asked between responses and within them.
    on_best : called with the best design so far whenever it is another, while the search goes on.
    **problem : the keys of a problem.

    `method` is that of the search without uncertainty: the robust one is always the cone programme.

    Returns
    -------
    Both optima over the uncertainty; look at the status.

    Raises
    ------
    SettingError, SceneError, DesignError
        Bad paths, bounds, uncertainty, cases, limits or start.
    TypeError
        An argument that is no key.
    """
    begun = clock()
    posed = pose(scene, limits, **problem)
    if posed.method is Method.PERFORMANCE_CURVE:
        raise DesignError("method", posed.method.value, "must be another one: a curve knows no uncertainty")
    over = read_uncertain(scene, posed.variables, uncertain, posed.cases)
    search = RobustSearch(
        posed, over, word("aim", aim, Aim), share("quantile", quantile), on_progress, should_stop, on_best
    )
    wanted = SAMPLES[search.aim] if samples is None else whole("samples", samples, least=FEWEST_SAMPLES)
    drawn = over.draw(wanted, whole("seed", seed, least=0))
    for scenario in drawn:
        check_settings(scene, posed.variables, scenario.settings)
    found = _run(search, drawn, should_stop)
    if on_progress is not None:
        on_progress(1.0, search.responses)
    return replace(found, seconds=clock() - begun)


@dataclass(slots=True, kw_only=True)
class _State:
    """What is known so far, for a result at any time."""

    nominal: DesignResult
    progress: SearchProgress = field(default_factory=SearchProgress)
    sides: dict[str, Side] = field(default_factory=dict)
    unknown: Scenario | None = None


def _run(
    search: RobustSearch, drawn: tuple[Scenario, ...], should_stop: Callable[[], bool] | None
) -> RobustResult:
    """Search without and with uncertainty, then judge both optima."""
    before = search.responses

    def count(_share: float, evaluations: int) -> None:
        search.count(before + evaluations - search.responses)

    state = _State(
        nominal=solve_problem(
            search.problem, on_progress=count, should_stop=should_stop, on_best=search.nominal
        )
    )
    # What is minimised over the uncertainty has the measure and the harmonics that the nominal optimum needs,
    # and more of these where the worst scenario needs them.
    most, posed = most_harmonics(search.problem.harmonics), state.nominal.problem
    search.most_harmonics = most
    search.problem = replace(search.problem, harmonics=posed.harmonics, cases=posed.cases)
    status = _ended(search, drawn, state)
    while status is RobustStatus.NOT_KNOWN and 2 * search.problem.harmonics <= most:
        # With fewer harmonics the designs are ranked: where that search ended, this one begins.
        begun = SearchProgress(cuts=[*state.progress.cuts], best=state.progress.best)
        earlier, again = search.problem, _State(nominal=state.nominal, progress=begun)
        search.problem = replace(earlier, harmonics=2 * earlier.harmonics)
        status = _ended(search, drawn, again)
        if status is not RobustStatus.NOT_KNOWN and "robust" not in again.sides:
            search.problem, search.most_harmonics = earlier, 0
            _ended(search, drawn, state)
            state.unknown = again.unknown
            break
        state = again
    best = state.progress.best
    return RobustResult(
        problem=search.problem, uncertain=search.uncertain, aim=search.aim, quantile=search.quantile,
        status=status, design=state.nominal, nominal=state.sides.get("nominal"),
        robust=state.sides.get("robust"),
        objective=math.nan if best is None else search.objective(best, len(state.progress.scenarios)),
        conditions=None if best is None else best.conditions, cuts=state.progress.weighed(),
        gap=state.progress.gap, inner_look=state.progress.finished, unknown=state.unknown,
        designs=search.designs, responses=search.responses, seconds=0.0,
    )  # fmt: skip


def _ended(search: RobustSearch, drawn: tuple[Scenario, ...], state: _State) -> RobustStatus:
    """Search until it ends or is made to."""
    try:
        return _search(search, drawn, state)
    except SearchStoppedError as stop:
        stopped = stop.status is DesignStatus.STOPPED
        return RobustStatus.STOPPED if stopped else RobustStatus.TOO_MANY
    except UnknownScenarioError as unknown:
        state.unknown = unknown.scenario
        return RobustStatus.UNKNOWN_SCENARIO


def _search(search: RobustSearch, drawn: tuple[Scenario, ...], state: _State) -> RobustStatus:
    """Run the search of the aim and look at both optima; fills the state."""
    if state.nominal.status is DesignStatus.STOPPED:
        return RobustStatus.STOPPED
    method = cutting_sets if search.aim is Aim.WORST_CASE else sampled
    status = method(search, state.nominal, drawn, state.progress)
    if status is RobustStatus.NOT_KNOWN:
        return status
    known = [] if state.progress.best is None else state.progress.scenarios
    if state.nominal.evaluation is not None and state.nominal.evaluation.good:
        state.sides["nominal"] = side_of(search, state.nominal.optimum, drawn, known)
    if state.progress.best is not None:
        state.sides["robust"] = side_of(search, state.progress.best.evaluation.values, drawn, known)
        unknown = state.sides["robust"].unknown
        if unknown is not None:
            raise UnknownScenarioError(unknown)
        status = _checked_status(search, state, status)
        sure = state.sides["robust"].known.relative <= WELL_KNOWN
        if status is RobustStatus.OPTIMAL and (not sure or state.progress.best.evaluation.open):
            return RobustStatus.NOT_KNOWN
    undamped = status is RobustStatus.NO_RESPONSE and state.nominal.status is DesignStatus.UNDAMPED
    return RobustStatus.UNDAMPED if undamped else status


def _checked_status(search: RobustSearch, state: _State, status: RobustStatus) -> RobustStatus:
    """Return the status once the worst scenario of all looks is known: it may be worse than all cuts."""
    best, side = state.progress.best, state.sides["robust"]
    if search.aim is not Aim.WORST_CASE or best is None or side.worst is None:
        return status
    plain = Aspect(quantity=PEAK, limited=False, plain=True)
    known = plain.worst(best.evaluation.rows)
    excess = side.worst_peak / known - 1.0 if known > 0.0 else 0.0
    weighted = search.problem.weights[PEAK] > 0.0 and len(search.problem.cases) == 1
    if weighted and excess > CLOSED:
        state.progress.gap = max(state.progress.gap, excess)
        return RobustStatus.NOT_CLOSED if status is RobustStatus.OPTIMAL else status
    return status
