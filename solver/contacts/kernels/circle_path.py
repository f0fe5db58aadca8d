"""The motion of a friction force under a circular limit: sticks and slips with exactly located events.

In stick the force is t = t_s + (ΔX, ΔY/κ); it slips where |t| − L crosses 0 upward, a root of curves that are
known. In slip its direction goes panel by panel (`solver.contacts.kernels.circle_panels`), as long as the
polynomial through a panel's nodes has small last terms, until the rate of slip q crosses 0 downward.
"""

from __future__ import annotations

import math

import numpy as np

from solver.contacts.kernels.circle_panels import (
    CURVES,
    DDLIMIT,
    DDX,
    DDY,
    DLIMIT,
    DX,
    DY,
    LIMIT,
    X,
    Y,
    curves_at,
    slip_rate,
    solve_panel,
    turning,
)
from solver.contacts.kernels.radau import NODES, SLOPES, STAGES, between, tail
from solver.contacts.kernels.stick_slip_events import AFTER_SLIP, NO_LENGTH, SLIP, STICK
from solver.jit.decorators import compiled
from solver.jit.fourier import Real
from solver.jit.separate import apart

# Columns of the pieces of a path. A stick begins with the force (TX, TY); a slip has COUNT panels from FIRST.
MOTION, BEGIN, END, BEGAN, FIRST, COUNT, TX, TY = 0, 1, 2, 3, 4, 5, 6, 7
PIECE_COLUMNS = 8
# Columns of the panels: begin, end, θ at the begin and at the nodes.
FROM, TO, START = 0, 1, 2
PANEL_COLUMNS = 3 + STAGES
# The state a march begins with and ends in: motion, force, its direction, and what a stick began after. Once it
# slipped, a change δt of the force at the begin is (S_MX, S_MY)·S_FACTOR·(S_PX, S_PY)·δt at the end.
S_MOTION, S_TX, S_TY, S_THETA, S_BEGAN, S_SLIPPED, S_FACTOR, S_PX, S_PY, S_MX, S_MY = (
    0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10,
)  # fmt: skip
STATE_SIZE = 11
# Numbers of a march: tolerance of force and of its rate, size of the limit, longest panel, and the largest last
# Legendre terms of the direction in a panel.
TOL, TOL_RATE, SCALE, LONGEST, TAIL_SIZE = 0, 1, 2, 3, 4

# How a march fails.
TABLE_FULL, UNSOLVED = -1, -2
SMALL_TAIL = 1e-6  # integrals over a panel are right to nearly the square of its last Legendre terms
LEAST_PANEL = 1e-13  # rad
IDLE = 4  # pieces without length in a row, after which a slip is not asked whether it sticks at once
BLIND = 1e-7  # rad, for so long


@compiled
def excess(waves: Real, kappa: float, offset_x: float, offset_y: float, tau: float, at: Real) -> float:
    """Return |t| − L of a stick with t = offset + (X, Y/κ); fills `at` with the curves."""
    curves_at(waves, tau, at)
    return math.hypot(offset_x + at[X], offset_y + at[Y] / kappa) - at[LIMIT]


@compiled
def excess_slopes(at: Real, kappa: float, offset_x: float, offset_y: float) -> tuple[float, float]:
    """Return slope and curvature of |t| − L from the curves `at` a point."""
    tx, ty = offset_x + at[X], offset_y + at[Y] / kappa
    size = math.hypot(tx, ty)
    if size == 0.0:
        return -at[DLIMIT], -at[DDLIMIT]
    dx, dy = at[DX], at[DY] / kappa
    along = (tx * dx + ty * dy) / size
    bend = (dx * dx + dy * dy + tx * at[DDX] + ty * at[DDY] / kappa - along * along) / size
    return along - at[DLIMIT], bend - at[DDLIMIT]


@apart
def _rising_root(
    waves: Real, kappa: float, offset_x: float, offset_y: float, order: int, lo: float, hi: float, at: Real
) -> float:
    """Return where |t| − L (order 0), or minus its slope (order 1), crosses 0 upward inside [lo, hi]."""
    x = 0.5 * (lo + hi)
    for _ in range(100):
        f = excess(waves, kappa, offset_x, offset_y, x, at)
        slope, bend = excess_slopes(at, kappa, offset_x, offset_y)
        if order == 1:
            f, slope = -slope, -bend
        if f > 0.0:
            hi = x
        else:
            lo = x
        step_to = x - f / slope if slope > 0.0 else lo - 1.0
        if not lo <= step_to <= hi:
            step_to = 0.5 * (lo + hi)
        moved = abs(step_to - x)
        x = step_to
        if moved <= 4e-16 * (1.0 + abs(x)) or hi - lo <= 4e-16 * (1.0 + abs(x)):
            break
    return x


@compiled
def _inside(
    waves: Real, kappa: float, offset_x: float, offset_y: float, lo: float, hi: float, tol: float, at: Real
) -> float:
    """Return a place soon after `lo` where |t| is below the limit, −1 if none is found before `hi`."""
    width = (hi - lo) / 16.0
    for part in range(1, 16):
        if excess(waves, kappa, offset_x, offset_y, lo + part * width, at) < -tol:
            return lo + part * width
    for _ in range(30):
        width *= 0.5
        if excess(waves, kappa, offset_x, offset_y, lo + width, at) < -tol:
            return lo + width
    return -1.0


@apart
def leave_stick(
    waves: Real, kappa: float, grid: Real, offset_x: float, offset_y: float, start: float, end: float,
    tol: float,
) -> tuple[float, bool]:  # fmt: skip
    """Return when a stuck force reaches the limit, and whether it does before `end`.

    `grid` (6, n) has X, Y, L and their slopes at τ_j = 2πj/n.
    """
    n = grid.shape[1]
    delta = 2.0 * math.pi / n
    at = np.empty(CURVES)
    j = math.floor(start / delta) + 1
    lo = start
    low = excess(waves, kappa, offset_x, offset_y, start, at)
    rate, _ = excess_slopes(at, kappa, offset_x, offset_y)
    while lo < end:
        hi = min(j * delta, end)
        if hi == end:
            high = excess(waves, kappa, offset_x, offset_y, end, at)
            rate_high, _ = excess_slopes(at, kappa, offset_x, offset_y)
        else:
            g = j % n
            tx, ty = offset_x + grid[0, g], offset_y + grid[1, g] / kappa
            size = math.hypot(tx, ty)
            high, rate_high = size - grid[2, g], -grid[5, g]
            if size > 0.0:
                rate_high += (tx * grid[3, g] + ty * grid[4, g] / kappa) / size
        if high > tol or (rate > 0.0 and rate_high < 0.0) or low >= -tol:
            begin = lo
            if low >= -tol:
                # The limit just left, or a touch: only after it was below can it reach it.
                begin = _inside(waves, kappa, offset_x, offset_y, lo, hi, tol, at)
                if begin < 0.0 and high > tol:
                    return lo, True
                if begin >= 0.0:
                    excess(waves, kappa, offset_x, offset_y, begin, at)
                    rate, _ = excess_slopes(at, kappa, offset_x, offset_y)
            if begin >= 0.0:
                top = hi
                if high <= tol and rate > 0.0 and rate_high < 0.0:
                    top = _rising_root(waves, kappa, offset_x, offset_y, 1, begin, hi, at)
                    high = max(high, excess(waves, kappa, offset_x, offset_y, top, at))
                if high > tol:
                    return _rising_root(waves, kappa, offset_x, offset_y, 0, begin, top, at), True
        lo, low, rate = hi, min(high, 0.0), rate_high
        if hi < end and high < -tol:
            low = high
        j += 1
    return end, False


@compiled
def _falls(nodes: Real, kappa: float, theta0: float, theta: Real, first: float, tol: float) -> int:
    """Return the number of the node (from 1) at or before which the rate of slip q falls below 0, or 0."""
    before = first
    here = slip_rate(nodes[0], kappa, theta[0])
    for i in range(STAGES):
        if here < -tol:
            return i + 1
        if i + 1 == STAGES:
            break
        after = slip_rate(nodes[i + 1], kappa, theta[i + 1])
        # A dip between nodes: below 0 if as deep as the parabola through three of them, and twice that.
        if before > here < after and here < 0.25 * max(before - here, after - here):
            return -(i + 1)
        before, here = here, after
    return 0


@apart
def _dense_rate(
    waves: Real, kappa: float, begin: float, h: float, theta0: float, theta: Real, place: float, at: Real
) -> float:
    """Return q at a place in [0, 1] of a panel."""
    curves_at(waves, begin + h * place, at)
    return slip_rate(at, kappa, between(theta0, theta, place))


@apart
def _where_it_falls(
    waves: Real, kappa: float, begin: float, h: float, theta0: float, theta: Real, node: int, tol: float,
    at: Real,
) -> float:  # fmt: skip
    """Return the place in [0, 1] where q falls below 0 before `node` (about it if negative), or 2."""
    hi = NODES[abs(node) - 1]
    lo = NODES[abs(node) - 2] if abs(node) > 1 else 0.0
    if node < 0:
        # Golden section for the bottom of the dip.
        a, b = lo, NODES[-node]
        ratio = 0.6180339887498949
        c, d = b - ratio * (b - a), a + ratio * (b - a)
        fc = _dense_rate(waves, kappa, begin, h, theta0, theta, c, at)
        fd = _dense_rate(waves, kappa, begin, h, theta0, theta, d, at)
        for _ in range(40):
            if min(fc, fd) < -tol:
                break
            if fc < fd:
                b, d, fd = d, c, fc
                c = b - ratio * (b - a)
                fc = _dense_rate(waves, kappa, begin, h, theta0, theta, c, at)
            else:
                a, c, fc = c, d, fd
                d = a + ratio * (b - a)
                fd = _dense_rate(waves, kappa, begin, h, theta0, theta, d, at)
        if min(fc, fd) >= -tol:
            return 2.0
        hi = c if fc < fd else d
    for _ in range(50):
        middle = 0.5 * (lo + hi)
        if _dense_rate(waves, kappa, begin, h, theta0, theta, middle, at) < 0.0:
            hi = middle
        else:
            lo = middle
        if hi - lo < 1e-6:
            break
    return hi


@apart
def _end_of_slip(
    waves: Real, kappa: float, begin: float, guess: float, theta0: float, theta: Real, nodes: Real,
    matrix: Real, right: Real,
) -> float:  # fmt: skip
    """Move the end of a panel to where q is 0, solving it anew; return the end, or −1 if that fails."""
    end = guess
    for turn in range(12):
        if not solve_panel(waves, kappa, begin, end, theta0, False, theta, nodes, matrix, right):
            return -1.0
        last = nodes[STAGES - 1]
        angle = theta[STAGES - 1]
        slope = SLOPES[STAGES - 1, 0] * theta0
        for j in range(STAGES):
            slope += SLOPES[STAGES - 1, j + 1] * theta[j]
        slope /= end - begin
        c, s = math.cos(angle), math.sin(angle)
        fall = c * last[DDX] + s * last[DDY] / kappa - last[DDLIMIT]
        fall += (c * last[DY] / kappa - s * last[DX]) * slope
        step = -slip_rate(last, kappa, angle) / fall if fall < 0.0 else 0.0
        step = min(max(step, -0.5 * (end - begin)), 0.5 * (end - begin))
        if abs(step) < 1e-14 * (1.0 + abs(end)) or turn == 11:
            break
        moved = (end + step - begin) / (end - begin)
        old = theta.copy()
        for j in range(STAGES):
            theta[j] = between(theta0, old, min(NODES[j] * moved, 1.0))
        end += step
    return end


@apart
def slip_on(
    waves: Real, kappa: float, begin: float, end: float, theta0: float, blind: float, numbers: Real,
    panels: Real, filled: int,
) -> tuple[float, float, float, int, int]:  # fmt: skip
    """Follow a slip from `begin` until it sticks, at most to `end`; append its panels.

    Returns
    -------
    (place, direction there, its derivative by theta0, panels filled, 1 if it sticks there, 0 at the end,
    TABLE_FULL or UNSOLVED).
    """
    nodes, matrix = np.empty((STAGES, CURVES)), np.empty((STAGES, STAGES))
    right, theta, at = np.empty((STAGES, 2)), np.empty(STAGES), np.empty(CURVES)
    tau, factor = begin, 1.0
    curves_at(waves, begin, at)
    _, stiff, g, _ = turning(at, kappa, theta0)
    first = slip_rate(at, kappa, theta0)
    h, small = numbers[LONGEST], numbers[TAIL_SIZE]
    if at[LIMIT] > 1e-12 * numbers[SCALE] and abs(stiff) * h > 3.0 * at[LIMIT] * g:
        h = 3.0 * at[LIMIT] * g / abs(stiff)
    while tau < end:
        rest = end - tau
        share = rest if h > 0.95 * rest else (0.5 * rest if h > 0.5 * rest else h)
        to = end if share == rest else tau + share
        solved = solve_panel(waves, kappa, tau, to, theta0, True, theta, nodes, matrix, right)
        if not solved and share > LEAST_PANEL:
            h = 0.2 * share
            continue
        if not solved:
            return tau, theta0, factor, filled, UNSOLVED
        force = 0.0
        for i in range(STAGES):
            force = max(force, nodes[i, LIMIT])
        error = tail(theta0, theta) * min(force / numbers[SCALE], 1.0)
        change = 3.0 if error == 0.0 else min(3.0, max(0.15, 0.9 * (small / error) ** (1.0 / STAGES)))
        if error > 3.0 * small and share > LEAST_PANEL:
            h = change * share
            continue
        node = _falls(nodes, kappa, theta0, theta, first, numbers[TOL_RATE])
        place = 2.0
        if node != 0:
            place = _where_it_falls(
                waves, kappa, tau, share, theta0, theta, node, numbers[TOL_RATE], at
            )
        if place < 2.0 and tau + place * share < begin + blind:
            place = 2.0
        stops = place < 2.0
        if stops:
            if place < 0.02 and first > numbers[TOL_RATE] and share > 1e-9:
                h = 0.1 * share  # perhaps the solution against the motion
                continue
            if place < 1e-5 and share <= 1e-9:
                return tau, theta0, factor, filled, 1
            old = theta.copy()
            for i in range(STAGES):
                theta[i] = between(theta0, old, NODES[i] * place)
            to = _end_of_slip(
                waves, kappa, tau, tau + place * share, theta0, theta, nodes, matrix, right
            )
            if to < 0.0:
                h = 0.5 * share
                continue
        if filled >= panels.shape[0]:
            return tau, theta0, factor, filled, TABLE_FULL
        row = panels[filled]
        row[FROM], row[TO], row[START] = tau, to, theta0
        for i in range(STAGES):
            row[START + 1 + i] = theta[i]
        filled += 1
        tau, theta0 = to, theta[STAGES - 1]
        factor *= right[STAGES - 1, 1]
        first = slip_rate(nodes[STAGES - 1], kappa, theta0)
        if stops:
            return tau, theta0, factor, filled, 1
        h = min(change * share, numbers[LONGEST])
    return end, theta0, factor, filled, 0


@compiled
def projection(kappa: float, theta: float) -> tuple[float, float, float]:
    """Return (px, py, along): how L δθ follows from δt and along·(δL − n·δt) where a slip begins."""
    c, s = np.cos(theta), np.sin(theta)
    along = s * c * (1.0 - kappa) / (kappa * c * c + s * s)
    return -s - along * c, c - along * s, along


@apart
def march_path(
    waves: Real, kappa: float, grid: Real, begin: float, end: float, state: Real, numbers: Real,
    pieces: Real, panels: Real, count: int, filled: int,
) -> tuple[int, int]:  # fmt: skip
    """Follow the force over [begin, end] from `state`, which is moved on; append pieces and panels.

    Returns
    -------
    Numbers of pieces and panels, or (TABLE_FULL, 0) or (UNSOLVED, 0).
    """
    tau, idle = begin, 0
    at = np.empty(CURVES)
    while tau < end:
        if count >= pieces.shape[0]:
            return TABLE_FULL, 0
        row = pieces[count]
        row[MOTION], row[BEGIN], row[BEGAN] = state[S_MOTION], tau, state[S_BEGAN]
        row[TX], row[TY], row[FIRST], row[COUNT] = state[S_TX], state[S_TY], filled, 0.0
        if state[S_MOTION] == STICK:
            curves_at(waves, tau, at)
            offset_x, offset_y = state[S_TX] - at[X], state[S_TY] - at[Y] / kappa
            tau, leaves = leave_stick(
                waves, kappa, grid, offset_x, offset_y, tau, end, numbers[TOL]
            )
            curves_at(waves, tau, at)
            state[S_TX], state[S_TY] = offset_x + at[X], offset_y + at[Y] / kappa
            if leaves:
                _begin_slip(at, kappa, state)
        else:
            blind = BLIND if idle >= IDLE else 0.0
            tau, theta, factor, now, how = slip_on(
                waves, kappa, tau, end, state[S_THETA], blind, numbers, panels, filled
            )
            if how < 0:
                return how, 0
            row[COUNT] = now - filled
            filled = now
            curves_at(waves, tau, at)
            state[S_THETA] = theta
            state[S_TX], state[S_TY] = at[LIMIT] * math.cos(theta), at[LIMIT] * math.sin(theta)
            state[S_FACTOR] *= factor * at[LIMIT]
            state[S_MX], state[S_MY] = -math.sin(theta), math.cos(theta)
            if how == 1:
                state[S_MOTION], state[S_BEGAN] = STICK, AFTER_SLIP
        row[END] = tau
        idle = idle + 1 if tau - row[BEGIN] <= NO_LENGTH else 0
        if idle > 40:
            return UNSOLVED, 0
        count += 1
    return count, filled


@compiled
def _begin_slip(at: Real, kappa: float, state: Real) -> None:
    """Turn a stick whose force has reached the limit into a slip."""
    theta = math.atan2(state[S_TY], state[S_TX])
    px, py, _ = projection(kappa, theta)
    if state[S_SLIPPED] == 0.0:
        state[S_SLIPPED], state[S_FACTOR] = 1.0, 1.0 / at[LIMIT]
        state[S_PX], state[S_PY] = px, py
    else:
        state[S_FACTOR] *= (px * state[S_MX] + py * state[S_MY]) / at[LIMIT]
    state[S_MOTION], state[S_THETA] = SLIP, theta
