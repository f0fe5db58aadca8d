"""The Jacobian of the balance: assembled whole where it is looked at, condensed where a step is solved for.

A contact that sticks all the time from the unloaded state is a spring, F = kt u (in space one for each of
its directions), and one that never touches has F = 0: their ports (`held`) do not couple the harmonics, so
they are eliminated exactly, harmonic by harmonic. With g = slope − shift of those ports, G = ∂F/∂U − shift of
the others (`free`), and

  D = I + A_hh g,  W = D⁻¹ A_hf,  V = A_fh g D⁻¹,  A' = A_ff − V A_hf,

the step of the free ports solves (I + A' G) δ_f = r_f − V r_h and δ_h = D⁻¹ r_h − W G δ_f. A bordered system
[dr/du dr/dλ; tᵀ w] condenses in the same way. Nothing is approximated: a contact that begins to slip is free
at the next evaluation. Where fewer leading ports move all others, `solver.balance.kernels.coordinates` takes
its place.
"""

from __future__ import annotations

import math

import numpy as np

from solver.balance.kernels.coordinates import (
    factorise_coordinates,
    is_reduced,
    step_in_coordinates,
    step_in_coordinates_transposed,
)
from solver.balance.kernels.gauge import keep_means
from solver.balance.kernels.slopes import take_slopes
from solver.contacts.kernels.system import (
    AT_BRANCH_POINT,
    FREE,
    HELD,
    SIZE,
    UNHELD,
    Evaluation,
    Receptance,
    System,
)
from solver.jit.decorators import compiled
from solver.jit.fourier import Complex, Integer, Real, coefficient_count, cosine_position
from solver.jit.lapack import (
    back_substitute,
    back_substitute_transposed,
    copy_block,
    copy_to,
    fill,
    fill_block,
    invert,
    multiply,
    take_block,
)
from solver.jit.lapack import factorise as factorise_block
from solver.jit.separate import apart


@compiled
def _add_block(
    J: Real, G: Real, row: int, column: int, here: int, a: complex, has_sine: bool
) -> None:  # fmt: skip
    """Add A_k[c, d] G to the rows of harmonic k of port c."""
    n = G.shape[0]
    real, imag = a.real, a.imag
    if not has_sine:
        for j in range(n):
            J[row, column + j] += real * G[here, j]
        return
    for j in range(n):
        cosine, sine = G[here, j], G[here + 1, j]
        J[row, column + j] += real * cosine + imag * sine
        J[row + 1, column + j] += real * sine - imag * cosine


@compiled
def fill_jacobian(system: System, linear: Receptance, point: Evaluation) -> None:
    """Fill `point.jacobian` with dr/du where `point` was evaluated last; the receptance is of all ports."""
    whole_jacobian(system, linear.A[0], point, point.jacobian)


@apart
def whole_jacobian(system: System, A: Complex, point: Evaluation, J: Real) -> None:
    """Fill J (nt, nt) with dr/du where `point` was evaluated last; A (nk, nc, nc) of all ports."""
    n, nc = coefficient_count(system.ks), system.owner.size
    fill_block(J, 0.0)
    take_slopes(system, point)
    for i in range(system.ks.size):
        here = cosine_position(system.ks, i)
        has_sine = system.ks[i] > 0
        for c in range(nc):
            row = c * n + here
            for e in range(system.laws.size):
                first, m = system.first_port[e], system.first_port[e + 1] - system.first_port[e]
                for d in range(first, first + m):
                    for q in range(first, first + m):
                        block = system.first_block[e] + (d - first) * m + q - first
                        _add_block(J, point.G[block], row, q * n, here, A[i, c, d], has_sine)
            J[row, row] += 1.0
            if has_sine:
                J[row + 1, row + 1] += 1.0
    keep_means(system, point, J, n)


@compiled
def _part(system: System, point: Evaluation) -> None:
    """Divide the ports into those kept and those eliminated; all are kept where nothing holds a part."""
    free, held = 0, 0
    whole = system.condense == 0 or point.counts[UNHELD] > 0
    for c in range(system.owner.size):
        if whole or math.isnan(point.slopes[c]) or point.elastic[c] > 0.0:
            point.free[free] = c
            free += 1
        else:
            point.held[held] = c
            held += 1
    point.counts[FREE], point.counts[HELD] = free, held


@apart
def _eliminate(system: System, linear: Receptance, point: Evaluation) -> bool:
    """Fill D⁻¹, W, V and A' of all harmonics; False if one's D is singular."""
    free, held = point.counts[FREE], point.counts[HELD]
    kept, gone = point.free, point.held
    if held == 0:
        for i in range(system.ks.size):
            for a in range(free):
                for b in range(free):
                    point.reduced[i, a, b] = linear.A[0, i, kept[a], kept[b]]
        return True
    D, inverse = np.empty((held, held), np.complex128), np.empty((held, held), np.complex128)
    W, down = np.empty((held, free), np.complex128), np.empty((held, free), np.complex128)
    V, up = np.empty((free, held), np.complex128), np.empty((free, held), np.complex128)
    taken = np.empty((free, free), np.complex128)
    for i in range(system.ks.size):
        A = linear.A[0, i]
        take_block(A, gone, gone, D)
        take_block(A, gone, kept, down)
        take_block(A, kept, gone, up)
        for h in range(held):
            g = point.slopes[gone[h]] - system.shift[gone[h]]
            for other in range(held):
                D[other, h] *= g
            for a in range(free):
                up[a, h] *= g
        for h in range(held):
            D[h, h] += 1.0
        if not invert(D, inverse):
            return False
        multiply(inverse, down, W)
        multiply(up, inverse, V)
        multiply(V, down, taken)
        for a in range(free):
            for b in range(free):
                point.reduced[i, a, b] = A[kept[a], kept[b]] - taken[a, b]
        copy_block(point.inverse[i], inverse)
        copy_block(point.W[i], W)
        copy_block(point.V[i], V)
    return True


@apart
def _assemble(system: System, point: Evaluation, J: Real) -> None:
    """Fill the leading block of `J` with I + A' G."""
    n, free = coefficient_count(system.ks), point.counts[FREE]
    for i in range(free * n):
        for j in range(free * n):
            J[i, j] = 0.0
    for i in range(system.ks.size):
        here = cosine_position(system.ks, i)
        has_sine = system.ks[i] > 0
        for a in range(free):
            row = a * n + here
            b = 0
            while b < free:
                # The ports of an element are free together, and stand side by side.
                e = system.owner[point.free[b]]
                m = system.first_port[e + 1] - system.first_port[e]
                for d in range(m):
                    for q in range(m):
                        block = system.first_block[e] + d * m + q
                        response = point.reduced[i, a, b + d]
                        _add_block(J, point.G[block], row, (b + q) * n, here, response, has_sine)
                b += m
            J[row, row] += 1.0
            if has_sine:
                J[row + 1, row + 1] += 1.0
    keep_means(system, point, J, n)


@apart
def _times(
    system: System, matrices: Complex, transposed: bool, rows: int, columns: int, x: Real, sign: float,
    y: Real,
) -> None:  # fmt: skip
    """Add sign·(matrix of each harmonic) @ x to y, or with its conjugate transpose; x, y (ports·n,)."""
    n = coefficient_count(system.ks)
    for i in range(system.ks.size):
        here = cosine_position(system.ks, i)
        has_sine = system.ks[i] > 0
        for row in range(rows):
            total = complex(0.0)
            for column in range(columns):
                at = column * n + here
                value = complex(x[at], -x[at + 1] if has_sine else 0.0)
                entry = matrices[i, column, row].conjugate() if transposed else matrices[i, row, column]
                total += entry * value
            at = row * n + here
            y[at] += sign * total.real
            if has_sine:
                y[at + 1] -= sign * total.imag


@compiled
def _gather(n: int, ports: Integer, count: int, source: Real, target: Real) -> None:
    """Copy the coefficients of some ports to the front of `target`."""
    for a in range(count):
        for j in range(n):
            target[a * n + j] = source[ports[a] * n + j]


@compiled
def _slopes_times(system: System, point: Evaluation, transposed: bool, x: Real, y: Real) -> None:
    """Fill y = G x over the free ports, or Gᵀ x."""
    n, free = coefficient_count(system.ks), point.counts[FREE]
    for i in range(free * n):
        y[i] = 0.0
    b = 0
    while b < free:
        e = system.owner[point.free[b]]
        m = system.first_port[e + 1] - system.first_port[e]
        for d in range(m):
            for q in range(m):
                G = point.G[system.first_block[e] + d * m + q]
                for i in range(n):
                    if transposed:
                        value = x[(b + d) * n + i]
                        for j in range(n):
                            y[(b + q) * n + j] += G[i, j] * value
                    else:
                        total = 0.0
                        for j in range(n):
                            total += G[i, j] * x[(b + q) * n + j]
                        y[(b + d) * n + i] += total
        b += m


@apart
def factorise(
    system: System, linear: Receptance, point: Evaluation, tangent: Real, weight_u: float, weight_p: float
) -> float:
    """Factorise dr/du at `point`, bordered by dr/dλ and the weighted tangent if weight_p > 0.

    Parameters
    ----------
    tangent : (nt + 1,) last entry the λ part; looked at only with a border.

    Returns
    -------
    The sign of the determinant, which condensing does not change; 0.0 if singular.
    """
    if is_reduced(system, linear):
        return factorise_coordinates(system, linear, point, tangent, weight_u, weight_p)
    n, lu = coefficient_count(system.ks), point.lu
    _part(system, point)
    take_slopes(system, point)
    if not _eliminate(system, linear, point):
        return 0.0
    _assemble(system, point, lu)
    size = point.counts[FREE] * n
    point.counts[AT_BRANCH_POINT] = 0
    if weight_p > 0.0:
        _border(system, point, tangent, weight_u, weight_p)
        size += 1
    point.counts[SIZE] = size
    return 1.0 if size == 0 else factorise_block(lu, size, point.pivots)


@apart
def _border(system: System, point: Evaluation, tangent: Real, weight_u: float, weight_p: float) -> None:
    """Put condensed dr/dλ and tangent around the leading block of the factors."""
    n, lu = coefficient_count(system.ks), point.lu
    free, held = point.counts[FREE], point.counts[HELD]
    end = free * n
    column, row, q = point.work[0], point.work[1], point.work[2]
    for i in range(point.border.size):
        point.border[i] = weight_u * tangent[i]
    corner = weight_p * tangent[tangent.size - 1]
    _gather(n, point.free, free, point.dr_dp, column)
    _gather(n, point.free, free, point.border, row)
    if held > 0:
        slope, along = np.empty(held * n), np.empty(held * n)
        _gather(n, point.held, held, point.dr_dp, slope)
        _gather(n, point.held, held, point.border, along)
        for i in range(held * n):
            point.held_slope[i] = 0.0
        _times(system, point.inverse, False, held, held, slope, 1.0, point.held_slope)
        _times(system, point.V, False, free, held, slope, -1.0, column)
        for i in range(held * n):
            corner -= along[i] * point.held_slope[i]
        weighted = np.zeros(max(end, 1))
        _times(system, point.W, True, free, held, along, 1.0, weighted)
        _slopes_times(system, point, True, weighted, q)
        for i in range(end):
            row[i] -= q[i]
    for i in range(end):
        lu[i, end] = column[i]
        lu[end, i] = row[i]
    lu[end, end] = corner


@apart
def step_back(system: System, point: Evaluation, x: Real) -> None:
    """Solve with the factors of `factorise`, in place.

    Parameters
    ----------
    x : (nt,) or, with a border, (nt + 1,) the right-hand side, last the border's.
    """
    if point.pushed.shape[1] > 0:
        step_in_coordinates(system, point, x)
        return
    n = coefficient_count(system.ks)
    free, held = point.counts[FREE], point.counts[HELD]
    end, size = free * n, point.counts[SIZE]
    bordered = size > end
    rhs, z = point.work[0], point.work[1]
    _gather(n, point.free, free, x, rhs)
    last = x.size - 1
    if bordered:
        rhs[end] = x[last]
    if held == 0:
        back_substitute(point.lu, size, point.pivots, rhs)
        for a in range(end):
            x[a] = rhs[a]
        if bordered:
            x[last] = rhs[end]
        return
    given, moved = point.work[2], point.work[3]
    _gather(n, point.held, held, x, given)
    for i in range(held * n):
        moved[i] = 0.0
    _times(system, point.inverse, False, held, held, given, 1.0, moved)
    _times(system, point.V, False, free, held, given, -1.0, rhs)
    if bordered:
        for h in range(held):
            for j in range(n):
                rhs[end] -= point.border[point.held[h] * n + j] * moved[h * n + j]
    if size > 0:
        back_substitute(point.lu, size, point.pivots, rhs)
    if bordered:
        x[last] = rhs[end]
        for i in range(held * n):
            moved[i] -= rhs[end] * point.held_slope[i]
    _slopes_times(system, point, False, rhs, z)
    _times(system, point.W, False, held, free, z, -1.0, moved)
    for a in range(free):
        copy_to(x[point.free[a] * n : (point.free[a] + 1) * n], rhs[a * n : (a + 1) * n])
    for h in range(held):
        copy_to(x[point.held[h] * n : (point.held[h] + 1) * n], moved[h * n : (h + 1) * n])


@apart
def step_back_transposed(system: System, point: Evaluation, x: Real) -> None:
    """Solve with the transpose of what `factorise` factorised without a border, in place.

    λ_f = (I + A' G)⁻ᵀ (b_f − Gᵀ Wᵀ b_h) and λ_h = D⁻ᵀ b_h − Vᵀ λ_f.

    Parameters
    ----------
    x : (nt,) the right-hand side.
    """
    if point.pushed.shape[1] > 0:
        step_in_coordinates_transposed(system, point, x)
        return
    n = coefficient_count(system.ks)
    free, held = point.counts[FREE], point.counts[HELD]
    size = point.counts[SIZE]
    rhs, z, given, moved = point.work[0], point.work[1], point.work[2], point.work[3]
    _gather(n, point.free, free, x, rhs)
    if held > 0:
        _gather(n, point.held, held, x, given)
        fill(moved, 0.0)
        _times(system, point.W, True, free, held, given, 1.0, moved)
        _slopes_times(system, point, True, moved, z)
        for i in range(size):
            rhs[i] -= z[i]
    if size > 0:
        back_substitute_transposed(point.lu, size, point.pivots, rhs)
    for a in range(free):
        copy_to(x[point.free[a] * n : (point.free[a] + 1) * n], rhs[a * n : (a + 1) * n])
    if held > 0:
        fill(moved, 0.0)
        _times(system, point.inverse, True, held, held, given, 1.0, moved)
        _times(system, point.V, True, held, free, rhs, -1.0, moved)
        for h in range(held):
            copy_to(x[point.held[h] * n : (point.held[h] + 1) * n], moved[h * n : (h + 1) * n])
