"""The condensed linear part at a frequency ω and a parameter p with the derivatives by ω, ω², p and ωp.

What `solver.linear.kernels.receptance` gives with one derivative, as the tracking of a peak needs it: there ω
moves whatever the parameter is.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numba.experimental import structref

from solver.contacts.kernels.system import DENSE, MODES, STRUCTURE, System
from solver.jit.decorators import compiled
from solver.jit.fourier import Complex, Real
from solver.jit.lapack import invert, multiply
from solver.jit.reference import Reference
from solver.jit.separate import apart
from solver.linear.kernels.modal_products import basis_of_modes, fill_product
from solver.linear.kernels.receptance import (
    PAIRS_UP_TO,
    add_driven,
    clear,
    excitation,
    fill_forces,
    project,
)

# First index of every array.
VALUE, BY_OMEGA, BY_OMEGA_TWICE, BY_P, BY_BOTH = 0, 1, 2, 3, 4
ORDERS = 5


class Jets(NamedTuple):
    """The condensed linear part and its derivatives; nk harmonics, nc relative motions."""

    A: Complex  # (ORDERS, nk, nc, nc)
    u_linear: Complex  # (ORDERS, nk, nc)
    B: Complex  # (ORDERS, nk, nc)
    x_linear: Complex  # (ORDERS, nk)


@structref.register
class _JetsType(Reference):
    """Numba's type of `Jets` by reference."""


class _JetsReference(structref.StructRefProxy):
    """`Jets` by reference."""


structref.define_proxy(_JetsReference, _JetsType, list(Jets._fields))

_new: Callable[..., Jets] = _JetsReference


@compiled
def new_jets(system: System) -> Jets:
    """Return empty jets for `system`."""
    nk, nc = system.ks.size, system.shift.size
    return _new(
        np.zeros((ORDERS, nk, nc, nc), np.complex128), np.zeros((ORDERS, nk, nc), np.complex128),
        np.zeros((ORDERS, nk, nc), np.complex128), np.zeros((ORDERS, nk), np.complex128),
    )  # fmt: skip


@apart
def fill_jets(system: System, omega: float, p: float, out: Jets) -> None:
    """Fill `out` at the frequency `omega` [rad/s] and the parameter λ = p (which is not the frequency)."""
    clear(out)
    out.A[:] = 0.0
    if system.form == DENSE:
        _dense(system, omega, p, out)
    else:
        _modal(system, omega, out)
    nc = out.u_linear.shape[2]
    for i in range(system.ks.size):
        f, df = excitation(system, p, system.ks[i])
        x = out.x_linear[:, i]
        x[BY_BOTH] = f * x[BY_BOTH] + df * x[BY_OMEGA]
        x[BY_P] = f * x[BY_P] + df * x[VALUE]
        for order in range(BY_P):
            x[order] *= f
        for c in range(nc):
            u = out.u_linear[:, i, c]
            u[BY_BOTH] = f * u[BY_BOTH] + df * u[BY_OMEGA]
            u[BY_P] = f * u[BY_P] + df * u[VALUE]
            for order in range(BY_P):
                u[order] *= f


@compiled
def _modal(system: System, omega: float, out: Jets) -> None:
    """Sum the modes: Z⁻¹ = Σ x_m y_mᴴ/d_m; (1/d)' = −d'/d², (1/d)'' = 2d'²/d³ − d''/d²."""
    nc, nm = out.u_linear.shape[2], system.eigenvalues.shape[1]
    terms, ports = np.empty((2 * BY_P, nm)), np.arange(nc if nc > PAIRS_UP_TO else 0)
    for s in range(system.eigenvalues.shape[0]):
        basis, duals, kinds = basis_of_modes(system, s, ports)
        for i in range(system.ks.size):
            if system.which[i] != s:
                continue
            _fill_terms(system, s, system.ks[i], omega, terms)
            for order in range(BY_P):
                for m in range(nm):
                    part = complex(terms[2 * order, m], terms[2 * order + 1, m])
                    driven = part * system.modal_forces[i, m]
                    seen = part * system.observe_modes[s, m]
                    out.x_linear[order, i] += system.observe_modes[s, m] * driven
                    for c in range(nc):
                        out.u_linear[order, i, c] += system.contact_modes[s, c, m] * driven
                        out.B[order, i, c] += seen * system.contact_duals[s, c, m]
                        if nc <= PAIRS_UP_TO:
                            phi = system.contact_modes[s, c, m] * part
                            for other in range(nc):
                                out.A[order, i, c, other] += phi * system.contact_duals[s, other, m]
            if nc > PAIRS_UP_TO:
                fill_product(basis, duals, kinds, terms, BY_P, i, out.A)


@compiled
def _fill_terms(system: System, s: int, k: int, omega: float, terms: Real) -> None:
    """Fill in 1/d_m and its first two derivatives by ω, real and imaginary parts; NaN where d_m is zero."""
    speed = k * omega
    for m in range(system.eigenvalues.shape[1]):
        if system.form == MODES:
            damping = system.dampings[s, m]
            d = complex(system.eigenvalues[s, m].real - speed * speed, speed * damping)
            slope, bend = complex(-2.0 * k * speed, k * damping), complex(-2.0 * k * k)
        else:
            d = complex(0.0, speed) - system.eigenvalues[s, m]
            slope, bend = complex(0.0, float(k)), complex(0.0)
        if d.real == 0.0 and d.imag == 0.0:
            d = complex(np.nan, np.nan)
        inverse = 1.0 / d
        first = -slope * inverse * inverse
        second = (2.0 * slope * slope * inverse - bend) * inverse * inverse
        terms[0, m], terms[1, m] = inverse.real, inverse.imag
        terms[2, m], terms[3, m] = first.real, first.imag
        terms[4, m], terms[5, m] = second.real, second.imag


@compiled
def _dense(system: System, omega: float, p: float, out: Jets) -> None:
    """Invert Z itself, with G = Z⁻¹: G_x = −G Z_x G, G_xy = G Z_x G Z_y G + G Z_y G Z_x G − G Z_xy G."""
    moved = p - system.parameter_reference if system.kind == STRUCTURE else 0.0
    structural = system.kind == STRUCTURE
    n = system.observe.size
    Z = np.zeros((ORDERS, n, n), np.complex128)
    G = np.zeros((ORDERS, n, n), np.complex128)
    half, one, two = (
        np.empty((n, n), np.complex128),
        np.empty((n, n), np.complex128),
        np.empty((n, n), np.complex128),
    )
    force, rise = np.empty(n, np.complex128), np.empty(n, np.complex128)
    for i in range(system.ks.size):
        k, s = max(system.ks[i], 1), system.which[i]
        speed = k * omega
        ik = complex(0.0, float(k))
        for a in range(n):
            for b in range(n):
                dK, dC, dM = system.dK[s, a, b], system.dC[s, a, b], system.dM[s, a, b]
                K, C, M = system.K[s, a, b], system.C[s, a, b] + moved * dC, system.M[s, a, b] + moved * dM
                if system.ddK.shape[0] > 0:
                    K += 0.5 * moved * moved * system.ddK[s, a, b]
                Z[VALUE, a, b] = K + moved * dK + ik * omega * C - speed * speed * M
                if system.ddK.shape[0] > 0:
                    dK += moved * system.ddK[s, a, b]
                Z[BY_OMEGA, a, b] = ik * C - 2.0 * k * speed * M
                Z[BY_OMEGA_TWICE, a, b] = -2.0 * k * k * M
                if structural:
                    Z[BY_P, a, b] = dK + ik * omega * dC - speed * speed * dM
                    Z[BY_BOTH, a, b] = ik * dC - 2.0 * k * speed * dM
        green = G[VALUE]
        if not invert(Z[VALUE], green):
            green[0, 0] = np.nan
        _sandwich(green, Z[BY_OMEGA], green, half, one)
        _set(G[BY_OMEGA], -1.0, one)
        _sandwich(green, Z[BY_OMEGA_TWICE], green, half, one)
        _sandwich(G[BY_OMEGA], Z[BY_OMEGA], green, half, two)
        _set(G[BY_OMEGA_TWICE], -1.0, one)
        _more(G[BY_OMEGA_TWICE], -2.0, two)
        if structural:
            _sandwich(green, Z[BY_P], green, half, one)
            _set(G[BY_P], -1.0, one)
            _sandwich(green, Z[BY_BOTH], green, half, one)
            _set(G[BY_BOTH], -1.0, one)
            _sandwich(G[BY_OMEGA], Z[BY_P], green, half, two)
            _more(G[BY_BOTH], -1.0, two)
            _sandwich(green, Z[BY_P], G[BY_OMEGA], half, two)
            _more(G[BY_BOTH], -1.0, two)
        fill_forces(system, i, moved, force, rise)
        for order in range(ORDERS):
            if structural or order < BY_P:
                project(system, s, force, G[order], i, order, out)
        if structural:
            for order, by in ((BY_P, VALUE), (BY_BOTH, BY_OMEGA)):
                add_driven(system, s, rise, G[by], out.u_linear[order, i], out.x_linear[order, i : i + 1])


@apart
def _sandwich(left: Complex, middle: Complex, right: Complex, half: Complex, out: Complex) -> None:
    """Fill `out` with left @ middle @ right."""
    multiply(left, middle, half)
    multiply(half, right, out)


@compiled
def _set(target: Complex, factor: float, source: Complex) -> None:
    """Set target = factor · source."""
    for a in range(target.shape[0]):
        for b in range(target.shape[1]):
            target[a, b] = factor * source[a, b]


@compiled
def _more(target: Complex, factor: float, source: Complex) -> None:
    """Add factor · source."""
    for a in range(target.shape[0]):
        for b in range(target.shape[1]):
            target[a, b] += factor * source[a, b]
