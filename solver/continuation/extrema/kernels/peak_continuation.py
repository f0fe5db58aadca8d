"""A peak of the response followed over a parameter, by continuation with exact tangents.

The parameter is followed in z, which is p or ln p. At an end of the band the frequency stays fixed.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solver.contacts.kernels.system import System
from solver.continuation.extrema.kernels.amplitude_hessian import (
    AMPLITUDE,
    CORNER,
    CURVE,
    DRIFT,
    RATE,
    SIGN,
    TAU,
    G,
    Summit,
)
from solver.continuation.extrema.kernels.peak_newton import MOST, SHARP, climb, find_summit, settle
from solver.jit.decorators import compiled
from solver.jit.fourier import Real
from solver.jit.lapack import copy_to
from solver.jit.separate import apart

# Columns of a tracked peak.
Z, P, OMEGA, HEIGHT, DHEIGHT, DOMEGA, PLACE, SLOPE, BEND, KINK = range(10)
COLUMNS = 10
_NEAR = 1e-4  # relative distance to a peak's frequency where only a high amplitude is wanted
_MOST_SLACK = 0.5  # relative error of the height in a step at most


class Ridge(NamedTuple):
    """Settings of a track."""

    start: float  # z
    stop: float
    logarithmic: bool  # z = ln p
    low: float  # rad/s, the band
    high: float
    fixed: bool  # the frequency stays: an end of the band
    first_step: float
    largest_step: float
    smallest_step: float
    height_error: float  # relative error of the trapezoidal rule in a step
    omega_error: float
    enough: float  # m, height from which a line only has to show that it is higher; infinity: it never is
    slack: float  # share of what it is higher by that the height may be wrong by then
    climb_from: float  # step at which a peak is looked for uphill where Newton's method fails


@compiled
def value_of(z: float, logarithmic: bool) -> tuple[float, float]:
    """Return p and dp/dz."""
    if logarithmic:
        p = math.exp(z)
        return p, p
    return z, 1.0


@apart
def record(
    ridge: Ridge, u: Real, omega: float, z: float, at: Summit, row: Real, solution: Real, tangent: Real
) -> None:
    """Write a peak with its derivatives by z into one row of the result."""
    p, by_z = value_of(z, ridge.logarithmic)
    numbers = at.numbers
    drift = 0.0 if ridge.fixed else numbers[DRIFT]
    row[Z], row[P], row[OMEGA], row[HEIGHT], row[PLACE] = z, p, omega, numbers[AMPLITUDE], numbers[TAU]
    row[DHEIGHT], row[DOMEGA] = numbers[RATE] * by_z, drift * by_z
    row[SLOPE], row[BEND], row[KINK] = numbers[G], numbers[CURVE], numbers[CORNER]
    copy_to(solution, u)
    for i in range(u.size):
        tangent[i] = -(at.rhs[2, i] + at.rhs[1, i] * drift) * by_z


@compiled
def between_rows(
    left: Real, right: Real, u_left: Real, u_right: Real, du_left: Real, du_right: Real, z: float, u: Real
) -> float:
    """Fill `u` with the cubic through two rows (also beyond them) at `z`; return ω there."""
    length = right[Z] - left[Z]
    t = (z - left[Z]) / length
    r = 1.0 - t
    value0, value1 = (1.0 + 2.0 * t) * r * r, t * t * (3.0 - 2.0 * t)
    slope0, slope1 = t * r * r * length, -t * t * r * length
    for i in range(u.size):
        u[i] = value0 * u_left[i] + value1 * u_right[i] + slope0 * du_left[i] + slope1 * du_right[i]
    return value0 * left[OMEGA] + value1 * right[OMEGA] + slope0 * left[DOMEGA] + slope1 * right[DOMEGA]


@compiled
def _correct(
    system: System, ridge: Ridge, u: Real, omega: float, p: float, tau: float, corner: bool, reach: float,
    high_enough: bool, uphill: bool, at: Summit,
) -> tuple[bool, int, float]:  # fmt: skip
    """Find the peak from a prediction: Newton's method, and at a corner or (`uphill`) where it fails uphill.

    With `high_enough` any solution of enough amplitude will do: the highest peak is at least as high.
    """
    iterations = 0
    if high_enough or not corner:
        kept, sharp = u.copy(), _NEAR if high_enough else SHARP
        good, iterations, found = find_summit(system, u, omega, p, tau, ridge.fixed, sharp, at)
        if good or ridge.fixed:
            return good, iterations, found
        copy_to(u, kept)
        if high_enough:
            good = settle(system, u, omega, p, tau, at) and at.numbers[AMPLITUDE] > ridge.enough
            at.numbers[DRIFT] = 0.0
            if good or not uphill:
                return good, 0, omega
            copy_to(u, kept)
        if not uphill:
            return False, iterations, found
    low, high = max(omega - reach, ridge.low), min(omega + reach, ridge.high)
    if not low < omega < high:
        return False, iterations, omega
    good, found = climb(system, u, omega, p, tau, 1e-2 * reach, low, high, at)
    return good, iterations, found


@apart
def _predict(
    rows: Real, solutions: Real, tangents: Real, count: int, smooth: bool, z: float, guess: Real
) -> float:
    """Fill `guess` with the prediction at `z` from the last rows; return the predicted ω."""
    here = rows[count - 1]
    length = z - here[Z]
    if smooth and abs(length) < 3.0 * abs(here[Z] - rows[count - 2, Z]):
        return between_rows(
            rows[count - 2], here, solutions[count - 2], solutions[count - 1], tangents[count - 2],
            tangents[count - 1], z, guess,
        )  # fmt: skip
    for i in range(guess.size):
        guess[i] = solutions[count - 1, i] + length * tangents[count - 1, i]
    return here[OMEGA] + length * here[DOMEGA]


@apart
def begin_track(
    system: System, ridge: Ridge, u: Real, omega: float, tau: float, sign: float, at: Summit,
    rows: Real, solutions: Real, tangents: Real,
) -> bool:  # fmt: skip
    """Find the peak at `ridge.start` and write it into the first row; return whether it was found.

    Parameters
    ----------
    u, omega, tau, sign : near it; sign 0 lets the larger of max x and −min x be chosen.
    rows : (most, COLUMNS); solutions, tangents : (most, nt) u and du/dz.
    """
    at.numbers[SIGN] = sign
    trial, (p, _) = u.copy(), value_of(ridge.start, ridge.logarithmic)
    good, _, omega = _correct(system, ridge, trial, omega, p, tau, False, 2e-3 * omega, False, True, at)
    if good:
        record(ridge, trial, omega, ridge.start, at, rows[0], solutions[0], tangents[0])
    return good


@apart
def step_track(
    system: System, ridge: Ridge, z: float, count: int, smooth: bool, at: Summit,
    rows: Real, solutions: Real, tangents: Real,
) -> tuple[float, int, bool]:  # fmt: skip
    """Find the peak at `z` and write it behind `count` rows; `smooth`: the last two are predicted from.

    Returns
    -------
    (how far it is from fitting as `step_error`, infinite if it was not found, Newton steps, whether it left
    the band).
    """
    guess, here = np.empty(solutions.shape[1]), rows[count - 1]
    omega = predicted = _predict(rows, solutions, tangents, count, smooth, z, guess)
    if not ridge.low <= predicted <= ridge.high:
        return np.inf, MOST, True
    p, _ = value_of(z, ridge.logarithmic)
    reach = 3.0 * abs(predicted - here[OMEGA]) + 1e-3 * here[OMEGA]
    good, iterations, omega = _correct(
        system, ridge, guess, predicted, p, here[PLACE], here[KINK] > 0.0, reach,
        here[HEIGHT] > ridge.enough, abs(z - here[Z]) <= ridge.climb_from, at,
    )  # fmt: skip
    if not (good and ridge.low <= omega <= ridge.high):
        return np.inf, iterations, good
    record(ridge, guess, omega, z, at, rows[count], solutions[count], tangents[count])
    return step_error(ridge, here, rows[count]), iterations, False


@compiled
def step_error(ridge: Ridge, left: Real, right: Real) -> float:
    """Return how far two rows are from fitting together, 1 being the most allowed.

    The derivatives at both ends give each end from the other by the trapezoidal rule: another peak, or a step
    too long for cubics to predict what lies between, does not fit. Where both are higher than enough a share
    of that is the error allowed.
    """
    length = right[Z] - left[Z]
    higher = min(left[HEIGHT], right[HEIGHT]) / ridge.enough - 1.0
    looser = max(1.0, min(_MOST_SLACK, ridge.slack * higher) / ridge.height_error)
    height = abs(right[HEIGHT] - left[HEIGHT] - 0.5 * length * (left[DHEIGHT] + right[DHEIGHT]))
    height /= ridge.height_error * max(left[HEIGHT], right[HEIGHT])
    omega = abs(right[OMEGA] - left[OMEGA] - 0.5 * length * (left[DOMEGA] + right[DOMEGA]))
    omega /= ridge.omega_error * left[OMEGA]
    if not math.isfinite(height + omega):
        return np.inf
    return max(height, omega) / looser


@apart
def polish(
    system: System, ridge: Ridge, left: int, z: float, sign: float, at: Summit, rows: Real, solutions: Real,
    tangents: Real, row: Real, solution: Real, tangent: Real,
) -> bool:  # fmt: skip
    """Find the tracked peak itself at `z`, guessed between rows `left` and `left` + 1.

    Parameters
    ----------
    rows, solutions, tangents : of `step_track`.
    row (COLUMNS,), solution (nt,), tangent (nt,) : the peak there, filled.
    """
    at.numbers[SIGN] = sign
    u = np.empty(solution.size)
    here, ahead = rows[left], rows[left + 1]
    omega = between_rows(
        here, ahead, solutions[left], solutions[left + 1], tangents[left], tangents[left + 1], z, u
    )
    p, _ = value_of(z, ridge.logarithmic)
    tau, corner = here[PLACE], here[KINK] > 0.0 and ahead[KINK] > 0.0
    reach = 3.0 * abs(ahead[OMEGA] - here[OMEGA]) + 1e-4 * omega
    good, _, omega = _correct(system, ridge, u, omega, p, tau, corner, reach, False, True, at)
    if not good:
        return False
    record(ridge, u, omega, z, at, row, solution, tangent)
    return max(step_error(ridge, here, row), step_error(ridge, row, ahead)) <= 2.0
