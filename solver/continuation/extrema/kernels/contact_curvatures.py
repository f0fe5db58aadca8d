"""The contacts at one (u, ω, p) for `amplitude_hessian` beside this module: forces and what they bend.

Elastic Coulomb contacts keep the events of their forces for the second derivatives; other laws find them
again.
"""

from __future__ import annotations

import numpy as np

from solver.balance.kernels.slopes import springs_of
from solver.contacts.kernels.columns import KT, MU
from solver.contacts.kernels.coulomb.line_force import contact_force
from solver.contacts.kernels.coulomb.line_hessian import second_along
from solver.contacts.kernels.laws import call_law, call_second
from solver.contacts.kernels.stick_slip_events import FAILED, SEPARATED, STUCK, UNLOADED
from solver.contacts.kernels.system import System
from solver.continuation.extrema.kernels.peak_state import Summit
from solver.jit.decorators import compiled
from solver.jit.fourier import Real, coefficient_count
from solver.jit.lapack import dot
from solver.jit.separate import apart
from solver.linear.kernels.dynamic_stiffness import VALUE


@apart
def forces_at(system: System, u: Real, at: Summit) -> bool:
    """Evaluate all contacts, forces less shift · u; False if one failed."""
    n = coefficient_count(system.ks)
    for e in range(system.laws.size):
        good = _jenkins_at(system, e, u, at) if system.jenkins[e] == 1 else _other_law_at(system, e, u, at)
        if not good:
            return False
    for c in range(system.shift.size):
        for i in range(n):
            at.F[c, i] -= system.shift[c] * u[c * n + i]
    return True


@compiled
def _jenkins_at(system: System, e: int, u: Real, at: Summit) -> bool:
    """Evaluate an elastic Coulomb contact, of one port, with what its second derivatives need."""
    n, c, block, row = coefficient_count(system.ks), system.first_port[e], system.first_block[e], at.table[e]
    state, count = contact_force(
        u[c * n : (c + 1) * n], system.ks, at.load[e], system.load_ks, row[KT], row[MU], system.cos_table,
        system.sin_table, at.segments[e], at.dF_dU[block], at.dF_dkt[e], at.dF_dmu[e], at.dF_dN[e], at.F[c],
    )  # fmt: skip
    at.states[e], at.counts[e], at.point.slopes[c] = state, count, np.nan
    if state == FAILED:
        return False
    if state == SEPARATED:
        at.point.slopes[c] = 0.0
    elif state == STUCK and at.segments[e, 0].began == UNLOADED:
        at.point.slopes[c] = row[KT]
    for i in range(n):
        total = at.slope[e, KT] * at.dF_dkt[e, i] + at.slope[e, MU] * at.dF_dmu[e, i]
        for j in range(at.dload.shape[1]):
            total += at.dF_dN[e, i, j] * at.dload[e, j]
        at.dF_dp[c, i] = total
    return True


@compiled
def _other_law_at(system: System, e: int, u: Real, at: Summit) -> bool:
    """Evaluate an element that follows another law."""
    n, c, end = coefficient_count(system.ks), system.first_port[e], system.first_port[e + 1]
    block, last = system.first_block[e], system.first_block[e + 1]
    U = u[c * n : end * n].reshape((end - c, n))
    state, _ = call_law(
        system.laws[e], U, system.ks, at.load[e], system.load_ks, at.table[e], at.slope[e], at.dload[e],
        system.cos_table, system.sin_table, at.point.segments, at.F[c:end], at.dF_dU[block:last],
        at.dF_dp[c:end],
    )  # fmt: skip
    at.states[e] = state
    springs_of(at.dF_dU[block:last], at.point.slopes[c:end])
    return bool(state != FAILED)


@compiled
def add_slopes_times(
    system: System, at: Summit, transposed: bool, sign: float, x: Real, y: Real
) -> None:  # fmt: skip
    """Add sign (∂F/∂U − shift) x to y over all ports, or its transpose; x, y (nc, n)."""
    n = coefficient_count(system.ks)
    for e in range(system.laws.size):
        first, m = system.first_port[e], system.first_port[e + 1] - system.first_port[e]
        for a in range(m):
            for b in range(m):
                G = at.dF_dU[system.first_block[e] + a * m + b]
                for i in range(n):
                    if transposed:
                        for j in range(n):
                            y[first + b, j] += sign * G[i, j] * x[first + a, i]
                    else:
                        total = 0.0
                        for j in range(n):
                            total += G[i, j] * x[first + b, j]
                        y[first + a, i] += sign * total
            for i in range(n):
                y[first + a, i] -= sign * system.shift[first + a] * x[first + a, i]


@apart
def second_forces_at(system: System, u: Real, at: Summit) -> float:
    """Fill h with zᵀ∂²F/∂U² du/dω of all contacts; return the same of ∂²F/∂p∂U. NaN if one failed."""
    total = 0.0
    for e in range(system.laws.size):
        total += (
            _second_of_jenkins(system, e, u, at) if system.jenkins[e] == 1 else _second_of(system, e, u, at)
        )
    return total


@compiled
def _second_of_jenkins(system: System, e: int, u: Real, at: Summit) -> float:
    """Fill h of an elastic Coulomb contact with zᵀ∂²F/∂U² du/dω; return the same by p."""
    n, c, block, row = coefficient_count(system.ks), system.first_port[e], system.first_block[e], at.table[e]
    along, none, out_N = np.empty(n), np.zeros(at.dload.shape[1]), np.empty(at.dload.shape[1])
    for i in range(n):
        along[i] = -at.rhs[1, c * n + i]
    by_kt, by_mu = second_along(
        u[c * n : (c + 1) * n], system.ks, at.load[e], system.load_ks, row[KT], row[MU], at.states[e],
        at.segments[e], at.counts[e], at.dF_dU[block], at.dF_dN[e], at.z[VALUE, c], along, none,
        at.h[c * n : (c + 1) * n], out_N,
    )  # fmt: skip
    total = dot(out_N, at.dload[e])
    if at.slope[e, KT] != 0.0:
        total += by_kt * at.slope[e, KT]
    if at.slope[e, MU] != 0.0:
        total += by_mu * at.slope[e, MU]
    return total


@compiled
def _second_of(system: System, e: int, u: Real, at: Summit) -> float:
    """Do the same of an element that follows another law; NaN if that failed."""
    n, c, end = coefficient_count(system.ks), system.first_port[e], system.first_port[e + 1]
    along, shape = np.empty((end - c, n)), (end - c, n)
    for a in range(end - c):
        for i in range(n):
            along[a, i] = -at.rhs[1, (c + a) * n + i]
    out_row, out_load = np.empty(at.slope.shape[1]), np.empty(at.dload.shape[1])
    state = call_second(
        at.seconds[e], u[c * n : end * n].reshape(shape), system.ks, at.load[e], system.load_ks, at.table[e],
        system.cos_table, system.sin_table, at.z[VALUE][c:end], along, np.zeros(at.slope.shape[1]),
        np.zeros(at.dload.shape[1]), at.h[c * n : end * n].reshape(shape), out_row, out_load,
    )  # fmt: skip
    if state == FAILED:
        return np.nan
    total = dot(out_load, at.dload[e])
    for column in range(at.slope.shape[1]):
        if at.slope[e, column] != 0.0:
            total += out_row[column] * at.slope[e, column]
    return total
