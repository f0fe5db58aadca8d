"""The Pareto front of peak against resonance band: what each costs in terms of the other.

Epsilon-constraint (Haimes, Lasdon, Wismer, IEEE Trans. SMC 1 (1971) 296): the least peak with the band at
most so wide, for widths between the two optima of one criterion alone. The multiplier of that limit is the
slope of the front, d peak / d band; points are added where the front is longest, and each search starts from
the best of all designs seen so far and of one predicted between the neighbours on the front.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Unpack

import numpy as np
from scipy.optimize import linprog

from optim.criteria.constraint_rows import DesignEvaluation
from optim.criteria.peak_criterion import BAND, PEAK
from optim.methods.enough_harmonics import by_first_response, only_if_known
from optim.methods.evaluator import DesignSearch, SearchStoppedError
from optim.methods.linearised import ACTIVE, Model, bounds_held
from optim.problem.checks import DesignError, whole
from optim.problem.design_problem import Limit, Method, Problem, pose
from optim.problem.problem_keys import FEWEST_POINTS, POINTS, FrontKeys, keywords
from optim.problem.variables import BoundedVariable, scaled, unscaled
from optim.results.design_result import DesignResult, DesignStatus
from optim.results.studies_result import ParetoPoint, ParetoResult, ParetoStatus, front_of
from optim.search import judge, local_search_of, solve_problem
from solver.jit.timer import clock
from solver.results.watch import OnProgress, ShouldStop, shows_progress
from solver.scene.scene import Scene

if TYPE_CHECKING:
    from optim.problem.keyword_types import FrontKeywords

FAR_APART = 0.02  # scaled distance from which the optima of two neighbours are both searched from
JUMP = 0.01  # share of the band's range within which two neighbours need no point between them
RESIDUAL = 1e-6  # of the first-order conditions, relative objective per scaled variable
NOTHING_TO_TRADE = 1e-6  # relative width of the front below which the two optima are one
MOST_EVALUATIONS = 5000
FOUND = (
    DesignStatus.OPTIMAL, DesignStatus.AT_BOUND, DesignStatus.KINK, DesignStatus.LOCAL,
    DesignStatus.NOT_KNOWN,
)  # fmt: skip


@shows_progress("front")
@keywords(FrontKeys)
def pareto_front(
    scene: Scene,
    *,
    points: int = POINTS,
    limits: Sequence[Limit] = (),
    on_progress: OnProgress = None,
    should_stop: ShouldStop = None,
    **problem: Unpack[FrontKeywords],
) -> ParetoResult:
    """Return the designs of which none has both a lower peak and a narrower band than another.

    What is minimised and the limit on the band are the front's own.

    Parameters
    ----------
    scene : the scene; `observe` says which DOF and which band.
    points : how many, both ends included.
    limits : bounds with types, in place of the keys `max_peak` and its like.
    on_progress : called with (share done, designs evaluated so far).
    should_stop : asked between responses and within them.
    **problem : the keys of a problem.

    Returns
    -------
    The front from the least peak to the narrowest band; look at its status.

    Raises
    ------
    SettingError, SceneError, DesignError
        Bad paths, bounds, cases, limits, start or number of points.
    TypeError
        An argument that is no key.
    """
    begun = clock()
    posed = pose(scene, limits, **problem)
    whole("points", points, least=FEWEST_POINTS)
    if posed.method is Method.PERFORMANCE_CURVE:
        raise DesignError("method", posed.method.value, "must be another one: a curve knows no band")
    # The designs of a front are compared by one measure: that of the first response.
    measured, told = by_first_response(posed, should_stop)
    front = _Front(replace(measured, keeps_measure=True), points, on_progress, should_stop)
    front.evaluations = len(told)
    status = front.run()
    if on_progress is not None:
        on_progress(1.0, max(front.reported, front.evaluations))
    kept, dominated = front_of(front.found)
    claims = status in (ParetoStatus.COMPLETE, ParetoStatus.NO_TRADE_OFF)
    if claims and any(point.design.status is DesignStatus.NOT_KNOWN for point in front.found):
        status = ParetoStatus.NOT_KNOWN
    return ParetoResult(
        problem=front.problem, status=status, ends=tuple(front.ends), points=kept, dominated=dominated,
        missed=tuple(front.missed), evaluations=front.evaluations, seconds=clock() - begun,
    )  # fmt: skip


class _Front:
    """A front on its way."""

    def __init__(
        self, problem: Problem, points: int, on_progress: Callable[[float, int], None] | None,
        should_stop: Callable[[], bool] | None,
    ) -> None:  # fmt: skip
        self.problem, self.points = problem, points
        self.ends: list[DesignResult] = []
        self.found: list[ParetoPoint] = []
        self.missed: list[float] = []
        self.evaluations = self.reported = 0
        self._pool: list[DesignEvaluation] = []
        self._on_progress, self._should_stop = on_progress, should_stop

    def run(self) -> ParetoStatus:
        """Find both ends, then points between."""
        for weights in (self.problem.weights, {PEAK: 0.0, BAND: 1.0}):
            problem = replace(self.problem, weights=weights)
            end = solve_problem(problem, on_progress=self._report, should_stop=self._should_stop)
            risen = end.problem.harmonics > self.problem.harmonics
            self.problem = replace(self.problem, harmonics=end.problem.harmonics)
            if risen and self.ends:
                # All of a front is of the same harmonics: the other end is looked for again.
                self.evaluations += len(end.history)
                self.ends, self.found, self._pool = [], [], []
                return self.run()
            self.ends.append(end)
            self._keep(end.history)
            if end.status is DesignStatus.STOPPED:
                return ParetoStatus.STOPPED
            if end.status not in FOUND or end.band_hz is None:
                return ParetoStatus.NO_END
            self.found.append(ParetoPoint.of(end, math.nan if self.found else 0.0))
            if end.band_hz == 0.0 and len(self.found) == 1:
                return ParetoStatus.NO_TRADE_OFF
        least, narrowest = self.found
        # The front leaves the least peak with the slope 0, or steeper where peaks are equal.
        search = DesignSearch(self.problem)
        evaluation = _at_limit(least.design.evaluation, least.band_hz)  # type: ignore[arg-type]
        search.keep(evaluation)
        slope = -steepest(search.model(evaluation), self.problem.variables) * least.peak / least.band_hz
        self.found[0] = replace(least, slope=slope)
        if least.band_hz - narrowest.band_hz <= NOTHING_TO_TRADE * least.band_hz:
            return ParetoStatus.NO_TRADE_OFF
        try:
            for _ in range(self.points - 2):
                self._add(*self._longest())
        except SearchStoppedError:
            return ParetoStatus.STOPPED
        return ParetoStatus.PARTIAL if self.missed else ParetoStatus.COMPLETE

    def _report(self, share: float, count: int) -> None:
        if self._on_progress is not None:
            # Each point is as far as its search; how many evaluations that takes is not known beforehand.
            done = len(self.ends) + max(len(self.found) - 2, 0) + len(self.missed) + min(share, 0.99)
            # A tracked end reports its responses, of which one is a design: the count must not fall back.
            self.reported = max(self.reported, self.evaluations + count)
            self._on_progress(min(done / self.points, 0.99), self.reported)

    def _keep(self, history: Sequence[DesignEvaluation]) -> None:
        """Add evaluated designs to the pool of starts; what they are judged by is the same at every limit."""
        self.evaluations += len(history)
        weights = {case.name: case.weight for case in self.problem.cases}
        for evaluation in history:
            rows = tuple(
                replace(row, weight=weights[row.case] if row.quantity is PEAK else 0.0)
                for row in evaluation.rows
            )
            if evaluation.good and all(np.all(np.isfinite(row.gradient)) for row in rows):
                self._pool.append(replace(evaluation, rows=rows))

    def _longest(self) -> tuple[ParetoPoint, ParetoPoint, float]:
        """Return the neighbours farthest apart on the front and the width to search between them."""
        ordered = sorted(self.found, key=lambda point: -point.band_hz)
        tall = max(p.peak for p in ordered) - min(p.peak for p in ordered) or 1.0
        wide = ordered[0].band_hz - ordered[-1].band_hz

        def length(pair: tuple[ParetoPoint, ParetoPoint]) -> float:
            one, other = pair
            missed = sum(other.band_hz < width < one.band_hz for width in self.missed)
            across = (one.band_hz - other.band_hz) / wide
            # Two basins may lie on either side of a jump, with nothing on the front between them.
            up = (one.peak - other.peak) / tall if across > JUMP else 0.0
            return math.hypot(across, up) / 4.0**missed

        one, other = max(pairwise(ordered), key=length)
        between = [one.band_hz, *(w for w in self.missed if other.band_hz < w < one.band_hz), other.band_hz]
        gaps = list(pairwise(between))
        high, low = max(sorted(gaps, reverse=True), key=lambda gap: abs(gap[0] - gap[1]))
        return one, other, 0.5 * (high + low)

    def _add(self, one: ParetoPoint, other: ParetoPoint, width: float) -> None:
        """Search the least peak with the band at most so wide."""
        limited = replace(self.problem, limits={**self.problem.limits, BAND: width})
        search = DesignSearch(limited, self._report, self._should_stop, MOST_EVALUATIONS)
        rebound = [_at_limit(evaluation, width) for evaluation in self._pool]
        search.keep(_at_limit(self.ends[0].evaluation or rebound[0], width))
        try:
            # The best end of the local searches from the promising starts.
            share = (one.band_hz - width) / (one.band_hz - other.band_hz)
            z = [scaled(search.variables, point.values) for point in (one, other)]
            middle = search(unscaled(search.variables, z[0] + share * (z[1] - z[0])))
            starts = sorted([*rebound, *([middle] if middle.good else [])], key=search.merit)
            begin = [starts[0]]
            for evaluation in starts[1:]:
                apart = math.dist(*(scaled(search.variables, one.values) for one in (evaluation, begin[0])))
                if len(begin) < 2 and FAR_APART < apart <= math.dist(*z) + FAR_APART:
                    begin.append(evaluation)
            local_search = local_search_of(search.problem.method)
            ends = [local_search(search, search.variables, evaluation, search.model) for evaluation in begin]
            local = min(ends, key=lambda local: local.rank)
        finally:
            self._keep(search.history[1:])
        if not local.feasible:
            self.missed.append(width)
            return
        result = DesignResult(
            problem=limited, status=judge(local), evaluation=local.evaluation, conditions=local.conditions,
            method=Method.IPOPT if self.problem.method is Method.IPOPT else Method.MINIMAX, basins=(),
            history=tuple(search.history[1:]), evaluations=len(search.history) - 1,
            work=float(len(search.history) - 1), seconds=0.0,
        )  # fmt: skip
        # d peak / d band along the front [m/Hz] from the multipliers of the limit on the band.
        pull = sum(x for row, x in local.conditions.rows if row.quantity is BAND)
        slope = -pull * search.model(local.evaluation).unit / width if local.settled else math.nan
        self.found.append(ParetoPoint.of(only_if_known(result), slope))


def _at_limit(evaluation: DesignEvaluation, width: float) -> DesignEvaluation:
    """Return an evaluation judged by another limit on the band."""
    rows = [replace(row, bound=width) if row.quantity is BAND else row for row in evaluation.rows]
    return replace(evaluation, rows=tuple(rows))


def steepest(model: Model, variables: Sequence[BoundedVariable]) -> float:
    """Return the largest multiplier a limit on the band, just reached, can have; NaN where it has no end.

    At a kink the multipliers are not unique; the largest is the slope by which the optimum rises when the
    band is made narrower (Bonnans, Shapiro, Perturbation Analysis of Optimization Problems, Springer 2000,
    section 4.3).
    """
    near = model.heights >= model.heights.max() * (1.0 - ACTIVE)
    band = [row.quantity is BAND for row in model.limited]
    held = [unit for _, _, unit in bounds_held(model.z, variables)]
    columns = np.vstack([model.slopes[near], model.excess_slopes[band], *held]).T
    count, limits = int(near.sum()), int(sum(band))
    sums, price = np.zeros((2, columns.shape[1]))
    sums[:count] = 1.0
    price[count : count + limits] = -1.0
    # The optimum is known to a residual: its conditions hold within that, not exactly.
    both = np.vstack([columns, -columns])
    found = linprog(
        price, A_ub=both, b_ub=np.full(len(both), RESIDUAL), A_eq=sums[None, :], b_eq=[1.0],
        bounds=(0.0, None),
    )  # fmt: skip
    return -float(found.fun) if found.success else math.nan
