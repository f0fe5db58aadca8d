"""One panel of a slip under a circular limit: the direction of the force by collocation.

With X = k1 u and Y = k1 w [N], the limit L = μN, the force L (cos θ, sin θ) and κ = k1/k2 the law of slip

    t1' = X' − k1 λ cos θ,   t2' = (Y' − k1 λ sin θ)/κ,   |t| = L,   λ ≥ 0

(the slider moves along the force: the rule associated with the circle) has λ eliminated the one equation

    R = L g θ' − F = 0,   g = κ cos²θ + sin²θ,   F = Y' cos θ − X' sin θ − (κ − 1) sin θ cos θ L',

and goes on while the rate of slip q = X' cos θ + Y' sin θ/κ − L' is positive. Written with the slopes of the
collocation polynomial, R has no pole where L becomes 0: there the force lies along the motion, F = 0.

Everything here takes real numbers or complex ones, whose imaginary parts carry a derivative along a
direction (complex step: W. Squire, G. Trapp, SIAM Rev. 40 (1998) 110).

Nodes, weights and derivatives are Radau's on the unit interval: with the right end among the nodes the method
is L-stable, and of order 2·STAGES − 1 at the end of a step and for integrals over it. E. Hairer, G. Wanner,
Solving Ordinary Differential Equations II (1996), section IV.5.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from solver.jit.decorators import compiled
from solver.jit.fourier import Real
from solver.jit.kernel_records import Records, Row, record
from solver.jit.separate import apart
from solver.jit.trig_polynomial import cosines_and_sines

STAGES = 10


def _nodes() -> Real:
    """Return the zeros of P_s − P_(s−1), moved from [−1, 1] to [0, 1]; the last one is 1."""
    series = np.zeros(STAGES + 1)
    series[-2:] = -1.0, 1.0
    roots = np.sort(legendre.legroots(series).real)
    slope = legendre.legder(series)
    for _ in range(3):
        roots = roots - legendre.legval(roots, series) / legendre.legval(roots, slope)
    roots[-1] = 1.0
    return np.asarray(0.5 * (1.0 + roots))


def _weights(nodes: Real) -> Real:
    """Return the weights with which the nodes integrate polynomials over [0, 1]."""
    moments = np.zeros(STAGES)
    moments[0] = 1.0
    return np.asarray(np.linalg.solve(legendre.legvander(2.0 * nodes - 1.0, STAGES - 1).T, moments))


def _barycentric(points: Real) -> Real:
    gaps = points[:, None] - points[None, :]
    np.fill_diagonal(gaps, 1.0)
    return np.asarray(1.0 / gaps.prod(axis=1))


def _derivatives(points: Real, share: Real) -> Real:
    """Return the matrix from values at `points` to the slopes of their polynomial at all but the first."""
    gaps = points[:, None] - points[None, :]
    np.fill_diagonal(gaps, 1.0)
    matrix = share[None, :] / share[:, None] / gaps
    np.fill_diagonal(matrix, 0.0)
    np.fill_diagonal(matrix, -matrix.sum(axis=1))
    return np.ascontiguousarray(matrix[1:])


def _last_terms(points: Real) -> Real:
    """Return the rows that give the last two Legendre coefficients of the polynomial through `points`."""
    return np.ascontiguousarray(np.linalg.inv(legendre.legvander(2.0 * points - 1.0, STAGES))[-2:])


NODES = _nodes()
WEIGHTS = _weights(NODES)
POINTS = np.concatenate([[0.0], NODES])  # the begin of a step and its nodes
SHARES = _barycentric(POINTS)
SLOPES = _derivatives(POINTS, SHARES)  # (STAGES, STAGES + 1)
TAIL = _last_terms(POINTS)  # (2, STAGES + 1)


@compiled
def between(start: float, stages: Real, place: float) -> float:
    """Return the polynomial through `start` and the values at the nodes at a place in [0, 1]."""
    above, below = 0.0, 0.0
    for i in range(STAGES + 1):
        value = start if i == 0 else stages[i - 1]
        gap = place - POINTS[i]
        if gap == 0.0:
            return value
        share = SHARES[i] / gap
        above += share * value
        below += share
    return above / below


@compiled
def tail(start: float, stages: Real) -> float:
    """Return the size of the last two Legendre coefficients of the polynomial through them."""
    last, before = TAIL[1, 0] * start, TAIL[0, 0] * start
    for i in range(STAGES):
        last += TAIL[1, i + 1] * stages[i]
        before += TAIL[0, i + 1] * stages[i]
    return max(abs(last), abs(before))


Array: TypeAlias = NDArray[Any]  # of real or of complex numbers
Number: TypeAlias = Any  # a real or a complex one

X, Y, LIMIT = 0, 1, 2  # rows of `waves`
# Columns of the matrix of a panel behind ∂R/∂θ: −R, which becomes Newton's step, and −∂R/∂θ0, which becomes
# ∂θ/∂θ0.
STEP, BY_START = STAGES, STAGES + 1
PANEL_MATRIX = STAGES, STAGES + 2
NEWTON_STEPS = 14
SMALL_TURN = 3e-6  # rad: Newton's step after which what is left is its square


class Curves(NamedTuple):
    """X, Y and L at a point, their slopes and curvatures by τ."""

    x: Number
    y: Number
    limit: Number
    dx: Number
    dy: Number
    dlimit: Number
    ddx: Number
    ddy: Number
    ddlimit: Number


CURVES = record(**dict.fromkeys(Curves._fields, np.float64))
CARRIED_CURVES = record(**dict.fromkeys(Curves._fields, np.complex128))


class PanelWork(NamedTuple):
    """Where a panel is solved."""

    nodes: Records  # (STAGES,) the curves at the nodes, `Curves` each
    angles: Array  # (3, STAGES) scratch: angles, their cosines and sines
    matrix: Array  # (PANEL_MATRIX)


@compiled
def new_panel_work() -> PanelWork:
    """Return room for a panel of real numbers."""
    return PanelWork(np.empty(STAGES, CURVES), np.empty((3, STAGES)), np.empty(PANEL_MATRIX))


@compiled
def curves_at(waves: Array, tau: Number) -> Curves:
    """Return X, Y and L, their slopes and curvatures; `waves` is (3, 2, degree + 1)."""
    cos1, sin1 = np.cos(tau), np.sin(tau)
    cosine, sine = cos1, sin1
    x, y, limit = waves[X, 0, 0], waves[Y, 0, 0], waves[LIMIT, 0, 0]
    dx = dy = dlimit = ddx = ddy = ddlimit = 0.0 * x
    for k in range(1, waves.shape[2]):
        a, b = waves[X, 0, k], waves[X, 1, k]
        a, b = a * cosine + b * sine, b * cosine - a * sine
        x, dx, ddx = x + a, dx + k * b, ddx - k * k * a
        a, b = waves[Y, 0, k], waves[Y, 1, k]
        a, b = a * cosine + b * sine, b * cosine - a * sine
        y, dy, ddy = y + a, dy + k * b, ddy - k * k * a
        a, b = waves[LIMIT, 0, k], waves[LIMIT, 1, k]
        a, b = a * cosine + b * sine, b * cosine - a * sine
        limit, dlimit, ddlimit = limit + a, dlimit + k * b, ddlimit - k * k * a
        cosine, sine = cosine * cos1 - sine * sin1, sine * cos1 + cosine * sin1
    return Curves(x, y, limit, dx, dy, dlimit, ddx, ddy, ddlimit)


@compiled
def _keep(at: Curves, row: Row) -> None:
    """Write what the curves are at a point to a record."""
    row.x, row.y, row.limit, row.dx, row.dy, row.dlimit = at.x, at.y, at.limit, at.dx, at.dy, at.dlimit
    row.ddx, row.ddy, row.ddlimit = at.ddx, at.ddy, at.ddlimit


@compiled
def _slopes_at_nodes(waves: Array, begin: Number, h: Number, work: PanelWork) -> None:
    """Fill in what directions turn by at the nodes of a panel: L and the slopes of X, Y and L."""
    nodes, angles, cosines, sines = work.nodes, work.angles[0], work.angles[1], work.angles[2]
    for i in range(STAGES):
        angles[i] = begin + h * NODES[i]
    cosines_and_sines(angles, cosines, sines)
    for i in range(0, STAGES, 2):
        # Two nodes at once: either waits for the last harmonic before it has the next one.
        a1, b1, c1, d1 = cosines[i], sines[i], cosines[i + 1], sines[i + 1]
        a, b, c, d = a1, b1, c1, d1
        load = more_load = waves[LIMIT, 0, 0]
        rise = dx = dy = more_rise = more_dx = more_dy = 0.0 * a1
        for k in range(1, waves.shape[2]):
            p, q = waves[LIMIT, 0, k], waves[LIMIT, 1, k]
            x, u, y, v = k * waves[X, 0, k], k * waves[X, 1, k], k * waves[Y, 0, k], k * waves[Y, 1, k]
            load += p * a + q * b
            rise += k * (q * a - p * b)
            dx += u * a - x * b
            dy += v * a - y * b
            more_load += p * c + q * d
            more_rise += k * (q * c - p * d)
            more_dx += u * c - x * d
            more_dy += v * c - y * d
            a, b = a * a1 - b * b1, b * a1 + a * b1
            c, d = c * c1 - d * d1, d * c1 + c * d1
        j = i + 1
        nodes[i].limit, nodes[i].dx, nodes[i].dy, nodes[i].dlimit = load, dx, dy, rise
        nodes[j].limit, nodes[j].dx, nodes[j].dy, nodes[j].dlimit = more_load, more_dx, more_dy, more_rise


@compiled
def turning(at: Curves, kappa: Number, theta: Number) -> tuple[Number, Number, Number, Number]:
    """Return F, ∂F/∂θ, g and ∂g/∂θ with the curves `at` a point."""
    return turning_by(at, kappa, np.cos(theta), np.sin(theta))


@compiled
def turning_by(at: Curves, kappa: Number, c: Number, s: Number) -> tuple[Number, Number, Number, Number]:
    """Return the same from cos θ and sin θ."""
    more = (kappa - 1.0) * at.dlimit
    F = c * at.dy - s * at.dx - more * s * c
    slope = -s * at.dy - c * at.dx - more * (c * c - s * s)
    return F, slope, kappa * c * c + s * s, -2.0 * (kappa - 1.0) * s * c


@compiled
def slip_rate(at: Curves, kappa: Number, theta: Number) -> Number:
    """Return q; the force slips on while it is positive."""
    return np.cos(theta) * at.dx + np.sin(theta) * at.dy / kappa - at.dlimit


@compiled
def onset_direction(at: Curves, kappa: float) -> float:
    """Return the direction in which a force begins to slip where contact begins, from the curves there.

    There t' = L' n, so n = (X'/(L' + Λ), Y'/(κL' + Λ)) with Λ > 0 from |n| = 1.
    """
    rise, dx, dy = at.dlimit, at.dx, at.dy
    if kappa == 1.0:
        return math.atan2(dy, dx)
    more = 0.0
    for _ in range(60):
        a, b = rise + more, kappa * rise + more
        size = (dx / a) ** 2 + (dy / b) ** 2
        slope = -2.0 * (dx * dx / a**3 + dy * dy / b**3)
        # Newton's method on 1/√size − 1, which is nearly linear.
        step = 2.0 * size * (1.0 - math.sqrt(size)) / slope
        more = max(more + step, 0.0)
        if abs(step) <= 1e-15 * (rise + more):
            break
    return math.atan2(dy / (kappa * rise + more), dx / (rise + more))


@compiled
def solve_columns(matrix: Array, right: Array) -> bool:
    """Solve matrix · x = right for all columns in place, by elimination without exchanges.

    Those of a panel are rows of Radau's derivatives scaled, plus a diagonal: while directions draw together
    it is positive, and entries grow at most twofold.
    """
    n, columns = matrix.shape[0], right.shape[1]
    for k in range(n):
        if not abs(matrix[k, k]) > 0.0:
            return False
        inverse = 1.0 / matrix[k, k]
        for i in range(k + 1, n):
            factor = matrix[i, k] * inverse
            for j in range(k + 1, n):
                matrix[i, j] -= factor * matrix[k, j]
            for j in range(columns):
                right[i, j] -= factor * right[k, j]
    for k in range(n - 1, -1, -1):
        inverse = 1.0 / matrix[k, k]
        for j in range(columns):
            right[k, j] *= inverse
        for i in range(k):
            factor = matrix[i, k]
            for j in range(columns):
                right[i, j] -= factor * right[k, j]
    return True


@compiled
def _solve_panel_matrix(matrix: Array) -> bool:
    """Solve as `solve_columns` for both columns behind the matrix of a panel, in place.

    A row is written out: it stays in registers while it is taken from those below.
    """
    for k in range(STAGES):
        p = matrix[k]
        if not abs(p[k]) > 0.0:
            return False
        inverse = 1.0 / p[k]
        p0, p1, p2, p3, p4, p5 = p[0], p[1], p[2], p[3], p[4], p[5]
        p6, p7, p8, p9, p10, p11 = p[6], p[7], p[8], p[9], p[10], p[11]
        for i in range(k + 1, STAGES):
            row = matrix[i]
            factor = row[k] * inverse
            row[0] -= factor * p0
            row[1] -= factor * p1
            row[2] -= factor * p2
            row[3] -= factor * p3
            row[4] -= factor * p4
            row[5] -= factor * p5
            row[6] -= factor * p6
            row[7] -= factor * p7
            row[8] -= factor * p8
            row[9] -= factor * p9
            row[10] -= factor * p10
            row[11] -= factor * p11
    for k in range(STAGES - 1, -1, -1):
        inverse = 1.0 / matrix[k, k]
        step, slope = matrix[k, STEP] * inverse, matrix[k, BY_START] * inverse
        matrix[k, STEP], matrix[k, BY_START] = step, slope
        for i in range(k):
            factor = matrix[i, k]
            matrix[i, STEP] -= factor * step
            matrix[i, BY_START] -= factor * slope
    return True


@compiled
def _fill_panel_matrix(work: PanelWork, kappa: Number, h: Number, theta0: Number, theta: Array) -> None:
    """Fill the matrix of a step of Newton's method from the curves at the nodes."""
    nodes, matrix, inverse = work.nodes, work.matrix, 1.0 / h
    cosines, sines = work.angles[1], work.angles[2]
    cosines_and_sines(theta, cosines, sines)
    for i in range(STAGES):
        F, slope, g, dg = turning_by(nodes[i], kappa, cosines[i], sines[i])
        rate = SLOPES[i, 0] * theta0
        for j in range(STAGES):
            rate += SLOPES[i, j + 1] * theta[j]
        row, factor = matrix[i], nodes[i].limit * g * inverse
        for j in range(STAGES):
            row[j] = factor * SLOPES[i, j + 1]
        row[i] += nodes[i].limit * dg * rate * inverse - slope
        row[STEP], row[BY_START] = F - factor * rate, -factor * SLOPES[i, 0]


@compiled
def _guess(nodes: Records, kappa: Number, h: Number, theta0: Number, theta: Array) -> None:
    """Fill `theta` with one linearly implicit step from node to node, backward where L is 0."""
    before, rate, place = theta0, 0.0 * theta0, 0.0
    for i in range(STAGES):
        F, slope, g, _ = turning(nodes[i], kappa, before)
        half = 0.5 * h * (NODES[i] - place)
        scale = nodes[i].limit * g
        if i == 0:
            half *= 2.0
        moved = half * (rate * scale + F) / (scale - half * slope) if slope.real < 0.0 else half * 0.0
        rate = (F + slope * moved) / scale if scale.real > 0.0 else 0.0 * rate
        before, place = before + moved, NODES[i]
        theta[i] = before


@apart
def solve_panel(
    waves: Array, kappa: Number, begin: Number, end: Number, theta0: Number, fresh: bool, theta: Array,
    work: PanelWork,
) -> bool:  # fmt: skip
    """Solve R = 0 at the nodes of [begin, end] by Newton's method from `theta`, or a `fresh` guess.

    On return the nodes have L and the slopes of X, Y and L, all curves at the last one, and the matrix has
    ∂θ/∂θ0 as its column BY_START. False if it fails.
    """
    h, nodes, matrix = end - begin, work.nodes, work.matrix
    _slopes_at_nodes(waves, begin, h, work)
    _keep(curves_at(waves, end), nodes[STAGES - 1])
    if fresh:
        _guess(nodes, kappa, h, theta0, theta)
    for _ in range(NEWTON_STEPS):
        _fill_panel_matrix(work, kappa, h, theta0, theta)
        if not _solve_panel_matrix(matrix):
            return False
        most = 0.0
        for i in range(STAGES):
            most = max(most, abs(matrix[i, STEP]))
        if not most < 1e6:
            return False
        share = 1.0 / max(most, 1.0)
        for i in range(STAGES):
            theta[i] += share * matrix[i, STEP]
        if most < SMALL_TURN:
            return True
    return False
