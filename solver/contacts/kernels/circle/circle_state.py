"""The periodic force under a circular limit: what the contact does over a period, and how it got there.

Where the contact opens, each interval of contact begins with the force 0. Where it does not, the offset of
the slider is pushed by the moving limits alone (a sweeping process), so two histories never move apart: if
one of them slips for ever, all become the same. It is found from a rough march over the grid, then by
Newton's method on the force at one time; once a contact has slipped, its force is on the circle, and a change
of it is one number. If the slipping ends, the force keeps what the periods from the unloaded state left.
"""

from __future__ import annotations

import math

import numpy as np

from solver.contacts.kernels.circle.panels import (
    LIMIT,
    Curves,
    curves_at,
    onset_direction,
    slip_rate,
)
from solver.contacts.kernels.circle.path import MARCH, PANEL, PIECE, SMALL_TAIL, Numbers, march_path
from solver.contacts.kernels.state_durations import contact_intervals, one_wave
from solver.contacts.kernels.stick_slip_events import (
    AFTER_SEPARATION,
    AFTER_SLIP,
    FAILED,
    LIFTING,
    ROUNDING,
    SEPARATED,
    SLIP,
    SLIPPING,
    STICK,
    STUCK,
    UNLOADED,
)
from solver.jit.decorators import compiled
from solver.jit.fourier import Real
from solver.jit.kernel_records import Records, record
from solver.jit.separate import apart
from solver.jit.trig_polynomial import on_grid

TURN = 2.0 * math.pi
FORGOTTEN = (
    24.0  # exponent of what is left of a difference, at which the exact march begins before its period
)
# Share of a period beyond which an exact march before it costs more than it saves, but for what slips so
# little (the exponent over a period) that it may end in sticking.
MOST_FORGETTING, LITTLE = 0.75, 3.0
REPEATS = 3e-9  # change of the force over a period, relative to the largest limit, that counts as none
MOST_ROUNDS = 60
MOST_TRANSIENT = 40  # periods after which a slider that still slips is taken to do so for ever
# Periods after which a motion that slips for ever is looked for already, in so many rounds. It is believed
# where its slips last too long to fade away [rad], or fade so slowly (what is left of a difference after a
# period) that more periods would not end them.
EARLY, EARLY_ROUNDS, LASTING, SLOWLY = 3, 20, 0.03, 0.95
# Where as good as all of a difference is left after a period, its last slip has just ended; so much nearer to
# what still slipped the search goes on.
NEUTRAL, NEARER = 1.0 - 1e-5, 0.25
WAVES_PER_PANEL = 9.0  # rad that the highest harmonic turns in one panel, at most
# How the path was found, and so how its derivatives go on: each interval from no force, one period that
# repeats, or from the unloaded state to a last period that sticks (or sticks from the first).
OPENS, CLOSES, SETTLES = 0, 1, 2
# What is found of a path: these, how many pieces, panels and intervals of contact it has, and, where it
# closes, how a change of the force at the begin comes back: (mx, my)·factor·(px, py)·δt.
FOUND = record(
    how=int, pieces=int, panels=int, intervals=int, factor=float, px=float, py=float, mx=float, my=float
)


@apart
def contact_grid(waves: Real, degree: int, cos_table: Real, sin_table: Real, grid: Real) -> None:
    """Fill `grid` (6, n) with X, Y, L and their slopes at τ_j = 2πj/n."""
    for x in range(3):
        on_grid(waves[x, 0], waves[x, 1], degree, cos_table, sin_table, grid[x], grid[3 + x])


@compiled
def _fresh(state: Records, motion: float, tx: float, ty: float, theta: float, began: float) -> None:
    """Begin a march: nothing depends on its begin yet, but for a slip on its direction."""
    state[0].motion, state[0].tx, state[0].ty, state[0].theta = motion, tx, ty, theta
    state[0].began, state[0].slipped, state[0].factor = began, 0.0, 0.0
    if motion == SLIP:
        size = math.hypot(tx, ty)
        state[0].slipped, state[0].factor = 1.0, (1.0 / size if size > 0.0 else 0.0)
        state[0].px, state[0].py = -math.sin(theta), math.cos(theta)


@apart
def _march_intervals(
    waves: Real, kappa: float, grid: Real, intervals: Real, n_intervals: int, numbers: Numbers,
    pieces: Records, panels: Records, found: Records,
) -> int:  # fmt: skip
    """March every interval of contact from its beginning, where the force is 0."""
    state = np.empty(1, MARCH)
    count, filled = 0, 0
    for i in range(n_intervals):
        begin, end = intervals[i, 0], intervals[i, 1]
        at = curves_at(waves, begin)
        motion = SLIP if math.hypot(at.dx, at.dy / kappa) > at.dlimit else STICK
        theta = onset_direction(at, kappa) if motion == SLIP else 0.0
        _fresh(state, motion, 0.0, 0.0, theta, AFTER_SEPARATION)
        count, filled = march_path(
            waves, kappa, grid, begin, end, state, numbers, pieces, panels, count, filled
        )
        if count < 0:
            return count
    found[0].how, found[0].pieces, found[0].panels = OPENS, count, filled
    return LIFTING


@compiled
def _rough_step(force: Real, dx: float, dy: float, before: float, limit: float) -> float:
    """Move a force by one straight step (dx, dy) while the limit goes straight too.

    In slip tan φ/2, φ the angle from the step, decays by exp(−∫|dstep|/limit).

    Returns
    -------
    What the step forgets, that exponent, 0 if it sticks.
    """
    tx, ty = force[0], force[1]
    trial = math.sqrt((tx + dx) ** 2 + (ty + dy) ** 2)
    if trial <= limit:
        force[0], force[1] = tx + dx, ty + dy
        return 0.0
    below = max(before - math.sqrt(tx * tx + ty * ty), 0.0)
    stuck = below / (below + trial - limit)
    tx, ty = tx + stuck * dx, ty + stuck * dy
    size, length = math.sqrt(tx * tx + ty * ty), math.sqrt(dx * dx + dy * dy)
    if size == 0.0 or length == 0.0:
        share = limit / trial
        force[0], force[1] = share * (force[0] + dx), share * (force[1] + dy)
        return 0.0
    nx, ny, wx, wy = tx / size, ty / size, dx / length, dy / length
    c, exponent = nx * wx + ny * wy, 2.0 * (1.0 - stuck) * length / (size + limit)
    q = math.exp(-exponent)
    below = 1.0 + c + q * q * (1.0 - c)
    along, kept = (1.0 + c - q * q * (1.0 - c) - 2.0 * q * c) / below, 2.0 * q / below
    nx, ny = along * wx + kept * nx, along * wy + kept * ny
    force[0], force[1] = limit * nx, limit * ny
    return exponent * max(nx * wx + ny * wy, 0.0)


@apart
def _rough(grid: Real, kappa: float, force: Real, history: Real) -> tuple[int, int]:
    """Go over the grid twice from the unloaded state; find places from where to go on exactly.

    Returns
    -------
    (from, to) points of the grid: at `to` it slips most, and what happened before `from` is forgotten there;
    both the same where that takes most of a period, −1 if it does not slip in the second one. `force` is that
    at `from`.
    """
    n = grid.shape[1]
    force[0], force[1] = grid[0, 0], grid[1, 0] / kappa
    size = math.hypot(force[0], force[1])
    if size > grid[2, 0]:
        force[0], force[1] = force[0] * grid[2, 0] / size, force[1] * grid[2, 0] / size
    best, most = -1, 0.0
    for period in range(2):
        for j in range(n):
            before = j - 1 if j > 0 else n - 1
            forgets = 0.0
            if period > 0 or j > 0:
                dx, dy = grid[0, j] - grid[0, before], (grid[1, j] - grid[1, before]) / kappa
                forgets = _rough_step(force, dx, dy, grid[2, before], grid[2, j])
            history[0, j], history[1, j], history[2, j] = forgets, force[0], force[1]
            if period > 0 and forgets > most:
                best, most = j, forgets
    if best < 0:
        return -1, -1
    total, back = 0.0, 0
    while total < FORGOTTEN and back < n:
        total += history[0, (best - back + n) % n]
        back += 1
    if back > MOST_FORGETTING * n and total >= LITTLE:
        back = 0
    begin = best - back if best >= back else best - back + n
    force[0], force[1] = history[1, begin % n], history[2, begin % n]
    return begin, begin + back


@compiled
def _start_at(at: Curves, kappa: float, tx: float, ty: float, state: Records) -> None:
    """Begin with the force (tx, ty), cut to the limit; there it slips if the rate of slip says so."""
    size, theta = math.hypot(tx, ty), math.atan2(ty, tx)
    if size > at.limit * (1.0 - 1e-12) and slip_rate(at, kappa, theta) > 0.0:
        _fresh(state, SLIP, at.limit * math.cos(theta), at.limit * math.sin(theta), theta, AFTER_SLIP)
        return
    share = at.limit / size if size > at.limit else 1.0
    _fresh(state, STICK, share * tx, share * ty, theta, AFTER_SLIP)


@apart
def _repeat(
    waves: Real, kappa: float, grid: Real, begin: float, force: Real, may_end: bool, rounds: int,
    numbers: Numbers, pieces: Records, panels: Records, found: Records,
) -> int:  # fmt: skip
    """Find the force at `begin` that is the same a period later; STUCK means that the slipping ended.

    Where it may not end, because many periods from the unloaded state slip, a step of Newton's method that
    ends it is too long.
    """
    state = np.empty(1, MARCH)
    tx, ty = force[0], force[1]
    last_x, last_y = tx, ty
    before, plain = np.inf, False
    at = curves_at(waves, begin)
    for _ in range(rounds):
        _start_at(at, kappa, tx, ty, state)
        tx, ty = state[0].tx, state[0].ty
        count, filled = march_path(
            waves, kappa, grid, begin, begin + TURN, state, numbers, pieces, panels, 0, 0
        )
        if count < 0:
            return count
        rx, ry = state[0].tx - tx, state[0].ty - ty
        if state[0].slipped == 0.0 and may_end:
            return STUCK
        memory = state[0].factor * (state[0].px * state[0].mx + state[0].py * state[0].my)
        ended = state[0].slipped == 0.0 or (memory >= NEUTRAL and not may_end)
        if ended and (tx != last_x or ty != last_y):
            tx, ty = tx + NEARER * (last_x - tx), ty + NEARER * (last_y - ty)
            continue
        last_x, last_y = tx, ty
        along = state[0].factor * (state[0].px * rx + state[0].py * ry)
        change = math.hypot(rx, ry)
        plain = (change > 0.5 * before and not plain) or memory >= 1.0
        before = change
        step = 0.0 if plain else along / (1.0 - memory)
        if math.hypot(rx + step * state[0].mx, ry + step * state[0].my) <= REPEATS * numbers.scale:
            found[0].how, found[0].pieces, found[0].panels = CLOSES, count, filled
            found[0].factor, found[0].px, found[0].py = state[0].factor, state[0].px, state[0].py
            found[0].mx, found[0].my = state[0].mx, state[0].my
            return SLIPPING
        tx, ty = state[0].tx + step * state[0].mx, state[0].ty + step * state[0].my
    return FAILED


@compiled
def _lasts(pieces: Records, found: Records) -> bool:
    """Return whether the slips of a path that repeats go on for ever, or fade away very slowly."""
    slipped = 0.0
    for i in range(found[0].pieces):
        if pieces[i].motion == SLIP:
            slipped += pieces[i].end - pieces[i].begin
    left = found[0].factor * (found[0].px * found[0].mx + found[0].py * found[0].my)
    return bool(slipped >= LASTING or left >= SLOWLY)


@apart
def _settle(
    waves: Real, kappa: float, grid: Real, periods: int, numbers: Numbers, pieces: Records, panels: Records,
    found: Records, force: Real,
) -> int:  # fmt: skip
    """March from the unloaded state until a period passes without slip; SLIPPING if none does."""
    state = np.empty(1, MARCH)
    at = curves_at(waves, 0.0)
    tx, ty = at.x, at.y / kappa
    size = math.hypot(tx, ty)
    if size <= at.limit:
        _fresh(state, STICK, tx, ty, 0.0, UNLOADED)
    else:
        _start_at(at, kappa, tx, ty, state)
        state[0].slipped = 0.0
    count, filled = 0, 0
    for period in range(periods):
        before = filled
        count, filled = march_path(
            waves, kappa, grid, period * TURN, (period + 1) * TURN, state, numbers, pieces, panels, count,
            filled,
        )  # fmt: skip
        if count < 0:
            return count
        if filled == before and state[0].motion == STICK:
            found[0].how, found[0].pieces, found[0].panels = SETTLES, count, filled
            return STUCK
    force[0], force[1] = state[0].tx, state[0].ty
    return SLIPPING


@apart
def _closed(
    waves: Real, kappa: float, grid: Real, numbers: Numbers, pieces: Records, panels: Records, found: Records
) -> int:
    """Find the path of a contact that never opens."""
    force, history, n = np.zeros(2), np.empty((3, grid.shape[1])), grid.shape[1]
    begin, place = _rough(grid, kappa, force, history)
    if place >= 0:
        state = np.empty(1, MARCH)
        tau = TURN * begin / n
        at = curves_at(waves, tau)
        _start_at(at, kappa, force[0], force[1], state)
        if place > begin:
            count, _ = march_path(
                waves, kappa, grid, tau, TURN * place / n, state, numbers, pieces, panels, 0, 0
            )
            if count < 0:
                return count
            force[0], force[1] = state[0].tx, state[0].ty
        how = _repeat(
            waves, kappa, grid, TURN * place / n, force, True, MOST_ROUNDS, numbers, pieces, panels, found
        )
        if how != STUCK:
            return how
    # What a transient leaves stays: it is not averaged over a period as a motion that repeats.
    finer = Numbers(numbers.tol, numbers.tol_rate, numbers.scale, numbers.longest, 1e-2 * SMALL_TAIL)
    how = _settle(waves, kappa, grid, EARLY, finer, pieces, panels, found, force)
    if how != SLIPPING:
        return how
    how = _repeat(waves, kappa, grid, 0.0, force, False, EARLY_ROUNDS, finer, pieces, panels, found)
    if how == SLIPPING and _lasts(pieces, found):
        return how
    how = _settle(waves, kappa, grid, MOST_TRANSIENT, finer, pieces, panels, found, force)
    if how == SLIPPING:
        how = _repeat(waves, kappa, grid, 0.0, force, False, MOST_ROUNDS, finer, pieces, panels, found)
    return how


@apart
def find_path(
    waves: Real, kappa: float, cos_table: Real, sin_table: Real, pieces: Records, panels: Records,
    found: Records, intervals: Real,
) -> int:  # fmt: skip
    """Find what the contact does; fill pieces, panels and `found` (1,).

    Parameters
    ----------
    waves : (3, 2, degree + 1) X, Y and L, see `solver.contacts.kernels.circle.panels`.
    intervals : (degree + 1, 2), filled with the intervals of contact of a contact that opens.

    Returns
    -------
    SEPARATED, STUCK, SLIPPING, LIFTING or FAILED; −1 if a table is full, −2 if a panel could not be solved.
    """
    degree = waves.shape[2] - 1
    grid = np.empty((6, 2 * (cos_table.shape[1] - 1)))
    contact_grid(waves, degree, cos_table, sin_table, grid)
    motion, rate, load, total = 0.0, 0.0, 0.0, 0.0
    for j in range(grid.shape[1]):
        total += grid[0, j] + grid[1, j] + grid[2, j]
        motion = max(motion, max(abs(grid[0, j]), abs(grid[1, j]) / kappa))
        rate = max(rate, max(max(abs(grid[3, j]), abs(grid[4, j]) / kappa), abs(grid[5, j])))
        load = max(load, grid[2, j])
    if not math.isfinite(total):
        return FAILED
    found[0].intervals = 0.0
    if load <= 0.0:
        return SEPARATED
    top = 0
    for k in range(degree + 1):
        if waves[LIMIT, 0, k] != 0.0 or waves[LIMIT, 1, k] != 0.0:
            top = k
    n_intervals = -1
    if top == 1:
        n_intervals = one_wave(waves[LIMIT, 0, 0], waves[LIMIT, 0, 1], waves[LIMIT, 1, 1], intervals)
    elif top > 1:
        n_intervals = contact_intervals(waves[LIMIT, 0], waves[LIMIT, 1], top, grid[2], grid[5], intervals)
    if n_intervals == 0:
        return SEPARATED
    numbers = Numbers(
        ROUNDING * (motion + load), 5.0 * ROUNDING * (rate + load), load,
        min(WAVES_PER_PANEL / max(degree, 1), 1.6), SMALL_TAIL,
    )  # fmt: skip
    if n_intervals < 0:
        return _closed(waves, kappa, grid, numbers, pieces, panels, found)
    found[0].intervals = n_intervals
    return _march_intervals(waves, kappa, grid, intervals, n_intervals, numbers, pieces, panels, found)


@compiled
def new_tables(degree: int, times: int) -> tuple[Records, Records]:
    """Return empty tables for pieces and panels, `times` as large as is nearly always enough."""
    most = times * (48 + 6 * degree)
    return np.empty(most, PIECE), np.empty(2 * most, PANEL)
