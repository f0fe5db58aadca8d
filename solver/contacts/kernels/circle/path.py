"""The motion of a friction force under a circular limit: sticks and slips with exactly located events.

In stick the force is t = t_s + (ΔX, ΔY/κ); it slips where |t| − L crosses 0 upward, a root of curves that are
known. In slip its direction goes panel by panel (`solver.contacts.kernels.circle.panels`), as long as the
polynomial through a panel's nodes has small last terms, until the rate of slip q crosses 0 downward.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solver.contacts.kernels.circle.panels import (
    BY_START,
    NODES,
    SLOPES,
    STAGES,
    Curves,
    Number,
    PanelWork,
    between,
    curves_at,
    new_panel_work,
    onset_direction,
    slip_rate,
    solve_panel,
    tail,
    turning,
)
from solver.contacts.kernels.stick_slip_events import AFTER_SEPARATION, AFTER_SLIP, NO_LENGTH, SLIP, STICK
from solver.jit.decorators import compiled
from solver.jit.fourier import Real
from solver.jit.kernel_records import Records, record
from solver.jit.separate import apart

ROUNDING = 1e-12  # of the offset, at most: what is left of a force that is 0


@compiled
def length(x: float, y: float) -> float:
    """Return √(x² + y²); forces are far from where their squares overflow, which `math.hypot` guards for."""
    return math.sqrt(x * x + y * y)


@compiled
def excess(waves: Real, kappa: float, offset_x: float, offset_y: float, tau: float) -> tuple[float, Curves]:
    """Return |t| − L of a stick with t = offset + (X, Y/κ), and the curves there."""
    at = curves_at(waves, tau)
    return length(offset_x + at.x, offset_y + at.y / kappa) - at.limit, at


@compiled
def excess_slopes(at: Curves, kappa: float, offset_x: float, offset_y: float) -> tuple[float, float]:
    """Return slope and curvature of |t| − L from the curves `at` a point, those ahead of it where t is 0."""
    tx, ty = offset_x + at.x, offset_y + at.y / kappa
    size = length(tx, ty)
    dx, dy = at.dx, at.dy / kappa
    if size <= ROUNDING * (abs(offset_x) + abs(offset_y)):
        speed = length(dx, dy)
        turn = (dx * at.ddx + dy * at.ddy / kappa) / speed if speed > 0.0 else 0.0
        return speed - at.dlimit, turn - at.ddlimit
    along = (tx * dx + ty * dy) / size
    bend = (dx * dx + dy * dy + tx * at.ddx + ty * at.ddy / kappa - along * along) / size
    return along - at.dlimit, bend - at.ddlimit


@apart
def _rising_root(
    waves: Real, kappa: float, offset_x: float, offset_y: float, order: int, lo: float, hi: float
) -> float:
    """Return where |t| − L (order 0), or minus its slope (order 1), crosses 0 upward inside [lo, hi]."""
    x = 0.5 * (lo + hi)
    for _ in range(100):
        f, at = excess(waves, kappa, offset_x, offset_y, x)
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
    waves: Real, kappa: float, offset_x: float, offset_y: float, lo: float, hi: float, tol: float
) -> float:
    """Return a place soon after `lo` where |t| is below the limit, −1 if none is found before `hi`."""
    width = (hi - lo) / 16.0
    for part in range(1, 16):
        if excess(waves, kappa, offset_x, offset_y, lo + part * width)[0] < -tol:
            return lo + part * width
    for _ in range(30):
        width *= 0.5
        if excess(waves, kappa, offset_x, offset_y, lo + width)[0] < -tol:
            return lo + width
    return -1.0


@compiled
def _behind_a_dip(
    waves: Real, kappa: float, offset_x: float, offset_y: float, start: float, until: float, tol: float
) -> tuple[float, bool]:  # fmt: skip
    """Return a place from which |t| − L rises, −1 if it does not dip first, and whether the stick ends there.

    A rise and fall that follow before `until` would not show at the ends of this interval. A parabola is back
    at its level after −2 times slope over curvature; what falls again afterwards is lower there, and still
    rises. Where the stick begins at the limit and dips as deep as rounding, it ends there.
    """
    begins, at = excess(waves, kappa, offset_x, offset_y, start)
    rate, bend = excess_slopes(at, kappa, offset_x, offset_y)
    if rate > 0.0 or bend <= 0.0 or start - 2.0 * rate / bend >= until:
        return -1.0, False
    place, rise = start, 0.0
    for share in (1.0, 0.75):
        place = start - 2.0 * share * rate / bend
        low, at = excess(waves, kappa, offset_x, offset_y, place)
        rise, _ = excess_slopes(at, kappa, offset_x, offset_y)
        if low < -tol and rise > 0.0:
            return place, False
    if begins >= -tol and rise > 0.0:
        return start - 2.0 * rate / bend, True
    return -1.0, False


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
    j = math.floor(start / delta) + 1
    lo = start
    low, at = excess(waves, kappa, offset_x, offset_y, start)
    rate, _ = excess_slopes(at, kappa, offset_x, offset_y)
    dipped, ends = _behind_a_dip(waves, kappa, offset_x, offset_y, start, min(j * delta, end), tol)
    if ends:
        return dipped, True
    if dipped > 0.0:
        lo = dipped
        low, at = excess(waves, kappa, offset_x, offset_y, dipped)
        rate, _ = excess_slopes(at, kappa, offset_x, offset_y)
    while lo < end:
        hi = min(j * delta, end)
        if hi == end:
            high, at = excess(waves, kappa, offset_x, offset_y, end)
            rate_high, _ = excess_slopes(at, kappa, offset_x, offset_y)
        else:
            g = j % n
            tx, ty = offset_x + grid[0, g], offset_y + grid[1, g] / kappa
            size = length(tx, ty)
            high, rate_high = size - grid[2, g], -grid[5, g]
            if size > 0.0:
                rate_high += (tx * grid[3, g] + ty * grid[4, g] / kappa) / size
        if high > tol or (rate > 0.0 and rate_high < 0.0) or low >= -tol:
            begin = lo
            if low >= -tol:
                # The limit just left, or a touch: only after it was below can it reach it.
                begin = _inside(waves, kappa, offset_x, offset_y, lo, hi, tol)
                if begin < 0.0 and high > tol:
                    return lo, True
                if begin >= 0.0:
                    _, at = excess(waves, kappa, offset_x, offset_y, begin)
                    rate, _ = excess_slopes(at, kappa, offset_x, offset_y)
            if begin >= 0.0:
                top = hi
                if high <= tol and rate > 0.0 and rate_high < 0.0:
                    top = _rising_root(waves, kappa, offset_x, offset_y, 1, begin, hi)
                    high = max(high, excess(waves, kappa, offset_x, offset_y, top)[0])
                if high > tol:
                    return _rising_root(waves, kappa, offset_x, offset_y, 0, begin, top), True
        lo, low, rate = hi, min(high, 0.0), rate_high
        if hi < end and high < -tol:
            low = high
        j += 1
    return end, False


def _piece(number: type) -> np.dtype[np.void]:
    """Return a piece of a path: a stick begins with the force (tx, ty), a slip has `count` panels."""
    return record(
        motion=float, begin=number, end=number, began=float, first=int, count=int, tx=number, ty=number
    )


def _panel(number: type) -> np.dtype[np.void]:
    """Return a panel: begin, end, θ at the begin and at the nodes."""
    return record(begin=number, end=number, start=number, theta=(number, STAGES))


PIECE, CARRIED_PIECE = _piece(float), _piece(complex)
PANEL, CARRIED_PANEL = _panel(float), _panel(complex)
# The state a march begins with and ends in: motion, force, its direction, what a stick began after. Once it
# slipped, a change δt of the force at the begin is (mx, my)·factor·(px, py)·δt at the end.
MARCH = record(
    motion=float, tx=float, ty=float, theta=float, began=float, slipped=float, factor=float, px=float,
    py=float, mx=float, my=float,
)  # fmt: skip


class Numbers(NamedTuple):
    """What a march goes by."""

    tol: float  # of the force [N]
    tol_rate: float  # of its rate
    scale: float  # size of the limit [N]
    longest: float  # panel [rad]
    tail_size: float  # the largest last Legendre terms in a panel


# How a march fails.
TABLE_FULL, UNSOLVED = -1, -2
SMALL_TAIL = 1e-6  # integrals over a panel are right to nearly the square of its last Legendre terms
LEAST_PANEL, SHORT_PANEL = 1e-13, 1e-9  # rad
NOWHERE = 2.0  # no place in a panel, which is 0..1
NEAR = 1e-6  # of a panel, within which the end of a slip is looked for
CLOSED_IN = 1e-11  # rad: there the rate of slip is so small that the force is right to its square
# Lengths in which directions decay: of the first panel, the same where the force begins along the motion (its
# derivatives alone have a transient), and after how many nothing is left to be resolved.
FIRST_PANEL, ALIGNED_PANEL, DECAYED = 3.0, 6.0, 24.0
ALIGNED = 1e-10  # rad
IDLE = 4  # pieces without length in a row, after which a slip is not asked whether it sticks at once
BLIND = 1e-7  # rad, for so long


@compiled
def _falls(nodes: Records, kappa: float, theta: Real, first: float, tol: float, past: int) -> int:
    """Return the number of the node (from 1) at or before which the rate of slip q falls below 0, or 0.

    Negative if it may do so in a dip about that node. Nodes up to `past` are known not to be in one.
    """
    before = first if past == 0 else slip_rate(nodes[past - 1], kappa, theta[past - 1])
    here = slip_rate(nodes[past], kappa, theta[past])
    for i in range(past, STAGES):
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
    waves: Real, kappa: float, begin: float, h: float, theta0: float, theta: Real, place: float
) -> float:
    """Return q at a place in [0, 1] of a panel."""
    at = curves_at(waves, begin + h * place)
    return slip_rate(at, kappa, between(theta0, theta, place))


@apart
def _where_it_falls(
    waves: Real, kappa: float, begin: float, h: float, theta0: float, theta: Real, node: int, tol: float
) -> float:  # fmt: skip
    """Return the place in [0, 1] where q falls below 0 before `node` (about it if negative), or NOWHERE."""
    hi = NODES[abs(node) - 1]
    lo = NODES[abs(node) - 2] if abs(node) > 1 else 0.0
    if node < 0:
        # Golden section for the bottom of the dip.
        a, b = lo, NODES[-node]
        ratio = 0.6180339887498949
        c, d = b - ratio * (b - a), a + ratio * (b - a)
        fc = _dense_rate(waves, kappa, begin, h, theta0, theta, c)
        fd = _dense_rate(waves, kappa, begin, h, theta0, theta, d)
        for _ in range(40):
            if min(fc, fd) < -tol:
                break
            if fc < fd:
                b, d, fd = d, c, fc
                c = b - ratio * (b - a)
                fc = _dense_rate(waves, kappa, begin, h, theta0, theta, c)
            else:
                a, c, fc = c, d, fd
                d = a + ratio * (b - a)
                fd = _dense_rate(waves, kappa, begin, h, theta0, theta, d)
        if min(fc, fd) >= -tol:
            return NOWHERE
        hi = c if fc < fd else d
    rate_lo = _dense_rate(waves, kappa, begin, h, theta0, theta, lo)
    rate_hi = _dense_rate(waves, kappa, begin, h, theta0, theta, hi)
    place, side = hi, 0
    for turn in range(50):
        # Illinois, with a bisection now and then; `_end_of_slip` closes in from there.
        share = rate_lo / (rate_lo - rate_hi) if rate_lo > 0.0 > rate_hi and turn % 4 != 3 else 0.5
        last, place = place, lo + share * (hi - lo)
        rate = _dense_rate(waves, kappa, begin, h, theta0, theta, place)
        if rate < 0.0:
            hi, rate_hi, rate_lo, side = place, rate, rate_lo * (0.5 if side < 0 else 1.0), -1
        else:
            lo, rate_lo, rate_hi, side = place, rate, rate_hi * (0.5 if side > 0 else 1.0), 1
        if hi - lo < NEAR or abs(place - last) < NEAR:
            return place
    return hi


@apart
def _end_of_slip(
    waves: Real, kappa: float, begin: float, guess: float, theta0: float, theta: Real, work: PanelWork
) -> float:  # fmt: skip
    """Move the end of a panel to where q is 0, solving it anew; return the end, or −1 if that fails."""
    end = guess
    for turn in range(12):
        if not solve_panel(waves, kappa, begin, end, theta0, False, theta, work):
            return -1.0
        last = work.nodes[STAGES - 1]
        angle = theta[STAGES - 1]
        slope = SLOPES[STAGES - 1, 0] * theta0
        for j in range(STAGES):
            slope += SLOPES[STAGES - 1, j + 1] * theta[j]
        slope /= end - begin
        c, s = math.cos(angle), math.sin(angle)
        fall = c * last.ddx + s * last.ddy / kappa - last.ddlimit
        fall += (c * last.dy / kappa - s * last.dx) * slope
        step = -slip_rate(last, kappa, angle) / fall if fall < 0.0 else 0.0
        step = min(max(step, -0.5 * (end - begin)), 0.5 * (end - begin))
        if abs(step) < CLOSED_IN * (1.0 + abs(end)) or turn == 11:
            break
        moved = (end + step - begin) / (end - begin)
        old = theta.copy()
        for j in range(STAGES):
            theta[j] = between(theta0, old, min(NODES[j] * moved, 1.0))
        end += step
    return end


@compiled
def _error_of(limit0: float, nodes: Records, theta0: float, theta: Real, scale: float, limits: Real) -> float:
    """Return the last Legendre terms of a panel, of the direction weighted with the limit, or of the limit.

    What the force is integrated with has waves of its own: its size counts as much as its direction.
    """
    most = 0.0
    for i in range(STAGES):
        limits[i] = nodes[i].limit / scale
        most = max(most, limits[i])
    return max(tail(theta0, theta) * min(most, 1.0), tail(limit0 / scale, limits))


@apart
def _stop_in(
    waves: Real, kappa: float, begin: float, h: float, theta0: float, theta: Real, nodes: Records,
    first: float, tol: float,
) -> float:  # fmt: skip
    """Return the place in [0, 1] of a panel where the rate of slip falls below 0, or NOWHERE."""
    past = 0
    while past < STAGES:
        node = _falls(nodes, kappa, theta, first, tol, past)
        if node == 0:
            return NOWHERE
        place = _where_it_falls(waves, kappa, begin, h, theta0, theta, node, tol)
        if place < NOWHERE:
            return place
        # A dip that does not reach 0; it may fall below 0 behind it.
        past = abs(node)
    return NOWHERE


@compiled
def _keep(panels: Records, filled: int, begin: float, end: float, theta0: float, theta: Real) -> None:
    """Write a panel to the table."""
    row = panels[filled]
    row.begin, row.end, row.start = begin, end, theta0
    for i in range(STAGES):
        row.theta[i] = theta[i]


@compiled
def _shortened(theta0: float, theta: Real, place: float) -> None:
    """Put the values at the nodes of [0, place] of a panel in the place of those at its nodes."""
    old = theta.copy()
    for i in range(STAGES):
        theta[i] = between(theta0, old, NODES[i] * place)


@apart
def slip_on(
    waves: Real, kappa: float, begin: float, end: float, theta0: float, blind: float, numbers: Numbers,
    panels: Records, filled: int,
) -> tuple[float, float, float, int, int]:  # fmt: skip
    """Follow a slip from `begin` until it sticks, at most to `end`; append its panels.

    Returns
    -------
    (place, direction there, its derivative by theta0, panels filled, 1 if it sticks there, 0 at the end,
    TABLE_FULL or UNSOLVED).
    """
    work = new_panel_work()
    nodes = work.nodes
    theta = np.empty(STAGES)
    tau, factor, tol, small = begin, 1.0, numbers.tol_rate, numbers.tail_size
    at = curves_at(waves, begin)
    first, limit0, limits = slip_rate(at, kappa, theta0), at.limit, np.empty(STAGES)
    h, decay = _first_panel(at, kappa, theta0, numbers)
    while tau < end:
        rest = end - tau
        share = rest if h > 0.95 * rest else (0.5 * rest if h > 0.5 * rest else h)
        to = end if share == rest else tau + share
        if not solve_panel(waves, kappa, tau, to, theta0, True, theta, work):
            if share <= LEAST_PANEL:
                return tau, theta0, factor, filled, UNSOLVED
            h = 0.2 * share
            continue
        error = _error_of(limit0, nodes, theta0, theta, numbers.scale, limits)
        change = 3.0 if to - begin < DECAYED * decay else 64.0
        if error > 0.0:
            change = min(change, max(0.15, 0.9 * (small / error) ** (1.0 / STAGES)))
        if error > 3.0 * small and share > LEAST_PANEL:
            h = change * share
            continue
        place = _stop_in(waves, kappa, tau, share, theta0, theta, nodes, first, tol)
        stops = place < NOWHERE and tau + place * share >= begin + blind
        if stops and place < 0.02 and first > tol and share > SHORT_PANEL:
            h = 0.1 * share  # perhaps the solution against the motion
            continue
        if stops and place < 1e-5 and share <= SHORT_PANEL:
            return tau, theta0, factor, filled, 1
        if stops:
            _shortened(theta0, theta, place)
            to = _end_of_slip(waves, kappa, tau, tau + place * share, theta0, theta, work)
            if to < 0.0:
                h = 0.5 * share
                continue
        if filled >= panels.shape[0]:
            return tau, theta0, factor, filled, TABLE_FULL
        _keep(panels, filled, tau, to, theta0, theta)
        filled += 1
        tau, theta0 = to, theta[STAGES - 1]
        factor *= work.matrix[STAGES - 1, BY_START]
        first, limit0 = slip_rate(nodes[STAGES - 1], kappa, theta0), nodes[STAGES - 1].limit
        if stops:
            return tau, theta0, factor, filled, 1
        h = min(change * share, numbers.longest)
    return end, theta0, factor, filled, 0


@compiled
def _first_panel(at: Curves, kappa: float, theta0: float, numbers: Numbers) -> tuple[float, float]:
    """Return the length of a slip's first panel, and that in which its direction decays (none: 0)."""
    F, stiff, g, _ = turning(at, kappa, theta0)
    longest, scale = numbers.longest, at.limit * g
    if not (at.limit > 1e-12 * numbers.scale and abs(stiff) * longest > FIRST_PANEL * scale):
        return longest, 0.0
    decay = scale / abs(stiff)
    aligned = stiff < 0.0 and abs(F) <= -ALIGNED * stiff
    return min((ALIGNED_PANEL if aligned else FIRST_PANEL) * decay, longest), decay


@compiled
def projection(kappa: Number, theta: Number) -> tuple[Number, Number, Number]:
    """Return (px, py, along): how L δθ follows from δt and along·(δL − n·δt) where a slip begins."""
    c, s = np.cos(theta), np.sin(theta)
    along = s * c * (1.0 - kappa) / (kappa * c * c + s * s)
    return -s - along * c, c - along * s, along


@apart
def march_path(
    waves: Real, kappa: float, grid: Real, begin: float, end: float, state: Records, numbers: Numbers,
    pieces: Records, panels: Records, count: int, filled: int,
) -> tuple[int, int]:  # fmt: skip
    """Follow the force over [begin, end] from `state`, which is moved on; append pieces and panels.

    Returns
    -------
    Numbers of pieces and panels, or (TABLE_FULL, 0) or (UNSOLVED, 0).
    """
    tau, idle, first = begin, 0, count
    opens = state[0].began == AFTER_SEPARATION
    while tau < end:
        if count >= pieces.shape[0]:
            return TABLE_FULL, 0
        row = pieces[count]
        row.motion, row.begin, row.began = state[0].motion, tau, state[0].began
        row.tx, row.ty, row.first, row.count = state[0].tx, state[0].ty, filled, 0.0
        if state[0].motion == STICK:
            at = curves_at(waves, tau)
            offset_x, offset_y = state[0].tx - at.x, state[0].ty - at.y / kappa
            tau, leaves = leave_stick(waves, kappa, grid, offset_x, offset_y, tau, end, numbers.tol)
            if leaves and opens and tau - begin <= NO_LENGTH:
                # At the margin of stick and slip neither has a length: contact begins with a slip.
                tau, count, idle = begin, first, IDLE
                _slip_from_contact(waves, kappa, tau, state)
                continue
            at = curves_at(waves, tau)
            state[0].tx, state[0].ty = offset_x + at.x, offset_y + at.y / kappa
            if leaves:
                _begin_slip(at, kappa, state)
        else:
            blind = BLIND if idle >= IDLE else 0.0
            tau, theta, factor, now, how = slip_on(
                waves, kappa, tau, end, state[0].theta, blind, numbers, panels, filled
            )
            if how < 0:
                return how, 0
            row.count = now - filled
            filled = now
            at = curves_at(waves, tau)
            state[0].theta = theta
            state[0].tx, state[0].ty = at.limit * math.cos(theta), at.limit * math.sin(theta)
            state[0].factor *= factor * at.limit
            state[0].mx, state[0].my = -math.sin(theta), math.cos(theta)
            if how == 1:
                state[0].motion, state[0].began = STICK, AFTER_SLIP
        row.end = tau
        idle = idle + 1 if tau - row.begin <= NO_LENGTH else 0
        if idle > 40:
            return UNSOLVED, 0
        count += 1
    return count, filled


@compiled
def _slip_from_contact(waves: Real, kappa: float, tau: float, state: Records) -> None:
    """Begin a slip where contact begins at τ; nothing depends on the force before it, which is 0."""
    at = curves_at(waves, tau)
    state[0].motion, state[0].began, state[0].theta = SLIP, AFTER_SEPARATION, onset_direction(at, kappa)
    state[0].tx, state[0].ty, state[0].slipped, state[0].factor = 0.0, 0.0, 1.0, 0.0


@compiled
def _begin_slip(at: Curves, kappa: float, state: Records) -> None:
    """Turn a stick whose force has reached the limit into a slip."""
    theta = math.atan2(state[0].ty, state[0].tx)
    px, py, _ = projection(kappa, theta)
    if state[0].slipped == 0.0:
        state[0].slipped, state[0].factor = 1.0, 1.0 / at.limit
        state[0].px, state[0].py = px, py
    else:
        state[0].factor *= (px * state[0].mx + py * state[0].my) / at.limit
    state[0].motion, state[0].theta = SLIP, theta
