"""Campbell diagrams: where the orders of a running speed meet the resonances of a scene with friction.

An excitation that repeats n times a revolution has the frequency n · speed / 60. Friction moves a resonance
between its places with all contacts stuck and all contacts open, so what an order meets are the peaks of its
own frequency response, not natural frequencies; those are given beside them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from optim.problem.cases import with_engine_order
from optim.problem.checks import DesignError, range_above_zero, whole
from optim.results.studies_result import CampbellDiagram, CampbellStatus, Crossing, OrderResponse, Ranges
from solver.balance.kernels.output import MAX_ABS
from solver.balance.workspace import Workspace
from solver.continuation.branch import Branch, BranchStatus, Peak
from solver.continuation.branches.sweep import sweep
from solver.continuation.extrema.error_estimate import ErrorEstimator
from solver.jit.fourier import Real
from solver.jit.timer import clock
from solver.linear.natural_frequencies import natural_frequencies
from solver.results.watch import OnProgress, ShouldStop, part_of, shows_progress
from solver.scene.scene import Scene

_MOST_ORDERS = 100
_ROUNDING = 1e-9
_ORDER = ", the excitations a revolution"


@shows_progress("campbell")
def campbell_diagram(
    scene: Scene,
    *,
    speeds_rpm: Sequence[float] | Sequence[Sequence[float]],
    orders: Sequence[int] | None = None,
    limit: float | None = None,
    band_hz: Sequence[float] | None = None,
    harmonics: int = 11,
    on_progress: OnProgress = None,
    should_stop: ShouldStop = None,
) -> CampbellDiagram:
    """Compute the Campbell diagram of a scene.

    Parameters
    ----------
    scene : what vibrates. In a cyclic one order n excites as a wave of that engine order; elsewhere it is the
        n-th multiple of the speed. One with a `speed_order` runs along the line of each order: gyroscopic
        terms, stiffness and loads follow the speed.
    speeds_rpm : the running speeds [1/min], [low, high] or a list of such ranges.
    orders : excitations a revolution; the scene's engine order, or 1, if left out.
    limit : amplitude [m] that counts as resonance; half power of the highest peak of each order if left out.
    band_hz : frequencies looked at [Hz]; the scene's band and those of the running speeds if left out.
    harmonics : highest harmonic kept.
    on_progress : called with (share done, points so far).
    should_stop : asked now and then; True ends the diagram with the status STOPPED.

    Raises
    ------
    DesignError, SettingError
        Bad speeds, orders, band, limit or number of harmonics.
    """
    begun = clock()
    speeds, chosen = _speeds(speeds_rpm), _orders(scene, orders)
    looked_at = None if band_hz is None else range_above_zero("band_hz", band_hz, " [Hz]")
    cyclic = scene.structure.has_sectors
    alone = cyclic or scene.speed_order is not None  # each order has a response of its own
    groups = [(order,) for order in chosen] if alone else [chosen]
    found: list[OrderResponse] = []
    stopped, count = False, 0
    for i, group in enumerate(groups):
        here = with_engine_order(scene, group[0]) if cyclic else scene
        if scene.speed_order is not None:
            here = here.model_copy(update={"speed_order": float(group[0])})
        needed = [order * speed / 60.0 for order in group for pair in speeds for speed in pair]
        band = scene.observe.band
        low, high = looked_at or (min(band[0], *needed), max(band[1], *needed))
        progress = part_of(on_progress, i / len(groups), (i + 1) / len(groups), count)
        branch = sweep(
            here, start=low, stop=high, harmonics=harmonics, limit=limit, on_progress=progress,
            should_stop=should_stop,
        )  # fmt: skip
        count += len(branch.values)
        stuck, free = (natural_frequencies(here, stuck=each) for each in (True, False))
        found += [_response(branch, order, speeds, stuck, free) for order in group]
        stopped = should_stop is not None and should_stop()
        if stopped:
            break
    return CampbellDiagram(
        scene=scene, speeds_rpm=speeds, limit=limit, orders=tuple(found), n_harmonics=harmonics,
        status=_status(found, len(chosen), stopped=stopped), seconds=clock() - begun,
    )  # fmt: skip


def _status(found: Sequence[OrderResponse], asked: int, *, stopped: bool) -> CampbellStatus:
    """Return how a diagram of so many orders ended."""
    if stopped and not (len(found) == asked and found[-1].branch.reached):
        return CampbellStatus.STOPPED
    if any(one.branch.status is BranchStatus.UNDAMPED for one in found):
        return CampbellStatus.UNDAMPED
    whole = all(one.branch.reached for one in found)
    return CampbellStatus.COMPLETED if whole else CampbellStatus.INCOMPLETE


def forbidden_hz(speeds_rpm: Sequence[float] | Sequence[Sequence[float]], order: int) -> Ranges:
    """Return the frequencies [Hz] that an order excites at running speeds, [low, high] · order / 60.

    Parameters
    ----------
    speeds_rpm : [low, high] in 1/min, or a list of such ranges.
    order : excitations a revolution.

    Raises
    ------
    DesignError
        Speeds that are not ranges above 0, or an order that is not a whole number above 0.
    """
    return _scaled(_speeds(speeds_rpm), whole("order", order, least=1, more=_ORDER) / 60.0)


def _response(branch: Branch, order: int, speeds: Ranges, stuck: Real, free: Real) -> OrderResponse:
    """Return what a response means for one order."""
    per_hz = 60.0 / order
    bands = () if branch.band is None else branch.band.intervals
    exceeded = _scaled(bands, per_hz)
    inside = tuple((max(a, c), min(b, d)) for a, b in exceeded for c, d in speeds if max(a, c) < min(b, d))
    amplitudes = _Amplitudes(branch)
    peaks = sorted(branch.interior_peaks, key=lambda peak: peak.at)
    top = max(branch.start, branch.stop)
    return OrderResponse(
        order=order, branch=branch, running_hz=_scaled(speeds, 1.0 / per_hz),
        limit=math.nan if branch.band is None else branch.band.limit, bands_hz=bands, exceeded_rpm=exceeded,
        exceeded_running_rpm=inside,
        crossings=tuple(_crossing(*amplitudes.of_peak(peak), order, speeds) for peak in peaks),
        highest_running=_highest_running(amplitudes, order, speeds),
        stuck_hz=tuple(stuck[stuck <= top].tolist()), open_hz=tuple(free[free <= top].tolist()),
    )  # fmt: skip


class _Amplitudes:
    """Amplitudes of a response with their estimated errors, as (frequency [Hz], amplitude, error [m])."""

    def __init__(self, branch: Branch) -> None:
        self.branch = branch
        self._workspace = Workspace.of(branch.balance)
        self._estimator = ErrorEstimator(self._workspace)

    def of_peak(self, peak: Peak) -> tuple[float, float, float]:
        """Return a peak; of one that is no end the error is that across the branch."""
        at = 2.0 * math.pi * peak.at
        error = self._estimator.at(peak.solution, at, across=peak.interior)
        return peak.at, peak.value, error.max_abs

    def at(self, hertz: float) -> tuple[float, float, float] | None:
        """Return the amplitude at a frequency of the response; None without a solution there."""
        nearest = self.branch.solutions[int(np.argmin(np.abs(self.branch.values - hertz)))]
        found = self._workspace.solve(2.0 * math.pi * hertz, nearest[:-1])
        measured = self._workspace.measure(found.u, 2.0 * math.pi * hertz) if found.converged else None
        if measured is None:
            return None
        error = self._estimator.at(found.u, 2.0 * math.pi * hertz)
        return hertz, float(measured.values[MAX_ABS]), error.max_abs

    @property
    def elsewhere(self) -> float:
        """What the response may reach at a place that it shows no peak at, by the harmonics left out [m].

        It is in the error of the whole response, if that exceeds what its highest peak alone has.
        """
        peak, whole = self.branch.peaks[0], self.branch.error_estimate
        alone = self.of_peak(peak)[2]
        return peak.value + whole if whole > alone * (1.0 + _ROUNDING) else -math.inf


def _highest_running(amplitudes: _Amplitudes, order: int, speeds: Ranges) -> Crossing | None:
    """Return the largest amplitude at running speeds: a peak there, or the response at an end of them."""
    branch = amplitudes.branch
    if not branch.peaks:
        return None
    candidates = [amplitudes.of_peak(peak) for peak in branch.peaks]
    low, high = float(branch.values.min()), float(branch.values.max())
    for end in {order * speed / 60.0 for pair in speeds for speed in pair}:
        found = amplitudes.at(end) if low <= end <= high else None
        if found is not None:
            candidates.append(found)
    running = [one for one in candidates if _is_running(one[0] * 60.0 / order, speeds)]
    if not running:
        return None
    at, value, _ = max(running, key=lambda one: one[1])
    # A lower amplitude that is less well known may be the highest of all; one not known makes all unknown.
    reached = [height + error for _, height, error in running] + [amplitudes.elsewhere]
    error = max(reached) - value if all(map(math.isfinite, reached[:-1])) else math.nan
    return _crossing(at, value, error, order, speeds)


def _crossing(at_hz: float, amplitude: float, error: float, order: int, speeds: Ranges) -> Crossing:
    speed = at_hz * 60.0 / order
    inside = _is_running(speed, speeds)
    nearest = min((end for pair in speeds for end in pair), key=lambda end: abs(end - speed))
    margin = 0.0 if inside else abs(speed - nearest) / nearest
    return Crossing(
        speed_rpm=speed, frequency_hz=at_hz, amplitude=amplitude, inside=inside, margin=margin,
        error_estimate=error,
    )  # fmt: skip


def _is_running(speed: float, speeds: Ranges) -> bool:
    """Return whether a speed is a running speed; an end of a range is, whatever its rounding."""
    return any(low * (1.0 - 1e-12) <= speed <= high * (1.0 + 1e-12) for low, high in speeds)


def _scaled(ranges: Ranges, factor: float) -> Ranges:
    return tuple((low * factor, high * factor) for low, high in ranges)


def _speeds(speeds_rpm: object) -> Ranges:
    """Return the running speeds, ascending."""
    if not isinstance(speeds_rpm, Sequence) or isinstance(speeds_rpm, str) or not speeds_rpm:
        raise DesignError("speeds_rpm", speeds_rpm, "must be [low, high] in 1/min, or a list of such ranges")
    if isinstance(speeds_rpm[0], Sequence):
        pairs = enumerate(speeds_rpm)
        return tuple(sorted(range_above_zero(f"speeds_rpm[{i}]", pair, " [1/min]") for i, pair in pairs))
    return (range_above_zero("speeds_rpm", speeds_rpm, " [1/min]"),)


def _orders(scene: Scene, orders: object) -> tuple[int, ...]:
    """Return the orders, ascending, none twice."""
    if orders is None:
        return (max(scene.engine_order, 1),)
    if not isinstance(orders, Sequence) or isinstance(orders, str) or not orders:
        raise DesignError("orders", orders, "must be a list of at least one whole number >= 1")
    if len(orders) > _MOST_ORDERS:
        raise DesignError("orders", len(orders), f"must be at most {_MOST_ORDERS} numbers")
    return tuple(sorted({whole(("orders", i), one, least=1, more=_ORDER) for i, one in enumerate(orders)}))
