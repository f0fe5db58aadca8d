"""What rounding leaves of the observed motion, and resonances of which it leaves nothing.

The matrices of a structure are rounded, and what is found with them is the exact answer of a structure whose
entries are off by some units of the last place (backward stability; N. J. Higham, Accuracy and Stability of
Numerical Algorithms, 2nd ed., SIAM 2002, ch. 7 and 10). For a harmonic with the closed loop Z + Lᴴ κ L of the
structure and its contacts, and g the row of its inverse that leads to the observed DOF, that changes the
observed motion by g δZ x: at most ε |g|_Z |x|_Z, where |x|_Z weighs every coordinate by the square root of
its largest entry of Z (`solver.linear.modal.sizes_of`). Near a node of the motion |x|_Z is far larger than
what is observed, and near a resonance both factors grow as the damping falls: the bound is about ε/ζ there.
Where contacts and excitation cancel, the rounding of what cancels is added.

Where the bound at a resonance is the motion itself no digit of its height is known, and it counts as not
damped: ζ below some ε.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solver.balance.balance import Balance
from solver.balance.kernels.linearised_contacts import fill_springs
from solver.balance.parameter import Kind
from solver.balance.workspace import Workspace
from solver.contacts.kernels.system import (
    DENSE,
    MODES,
    System,
    evaluation_by_value,
    of_all_ports,
    receptance_by_value,
)
from solver.jit.fourier import Complex, Flags, Real
from solver.linear.kernels.receptance import excitation

# What the entries of the matrices are off by, and sums of what cancels, found on random scenes.
LOST_BITS = 4.0 * float(np.finfo(float).eps)
_LOST_SUMS = 16.0  # in units of the former
_TINY = 1e-300
_SEEN = 1e-12  # share of a mode's motion below which a contact does not see it


class _Chains(NamedTuple):
    """What leads from the forces to the observed DOF, mode by mode (or coordinate by coordinate) of m."""

    seen: Complex  # (nk, m) g, the closed loop's row for the observed DOF
    moved: Complex  # (nk, m) x
    slope: Complex  # (nk,) of the observed motion by ω [m s]
    kept: Flags  # (nk,) harmonics that are observed


def observed_rounding(workspace: Workspace, u: Real, p: float, *, across: bool) -> float:
    """Return what rounding may do to the observed motion at a solution (u, λ = p) [m].

    Parameters
    ----------
    workspace : evaluated there.
    across : only what does not move the solution along the branch: a resonance that is rounded in frequency
        keeps its height.
    """
    balance = workspace.balance
    system, point = balance.system, evaluation_by_value(workspace.point)
    linear = of_all_ports(system, receptance_by_value(workspace.linear))
    forces = amplitudes(system, point.F) - system.shift[:, None] * amplitudes(system, u.reshape(point.F.shape))
    loop = linear.B[0] if not point.F.shape[0] else _through_contacts(workspace, linear.A[0], linear.B[0])
    chains = _chains(balance, forces.T, loop, p)
    pushed, free = np.abs(forces.T), linear.x_linear[0]
    observed = np.abs(free - (linear.B[0] * forces.T).sum(axis=1))
    cancelled = np.zeros(observed.size)
    if pushed.size:
        cancelled += np.abs(free) + (np.abs(linear.B[0]) * pushed).sum(axis=1)
        moved = np.abs(linear.u_linear[0]) + np.matmul(np.abs(linear.A[0]), pushed[:, :, None])[:, :, 0]
        cancelled += (np.abs(loop) * moved).sum(axis=1)
    changes = _changes(balance, chains, observed, p, across=across)
    return LOST_BITS * float(np.sum(changes + _LOST_SUMS * cancelled))


def amplitudes(system: System, coefficients: Real) -> Complex:
    """Return the complex amplitudes (..., nk) of coefficients (..., n) of the harmonics kept."""
    odd = int(system.ks[0] == 0)
    found = np.empty((*coefficients.shape[:-1], system.ks.size), np.complex128)
    found[..., :odd] = coefficients[..., :odd]
    found[..., odd:] = coefficients[..., odd::2] - 1j * coefficients[..., odd + 1 :: 2]
    return found


def _through_contacts(workspace: Workspace, A: Complex, B: Complex) -> Complex:
    """Return B κ (1 + A κ)⁻¹, (nk, nc): the observed motion for a unit of rounding of each contact's."""
    system = workspace.balance.system
    springs = np.empty((system.ks.size, int(system.first_block[-1])), np.complex128)
    fill_springs(workspace.system, workspace.point, springs)
    ports = np.diff(system.first_port)[system.owner]
    row = np.repeat(np.arange(system.owner.size), ports)
    port = np.arange(row.size) - np.repeat(np.cumsum(ports) - ports, ports)
    first = system.first_port[system.owner][row]
    kappa = np.zeros((system.ks.size, ports.size, ports.size), np.complex128)
    block = system.first_block[system.owner][row] + (row - first) * ports[row] + port
    kappa[:, row, first + port] = springs[:, block]
    every = np.arange(ports.size)
    kappa[:, every, every] -= system.shift
    led = np.matmul(B[:, None, :], kappa)
    closed = np.eye(ports.size) + np.matmul(A, kappa)
    return np.linalg.solve(closed.transpose(0, 2, 1), led.transpose(0, 2, 1))[:, :, 0]


def _chains(balance: Balance, forces: Complex, loop: Complex, p: float) -> _Chains:
    """Return how the excitation and the forces (nk, nc) of the contacts move what is observed."""
    system = balance.system
    omega = p if balance.parameter.kind is Kind.FREQUENCY else system.omega
    level = np.array([excitation.py_func(system, p, int(k))[0] for k in system.ks])[:, None]
    ks, which = system.ks[:, None], system.which
    kept = np.ones(system.ks.size, np.bool_) if system.only < 0 else system.ks == system.only
    if system.form == DENSE:
        return _dense_chains(balance, forces, loop, omega, p, level, kept)
    pushed = system.modal_forces * level - np.matmul(forces[:, None, :], system.contact_duals[which])[:, 0]
    seen = system.observe_modes[which] - np.matmul(loop[:, None, :], system.contact_modes[which])[:, 0]
    if system.form == MODES:
        slope = 1j * ks * system.dampings[which] - 2.0 * ks**2 * omega
        d = system.eigenvalues[which] - (ks * omega) ** 2 + 1j * ks * omega * system.dampings[which]
    else:
        slope = np.broadcast_to(1j * ks, pushed.shape)
        d = 1j * ks * omega - system.eigenvalues[which]
    d = np.where(d == 0.0, _TINY, d)
    seen, moved = seen / d, pushed / d
    return _Chains(seen, moved, -(seen * slope * moved).sum(axis=1), kept)


def _dense_chains(
    balance: Balance, forces: Complex, loop: Complex, omega: float, p: float, level: Complex, kept: Flags
) -> _Chains:
    """Return the same from the matrices."""
    system = balance.system
    ks, which = np.maximum(system.ks, 1)[:, None, None], system.which
    K, C, M, pushed = system.K, system.C, system.M, system.forces
    if balance.parameter.kind is Kind.STRUCTURE:
        by = p - system.parameter_reference
        K, C, M = K + by * system.dK, C + by * system.dC, M + by * system.dM
        if system.ddK.size:
            K = K + 0.5 * by * by * system.ddK
        if system.dforces.size:
            pushed = pushed + by * system.dforces[0] + 0.5 * by * by * system.dforces[1]
    Z = K[which] + 1j * ks * omega * C[which] - (ks * omega) ** 2 * M[which]
    L = system.L[which]
    pushed = pushed * level - np.matmul(forces[:, None, :], L.conj())[:, 0]
    seen = system.observe - np.matmul(loop[:, None, :], L)[:, 0]
    moved = np.linalg.solve(Z, pushed[:, :, None])[:, :, 0]
    seen = np.linalg.solve(Z.transpose(0, 2, 1), seen[:, :, None])[:, :, 0]
    turned = np.matmul(1j * ks * C[which] - 2.0 * ks**2 * omega * M[which], moved[:, :, None])[:, :, 0]
    return _Chains(seen, moved, -(seen * turned).sum(axis=1), kept)


def _changes(balance: Balance, chains: _Chains, observed: Real, p: float, *, across: bool) -> Real:
    """Return the bounds g δZ x of harmonics with observed amplitudes (nk,), in units of rounding [m]."""
    seen, moved, slope, kept = chains
    system = balance.system
    omega = p if balance.parameter.kind is Kind.FREQUENCY else system.omega
    k = np.maximum(system.ks, int(system.form == DENSE))[:, None] * omega
    by = balance.sizes[:, :, system.which]
    left, right = (np.sqrt(each[0] + k * each[1] + k**2 * each[2]) for each in by)
    whole = _norm(left * seen) * _norm(right * moved)
    if across:
        # Entries of Z are real but for damping: what they do along the slope by ω moves the resonance alone.
        # Turned so that the largest parts of x, and of g against the slope, are real, the rest counts.
        turn = np.exp(-0.5j * np.angle(((right * moved) ** 2).sum(axis=1)))
        other = np.exp(-1j * np.angle(slope)) / turn
        x, g = moved * turn[:, None], seen * other[:, None]
        aside = _norm(left * g.real) * _norm(right * x.imag) + _norm(left * g.imag) * _norm(right * x.real)
        lost = k[:, 0] * _norm(np.sqrt(by[0, 1]) * seen) * _norm(np.sqrt(by[1, 1]) * moved)
        far = LOST_BITS * whole**2 / np.maximum(observed, _TINY)  # where it moves by more than it is wide
        whole = np.minimum(aside + lost + far, whole)
    return np.where(kept, whole, 0.0)


def _norm(rows: Real | Complex) -> Real:
    return np.sqrt((np.abs(rows) ** 2).sum(axis=1))
