"""One row of a map: the response at many frequencies, evenly spaced, each solved exactly there."""

from __future__ import annotations

import numpy as np

from solver.balance.kernels.newton import newton
from solver.balance.kernels.output import extremes, observed_motion
from solver.contacts.kernels.system import Evaluation, Receptance, System
from solver.jit.decorators import compiled
from solver.jit.fourier import Integer, Real, coefficient_count
from solver.jit.lapack import copy_to
from solver.jit.separate import apart
from solver.linear.kernels.receptance import receptance

# Columns of the values of a row.
MAX_ABS, HALF_RANGE, RESIDUAL = 0, 1, 2
ROW_VALUES = 3
# What is known of a point.
UNSOLVED, GIVEN, SOLVED = 0, 1, 2


@apart
def solve_row(
    system: System, linear: Receptance, point: Evaluation, omegas: Real, begin: int, above: Real,
    known_above: Integer, solutions: Real, known: Integer, values: Real,
) -> tuple[int, int]:  # fmt: skip
    """Solve a row from point number `begin` on, each predicted from its neighbours.

    Parameters
    ----------
    omegas : (F,) evenly spaced [rad/s].
    above, known_above : (F, nt), (F,) the neighbouring row.
    solutions, known : (F, nt), (F,) of this row, filled; at `begin` a guess may be GIVEN.
    values : (F, ROW_VALUES) filled.

    Returns
    -------
    (the first point that was not solved, or F; Newton iterations).
    """
    spent = 0
    u, x = np.empty(solutions.shape[1]), np.empty(coefficient_count(system.ks))
    for i in range(begin, omegas.size):
        receptance(system, omegas[i], linear)
        good = False
        for attempt in range(2):
            if i == begin and known[i] == GIVEN:
                copy_to(u, solutions[i])
            elif attempt == 0:
                if not _predict(i, above, known_above, solutions, known, u):
                    continue
            elif i > 0 and known[i - 1] == SOLVED:
                copy_to(u, solutions[i - 1])
            else:
                continue
            good, iterations, norm = newton(system, linear, u, omegas[i], 0.0, point)
            spent += iterations
            if good:
                values[i, RESIDUAL] = norm
                break
        if not good:
            return i, spent
        copy_to(solutions[i], u)
        known[i] = SOLVED
        observed_motion(system, linear, u, point, x)
        high, _, low, _ = extremes(system, x)
        values[i, HALF_RANGE] = 0.5 * (high - low)
        values[i, MAX_ABS] = values[i, HALF_RANGE] if system.centred == 1 else max(high, -low)
    return omegas.size, spent


@compiled
def _predict(i: int, above: Real, known_above: Integer, solutions: Real, known: Integer, u: Real) -> bool:
    """Extrapolate along the row by a parabola, corrected by what that misses in the row above.

    Returns False where nothing is known nearby.
    """
    reach = 0
    while reach < 3 and i - reach > 0 and known[i - reach - 1] == SOLVED:
        reach += 1
    beside = known_above[i] == SOLVED
    if reach == 0:
        if beside:
            copy_to(u, above[i])
        return beside
    for back in range(1, reach + 1):
        beside = beside and known_above[i - back] == SOLVED
    w1 = 3.0 if reach == 3 else float(reach)
    w2 = -3.0 if reach == 3 else -1.0 if reach == 2 else 0.0
    w3 = 1.0 if reach == 3 else 0.0
    b2, b3 = i - min(reach, 2), i - reach
    for j in range(u.size):
        u[j] = w1 * solutions[i - 1, j] + w2 * solutions[b2, j] + w3 * solutions[b3, j]
        if beside:
            u[j] += above[i, j] - w1 * above[i - 1, j] - w2 * above[b2, j] - w3 * above[b3, j]
    return True
