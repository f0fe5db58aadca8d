"""Correction with the factors of the last branch point: a step costs two triangular solves, not a new LU.

Broyden's method in its limited-memory form: C. G. Broyden, Math. Comp. 19 (1965) 577; C. T. Kelley, Iterative
Methods for Linear and Nonlinear Equations (SIAM 1995), section 7.3, doi:10.1137/1.9781611970944. For many
contacts, where a factorisation costs more than several evaluations.
"""

from __future__ import annotations

import math

import numpy as np

from solver.balance.kernels.jacobian import step_back
from solver.balance.kernels.newton import ACCEPTED, TARGET
from solver.balance.kernels.residual import complete, evaluate_forces, prepare_forces
from solver.contacts.kernels.system import Evaluation, Receptance, System
from solver.jit.decorators import compiled
from solver.jit.fourier import Real
from solver.jit.lapack import set_to
from solver.jit.separate import apart

_MOST_SOLVES = 14
_SLOWEST = 0.5  # the residual has to fall by this factor a step from the third step on


@apart
def frozen_arc(
    system: System, linear: Receptance, u: Real, p: float, tangent: Real, weight_u: float, weight_p: float,
    point: Evaluation,
) -> tuple[bool, int, float, float]:  # fmt: skip
    """Solve r(u, p) = 0 on the plane through (u, p) that is orthogonal to the tangent; u in place.

    The factors are those `solver.balance.kernels.jacobian.factorise` left at the last point of the branch,
    whatever their border was: the tangent of that point spans what their upper rows map to 0.

    Returns
    -------
    (converged, solves, p, relative residual); where it converged derivatives are in place.
    """
    n = u.size
    steps, sizes = np.empty((_MOST_SOLVES + 1, n + 1)), np.empty(_MOST_SOLVES + 1)
    before, norm = np.inf, np.inf
    across = weight_p * tangent[n] * tangent[n]
    for i in range(n):
        across += weight_u * tangent[i] * tangent[i]
    for iteration in range(_MOST_SOLVES + 1):
        prepare_forces(system, linear, p)
        norm = evaluate_forces(system, linear, u, p, point)
        if not math.isfinite(norm):
            return False, iteration, p, norm
        if norm <= TARGET:
            norm = complete(system, linear, u, p, norm, point)
            return norm <= ACCEPTED, iteration, p, norm
        if norm <= ACCEPTED and norm > 0.5 * before:
            return False, iteration, p, norm  # whether rounding allows no better is for Newton's method
        if iteration == _MOST_SOLVES or norm > 1e3 * max(before, 1e-3):
            return False, iteration, p, norm
        if iteration > 2 and norm > _SLOWEST * before:
            return False, iteration, p, norm
        before = norm
        step = steps[iteration]
        for i in range(n):
            step[i] = -point.residual[i]
        step[n] = 0.0
        step_back(system, point, step)
        along = weight_p * tangent[n] * step[n]
        for i in range(n):
            along += weight_u * tangent[i] * step[i]
        set_to(step, step, -along / across, tangent)
        for j in range(iteration - 1):
            share = _dot(steps[j], step, weight_u, weight_p) / sizes[j]
            set_to(step, step, share, steps[j + 1])
        if iteration > 0:
            last = steps[iteration - 1]
            left = 1.0 - _dot(last, step, weight_u, weight_p) / sizes[iteration - 1]
            if not abs(left) > 1e-3:
                return False, iteration, p, norm
            for i in range(n + 1):
                step[i] /= left
        sizes[iteration] = _dot(step, step, weight_u, weight_p)
        if not sizes[iteration] > 0.0:
            return False, iteration, p, norm
        set_to(u, u, 1.0, step)
        p += step[n]
    return False, _MOST_SOLVES, p, norm


@compiled
def _dot(a: Real, b: Real, weight_u: float, weight_p: float) -> float:
    """Return the weighted scalar product of two vectors, λ last."""
    n = a.size - 1
    total = 0.0
    for i in range(n):
        total += a[i] * b[i]
    return weight_u * total + weight_p * a[n] * b[n]
