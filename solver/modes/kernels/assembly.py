"""Residual and Jacobian of the extended periodic motion, put together; the formulas stand in `equations`.

Amplitudes are v̂ = v_c − i v_s. The slopes of the forces act between the leading motions: where `span` leads
all ports by fewer motions, dF/dw = spanᵀ dF/dU span.
"""

from __future__ import annotations

import numpy as np

from solver.jit.decorators import compiled
from solver.jit.fourier import Complex, Integer, Real, coefficient_count, cosine_position
from solver.jit.lapack import multiply
from solver.jit.separate import apart


@apart
def fill_slopes(ks: Integer, places: Integer, G: Real, span: Real, slopes: Complex) -> None:
    """Fill the amplitudes of dF/dw of every kept harmonic.

    Parameters
    ----------
    places : (nb, 3) row port, column port and number of every block.
    G : (·, n, n) blocks of dF/dU less the shift.
    span : (nc, r) motions of the ports by the leading ones; (nc, 0) where every port leads itself.
    slopes : (nk, r, r n) filled.
    """
    n = coefficient_count(ks)
    for i in range(slopes.shape[0]):
        for a in range(slopes.shape[1]):
            for j in range(slopes.shape[2]):
                slopes[i, a, j] = 0.0
    for block in range(places.shape[0]):
        row, column, at = places[block, 0], places[block, 1], places[block, 2]
        if span.shape[1] == 0:
            _add_slopes(ks, n, G[at], row, column, 1.0, slopes)
            continue
        for a in range(span.shape[1]):
            for b in range(span.shape[1]):
                factor = span[row, a] * span[column, b]
                if factor != 0.0:
                    _add_slopes(ks, n, G[at], a, b, factor, slopes)


@compiled
def _add_slopes(ks: Integer, n: int, G: Real, a: int, b: int, factor: float, slopes: Complex) -> None:
    """Add factor times the amplitudes of one block, of the force a by the motion b."""
    for i in range(ks.size):
        here = cosine_position(ks, i)
        has_sine = ks[i] > 0
        for j in range(n):
            sine = G[here + 1, j] if has_sine else 0.0
            slopes[i, a, b * n + j] += factor * complex(G[here, j], -sine)


@apart
def fill_motions(
    ks: Integer, contact: Complex, A: Complex, slopes: Complex, x: Complex, w: Real, changes: Complex,
    forces: Real, residual: Real, J: Real, rough: Real,
) -> None:  # fmt: skip
    """Fill the rows of the motions: w − L x, what they change with, and what they are relative to.

    Parameters
    ----------
    contact : (nk, r, N) motions of the leading ports; A : (nk, r, r) L Z⁻¹ Lᴴ.
    slopes : (nk, r, r n) of `fill_slopes`.
    x : (nk, N); w : (r, n).
    changes : (3, nk, N) change of x by Re q, ω and the last unknown.
    forces : (r, n) at the leading ports less the shift.
    residual, J : (m,), (m, m) of the equations, rows of the motions filled.
    rough : (r n,) filled with max|A_k| max|F|, the size of which a residual is rounding.
    """
    nk, r, width = slopes.shape
    n, pushed = coefficient_count(ks), np.empty((r, width), np.complex128)
    strongest = 0.0
    for c in range(r):
        for j in range(n):
            strongest = max(strongest, abs(forces[c, j]))
    for i in range(nk):
        here = cosine_position(ks, i)
        has_sine = ks[i] > 0
        reach = 0.0
        multiply(A[i], slopes[i], pushed)
        for c in range(r):
            for d in range(r):
                reach = max(reach, abs(A[i, c, d]))
        for c in range(r):
            rough[c * n + here] = reach * strongest
            if has_sine:
                rough[c * n + here + 1] = reach * strongest
            row = c * n + here
            for j in range(width):
                J[row, j] = pushed[c, j].real
                if has_sine:
                    J[row + 1, j] = -pushed[c, j].imag
            J[row, row] += 1.0
            moved = _seen(contact, x, i, c)
            residual[row] = w[c, here] - moved.real
            by_q, by_omega, by_last = _all_seen(contact, changes, i, c)
            J[row, width], J[row, width + 1] = -by_q.real, by_q.imag
            J[row, width + 2], J[row, width + 3] = -by_omega.real, -by_last.real
            if has_sine:
                J[row + 1, row + 1] += 1.0
                residual[row + 1] = w[c, here + 1] + moved.imag
                J[row + 1, width], J[row + 1, width + 1] = by_q.imag, by_q.real
                J[row + 1, width + 2], J[row + 1, width + 3] = by_omega.imag, by_last.imag


@compiled
def _seen(contact: Complex, x: Complex, i: int, c: int) -> complex:
    """Return the motion of a leading port in harmonic i."""
    total = complex(0.0)
    for a in range(x.shape[1]):
        total += contact[i, c, a] * x[i, a]
    return total


@compiled
def _all_seen(contact: Complex, changes: Complex, i: int, c: int) -> tuple[complex, complex, complex]:
    """Return the motions of a leading port in harmonic i of all changes."""
    first, second, third = complex(0.0), complex(0.0), complex(0.0)
    for a in range(changes.shape[2]):
        to = contact[i, c, a]
        first += to * changes[0, i, a]
        second += to * changes[1, i, a]
        third += to * changes[2, i, a]
    return first, second, third


@apart
def fill_functionals(
    back: Complex, slopes: Complex, rows: Complex, adjoints: Complex, changes: Complex, J: Real
) -> None:
    """Fill the rows of q (two), of the phase and of the amplitude, each of a sum cᴴ x over the harmonics.

    Parameters
    ----------
    back : (nk, N, r) what the forces at the leading ports push.
    rows, adjoints : (3, nk, N) c and Z⁻ᴴ c.
    changes : (3, nk, N) as in `fill_motions`.
    """
    nk, r, width = slopes.shape
    for each in range(3):
        place = width if each == 0 else width + 1 + each
        for j in range(width + 4):
            J[place, j] = 0.0
            if each == 0:
                J[place + 1, j] = 0.0
        for i in range(nk):
            for a in range(r):
                pull = complex(0.0)
                for b in range(back.shape[1]):
                    pull += adjoints[each, i, b].conjugate() * back[i, b, a]
                if pull == 0.0:
                    continue
                for j in range(width):
                    by = pull * slopes[i, a, j]
                    if each == 0:
                        J[place, j] += by.real
                        J[place + 1, j] += by.imag
                    else:
                        J[place, j] -= by.real
            for k in range(3):
                by = complex(0.0)
                for b in range(back.shape[1]):
                    by += rows[each, i, b].conjugate() * changes[k, i, b]
                _add_rest(J, place, width, each, k, by)
    J[width, width] += 1.0
    J[width + 1, width + 1] += 1.0


@compiled
def _add_rest(J: Real, place: int, width: int, each: int, k: int, by: complex) -> None:
    """Add the derivative by q (k = 0), ω (1) or the last unknown (2)."""
    if each == 0:
        if k == 0:
            J[place, width] -= by.real
            J[place, width + 1] += by.imag
            J[place + 1, width] -= by.imag
            J[place + 1, width + 1] -= by.real
        else:
            J[place, width + 1 + k] -= by.real
            J[place + 1, width + 1 + k] -= by.imag
    elif k == 0:
        J[place, width] += by.real
        J[place, width + 1] -= by.imag
    else:
        J[place, width + 1 + k] += by.real
