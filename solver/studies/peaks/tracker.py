"""Peaks of the frequency response as lines over a parameter: found by sweeps, followed by continuation.

A tracked peak is an attained amplitude at every value of the parameter, so the highest of all lines bounds
the highest peak from below everywhere; a sweep shows what no line has reached yet.
"""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from solver.balance.contact_hessian import check_measure, check_no_line, second_numbers
from solver.balance.kernels.output import MAX_ABS
from solver.balance.simplifications import Effects
from solver.contacts.kernels.system import System, by_reference
from solver.contacts.laws.contact_law import without_second
from solver.continuation.bracketing import dense_between
from solver.continuation.branch import Peak
from solver.continuation.extrema.extrema import Rival, rivals
from solver.continuation.extrema.kernels.amplitude_hessian import (
    SIGN,
    SPENT,
    Summit,
    new_summit,
    summit_numbers,
    summit_seconds,
)
from solver.continuation.extrema.kernels.peak_continuation import (
    COLUMNS,
    HEIGHT,
    OMEGA,
    PLACE,
    Ridge,
    Z,
    polish,
)
from solver.continuation.walk import Pace, walk
from solver.errors import SettingError
from solver.jit.fourier import Integer, Real
from solver.scene.scene import Scene
from solver.studies.peaks.peak_lines import (
    CROSSING,
    MOST_ROWS,
    BandEndCrossing,
    FollowedPeak,
    HeldAmplitude,
    Line,
    LineEnd,
    Seed,
    crossings,
    entries,
    fitted,
    leavings,
    nearest,
    passes,
)
from solver.studies.peaks.survey import EVERYWHERE, SAME, Allowance, Glance, Look, Looking, TrackingPace

Place = tuple[Real, Real, Real]  # row (COLUMNS,), solution and tangent (n_unknowns,) of a line at one z
SUBDIVIDED = 6  # places between two rows at which the envelope is looked at
ROUNDING = 1e-12
ABOUT = 0.01  # relative height that a row that does not fit may lack
CAREFUL = 3e-4  # share of the range: first step where lines are close
AGAIN = 8  # times the peaks of one sweep are followed at most
ENDING = 0.1  # of the first step: as short as steps become before a line ends
EXACTLY = 1e-6  # relative distance within which a peak is one that was solved at the same place
# What an amplitude that is held lies above what is enough by: share of what the peak does, and at most.
ABOVE, MOST_ABOVE, LEAST_ABOVE = 0.25, 0.02, 1e-4
_Track = tuple[LineEnd, Real, Real, Real, float]  # why it ended, rows, solutions, tangents and its sign


def check_laws(scene: Scene) -> None:
    """Refuse contacts whose force has no exact second derivatives, by a SettingError."""
    others = without_second(scene.contacts)
    if others:
        wanted = f"has contacts whose law has no second derivatives, so its peaks are not tracked: {others}"
        raise SettingError("scene", scene.name, f"{wanted}; use sweeps, or a map without the ridge")


class Tracker(Looking):
    """Sweeps and lines of one scene and parameter; the arrays of the compiled loops are its own."""

    def __init__(
        self, scene: Scene, parameter: str, start: float, stop: float, harmonics: int,
        effects: Effects | None, pace: TrackingPace = EVERYWHERE, allowance: Allowance | None = None,
    ) -> None:  # fmt: skip
        check_no_line(scene)
        super().__init__(scene, parameter, start, stop, harmonics, effects, pace, allowance)
        check_laws(self.balance.scene)
        check_measure(self.balance.scene)
        self._first_step = pace.steps.first
        self.exact_between: set[tuple[float, float, float]] = set()  # z, z and height of rows: cubics hold
        self._system: System = by_reference(self.balance.system)
        self._summit: Summit = new_summit(self._system)
        summit_seconds(self._summit)[:] = second_numbers(self.balance.scene)
        self._crossings: list[BandEndCrossing] = []
        self._asked_at: Counter[float] = Counter()
        self._exact: dict[tuple[int, float, bool], tuple[Line, Real]] = {}  # by a line that is kept with it
        self._held: set[tuple[float, float, float]] = set()  # z, end of the range and amplitude asked for

    @property
    def least(self) -> float:
        """The least of the highest peaks of all sweeps [m]."""
        return min((look.top for look in self.looks if look.seen), default=math.inf)

    @property
    def enough(self) -> float:
        """The height from which a line only has to show that it is higher [m]."""
        return self.least * self._pace.above

    def follow_up_to(self, above: float) -> None:
        """Set `Pace.above` for the lines to come, and for what counts as a minimum of those there are."""
        self._pace = replace(self._pace, above=above)

    @property
    def spent(self) -> int:
        """Evaluations of the balance in following peaks so far."""
        return int(summit_numbers(self._summit)[SPENT])

    def follow(
        self, look: Look, share: float, solved: Mapping[int, Real] | None = None, *, careful: bool = False
    ) -> bool:
        """Follow every peak of a sweep above `share` of the highest that is on no line yet.

        Parameters
        ----------
        solved : rows of lines at the same place, which tell more exactly than their cubics what is on them.
        careful : whether to begin with short steps: other lines are close, or lines end close by.

        Returns
        -------
        Whether there is a new line.
        """
        before, ks = len(self.lines), look.branch.balance.system.ks
        self._asked_at[look.z] += 1
        if self._asked_at[look.z] > AGAIN:
            return False  # what is followed from there is not what was seen there
        self._first_step = min(self._pace.steps.first, CAREFUL if careful else math.inf)
        for peak in look.peaks:
            if peak.value >= share * look.top and not self.known(look.z, peak, solved):
                self._follow(look.z, peak, ks)
        return len(self.lines) > before

    def follow_rivals(self, look: Look, share: float) -> None:
        """Follow the peaks of max x and of −min x that the other of the two hides in a sweep."""
        for rival in rivals(look.branch):
            if rival.value >= share * look.top:
                self._draw(self._seed_of(look.z, rival, look.branch.balance.system.ks))

    def follow_guess(self, glance: Glance, guess: Rival, within: tuple[float, float], share: float) -> bool:
        """Solve for a peak of a glance and follow it if it is high and on no line yet.

        Parameters
        ----------
        within : z as far as which it is followed at most.
        share : of the highest line there that it has to reach.

        Returns
        -------
        Whether there is a new line.
        """
        before, z = len(self.lines), glance.z
        self._first_step = self._pace.steps.first
        seed = self._seed_of(z, guess, glance.ks)
        _, rows, solutions, _, sign = self._track(seed, z)
        if len(rows) == 0 or rows[0, HEIGHT] < share * self.envelope(np.array([z]))[0]:
            return False
        if not self._met(rows[0]):
            omega, place = float(rows[0, OMEGA]), float(rows[0, PLACE])
            self._draw(
                Seed(z=z, omega=omega, u=solutions[0], sign=sign, place=place, fixed=False, within=within)
            )
        return len(self.lines) > before

    def hold(self, low: float, high: float) -> bool:
        """Cover a stretch by amplitudes that are high enough, held from the sweeps nearest to its ends.

        Returns
        -------
        Whether there is a new line that reaches into it.
        """
        before, enough = len(self.lines), self.enough
        if not 0.0 < enough < math.inf:
            return False
        seen = sorted((look for look in self.looks if look.seen), key=lambda look: look.z)
        below = [(look, self.scale.high) for look in seen if look.z <= 0.5 * (low + high)][-1:]
        above = [(look, self.scale.low) for look in seen if look.z > 0.5 * (low + high)][:1]
        for look, end in below + above:
            more = ABOVE * (look.top / enough - 1.0)
            if more > LEAST_ABOVE and (look.z, end, enough) not in self._held:
                self._held.add((look.z, end, enough))
                self._hold(look, end, enough, min(more, MOST_ABOVE))
        return any(line.low < high and line.high > low for line in self.lines[before:])

    def _hold(self, look: Look, end: float, enough: float, more: float) -> None:
        """Add the line of an amplitude held on the broader flank of the highest peak of a sweep."""
        height, found = enough * (1.0 + more), look.branch.measures[:, MAX_ABS]
        solutions, top = look.branch.solutions, int(np.argmax(found))
        lower = np.flatnonzero(found < height)
        flanks = [*lower[lower < top][-1:], *lower[lower > top][:1]]
        if not flanks:
            return
        at = max(flanks, key=lambda row: abs(solutions[row, -1] - solutions[top, -1]))
        inner = at + (1 if at < top else -1)
        share = (height - found[at]) / (found[inner] - found[at])
        guess = (1.0 - share) * solutions[at] + share * solutions[inner]
        u, omega = fitted(guess[:-1].copy(), look.branch.balance.system.ks, self.balance), float(guess[-1])
        seed = Seed(z=look.z, omega=omega, u=u, sign=0.0, place=0.0, fixed=False, height=height)
        far = self._track(seed, end, partial(HeldAmplitude, within=0.25 * more))
        if len(far[1]) > 1:
            near = LineEnd.NOT_FOUND, far[1][:1], far[2][:1], far[3][:1], far[4]
            ways = (near, far) if end > look.z else (far, near)
            self.lines.append(_joined(*ways, fixed=False, held=True))

    def _seed_of(self, z: float, rival: Rival, ks: Integer) -> Seed:
        """Return the seed of a peak that is known as near as the points of a walk are."""
        u = fitted(rival.solution, ks, self.balance)
        return Seed(z=z, omega=rival.omega, u=u, sign=rival.sign, place=math.nan, fixed=False)

    def _met(self, row: Real) -> bool:
        """Return whether a solved peak is on a line, by solving for those that are near."""
        z = float(row[Z])
        for line in self.lines:
            at = line.frequencies(row[[Z]])[0], line.heights(row[[Z]])[0]
            if abs(at[0] / row[OMEGA] - 1.0) <= ABOUT and abs(at[1] / row[HEIGHT] - 1.0) <= ABOUT:
                exact = self.exact(line, z, fitting=False)
                if exact is not None and abs(exact[HEIGHT] / row[HEIGHT] - 1.0) <= EXACTLY:
                    return True
        return False

    def known(self, z: float, peak: Peak, solved: Mapping[int, Real] | None = None) -> bool:
        """Return whether a peak at z is on a line."""
        omega, here = 2.0 * math.pi * peak.at, np.array([z])
        for index, line in enumerate(self.lines):
            if solved is not None and index in solved:
                row = solved[index]
                near = abs(row[OMEGA] - omega) <= 10.0 * EXACTLY * omega
                if near and abs(row[HEIGHT] - peak.value) <= EXACTLY * peak.value:
                    return True
                continue
            near = abs(line.frequencies(here)[0] - omega) <= 0.2 * SAME * omega
            if near and abs(line.heights(here)[0] - peak.value) <= SAME * peak.value:
                return True
        return False

    def exact(self, line: Line, z: float, *, fitting: bool = True) -> Real | None:
        """Return the row of a line at z, solved; None if it is not found there; see `solved`."""
        same = np.flatnonzero(line.rows[:, Z] == z)
        if same.size:
            exact_row: Real = line.rows[same[0]]
            return exact_row
        if not line.low < z < line.high:
            return None
        # A minimum is looked for again behind the sweep made at it, along the same way.
        known = self._exact.get((id(line), z, fitting))
        if known is None:
            place = self.solved(line, z, fitting=fitting)
            if place is None:
                return None
            known = self._exact[id(line), z, fitting] = line, place[0]
        return known[1]

    def solved(self, line: Line, z: float, *, fitting: bool = True) -> Place | None:
        """Return row, solution and tangent of a line between two rows, None if not found; raises as `check`.

        Parameters
        ----------
        fitting : whether it has to fit the rows beside it; otherwise about as high, or higher, will do,
            because a kink may lie between: what is found is attained in any case.
        """
        if not self.allowance.ended:
            self.check()
        elif self.allowance.over:
            return None
        left = int(np.searchsorted(line.rows[:, Z], z)) - 1
        row, nt = np.zeros(COLUMNS), self.balance.n_unknowns
        solution, tangent = np.zeros(nt), np.zeros(nt)
        good = polish(
            self._system, self._ridge(line.low, line.high, fixed=line.fixed), left, z, line.sign,
            self._summit, line.rows, line.solutions, line.tangents, row, solution, tangent,
        )  # fmt: skip
        found = good
        if not good and not fitting and row[OMEGA] > 0.0:
            cubic = float(line.heights(np.array([z]))[0])
            found = bool(row[HEIGHT] >= (1.0 - ABOUT) * cubic)
        return (row, solution, tangent) if found else None

    def _follow(self, z: float, peak: Peak, ks: Integer) -> None:
        """Follow a peak from z to both ends of the range."""
        band = self._scene.observe.band
        at_end = min(abs(peak.at - end) for end in band) <= 1e-9 * band[1]
        if not peak.interior and not at_end:
            return
        u, fixed = fitted(peak.solution, ks, self.balance), not peak.interior
        self._draw(Seed(z=z, omega=2.0 * math.pi * peak.at, u=u, sign=0.0, place=0.0, fixed=fixed))

    def _draw(self, seed: Seed) -> None:
        """Add the line through a peak, and what follows from it at the ends of the band, each once."""
        waiting, given = deque([seed]), True
        while waiting:
            seed = waiting.popleft()
            if not given and self._followed(seed):
                continue
            given, line = False, self._line(seed)
            if line is None:
                continue
            self.lines.append(line)
            waiting += leavings(line, self._band)
            self._crossings += crossings(line, self._band)
            if line.fixed:
                waiting += entries(line, self._band, self, self._pace.steps.least * self.scale.span)

    def _line(self, seed: Seed) -> Line | None:
        """Return the line through a peak; None if there is nothing to follow."""
        low, high = self._wanted(seed.z)
        low, high = max(low, seed.within[0]), min(high, seed.within[1])
        if low == high:
            return None
        up = self._track(seed, high)
        down = self._track(seed, low)
        if len(up[1]) == 0 or len(down[1]) == 0:
            return None
        return _joined(down, up, fixed=seed.fixed)

    def _followed(self, seed: Seed) -> bool:
        """Return whether what follows from a line was followed already; it is then."""
        if seed.fixed:
            return passes(self.lines, seed, EXACTLY, SAME)
        one = BandEndCrossing(z=seed.z, edge=nearest(self._band, seed.omega), sign=seed.sign)
        near = CROSSING * self._pace.steps.least * self.scale.span
        known = any(one.same(other, near) for other in self._crossings)
        self._crossings.append(one)
        return known or passes(self.lines, seed, 2.0 * SAME, SAME)

    def places(self) -> Real:
        """Return where the envelope is looked at: the ends, all rows of all lines, and between them."""
        ends = np.array([self.scale.low, self.scale.high])
        nodes = np.unique(np.concatenate([ends, *(line.rows[:, Z] for line in self.lines)]))
        share = np.arange(SUBDIVIDED) / SUBDIVIDED
        between = nodes[:-1, None] + share * np.diff(nodes)[:, None]
        return np.append(between.reshape(-1), nodes[-1])

    def _wanted(self, z: float) -> tuple[float, float]:
        """Return how far a line from z is wanted both ways: as far as the others are not high enough."""
        enough = self.enough
        if math.isinf(enough) or not self.lines:
            return self.scale.low, self.scale.high
        at = self.places()
        short = np.flatnonzero(self.envelope(at) < enough)
        if short.size == 0:
            return z, z
        first, last = max(int(short[0]) - 1, 0), min(int(short[-1]) + 1, at.size - 1)
        return min(float(at[first]), z), max(float(at[last]), z)

    @property
    def _band(self) -> tuple[float, float]:
        low, high = self._scene.observe.band
        return 2.0 * math.pi * low, 2.0 * math.pi * high

    @property
    def _steps(self) -> Pace:
        """The steps of z of the lines to come."""
        own, first = self._pace.steps, self._first_step
        return replace(own, first=first, least=min(own.least, ENDING * first)).times(self.scale.span)

    def _ridge(self, start: float, stop: float, *, fixed: bool) -> Ridge:
        (low, high), pace, steps = self._band, self._pace, self._steps
        if fixed:  # the end of the band itself, and rounding of it, is inside
            low, high = low * (1.0 - ROUNDING), high * (1.0 + ROUNDING)
        return Ridge(
            start=start, stop=stop, logarithmic=self.scale.logarithmic, low=low, high=high, fixed=fixed,
            first_step=steps.first, largest_step=steps.largest, smallest_step=steps.least,
            height_error=pace.height_error, omega_error=pace.omega_error, enough=self.enough,
            slack=pace.slack, climb_from=pace.climb_from * self.scale.span,
        )  # fmt: skip

    def _track(self, seed: Seed, stop: float, what: Callable[..., FollowedPeak] = FollowedPeak) -> _Track:
        """Follow a peak, or an amplitude on its flank, one way."""
        self.check()
        peak = what(self._system, self._summit, self._ridge(seed.z, stop, fixed=seed.fixed), seed)
        for count in walk(peak, self._steps):
            self.check()
            if count == MOST_ROWS:
                break
        rows, solutions, tangents = (part[: peak.count].copy() for part in peak.found)
        return peak.end, rows, solutions, tangents, float(summit_numbers(self._summit)[SIGN])


def _joined(down: _Track, up: _Track, *, fixed: bool, held: bool = False) -> Line:
    """Return the line that goes both ways from the same row."""
    ways = zip(down[1:4], up[1:4], strict=True)
    rows, solutions, tangents = (np.concatenate([before[:0:-1], behind]) for before, behind in ways)
    return Line(
        rows=rows, solutions=solutions, tangents=tangents, sign=up[4], fixed=fixed, ends=(down[0], up[0]),
        held=held,
    )  # fmt: skip


ALLOWED = 0.25  # share of what an interval is higher by that its cubic may be wrong by
EXACT = 1e-7  # relative error of a cubic that is no error
SHORTEST = 1e-5  # share of the range below which an interval is not divided
_SAMPLES = np.linspace(0.0, 1.0, 9)
_DEEPEST = 12


def tighten(tracker: Tracker, doubt: float) -> bool:
    """Add rows to the lines where they may be lowest; return whether there is anything new.

    How far two rows fit together says little about a kink between them. So between rows that are nearly as
    low as the lowest place known, the peak in the middle is solved for and compared with the cubic; an
    interval that is higher by some share may be wrong by a quarter of that, and no more, so that nothing
    lower hides in it.

    Parameters
    ----------
    doubt : relative height above the lowest place up to which the lines have to be exact.
    """
    heights = tracker.envelope(tracker.places())
    heights = heights[np.isfinite(heights)]
    if heights.size == 0:
        return False
    least, new = float(heights.min()), False
    for index, line in enumerate(tracker.lines):
        matters = [] if line.held else _matters(tracker, line, least, doubt)
        if any(matters):
            tracker.lines[index] = _with_more(tracker, line, matters, least)
            new = True
    return new


def _matters(tracker: Tracker, line: Line, least: float, doubt: float) -> list[bool]:
    """Return of every interval of a line whether it may hold the optimum, and has not been looked at."""
    rows = line.rows
    z = rows[:-1, Z, None] + _SAMPLES * np.diff(rows[:, Z])[:, None]
    top = tracker.envelope(z.reshape(-1)).reshape(z.shape)
    heights = line.heights(z.reshape(-1)).reshape(z.shape)
    low = np.any((top <= least * (1.0 + doubt)) & (heights >= top * (1.0 - doubt)), axis=1)
    return [
        bool(low[i]) and (rows[i, Z], rows[i + 1, Z], rows[i, HEIGHT]) not in tracker.exact_between
        for i in range(len(low))
    ]


def _with_more(tracker: Tracker, line: Line, matters: list[bool], least: float) -> Line:
    """Return a line with rows added in some of its intervals."""
    known = list(zip(line.rows, line.solutions, line.tangents, strict=True))
    places: list[Place] = [known[0]]
    for (left, right), wanted in zip(pairwise(known), matters, strict=True):
        if wanted:
            places += dense_between(left, right, _DEEPEST + 1, partial(_halved, tracker, line, least))
        places.append(right)
    rows, solutions, tangents = (np.array(part) for part in zip(*places, strict=True))
    return replace(line, rows=rows, solutions=solutions, tangents=tangents)


def _halved(
    tracker: Tracker, line: Line, least: float, left: Place, right: Place, depth: int
) -> tuple[Place | None, bool]:
    """Return the place in the middle of two, and whether the cubic is as exact as it has to be."""
    a, b = left[0], right[0]
    rows, solutions, tangents = (np.array(part) for part in zip(left, right, strict=True))
    pair = replace(line, rows=rows, solutions=solutions, tangents=tangents)
    middle = None
    if b[Z] - a[Z] > SHORTEST * tracker.scale.span:
        middle = tracker.solved(pair, 0.5 * (a[Z] + b[Z]), fitting=False)
    if middle is None:
        tracker.exact_between.add((a[Z], b[Z], a[HEIGHT]))
        return None, True
    height, cubic = float(middle[0][HEIGHT]), pair.heights(a[Z] + _SAMPLES * (b[Z] - a[Z]))
    allowed = max(EXACT * least, ALLOWED * (min(float(cubic.min()), height) - least))
    enough = abs(float(cubic[_SAMPLES.size // 2]) - height) <= allowed or depth == 1
    if enough:
        for one, other in ((a, middle[0]), (middle[0], b)):
            tracker.exact_between.add((one[Z], other[Z], one[HEIGHT]))
    return middle, enough
