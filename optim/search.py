"""`design`: the best damper of a scene."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence

from scipy.stats import qmc

from optim.evaluation import evaluate, natural_scales
from optim.local import Local, LocalSearch, is_flat
from optim.model import Model, model_of
from optim.problem import Method, Problem, pose
from optim.result import Basin, DesignResult, DesignStatus
from optim.rows import Evaluation
from optim.variables import Variable, unscaled
from solver.scene import Scene

COARSE_ONE = 9  # designs of the coarse stage with one variable
COARSE_EACH = 6  # and for each variable with more
WORTH_A_LOOK = 1.15  # relative height up to which an interval of the coarse stage is halved
BASINS = 2  # of the coarse stage that are searched to the end
SAME_PLACE = 1e-3  # scaled distance within which two optima are one
MOST_EVALUATIONS = 400


class StoppedError(Exception):
    """The caller asked to stop, or the evaluations are used up."""

    def __init__(self, status: DesignStatus) -> None:
        self.status = status
        super().__init__(status.value)


class Search:
    """Evaluates designs, keeps all of them, reports progress and looks whether to stop."""

    def __init__(
        self, problem: Problem, on_progress: Callable[[float, int], None] | None = None,
        should_stop: Callable[[], bool] | None = None, most: int = MOST_EVALUATIONS,
    ) -> None:  # fmt: skip
        self.problem = problem
        self.history: list[Evaluation] = []
        self.scales = natural_scales(problem)
        self.should_stop = should_stop
        self.on_progress = on_progress
        self._most = most
        self._scale: float | None = None

    def __call__(self, values: Mapping[str, float]) -> Evaluation:
        """Evaluate one design with gradients.

        Raises
        ------
        StoppedError
            The caller asked to stop, or the evaluations are used up.
        """
        self.check()
        if len(self.history) >= self._most:
            raise StoppedError(DesignStatus.TOO_MANY)
        evaluation = evaluate(self.problem, values, should_stop=self.should_stop)
        self.keep(evaluation)
        return evaluation

    def check(self) -> None:
        """Raise StoppedError if the caller asked to stop."""
        if self.should_stop is not None and self.should_stop():
            raise StoppedError(DesignStatus.STOPPED)

    def keep(self, evaluation: Evaluation) -> None:
        """Add an evaluation to the history and report it."""
        self.history.append(evaluation)
        if self._scale is None and evaluation.good:
            self._scale = evaluation.objective or 1.0
        if self.on_progress is not None:
            # The number of evaluations is not known beforehand: the share approaches 1 from below.
            done = len(self.history)
            self.on_progress(done / (done + 12.0), done)

    @property
    def variables(self) -> tuple[Variable, ...]:
        """What may be chosen."""
        return self.problem.variables

    def good(self) -> list[Evaluation]:
        """Return every design whose numbers are known."""
        return [evaluation for evaluation in self.history if evaluation.good]

    def model(self, evaluation: Evaluation) -> Model:
        """Return the model of a good evaluation, relative to the first one."""
        return model_of(evaluation, self.variables, self._scale or 1.0, self.scales)

    def merit(self, evaluation: Evaluation) -> float:
        """Return what the search decreases."""
        return self.model(evaluation).merit


def design(
    scene: Scene,
    *,
    variables: Mapping[str, tuple[float, float]] | None = None,
    scaling: Mapping[str, str] | None = None,
    cases: Sequence[Mapping[str, object]] | None = None,
    limit: float | None = None,
    weights: Mapping[str, float] | None = None,
    max_peak: float | None = None,
    max_band_hz: float | None = None,
    forbidden_hz: Sequence[Sequence[float]] | None = None,
    speeds_rpm: Sequence[Sequence[float]] | None = None,
    max_friction_work: Mapping[str, float] | float | None = None,
    contact_states: Mapping[str, str] | None = None,
    harmonics: int = 11,
    start: Mapping[str, float] | None = None,
    method: str | Method = Method.AUTO,
    on_progress: Callable[[float, int], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> DesignResult:
    """Choose parameters within bounds so that the highest peak over the scene's band is least.

    Parameters
    ----------
    scene : the scene; `observe` says which DOF and which band.
    variables : parameter path to (low, high), paths that share a value separated by commas; the N0 of the
        contact with a tied N1 if left out.
    scaling : variable to ``linear`` or ``logarithmic``; by the bounds if left out.
    cases : the responses that count, see `optim.cases.read_cases`; the scene as it is if left out.
    limit : amplitude [m] above which the resonance band is measured; half power of the peak if left out.
    weights : of ``peak`` [1/m] and ``band`` [1/Hz] in what is minimised; the peak alone if left out.
    max_peak : largest amplitude allowed [m].
    max_band_hz : largest width of the resonance band allowed [Hz].
    forbidden_hz : ranges [Hz] in which the amplitude must stay below `limit`.
    speeds_rpm : ranges of running speeds [1/min]: forbidden ranges by the order of each case.
    max_friction_work : largest friction work in a cycle [J], of every contact or by contact.
    contact_states : contact to ``never-separates``.
    harmonics : highest harmonic kept.
    start : a design to start from, variable to value; it is tried along with those of the coarse stage.
    method : ``auto``, ``tracked``, ``minimax`` or ``ipopt``.
    on_progress : called with (share done, evaluations so far).
    should_stop : asked between responses and within them.

    Returns
    -------
    The best design with everything tried on the way; look at its status.

    Raises
    ------
    SettingError, SceneError, DesignError
        Bad paths, bounds, cases, limits or start.
    """
    problem = pose(
        scene, variables=variables, scaling=scaling, cases=cases, limit=limit, weights=weights,
        max_peak=max_peak, max_band_hz=max_band_hz, forbidden_hz=forbidden_hz, speeds_rpm=speeds_rpm,
        max_friction_work=max_friction_work, contact_states=contact_states, harmonics=harmonics, start=start,
        method=method,
    )  # fmt: skip
    return solve_problem(problem, on_progress=on_progress, should_stop=should_stop)


def solve_problem(
    problem: Problem, *, on_progress: Callable[[float, int], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> DesignResult:  # fmt: skip
    """Search the best design of a problem; see `design`."""
    begun = time.perf_counter()
    search = Search(problem, on_progress, should_stop)
    found: list[Local] = []
    try:
        status = _search(search, found)
    except StoppedError as stop:
        status = stop.status
    if on_progress is not None and found:
        on_progress(1.0, len(search.history))
    return _result(search, found, status, time.perf_counter() - begun)


def _search(search: Search, found: list[Local]) -> DesignStatus:
    """Run the coarse stage, then a local search from the best designs of it that lie in different basins."""
    for values in coarse(search.problem):
        search(values)
    if len(search.variables) == 1:
        for values in _between(search):
            search(values)
    good = search.good()
    if not good:
        return DesignStatus.NO_RESPONSE
    if all(is_flat(search.model(evaluation)) for evaluation in good):
        return DesignStatus.FLAT
    local_search = local_search_of(search.problem.method)
    for begin in _basins(search, good):
        found.append(local_search(search, search.variables, begin, search.model))
    return judge(min(found, key=lambda local: local.merit))


def local_search_of(method: Method) -> LocalSearch:
    """Return the local search of a method; CasADi and CVXPY are loaded when they are needed."""
    if method is Method.IPOPT:
        from optim.nlp import ipopt_search

        return ipopt_search
    from optim.minimax import minimax_search

    return minimax_search


def judge(best: Local) -> DesignStatus:
    """Return how a search ended from the best end of its local searches."""
    if not best.feasible:
        return DesignStatus.INFEASIBLE
    return DesignStatus.OPTIMAL if best.settled else DesignStatus.KINK


def coarse(problem: Problem) -> list[dict[str, float]]:
    """Return the designs of the coarse stage: even in scaled variables, the start first."""
    n = len(problem.variables)
    if n == 1:
        points = [[i / (COARSE_ONE - 1.0)] for i in range(COARSE_ONE)]
    else:
        points = qmc.Sobol(n, scramble=False).random(2 ** math.ceil(math.log2(COARSE_EACH * n))).tolist()
    designs = [unscaled(problem.variables, point) for point in points]
    start = None if problem.start is None else dict(problem.start)
    return [start, *designs] if start is not None and start not in designs else designs


def _between(search: Search) -> list[dict[str, float]]:
    """Return the middles of those coarse intervals in which a design may beat the best one so far."""
    variable = search.variables[0]
    good = sorted(search.good(), key=lambda evaluation: evaluation.values[variable.name])
    merits = [search.merit(evaluation) for evaluation in good]
    places = [variable.inside(evaluation.values[variable.name]) for evaluation in good]
    return [
        {variable.name: variable.outside(0.5 * (places[i] + places[i + 1]))}
        for i in range(len(good) - 1)
        if min(merits[i], merits[i + 1]) <= WORTH_A_LOOK * min(merits)
    ]


def _basins(search: Search, good: list[Evaluation]) -> list[Evaluation]:
    """Return the best designs of the coarse stage; with one variable the best of its local minima."""
    ranked = sorted(good, key=search.merit)
    if len(search.variables) > 1:
        return ranked[:BASINS]
    name = search.variables[0].name
    along = sorted(good, key=lambda evaluation: evaluation.values[name])
    merits = [math.inf, *(search.merit(evaluation) for evaluation in along), math.inf]
    minima = [e for i, e in enumerate(along) if merits[i] >= merits[i + 1] <= merits[i + 2]]
    return sorted(minima, key=search.merit)[:BASINS]


def basins_of(search: Search, found: list[Local]) -> tuple[Basin, ...]:
    """Return the local optima that differ, best first."""
    basins: list[Basin] = []
    places: list[list[float]] = []
    for local in sorted(found, key=lambda local: local.merit):
        z = [variable.inside(local.evaluation.values[variable.name]) for variable in search.variables]
        if any(math.dist(z, other) <= SAME_PLACE for other in places):
            continue
        places.append(z)
        basins.append(
            Basin(
                values=dict(local.evaluation.values), peak=local.evaluation.peaks[0].value,
                objective=local.evaluation.objective, settled=local.settled, feasible=local.feasible,
            )
        )  # fmt: skip
    return tuple(basins)


def _result(search: Search, found: list[Local], status: DesignStatus, seconds: float) -> DesignResult:
    """Put the result together; after a stop the best design so far stands in it."""
    best = min(found, key=lambda local: local.merit, default=None)
    evaluation = best.evaluation if best else min(search.good(), key=search.merit, default=None)
    return DesignResult(
        problem=search.problem, method=Method.MINIMAX, status=status, evaluation=evaluation,
        conditions=None if best is None else best.conditions, basins=basins_of(search, found),
        history=tuple(search.history), work=float(sum(len(e.responses) for e in search.history)),
        seconds=seconds,
    )  # fmt: skip
