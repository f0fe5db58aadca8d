"""When a stuck force reaches a circular limit: |t| − L crosses 0 upward, t = offset + (X, Y/κ).

The curves are those of `solver.contacts.kernels.circle.panels`; a grid brackets the root, Newton's method
inside the bracket finds it.
"""

from __future__ import annotations

import math

from solver.contacts.kernels.circle.panels import (
    Curves,
    curves_at,
)
from solver.jit.decorators import compiled
from solver.jit.fourier import Real
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
