"""The contacts at a solution as springs: forces, their slopes by λ, and their answer to small changes."""

from __future__ import annotations

import numpy as np

from solver.balance.kernels.output import force_slope
from solver.balance.kernels.residual import evaluate
from solver.contacts.kernels.system import Evaluation, Receptance, System
from solver.jit.fourier import Complex, Real, coefficient_count, cosine_position
from solver.jit.separate import apart
from solver.linear.kernels.receptance import receptance


@apart
def _linearise(
    system: System, linear: Receptance, point: Evaluation, u: Real, p: float, du: Real, motions: Complex,
    stiffness: Complex,
) -> float:  # fmt: skip
    """Evaluate a solution (u, λ = p) whose branch leaves it in the direction (du, 1).

    Parameters
    ----------
    motions : (4, nk, nc) complex amplitudes of u, du/dλ, the forces less those of the shift, and their slope
        by λ; filled.
    stiffness : (nk, nc, nc) what a small change of a harmonic of the motions changes in the same harmonic of
        the forces, the shift included [N/m]: the part of dF/dU that commutes with a shift in time; filled.

    Returns
    -------
    The relative residual.
    """
    receptance(system, p, linear)
    norm = evaluate(system, linear, u, p, 0.0, point)
    nc, n = system.owner.size, coefficient_count(system.ks)
    dF = np.empty((nc, n))
    force_slope(system, point, du, 1.0, dF)
    for i in range(system.ks.size):
        here = cosine_position(system.ks, i)
        has_sine = system.ks[i] > 0
        for c in range(nc):
            at = c * n + here
            motions[0, i, c], motions[1, i, c] = complex(u[at], 0.0), complex(du[at], 0.0)
            motions[2, i, c] = complex(point.F[c, here] - system.shift[c] * u[at], 0.0)
            motions[3, i, c] = complex(dF[c, here], 0.0)
            if has_sine:
                motions[0, i, c] -= 1j * u[at + 1]
                motions[1, i, c] -= 1j * du[at + 1]
                motions[2, i, c] -= 1j * (point.F[c, here + 1] - system.shift[c] * u[at + 1])
                motions[3, i, c] -= 1j * dF[c, here + 1]
            for d in range(nc):
                stiffness[i, c, d] = 0.0
            e = system.owner[c]
            first, m = system.first_port[e], system.first_port[e + 1] - system.first_port[e]
            for q in range(m):
                block = point.dF_dU[system.first_block[e] + (c - first) * m + q]
                answer = complex(block[here, here], 0.0)
                if has_sine:
                    even = 0.5 * (block[here, here] + block[here + 1, here + 1])
                    answer = complex(even, 0.5 * (block[here, here + 1] - block[here + 1, here]))
                stiffness[i, c, first + q] = answer
    return norm


@apart
def linearise_all(
    system: System, linear: Receptance, point: Evaluation, solutions: Real, tangents: Real, motions: Complex,
    stiffness: Complex,
) -> None:  # fmt: skip
    """Evaluate points of a branch.

    Parameters
    ----------
    solutions, tangents : (P, nt + 1) points and directions of the branch, λ last, which must change.
    motions, stiffness : (P, 4, nk, nc) and (P, nk, nc, nc), as in `_linearise`; filled.
    """
    nt = solutions.shape[1] - 1
    du = np.empty(nt)
    for row in range(solutions.shape[0]):
        for i in range(nt):
            du[i] = tangents[row, i] / tangents[row, nt]
        p = solutions[row, nt]
        _linearise(system, linear, point, solutions[row, :nt], p, du, motions[row], stiffness[row])
