"""Factors of the Jacobian where each contact feels few others: banded, of the balance in forces.

dr/du = I + A G with the receptance A couples every port with every other one, but A⁻¹, the dynamic stiffness
that the ports see, couples those alone that stand side by side in the structure. So

  dr/du = A (A⁻¹ + G),  (A⁻¹ + G) δ = A⁻¹ b,

of which A⁻¹ + G has entries near its diagonal where the contacts follow each other along the structure: G is
of one contact. A border is eliminated block by block: with a = (dr/du)⁻¹ b and v = (dr/du)⁻¹ d
the solution of [dr/du d; tᵀ w] is δ = a − s v, s = (c − tᵀ a)/(w − tᵀ v). The determinant is the product of
those of A, positive in every harmonic but the mean, of A⁻¹ + G and of w − tᵀ v.
"""

from __future__ import annotations

import math

import numpy as np

from solver.balance.kernels.slopes import take_slopes
from solver.contacts.kernels.system import BANDED, HELD, SIZE, UNHELD, Evaluation, Receptance, System
from solver.jit.decorators import compiled
from solver.jit.fourier import Index, Real, coefficient_count, cosine_position
from solver.jit.lapack import copy_to, dot, invert, set_to
from solver.jit.lapack import factorise as factorise_block
from solver.jit.separate import apart

BANDED_FROM = 400  # unknowns from which a band pays
_NARROW = 6  # times in them that one side of it has to go
_NOTHING = 1e-9  # relative size of an entry of A⁻¹ that is rounding
NOT_BANDED = math.nan


@apart
def factorise_banded(
    system: System, linear: Receptance, point: Evaluation, tangent: Real, weight_u: float, weight_p: float
) -> float:
    """Factorise as `solver.balance.kernels.jacobian.factorise`, or return NaN where that has to."""
    nt = point.border.size
    if point.counts[BANDED] < 0 or point.counts[UNHELD] > 0:
        point.counts[BANDED] = min(point.counts[BANDED], 0)
        return NOT_BANDED
    sign = _stiffness_of_ports(system, linear, point)
    side = nt if sign == 0.0 else _side(system, point)
    if _NARROW * side > nt:
        point.counts[BANDED] = -1
        return NOT_BANDED
    take_slopes(system, point)
    _assemble(system, point, side)
    sign *= factorise_band(point.lu, nt, side, point.pivots)
    point.counts[BANDED], point.counts[SIZE], point.counts[HELD], point.settled[nt] = 1, nt, side, 0.0
    if sign != 0.0 and weight_p > 0.0:
        for i in range(nt):
            point.border[i] = weight_u * tangent[i]
        copy_to(point.settled[:nt], point.dr_dp)
        _solve(system, point, point.settled[:nt], side)
        left = weight_p * tangent[nt] - dot(point.border, point.settled[:nt])
        point.settled[nt] = left
        sign *= math.copysign(1.0, left) if left != 0.0 and math.isfinite(left) else 0.0
    return sign


@apart
def step_banded(system: System, point: Evaluation, x: Real) -> None:
    """Solve with these factors, in place; see `solver.balance.kernels.jacobian.step_back`."""
    nt, side = point.border.size, point.counts[HELD]
    _solve(system, point, x[:nt], side)
    if x.size > nt and point.settled[nt] != 0.0:
        x[nt] = (x[nt] - dot(point.border, x[:nt])) / point.settled[nt]
        set_to(x[:nt], x[:nt], -x[nt], point.settled)


@apart
def step_banded_transposed(system: System, point: Evaluation, x: Real) -> None:
    """Solve with the transpose of dr/du, x (nt,) in place."""
    forces, side = point.work[0, : x.size], point.counts[HELD]
    copy_to(forces, x)
    solve_band(point.lu, x.size, side, point.pivots, True, forces)
    _stiffness_times(system, point, side, True, forces, x)


@compiled
def _solve(system: System, point: Evaluation, x: Real, side: int) -> None:
    forces = point.work[0, : x.size]
    _stiffness_times(system, point, side, False, x, forces)
    copy_to(x, forces)
    solve_band(point.lu, x.size, side, point.pivots, False, x)


@apart
def _stiffness_of_ports(system: System, linear: Receptance, point: Evaluation) -> float:
    """Fill `point.responses` with A⁻¹ of all harmonics; return the sign of det A, 0.0 if one is singular."""
    nc, sign = system.owner.size, 1.0
    for i in range(system.ks.size):
        A = linear.A[0, i].copy()
        if system.ks[i] == 0:
            mean, pivots = np.empty((nc, nc)), np.empty(nc, np.int32)
            for c in range(nc):
                for d in range(nc):
                    mean[c, d] = A[c, d].real
            sign = factorise_block(mean, nc, pivots)
        if sign == 0.0 or not invert(A, point.responses[i]):
            return 0.0
    return sign


@compiled
def _side(system: System, point: Evaluation) -> int:
    """Return how many diagonals lie on either side: of contacts, and of A⁻¹ but for what is rounding."""
    n, nc, side, reach = coefficient_count(system.ks), system.owner.size, 0, 0
    own = point.work[0, :nc]
    for e in range(system.laws.size):
        side = max(side, (system.first_port[e + 1] - system.first_port[e]) * n - 1)
    for i in range(system.ks.size):
        B = point.responses[i]
        for c in range(nc):
            own[c] = math.sqrt(_NOTHING * abs(B[c, c]))
        for c in range(nc):
            for d in range(nc):
                if abs(c - d) > reach and abs(B[c, d].real) + abs(B[c, d].imag) > own[c] * own[d]:
                    reach = abs(c - d)
    return max(side, reach * n + 1)


@apart
def _assemble(system: System, point: Evaluation, side: int) -> None:
    """Fill the leading columns of the factors with the band of A⁻¹ + G, row i from column i − side on."""
    n, nc, band = coefficient_count(system.ks), system.owner.size, point.lu
    for row in range(nc * n):
        for j in range(3 * side + 1):
            band[row, j] = 0.0
    for c in range(nc):
        for d in range(max(c - side // n, 0), min(c + side // n + 1, nc)):
            for i in range(system.ks.size):
                here, entry = cosine_position(system.ks, i), point.responses[i, c, d]
                row, at = c * n + here, (d - c) * n + side
                band[row, at] = entry.real
                if system.ks[i] > 0:
                    band[row, at + 1], band[row + 1, at - 1] = entry.imag, -entry.imag
                    band[row + 1, at] = entry.real
    for e in range(system.laws.size):
        first, m = system.first_port[e], system.first_port[e + 1] - system.first_port[e]
        for a in range(m):
            for b in range(m):
                G = point.G[system.first_block[e] + a * m + b]
                for i in range(n):
                    at = (b - a) * n - i + side
                    for j in range(n):
                        band[(first + a) * n + i, at + j] += G[i, j]


@apart
def _stiffness_times(
    system: System, point: Evaluation, side: int, transposed: bool, x: Real, y: Real
) -> None:
    """Fill y = A⁻¹ x, or its transpose; x and y are of all ports."""
    n, nc = coefficient_count(system.ks), system.owner.size
    for i in range(system.ks.size):
        here, has_sine = cosine_position(system.ks, i), system.ks[i] > 0
        for c in range(nc):
            total = complex(0.0)
            for d in range(max(c - side // n, 0), min(c + side // n + 1, nc)):
                value = complex(x[d * n + here], -x[d * n + here + 1] if has_sine else 0.0)
                entry = point.responses[i, d, c].conjugate() if transposed else point.responses[i, c, d]
                total += entry * value
            y[c * n + here] = total.real
            if has_sine:
                y[c * n + here + 1] = -total.imag


@apart
def factorise_band(band: Real, n: int, side: int, pivots: Index) -> float:
    """Factorise a matrix with `side` diagonals on either side in place, rows exchanged.

    Entry (i, j) stands in row i and column j − i + side of `band`, which has room for 3 · side + 1. The first
    columns of a row then have the factors of its column. Two pivots at a time are subtracted from the rows
    below, which are read and written half as often.

    Returns
    -------
    The sign of the determinant, 0.0 if the matrix is singular or not finite.
    """
    sign, end, waiting = 1.0, 0, np.zeros(side + 1)
    for k in range(0, n, 2):
        end, turn = _exchange(band, n, k, end, side, pivots)
        sign *= turn
        c, below = k + 1, min(side, n - 1 - k)
        if turn == 0.0 or c == n:
            return sign
        for i in range(below):
            band[k, i] = waiting[i] = band[c + i, side - 1 - i] / band[k, side]
            band[c + i, side - i] -= waiting[i] * band[k, side + 1]
        waiting[below] = 0.0
        end, turn = _exchange(band, n, c, end, side, pivots)
        sign *= turn
        if turn == 0.0:
            return 0.0
        other = pivots[c] - c
        waiting[0], waiting[other] = waiting[other], waiting[0]
        # A row exchanged for the second pivot may reach one column beyond the room of the first one's.
        count = min(end - c, 2 * side - 1)
        first, second = band[k, side + 2 : side + 2 + count], band[c, side + 1 : side + 1 + count]
        set_to(second, second, -waiting[0], first)
        for i in range(min(side, n - 1 - c)):
            r, one = c + 1 + i, waiting[i + 1]
            two = band[c, i] = band[r, side - 1 - i] / band[c, side]
            row = band[r, side - i : side - i + count]
            for j in range(count):
                row[j] -= one * first[j] + two * second[j]
            if c + count < end:
                band[r, end - r + side] -= two * band[c, end - c + side]
    return sign


@compiled
def _exchange(band: Real, n: int, k: int, end: int, side: int, pivots: Index) -> tuple[int, float]:
    """Exchange row k for that of its pivot; the last column that rows now reach, and a factor of the sign."""
    pivot, size = k, abs(band[k, side])
    for r in range(k + 1, min(k + side, n - 1) + 1):
        here = abs(band[r, k - r + side])
        if here > size:
            pivot, size = r, here
    if not (size > 0.0 and math.isfinite(size)):
        return end, 0.0
    pivots[k], end = pivot, max(end, min(pivot + side, n - 1))
    if pivot != k:
        for j in range(side, end - k + side + 1):
            band[k, j], band[pivot, j + k - pivot] = band[pivot, j + k - pivot], band[k, j]
    return end, -1.0 if (band[k, side] < 0.0) != (pivot != k) else 1.0


@apart
def solve_band(band: Real, n: int, side: int, pivots: Index, transposed: bool, x: Real) -> None:
    """Solve with the factors of `factorise_band`, or with their transpose; x in place."""
    for k in range(n):
        if transposed:
            x[k] /= band[k, side]
            row = band[k, side + 1 : side + 1 + min(2 * side, n - 1 - k)]
        else:
            x[k], x[pivots[k]] = x[pivots[k]], x[k]
            row = band[k, : min(side, n - 1 - k)]
        set_to(x[k + 1 : k + 1 + row.size], x[k + 1 :], -x[k], row)
    for k in range(n - 1, -1, -1):
        if transposed:
            x[k] -= dot(band[k, : min(side, n - 1 - k)], x[k + 1 :])
            x[k], x[pivots[k]] = x[pivots[k]], x[k]
        else:
            x[k] -= dot(band[k, side + 1 : side + 1 + min(2 * side, n - 1 - k)], x[k + 1 :])
            x[k] /= band[k, side]
