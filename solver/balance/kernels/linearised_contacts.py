"""The contacts at a solution as springs: forces, their slopes by λ, and their answer to small changes."""

from __future__ import annotations

import numpy as np

from solver.balance.kernels.output import force_slope
from solver.balance.kernels.residual import evaluate, evaluate_contacts
from solver.contacts.kernels.system import Evaluation, Receptance, System
from solver.jit.decorators import compiled
from solver.jit.fourier import Complex, Real, coefficient_count, cosine_position
from solver.jit.separate import apart
from solver.linear.kernels.receptance import receptance


@apart
def fill_springs(system: System, point: Evaluation, springs: Complex) -> None:
    """Fill ĝ_k, (nk, blocks) [N/m], of the contacts where `point` was evaluated: F̂_k changes by ĝ_k û_k.

    It is the part of dF/dU that commutes with a shift in time; what answers a change with its mirror image is
    left out. The blocks are those of dF/dU: port by port of each contact.
    """
    for i in range(system.ks.size):
        here = cosine_position(system.ks, i)
        for b in range(springs.shape[1]):
            block = point.dF_dU[b]
            answer = complex(block[here, here], 0.0)
            if system.ks[i] > 0:
                even = 0.5 * (block[here, here] + block[here + 1, here + 1])
                answer = complex(even, 0.5 * (block[here, here + 1] - block[here + 1, here]))
            springs[i, b] = answer


@compiled
def _fill_stiffness(system: System, point: Evaluation, stiffness: Complex) -> None:
    """Fill ĝ_k as a matrix of all ports, (nk, nc, nc) [N/m]."""
    nk, nc, ne = system.ks.size, system.owner.size, system.laws.size
    springs = np.empty((nk, system.first_block[ne]), np.complex128)
    fill_springs(system, point, springs)
    for i in range(nk):
        for c in range(nc):
            for d in range(nc):
                stiffness[i, c, d] = 0.0
            e = system.owner[c]
            first, m = system.first_port[e], system.first_port[e + 1] - system.first_port[e]
            for q in range(m):
                stiffness[i, c, first + q] = springs[i, system.first_block[e] + (c - first) * m + q]


@compiled
def _amplitude(system: System, i: int, coefficients: Real, at: int) -> complex:
    """Return the complex amplitude of harmonic number i of the motion whose coefficients begin at `at`."""
    here = at + cosine_position(system.ks, i)
    return complex(coefficients[here], -coefficients[here + 1] if system.ks[i] > 0 else 0.0)


@apart
def linearise(
    system: System, linear: Receptance, point: Evaluation, u: Real, p: float, du: Real, motions: Complex,
    stiffness: Complex,
) -> float:  # fmt: skip
    """Evaluate a solution (u, λ = p) whose branch leaves it in the direction (du, 1).

    Parameters
    ----------
    motions : (4, nk, nc) complex amplitudes of u, du/dλ, the forces less those of the shift, and their slope
        by λ; filled.
    stiffness : (nk, nc, nc) as in `_fill_stiffness`, the shift included [N/m]; filled.

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
        for c in range(nc):
            motions[0, i, c] = _amplitude(system, i, u, c * n)
            motions[1, i, c] = _amplitude(system, i, du, c * n)
            motions[2, i, c] = _amplitude(system, i, point.F[c], 0) - system.shift[c] * motions[0, i, c]
            motions[3, i, c] = _amplitude(system, i, dF[c], 0)
    _fill_stiffness(system, point, stiffness)
    return norm


@apart
def springs_at(system: System, point: Evaluation, solutions: Real, springs: Complex) -> None:
    """Fill `springs` (P, nk, blocks) as `fill_springs` at solutions (P, nt + 1), λ last."""
    nt = solutions.shape[1] - 1
    for row in range(solutions.shape[0]):
        evaluate_contacts(system, solutions[row, :nt], solutions[row, nt], 0.0, False, point)
        fill_springs(system, point, springs[row])


@apart
def forces_at(
    system: System, point: Evaluation, solutions: Real, forces: Complex, stiffness: Complex
) -> None:  # fmt: skip
    """Evaluate the contacts at points.

    Parameters
    ----------
    solutions : (P, nt + 1) motions, λ last.
    forces : (P, nk, nc) complex amplitudes of the forces less those of the shift; filled.
    stiffness : (P, nk, nc, nc) as in `_fill_stiffness`, filled; or of no row where it is not wanted.
    """
    nt, n = solutions.shape[1] - 1, coefficient_count(system.ks)
    for row in range(solutions.shape[0]):
        u = solutions[row, :nt]
        if not evaluate_contacts(system, u, solutions[row, nt], 0.0, False, point):
            point.F[:] = np.nan
        for i in range(system.ks.size):
            for c in range(system.owner.size):
                carried = system.shift[c] * _amplitude(system, i, u, c * n)
                forces[row, i, c] = _amplitude(system, i, point.F[c], 0) - carried
        if stiffness.shape[0] > 0:
            _fill_stiffness(system, point, stiffness[row])
