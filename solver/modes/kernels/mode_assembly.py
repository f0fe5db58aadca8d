"""The equations of the extended periodic motion and a Newton step; the formulas stand in `equations`.

Amplitudes are v̂ = v_c − i v_s. The slopes of the forces act between the leading motions: where `span` leads
all ports by fewer motions, dF/dw = spanᵀ dF/dU span.
"""

from __future__ import annotations

import math

import numpy as np

from solver.jit.decorators import compiled
from solver.jit.fourier import Complex, Index, Integer, Real, coefficient_count, cosine_position
from solver.jit.lapack import back_substitute, factorise, multiply
from solver.jit.separate import apart
from solver.linear.kernels.dynamic_stiffness import dynamic_stiffness


@apart
def fill_stiffness(
    turns: Real, K: Complex, C: Complex, M: Complex, mass: Complex, omega: float, zeta: float, Z: Complex,
    by_omega: Complex, by_zeta: Complex,
) -> None:  # fmt: skip
    """Fill Z, ∂Z/∂ω and ∂Z/∂ζ entry by entry; all matrices (nk, L), of modes or of whole matrices."""
    for i in range(K.shape[0]):
        for j in range(K.shape[1]):
            drag = complex(0.0, 2.0 * turns[i]) * mass[i, j]
            value, slope, _ = dynamic_stiffness(K[i, j], C[i, j], M[i, j], turns[i], omega)
            Z[i, j] = value - zeta * omega * omega * drag
            by_omega[i, j] = slope - 2.0 * zeta * omega * drag
            by_zeta[i, j] = -(omega * omega) * drag


@apart
def invert_modes(Z: Complex, first: int, rho: complex, b: Complex) -> bool:
    """Add ρ |b|² to the modes of harmonic 1 and replace each Z by its inverse; False if one is 0."""
    for a in range(Z.shape[1]):
        Z[first, a] += rho * (b[a].real * b[a].real + b[a].imag * b[a].imag)
    for i in range(Z.shape[0]):
        for a in range(Z.shape[1]):
            if Z[i, a] == 0.0:
                return False
            Z[i, a] = 1.0 / Z[i, a]
    return True


@apart
def fill_pushes(
    ks: Integer, back: Complex, forces: Real, moved: Real, phi: Complex, by_omega: Complex
) -> None:
    """Fill −Lᴴ F of all coordinates, (nk, N), and its derivative by ω.

    Parameters
    ----------
    back : (nk, N, r); forces, moved : (r, n) forces at the leading ports and their derivatives by ω.
    """
    for i in range(ks.size):
        here = cosine_position(ks, i)
        has_sine = ks[i] > 0
        for a in range(back.shape[1]):
            total, change = complex(0.0), complex(0.0)
            for c in range(back.shape[2]):
                to = back[i, a, c]
                total += to * complex(forces[c, here], -forces[c, here + 1] if has_sine else 0.0)
                change += to * complex(moved[c, here], -moved[c, here + 1] if has_sine else 0.0)
            phi[i, a], by_omega[i, a] = -total, -change


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


@apart
def scaled_step(J: Real, rhs: Real, columns: Real, scaled: Real, pivots: Index) -> bool:
    """Solve J δ = rhs in units `columns` of the unknowns, rows brought to one size; δ in place of `rhs`.

    Returns
    -------
    False, with `rhs` meaningless, if J is singular or something is not finite.
    """
    m = rhs.size
    for i in range(m):
        largest = 0.0
        for j in range(m):
            value = J[i, j] * columns[j]
            scaled[i, j] = value
            largest = max(largest, abs(value))
            if not math.isfinite(value):
                return False
        factor = 1.0 if largest == 0.0 else 1.0 / largest
        for j in range(m):
            scaled[i, j] *= factor
        rhs[i] *= factor
    if factorise(scaled, m, pivots) == 0.0:
        return False
    back_substitute(scaled, m, pivots, rhs)
    for i in range(m):
        rhs[i] *= columns[i]
        if not math.isfinite(rhs[i]):
            return False
    return True


@apart
def relative_residual(
    residual: Real, rough: Real, y: Real, size: int, a: float, lag: float, cancelled: float
) -> float:
    """Return the largest residual, each relative to what it is a difference of; NaN if one is.

    Parameters
    ----------
    rough : (size,) size that a residual of each motion is rounding of, times `cancelled` at least.
    a : amplitude; lag : what the residual of the phase is relative to.
    """
    motion, worst = 1e-300, 0.0
    for i in range(size):
        motion = max(motion, abs(y[i]))
    for i in range(size):
        share = abs(residual[i]) / max(motion, cancelled * rough[i])
        if not share <= worst:
            worst = share
    q = max(math.hypot(y[size], y[size + 1]), a)
    for share in (
        abs(residual[size]) / q, abs(residual[size + 1]) / q, abs(residual[size + 2]) / max(lag, 1e-300),
        abs(residual[size + 3]),
    ):  # fmt: skip
        if not share <= worst:
            worst = share
    return worst if math.isfinite(worst) else np.inf
