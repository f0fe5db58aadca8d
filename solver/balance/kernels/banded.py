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
from solver.contacts.kernels.system import BANDED, SIZE, UNHELD, Evaluation, Receptance, System
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
    n, nt = coefficient_count(system.ks), point.border.size
    if point.counts[BANDED] < 0 or point.counts[UNHELD] > 0:
        point.counts[BANDED] = min(point.counts[BANDED], 0)
        return NOT_BANDED
    sign, reach = _stiffness_of_ports(system, linear, point), 0
    if sign != 0.0:
        reach = _reach(system, point)
    side = max(reach * n + 1, _of_contacts(system) * n - 1)
    if sign == 0.0 or _NARROW * side > nt:
        point.counts[BANDED] = -1
        return NOT_BANDED
    take_slopes(system, point)
    _assemble(system, point, side)
    sign *= factorise_band(point.lu, nt, side, point.pivots)
    point.counts[BANDED], point.counts[SIZE], point.settled[nt] = 1, side, 0.0
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
    nt, side = point.border.size, point.counts[SIZE]
    _solve(system, point, x[:nt], side)
    if x.size > nt and point.settled[nt] != 0.0:
        x[nt] = (x[nt] - dot(point.border, x[:nt])) / point.settled[nt]
        set_to(x[:nt], x[:nt], -x[nt], point.settled)


@apart
def step_banded_transposed(system: System, point: Evaluation, x: Real) -> None:
    """Solve with the transpose of dr/du, x (nt,) in place."""
    forces = point.work[0, : x.size]
    copy_to(forces, x)
    solve_band(point.lu, x.size, point.counts[SIZE], point.pivots, True, forces)
    _stiffness_times(system, point, point.counts[SIZE], True, forces, x)


@compiled
def _solve(system: System, point: Evaluation, x: Real, side: int) -> None:
    forces = point.work[0, : x.size]
    _stiffness_times(system, point, side, False, x, forces)
    copy_to(x, forces)
    solve_band(point.lu, x.size, side, point.pivots, False, x)


@compiled
def _of_contacts(system: System) -> int:
    """Return the most ports that a contact has."""
    most = 0
    for e in range(system.laws.size):
        most = max(most, system.first_port[e + 1] - system.first_port[e])
    return most


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
def _reach(system: System, point: Evaluation) -> int:
    """Return how many ports on A⁻¹ couples any two; what is left beyond is rounding."""
    reach, nc = 0, system.owner.size
    for i in range(system.ks.size):
        B = point.responses[i]
        for c in range(nc):
            for d in range(nc):
                size = abs(B[c, d].real) + abs(B[c, d].imag)
                if abs(c - d) > reach and size > _NOTHING * math.sqrt(abs(B[c, c]) * abs(B[d, d])):
                    reach = abs(c - d)
    return reach


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

    Entry (i, j) stands in row i and column j − i + side of `band`, which has room for 3 · side + 1.

    Returns
    -------
    The sign of the determinant, 0.0 if the matrix is singular or not finite.
    """
    sign, end = 1.0, 0
    for k in range(n):
        below = min(k + side, n - 1)
        pivot, size = k, abs(band[k, side])
        for r in range(k + 1, below + 1):
            here = abs(band[r, k - r + side])
            if here > size:
                pivot, size = r, here
        if not (size > 0.0 and math.isfinite(size)):
            return 0.0
        pivots[k], end = pivot, max(end, min(pivot + side, n - 1))
        if pivot != k:
            sign = -sign
            shift = k - pivot
            for j in range(side, end - k + side + 1):
                band[k, j], band[pivot, j + shift] = band[pivot, j + shift], band[k, j]
        if band[k, side] < 0.0:
            sign = -sign
        _subtract(band, k, below, end, side)
    return sign


@compiled
def _subtract(band: Real, k: int, below: int, end: int, side: int) -> None:
    """Subtract row k, from its pivot to column `end`, from those below that have an entry in column k."""
    count, inverse = end - k, 1.0 / band[k, side]
    above = band[k, side + 1 : side + 1 + count]
    for r in range(k + 1, below + 1):
        at = k - r + side
        factor = band[r, at] * inverse
        band[r, at] = factor
        if factor != 0.0:
            row = band[r, at + 1 : at + 1 + count]
            for j in range(count):
                row[j] -= factor * above[j]


@apart
def solve_band(band: Real, n: int, side: int, pivots: Index, transposed: bool, x: Real) -> None:
    """Solve with the factors of `factorise_band`, or with their transpose; x in place."""
    if transposed:
        for k in range(n):
            x[k] /= band[k, side]
            for j in range(1, min(2 * side, n - 1 - k) + 1):
                x[k + j] -= band[k, side + j] * x[k]
        for k in range(n - 1, -1, -1):
            for r in range(k + 1, min(k + side, n - 1) + 1):
                x[k] -= band[r, k - r + side] * x[r]
            x[k], x[pivots[k]] = x[pivots[k]], x[k]
        return
    for k in range(n):
        x[k], x[pivots[k]] = x[pivots[k]], x[k]
        for r in range(k + 1, min(k + side, n - 1) + 1):
            x[r] -= band[r, k - r + side] * x[k]
    for k in range(n - 1, -1, -1):
        total = x[k]
        for j in range(1, min(2 * side, n - 1 - k) + 1):
            total -= band[k, side + j] * x[k + j]
        x[k] = total / band[k, side]
