"""A peak of the response at fixed parameters: Newton's method on {r = 0, da/dω = 0}, and climbing to it.

The Newton step uses the exact second derivatives of `amplitude_hessian` beside this module: with N = −J⁻¹
r and u' = du/dω, δω = −(g + h·N)/a'' and δu = N + u' δω. Where it fails (a'' jumps where a contact changes
its piece) solutions at fixed frequencies lead uphill until g changes sign, and a bracket is closed on the
top. The top may be a corner: where a stick just touches its limit dF/dU itself jumps, and g with it.
"""

from __future__ import annotations

import math

import numpy as np

from solver.contacts.kernels.system import System
from solver.continuation.extrema.kernels.amplitude_hessian import (
    AMPLITUDE,
    CORNER,
    CURVE,
    DA_DP,
    DG_DP,
    DRIFT,
    NORM,
    RATE,
    SIGN,
    SPENT,
    TAU,
    G,
    Summit,
    balance_at,
    choose_extremum,
    curvatures_at,
    find_extremum,
    observe_at,
    slopes_at,
    solve_responses,
    solve_step,
)
from solver.jit.decorators import compiled
from solver.jit.fourier import Real
from solver.jit.lapack import copy_to, dot, set_to
from solver.jit.separate import apart

# What is kept of one side of a bracket.
_AT, _TAU, _HEIGHT, _G, _CURVE, _BY_P = range(6)
_END_NUMBERS = 6
_CORNER = 1e-8  # relative width of a bracket in which g jumps
TARGET, ACCEPTED = 1e-11, 1e-9  # relative residuals, as in `solver.balance.kernels.newton`
SHARP = 1e-10  # relative error of a peak's frequency
_LARGEST_MOVE = 0.05  # of the frequency in one Newton step
MOST = 9  # Newton iterations on a peak
_MOST_CLIMB, _FEWEST_CLIMB = 400.0, 60.0  # evaluations of one climb at most, with few and with many unknowns
_MANY = 100.0  # unknowns from which it is fewer: an evaluation takes longer


@apart
def all_at(system: System, u: Real, omega: float, p: float, tau: float, at: Summit) -> bool:
    """Evaluate balance, amplitude, slopes and curvatures at (u, ω, p); the extremum is near `tau`."""
    at.numbers[NORM] = balance_at(system, u, omega, p, at)
    if not math.isfinite(at.numbers[NORM]) or not solve_responses(system, at):
        return False
    observe_at(system, at)
    if at.numbers[SIGN] == 0.0:
        choose_extremum(system, at)
        tau = at.numbers[TAU]
    if not find_extremum(system, at, tau) or not slopes_at(system, at):
        return False
    curvatures_at(system, u, at)
    numbers = at.numbers
    numbers[CORNER], numbers[RATE] = 0.0, numbers[DA_DP]
    numbers[DRIFT] = -numbers[DG_DP] / numbers[CURVE] if numbers[CURVE] < 0.0 else 0.0
    return math.isfinite(numbers[CURVE])


@apart
def find_summit(
    system: System, u: Real, omega: float, p: float, tau: float, fixed: bool, sharp: float, at: Summit
) -> tuple[bool, int, float]:
    """Find the peak near (u, ω) by Newton's method, u in place; with `fixed` the solution at ω alone.

    Parameters
    ----------
    sharp : relative error of the frequency that is good enough; `SHARP`, or more where a solution near the
        peak will do.

    Returns
    -------
    (found, iterations, ω). `at` belongs to the result.
    """
    n = u.size
    numbers = at.numbers
    for iteration in range(MOST):
        if not all_at(system, u, omega, p, tau, at):
            return False, iteration, omega
        tau = numbers[TAU]
        move = 0.0
        if not fixed:
            if not numbers[CURVE] < 0.0:
                return False, iteration, omega
            move = -(numbers[G] - dot(at.h, at.rhs[0])) / numbers[CURVE]
        off = abs(move) / omega
        if numbers[NORM] <= (TARGET if sharp <= SHARP else ACCEPTED) and off <= sharp:
            return True, iteration, omega
        if iteration > 4 and numbers[NORM] <= ACCEPTED and off <= 100.0 * SHARP:
            return True, iteration, omega
        if not off <= _LARGEST_MOVE:
            return False, iteration, omega
        for i in range(n):
            u[i] -= at.rhs[0, i] + at.rhs[1, i] * move
        omega += move
    return False, MOST, omega


@apart
def settle(system: System, u: Real, omega: float, p: float, tau: float, at: Summit) -> bool:
    """Solve at a fixed frequency, u in place, and evaluate everything there."""
    before = np.inf
    for _ in range(16):
        norm = balance_at(system, u, omega, p, at)
        if not math.isfinite(norm) or norm > 1e3 * max(before, 1e-3):
            return False
        if norm <= TARGET or (norm <= ACCEPTED and norm > 0.5 * before):
            return all_at(system, u, omega, p, tau, at)
        before = norm
        if not solve_step(system, at):
            return False
        for i in range(u.size):
            u[i] -= at.rhs[0, i]
    return False


@apart
def climb(
    system: System, u: Real, omega: float, p: float, tau: float, first: float, low: float, high: float,
    at: Summit,
) -> tuple[bool, float]:  # fmt: skip
    """Find the peak uphill from (u, ω) between `low` and `high` [rad/s], u in place; return (found, ω).

    The work is bounded: one climb is what nobody can interrupt.
    """
    n = u.size
    most = at.numbers[SPENT] + max(_FEWEST_CLIMB, _MOST_CLIMB * min(1.0, (_MANY / max(n, 1)) ** 2))
    if not settle(system, u, omega, p, tau, at):
        return False, omega
    ends, us, slopes = np.empty((2, _END_NUMBERS)), np.empty((2, n)), np.empty((2, n))
    here, step = 0, first
    _keep(here, omega, u, at, ends, us, slopes)
    way = 1.0 if at.numbers[G] > 0.0 else -1.0
    for _ in range(60):
        if at.numbers[SPENT] > most:
            break
        start = ends[here, _AT]
        there = min(max(start + way * step, low), high)
        set_to(u, us[here], there - start, slopes[here])
        if not settle(system, u, there, p, ends[here, _TAU], at):
            step *= 0.5
            if step < 1e-9 * omega:
                return False, omega
            continue
        _keep(1 - here, there, u, at, ends, us, slopes)
        if at.numbers[G] * way <= 0.0:
            return _squeeze(system, u, p, ends, us, slopes, most, at)
        if there <= low or there >= high:
            return False, omega
        here, step = 1 - here, 1.6 * step
    return False, omega


@compiled
def _keep(side: int, omega: float, u: Real, at: Summit, ends: Real, us: Real, slopes: Real) -> None:
    """Keep the solution just settled as one side of a bracket."""
    numbers = at.numbers
    end = ends[side]
    end[_AT], end[_TAU], end[_HEIGHT], end[_G] = omega, numbers[TAU], numbers[AMPLITUDE], numbers[G]
    end[_CURVE], end[_BY_P] = numbers[CURVE], numbers[DA_DP]
    copy_to(us[side], u)
    for i in range(u.size):
        slopes[side, i] = -at.rhs[1, i]


@apart
def _squeeze(
    system: System, u: Real, p: float, ends: Real, us: Real, slopes: Real, most: float, at: Summit
) -> tuple[bool, float]:  # fmt: skip
    """Find the maximum between two solutions that both rise towards it; the result in `u`.

    Either g is 0 there, or it jumps: a corner, where the tangents of both sides meet. `most`: evaluations in
    all at which it is given up.
    """
    before = np.inf
    for iteration in range(60):
        if at.numbers[SPENT] > most:
            break
        left, right = (ends[0], ends[1]) if ends[0, _AT] < ends[1, _AT] else (ends[1], ends[0])
        width = right[_AT] - left[_AT]
        for side in range(2):
            move = _root_of(ends[side])
            if abs(move) <= SHARP * ends[side, _AT]:
                copy_to(u, us[side])
                return settle(system, u, ends[side, _AT], p, ends[side, _TAU], at), ends[side, _AT]
        if width <= _CORNER * left[_AT]:
            return _corner(system, u, p, left, right, ends, us, slopes, at)
        from_left, from_right = left[_AT] + _root_of(left), right[_AT] + _root_of(right)
        if left[_AT] < from_left < right[_AT]:
            guess = from_left
            if left[_AT] < from_right < right[_AT] and abs(_root_of(right)) < abs(_root_of(left)):
                guess = from_right
        elif left[_AT] < from_right < right[_AT]:
            guess = from_right
        else:
            guess = _meeting(left, right)
            # Past it a little, in turns: both sides have to come near for the tangents to meet at the corner.
            beyond = max(0.02 * abs(guess - before), 0.25 * _CORNER * guess)
            guess, before = guess + (beyond if iteration % 2 == 0 else -beyond), guess
        if not (left[_AT] < guess < right[_AT]) or iteration % 6 == 5:
            guess = 0.5 * (left[_AT] + right[_AT])
        nearer = 0 if abs(guess - ends[0, _AT]) <= abs(guess - ends[1, _AT]) else 1
        set_to(u, us[nearer], guess - ends[nearer, _AT], slopes[nearer])
        if not settle(system, u, guess, p, ends[nearer, _TAU], at):
            return False, guess
        rising = at.numbers[G] > 0.0
        side = 0 if (ends[0, _AT] < ends[1, _AT]) == rising else 1
        _keep(side, guess, u, at, ends, us, slopes)
    return False, ends[0, _AT]


@compiled
def _root_of(end: Real) -> float:
    """Return how far away the parabola of one side has its top; infinity if it has none."""
    return -end[_G] / end[_CURVE] if end[_CURVE] < 0.0 else np.inf


@compiled
def _meeting(left: Real, right: Real) -> float:
    """Return where the tangents of both sides meet."""
    gap = right[_HEIGHT] - left[_HEIGHT] + left[_G] * left[_AT] - right[_G] * right[_AT]
    return gap / (left[_G] - right[_G]) if left[_G] != right[_G] else 0.5 * (left[_AT] + right[_AT])


@compiled
def _corner(
    system: System, u: Real, p: float, left: Real, right: Real, ends: Real, us: Real, slopes: Real, at: Summit
) -> tuple[bool, float]:
    """Settle on a corner. It moves by p so that both sides stay equal: a_p + g dω/dp is the same on both."""
    drift = (left[_BY_P] - right[_BY_P]) / (right[_G] - left[_G])
    rate = left[_BY_P] + left[_G] * drift
    omega = min(max(_meeting(left, right), left[_AT]), right[_AT])
    nearer = 0 if abs(omega - ends[0, _AT]) <= abs(omega - ends[1, _AT]) else 1
    height = ends[nearer, _HEIGHT] + ends[nearer, _G] * (omega - ends[nearer, _AT])
    set_to(u, us[nearer], omega - ends[nearer, _AT], slopes[nearer])
    good = settle(system, u, omega, p, ends[nearer, _TAU], at)
    at.numbers[CORNER], at.numbers[DRIFT], at.numbers[RATE] = 1.0, drift, rate
    at.numbers[AMPLITUDE] = height
    return good and math.isfinite(drift), omega
