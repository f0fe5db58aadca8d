"""The given normal load of the contacts, N0 + Σ N_k cos(kτ + φ_k): coefficients, derivatives by λ."""

from __future__ import annotations

import math

from solver.contacts.kernels.columns import COLUMNS, N0, N1, PHASE, RATIO
from solver.jit.decorators import compiled
from solver.jit.fourier import Real


@compiled
def tie(row: Real, slope: Real) -> None:
    """Set N1 = N1_ratio N0 in the row of a contact, and its derivative."""
    row[N1] = row[RATIO] * row[N0]
    slope[N1] = row[RATIO] * slope[N0] + slope[RATIO] * row[N0]


@compiled
def fill_load(row: Real, slope: Real, added: float, load: Real, dload: Real) -> None:
    """Fill the coefficients of mean (`added` on it), cosines and sines [N], and their derivatives.

    Both have 1 + 2 K of them, K the highest harmonic of the loads in the table.
    """
    load[0], dload[0] = row[N0] + added, slope[N0]
    for j in range(1, load.size, 2):
        size, phase = (N1, PHASE) if j == 1 else (COLUMNS + j - 3, COLUMNS + j - 2)
        amplitude, turn = row[size], slope[phase]
        cosine, sine = math.cos(row[phase]), math.sin(row[phase])
        load[j], load[j + 1] = amplitude * cosine, -amplitude * sine
        dload[j] = slope[size] * cosine - amplitude * sine * turn
        dload[j + 1] = -slope[size] * sine - amplitude * cosine * turn


@compiled
def least_load(row: Real) -> float:
    """Return a bound from below of the load over a period [N], the least of it with one harmonic."""
    return float(row[N0] - _swing(row))


@compiled
def largest_load(row: Real) -> float:
    """Return a bound of |N| over a period [N]."""
    return float(abs(row[N0]) + _swing(row))


@compiled
def _swing(row: Real) -> float:
    """Return the sum of the amplitudes [N]."""
    swing = abs(row[N1])
    for column in range(COLUMNS, row.size, 2):
        swing += abs(row[column])
    return float(swing)
