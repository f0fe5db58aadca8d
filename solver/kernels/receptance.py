"""The condensed linear part A_k, ū_k at one λ, and the way to the observed DOF, with derivatives by λ."""

from __future__ import annotations

import math

import numpy as np

from solver.fourier import Complex
from solver.kernels.compiled import compiled, out_of_line
from solver.kernels.linear import invert
from solver.kernels.system import DENSE, FORCE_PHASE, FREQUENCY, LEVEL, MODES, STRUCTURE, Receptance, System


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
    out_of_line()
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
def _inverse(z: complex) -> complex:
    """Return 1/z; NaN, not an exception, where an undamped mode is met exactly."""
    if z.real == 0.0 and z.imag == 0.0:
        return complex(np.nan, np.nan)
    return 1.0 / z


@compiled
def _modal_receptance(system: System, p: float, out: Receptance) -> None:
    """Sum the modes: Z⁻¹ = Σ x_m y_mᴴ / d_m with d_m = ω_m² − (kω)² + ikω c_m, or ikω − s_m for poles."""
    out_of_line()
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
                inverse = _inverse(complex(system.eigenvalues[s, m].real - speed * speed, speed * damping))
                dinverse = -by_omega * inverse * inverse * complex(-2.0 * k * speed, k * damping)
            else:
                inverse = _inverse(complex(0.0, speed) - system.eigenvalues[s, m])
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
    out_of_line()
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
