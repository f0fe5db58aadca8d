"""Coefficients of the force under a circular limit, and their derivatives, from the path and its nodes.

The force is continuous everywhere, so the begins and ends of sticks and slips drop out of ∫ δt e; what is
left is δt at a fixed time. It is followed backwards (adjoint): ψ(τ) says what a change of the force at τ adds
to the integrals from there on, for all of them at once.

- stick: δt = δt(τs) + δX − δX(τs); after separation the begin moves with N: δt(τs) = −t' δτs, δτs = −δL/L'.
- begin of a slip: δτ = (δL − n·δt)/q and t' jumps by −Kλn, K ∝ diag(1, 1/κ), qn = …, so that q cancels:
  L δθ = m·δt + along (δL − n·δt), see `solver.contacts.kernels.circle.path.projection`.
- slip: the collocation of its panel, linearised; its transpose is solved for all integrals together.
- where contact begins with a slip, δθ is the regular solution: (∂F/∂θ) δθ = g θ' δL − δF.
- over a period that repeats, ψ at the end is ψ at the begin: two unknowns, two more rows in the sweep.

Real or complex as `solver.contacts.kernels.circle.panels`. Derivation by ourselves.
"""

from __future__ import annotations

import math

import numpy as np

from solver.contacts.kernels.circle.circle_adjoint import (
    STUCK_COS,
    STUCK_SIN,
    panel_back,
)
from solver.contacts.kernels.circle.circle_state import CLOSES, SETTLES
from solver.contacts.kernels.circle.panels import (
    NODES,
    STAGES,
    WEIGHTS,
    Array,
    Number,
    X,
    Y,
    curves_at,
    turning,
)
from solver.contacts.kernels.circle.path import projection
from solver.contacts.kernels.coulomb.line_force import add_moments, bases_at, basis_at, moment_rows, products
from solver.contacts.kernels.stick_slip_events import AFTER_SEPARATION, STICK, UNLOADED
from solver.jit.decorators import compiled
from solver.jit.fourier import Integer, Real, coefficient_count
from solver.jit.kernel_records import Records, Row
from solver.jit.lapack import fill_block
from solver.jit.separate import apart


@compiled
def pack(wave: Array, ks: Integer, q: Array) -> None:
    """Fill q with the coefficients for `ks` of a curve kept as cosines and sines."""
    here = 0
    for i in range(ks.size):
        q[here] = wave[0, ks[i]]
        here += 1
        if ks[i] > 0:
            q[here] = wave[1, ks[i]]
            here += 1


@apart
def circle_force(
    waves: Real,
    kappa: float,
    ks: Integer,
    all_ks: Integer,
    found: Records,
    pieces: Records,
    panels: Records,
    F: Real,
) -> None:
    """Fill F (2, n); arguments as of `solver.contacts.kernels.circle.circle_gradient.circle_gradient`."""
    n, size, count = F.shape[1], coefficient_count(all_ks), found[0].pieces
    sums, here = np.zeros((2, ks[-1] + all_ks[-1] + 1)), np.empty((2, ks[-1] + all_ks[-1] + 1))
    moment, block, packed = np.empty(n), np.empty((n, size)), np.empty((2, size))
    fill_block(F, 0.0)
    for index in range(count - 1 if found[0].how == SETTLES else 0, count):
        row = pieces[index]
        if row.motion != STICK:
            for p in range(row.first, row.first + row.count):
                _add_panel(waves, ks, panels[p], moment, F)
            continue
        fill_block(here, 0.0)
        add_moments(row.begin, row.end, 1.0, here[0], here[1])
        moment_rows(here[0], here[1], ks, moment)
        for q in range(sums.shape[1]):
            sums[STUCK_COS, q] += here[0, q]
            sums[STUCK_SIN, q] += here[1, q]
        at = curves_at(waves, row.begin)
        offset_x, offset_y = row.tx - at.x, row.ty - at.y / kappa
        for i in range(n):
            F[0, i] += offset_x * moment[i]
            F[1, i] += offset_y * moment[i]
    products(sums[STUCK_COS], sums[STUCK_SIN], ks, all_ks, 1.0, block)
    pack(waves[X], all_ks, packed[X])
    pack(waves[Y], all_ks, packed[Y])
    for i in range(n):
        x, y = 0.0, 0.0
        for j in range(size):
            x += block[i, j] * packed[X, j]
            y += block[i, j] * packed[Y, j]
        F[0, i] += x
        F[1, i] += y / kappa


@compiled
def _add_panel(waves: Real, ks: Integer, panel: Row, e: Real, F: Real) -> None:
    """Add the integrals of L (cos θ, sin θ) over a panel."""
    begin, h = panel.begin, panel.end - panel.begin
    for i in range(STAGES):
        tau, theta = begin + h * NODES[i], panel.theta[i]
        at = curves_at(waves, tau)
        basis_at(tau, ks, e)
        if ks[0] == 0:
            e[0] *= 0.5
        share = h * WEIGHTS[i] * at.limit / math.pi
        along, across = share * math.cos(theta), share * math.sin(theta)
        for j in range(e.size):
            F[0, j] += along * e[j]
            F[1, j] += across * e[j]


@compiled
def _add_row(G: Array, column: int, psi: Array, factor: Number, e: Array) -> None:
    """Add factor · psi ⊗ e to the columns of G from `column`."""
    for r in range(psi.size):
        share = factor * psi[r]
        for j in range(e.size):
            G[r, column + j] += share * e[j]


@apart
def _stick_back(
    waves: Array, kappa: Number, ks: Integer, all_ks: Integer, row: Row, active: bool, weights: Array,
    of_motion: Integer, psi: Array, sums: Array, F: Array, G: Array,
) -> None:  # fmt: skip
    """Go back over a stick: ψ at its begin from ψ at its end."""
    m, n, dtype = psi.shape[1], of_motion.size, waves.dtype
    size = all_ks.size * 2 - (1 if all_ks[0] == 0 else 0)
    e, de, moment = np.empty(size, dtype), np.empty(size, dtype), np.empty(n, dtype)
    at = curves_at(waves, row.end)
    bases_at(row.end, all_ks, e, de)
    _add_row(G, 0, psi[0], 1.0, e)
    _add_row(G, size, psi[1], 1.0 / kappa, e)
    for r in range(m):
        G[r, 3 * size] -= psi[1, r] * at.y / (kappa * kappa)
    at = curves_at(waves, row.begin)
    bases_at(row.begin, all_ks, e, de)
    if active:
        here = np.zeros((2, sums.shape[1]), dtype)
        add_moments(row.begin, row.end, 1.0, here[0], here[1])
        moment_rows(here[0], here[1], ks, moment)
        for q in range(sums.shape[1]):
            sums[STUCK_COS, q] += here[0, q]
            sums[STUCK_SIN, q] += here[1, q]
        offset_x, offset_y = row.tx - at.x, row.ty - at.y / kappa
        for i in range(n):
            F[0, i] += offset_x * moment[i]
            F[1, i] += offset_y * moment[i]
        if weights.shape[0] == 0:
            for i in range(n):
                psi[0, i] += moment[i]
                psi[1, n + i] += moment[i]
        else:
            for r in range(weights.shape[0]):
                for i in range(n):
                    psi[0, r] += weights[r, 0, i] * moment[i]
                    psi[1, r] += weights[r, 1, i] * moment[i]
    _add_row(G, 0, psi[0], -1.0, e)
    _add_row(G, size, psi[1], -1.0 / kappa, e)
    for r in range(m):
        G[r, 3 * size] += psi[1, r] * at.y / (kappa * kappa)
    if row.began == AFTER_SEPARATION:
        _add_row(G, 2 * size, psi[0], at.dx / at.dlimit, e)
        _add_row(G, 2 * size, psi[1], at.dy / (kappa * at.dlimit), e)


@apart
def _contact_back(
    waves: Array, kappa: Number, all_ks: Integer, tau: Number, theta: Number, eta: Array, G: Array
) -> None:
    """Go back over the begin of a slip where contact begins: δθ of the regular solution."""
    size = (G.shape[1] - 1) // 3
    e, de = np.empty(size, waves.dtype), np.empty(size, waves.dtype)
    at = curves_at(waves, tau)
    bases_at(tau, all_ks, e, de)
    _, slope, g, _ = turning(at, kappa, theta)
    c, s = np.cos(theta), np.sin(theta)
    more = (kappa - 1.0) * s * c
    # L θ' g = F, differentiated where L = 0.
    rate = (c * at.ddy - s * at.ddx - more * at.ddlimit) / (at.dlimit * g - slope)
    _add_row(G, 0, eta, s / slope, de)
    _add_row(G, size, eta, -c / slope, de)
    _add_row(G, 2 * size, eta, g * rate / slope, e)
    _add_row(G, 2 * size, eta, more / slope, de)
    for r in range(eta.size):
        G[r, 3 * size] += eta[r] * s * c * at.dlimit / slope


@apart
def _slip_begin(
    waves: Array, kappa: Number, all_ks: Integer, tau: Number, theta: Number, after_stick: bool, eta: Array,
    psi: Array, G: Array,
) -> None:  # fmt: skip
    """Turn η at the begin of a slip into ψ of the force before it."""
    at = curves_at(waves, tau)
    px, py, along = projection(kappa, theta)
    if not after_stick:
        px, py = -np.sin(theta), np.cos(theta)
    for r in range(eta.size):
        psi[0, r], psi[1, r] = px * eta[r] / at.limit, py * eta[r] / at.limit
    if after_stick and kappa != 1.0:
        size = (G.shape[1] - 1) // 3
        e, de = np.empty(size, waves.dtype), np.empty(size, waves.dtype)
        bases_at(tau, all_ks, e, de)
        _add_row(G, 2 * size, eta, along / at.limit, e)


@apart
def _slip_end(
    waves: Array, all_ks: Integer, tau: Number, theta: Number, psi: Array, eta: Array, G: Array
) -> None:
    """Turn ψ of the force L n at the end of a slip into η of its direction; L has its own part."""
    size = (G.shape[1] - 1) // 3
    e, de = np.empty(size, waves.dtype), np.empty(size, waves.dtype)
    at = curves_at(waves, tau)
    bases_at(tau, all_ks, e, de)
    c, s = np.cos(theta), np.sin(theta)
    for r in range(eta.size):
        eta[r] = at.limit * (c * psi[1, r] - s * psi[0, r])
    _add_row(G, 2 * size, psi[0], c, e)
    _add_row(G, 2 * size, psi[1], s, e)


@apart
def _unloaded_back(waves: Array, kappa: Number, all_ks: Integer, cut: bool, psi: Array, G: Array) -> None:
    """Go back over τ = 0, where the force is that of the unloaded state, cut to the limit if it is beyond."""
    size = (G.shape[1] - 1) // 3
    e, de = np.empty(size, waves.dtype), np.empty(size, waves.dtype)
    at = curves_at(waves, 0.0 * waves[0, 0, 0])
    bases_at(0.0 * waves[0, 0, 0], all_ks, e, de)
    tx, ty = at.x, at.y / kappa
    if cut:
        length = np.sqrt(tx * tx + ty * ty)
        nx, ny = tx / length, ty / length
        share = at.limit / length
        for r in range(psi.shape[1]):
            along = nx * psi[0, r] + ny * psi[1, r]
            for j in range(size):
                G[r, 2 * size + j] += along * e[j]
            psi[0, r], psi[1, r] = share * (psi[0, r] - along * nx), share * (psi[1, r] - along * ny)
    _add_row(G, 0, psi[0], 1.0, e)
    _add_row(G, size, psi[1], 1.0 / kappa, e)
    for r in range(psi.shape[1]):
        G[r, 3 * size] -= psi[1, r] * at.y / (kappa * kappa)


@apart
def _linear_parts(
    packed: Array, kappa: Number, ks: Integer, all_ks: Integer, of_motion: Integer, weights: Array,
    sums: Array, F: Array, G: Array,
) -> None:  # fmt: skip
    """Add what the sums give: X and Y in sticks, L n in slips."""
    n, size = of_motion.size, packed.shape[1]
    block = np.empty((n, size), packed.dtype)
    for part in range(3):
        products(sums[2 * part], sums[2 * part + 1], ks, all_ks, 1.0, block)
        if part > 0:
            _add_block(block, weights, part - 1, 2 * size, 1.0, G)
            continue
        _add_block(block, weights, 0, 0, 1.0, G)
        _add_block(block, weights, 1, size, 1.0 / kappa, G)
        for x in range(2):
            for i in range(n):
                total = block[i, 0] * packed[x, 0]
                for j in range(1, size):
                    total += block[i, j] * packed[x, j]
                F[x, i] += total if x == 0 else total / kappa
                if x == 1 and weights.shape[0] == 0:
                    G[n + i, 3 * size] -= total / (kappa * kappa)
                elif x == 1:
                    for r in range(weights.shape[0]):
                        G[r, 3 * size] -= weights[r, 1, i] * total / (kappa * kappa)


@compiled
def _add_block(block: Array, weights: Array, component: int, column: int, factor: Number, G: Array) -> None:
    """Add factor · (weights of a component) · block to the columns of G from `column`."""
    n, size = block.shape
    if weights.shape[0] == 0:
        for i in range(n):
            for j in range(size):
                G[component * n + i, column + j] += factor * block[i, j]
        return
    for r in range(weights.shape[0]):
        for i in range(n):
            share = factor * weights[r, component, i]
            for j in range(size):
                G[r, column + j] += share * block[i, j]


@compiled
def _close(psi: Array, rows: int, G: Array) -> None:
    """Let ψ at the end of the period be ψ at its begin; the last two rows are of ψ = (1, 0) and (0, 1)."""
    a, b = psi[0, rows], psi[0, rows + 1]
    c, d = psi[1, rows], psi[1, rows + 1]
    determinant = (1.0 - a) * (1.0 - d) - b * c
    for r in range(rows):
        x = ((1.0 - d) * psi[0, r] + b * psi[1, r]) / determinant
        y = (c * psi[0, r] + (1.0 - a) * psi[1, r]) / determinant
        for j in range(G.shape[1]):
            G[r, j] += x * G[rows, j] + y * G[rows + 1, j]


@apart
def circle_gradient(
    waves: Array, kappa: Number, ks: Integer, all_ks: Integer, of_motion: Integer, found: Records,
    pieces: Records, panels: Records, weights: Array, F: Array, G: Array,
) -> None:  # fmt: skip
    """Fill the force coefficients and their gradient from a path.

    Parameters
    ----------
    waves, found, pieces, panels : as `solver.contacts.kernels.circle.circle_state.find_path` leaves them.
    ks : harmonics of the force; all_ks : those of X, Y and L together; of_motion : (n,) where the
        coefficients of the first stand among the second.
    weights : (m, 2, n) of the coefficients; with m = 0 every coefficient has a row of its own, first those of
        the first direction.
    F : (2, n), filled.
    G : (rows + 2, 3·size + 1), filled: derivatives by the coefficients of X, Y and L and by κ; the last two
        rows are scratch.
    """
    dtype, size = waves.dtype, (G.shape[1] - 1) // 3
    rows, count = G.shape[0] - 2, found[0].pieces
    psi, eta = np.zeros((2, rows + 2), dtype), np.zeros(rows + 2, dtype)
    sums = np.zeros((6, ks[-1] + all_ks[-1] + 1), dtype)
    nodes, used = STAGES * found[0].panels, 0
    table, adjoint = np.empty((nodes, 3 * size + 1), dtype), np.empty((nodes, rows + 2), dtype)
    packed = np.empty((3, size), dtype)
    for x in range(3):
        pack(waves[x], all_ks, packed[x])
    fill_block(G, 0.0)
    fill_block(F, 0.0)
    if found[0].how == CLOSES:
        psi[0, rows], psi[1, rows + 1] = 1.0, 1.0
    for index in range(count - 1, -1, -1):
        row = pieces[index]
        active = found[0].how != SETTLES or index == count - 1
        if index + 1 < count and pieces[index + 1].begin != row.end:
            fill_block(psi, 0.0)
        follows = index > 0 and pieces[index - 1].end == row.begin
        if row.motion == STICK:
            _stick_back(waves, kappa, ks, all_ks, row, active, weights, of_motion, psi, sums, F, G)
            continue
        last = row.first + row.count - 1
        if last < row.first:
            continue
        _slip_end(waves, all_ks, row.end, panels[last].theta[STAGES - 1], psi, eta, G)
        for p in range(last, row.first - 1, -1):
            here = slice(used, used + STAGES)
            panel_back(
                packed, kappa, all_ks, panels[p], weights, of_motion, active, eta, sums, F, table[here],
                adjoint[here],
            )  # fmt: skip
            used += STAGES
        theta = panels[row.first].start
        if not follows and row.began == AFTER_SEPARATION:
            _contact_back(waves, kappa, all_ks, row.begin, theta, eta, G)
            fill_block(psi, 0.0)
            continue
        after_stick = follows and pieces[index - 1].motion == STICK
        _slip_begin(waves, kappa, all_ks, row.begin, theta, after_stick, eta, psi, G)
    G += np.dot(adjoint[:used].T, table[:used])
    _linear_parts(packed, kappa, ks, all_ks, of_motion, weights, sums, F, G)
    if found[0].how == CLOSES:
        _close(psi, rows, G)
    elif found[0].how == SETTLES:
        _unloaded_back(waves, kappa, all_ks, pieces[0].began != UNLOADED, psi, G)
