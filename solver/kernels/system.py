"""The condensed multi-harmonic balance r(u, λ) = u − ū + A F(u): its data and its evaluation.

With Z_k = K − (kω)²M + ikωC of every kept harmonic k, the linear degrees of freedom are eliminated:
A_k = L Z_k⁻¹ Lᴴ, ū_k = L Z_k⁻¹ f̂_k, so the unknowns are the slip motions of the contacts alone. Three forms of
Z⁻¹ are kept: undamped modes (classical damping), poles and residues (any damping whose eigenvectors span the
state space), both at the cost of modes × contacts² a frequency, and dense (the rest, and whenever λ is a
parameter of the structure itself).

A stiffness `shift` of each contact may be moved into the structure and taken out of the force again,
r = u − ū + A (F − shift u): the same equation, but Z_0 stays regular when only contacts hold a part in place.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solver.fourier import Complex, Integer, Real, coefficient_count, cosine_position
from solver.kernels.compiled import compiled
from solver.kernels.events import FAILED
from solver.kernels.force import contact_force

# What λ is.
FREQUENCY, LEVEL, FORCE_PHASE, STRUCTURE = 0, 1, 2, 3
NORMAL_LOAD, LOAD_AMPLITUDE, LOAD_RATIO, LOAD_PHASE, STIFFNESS, FRICTION = 4, 5, 6, 7, 8, 9
# How Z⁻¹ is kept.
MODES, POLES, DENSE = 0, 1, 2
# Columns of the contact table.
KT, MU, N0, N1, RATIO, PHASE = 0, 1, 2, 3, 4, 5
LOAD_COEFFICIENTS = 3
LOAD_HARMONICS = np.array([0, 1], dtype=np.int64)


class System(NamedTuple):
    """Everything the compiled loops need; arrays only.

    nk harmonics, nc contacts, ns distinct structures (nodal diameters), nm modes or n DOFs of each.
    """

    ks: Integer  # (nk,) harmonics kept, ascending
    which: Integer  # (nk,) structure of each harmonic
    cos_table: Real
    sin_table: Real
    contacts: Real  # (nc, 6) kt, mu, N0, N1, N1_ratio (NaN: not tied), N1_phase
    active: Real  # (nc,) 1.0 where λ acts
    shift: Real  # (nc,) stiffness moved into the structure [N/m]
    kind: int  # what λ is
    omega: float  # rad/s, when λ is not the frequency
    level_reference: float  # N, the excitation amplitude at level 1
    phase_reference: float  # rad
    parameter_reference: float  # the value of a structural parameter at which K, M, C stand
    form: int
    eigenvalues: Complex  # (ns, nm) undamped ω² [rad²/s²], or poles [rad/s]
    dampings: Real  # (ns, nm) modal damping [1/s] of undamped modes
    contact_modes: Complex  # (ns, nc, nm) L x_m
    contact_duals: Complex  # (ns, nc, nm) y_mᴴ Lᴴ, normalised
    observe_modes: Complex  # (ns, nm)
    modal_forces: Complex  # (nk, nm) y_mᴴ f̂_k at level 1, normalised
    K: Complex  # (ns, n, n), likewise below; empty unless dense
    C: Complex
    M: Complex
    dK: Complex  # derivative by the structural parameter
    dC: Complex
    dM: Complex
    L: Complex  # (ns, nc, n)
    observe: Complex  # (n,)
    forces: Complex  # (nk, n) f̂_k at level 1


class Receptance(NamedTuple):
    """Condensed linear part at one λ, and its derivative by λ (first index 0: value, 1: derivative)."""

    A: Complex  # (2, nk, nc, nc)
    u_linear: Complex  # (2, nk, nc)
    B: Complex  # (2, nk, nc) from the contact forces to the observed DOF
    x_linear: Complex  # (2, nk)


class Evaluation(NamedTuple):
    """The balance at one (u, λ): residual, Jacobian, derivative by λ, and the contact forces behind them."""

    residual: Real  # (nt,)
    jacobian: Real  # (nt, nt) dr/du
    dr_dp: Real  # (nt,) dr/dλ
    F: Real  # (nc, n)
    dF_dU: Real  # (nc, n, n)
    dF_dkt: Real  # (nc, n)
    dF_dmu: Real  # (nc, n)
    dF_dN: Real  # (nc, n, 3)
    dF_dp: Real  # (nc, n) partial derivative of the force by λ
    states: Integer  # (nc,)
    segments: Real  # scratch


@compiled
def new_receptance(system: System) -> Receptance:
    """Return an empty receptance for `system`."""
    nk, nc = system.ks.size, system.contacts.shape[0]
    return Receptance(
        np.zeros((2, nk, nc, nc), np.complex128),
        np.zeros((2, nk, nc), np.complex128),
        np.zeros((2, nk, nc), np.complex128),
        np.zeros((2, nk), np.complex128),
    )


@compiled
def new_evaluation(system: System) -> Evaluation:
    """Return empty arrays for `evaluate`."""
    nc, n = system.contacts.shape[0], coefficient_count(system.ks)
    return Evaluation(
        np.zeros(nc * n), np.zeros((nc * n, nc * n)), np.zeros(nc * n),
        np.zeros((nc, n)), np.zeros((nc, n, n)), np.zeros((nc, n)), np.zeros((nc, n)),
        np.zeros((nc, n, LOAD_COEFFICIENTS)), np.zeros((nc, n)), np.zeros(nc, np.int64),
        np.zeros((16 * max(system.ks[-1], 1) + 64, 6)),
    )  # fmt: skip


@compiled
def contact_values(system: System, p: float, added: float) -> tuple[Real, Real, Real, Real]:
    """Return the contacts at λ = p: table, load coefficients (nc, 3), and the derivatives of both by λ.

    `added` [N] is put on every mean load (the start-up ladder presses the contacts into full stick).
    """
    table = system.contacts.copy()
    slope = np.zeros_like(table)
    nc = table.shape[0]
    for c in range(nc):
        row, d = table[c], slope[c]
        tied = not math.isnan(row[RATIO])
        if system.active[c] > 0.0:
            if system.kind == NORMAL_LOAD:
                row[N0], d[N0] = p, 1.0
            elif system.kind == LOAD_AMPLITUDE:
                row[N1], d[N1], tied = p, 1.0, False
            elif system.kind == LOAD_RATIO:
                row[RATIO], d[RATIO], tied = p, 1.0, True
            elif system.kind == LOAD_PHASE:
                row[PHASE], d[PHASE] = p, 1.0
            elif system.kind == STIFFNESS:
                row[KT], d[KT] = p, 1.0
            elif system.kind == FRICTION:
                row[MU], d[MU] = p, 1.0
        if tied:
            row[N1] = row[RATIO] * row[N0]
            d[N1] = row[RATIO] * d[N0] + d[RATIO] * row[N0]
    load, dload = np.empty((nc, LOAD_COEFFICIENTS)), np.empty((nc, LOAD_COEFFICIENTS))
    for c in range(nc):
        cosine, sine = math.cos(table[c, PHASE]), math.sin(table[c, PHASE])
        amplitude, turn = table[c, N1], slope[c, PHASE]
        load[c, 0], dload[c, 0] = table[c, N0] + added, slope[c, N0]
        load[c, 1], load[c, 2] = amplitude * cosine, -amplitude * sine
        dload[c, 1] = slope[c, N1] * cosine - amplitude * sine * turn
        dload[c, 2] = -slope[c, N1] * sine - amplitude * cosine * turn
    return table, load, slope, dload


@compiled
def excitation(system: System, p: float) -> tuple[complex, complex]:
    """Return the complex factor on the unit excitation at λ = p and its derivative by λ."""
    if system.kind == LEVEL:
        return complex(p / system.level_reference), complex(1.0 / system.level_reference)
    if system.kind == FORCE_PHASE:
        turn = p - system.phase_reference
        value = complex(math.cos(turn), math.sin(turn))
        return value, 1j * value
    return complex(1.0), complex(0.0)


@compiled
def receptance(system: System, p: float, out: Receptance) -> None:
    """Fill `out` with the condensed linear part at λ = p and its derivative by λ."""
    if system.form == DENSE:
        _dense_receptance(system, p, out)
    else:
        _modal_receptance(system, p, out)
    factor, slope = excitation(system, p)
    for k in range(system.ks.size):
        # A static load (harmonic 0) has no phase to turn; its level scales all the same.
        f, df = factor, slope
        if system.ks[k] == 0 and system.kind == FORCE_PHASE:
            f, df = complex(1.0), complex(0.0)
        out.x_linear[1, k] = f * out.x_linear[1, k] + df * out.x_linear[0, k]
        out.x_linear[0, k] *= f
        for c in range(system.contacts.shape[0]):
            out.u_linear[1, k, c] = f * out.u_linear[1, k, c] + df * out.u_linear[0, k, c]
            out.u_linear[0, k, c] *= f


@compiled
def _modal_receptance(system: System, p: float, out: Receptance) -> None:
    """Sum the modes: Z⁻¹ = Σ x_m y_mᴴ / d_m with d_m = ω_m² − (kω)² + ikω c_m, or ikω − s_m for poles."""
    omega = p if system.kind == FREQUENCY else system.omega
    by_omega = 1.0 if system.kind == FREQUENCY else 0.0
    nc = system.contacts.shape[0]
    out.A[:], out.u_linear[:], out.B[:], out.x_linear[:] = 0.0, 0.0, 0.0, 0.0
    for i in range(system.ks.size):
        k, s = system.ks[i], system.which[i]
        speed = k * omega
        for m in range(system.eigenvalues.shape[1]):
            if system.form == MODES:
                damping = system.dampings[s, m]
                inverse = 1.0 / complex(system.eigenvalues[s, m].real - speed * speed, speed * damping)
                dinverse = -by_omega * inverse * inverse * complex(-2.0 * k * speed, k * damping)
            else:
                inverse = 1.0 / (complex(0.0, speed) - system.eigenvalues[s, m])
                dinverse = -by_omega * inverse * inverse * complex(0.0, float(k))
            force, seen = system.modal_forces[i, m], system.observe_modes[s, m]
            out.x_linear[0, i] += seen * inverse * force
            out.x_linear[1, i] += seen * dinverse * force
            for c in range(nc):
                phi = system.contact_modes[s, c, m]
                out.u_linear[0, i, c] += phi * inverse * force
                out.u_linear[1, i, c] += phi * dinverse * force
                back = seen * system.contact_duals[s, c, m]
                out.B[0, i, c] += back * inverse
                out.B[1, i, c] += back * dinverse
                for d in range(nc):
                    pair = phi * system.contact_duals[s, d, m]
                    out.A[0, i, c, d] += pair * inverse
                    out.A[1, i, c, d] += pair * dinverse


@compiled
def _dense_receptance(system: System, p: float, out: Receptance) -> None:
    """Solve with Z_k itself; λ may be the frequency or a structural parameter."""
    omega = p if system.kind == FREQUENCY else system.omega
    moved = p - system.parameter_reference if system.kind == STRUCTURE else 0.0
    for i in range(system.ks.size):
        k, s = system.ks[i], system.which[i]
        speed = k * omega
        Z = (
            system.K[s] + moved * system.dK[s]
            - speed * speed * (system.M[s] + moved * system.dM[s])
            + 1j * speed * (system.C[s] + moved * system.dC[s])
        )  # fmt: skip
        if system.kind == STRUCTURE:
            dZ = system.dK[s] - speed * speed * system.dM[s] + 1j * speed * system.dC[s]
        elif system.kind == FREQUENCY:
            dZ = -2.0 * k * speed * system.M[s] + 1j * k * system.C[s]
        else:
            dZ = np.zeros_like(Z)
        inverse = np.linalg.inv(Z)
        dinverse = -inverse @ (dZ @ inverse)
        L, force, seen = system.L[s], system.forces[i], system.observe
        Lh = np.ascontiguousarray(L.conj().T)
        for order in range(2):
            green = inverse if order == 0 else dinverse
            response = green @ force
            back = green @ Lh
            out.A[order, i] = L @ back
            out.u_linear[order, i] = L @ response
            out.B[order, i] = seen @ back
            out.x_linear[order, i] = (seen * response).sum()


@compiled
def evaluate(system: System, linear: Receptance, u: Real, p: float, added: float, out: Evaluation) -> float:
    """Evaluate the balance at (u, λ = p) for a receptance already filled at p.

    Returns
    -------
    The relative residual: max|r| over the largest of |u|, |ū| and |A F| (NaN if a contact failed).
    """
    nc, n = system.contacts.shape[0], coefficient_count(system.ks)
    table, load, slope, dload = contact_values(system, p, added)
    for c in range(nc):
        U = u[c * n : (c + 1) * n]
        state, _ = contact_force(
            U, system.ks, load[c], LOAD_HARMONICS, table[c, KT], table[c, MU], system.cos_table,
            system.sin_table, out.segments, out.dF_dU[c], out.dF_dkt[c], out.dF_dmu[c], out.dF_dN[c], out.F[c],
        )  # fmt: skip
        out.states[c] = state
        if state == FAILED:
            return np.nan
        for i in range(n):
            total = slope[c, KT] * out.dF_dkt[c, i] + slope[c, MU] * out.dF_dmu[c, i]
            for j in range(LOAD_COEFFICIENTS):
                total += out.dF_dN[c, i, j] * dload[c, j]
            out.dF_dp[c, i] = total
    return _assemble(system, linear, u, out)


@compiled
def _assemble(system: System, linear: Receptance, u: Real, out: Evaluation) -> float:
    """Put r, dr/du and dr/dλ together from the contact forces and the receptance."""
    nc, n = system.contacts.shape[0], coefficient_count(system.ks)
    r, J, dr = out.residual, out.jacobian, out.dr_dp
    J[:, :] = 0.0
    scale, largest_residual = 0.0, 0.0
    for i in range(system.ks.size):
        here = cosine_position(system.ks, i)
        has_sine = system.ks[i] > 0
        for c in range(nc):
            row = c * n + here
            response, dresponse = complex(0.0), complex(0.0)
            for d in range(nc):
                a, da = linear.A[0, i, c, d], linear.A[1, i, c, d]
                at = d * n + here
                stiffness = system.shift[d]
                fc = out.F[d, here] - stiffness * u[at]
                fs, dfs = 0.0, 0.0
                if has_sine:
                    fs = out.F[d, here + 1] - stiffness * u[at + 1]
                    dfs = out.dF_dp[d, here + 1]
                force, dforce = complex(fc, -fs), complex(out.dF_dp[d, here], -dfs)
                response += a * force
                dresponse += a * dforce + da * force
                _add_block(J, out.dF_dU[d], stiffness, row, d * n, here, a, has_sine)
            free, dfree = linear.u_linear[0, i, c], linear.u_linear[1, i, c]
            scale = max(scale, abs(free), abs(response), abs(u[row]))
            r[row] = u[row] - free.real + response.real
            dr[row] = -dfree.real + dresponse.real
            J[row, row] += 1.0
            largest_residual = max(largest_residual, abs(r[row]))
            if has_sine:
                r[row + 1] = u[row + 1] + free.imag - response.imag
                dr[row + 1] = dfree.imag - dresponse.imag
                J[row + 1, row + 1] += 1.0
                largest_residual = max(largest_residual, abs(r[row + 1]))
    if scale == 0.0:
        return largest_residual
    return largest_residual / scale


@compiled
def _add_block(
    J: Real, dF_dU: Real, stiffness: float, row: int, column: int, here: int, a: complex, has_sine: bool
) -> None:
    """Add A_k[c, d] ∂F_d/∂U_d to the rows of harmonic k of contact c."""
    n = dF_dU.shape[0]
    real, imag = a.real, a.imag
    if not has_sine:
        for j in range(n):
            J[row, column + j] += real * dF_dU[here, j]
        J[row, column + here] -= real * stiffness
        return
    for j in range(n):
        cosine, sine = dF_dU[here, j], dF_dU[here + 1, j]
        J[row, column + j] += real * cosine + imag * sine
        J[row + 1, column + j] += real * sine - imag * cosine
    J[row, column + here] -= real * stiffness
    J[row, column + here + 1] -= imag * stiffness
    J[row + 1, column + here + 1] -= real * stiffness
    J[row + 1, column + here] += imag * stiffness
