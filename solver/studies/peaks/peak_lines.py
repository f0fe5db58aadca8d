"""Peaks as lines over the parameter: where they begin, how one is followed, where it leaves the band.

A *crossing* is a place where a peak meets an end of the band. Each is followed once: a peak that comes in
where a known line went out is that line.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Annotated, Protocol

import numpy as np

from solver.balance.balance import Balance
from solver.contacts.kernels.system import System
from solver.continuation.extrema.kernels.amplitude_hessian import (
    AMPLITUDE,
    CORNER,
    CURVE,
    DA_DP,
    DRIFT,
    RATE,
    SIGN,
    TAU,
    G,
    Summit,
    balance_at,
    choose_extremum,
    find_extremum,
    observe_at,
    slopes_at,
    solve_responses,
    summit_numbers,
    summit_step,
)
from solver.continuation.extrema.kernels.peak_continuation import (
    COLUMNS,
    DHEIGHT,
    DOMEGA,
    HEIGHT,
    OMEGA,
    PLACE,
    SLOPE,
    Ridge,
    Z,
    begin_track,
    between_rows,
    record,
    step_error,
    step_track,
    value_of,
)
from solver.continuation.extrema.kernels.peak_newton import ACCEPTED
from solver.jit import fourier
from solver.jit.fourier import Integer, Real

CROSSING = 3.0  # smallest steps within which two crossings are one
_HALVINGS = 12


class LineEnd(Enum):
    """Why a line ends where it does; the value is what a user reads."""

    ARRIVED = "the end of the range"
    VANISHED = "the peak vanishes"
    LEFT_BAND = "the peak leaves the band"
    TOO_LONG = "too many steps"
    NOT_FOUND = "not found again"


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """One peak over the parameter, ascending in z (the parameter or its logarithm)."""

    rows: Annotated[
        Real,
        "Columns named in `solver.continuation.extrema.kernels.peak_continuation`, (P, COLUMNS); "
        "derivatives are by z.",
    ]
    solutions: Annotated[Real, "Slip motions [m], (P, n_unknowns)."]
    tangents: Annotated[Real, "Their derivatives by z, (P, n_unknowns)."]
    sign: Annotated[float, "1 for a peak of max x, −1 for one of −min x."]
    fixed: Annotated[bool, "The amplitude at an end of the band, not a stationary peak."]
    ends: Annotated[tuple[LineEnd, LineEnd], "Why it ends below and above."]
    held: Annotated[bool, "One amplitude on the flank of a peak, which is higher: see `HeldAmplitude`."] = (
        False
    )

    @property
    def low(self) -> float:
        """Smallest z it covers."""
        return float(self.rows[0, Z])

    @property
    def high(self) -> float:
        """Largest z it covers."""
        return float(self.rows[-1, Z])

    def heights(self, z: Real) -> Real:
        """Return the height by cubics between the rows; −inf beyond the line."""
        return self._cubic(z, HEIGHT, DHEIGHT)

    def frequencies(self, z: Real) -> Real:
        """Return ω likewise [rad/s]."""
        return self._cubic(z, OMEGA, DOMEGA)

    def _cubic(self, z: Real, value: int, slope: int) -> Real:
        rows = self.rows
        if len(rows) == 1:
            return np.where(z == rows[0, Z], rows[0, value], -np.inf)
        right = np.clip(np.searchsorted(rows[:, Z], z), 1, len(rows) - 1)
        a, b = rows[right - 1], rows[right]
        length = b[:, Z] - a[:, Z]
        t = (z - a[:, Z]) / length
        r = 1.0 - t
        cubic = (1.0 + 2.0 * t) * r * r * a[:, value] + t * t * (3.0 - 2.0 * t) * b[:, value]
        cubic += t * r * length * (r * a[:, slope] - t * b[:, slope])
        return np.where((z >= self.low) & (z <= self.high), cubic, -np.inf)


@dataclass(frozen=True, slots=True, kw_only=True)
class Seed:
    """A peak from which a line is to be followed."""

    z: Annotated[float, "Where."]
    omega: Annotated[float, "Its frequency [rad/s]."]
    u: Annotated[Real, "Slip motions near it [m], (n_unknowns,)."]
    sign: Annotated[float, "1 for a peak of max x, −1 for one of −min x, 0 for the larger."]
    place: Annotated[float, "The instant τ of it; NaN: not known."]
    fixed: Annotated[bool, "The amplitude at an end of the band."]
    within: Annotated[tuple[float, float], "z as far as which it is followed at most."] = (
        -math.inf,
        math.inf,
    )
    height: Annotated[float, "m, as far as it is known (NaN)."] = math.nan


@dataclass(frozen=True, slots=True, kw_only=True)
class BandEndCrossing:
    """Where a peak meets an end of the band."""

    z: float
    edge: float
    sign: float

    def same(self, other: BandEndCrossing, near: float) -> bool:
        """Return whether another is the same; `near`: distance in z."""
        return self.edge == other.edge and self.sign == other.sign and abs(self.z - other.z) <= near


class Solves(Protocol):
    """Solves a line between two of its rows; `solver.studies.peaks.tracker.Tracker`."""

    def solved(self, line: Line, z: float, *, fitting: bool = True) -> tuple[Real, Real, Real] | None:
        """Return row, solution and tangent."""
        ...


def leavings(line: Line, band: tuple[float, float]) -> list[Seed]:
    """Return what counts from where a line leaves the band: the amplitude at that end of it."""
    found = []
    for end, row in zip(line.ends, (0, -1), strict=True):
        if end is LineEnd.LEFT_BAND and not line.fixed:
            numbers = line.rows[row]
            found.append(
                Seed(
                    z=float(numbers[Z]), omega=nearest(band, float(numbers[OMEGA])),
                    u=line.solutions[row].copy(), sign=line.sign, place=float(numbers[PLACE]), fixed=True,
                    height=float(numbers[HEIGHT]),
                )
            )  # fmt: skip
    return found


def crossings(line: Line, band: tuple[float, float]) -> list[BandEndCrossing]:
    """Return where a line leaves the band."""
    return [BandEndCrossing(z=seed.z, edge=seed.omega, sign=seed.sign) for seed in leavings(line, band)]


def entries(line: Line, band: tuple[float, float], solves: Solves, closest: float) -> list[Seed]:
    """Return the peaks that come in along an end of the band: where its amplitude begins to fall outward.

    Parameters
    ----------
    line : the amplitude at an end of the band.
    closest : z as near as which a crossing is found.
    """
    outward = 1.0 if line.rows[0, OMEGA] > 0.5 * sum(band) else -1.0
    inside = line.rows[:, SLOPE] * outward < 0.0
    found = []
    for left in np.flatnonzero(np.diff(inside)):
        inner = int(left) + 1 if inside[left + 1] else int(left)
        places = {row: (line.rows[row], line.solutions[row]) for row in (int(left), int(left) + 1)}
        known, other = places.pop(inner), places.popitem()[1]
        for _ in range(_HALVINGS):
            if abs(known[0][Z] - other[0][Z]) <= closest:
                break
            place = solves.solved(line, 0.5 * float(known[0][Z] + other[0][Z]), fitting=False)
            if place is None:
                break
            if place[0][SLOPE] * outward < 0.0:
                known = place[0], place[1]
            else:
                other = place[0], place[1]
        row, solution = known
        found.append(
            Seed(
                z=float(row[Z]), omega=float(row[OMEGA]), u=solution.copy(), sign=line.sign,
                place=float(row[PLACE]), fixed=False, height=float(row[HEIGHT]),
            )
        )  # fmt: skip
    return found


def nearest(band: tuple[float, float], omega: float) -> float:
    """Return the end of the band that is nearer."""
    return min(band, key=lambda edge: abs(edge - omega))


def passes(lines: Sequence[Line], seed: Seed, near: float, about: float) -> bool:
    """Return whether a line of the same kind passes within relative distances of frequency and height."""
    here = np.array([seed.z])
    return any(
        line.fixed == seed.fixed
        and line.sign == seed.sign
        and abs(line.frequencies(here)[0] - seed.omega) <= near * seed.omega
        and abs(line.heights(here)[0] - seed.height) <= about * seed.height
        for line in lines
    )


def fitted(solution: Real, ks: Integer, balance: Balance) -> Real:
    """Return a solution with harmonics `ks` in those of `balance`."""
    mine, n = balance.system.ks, balance.n_coefficients
    if np.array_equal(ks, mine):
        return solution.copy()
    top = int(max(ks[-1], mine[-1]))
    full = fourier.to_full(solution.reshape(-1, 2 * ks.size - int(ks[0] == 0)), ks, top)
    columns = [0] if mine[0] == 0 else []
    for k in mine[mine > 0]:
        columns += [2 * int(k) - 1, 2 * int(k)]
    found: Real = np.ascontiguousarray(full[:, columns]).reshape(-1)
    return found if found.size == n * (balance.n_unknowns // max(n, 1)) else solution.copy()


MOST_ROWS = 600
_EASY, _SHORTER = 4, 0.8  # Newton steps beyond which the next step is shorter, and by how much


class FollowedPeak:
    """A peak as it stands at its last row.

    Attributes
    ----------
    found : rows, solutions and tangents of `step_track`, and `count` of them.
    end : why it goes no further.
    """

    def __init__(self, system: System, summit: Summit, ridge: Ridge, seed: Seed) -> None:
        self._system, self._summit, self._ridge, nt = system, summit, ridge, seed.u.size
        self._forward, self._smooth = math.copysign(1.0, ridge.stop - ridge.start), False
        self.found = np.zeros((MOST_ROWS, COLUMNS)), np.zeros((MOST_ROWS, nt)), np.zeros((MOST_ROWS, nt))
        begun = self._begun(seed)
        self.count = 1 if begun else 0
        self.end = LineEnd.TOO_LONG if begun else LineEnd.NOT_FOUND
        if begun and ridge.start == ridge.stop:
            self.end = LineEnd.ARRIVED

    @property
    def ended(self) -> bool:
        """Whether it has arrived, or was not found at all."""
        return self.end is not LineEnd.TOO_LONG

    def _begun(self, seed: Seed) -> bool:
        """Write the first row; return whether it was found."""
        start = seed.u, seed.omega, seed.place, seed.sign
        return bool(begin_track(self._system, self._ridge, *start, self._summit, *self.found))

    def _step(self, z: float) -> tuple[float, int, bool]:
        """Write the next row, as `step_track`."""
        found: tuple[float, int, bool] = step_track(
            self._system, self._ridge, z, self.count, self._smooth, self._summit, *self.found
        )
        return found

    def tried(self, size: float) -> tuple[int | None, float]:
        """Try a step of z; the point is the number of rows with it."""
        ridge, at = self._ridge, float(self.found[0][self.count - 1, Z])
        z = at + self._forward * size
        last = (z - ridge.stop) * self._forward >= 0.0 or abs(z - ridge.stop) < 0.1 * ridge.smallest_step
        z = ridge.stop if last else z
        error, iterations, self._outside = self._step(z)
        self._smooth = error <= 1.0
        if not self._smooth:
            return None, 0.5 * abs(z - at)
        growth = min(2.0, max(0.5, 0.8 * (error + 1e-3) ** (-1.0 / 3.0)))
        if iterations > _EASY:
            growth = min(growth, _SHORTER)
        self.count += 1
        if last:
            self.end = LineEnd.ARRIVED
        return self.count, min(abs(z - at) * growth, ridge.largest_step)

    def leapt(self) -> tuple[None, float]:
        """Say why it ends: where no short step leads on nothing does."""
        self.end = LineEnd.LEFT_BAND if self._outside else LineEnd.VANISHED
        return None, 0.0


_MOST_TURNS, _FAR, _SETTLED = 8, 5e-3, 1e-2
"""Newton steps, share of the frequency that one may move it by, and residual from which one does."""


class HeldAmplitude(FollowedPeak):
    """A solution of one amplitude on the flank of a peak: over the parameter that peak is at least as high.

    Beside a fold Newton's method on da/dω = 0 finds a peak from close by alone, and its line ends soon. The
    flank is smooth there; no second derivatives are needed, and rows are far apart.
    """

    def __init__(self, system: System, summit: Summit, ridge: Ridge, seed: Seed, within: float) -> None:
        self._level, self._within, self.count = seed.height, within, 0
        super().__init__(system, summit, ridge, seed)

    def _begun(self, seed: Seed) -> bool:
        summit_numbers(self._summit)[SIGN] = seed.sign
        return self._solved(self._ridge.start, seed.u.copy(), seed.omega, seed.place) is not None

    def _step(self, z: float) -> tuple[float, int, bool]:
        rows, solutions, tangents = self.found
        here, last = rows[self.count - 1], self.count - 1
        length, u = z - here[Z], solutions[last] + (z - here[Z]) * tangents[last]
        omega = float(here[OMEGA] + length * here[DOMEGA])
        if self._smooth and last and abs(length) < 3.0 * abs(here[Z] - rows[last - 1, Z]):
            ends = [part[each] for part in self.found for each in (last - 1, last)]
            omega = between_rows(ends[0], ends[1], ends[2], ends[3], ends[4], ends[5], z, u)
        steps = self._solved(z, u, omega, float(here[PLACE]))
        if steps is None:
            return math.inf, _MOST_TURNS, False
        return float(step_error(self._ridge, here, rows[self.count])), steps, False

    def _solved(self, z: float, u: Real, omega: float, tau: float) -> int | None:
        """Write the row at z from a guess; return how many Newton steps that took, None if it failed."""
        system, ridge, at, place = self._system, self._ridge, self._summit, self.count
        numbers, (p, by_z) = summit_numbers(at), value_of(z, ridge.logarithmic)
        still, moved = np.empty_like(u), np.empty_like(u)
        rows, solutions, tangents = (part[place] for part in self.found)
        numbers[CURVE] = numbers[CORNER] = numbers[RATE] = 0.0
        for step in range(_MOST_TURNS):
            norm = balance_at(system, u, omega, p, at) if ridge.low <= omega <= ridge.high else math.nan
            if not math.isfinite(norm) or not solve_responses(system, at):
                break
            observe_at(system, at)
            if numbers[SIGN] == 0.0:
                choose_extremum(system, at)
                tau = float(numbers[TAU])
            if not find_extremum(system, at, tau) or not slopes_at(system, at) or numbers[G] == 0.0:
                break
            tau, missing = float(numbers[TAU]), self._level - float(numbers[AMPLITUDE])
            if norm <= ACCEPTED and abs(missing) <= self._within * self._level:
                numbers[DRIFT] = -numbers[DA_DP] / numbers[G]
                record(ridge, u, omega, z, at, rows, solutions, tangents)
                return step
            move = missing / float(numbers[G]) if norm <= _SETTLED else 0.0
            move = min(max(move, -_FAR * omega), _FAR * omega)
            for drift, tangent in ((0.0, still), (move / by_z, moved)):
                numbers[DRIFT] = drift
                record(ridge, u, omega, z, at, rows, solutions, tangent)
            u, omega = u - summit_step(at) + (moved - still), omega + move
        return None
