"""Peaks of the frequency response as lines over a parameter: found by sweeps, followed by continuation.

A tracked peak is an attained amplitude at every value of the parameter, so the highest of all lines bounds
the highest peak from below everywhere; a sweep shows what no line has reached yet.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from solver import fourier
from solver.balance import build
from solver.branch import Peak
from solver.contact_rows import law_numbers
from solver.continuation import sweep
from solver.errors import SettingError
from solver.fourier import Integer, Real
from solver.kernels import track as kernel
from solver.kernels.laws_columns import COULOMB
from solver.kernels.summit import SIGN, SPENT, Summit, new_summit, summit_numbers
from solver.kernels.system import System, by_reference
from solver.kernels.track import (
    COLUMNS,
    HEIGHT,
    OMEGA,
    PLACE,
    SLOPE,
    Ridge,
    Z,
    polish,
    track,
)
from solver.lines import EVERYWHERE, Glance, Line, LineEnd, Look, Pace, glance_at
from solver.rivals import Rival, rivals
from solver.savings import Effects
from solver.scale import scale_of
from solver.scene import Scene

SAME = (
    1e-3  # relative distance, in height and a fifth of it in frequency, within which two peaks are the same
)
Place = tuple[Real, Real, Real]  # row (COLUMNS,), solution and tangent (n_unknowns,) of a line at one z
_MOST_ROWS = 600
SUBDIVIDED = 6  # places between two rows at which the envelope is looked at
ROUNDING = 1e-12
FEWEST = 3  # harmonics of a glance
ABOUT = 0.01  # relative height that a row that does not fit may lack
CAREFUL = 3e-4  # share of the range: first step where lines are close
EXACTLY = 1e-6  # relative distance within which a peak is one that was solved at the same place


_ENDS = {
    kernel.ARRIVED: LineEnd.ARRIVED,
    kernel.VANISHED: LineEnd.VANISHED,
    kernel.LEFT_BAND: LineEnd.LEFT_BAND,
    kernel.TOO_LONG: LineEnd.TOO_LONG,
    kernel.NOT_FOUND: LineEnd.NOT_FOUND,
}


def check_laws(scene: Scene) -> None:
    """Refuse contacts whose force has no exact second derivatives here.

    Raises
    ------
    SettingError
        A contact that is not elastic Coulomb friction under a given load.
    """
    laws = law_numbers(scene)
    others = [contact.name for contact, law in zip(scene.contacts, laws, strict=True) if law != COULOMB]
    if others:
        wanted = (
            f"has contacts with another law than coulomb ({', '.join(others)}), so its peaks are not tracked"
        )
        raise SettingError("scene", scene.name, f"{wanted}: use sweeps, or a map without the ridge")


class Tracker:
    """Sweeps and lines of one scene and parameter; the arrays of the compiled loops are its own."""

    def __init__(
        self, scene: Scene, parameter: str, start: float, stop: float, harmonics: int,
        effects: Effects | None, pace: Pace = EVERYWHERE,
    ) -> None:  # fmt: skip
        self.scale = scale_of(scene, parameter, start, stop)
        self.balance = build(
            scene, parameter, harmonics=harmonics, frequency_hz=scene.observe.band[0], effects=effects
        )
        check_laws(self.balance.scene)
        self._effects, self._pace, self._first_step = effects, pace, pace.first_step
        self.lines: list[Line] = []
        self.looks: list[Look] = []
        self.glances: list[Glance] = []
        self.exact_between: set[tuple[float, float, float]] = set()  # z, z and height of rows: cubics hold
        self._scene, self._harmonics = self.balance.scene, harmonics
        self._system: System = by_reference(self.balance.system)
        self._summit: Summit = new_summit(self._system)

    @property
    def enough(self) -> float:
        """The height from which a line only has to show that it is higher [m]."""
        least = min((look.top for look in self.looks if look.seen), default=math.inf)
        return least * self._pace.above

    def follow_up_to(self, above: float) -> None:
        """Set `Pace.above` for the lines to come, and for what counts as a minimum of those there are."""
        self._pace = replace(self._pace, above=above)

    @property
    def spent(self) -> int:
        """Evaluations of the balance in following peaks so far."""
        return int(summit_numbers(self._summit)[SPENT])

    def look(self, z: float) -> Look:
        """Sweep at z."""
        path = self.balance.parameter.path
        branch = sweep(
            self._scene.with_values({path: self.scale.outside(z)}), harmonics=self._harmonics,
            effects=self._effects,
        )  # fmt: skip
        top = branch.peaks[0].value if branch.peaks else -math.inf
        higher = bool(self.lines) and top > float(self.envelope(np.array([z]))[0]) * (1.0 + SAME)
        look = Look(z=z, branch=branch, surprising=higher)
        self.looks.append(look)
        return look

    def follow(self, look: Look, share: float, solved: Mapping[int, Real] | None = None) -> bool:
        """Follow every peak of a sweep above `share` of the highest that is on no line yet.

        Parameters
        ----------
        solved : rows of lines at the same place, which tell more exactly than their cubics what is on them.

        Returns
        -------
        Whether there is a new line.
        """
        before, ks = len(self.lines), look.branch.balance.system.ks
        # A peak that the lines there do not know may have one of them close beside it.
        self._first_step = min(self._pace.first_step, math.inf if solved is None else CAREFUL)
        for peak in look.branch.peaks:
            if peak.value >= share * look.top and not self.known(look.z, peak, solved):
                self._follow(look.z, peak, ks)
        return len(self.lines) > before

    def follow_rivals(self, look: Look, share: float) -> None:
        """Follow the peaks of max x and of −min x that the other of the two hides in a sweep."""
        for rival in rivals(look.branch):
            if rival.value >= share * look.top:
                u = self._fitted(rival.solution, look.branch.balance.system.ks)
                self._draw(look.z, rival.omega, u, (rival.sign, math.nan), fixed=False)

    def glance(self, z: float) -> Glance:
        """Look at z with fewer harmonics, in which peaks lie nearly where they are."""
        path, fewer = self.balance.parameter.path, max(FEWEST, self._harmonics // 2)
        scene = self._scene.with_values({path: self.scale.outside(z)})
        glance = glance_at(z, scene, min(fewer, self._harmonics), self._effects)
        self.glances.append(glance)
        return glance

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
        before, u, z = len(self.lines), self._fitted(guess.solution, glance.ks), glance.z
        self._first_step = self._pace.first_step
        start = (guess.sign, math.nan)
        _, rows, solutions, _, sign = self._track(z, z, guess.omega, u, start, fixed=False)
        if len(rows) == 0 or rows[0, HEIGHT] < share * self.envelope(np.array([z]))[0]:
            return False
        if not self._met(rows[0]):
            extremum = sign, float(rows[0, PLACE])
            self._draw(z, float(rows[0, OMEGA]), solutions[0], extremum, fixed=False, within=within)
        return len(self.lines) > before

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

    def envelope(self, z: Real) -> Real:
        """Return the height of the highest line; −inf where there is none."""
        heights = [line.heights(z) for line in self.lines]
        return np.max(heights, axis=0) if heights else np.full(z.size, -np.inf)

    def exact(self, line: Line, z: float, *, fitting: bool = True) -> Real | None:
        """Return the row of a line at z, solved; None if it is not found there; see `solved`."""
        same = np.flatnonzero(line.rows[:, Z] == z)
        if same.size:
            exact_row: Real = line.rows[same[0]]
            return exact_row
        if not line.low < z < line.high:
            return None
        place = self.solved(line, z, fitting=fitting)
        return None if place is None else place[0]

    def solved(self, line: Line, z: float, *, fitting: bool = True) -> Place | None:
        """Return row, solution and tangent of a line between two of its rows; None if it is not found.

        Parameters
        ----------
        fitting : whether it has to fit the rows beside it; otherwise about as high, or higher, will do,
            because a kink may lie between: what is found is attained in any case.
        """
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
        u = self._fitted(peak.solution, ks)
        self._draw(z, 2.0 * math.pi * peak.at, u, (0.0, 0.0), fixed=not peak.interior)

    def _draw(
        self, z: float, omega: float, u: Real, extremum: tuple[float, float], *, fixed: bool,
        within: tuple[float, float] = (-math.inf, math.inf),
    ) -> None:  # fmt: skip
        """Add the line through a peak; `extremum` is its sign (0: the larger of the two) and place."""
        low, high = self._wanted(z)
        low, high = max(low, within[0]), min(high, within[1])
        if low == high:
            return
        up = self._track(z, high, omega, u, extremum, fixed=fixed)
        down = self._track(z, low, omega, u, extremum, fixed=fixed)
        if len(up[1]) == 0 or len(down[1]) == 0:
            return
        line = Line(
            rows=np.concatenate([down[1][:0:-1], up[1]]), solutions=np.concatenate([down[2][:0:-1], up[2]]),
            tangents=np.concatenate([down[3][:0:-1], up[3]]), sign=up[4], fixed=fixed, ends=(down[0], up[0]),
        )  # fmt: skip
        self.lines.append(line)
        for end, row in zip(line.ends, (0, -1), strict=True):
            if end is LineEnd.LEFT_BAND and not fixed:
                edge = min(self._band, key=lambda omega: abs(omega - line.rows[row, OMEGA]))
                extremum = line.sign, float(line.rows[row, PLACE])
                self._draw(float(line.rows[row, Z]), edge, line.solutions[row].copy(), extremum, fixed=True)
        if fixed:
            self._enter(line)

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

    def _enter(self, line: Line) -> None:
        """Follow the peak that comes in at an end of the band: there the amplitude begins to fall outward."""
        outward = 1.0 if line.rows[0, OMEGA] > 0.5 * sum(self._band) else -1.0
        inward = np.flatnonzero(line.rows[:, SLOPE] * outward < 0.0)
        if inward.size == 0 or inward.size == len(line.rows):
            return
        begin = inward[0] if inward[0] > 0 else inward[np.flatnonzero(np.diff(inward, append=-1) != 1)[0]]
        row = line.rows[begin]
        z, omega, u = float(row[Z]), float(row[OMEGA]), line.solutions[begin].copy()
        for other in self.lines:
            if not other.fixed and abs(other.frequencies(np.array([z]))[0] - omega) <= 2.0 * SAME * omega:
                return
        self._draw(z, omega, u, (line.sign, float(row[PLACE])), fixed=False)

    @property
    def _band(self) -> tuple[float, float]:
        low, high = self._scene.observe.band
        return 2.0 * math.pi * low, 2.0 * math.pi * high

    def _ridge(self, start: float, stop: float, *, fixed: bool) -> Ridge:
        (low, high), pace, span = self._band, self._pace, self.scale.span
        if fixed:  # the end of the band itself, and rounding of it, is inside
            low, high = low * (1.0 - ROUNDING), high * (1.0 + ROUNDING)
        return Ridge(
            start=start, stop=stop, logarithmic=self.scale.logarithmic, low=low, high=high, fixed=fixed,
            first_step=self._first_step * span, largest_step=pace.largest_step * span,
            smallest_step=pace.smallest_step * span, height_error=pace.height_error,
            omega_error=pace.omega_error, enough=self.enough, slack=pace.slack,
            climb_from=pace.climb_from * span,
        )  # fmt: skip

    def _track(
        self, start: float, stop: float, omega: float, u: Real, extremum: tuple[float, float],
        *, fixed: bool,
    ) -> tuple[LineEnd, Real, Real, Real, float]:  # fmt: skip
        """Follow a peak one way; return why it ended, its rows, solutions, tangents and its sign."""
        nt = self.balance.n_unknowns
        rows = np.zeros((_MOST_ROWS, COLUMNS))
        solutions, tangents = np.zeros((_MOST_ROWS, nt)), np.zeros((_MOST_ROWS, nt))
        ridge = self._ridge(start, stop, fixed=fixed)
        code, count = track(
            self._system, ridge, u, omega, extremum[1], extremum[0], self._summit, rows, solutions, tangents
        )
        found = float(summit_numbers(self._summit)[SIGN])
        return (
            _ENDS[code], rows[:count].copy(), solutions[:count].copy(), tangents[:count].copy(), found,
        )  # fmt: skip

    def _fitted(self, solution: Real, ks: Integer) -> Real:
        """Return a solution of a sweep with the harmonics kept here."""
        mine, n = self.balance.system.ks, self.balance.n_coefficients
        if np.array_equal(ks, mine):
            return solution.copy()
        top = int(max(ks[-1], mine[-1]))
        full = fourier.to_full(solution.reshape(-1, 2 * ks.size - int(ks[0] == 0)), ks, top)
        columns = [0] if mine[0] == 0 else []
        for k in mine[mine > 0]:
            columns += [2 * int(k) - 1, 2 * int(k)]
        fitted: Real = np.ascontiguousarray(full[:, columns]).reshape(-1)
        return fitted if fitted.size == n * (self.balance.n_unknowns // max(n, 1)) else solution.copy()
