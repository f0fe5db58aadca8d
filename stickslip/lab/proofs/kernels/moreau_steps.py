"""Time stepping with rigid contacts: Moreau's scheme, forces projected on what laws allow.

Over a step the trapezoidal rule gives the rates at its end as v = v_free − G F, F the mean forces of all rows
over the step. Each row's own law and D = L G give F in closed form from the others; they are solved by turns
(J. J. Moreau, in: Nonsmooth Mechanics and Applications, 1988; M. Jean, Comput. Methods Appl. Mech. Eng. 177
(1999) 235). Where a row changes what it does the step is halved, again and again, so that an event is met
within h/2^(LEVELS − 1) and the scheme keeps its second order.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.jit.decorators import compiled

Real = NDArray[np.float64]
Whole = NDArray[np.int64]

LEVELS = 26
RIGID, ELASTIC, GAP, PRESSED, HELD = 0, 1, 2, 3, 4  # friction; a spring on one side; a normal motion
RAN, OPENED, UNSOLVED = 0, 1, 2
_MOST_TURNS = 20_000
_SAME = 1e-15
_STILL = 1e-12  # of the rate that the largest force would give
FINE, _MOST_FINE = 12, 80  # so many steps on end of these levels: an event on the edge, taken as it comes
_MOST_PARTS = 200  # of a step, on average: more are events without end


class Stepped(NamedTuple):
    """The equations x'' = W p(τ) − A x − B x' − W Lᵀ F and the rows of contacts.

    Attributes
    ----------
    A : (n, n) array; inverses : (LEVELS, n, n) of 1 + h B/2 + h² A/4 at h, h/2, …; B : (n, n).
    cosines, sines : (K + 1, n) W times the amplitudes of the forces.
    rows : (m, n) relative motions; pulls : (LEVELS, n, m) G; D : (LEVELS, m, m) rows of G.
    law : (m,) what each row is; k, mu, gap, rest : (m,) numbers of it; normal : (m,) row of its load or -1.
    load : (m, 2K + 1) Fourier coefficients of the given load.
    """

    A: Real
    B: Real
    inverses: Real
    cosines: Real
    sines: Real
    rows: Real
    pulls: Real
    D: Real
    law: Whole
    k: Real
    mu: Real
    gap: Real
    rest: Real
    normal: Whole
    load: Real


@compiled
def given_load(load: Real, tau: float) -> float:
    """Return a given load at an angle."""
    total = load[0]
    for k in range(1, (load.size + 1) // 2):
        total += load[2 * k - 1] * math.cos(k * tau) + load[2 * k] * math.sin(k * tau)
    return total


@compiled
def _clipped(value: float, size: float) -> float:
    return min(max(value, -size), size)


@compiled
def mean_force(
    it: Stepped, c: int, tau: float, h: float, u: float, rate: float, free: float, own: float, force: float,
    means: Real, motions: Real, rates: Real, ends: Real,
) -> tuple[float, float, int]:  # fmt: skip
    """Return the mean force of a row over a step, that at its end, and what the row does.

    Parameters
    ----------
    u, rate : motion and rate at the start; free : rate at the end without the force of this row.
    own : D of the row; force : at the start; means : of all rows; motions, rates, ends : of all rows, motion
    and rate at the start, rate at the end.
    """
    law = it.law[c]
    if law == HELD:
        return free / own, free / own, 0
    if law in (GAP, PRESSED):
        offset, later = -it.k[c] * it.gap[c], -it.k[c] * it.gap[c]
        if law == PRESSED:
            offset, later = given_load(it.load[c], tau), given_load(it.load[c], tau + h)
        before = max(offset + it.k[c] * u, 0.0)
        pressed = 0.5 * (before + later + it.k[c] * (u + 0.5 * h * (rate + free)))
        pressed /= 1.0 + 0.25 * it.k[c] * h * own
        after = 2.0 * pressed - before
        if after > 0.0:
            return pressed - it.rest[c], after - it.rest[c], 1
        return 0.5 * before - it.rest[c], -it.rest[c], 0
    middle, end = given_load(it.load[c], tau + 0.5 * h), given_load(it.load[c], tau + h)
    n = it.normal[c]
    if n >= 0 and it.law[n] == HELD:
        middle = end = means[n] + it.rest[n]
    elif n >= 0:
        moved = 0.5 * h * (rates[n] + ends[n])
        middle += it.k[n] * (motions[n] + 0.25 * h * (rates[n] + ends[n]))
        end += it.k[n] * (motions[n] + moved)
    limit, last = it.mu[c] * max(middle, 0.0), it.mu[c] * max(end, 0.0)
    opened = 2 if middle <= 0.0 else 0
    if law == RIGID:
        wanted = free / own
        found = _clipped(wanted, limit)
        state = 0 if abs(wanted) <= limit else (1 if wanted > 0.0 else -1)
        return found, found, opened if opened else state
    stuck = (force + 0.25 * it.k[c] * h * (rate + free)) / (1.0 + 0.25 * it.k[c] * h * own)
    after = 2.0 * stuck - force
    held = _clipped(after, last)
    state = 0 if abs(after) <= (1.0 + _STILL) * last else (1 if after > 0.0 else -1)
    return 0.5 * (force + held), held, opened if opened else state


@compiled
def try_step(
    it: Stepped, level: int, tau: float, h: float, x: Real, v: Real, force: Real, means: Real,
    later: Real, after: Real, doing: Whole,
) -> bool:  # fmt: skip
    """Find the rates at the end of a step (`later`), forces there (`after`), what rows do; False if not."""
    n, m = x.size, it.law.size
    push = np.zeros(n)
    for k in range(it.cosines.shape[0]):
        c, s = math.cos(k * (tau + 0.5 * h)), math.sin(k * (tau + 0.5 * h))
        for i in range(n):
            push[i] += it.cosines[k, i] * c + it.sines[k, i] * s
    free = it.inverses[level] @ (v + h * (push - it.A @ (x + 0.25 * h * v) - 0.5 * (it.B @ v)))
    motions, rates, ends = it.rows @ x, it.rows @ v, it.rows @ free
    D, rounding = it.D[level], 0.0
    for c in range(m):  # a rate over a small D: of a short step the forces are known to no more
        rounding = max(rounding, _SAME * (abs(rates[c]) + abs(ends[c])) / D[c, c])
    for c in range(m):
        for j in range(m):
            ends[c] -= D[c, j] * means[j]
    for _turn in range(_MOST_TURNS):
        moved, size = 0.0, 0.0
        for c in range(m):
            alone = ends[c] + D[c, c] * means[c]
            found, last, state = mean_force(
                it, c, tau, h, motions[c], rates[c], alone, D[c, c], force[c], means, motions, rates, ends
            )
            change = found - means[c]
            for j in range(m):
                ends[j] -= D[j, c] * change
            means[c], after[c], doing[c] = found, last, state
            moved, size = max(moved, abs(change)), max(size, abs(found))
        if moved <= 10.0 * (_SAME * size + rounding):
            later[:] = free - it.pulls[level] @ means
            for c in range(m):  # parallel ones share a force anyhow: whether they stick is in their motion
                if it.law[c] == RIGID and doing[c] != 2:
                    still = abs(ends[c]) <= 10.0 * rounding * D[c, c] + _STILL * D[c, c] * size
                    doing[c] = 0 if still else (1 if ends[c] > 0.0 else -1)
            return True
    return False


@compiled
def run_period(
    it: Stepped, steps: int, x: Real, v: Real, force: Real, doing: Whole, record: Real, kept: Real
) -> int:  # fmt: skip
    """March one period from the angle 0; x, v, forces and what rows do are moved on.

    Parameters
    ----------
    record : (2, steps) observed motion and rate at the start of every step, of the row `kept` (n,); more of
    it is filled with the motion, force and load of every row, (2 + 3 m, steps). Empty: nothing is kept.
    """
    m, whole = it.law.size, 2.0 * math.pi / steps
    means, later, after = force.copy(), v.copy(), force.copy()
    found = doing.copy()
    units, parts, fine = 2 ** (LEVELS - 1), 0, 0
    for step in range(steps):
        if record.shape[1] > 0:
            record[0, step], record[1, step] = kept @ x, kept @ v
            motions = it.rows @ x
            for c in range(m):
                record[2 + c, step], record[2 + m + c, step] = motions[c], force[c]
                load = given_load(it.load[c], step * whole)
                if it.normal[c] >= 0:
                    own = it.normal[c]
                    load = force[own] + it.rest[own]
                record[2 + 2 * m + c, step] = max(load, 0.0)
        gone, level = 0, 0
        while gone < units:
            while units >> level > units - gone:
                level += 1
            h, tau = whole / 2**level, whole * (step + gone / units)
            trial = means.copy()
            parts += 1
            if parts > _MOST_PARTS * steps:
                return UNSOLVED
            if not try_step(it, level, tau, h, x, v, force, trial, later, after, found):
                return UNSOLVED
            if level < LEVELS - 1 and fine < _MOST_FINE and np.any(found != doing):
                level += 1
                continue
            means[:], doing[:], force[:] = trial, found, after
            x += 0.5 * h * (v + later)
            v[:] = later
            for c in range(m):
                if it.law[c] == HELD and force[c] + it.rest[c] < 0.0:
                    return OPENED
            gone += units >> level
            fine = fine + 1 if level > FINE else 0
            level = max(level - 1, 0)
    return RAN
