"""The Jacobian of the balance: assembled whole where it is looked at, condensed where a step is solved for.

A contact that sticks all the time from the unloaded state is a spring, F = kt u (in space one for each of
its directions), one that never touches has F = 0, and the normal force of one that never opens is a spring's
whatever friction does: the forces of such ports (`held`) do not couple the harmonics, so they are eliminated
exactly, harmonic by harmonic. With g = slope − shift of those ports, G = ∂F/∂U − shift, of which the rows of
the others (`free`) are looked at, and

  D = I + A_hh g,  V = A_fh g D⁻¹,  T b = (b_f − V b_h, D⁻¹ b_h),  R = (A_ff − V A_hf, D⁻¹ A_hf),

the step δ that solves dr/du δ = b is T b − R φ with the forces φ of the free ports. Where friction feels
ports that are eliminated these are the unknowns, (I + G R) φ = G T b, and a bordered system [dr/du d; tᵀ w]
condenses to

  [I + G R, G T d; −tᵀ R, w − tᵀ T d].

Elsewhere the motions are, φ = G δ_f and (I + R_ff G) δ_f = (T b)_f, which loses nothing near resonances that
nothing damps: there T b and R φ cancel. Both have the sign of det dr/du.

Nothing is approximated: a contact that begins to slip is free at the next evaluation. Where fewer leading
ports move all others, `solver.balance.kernels.coordinates` takes its place, and
`solver.balance.kernels.banded` where many contacts feel few others each.
"""

from __future__ import annotations

import math

import numpy as np

from solver.balance.kernels.banded import BANDED_FROM, factorise_banded, step_banded, step_banded_transposed
from solver.balance.kernels.coordinates import (
    factorise_coordinates,
    is_reduced,
    step_in_coordinates,
    step_in_coordinates_transposed,
)
from solver.balance.kernels.gauge import keep_means
from solver.balance.kernels.slopes import slopes_times, take_slopes
from solver.contacts.kernels.system import (
    AT_BRANCH_POINT,
    BANDED,
    FREE,
    HELD,
    MIXED,
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
    dot,
    fill,
    fill_block,
    invert,
    largest_entry,
    multiply,
    set_to,
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
    free, held, mixed, before = 0, 0, 0, False
    whole = system.condense == 0 or point.counts[UNHELD] > 0
    for c in range(system.owner.size):
        kept = whole or math.isnan(point.slopes[c]) or point.elastic[c] > 0.0
        if c > 0 and system.owner[c] == system.owner[c - 1] and kept != before:
            mixed = 1
        before = kept
        if kept:
            point.free[free] = c
            free += 1
        else:
            point.held[held] = c
            held += 1
    point.counts[FREE], point.counts[HELD], point.counts[MIXED] = free, held, mixed


@apart
def _eliminate(system: System, linear: Receptance, point: Evaluation) -> bool:
    """Fill R, V and D⁻¹ of all harmonics into `responses`; False if one's D is singular."""
    free, held = point.counts[FREE], point.counts[HELD]
    kept, gone = point.free[:free], point.held[:held]
    if held == 0:
        for i in range(system.ks.size):
            copy_block(point.responses[i], linear.A[0, i])
        return True
    D, inverse = np.empty((held, held), np.complex128), np.empty((held, held), np.complex128)
    W, down = np.empty((held, free), np.complex128), np.empty((held, free), np.complex128)
    V, up = np.empty((free, held), np.complex128), np.empty((free, held), np.complex128)
    taken = np.empty((free, free), np.complex128)
    for i in range(system.ks.size):
        A, R = linear.A[0, i], point.responses[i]
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
                R[kept[a], kept[b]] = A[kept[a], kept[b]] - taken[a, b]
            for h in range(held):
                R[kept[a], gone[h]], R[gone[h], kept[a]] = V[a, h], W[h, a]
        for h in range(held):
            for other in range(held):
                R[gone[h], gone[other]] = inverse[h, other]
    return True


@apart
def _assemble(system: System, point: Evaluation) -> None:
    """Fill the leading block of the factors with I + R G of the free ports."""
    n, free, J, kept = coefficient_count(system.ks), point.counts[FREE], point.lu, point.free
    for i in range(free * n):
        fill(J[i, : free * n], 0.0)
    for i in range(system.ks.size):
        here, has_sine = cosine_position(system.ks, i), system.ks[i] > 0
        for a in range(free):
            row, b = a * n + here, 0
            while b < free:
                # The ports of an element are free together, and stand side by side.
                e = system.owner[kept[b]]
                m = system.first_port[e + 1] - system.first_port[e]
                for d in range(m):
                    response = point.responses[i, kept[a], kept[b + d]]
                    for q in range(m):
                        G = point.G[system.first_block[e] + d * m + q]
                        _add_block(J, G, row, (b + q) * n, here, response, has_sine)
                b += m
            J[row, row] += 1.0
            if has_sine:
                J[row + 1, row + 1] += 1.0
    keep_means(system, point, J, n)


@apart
def _assemble_mixed(system: System, point: Evaluation) -> None:
    """Fill the leading block of the factors with the transpose of I + G R."""
    n, free, lu = coefficient_count(system.ks), point.counts[FREE], point.lu
    columns = np.empty((n, n))
    for i in range(free * n):
        fill(lu[i, : free * n], 0.0)
        lu[i, i] = 1.0
    for a in range(free):
        e = system.owner[point.free[a]]
        first, m = system.first_port[e], system.first_port[e + 1] - system.first_port[e]
        for q in range(m):
            G = point.G[system.first_block[e] + (point.free[a] - first) * m + q]
            for i in range(n):
                for j in range(n):
                    columns[j, i] = G[i, j]
            for b in range(free):
                for i in range(system.ks.size):
                    r = point.responses[i, first + q, point.free[b]]
                    if r != 0.0:
                        here = cosine_position(system.ks, i)
                        _add_rows(lu, columns, b * n + here, a * n, here, r, system.ks[i] > 0)


@compiled
def _add_rows(
    lu: Real, columns: Real, row: int, column: int, here: int, r: complex, has_sine: bool
) -> None:  # fmt: skip
    """Add what forces of one harmonic at a port bring about through the motion r of another one."""
    real, imag = r.real, r.imag
    if not has_sine:
        for j in range(columns.shape[1]):
            lu[row, column + j] += real * columns[here, j]
        return
    for j in range(columns.shape[1]):
        cosine, sine = columns[here, j], columns[here + 1, j]
        lu[row, column + j] += real * cosine - imag * sine
        lu[row + 1, column + j] += imag * cosine + real * sine


@apart
def _times(
    system: System, point: Evaluation, rows: Integer, columns: Integer, transposed: bool, x: Real,
    sign: float, y: Real,
) -> None:  # fmt: skip
    """Add sign · (`responses` of `rows` to `columns`) x to y, or its transpose; x and y are of all ports."""
    n = coefficient_count(system.ks)
    for i in range(system.ks.size):
        here, has_sine = cosine_position(system.ks, i), system.ks[i] > 0
        for c in rows:
            total = complex(0.0)
            for d in columns:
                at = d * n + here
                value = complex(x[at], -x[at + 1] if has_sine else 0.0)
                entry = point.responses[i, d, c].conjugate() if transposed else point.responses[i, c, d]
                total += entry * value
            at = c * n + here
            y[at] += sign * total.real
            if has_sine:
                y[at + 1] -= sign * total.imag


@compiled
def _settled(system: System, point: Evaluation, x: Real, y: Real) -> None:
    """Fill y = T x: the motions left of x once the ports eliminated have answered it."""
    n, held = coefficient_count(system.ks), point.counts[HELD]
    kept, gone = point.free[: point.counts[FREE]], point.held[:held]
    copy_to(y, x)
    if held > 0:
        for h in gone:
            fill(y[h * n : (h + 1) * n], 0.0)
        _times(system, point, gone, gone, False, x, 1.0, y)
        _times(system, point, kept, gone, False, x, -1.0, y)


@compiled
def _gather(n: int, ports: Integer, source: Real, target: Real) -> None:
    """Copy the coefficients of some ports to the front of `target`."""
    for a in range(ports.size):
        copy_to(target[a * n : (a + 1) * n], source[ports[a] * n : (ports[a] + 1) * n])


@compiled
def _dot_of(n: int, ports: Integer, one: Real, other: Real) -> float:
    """Return the scalar product of the coefficients of some ports."""
    total = 0.0
    for c in ports:
        total += dot(one[c * n : (c + 1) * n], other[c * n : (c + 1) * n])
    return total


@compiled
def _spread(n: int, ports: Integer, source: Real, target: Real) -> None:
    """Copy them back."""
    for a in range(ports.size):
        copy_to(target[ports[a] * n : (ports[a] + 1) * n], source[a * n : (a + 1) * n])


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
    point.counts[AT_BRANCH_POINT] = 0
    if point.border.size >= BANDED_FROM:
        sign = factorise_banded(system, linear, point, tangent, weight_u, weight_p)
        if not math.isnan(sign):
            return sign
    _part(system, point)
    take_slopes(system, point)
    if not _eliminate(system, linear, point):
        return 0.0
    if point.counts[MIXED] == 0:
        _assemble(system, point)
    else:
        _assemble_mixed(system, point)
    size = point.counts[FREE] * coefficient_count(system.ks)
    if weight_p > 0.0:
        _border(system, point, tangent, weight_u, weight_p)
        size += 1
    point.counts[SIZE] = size
    return 1.0 if size == 0 else factorise_block(point.lu, size, point.pivots)


@apart
def _border(system: System, point: Evaluation, tangent: Real, weight_u: float, weight_p: float) -> None:
    """Put dr/dλ and the tangent, of motions or forces, around the leading block of the factors.

    That of forces is scaled to 1: pivots are chosen among equations.
    """
    n, nt, lu = coefficient_count(system.ks), point.border.size, point.lu
    kept, gone = point.free[: point.counts[FREE]], point.held[: point.counts[HELD]]
    corner, end, along = weight_p * tangent[nt], kept.size * n, np.zeros(nt)
    _settled(system, point, point.dr_dp, point.settled[:nt])
    for i in range(nt):
        point.border[i] = weight_u * tangent[i]
    forces = point.work[0, :nt]
    if point.counts[MIXED] == 0:
        fill(forces, 0.0)
        if gone.size > 0:
            _times(system, point, kept, gone, True, point.border, 1.0, along)
            slopes_times(system, point, True, along, forces)
        for a in range(kept.size):
            for i in range(n):
                at = kept[a] * n + i
                lu[a * n + i, end], lu[end, a * n + i] = point.settled[at], point.border[at] - forces[at]
        lu[end, end] = corner - _dot_of(n, gone, point.border, point.settled)
        return
    corner -= dot(point.border, point.settled[:nt])
    slopes_times(system, point, False, point.settled[:nt], forces)
    _gather(n, kept, forces, lu[end])
    _times(system, point, kept, kept, True, point.border, -1.0, along)
    _times(system, point, kept, gone, True, point.border, -1.0, along)
    _gather(n, kept, along, forces)
    most = max(largest_entry(forces[:end]), abs(corner))
    scale = 1.0 / most if most > 0.0 else 1.0
    for i in range(end):
        lu[i, end] = scale * forces[i]
    lu[end, end], point.settled[nt] = scale * corner, scale


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
    if point.counts[BANDED] > 0:
        step_banded(system, point, x)
        return
    n, nt, size = coefficient_count(system.ks), point.border.size, point.counts[SIZE]
    kept, gone = point.free[: point.counts[FREE]], point.held[: point.counts[HELD]]
    end, motions, forces, rhs = kept.size * n, point.work[0, :nt], point.work[1, :nt], point.work[2]
    _settled(system, point, x[:nt], motions)
    mixed = point.counts[MIXED] == 1
    if mixed:
        slopes_times(system, point, False, motions, forces)
        _gather(n, kept, forces, rhs)
        if size > end:
            rhs[end] = (x[nt] - dot(point.border, motions)) * point.settled[nt]
        back_substitute_transposed(point.lu, size, point.pivots, rhs)
        _spread(n, kept, rhs, forces)
    else:
        _gather(n, kept, motions, rhs)
        if size > end:
            rhs[end] = x[nt] - _dot_of(n, gone, point.border, motions)
        back_substitute(point.lu, size, point.pivots, rhs)
    copy_to(x[:nt], motions)
    if size > end:
        x[nt] = rhs[end]
        set_to(x[:nt], motions, -rhs[end], point.settled)
    if mixed:
        _times(system, point, kept, kept, False, forces, -1.0, x)
    else:
        _spread(n, kept, rhs, x)
        if gone.size > 0:
            fill(motions, 0.0)
            _spread(n, kept, rhs, motions)
            slopes_times(system, point, False, motions, forces)
    if gone.size > 0:
        _times(system, point, gone, kept, False, forces, -1.0, x)


@apart
def step_back_transposed(system: System, point: Evaluation, x: Real) -> None:
    """Solve with the transpose of what `factorise` factorised without a border, in place.

    λ = Tᵀ (b − G_fᵀ (I + G_f R)⁻ᵀ Rᵀ b), or Tᵀ (λ_f, b_h) with (I + R G)ᵀ λ_f = b_f − Gᵀ R_hfᵀ b_h.

    Parameters
    ----------
    x : (nt,) the right-hand side.
    """
    if point.pushed.shape[1] > 0:
        step_in_coordinates_transposed(system, point, x)
        return
    if point.counts[BANDED] > 0:
        step_banded_transposed(system, point, x)
        return
    n, nt, size = coefficient_count(system.ks), x.size, point.counts[SIZE]
    kept, gone = point.free[: point.counts[FREE]], point.held[: point.counts[HELD]]
    forces, motions, rhs = point.work[0, :nt], point.work[1, :nt], point.work[2]
    fill(forces, 0.0)
    _times(system, point, kept, gone, True, x, 1.0, forces)
    if point.counts[MIXED] == 0:
        slopes_times(system, point, True, forces, motions)
        set_to(motions, x, -1.0, motions)
        _gather(n, kept, motions, rhs)
        back_substitute_transposed(point.lu, size, point.pivots, rhs)
        copy_to(motions, x)
        _spread(n, kept, rhs, motions)
    else:
        _times(system, point, kept, kept, True, x, 1.0, forces)
        _gather(n, kept, forces, rhs)
        back_substitute(point.lu, size, point.pivots, rhs)
        fill(forces, 0.0)
        _spread(n, kept, rhs, forces)
        slopes_times(system, point, True, forces, motions)
        set_to(motions, x, -1.0, motions)
    _settled_transposed(system, point, motions, x)


@compiled
def _settled_transposed(system: System, point: Evaluation, x: Real, y: Real) -> None:
    """Fill y = Tᵀ x."""
    n, held = coefficient_count(system.ks), point.counts[HELD]
    kept, gone = point.free[: point.counts[FREE]], point.held[:held]
    copy_to(y, x)
    for h in gone:
        fill(y[h * n : (h + 1) * n], 0.0)
    _times(system, point, gone, gone, True, x, 1.0, y)
    _times(system, point, gone, kept, True, x, -1.0, y)
