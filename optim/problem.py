"""`design`: the best damper of a scene."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping

import numpy as np
from scipy.stats import qmc

from optim.criteria import Criteria, evaluate
from optim.errors import DesignError
from optim.minimax import Local, is_flat, local_search
from optim.result import DesignResult, DesignStatus
from optim.scaling import Real, Variable, check_variables
from optim.subproblem import SLACK_WEIGHT
from solver.balance import check_harmonics
from solver.scene import Scene

COARSE_ONE = 9  # designs of the coarse stage with one variable
COARSE_EACH = 6  # and for each variable with more
WORTH_A_LOOK = 1.15  # relative height up to which an interval of the coarse stage is halved
BASINS = 2  # of the coarse stage that are searched to the end
MOST_EVALUATIONS = 400
SAME_HEIGHT = 1e-5  # relative distance within which peaks count as equally high


class _StoppedError(Exception):
    """The caller asked to stop, or the evaluations are used up."""

    def __init__(self, status: DesignStatus) -> None:
        self.status = status
        super().__init__(status.value)


class _Search:
    """Evaluates designs, keeps all of them, reports progress and looks whether to stop."""

    def __init__(
        self, scene: Scene, variables: tuple[Variable, ...], harmonics: int, limit: float | None,
        on_progress: Callable[[float, int], None] | None, should_stop: Callable[[], bool] | None,
    ) -> None:  # fmt: skip
        self.history: list[Criteria] = []
        self.variables = variables
        self._scene = scene
        self._harmonics = harmonics
        self._limit = limit
        self._on_progress = on_progress
        self._should_stop = should_stop

    def __call__(self, values: Mapping[str, float]) -> Criteria:
        """Evaluate one design with gradients."""
        if self._should_stop is not None and self._should_stop():
            raise _StoppedError(DesignStatus.STOPPED)
        if len(self.history) >= MOST_EVALUATIONS:
            raise _StoppedError(DesignStatus.TOO_MANY)
        criteria = evaluate(
            self._scene, values, harmonics=self._harmonics, limit=self._limit, should_stop=self._should_stop
        )
        self.history.append(criteria)
        if self._on_progress is not None:
            # The number of evaluations is not known beforehand: the share approaches 1 from below.
            done = len(self.history)
            self._on_progress(done / (done + 12.0), done)
        return criteria


def design(
    scene: Scene,
    *,
    variables: Mapping[str, tuple[float, float]] | None = None,
    limit: float | None = None,
    max_band_hz: float | None = None,
    harmonics: int = 11,
    start: Mapping[str, float] | None = None,
    on_progress: Callable[[float, int], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> DesignResult:
    """Choose parameters within bounds so that the highest peak over the scene's band is least.

    Parameters
    ----------
    scene : the scene; `observe` says which DOF and which band.
    variables : parameter path to (low, high); the N0 of the contact with a tied N1 if left out.
    limit : amplitude [m] above which the resonance band is measured; half power of the peak if left out.
    max_band_hz : largest width of that band allowed [Hz].
    harmonics : highest harmonic kept.
    start : a design to start from, path to value; it is tried along with those of the coarse stage.
    on_progress : called with (share done, frequency responses so far).
    should_stop : asked between responses and within them.

    Returns
    -------
    The best design with everything tried on the way; look at its status.

    Raises
    ------
    SettingError, DesignError
        Bad paths, bounds, limits or start.
    """
    begun = time.perf_counter()
    chosen = check_variables(scene, variables)
    check_harmonics(harmonics)
    for name, value in (("limit", limit), ("max_band_hz", max_band_hz)):
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if value is not None and not (number and math.isfinite(value) and value > 0.0):
            raise DesignError(name, value, "must be a number > 0")
    first = _check_start(chosen, start)
    search = _Search(scene, chosen, harmonics, limit, on_progress, should_stop)
    local, status = None, DesignStatus.STOPPED
    try:
        local, status = _search(search, first, max_band_hz)
    except _StoppedError as stop:
        status = stop.status
    if on_progress is not None and local is not None:
        on_progress(1.0, len(search.history))
    return _result(scene, search, local, status, max_band_hz, time.perf_counter() - begun)


def _check_start(
    variables: tuple[Variable, ...], start: Mapping[str, float] | None
) -> dict[str, float] | None:
    """Return the start with every variable in it, or None.

    Raises
    ------
    DesignError
        A path that is no variable, a missing one, or a value out of bounds.
    """
    if start is None:
        return None
    paths = [variable.path for variable in variables]
    for path in start:
        if path not in paths:
            raise DesignError("start", path, f"must name the variables {', '.join(paths)}")
    for variable in variables:
        value = start.get(variable.path)
        if value is None or not variable.low <= value <= variable.high:
            raise DesignError(
                f"start.{variable.path}", value, f"must be from {variable.low} to {variable.high}"
            )
    return {path: float(start[path]) for path in paths}


def _search(
    search: _Search, start: dict[str, float] | None, max_band_hz: float | None
) -> tuple[Local | None, DesignStatus]:
    """Run the coarse stage, then a local search from the best designs of it that lie in different basins."""
    for values in _coarse(search.variables, start):
        search(values)
    if len(search.variables) == 1:
        for values in _between(search, max_band_hz):
            search(values)
    good = [criteria for criteria in search.history if criteria.good]
    if not good:
        return None, DesignStatus.NO_RESPONSE
    if all(is_flat(criteria, search.variables) for criteria in good):
        nothing = np.zeros(len(good[0].peaks))
        return Local(
            criteria=good[0], settled=True, optimality=0.0, peak_multipliers=nothing
        ), DesignStatus.FLAT
    found = [
        local_search(search, search.variables, criteria, max_band_hz)
        for criteria in _basins(good, search.variables, max_band_hz)
    ]
    best = min(found, key=lambda local: _merit(local.criteria, max_band_hz))
    band = best.criteria.band
    if max_band_hz is not None and band is not None and band.width > max_band_hz * (1.0 + 1e-6):
        return best, DesignStatus.BAND_INFEASIBLE
    return best, DesignStatus.OPTIMAL if best.settled else DesignStatus.KINK


def _coarse(variables: tuple[Variable, ...], start: dict[str, float] | None) -> list[dict[str, float]]:
    """Return the designs of the coarse stage: even in scaled variables, the start first."""
    n = len(variables)
    points: Real
    if n == 1:
        points = np.linspace(0.0, 1.0, COARSE_ONE)[:, None]
    else:
        points = qmc.Sobol(n, scramble=False).random(2 ** math.ceil(math.log2(COARSE_EACH * n)))
    designs = [
        {variable.path: variable.outside(float(z)) for variable, z in zip(variables, point, strict=True)}
        for point in points
    ]
    return [start, *designs] if start is not None and start not in designs else designs


def _between(search: _Search, max_band_hz: float | None) -> list[dict[str, float]]:
    """Return the middles of those coarse intervals in which a design may beat the best one so far."""
    variable = search.variables[0]
    good = sorted(
        (criteria for criteria in search.history if criteria.good), key=lambda c: c.values[variable.path]
    )
    merits = [_merit(criteria, max_band_hz) for criteria in good]
    places = [variable.inside(criteria.values[variable.path]) for criteria in good]
    return [
        {variable.path: variable.outside(0.5 * (places[i] + places[i + 1]))}
        for i in range(len(good) - 1)
        if min(merits[i], merits[i + 1]) <= WORTH_A_LOOK * min(merits)
    ]


def _merit(criteria: Criteria, max_band_hz: float | None) -> float:
    """Return the highest peak with the penalty of the search on the band."""
    excess = 0.0
    if max_band_hz is not None and criteria.band is not None:
        excess = max(criteria.band.width / max_band_hz - 1.0, 0.0)
    return criteria.peaks[0].value * (1.0 + SLACK_WEIGHT * excess)


def _basins(
    good: list[Criteria], variables: tuple[Variable, ...], max_band_hz: float | None
) -> list[Criteria]:
    """Return the best designs of the coarse stage; with one variable the best of its local minima."""
    ranked = sorted(good, key=lambda criteria: _merit(criteria, max_band_hz))
    if len(variables) > 1:
        return ranked[:BASINS]
    path = variables[0].path
    along = sorted(good, key=lambda criteria: criteria.values[path])
    merits = [math.inf, *(_merit(criteria, max_band_hz) for criteria in along), math.inf]
    minima = [c for i, c in enumerate(along) if merits[i] >= merits[i + 1] <= merits[i + 2]]
    return sorted(minima, key=lambda criteria: _merit(criteria, max_band_hz))[:BASINS]


def _result(
    scene: Scene, search: _Search, local: Local | None, status: DesignStatus, max_band_hz: float | None,
    seconds: float,
) -> DesignResult:  # fmt: skip
    """Put the result together; after a stop the best design so far stands in it."""
    good = [criteria for criteria in search.history if criteria.good]
    best = local.criteria if local else min(good, key=lambda c: _merit(c, max_band_hz), default=None)
    multipliers = () if local is None else tuple(float(x) for x in local.peak_multipliers if x > 1e-6)
    return DesignResult(
        scene=scene.name, status=status, optimum={} if best is None else dict(best.values), criteria=best,
        active=() if best is None else _active(best, search.variables, max_band_hz),
        optimality=math.nan if local is None else local.optimality, multipliers=multipliers,
        history=tuple(search.history), seconds=seconds,
    )  # fmt: skip


def _active(best: Criteria, variables: tuple[Variable, ...], max_band_hz: float | None) -> tuple[str, ...]:
    """Return what holds the optimum in place, in words."""
    top = best.peaks[0].value
    active = [f"peak at {peak.at:.6g} Hz" for peak in best.peaks if peak.value >= top * (1.0 - SAME_HEIGHT)]
    for variable in variables:
        value = best.values[variable.path]
        for bound, name in ((variable.low, "lower"), (variable.high, "upper")):
            if abs(value - bound) <= 1e-9 * max(abs(bound), 1e-300):
                active.append(f"{name} bound of {variable.path}")
    band = best.band
    if max_band_hz is not None and band is not None and band.width >= max_band_hz * (1.0 - 1e-4):
        active.append(f"band limit of {max_band_hz:g} Hz")
    return tuple(active)
