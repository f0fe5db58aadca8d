"""The given normal load of the contacts, N0 + N1 cos(τ + φ): its coefficients and their derivatives by λ."""

from __future__ import annotations

import math

from solver.contacts.kernels.columns import N0, N1, PHASE, RATIO
from solver.jit.decorators import compiled
from solver.jit.fourier import Real


@compiled
def tie(row: Real, slope: Real) -> None:
    """Set N1 = N1_ratio N0 in the row of a contact, and its derivative."""
    row[N1] = row[RATIO] * row[N0]
    slope[N1] = row[RATIO] * slope[N0] + slope[RATIO] * row[N0]


@compiled
def fill_load(row: Real, slope: Real, added: float, load: Real, dload: Real) -> None:
    """Fill the coefficients of mean (`added` on it), cosine and sine [N], (3,), and their derivatives."""
    cosine, sine = math.cos(row[PHASE]), math.sin(row[PHASE])
    amplitude, turn = row[N1], slope[PHASE]
    load[0], dload[0] = row[N0] + added, slope[N0]
    load[1], load[2] = amplitude * cosine, -amplitude * sine
    dload[1] = slope[N1] * cosine - amplitude * sine * turn
    dload[2] = -slope[N1] * sine - amplitude * cosine * turn


@compiled
def least_load(row: Real) -> float:
    """Return the least of the load over a period [N]."""
    return float(row[N0] - abs(row[N1]))


@compiled
def largest_load(row: Real) -> float:
    """Return a bound of |N| over a period [N]."""
    return float(abs(row[N0]) + abs(row[N1]))
