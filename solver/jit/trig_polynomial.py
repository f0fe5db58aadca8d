"""Trigonometric polynomials: values on a grid, values at a point, bracketed roots.

A polynomial of degree H is kept here as two arrays ``c[0…H]``, ``s[0…H]`` (``s[0]`` unused), because the
loops run over k; the layout ``[q0, c1, s1, …]`` of `solver.jit.fourier` is unpacked once on entry.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.jit.decorators import compiled
from solver.jit.fourier import Integer, Real
from solver.jit.separate import apart

RISING, FALLING = 1.0, -1.0
POINTS_PER_WAVE = 12  # grid points for the shortest wave kept; the grid only brackets the events
SMALLEST_GRID = 48


def grid_size(highest_harmonic: int) -> int:
    """Return the even number of grid points on which events of degree `highest_harmonic` are bracketed."""
    return max(SMALLEST_GRID, POINTS_PER_WAVE * highest_harmonic)


@lru_cache(maxsize=16)
def grid_tables(n_grid: int, highest_harmonic: int) -> tuple[Real, Real]:
    """Return cos kτ_j and sin kτ_j, (H + 1, n_grid/2 + 1) each, on the first half of the grid τ_j = 2πj/n."""
    phase = np.outer(np.arange(highest_harmonic + 1), np.arange(n_grid // 2 + 1)) % n_grid
    angle = 2.0 * np.pi / n_grid * phase
    return np.cos(angle), np.sin(angle)


@apart
def on_grid(
    c: Real, s: Real, degree: int, cos_table: Real, sin_table: Real, value: Real, slope: Real
) -> None:
    """Fill `value` and `slope` (d/dτ) of the polynomial at τ_j = 2πj/n, j = 0 … n − 1.

    Even and odd part are summed on half the grid only: q(−τ) = even − odd.
    """
    n = value.size
    half = n // 2
    parts = np.zeros((4, half + 1))
    even, odd, slope_even, slope_odd = parts[0], parts[1], parts[2], parts[3]
    for k in range(1, degree + 1):
        ck, sk = c[k], s[k]
        if ck == 0.0 and sk == 0.0:
            continue
        kc, ks = k * ck, k * sk
        for j in range(half + 1):
            cosine, sine = cos_table[k, j], sin_table[k, j]
            even[j] += ck * cosine
            odd[j] += sk * sine
            slope_even[j] += ks * cosine
            slope_odd[j] -= kc * sine
    for j in range(half + 1):
        even[j] += c[0]
        value[j] = even[j] + odd[j]
        slope[j] = slope_even[j] + slope_odd[j]
    for j in range(1, half):
        value[n - j] = even[j] - odd[j]
        slope[n - j] = slope_even[j] - slope_odd[j]


@compiled
def at_point(c: Real, s: Real, degree: int, tau: float) -> tuple[float, float, float, float]:
    """Return value, first, second and third τ-derivative of the polynomial at `tau` [rad]."""
    cos1, sin1 = math.cos(tau), math.sin(tau)
    cosk, sink = cos1, sin1
    q0, q1, q2, q3 = c[0], 0.0, 0.0, 0.0
    for k in range(1, degree + 1):
        a = c[k] * cosk + s[k] * sink
        b = s[k] * cosk - c[k] * sink
        q0 += a
        q1 += k * b
        q2 -= k * k * a
        q3 -= k * k * k * b
        cosk, sink = cosk * cos1 - sink * sin1, sink * cos1 + cosk * sin1
    return q0, q1, q2, q3


@compiled
def order_at(c: Real, s: Real, degree: int, tau: float, order: int, shift: float) -> tuple[float, float]:
    """Return the order-th derivative of (polynomial + shift) and its slope at `tau`."""
    q0, q1, q2, q3 = at_point(c, s, degree, tau)
    if order == 0:
        return q0 + shift, q1
    if order == 1:
        return q1, q2
    return q2, q3


@apart
def bracketed_root(
    c: Real, s: Real, degree: int, order: int, shift: float, lo: float, hi: float, guess: float, way: float
) -> float:
    """Return the root in [lo, hi] of the order-th derivative of (polynomial + shift).

    Newton's method kept inside a bracket: `way` is RISING if the function goes from negative at `lo` to
    positive at `hi`, else FALLING; the end values are never evaluated, so an end may itself be a zero.
    """
    x = guess
    if not (lo < x < hi):
        x = 0.5 * (lo + hi)
    moved = 0.0
    for _ in range(80):
        f, slope = order_at(c, s, degree, x, order, shift)
        if f == 0.0:
            return x
        if (f > 0.0) == (way > 0.0):
            hi = x
        else:
            lo = x
        step_to = x - f / slope if slope != 0.0 else lo - 1.0
        if not (lo <= step_to <= hi):
            step_to = 0.5 * (lo + hi)
        before, moved = moved, abs(step_to - x)
        x = step_to
        # From the second step on, a quadratically converging one leaves an error of about moved³/before².
        small = 1e-16 * (1.0 + abs(x))
        if moved <= 4.0 * small or moved * moved * moved <= small * before * before or hi - lo <= 4.0 * small:
            break
    return x


@compiled
def cubic_root(g_lo: float, slope_lo: float, g_hi: float, slope_hi: float, width: float) -> float:
    """Return where in (0, width) the cubic through values and slopes at both ends is 0; a guess, no more.

    A few Newton steps from the root of the chord; the ends have opposite signs.
    """
    rise = g_hi - g_lo
    a, b = slope_lo * width, slope_hi * width
    square, cube = 3.0 * rise - 2.0 * a - b, a + b - 2.0 * rise
    t = -g_lo / rise if rise != 0.0 else 0.5
    for _ in range(3):
        g = g_lo + t * (a + t * (square + t * cube))
        slope = a + t * (2.0 * square + 3.0 * t * cube)
        t = t - g / slope if slope != 0.0 else 0.5
        if not (0.0 < t < 1.0):
            return 0.5 * width
    return t * width


@compiled
def cubic_turn(g_lo: float, slope_lo: float, g_hi: float, slope_hi: float, width: float) -> float:
    """Return where in (0, width) the cubic through values and slopes at both ends turns; a guess, no more.

    Its slope is a parabola with the given ends and mean; the ends have opposite signs.
    """
    mean = (g_hi - g_lo) / width
    bend = 3.0 * (slope_lo + slope_hi - 2.0 * mean)
    tilt = 6.0 * mean - 4.0 * slope_lo - 2.0 * slope_hi
    inside = tilt * tilt - 4.0 * bend * slope_lo
    if inside >= 0.0:
        # The root in (0, 1), written so that nothing cancels.
        q = -0.5 * (tilt + math.copysign(math.sqrt(inside), tilt))
        for t in (q / bend if bend != 0.0 else -1.0, slope_lo / q if q != 0.0 else -1.0):
            if 0.0 < t < 1.0:
                return t * width
    fall = slope_lo - slope_hi
    return width * slope_lo / fall if fall != 0.0 else 0.5 * width


@compiled
def unpack(q: Real, ks: Integer, c: Real, s: Real) -> None:
    """Spread coefficients in the order of `solver.jit.fourier` for the harmonics `ks` over c[0…], s[0…]."""
    for k in range(c.size):
        c[k], s[k] = 0.0, 0.0
    here = 0
    for i in range(ks.size):
        k = ks[i]
        c[k] = q[here]
        if k == 0:
            here += 1
        else:
            s[k] = q[here + 1]
            here += 2


_QUARTERS, _QUARTER = 2.0 / math.pi, 0.5 * math.pi


@compiled
def cosines_and_sines(angles: NDArray[Any], cosines: NDArray[Any], sines: NDArray[Any]) -> None:
    """Fill in cos and sin of angles [rad], real or complex with a small imaginary part.

    Right to 1e-15 for the few turns of one period: Taylor's polynomials about the nearest quarter of a turn.
    """
    for i in range(angles.size):
        turns = np.rint(angles[i].real * _QUARTERS)
        z = angles[i] - turns * _QUARTER
        q = z * z
        sine = 1.6059043836821613e-10 - q * 7.647163731819816e-13
        sine = 2.7557319223985893e-6 + q * (-2.505210838544172e-8 + q * sine)
        sine = 8.333333333333333e-3 + q * (-1.984126984126984e-4 + q * sine)
        sine = z * (1.0 + q * (-1.6666666666666666e-1 + q * sine))
        cosine = 2.08767569878681e-9 + q * (-1.1470745597729725e-11 + q * 4.779477332387385e-14)
        cosine = 2.48015873015873e-5 + q * (-2.7557319223985888e-7 + q * cosine)
        cosine = 4.1666666666666664e-2 + q * (-1.388888888888889e-3 + q * cosine)
        cosine = 1.0 + q * (-0.5 + q * cosine)
        quarter = int(turns)
        odd = quarter & 1 == 1
        along, across = (sine, cosine) if odd else (cosine, sine)
        cosines[i] = -along if (quarter + 1) & 2 != 0 else along
        sines[i] = -across if quarter & 2 != 0 else across
