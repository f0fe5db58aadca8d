"""Z_k(ω) = K + ikωC − (kω)²M of a harmonic: its inverse with derivatives by ω and a structural parameter.

As matrices Z⁻¹ = G itself, with G_x = −G Z_x G and G_xy = G Z_x G Z_y G + G Z_y G Z_x G − G Z_xy G. In
modes and poles it is the reciprocal 1/d of a number for each, which is the same formula: K = ω_m², C = c_m,
M = 1 of modes, K = −s_m, C = 1, M = 0 of poles.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from solver.contacts.kernels.system import MODES, STRUCTURE, System
from solver.jit.decorators import compiled
from solver.jit.fourier import Complex, Integer, Real
from solver.jit.lapack import invert, multiply
from solver.jit.separate import apart

# First index of Z and G, of what follows from them, and of `Jets`.
VALUE, BY_OMEGA, BY_OMEGA_TWICE, BY_P, BY_BOTH = 0, 1, 2, 3, 4
ORDERS = 5


@compiled
def dynamic_stiffness(
    K: complex, C: complex, M: complex, k: float, omega: float
) -> tuple[complex, complex, complex]:
    """Return an entry of Z_k, ∂Z_k/∂ω and ∂²Z_k/∂ω²."""
    speed, ik = k * omega, complex(0.0, k)
    return K + omega * (ik * C) - speed * speed * M, ik * C - 2.0 * k * speed * M, -2.0 * k * k * M


@compiled
def fill_dynamic_stiffness(system: System, i: int, omega: float, moved: float, Z: Complex) -> None:
    """Fill Z (ORDERS, n, n) of harmonic number i where the structural parameter has moved by so much.

    The mean is computed with k = 1 and matrices C and M of its own: 0, unless its stiffness follows ω².
    """
    k, s, n = float(max(system.ks[i], 1)), system.which[i], system.observe.size
    bends, structural = system.ddK.shape[0] > 0, system.kind == STRUCTURE
    for a in range(n):
        for b in range(n):
            dK, dC, dM = system.dK[s, a, b], system.dC[s, a, b], system.dM[s, a, b]
            K, C, M = system.K[s, a, b] + moved * dK, system.C[s, a, b], system.M[s, a, b]
            if bends:
                K += 0.5 * moved * moved * system.ddK[s, a, b]
                dK += moved * system.ddK[s, a, b]
            value, first, second = dynamic_stiffness(K, C + moved * dC, M + moved * dM, k, omega)
            Z[VALUE, a, b], Z[BY_OMEGA, a, b], Z[BY_OMEGA_TWICE, a, b] = value, first, second
            if structural:
                Z[BY_P, a, b], Z[BY_BOTH, a, b], _ = dynamic_stiffness(dK, dC, dM, k, omega)


@apart
def fill_inverse(Z: Complex, orders: Integer, G: Complex) -> None:
    """Fill G (ORDERS, n, n) with Z⁻¹ and the derivatives that ascending `orders` name; NaN where singular.

    A mixed or second derivative needs the first one by ω.
    """
    half, term = np.empty_like(G[VALUE]), np.empty_like(G[VALUE])
    if not invert(Z[VALUE], G[VALUE]):
        G[VALUE, 0, 0] = np.nan
    for order in orders:
        if order != VALUE:
            G[order] = 0.0
            _take(G[VALUE], Z[order], G[VALUE], 1.0, half, term, G[order])
        if order == BY_OMEGA_TWICE:
            _take(G[BY_OMEGA], Z[BY_OMEGA], G[VALUE], 2.0, half, term, G[order])
        if order == BY_BOTH:
            _take(G[BY_OMEGA], Z[BY_P], G[VALUE], 1.0, half, term, G[order])
            _take(G[VALUE], Z[BY_P], G[BY_OMEGA], 1.0, half, term, G[order])


@compiled
def _take(
    left: Complex, middle: Complex, right: Complex, factor: float, half: Complex, term: Complex, out: Complex
) -> None:
    """Take factor · left @ middle @ right from `out`."""
    multiply(left, middle, half)
    multiply(half, right, term)
    for a in range(out.shape[0]):
        for b in range(out.shape[1]):
            out[a, b] -= factor * term[a, b]


@compiled
def fill_terms(
    system: System, s: int, first: int, size: int, k: float, omega: float, by_omega: float, terms: Real
) -> None:
    """Fill in 1/d_m and its derivative; NaN where d_m is zero.

    Parameters
    ----------
    first, size : the block of modes.
    by_omega : 1.0 where λ is the frequency, else 0.0: derivatives are by λ.
    terms : (4, ·) or more rows: real and imaginary part of the value, then of the derivative.
    """
    speed, values = k * omega, system.eigenvalues[s]
    for m in range(size):
        terms[0, m] = values[first + m].real
        terms[1, m] = values[first + m].imag
    a, b, da, db = terms[0], terms[1], terms[2], terms[3]
    if system.form == MODES:
        dampings = system.dampings[s]
        for m in range(size):
            a[m] -= speed * speed
            b[m] = speed * dampings[first + m]
            da[m] = -2.0 * k * speed * by_omega
            db[m] = k * dampings[first + m] * by_omega
    else:
        for m in range(size):
            a[m] = -a[m]
            b[m] = speed - b[m]
            da[m] = 0.0
            db[m] = k * by_omega
    for m in range(size):
        inverse = 1.0 / (a[m] * a[m] + b[m] * b[m])
        re, im = a[m] * inverse, -b[m] * inverse
        re2, im2 = re * re - im * im, 2.0 * re * im
        a[m], b[m] = re, im
        da[m], db[m] = im2 * db[m] - re2 * da[m], -re2 * db[m] - im2 * da[m]


@compiled
def fill_second_terms(system: System, size: int, k: float, terms: Real) -> None:
    """Fill in the second derivatives by ω behind what `fill_terms` filled in: 2 g'²/g − d'' g², g = 1/d_m."""
    bend = -2.0 * k * k if system.form == MODES else 0.0
    for m in range(size):
        g, slope = complex(terms[0, m], terms[1, m]), complex(terms[2, m], terms[3, m])
        second = 2.0 * slope * slope / g - bend * g * g
        terms[4, m], terms[5, m] = second.real, second.imag


@compiled
def fill_forces(system: System, i: int, moved: float, force: Complex, rise: Complex) -> None:
    """Fill in the forces of harmonic number i where the structural parameter has moved, and their slope."""
    for a in range(force.size):
        force[a], rise[a] = system.forces[i, a], 0.0
        if system.kind == STRUCTURE:
            first, second = system.dforces[0, i, a], system.dforces[1, i, a]
            force[a] += moved * (first + 0.5 * moved * second)
            rise[a] = first + moved * second


@apart
def fill_from_matrices(system: System, omega: float, p: float, orders: Integer, out: Any) -> None:
    """Fill the condensed linear part at (ω, λ = p) by inverting Z_k itself.

    Parameters
    ----------
    orders : ascending, which derivative each first index of `out` (a `Receptance` or `Jets`) stands for.
    """
    moved, n = p - system.parameter_reference if system.kind == STRUCTURE else 0.0, system.observe.size
    Z, G = np.zeros((ORDERS, n, n), np.complex128), np.zeros((ORDERS, n, n), np.complex128)
    force, rise = np.empty(n, np.complex128), np.empty(n, np.complex128)
    for i in range(system.ks.size):
        s = system.which[i]
        fill_dynamic_stiffness(system, i, omega, moved, Z)
        fill_inverse(Z, orders, G)
        fill_forces(system, i, moved, force, rise)
        for at in range(orders.size):
            project(system, s, force, G[orders[at]], i, at, out)
            if orders[at] >= BY_P:
                by = VALUE if orders[at] == BY_P else BY_OMEGA
                add_driven(system, s, rise, G[by], out.u_linear[at, i], out.x_linear[at, i : i + 1])


@compiled
def add_driven(system: System, s: int, force: Complex, green: Complex, u: Complex, x: Complex) -> None:
    """Add the motions of contacts (nc,) and observed DOF (1,) under forces, through Z⁻¹ or a derivative."""
    for a in range(force.size):
        motion = complex(0.0)
        for b in range(force.size):
            motion += green[a, b] * force[b]
        x[0] += system.observe[a] * motion
        for c in range(u.size):
            u[c] += system.L[s, c, a] * motion


@compiled
def project(system: System, s: int, force: Complex, green: Complex, i: int, order: int, out: Any) -> None:
    """Fill in Z⁻¹ (or a derivative) of harmonic number i, seen from contacts, excitation and observed DOF.

    A is that of the leading ports, or, where `out` has room for them, of all.
    """
    nc, n, r = out.B.shape[2], green.shape[0], out.A.shape[2]
    back, moved = np.empty((n, nc), np.complex128), np.empty((n, nc), np.complex128)
    for a in range(n):
        for c in range(nc):
            back[a, c] = system.L[s, c, a].conjugate()
    multiply(green, back, moved)
    out.x_linear[order, i] = 0.0
    for c in range(nc):
        out.u_linear[order, i, c], out.B[order, i, c] = 0.0, 0.0
        for a in range(n):
            out.B[order, i, c] += system.observe[a] * moved[a, c]
    add_driven(system, s, force, green, out.u_linear[order, i], out.x_linear[order, i : i + 1])
    if r == nc:
        multiply(system.L[s], moved, out.A[order, i])
        return
    rows, columns = np.empty((r, n), np.complex128), np.empty((n, r), np.complex128)
    for c in range(r):
        for a in range(n):
            rows[c, a], columns[a, c] = system.L[s, system.leading[c], a], moved[a, system.leading[c]]
    multiply(rows, columns, out.A[order, i])
