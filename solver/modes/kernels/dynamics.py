"""Z_k(ω, ζ) of all kept harmonics with its derivatives, and what pushes the coordinates; see `structure`."""

from __future__ import annotations

from solver.jit.fourier import Complex, Integer, Real, cosine_position
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
