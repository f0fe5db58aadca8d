"""The partial derivatives of a law's functions: by hand, by a complex step, or by central differences.

A table `L` has a row for each state and one for the force; its columns are the inputs (u, v of a law in rate
form; u, v, du, dt of one in samples), the direction in which λ changes the parameters, and the states. A
complex step is exact to rounding: J. R. R. A. Martins, P. Sturdza, J. J. Alonso, ACM Trans. Math. Softw. 29
(2003) 245, doi:10.1145/838250.838251. A central difference leaves about 1e-10 of the size.
"""

from __future__ import annotations

import numpy as np

from solver.jit.decorators import compiled
from solver.jit.fourier import Complex, Real
from solver.jit.law_functions import (
    call_complex_force,
    call_complex_rate,
    call_complex_step,
    call_force,
    call_rate,
    call_rate_slopes,
    call_step,
    call_step_slopes,
)
from solver.jit.separate import apart

BY_HAND, BY_COMPLEX_STEP, BY_DIFFERENCES = 0, 1, 2
RATE_INPUTS, STEP_INPUTS = 2, 4
_TINY = 1e-30  # of a complex step, relative: only its first power is left
_STEP = 6e-6  # of a central difference, relative: the cube root of the rounding


@compiled
def inputs_of(steps: bool) -> int:
    """Return how many inputs a law has."""
    return STEP_INPUTS if steps else RATE_INPUTS


@apart
def partials(
    number: int, way: int, steps: bool, alone: bool, forces: bool, x: Real, last: Real, state: Real, p: Real,
    slope: Real, sizes: Real, L: Real, hand: Real, work: Complex,
) -> None:  # fmt: skip
    """Fill `L` (states + 1, inputs + 1 + states), see the module.

    Parameters
    ----------
    alone : whether each state follows by itself.
    forces : whether the row of the force is asked for.
    x : (inputs,) where; last : (states,) the state there, of a law in samples that of the sample before.
    state : scratch for the state after a step.
    slope : derivatives of the parameters by λ.
    sizes : of the inputs and, behind them, of the states, for differences.
    hand : (states + 1, inputs + states + parameters) scratch for derivatives by hand.
    work : (inputs + 2·states + parameters,) scratch for a complex step.
    """
    inputs, ns = x.size, last.size
    if way == BY_HAND:
        if steps:
            call_step_slopes(number, x[0], x[1], x[2], x[3], last, state, p, hand)
        else:
            call_rate_slopes(number, x[0], x[1], last, p, hand)
        for i in range(ns + 1):
            for j in range(inputs):
                L[i, j] = hand[i, j]
            first, end = (i, i + 1) if alone and i < ns else (0, ns)
            for j in range(first, end):
                L[i, inputs + 1 + j] = hand[i, inputs + j]
            total = 0.0
            for j in range(p.size):
                if slope[j] != 0.0:
                    total += slope[j] * hand[i, inputs + ns + j]
            L[i, inputs] = total
    elif way == BY_COMPLEX_STEP:
        _complex_step(number, steps, forces, x, last, p, slope, work, L)
    else:
        _differences(number, steps, forces, x, last, p, slope, sizes, L)


@apart
def _complex_step(
    number: int, steps: bool, forces: bool, x: Real, last: Real, p: Real, slope: Real, work: Complex, L: Real
) -> None:
    """Fill `L` by a complex step in each column."""
    inputs, ns, moves = x.size, last.size, False
    at, z, rate = work[:inputs], work[inputs : inputs + ns], work[inputs + ns : inputs + 2 * ns]
    q = work[inputs + 2 * ns :]
    for j in range(inputs):
        at[j] = x[j]
    for j in range(ns):
        z[j] = last[j]
    for j in range(p.size):
        q[j] = p[j]
        moves = moves or slope[j] != 0.0
    for column in range(inputs + 1 + ns):
        if column == inputs and not moves:
            for i in range(ns + 1):
                L[i, column] = 0.0
            continue
        if column < inputs:
            at[column] = complex(x[column], _TINY)
        elif column > inputs:
            z[column - inputs - 1] = complex(last[column - inputs - 1], _TINY)
        else:
            for j in range(p.size):
                q[j] = complex(p[j], _TINY * slope[j])
        force = _complex_values(number, steps, forces, at, z, q, rate)
        for i in range(ns):
            L[i, column] = rate[i].imag / _TINY
        L[ns, column] = force.imag / _TINY
        if column < inputs:
            at[column] = x[column]
        elif column > inputs:
            z[column - inputs - 1] = last[column - inputs - 1]
        else:
            for j in range(p.size):
                q[j] = p[j]


@compiled
def _complex_values(
    number: int, steps: bool, forces: bool, x: Complex, z: Complex, p: Complex, out: Complex
) -> complex:
    """Fill the rate, or the state after a step; return the force, if it is asked for."""
    if steps:
        return call_complex_step(number, x[0], x[1], x[2], x[3], z, out, p)
    if z.size > 0:
        call_complex_rate(number, x[0], x[1], z, p, out)
    return call_complex_force(number, x[0], x[1], z, p) if forces else complex(0.0)


@compiled
def _values(number: int, steps: bool, forces: bool, x: Real, z: Real, p: Real, out: Real) -> float:
    """As `_complex_values`."""
    if steps:
        return call_step(number, x[0], x[1], x[2], x[3], z, out, p)
    if z.size > 0:
        call_rate(number, x[0], x[1], z, p, out)
    return call_force(number, x[0], x[1], z, p) if forces else 0.0


@apart
def _differences(
    number: int, steps: bool, forces: bool, x: Real, last: Real, p: Real, slope: Real, sizes: Real, L: Real
) -> None:
    """Fill `L` by central differences in each column."""
    inputs, ns = x.size, last.size
    at, z, q = x.copy(), last.copy(), p.copy()
    high, low = np.zeros(ns), np.zeros(ns)
    reach = np.inf  # how far λ may go: every parameter moves by `_STEP` of itself at most
    for j in range(p.size):
        if slope[j] != 0.0:
            reach = min(reach, (abs(p[j]) if p[j] != 0.0 else 1.0) / abs(slope[j]))
    for column in range(inputs + 1 + ns):
        h, force_high, force_low = _STEP * reach, 0.0, 0.0
        if column == inputs and not np.isfinite(reach):
            for i in range(ns + 1):
                L[i, column] = 0.0
            continue
        if column != inputs:
            h = _STEP * sizes[column if column < inputs else column - 1]
        for side in range(2):
            way = h if side == 0 else -h
            if column < inputs:
                at[column] = x[column] + way
            elif column > inputs:
                z[column - inputs - 1] = last[column - inputs - 1] + way
            else:
                for j in range(p.size):
                    q[j] = p[j] + way * slope[j]
            force = _values(number, steps, forces, at, z, q, high if side == 0 else low)
            if side == 0:
                force_high = force
            else:
                force_low = force
        for i in range(ns):
            L[i, column] = 0.5 * (high[i] - low[i]) / h
        L[ns, column] = 0.5 * (force_high - force_low) / h
        if column < inputs:
            at[column] = x[column]
        elif column > inputs:
            z[column - inputs - 1] = last[column - inputs - 1]
        else:
            for j in range(p.size):
                q[j] = p[j]
