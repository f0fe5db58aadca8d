"""The receptance of many ports as products of matrices: A_k = X D_k(ω) Yᴴ, and its derivatives by ω.

All is put into real products, which take half as long as complex ones, and a quarter where modes are real:
of a real mode x, or of the poles s and s̄ of a real structure with x and x̄, the columns are

  x t yᴴ = [Re x] [t yᴴ],   x t yᴴ + x̄ t' y'ᴴ = [Re x, Im x] [t yᴴ + t' y'ᴴ; i (t yᴴ − t' y'ᴴ)],

and of any other [Re x, Im x] [t yᴴ; i t yᴴ], with t = 1/d or a derivative of it. The left factor does not
depend on the frequency.
"""

from __future__ import annotations

import numpy as np

from solver.contacts.kernels.system import System
from solver.jit.decorators import compiled
from solver.jit.fourier import Complex, Integer, Real
from solver.jit.separate import apart

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
