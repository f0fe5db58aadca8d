"""The condensed linear part A_k, ū_k at one λ, and the way to the observed DOF, with derivatives by λ.

A that is asked for again where it was filled is not summed again. What forces at the contacts move is found
through the modes, A_k F = X diag(1/d) Yᴴ F, where derivatives are not asked for: it takes ports × modes
products where the entries of A_k take ports² × modes.

The receptance of many ports is a product of matrices, A_k = X D_k(ω) Yᴴ. All is put into real products, which
take half as long as complex ones, and a quarter where modes are real: of a real mode x, or of the poles s and
s̄ of a real structure with x and x̄, the columns are

  x t yᴴ = [Re x] [t yᴴ],   x t yᴴ + x̄ t' y'ᴴ = [Re x, Im x] [t yᴴ + t' y'ᴴ; i (t yᴴ − t' y'ᴴ)],

and of any other [Re x, Im x] [t yᴴ; i t yᴴ], with t = 1/d or a derivative of it. The left factor does not
depend on the frequency.

The tracking of a peak, where ω moves whatever the parameter is, needs the derivatives by ω, ω², p and ωp.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from solver.contacts.kernels.system import (
    DENSE,
    FORCE_PHASE,
    FREQUENCY,
    LEVEL,
    MODES,
    STRUCTURE,
    Receptance,
    System,
)
from solver.jit.decorators import compiled
from solver.jit.fourier import Complex, Integer, Real
from solver.jit.kernel_records import referenced
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

# What a mode is: the second of a pair, of real motion, the first of a pair of conjugates, any other.
SECOND, REAL, FIRST, ANY = 0, 1, 2, 3
ROUNDING = 1e-13  # relative, of modes that are conjugates


@compiled
def _kind_of(system: System, s: int, m: int) -> int:
    """Return what mode m is, if it is not the second of a pair."""
    modes, duals, values = system.contact_modes[s], system.contact_duals[s], system.eigenvalues[s]
    turned, size, off, dual_size, dual_off = 0.0, 0.0, 0.0, 0.0, 0.0
    pair = m + 1 < values.size and values[m + 1] == values[m].conjugate()
    for c in range(modes.shape[0]):
        turned += abs(modes[c, m].imag)
        if pair:
            size += abs(modes[c, m])
            off += abs(modes[c, m + 1] - modes[c, m].conjugate())
            dual_size += abs(duals[c, m])
            dual_off += abs(duals[c, m + 1] - duals[c, m].conjugate())
    if turned == 0.0:
        return REAL
    return FIRST if pair and off <= ROUNDING * size and dual_off <= ROUNDING * dual_size else ANY


@compiled
def basis_of_modes(system: System, s: int, ports: Integer) -> tuple[Real, Complex, Integer]:
    """Return the modes of structure s at some ports as real columns, what multiplies them, and their kinds.

    Returns
    -------
    basis (K, r), one row for each column of X; duals (nm, r) yᴴ; kinds (nm,).
    """
    nm, r = system.eigenvalues.shape[1], ports.size
    kinds, count, m = np.zeros(nm, np.int64), 0, 0
    while m < nm:
        kinds[m] = _kind_of(system, s, m)
        count += 1 if kinds[m] == REAL else 2
        m += 2 if kinds[m] == FIRST else 1
    basis, duals, row = np.empty((count, r)), np.empty((nm, r), np.complex128), 0
    for m in range(nm):
        for c in range(r):
            duals[m, c] = system.contact_duals[s, ports[c], m]
        if kinds[m] == SECOND:
            continue
        for c in range(r):
            x = system.contact_modes[s, ports[c], m]
            basis[row, c] = x.real
            if kinds[m] != REAL:
                basis[row + 1, c] = x.imag
        row += 1 if kinds[m] == REAL else 2
    return basis, duals, kinds


@apart
def fill_product(
    basis: Real, duals: Complex, kinds: Integer, terms: Real, orders: int, i: int, A: Complex
) -> None:
    """Fill A[order, i] (r, r) of harmonic number i for the first derivatives.

    Parameters
    ----------
    terms : (≥ 2·orders, nm) real and imaginary part of 1/d_m, then of its derivatives.
    """
    nm, r = duals.shape
    rows, row = np.empty((basis.shape[0], 2 * orders * r)), 0
    for m in range(nm):
        if kinds[m] == SECOND:
            continue
        for order in range(orders):
            real, imag = 2 * order * r, (2 * order + 1) * r
            last = m + 1 if kinds[m] == FIRST else m
            t = complex(terms[2 * order, m], terms[2 * order + 1, m])
            t_last = complex(terms[2 * order, last], terms[2 * order + 1, last])
            for c in range(r):
                z = t * duals[m, c]
                total, turned = z, 1j * z
                if kinds[m] == FIRST:
                    other = t_last * duals[last, c]
                    total, turned = z + other, 1j * (z - other)
                rows[row, real + c], rows[row, imag + c] = total.real, total.imag
                if kinds[m] != REAL:
                    rows[row + 1, real + c], rows[row + 1, imag + c] = turned.real, turned.imag
        row += 1 if kinds[m] == REAL else 2
    product = np.dot(basis.T, rows)
    for order in range(orders):
        for a in range(r):
            for b in range(r):
                at = 2 * order * r + b
                A[order, i, a, b] = complex(product[a, at], product[a, at + r])


@compiled
def _place(system: System, p: float, i: int) -> float:
    """Return number i of those that tell what A belongs to: λ, what λ is, the frequency, and the modes."""
    if i == 0:
        return p
    if i == 1:
        return float(system.kind)
    if i == 2:
        return system.omega
    address = system.contact_modes.ctypes.data
    return float(address % 2**32) if i == 3 else float(address // 2**32)


@compiled
def is_filled(system: System, p: float, out: Any) -> bool:
    """Return whether A is that of this structure at λ = p."""
    same = True
    for i in range(out.filled.size):
        same = same and out.filled[i] == _place(system, p, i)
    return bool(same)


@compiled
def note(system: System, p: float, out: Any) -> None:
    """Keep in mind where A was filled."""
    for i in range(out.filled.size):
        out.filled[i] = _place(system, p, i)


@compiled
def forget(out: Any) -> None:
    """Have A filled anew next time: it is changed."""
    for i in range(out.filled.size):
        out.filled[i] = np.nan


BLOCK = 512  # modes summed at a time: their weights stay in the near cache
PAIRS_UP_TO = 12  # leading ports, with more products of matrices are faster (measured)


@compiled
def excitation(system: System, p: float, k: int) -> tuple[complex, complex]:
    """Return the complex factor on the unit excitation of harmonic k at λ = p and its derivative by λ.

    A static force has no phase to turn; the level scales it all the same, unless it is a load. Where λ is the
    frequency the level may follow it.
    """
    if system.kind == FREQUENCY:
        row = system.level[1 if k == 0 and system.constant_mean == 1 else 0]
        return complex(row[0] + p * (row[1] + p * row[2])), complex(row[1] + 2.0 * p * row[2])
    if k == 0 and (system.kind == FORCE_PHASE or system.constant_mean == 1):
        return complex(1.0), complex(0.0)
    if system.kind == LEVEL:
        return complex(p / system.level_reference), complex(1.0 / system.level_reference)
    if system.kind == FORCE_PHASE:
        turn = p - system.phase_reference
        value = complex(math.cos(turn), math.sin(turn))
        return value, 1j * value
    return complex(1.0), complex(0.0)


@apart
def receptance(system: System, p: float, out: Receptance) -> None:
    """Fill `out` with the condensed linear part at λ = p and its derivative by λ.

    A that was filled for the same structure at the same λ is left as it is.
    """
    if system.form == DENSE:
        _from_matrices(system, p, out)
    elif is_filled(system, p, out):
        _modal_receptance(system, p, 0, out)
    else:
        _modal_receptance(system, p, system.leading.size, out)
        note(system, p, out)
    scale_driven(system, p, out)


@apart
def observer_receptance(system: System, p: float, out: Receptance) -> None:
    """Fill in what the observed DOF needs: B and x̄ with their derivatives; A stays what it was.

    Of many observed DOFs on one motion each needs its own, but A, by far the most work, need not be known.
    """
    if system.form == DENSE:
        _from_matrices(system, p, out)
    else:
        _modal_receptance(system, p, 0, out)
    scale_driven(system, p, out)


@compiled
def scale_driven(system: System, p: float, out: Receptance) -> None:
    """Multiply motions under the unit excitation by its level and phase; what is not measured is 0."""
    for k in range(system.ks.size):
        f, df = excitation(system, p, system.ks[k])
        out.x_linear[1, k] = f * out.x_linear[1, k] + df * out.x_linear[0, k]
        out.x_linear[0, k] *= f
        for c in range(out.B.shape[2]):
            out.u_linear[1, k, c] = f * out.u_linear[1, k, c] + df * out.u_linear[0, k, c]
            out.u_linear[0, k, c] *= f
    measure_only(system, out)


@compiled
def measure_only(system: System, out: Any) -> None:
    """Leave no way to the observed DOF but for the forces of the harmonic that is measured."""
    if system.only < 0:
        return
    for k in range(system.ks.size):
        if system.ks[k] != system.only:
            for order in range(out.x_linear.shape[0]):
                out.x_linear[order, k] = 0.0
                for c in range(out.B.shape[2]):
                    out.B[order, k, c] = 0.0


@compiled
def clear(out: Any) -> None:
    """Set all derivatives of a receptance, or of `Jets`, to zero, but for A."""
    for order in range(out.x_linear.shape[0]):
        for i in range(out.x_linear.shape[1]):
            out.x_linear[order, i] = 0.0
            for c in range(out.B.shape[2]):
                out.u_linear[order, i, c] = 0.0
                out.B[order, i, c] = 0.0


@apart
def _modal_receptance(system: System, p: float, r: int, out: Receptance) -> None:
    """Sum the modes: Z⁻¹ = Σ x_m y_mᴴ / d_m with d_m = ω_m² − (kω)² + ikω c_m, or ikω − s_m for poles.

    Block by block: the products of modes at pairs of contacts once for all harmonics of a structure, then one
    real sum over the block for each of them, which the compiler vectorises. Of the leading ports the first r
    are summed; where these are many A is a product of matrices.
    """
    omega = p if system.kind == FREQUENCY else system.omega
    by_omega = 1.0 if system.kind == FREQUENCY else 0.0
    nc, most = out.B.shape[2], min(BLOCK, system.eigenvalues.shape[1])
    clear(out)
    if r > PAIRS_UP_TO:
        _fill_by_products(system, omega, by_omega, out)
        r = 0
    elif r > 0:
        out.A[:] = 0.0
    weights, driven = np.empty((2 * (r * r + nc), most)), np.empty((2 * (nc + 1), most))
    terms = np.empty((4, most))
    for s in range(system.eigenvalues.shape[0]):
        for first in range(0, system.eigenvalues.shape[1], BLOCK):
            size = min(BLOCK, system.eigenvalues.shape[1] - first)
            turns = _fill_weights(system, s, r, first, size, weights)
            for i in range(system.ks.size):
                if system.which[i] == s:
                    fill_terms(system, s, first, size, float(system.ks[i]), omega, by_omega, terms)
                    _add_pairs(system, r, size, i, turns, weights, terms, out)
                    if fill_driven(system, s, first, size, i, driven):
                        add_driven_modes(size, i, driven, terms, out)


@apart
def _fill_by_products(system: System, omega: float, by_omega: float, out: Receptance) -> None:
    """Fill A with products of the modes at the leading ports."""
    nm, orders = system.eigenvalues.shape[1], 2 if by_omega != 0.0 else 1
    terms = np.empty((4, nm))
    for s in range(system.eigenvalues.shape[0]):
        basis, duals, kinds = basis_of_modes(system, s, system.leading)
        for i in range(system.ks.size):
            if system.which[i] == s:
                fill_terms(system, s, 0, nm, float(system.ks[i]), omega, by_omega, terms)
                fill_product(basis, duals, kinds, terms, orders, i, out.A)
                if orders == 1:
                    out.A[1, i] = 0.0


@compiled
def _fill_weights(system: System, s: int, r: int, first: int, size: int, weights: Real) -> bool:
    """Fill in real and imaginary rows of x_m y_mᴴ at pairs of leading ports, then from ports to the observer.

    For modes, whose y is x, pairs with d ≤ c are enough. Returns whether any imaginary part is not zero.
    """
    nc, symmetric = system.contact_modes.shape[1], system.form == MODES
    modes, duals, seen = system.contact_modes, system.contact_duals, system.observe_modes
    turns = 0.0
    for a in range(r):
        for b in range(a + 1 if symmetric else r):
            row, c, d = 2 * (a * r + b), system.leading[a], system.leading[b]
            for m in range(size):
                x, y = modes[s, c, first + m], duals[s, d, first + m]
                weights[row, m] = x.real * y.real - x.imag * y.imag
                weights[row + 1, m] = x.real * y.imag + x.imag * y.real
                turns += abs(weights[row + 1, m])
    for c in range(nc):
        row = 2 * (r * r + c)
        for m in range(size):
            x, y = seen[s, first + m], duals[s, c, first + m]
            weights[row, m] = x.real * y.real - x.imag * y.imag
            weights[row + 1, m] = x.real * y.imag + x.imag * y.real
            turns += abs(weights[row + 1, m])
    return turns > 0.0


@compiled
def _products(left: Complex, right: Complex, first: int, size: int, real: Real, imag: Real) -> None:
    """Fill in real and imaginary parts of the products of a block."""
    for m in range(size):
        x, y = left[first + m], right[first + m]
        real[m] = x.real * y.real - x.imag * y.imag
        imag[m] = x.real * y.imag + x.imag * y.real


@compiled
def fill_driven(system: System, s: int, first: int, size: int, i: int, driven: Real) -> bool:
    """Fill in real and imaginary rows of x_m y_mᴴ f̂_k at contacts and observer; False without a force."""
    nc, modes, seen = system.contact_modes.shape[1], system.contact_modes[s], system.observe_modes[s]
    forces = system.modal_forces[i]
    moved = 0.0
    for m in range(first, first + size):
        moved += abs(forces[m].real) + abs(forces[m].imag)
    if moved == 0.0:
        return False
    for c in range(nc):
        _products(modes[c], forces, first, size, driven[2 * c], driven[2 * c + 1])
    _products(seen, forces, first, size, driven[2 * nc], driven[2 * nc + 1])
    return True


@compiled
def _sums(weights: Real, row: int, terms: Real, size: int) -> tuple[complex, complex]:
    """Return Σ w_m / d_m and its derivative for one row of real weights."""
    re, im, dre, dim = 0.0, 0.0, 0.0, 0.0
    for m in range(size):
        w = weights[row, m]
        re += w * terms[0, m]
        im += w * terms[1, m]
        dre += w * terms[2, m]
        dim += w * terms[3, m]
    return complex(re, im), complex(dre, dim)


@compiled
def _add_pairs(
    system: System, r: int, size: int, i: int, turns: bool, weights: Real, terms: Real, out: Receptance
) -> None:
    """Add a block of modes to A and B of harmonic number i."""
    A, B = out.A, out.B
    nc, symmetric = B.shape[2], system.form == MODES
    turned, dturned = complex(0.0), complex(0.0)
    for c in range(r):
        for d in range(c + 1 if symmetric else r):
            row = 2 * (c * r + d)
            value, dvalue = _sums(weights, row, terms, size)
            if turns:
                turned, dturned = _sums(weights, row + 1, terms, size)
            A[0, i, c, d] += value + 1j * turned
            A[1, i, c, d] += dvalue + 1j * dturned
            if symmetric and c != d:
                A[0, i, d, c] += value - 1j * turned
                A[1, i, d, c] += dvalue - 1j * dturned
    for c in range(nc):
        row = 2 * (r * r + c)
        value, dvalue = _sums(weights, row, terms, size)
        if turns:
            turned, dturned = _sums(weights, row + 1, terms, size)
        B[0, i, c] += value + 1j * turned
        B[1, i, c] += dvalue + 1j * dturned


@compiled
def add_driven_modes(size: int, i: int, driven: Real, terms: Real, out: Receptance) -> None:
    """Add a block of modes to ū and x̄ of harmonic number i."""
    nc = out.B.shape[2]
    for c in range(nc + 1):
        value, dvalue = _sums(driven, 2 * c, terms, size)
        turned, dturned = _sums(driven, 2 * c + 1, terms, size)
        if c == nc:
            out.x_linear[0, i] += value + 1j * turned
            out.x_linear[1, i] += dvalue + 1j * dturned
        else:
            out.u_linear[0, i, c] += value + 1j * turned
            out.u_linear[1, i, c] += dvalue + 1j * dturned


@apart
def _from_matrices(system: System, p: float, out: Receptance) -> None:
    """Invert Z_k itself; λ may be the frequency or a structural parameter."""
    omega, orders = p if system.kind == FREQUENCY else system.omega, np.array([VALUE])
    if system.kind == FREQUENCY:
        orders = np.array([VALUE, BY_OMEGA])
    elif system.kind == STRUCTURE:
        orders = np.array([VALUE, BY_P])
    else:
        out.A[1], out.B[1], out.u_linear[1], out.x_linear[1] = 0.0, 0.0, 0.0, 0.0
    fill_from_matrices(system, omega, p, orders, out)


@compiled
def goes_through_modes(system: System) -> bool:
    """Whether a structure has modes, or poles, and their way costs less: every port leads."""
    return bool(system.form != DENSE and system.leading.size == system.owner.size and system.owner.size > 1)


@apart
def driven_motions(system: System, p: float, out: Receptance) -> None:
    """Fill in the motions under the excitation at λ = p, with derivatives; A and B stay what they were."""
    omega = p if system.kind == FREQUENCY else system.omega
    by_omega = 1.0 if system.kind == FREQUENCY else 0.0
    nc, most = out.B.shape[2], min(BLOCK, system.eigenvalues.shape[1])
    driven, terms = np.empty((2 * (nc + 1), most)), np.empty((4, most))
    out.x_linear[:], out.u_linear[:] = 0.0, 0.0
    for i in range(system.ks.size):
        s = system.which[i]
        for first in range(0, system.eigenvalues.shape[1], BLOCK):
            size = min(BLOCK, system.eigenvalues.shape[1] - first)
            if fill_driven(system, s, first, size, i, driven):
                fill_terms(system, s, first, size, float(system.ks[i]), omega, by_omega, terms)
                add_driven_modes(size, i, driven, terms, out)
    scale_driven(system, p, out)


@apart
def modal_responses(system: System, p: float, i: int, forces: Complex, motions: Complex) -> None:
    """Fill the motions (nc,) of all ports that forces (nc,) of harmonic number i make at λ = p."""
    omega = p if system.kind == FREQUENCY else system.omega
    nc, most = forces.size, min(BLOCK, system.eigenvalues.shape[1])
    s, k = system.which[i], float(system.ks[i])
    terms, real, imag = np.empty((4, most)), np.empty(most), np.empty(most)
    modes, duals = system.contact_modes[s], system.contact_duals[s]
    motions[:] = 0.0
    for first in range(0, system.eigenvalues.shape[1], BLOCK):
        size = min(BLOCK, system.eigenvalues.shape[1] - first)
        fill_terms(system, s, first, size, k, omega, 0.0, terms)
        real[:], imag[:] = 0.0, 0.0
        for d in range(nc):
            f, g, row = forces[d].real, forces[d].imag, duals[d]
            for m in range(size):
                y = row[first + m]
                real[m] += y.real * f - y.imag * g
                imag[m] += y.real * g + y.imag * f
        for m in range(size):
            a, b = real[m], imag[m]
            real[m] = a * terms[0, m] - b * terms[1, m]
            imag[m] = a * terms[1, m] + b * terms[0, m]
        for c in range(nc):
            f, g, row = 0.0, 0.0, modes[c]
            for m in range(size):
                x = row[first + m]
                f += x.real * real[m] - x.imag * imag[m]
                g += x.real * imag[m] + x.imag * real[m]
            motions[c] += complex(f, g)


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
