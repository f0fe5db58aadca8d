"""A sweep over exact orbits: each is looked for beside its neighbour, and steps follow the curve.

A point is kept where a line or a parabola through those before it foresees it; else one half-way is put
between. The walk stops at the resonances of the structure with its contacts stuck and slipping, which are the
poles of these two modes, and beside them, so that narrow ones are not stepped over.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from solver.balance.kernels.output import HALF_RANGE, MAX_ABS, MEAN, MEASURES, RESIDUAL
from solver.balance.balance import Kind
from solver.continuation.bracketing import closing_in, least_between
from solver.continuation.branch import BranchStatus
from solver.continuation.branches.sweep import check_limit
from solver.continuation.branch import uncertain
from solver.continuation.extrema.extrema import band_limit
from solver.continuation.parameter_scale import check_range
from solver.continuation.branch import Band, Edge, Peak
from solver.continuation.stretches import Course
from solver.continuation.walk import ContinuationSettings
from solver.continuation.walk import Curve, Pace, walk
from solver.errors import SettingError
from solver.jit.timer import clock
from solver.response.contact_response import code_of
from stickslip.lab.proofs.exact.exact_branch import ExactBranch, Orbits, Point
from stickslip.lab.proofs.exact.piecewise import MemberState, Piecewise
from solver.contacts.pieces.line import FREE, STICK
from solver.response.solution import HISTORY_DEPENDENT, MEAN_UNDETERMINED, Solution, SolutionStatus
from solver.results.watch import OnProgress, ShouldStop, shows_progress
from solver.scene.scene import Scene

_OFF = 0.02  # of the highest amplitude so far, by which a point may lie beside what is foreseen
_PACE = Pace(first=1.0 / 64, least=1e-5, largest=1.0 / 24, easy=0.3)  # of the range
_LAST_TRIED = 1.0 / 1024  # of the range: nearer to where there is no response than that the branch ends
_SUPERHARMONICS = 5  # a resonance is met at its frequency over 1 … that
_BESIDE = (-4.0, -1.0, 0.0, 1.0, 4.0)  # half-widths from a resonance at which the walk stops
_LIGHTLY = 1e-9  # damping ratio of a pole that nothing damps
_NEAREST = 1e-10  # relative, of a peak's and an edge's place
_TRIALS = 500  # of a peak
_SMALL = 0.01  # of the highest peak: lower ones are not looked at
_ENDINGS = {
    SolutionStatus.RATCHETS: BranchStatus.RATCHETS,
    SolutionStatus.RIGID_OPENS: BranchStatus.RIGID_OPENS,
    SolutionStatus.NO_ORBIT: BranchStatus.NO_ORBIT,
}
_NOT_PROVEN = (
    "points of exact orbits follow the curve and the resonances of the structure with its contacts stuck and "
    "slipping, and nothing bounds what is between"
)


@shows_progress("sweep")
def sweep_exactly(
    scene: Scene, parameter: str = "frequency", start: float | None = None, stop: float | None = None, *,
    harmonics: int = 11, frequency_hz: float | None = None, limit: float | None = None,
    settings: ContinuationSettings | None = None, course: Course | None = None,
    on_progress: OnProgress = None, should_stop: ShouldStop = None, **others: Any,
) -> ExactBranch:  # fmt: skip
    """Return the exact responses over a range of one parameter; the arguments are those of `sweep`.

    Of `settings` the number of points counts. What chooses harmonics or savings of a balance changes nothing.

    Raises
    ------
    SettingError
        A bad path, range, frequency, limit or number of harmonics; a guess or a beginning of a branch; a part
        of the scene that cannot stand beside rigid contacts.
    """
    begun = clock()
    unknown = others.keys() - {"accuracy", "effects"}
    if unknown:
        raise TypeError(f"sweep takes no {', '.join(sorted(unknown))}")
    course = course or Course()
    for name in ("guess", "resume"):
        if getattr(course, name) is not None:
            raise SettingError(name, "given", "is for scenes without rigid contacts: leave it out")
    orbits = Orbits.of(scene, parameter, harmonics, frequency_hz)
    by_frequency = orbits.parameter.kind is Kind.FREQUENCY
    if by_frequency:
        start = scene.observe.band[0] if start is None else start
        stop = scene.observe.band[1] if stop is None else stop
    first, last = check_range(orbits.parameter, start, stop)
    check_limit(limit)
    orbit = OrbitWalk(orbits, first, last, (settings or ContinuationSettings()).most_points)
    for point in orbit.points():
        if course.on_points is not None:
            course.on_points(np.array([point.value]), np.array([point.height]))
        if on_progress is not None:
            on_progress((point.value - first) / (last - first), len(orbit.found))
        if should_stop is not None and should_stop():
            orbit.status = BranchStatus.STOPPED
            break
    branch = _finished(orbit, limit, begun)
    if on_progress is not None and branch.reached:
        on_progress(1.0, len(branch.values))
    return branch


class OrbitWalk(Curve[Point]):
    """The points of a sweep as they are found, in their order.

    Attributes
    ----------
    found : the points kept.
    status : how it ended.
    beyond : what was found at the last value tried where it ended early.
    rejected : points that were not foreseen, between which others were put.
    """

    def __init__(self, orbits: Orbits, first: float, last: float, most: int) -> None:
        self.orbits, self.first, self.last = orbits, first, last
        self.found: list[Point] = []
        self.status = BranchStatus.COMPLETED
        self.beyond: Solution | None = None
        self.rejected, self._most = 0, most
        stops, self._undamped = _resonances(orbits, first, last)
        self._pace, self._least = _PACE.times(abs(last - first)), _LAST_TRIED * abs(last - first)
        self._ahead: list[tuple[float, Point | None]] = [(value, None) for value in (last, *stops)]

    def points(self) -> Iterator[Point]:
        """Yield the points, until the end of the range or where there is no response."""
        first = self.orbits.at(self.first)
        if not first.solution.converged:
            self._lost(first, BranchStatus.NO_START)
            return
        yield self._kept(first)
        yield from walk(self, self._pace)

    @property
    def ended(self) -> bool:
        """Whether it goes no further."""
        return not self._ahead or self.status is not BranchStatus.COMPLETED

    def tried(self, size: float) -> tuple[Point | None, float]:
        """Try the next point ahead, no farther than `size`; one not foreseen is kept for later."""
        here, (target, known) = self.found[-1], self._ahead.pop()
        gap = abs(target - here.value)
        if known is None and gap > 1.0001 * size:
            self._ahead.append((target, None))
            target, gap = here.value + math.copysign(size, target - here.value), size
        new = self.orbits.at(target, here) if known is None else known
        off = self._off(new) if new.solution.converged else math.inf
        if off > 1.0 and gap > (self._pace.least if new.solution.converged else self._least):
            self.rejected += 1
            self._ahead += [(target, new), (0.5 * (here.value + target), None)]
            return None, gap
        if not new.solution.converged:  # only a start from rest says that there is none
            new = self.orbits.at(target)
        if off > 1.0 and any(_between(pole, here, new) for pole in self._undamped):
            self.status = BranchStatus.UNDAMPED
            return None, 0.0
        if not new.solution.converged:
            self._lost(new, BranchStatus.STALLED)
            return None, 0.0
        return self._kept(new), self._pace.after(gap, off)

    def _kept(self, new: Point) -> Point:
        """Stand at a point."""
        self.found.append(new)
        if self._ahead and len(self.found) >= self._most:
            self.status = BranchStatus.TOO_MANY_POINTS
        return new

    def _lost(self, new: Point, otherwise: BranchStatus) -> None:
        """End where there is no response."""
        self.beyond = new.solution
        self.status = _ENDINGS.get(new.solution.status, otherwise)

    def _off(self, new: Point) -> float:
        """Return how far a point lies beside what those before foresee, relative to what it may."""
        values = [each.value for each in self.found[-3:]]
        heights = [each.height for each in self.found[-3:]]
        size = max(new.height, max(each.height for each in self.found))
        beside = min(
            abs(new.height - _extrapolated(values[-k:], heights[-k:], new.value))
            for k in range(min(2, len(values)), len(values) + 1)
        )
        return beside / (_OFF * size) if size > 0.0 else 0.0


def _extrapolated(values: Sequence[float], heights: Sequence[float], at: float) -> float:
    """Return Lagrange's polynomial through points at a value."""
    total = 0.0
    for i, height in enumerate(heights):
        others = [value for j, value in enumerate(values) if j != i]
        total += height * math.prod((at - other) / (values[i] - other) for other in others)
    return total


def _between(value: float, one: Point, other: Point) -> bool:
    return (value - one.value) * (value - other.value) <= 0.0


def _resonances(orbits: Orbits, first: float, last: float) -> tuple[list[float], list[float]]:
    """Return where a sweep stops at and beside resonances, the last first, and those that nothing damps."""
    if orbits.parameter.kind is not Kind.FREQUENCY:
        return [], []
    omega = 2.0 * math.pi * first
    system = Piecewise(orbits.scene.at_frequency(first), omega)
    closed = np.ones(len(system.members), np.bool_)
    pressed = np.zeros(len(system.gaps), np.bool_)
    stops: list[float] = []
    undamped: list[float] = []
    for does in (STICK, FREE):
        state = MemberState(np.full(len(system.kt), does, np.int64), closed, pressed)
        poles = np.linalg.eigvals(system.mode(state).A[: 2 * system.n, : 2 * system.n]).astype(np.complex128)
        for pole in poles[poles.imag > 0.0].tolist():
            natural, width = abs(pole) * first, -pole.real * first
            for k in range(1, _SUPERHARMONICS + 1):
                if width <= _LIGHTLY * natural:
                    undamped.append(natural / k)
                else:
                    stops += [(natural + share * width) / k for share in _BESIDE]
    inside = sorted({value for value in stops if min(first, last) < value < max(first, last)})
    return (inside[::-1] if last > first else inside), undamped


def _finished(walk: OrbitWalk, limit: float | None, begun: float) -> ExactBranch:
    """Refine the peaks, measure the band, and put all together."""
    orbits = walk.orbits
    points = sorted(
        [*walk.found, *_summits(walk)], key=lambda each: each.value, reverse=walk.last < walk.first
    )
    tops = _peaks(points)
    peaks = tuple(peak for peak, _ in tops)
    at = band_limit(limit, peaks, orbits.parameter.kind)
    solutions = tuple(each.solution for each in points)
    measures = np.full((len(points), MEASURES), np.nan)
    for row, each in zip(measures, points, strict=True):
        found = each.solution
        row[[MAX_ABS, HALF_RANGE, MEAN, RESIDUAL]] = (
            each.height, found.half_peak_to_peak, found.mean, found.residual,
        )  # fmt: skip
    highest = tops[0][1].solution if tops else None
    values = np.array([each.value for each in points])
    gap = float(np.abs(np.diff(values)).max()) if len(points) > 1 else math.nan
    every = {flag for each in solutions for flag in each.flags}
    return ExactBranch(
        orbits=orbits, status=walk.status, start=walk.first, stop=walk.last, values=values,
        observed=np.array([each.observed for each in solutions] or np.zeros((0, 2 * orbits.n_harmonics + 1))),
        measures=measures,
        states=np.array(
            [[code_of(contact.state) for contact in each.contacts] for each in solutions], np.int64
        ).reshape(-1, len(orbits.scene.contacts)),
        peaks=peaks, band=None if at is None else _band(orbits, points, at),
        error_estimate=math.nan if highest is None else highest.error_estimate,
        newton_iterations=sum(each.newton_iterations for each in solutions),
        rejected_steps=walk.rejected, seconds=clock() - begun,
        peak_certificate=uncertain(_NOT_PROVEN, gap),
        flags=tuple(flag for flag in (MEAN_UNDETERMINED, HISTORY_DEPENDENT) if flag in every),
        solutions=solutions, highest=highest, beyond=walk.beyond,
        verdicts=tuple(point.solution.stability for _, point in tops),
    )  # fmt: skip


def _summits(walk: OrbitWalk) -> Iterator[Point]:
    """Yield the maxima between points, polished by Brent's method (golden section and parabolas)."""
    points = walk.found
    heights = [each.height for each in points]
    for i in range(1, len(points) - 1):
        if heights[i] < max(heights[i - 1], heights[i + 1], _SMALL * max(heights)) or heights[i] == 0.0:
            continue
        if heights[i] == heights[i - 1]:
            continue  # of a plateau its first point counts

        def beside(value: float, near: Point = points[i]) -> Point | None:
            point = walk.orbits.at(value, near)
            return point if point.solution.converged else None

        low, high = sorted((points[i - 1].value, points[i + 1].value))
        best = least_between(beside, lambda each: -each.height, low, high, _NEAREST * abs(high), _TRIALS, 0.0)
        if best is not None and best.height > heights[i]:
            yield best


def _peaks(points: Sequence[Point]) -> list[tuple[Peak, Point]]:
    """Return the maxima among points with the ends, highest first."""
    heights = [-math.inf, *(each.height for each in points), -math.inf]
    found = []
    for i, point in enumerate(points):
        if heights[i] < point.height >= heights[i + 2]:
            found.append((point.peak(interior=0 < i < len(points) - 1), point))
    return sorted(found, key=lambda each: -each[0].value)


def _band(orbits: Orbits, points: Sequence[Point], limit: float) -> Band:
    """Return where the amplitude exceeds a limit; its ends closed in by exact responses."""
    rising = sorted(points, key=lambda each: each.value)
    edges: list[Edge] = []
    ends: list[float] = [rising[0].value] if rising[0].height > limit else []
    known = True

    def above(point: Point) -> float:
        return point.height - limit if point.solution.converged else -limit

    for low, high in pairwise(rising):
        if (low.height > limit) == (high.height > limit):
            continue

        def at(share: float, low: Point = low, high: Point = high) -> Point:
            return orbits.at(low.value + share * (high.value - low.value), low)

        point = low
        for new, off, width in closing_in(at, above, above(low), above(high)):
            point = new
            if off == 0.0 or width * (high.value - low.value) <= _NEAREST * high.value:
                break
        known &= point.solution.converged
        ends.append(point.value)
        edges.append(Edge(at=point.value, solution=point.motions.ravel(), opens=high.height > limit))
    if rising[-1].height > limit:
        ends.append(rising[-1].value)
    intervals = tuple(zip(ends[::2], ends[1::2], strict=True))
    width = sum(high - low for low, high in intervals)
    return Band(limit=limit, width=width, intervals=intervals, edges=tuple(edges), known=known)
