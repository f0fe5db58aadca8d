"""The balance where few modes, coordinates or rigid bodies move many ports: its matrices in leading ports.

Every motion follows from those of r leading ports, L = P L_leading, so that A_k = P Â_k Pᵀ and
dr/du = I + P Â Pᵀ G is the identity and a part of rank r. By the identity of Woodbury (W. W. Hager, SIAM Rev.
31 (1989) 221, doi:10.1137/1031049) the step (I + P Â Pᵀ G) δ = b is

  T y = Â Pᵀ G b,  T = I + Â Ĝ,  Ĝ = Pᵀ G P,  δ = b − P y,

with r unknowns for each coefficient instead of as many as there are ports, and det T = det dr/du. With a
border, [dr/du dr/dλ; wᵀ ω], the same holds for

  [T, Â Pᵀ G dr/dλ; −wᵀ P, ω − wᵀ dr/dλ].

Nothing is approximated. The unknowns stay the motions of all ports.
"""

from __future__ import annotations

import numpy as np

from solver.balance.kernels.slopes import slopes_times, take_slopes
from solver.contacts.kernels.system import (
    AT_BRANCH_POINT,
    FREE,
    HELD,
    PINNED,
    SIZE,
    Evaluation,
    Receptance,
    System,
)
from solver.jit.decorators import compiled
from solver.jit.fourier import Complex, Integer, Real, coefficient_count, cosine_position
from solver.jit.lapack import back_substitute, back_substitute_transposed, copy_to, factorise, fill, invert
from solver.jit.separate import apart


@compiled
def is_reduced(system: System, linear: Receptance) -> bool:
    """Return whether a receptance is that of the leading ports alone."""
    return bool(linear.A.shape[2] < system.owner.size)


@apart
def responses(system: System, A: Complex, forces: Complex, motions: Complex) -> None:
    """Fill motions (nc,) with P Â Pᵀ forces (nc,) at one harmonic."""
    nc, r = system.span.shape
    gathered, moved = np.zeros(r, np.complex128), np.zeros(r, np.complex128)
    for c in range(nc):
        force = forces[c]
        for a in range(r):
            gathered[a] += system.span[c, a] * force
    for a in range(r):
        for b in range(r):
            moved[a] += A[a, b] * gathered[b]
    for c in range(nc):
        total = complex(0.0)
        for a in range(r):
            total += system.span[c, a] * moved[a]
        motions[c] = total


@apart
def reaches(system: System, A: Complex, reach: Real) -> None:
    """Fill reach (nc,) with the size of the receptance from other ports to each, by its largest entries."""
    nc, r = system.span.shape
    of_leading = np.zeros(r)
    for a in range(r):
        for b in range(r):
            of_leading[a] = max(of_leading[a], abs(A[a, b].real) + abs(A[a, b].imag))
    for c in range(nc):
        reach[c] = 0.0
        for a in range(r):
            reach[c] = max(reach[c], abs(system.span[c, a]) * of_leading[a])


@apart
def _gather(system: System, x: Real, y: Real) -> None:
    """Fill y (r·n,) with Pᵀ x."""
    n = coefficient_count(system.ks)
    nc, r = system.span.shape
    fill(y[: r * n], 0.0)
    for c in range(nc):
        for a in range(r):
            share = system.span[c, a]
            if share != 0.0:
                for j in range(n):
                    y[a * n + j] += share * x[c * n + j]


@apart
def _take_away(system: System, y: Real, x: Real) -> None:
    """Subtract P y from x."""
    n = coefficient_count(system.ks)
    nc, r = system.span.shape
    for c in range(nc):
        for a in range(r):
            share = system.span[c, a]
            if share != 0.0:
                for j in range(n):
                    x[c * n + j] -= share * y[a * n + j]


@apart
def _respond(ks: Integer, A: Complex, transposed: bool, x: Real, y: Real) -> None:
    """Fill y = Â x in the leading ports, or with its transpose; A (nk, r, r)."""
    n, r = coefficient_count(ks), A.shape[1]
    for i in range(ks.size):
        here = cosine_position(ks, i)
        has_sine = ks[i] > 0
        for a in range(r):
            total = complex(0.0)
            for b in range(r):
                at = b * n + here
                entry = A[i, b, a].conjugate() if transposed else A[i, a, b]
                total += entry * complex(x[at], -x[at + 1] if has_sine else 0.0)
            y[a * n + here] = total.real
            if has_sine:
                y[a * n + here + 1] = -total.imag


@apart
def _pushed_through(system: System, point: Evaluation, x: Real, y: Real) -> None:
    """Fill y (r·n,) with Â Pᵀ G x."""
    forces, gathered = np.empty(x.size), np.empty(y.size)
    slopes_times(system, point, False, x, forces)
    _gather(system, forces, gathered)
    _respond(system.ks, point.responses, False, gathered, y)


@apart
def _fill_springs(system: System, point: Evaluation) -> None:
    """Fill Ĝ = Pᵀ G P, (n, r, r·n): of each coefficient of the forces G P, then one product of matrices."""
    n, r = coefficient_count(system.ks), system.span.shape[1]
    pushed = point.pushed
    for i in range(n):
        for e in range(system.laws.size):
            first, m = system.first_port[e], system.first_port[e + 1] - system.first_port[e]
            for a in range(m):
                row = pushed[first + a]
                fill(row, 0.0)
                for b in range(m):
                    G = point.G[system.first_block[e] + a * m + b, i]
                    for q in range(r):
                        share = system.span[first + b, q]
                        if share != 0.0:
                            for j in range(n):
                                row[q * n + j] += share * G[j]
        np.dot(system.span.T, pushed, point.springs[i])
    along = np.empty(r)
    for k in range(point.counts[PINNED]):
        fill(along, 0.0)
        for c in range(system.owner.size):
            for a in range(r):
                along[a] += system.span[c, a] * point.pinned[k, c]
        for a in range(r):
            for b in range(r):
                point.springs[0, a, b * n] += along[a] * along[b]


@apart
def _assemble(system: System, point: Evaluation) -> None:
    """Fill the leading block of the factors with T = I + Â Ĝ, harmonic by harmonic."""
    n, r = coefficient_count(system.ks), system.span.shape[1]
    springs, lu = point.springs, point.lu
    for i in range(system.ks.size):
        here, m = cosine_position(system.ks, i), 2 if system.ks[i] > 0 else 1
        left, right, product = np.empty((m * r, m * r)), point.rows[: m * r], point.rows[2 * r : (2 + m) * r]
        for a in range(r):
            for q in range(m):
                copy_to(right[q * r + a], springs[here + q, a])
            for b in range(r):
                entry = point.responses[i, a, b]
                left[a, b] = entry.real
                if m == 2:
                    left[a, r + b], left[r + a, b], left[r + a, r + b] = entry.imag, -entry.imag, entry.real
        np.dot(left, right, product)
        for a in range(r):
            for q in range(m):
                row = a * n + here + q
                copy_to(lu[row, : r * n], product[q * r + a])
                lu[row, row] += 1.0


@apart
def factorise_coordinates(
    system: System, linear: Receptance, point: Evaluation, tangent: Real, weight_u: float, weight_p: float
) -> float:
    """Factorise as `solver.balance.kernels.jacobian.factorise`, in the leading ports."""
    n, r = coefficient_count(system.ks), system.span.shape[1]
    point.counts[FREE], point.counts[HELD], point.counts[AT_BRANCH_POINT] = system.owner.size, 0, 0
    take_slopes(system, point)
    for i in range(system.ks.size):
        for a in range(r):
            for b in range(r):
                point.responses[i, a, b] = linear.A[0, i, a, b]
    _fill_springs(system, point)
    _assemble(system, point)
    size, lu = r * n, point.lu
    if weight_p > 0.0:
        column, row = np.empty(r * n), np.empty(r * n)
        corner = weight_p * tangent[tangent.size - 1]
        for i in range(point.border.size):
            point.border[i] = weight_u * tangent[i]
            point.settled[i] = point.dr_dp[i]
            corner -= point.border[i] * point.dr_dp[i]
        _pushed_through(system, point, point.settled, column)
        _gather(system, point.border, row)
        for i in range(size):
            lu[i, size], lu[size, i] = column[i], -row[i]
        lu[size, size] = corner
        size += 1
    point.counts[SIZE] = size
    return factorise(lu, size, point.pivots)


@apart
def step_in_coordinates(system: System, point: Evaluation, x: Real) -> None:
    """Solve as `solver.balance.kernels.jacobian.step_back`, in place."""
    nt, inner = point.border.size, system.span.shape[1] * coefficient_count(system.ks)
    size = point.counts[SIZE]
    y = np.empty(size)
    _pushed_through(system, point, x[:nt], y[:inner])
    if size > inner:
        y[inner] = x[nt]
        for i in range(nt):
            y[inner] -= point.border[i] * x[i]
    back_substitute(point.lu, size, point.pivots, y)
    if size > inner:
        x[nt] = y[inner]
        for i in range(nt):
            x[i] -= y[inner] * point.settled[i]
    _take_away(system, y, x)


@apart
def step_in_coordinates_transposed(system: System, point: Evaluation, x: Real) -> None:
    """Solve with the transpose of dr/du, in place: Tᵀ z = Pᵀ b, λ = b − Gᵀ P Âᵀ z."""
    nt, inner = x.size, point.counts[SIZE]
    z, moved, along, back = np.empty(inner), np.empty(inner), np.zeros(nt), np.empty(nt)
    _gather(system, x, z)
    back_substitute_transposed(point.lu, inner, point.pivots, z)
    _respond(system.ks, point.responses, True, z, moved)
    _take_away(system, moved, along)
    slopes_times(system, point, True, along, back)
    for i in range(nt):
        x[i] += back[i]


@apart
def springs_response(system: System, A: Complex, stiffness: Real, free: Complex, motions: Complex) -> bool:
    """Fill motions (nc,) with (I + P Â Pᵀ g)⁻¹ free at one harmonic, g (nc,) springs; False if singular."""
    nc, r = system.span.shape
    held, matrix = np.zeros((r, r)), np.empty((r, r), np.complex128)
    inverse, gathered = np.empty((r, r), np.complex128), np.zeros(r, np.complex128)
    for c in range(nc):
        for a in range(r):
            share = system.span[c, a] * stiffness[c]
            gathered[a] += share * free[c]
            for b in range(r):
                held[a, b] += share * system.span[c, b]
    for a in range(r):
        for b in range(r):
            total = complex(1.0 if a == b else 0.0)
            for d in range(r):
                total += A[a, d] * held[d, b]
            matrix[a, b] = total
    if not invert(matrix, inverse):
        return False
    driven = np.zeros(r, np.complex128)
    for a in range(r):
        for b in range(r):
            driven[a] += A[a, b] * gathered[b]
    for c in range(nc):
        total = free[c]
        for a in range(r):
            for b in range(r):
                total -= system.span[c, a] * inverse[a, b] * driven[b]
        motions[c] = total
    return True


@apart
def on_springs(
    system: System, linear: Receptance, i: int, stiffness: Real, free: Complex, motions: Complex
) -> bool:
    """Solve (I + A k) motions = free at harmonic number i, (nc,) each; False if there is no such motion."""
    if is_reduced(system, linear):
        return springs_response(system, linear.A[0, i], stiffness, free, motions)
    nc = stiffness.size
    matrix, inverse = np.empty((nc, nc), np.complex128), np.empty((nc, nc), np.complex128)
    for c in range(nc):
        for d in range(nc):
            matrix[c, d] = linear.A[0, i, c, d] * stiffness[d]
        matrix[c, c] += 1.0
    if not invert(matrix, inverse):
        return False
    for c in range(nc):
        motion = complex(0.0)
        for d in range(nc):
            motion += inverse[c, d] * free[d]
        motions[c] = motion
    return True
