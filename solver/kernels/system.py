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
from numba.core import types
from numba.experimental import structref

from solver.fourier import Complex, Integer, Real, coefficient_count, cosine_position
from solver.kernels.compiled import compiled
from solver.kernels.events import FAILED
from solver.kernels.force import contact_force
from solver.kernels.linear import copy_block, fill_block, invert

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


# Inside the compiled loops each record is one pointer: forty arrays passed by value at every call cost more
# than the work itself, and minutes of compilation.


@structref.register
class _SystemType(types.StructRef):
    """Numba's type of a `System` by reference."""


@structref.register
class _ReceptanceType(types.StructRef):
    """Numba's type of a `Receptance` by reference."""


@structref.register
class _EvaluationType(types.StructRef):
    """Numba's type of an `Evaluation` by reference."""


class _SystemReference(structref.StructRefProxy):
    """A `System` by reference."""


class _ReceptanceReference(structref.StructRefProxy):
    """A `Receptance` by reference."""


class _EvaluationReference(structref.StructRefProxy):
    """An `Evaluation` by reference."""


structref.define_proxy(_SystemReference, _SystemType, list(System._fields))
structref.define_proxy(_ReceptanceReference, _ReceptanceType, list(Receptance._fields))
structref.define_proxy(_EvaluationReference, _EvaluationType, list(Evaluation._fields))


@compiled
def by_reference(system: System) -> System:
    """Return the same system as the compiled loops take it: one pointer."""
    return _SystemReference(*system)


@compiled
def evaluation_by_value(point: Evaluation) -> Evaluation:
    """Return the arrays of an evaluation as a tuple that Python can read (views, not copies)."""
    return Evaluation(
        point.residual, point.jacobian, point.dr_dp, point.F, point.dF_dU, point.dF_dkt, point.dF_dmu,
        point.dF_dN, point.dF_dp, point.states, point.segments,
    )  # fmt: skip


@compiled
def receptance_by_value(linear: Receptance) -> Receptance:
    """Return the arrays of a receptance as a tuple that Python can read (views, not copies)."""
    return Receptance(linear.A, linear.u_linear, linear.B, linear.x_linear)


@compiled
def new_receptance(system: System) -> Receptance:
    """Return an empty receptance for `system`."""
    nk, nc = system.ks.size, system.contacts.shape[0]
    return _ReceptanceReference(
        np.zeros((2, nk, nc, nc), np.complex128),
        np.zeros((2, nk, nc), np.complex128),
        np.zeros((2, nk, nc), np.complex128),
        np.zeros((2, nk), np.complex128),
    )


@compiled
def new_evaluation(system: System) -> Evaluation:
    """Return empty arrays for `evaluate`."""
    nc, n = system.contacts.shape[0], coefficient_count(system.ks)
    return _EvaluationReference(
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
    nc = system.contacts.shape[0]
    table, slope = np.empty((nc, 6)), np.zeros((nc, 6))
    copy_block(table, system.contacts)
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
def _clear(out: Receptance) -> None:
    """Set a receptance to zero."""
    nk, nc = out.x_linear.shape[1], out.B.shape[2]
    for order in range(2):
        for i in range(nk):
            out.x_linear[order, i] = 0.0
            for c in range(nc):
                out.u_linear[order, i, c] = 0.0
                out.B[order, i, c] = 0.0
                for d in range(nc):
                    out.A[order, i, c, d] = 0.0


@compiled
def _modal_receptance(system: System, p: float, out: Receptance) -> None:
    """Sum the modes: Z⁻¹ = Σ x_m y_mᴴ / d_m with d_m = ω_m² − (kω)² + ikω c_m, or ikω − s_m for poles."""
    omega = p if system.kind == FREQUENCY else system.omega
    by_omega = 1.0 if system.kind == FREQUENCY else 0.0
    nc = system.contacts.shape[0]
    _clear(out)
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
    """Invert Z_k itself; λ may be the frequency or a structural parameter: dZ⁻¹ = −Z⁻¹ dZ Z⁻¹."""
    omega = p if system.kind == FREQUENCY else system.omega
    moved = p - system.parameter_reference if system.kind == STRUCTURE else 0.0
    n = system.observe.size
    Z, dZ = np.empty((n, n), np.complex128), np.empty((n, n), np.complex128)
    green = np.empty((2, n, n), np.complex128)
    half = np.empty((n, n), np.complex128)
    for i in range(system.ks.size):
        k, s = system.ks[i], system.which[i]
        speed = k * omega
        damped, inertia = complex(0.0, speed), speed * speed
        for a in range(n):
            for b in range(n):
                dK, dC, dM = system.dK[s, a, b], system.dC[s, a, b], system.dM[s, a, b]
                C, M = system.C[s, a, b] + moved * dC, system.M[s, a, b] + moved * dM
                Z[a, b] = system.K[s, a, b] + moved * dK + damped * C - inertia * M
                dZ[a, b] = 0.0
                if system.kind == STRUCTURE:
                    dZ[a, b] = dK + damped * dC - inertia * dM
                elif system.kind == FREQUENCY:
                    dZ[a, b] = complex(0.0, float(k)) * C - 2.0 * k * speed * M
        if not invert(Z, green[0]):
            green[0, 0, 0] = np.nan
        _product(dZ, green[0], half)
        _product(green[0], half, green[1])
        for order in range(2):
            _project(system, s, i, 1.0 - 2.0 * order, green[order], order, out)


@compiled
def _product(left: Complex, right: Complex, out: Complex) -> None:
    """Fill `out` with left @ right."""
    n = left.shape[0]
    for a in range(n):
        for b in range(n):
            out[a, b] = 0.0
        for c in range(n):
            factor = left[a, c]
            if factor != 0.0:
                for b in range(n):
                    out[a, b] += factor * right[c, b]


@compiled
def _project(
    system: System, s: int, i: int, sign: float, green: Complex, order: int, out: Receptance
) -> None:
    """Project Z⁻¹ (or its derivative) of harmonic number i on contacts, excitation and observed DOF."""
    nc, n = system.contacts.shape[0], green.shape[0]
    out.x_linear[order, i] = 0.0
    for c in range(nc):
        out.u_linear[order, i, c] = 0.0
        out.B[order, i, c] = 0.0
        for d in range(nc):
            out.A[order, i, c, d] = 0.0
    for a in range(n):
        for b in range(n):
            value = sign * green[a, b]
            driven = value * system.forces[i, b]
            out.x_linear[order, i] += system.observe[a] * driven
            for c in range(nc):
                out.u_linear[order, i, c] += system.L[s, c, a] * driven
                back = value * system.L[s, c, b].conjugate()
                out.B[order, i, c] += system.observe[a] * back
                for d in range(nc):
                    out.A[order, i, d, c] += system.L[s, d, a] * back


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
    fill_block(J, 0.0)
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
