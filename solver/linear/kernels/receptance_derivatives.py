"""The condensed linear part at a frequency ω and a parameter p with the derivatives by ω, ω², p and ωp.

What `solver.linear.kernels.receptance` gives with one derivative, as the tracking of a peak needs it: there ω
moves whatever the parameter is.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from solver.contacts.kernels.system import DENSE, STRUCTURE, System
from solver.jit.decorators import compiled
from solver.jit.fourier import Complex
from solver.jit.reference import referenced
from solver.jit.separate import apart
from solver.linear.kernels.dynamic_stiffness import (
    BY_BOTH,
    BY_OMEGA,
    BY_P,
    ORDERS,
    VALUE,
    fill_from_matrices,
    fill_second_terms,
    fill_terms,
)
from solver.linear.kernels.modal_products import basis_of_modes, fill_product
from solver.linear.kernels.receptance import PAIRS_UP_TO, clear, excitation, measure_only


class Jets(NamedTuple):
    """The condensed linear part and its derivatives; nk harmonics, nc relative motions."""

    A: Complex  # (ORDERS, nk, nc, nc)
    u_linear: Complex  # (ORDERS, nk, nc)
    B: Complex  # (ORDERS, nk, nc)
    x_linear: Complex  # (ORDERS, nk)


_new: Callable[..., Jets] = referenced("Jets", __name__, Jets._fields)


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
        orders = np.arange(ORDERS if system.kind == STRUCTURE else BY_P)
        fill_from_matrices(system, omega, p, orders, out)
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
    measure_only(system, out)


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
            fill_terms(system, s, 0, nm, float(system.ks[i]), omega, 1.0, terms)
            fill_second_terms(system, nm, float(system.ks[i]), terms)
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
