"""Second derivatives of the force under a circular limit, contracted with weights, along a direction.

The gradient of `solver.contacts.kernels.circle.circle_gradient` is a formula of the path: of the times of its
events, the directions at its nodes and the curves. All of it is carried here into the complex plane, the
direction as a tiny imaginary part: events and nodes follow by Newton's method, and the imaginary part of the
gradient is its derivative, to rounding, without differences (W. Squire, G. Trapp, SIAM Rev. 40 (1998) 110).
The kernel behind the contract is `circle_law_second`.
"""

from __future__ import annotations

import math

import numpy as np

from solver.contacts.kernels.circle.circle_gradient import circle_gradient
from solver.contacts.kernels.circle.circle_law import curves_of, whole_path
from solver.contacts.kernels.circle.circle_state import CLOSES, FOUND, OPENS, SETTLES
from solver.contacts.kernels.circle.panels import (
    CARRIED_CURVES,
    PANEL_MATRIX,
    SLOPES,
    STAGES,
    Array,
    Number,
    PanelWork,
    curves_at,
    slip_rate,
    solve_panel,
    turning,
)
from solver.contacts.kernels.circle.path import CARRIED_PANEL, CARRIED_PIECE
from solver.contacts.kernels.columns import KN, KT, KT_SECOND, MU
from solver.contacts.kernels.coulomb.line_law import load_of, with_second
from solver.contacts.kernels.coulomb.second_law import through_load, tie_second
from solver.contacts.kernels.stick_slip_events import FAILED, SEPARATED, SLIP, STICK, UNLOADED
from solver.jit.decorators import compiled
from solver.jit.fourier import Integer, Real, coefficient_count, merged, positions
from solver.jit.kernel_records import Records, Row
from solver.jit.lapack import fill, fill_block
from solver.jit.separate import apart

TINY = 1e-30  # of the direction
ROUNDS = 4  # of Newton's method from a real solution, each of which all but squares what is left
# A stick that begins with contact and is so short [rad] ends where rounding says, force and limit both being
# all but 0: its end moves with its begin. What that leaves out is of the size of the force there.
SHORTEST = 1e-7


@compiled
def over(part: Number, whole: Number) -> Number:
    """Return a quotient, NaN by 0: there the motion is not smooth, and complex numbers would raise."""
    return part / whole if whole != 0.0 else complex(np.nan, np.nan)


@compiled
def _zero_of_limit(waves: Array, tau: Number) -> Number:
    """Move a time to where L is 0."""
    for _ in range(3):
        at = curves_at(waves, tau)
        tau -= over(at.limit, at.dlimit)
    return tau


@compiled
def _end_of_stick(waves: Array, kappa: Number, offset_x: Number, offset_y: Number, tau: Number) -> Number:
    """Move a time to where |t|² is L²."""
    for _ in range(ROUNDS):
        at = curves_at(waves, tau)
        tx, ty = offset_x + at.x, offset_y + at.y / kappa
        excess = tx * tx + ty * ty - at.limit * at.limit
        rise = 2.0 * (tx * at.dx + ty * at.dy / kappa - at.limit * at.dlimit)
        tau -= over(excess, rise)
    return tau


@compiled
def _direction(theta: float, tx: Number, ty: Number) -> Number:
    """Return the direction of (tx, ty), whose real part is near `theta`; NaN of a force that is 0."""
    c, s = np.cos(theta), np.sin(theta)
    return theta + over(c * ty - s * tx, c * tx + s * ty)


@apart
def _carry_slip(
    waves: Array, kappa: Number, row: Row, before: Row, panels: Records, given: Records, sticks: bool
) -> None:
    """Carry the panels of a slip, whose begin, first direction and first guess of the end are in place.

    `before` is the real piece, `given` has the real panels. Where it `sticks` the end moves to q = 0.
    """
    work = PanelWork(
        np.empty(STAGES, CARRIED_CURVES), np.empty((3, STAGES), np.complex128),
        np.empty(PANEL_MATRIX, np.complex128),
    )  # fmt: skip
    first, count, length = before.first, before.count, before.end - before.begin
    for _ in range(ROUNDS):
        theta = panels[first].start
        stretch = (row.end - row.begin) / length
        for p in range(first, first + count):
            panel = panels[p]
            panel.begin = row.begin + stretch * (given[p].begin - before.begin)
            panel.end = row.begin + stretch * (given[p].end - before.begin)
            panel.start = theta
            solve_panel(waves, kappa, panel.begin, panel.end, theta, False, panel.theta, work)
            theta = panel.theta[STAGES - 1]
        if not sticks:
            break
        panel, last = panels[first + count - 1], work.nodes[STAGES - 1]
        slope = SLOPES[STAGES - 1, 0] * panel.start
        for j in range(STAGES):
            slope += SLOPES[STAGES - 1, j + 1] * panel.theta[j]
        slope = over(slope, panel.end - panel.begin)
        c, s = np.cos(theta), np.sin(theta)
        fall = c * last.ddx + s * last.ddy / kappa - last.ddlimit
        fall += (c * last.dy / kappa - s * last.dx) * slope
        row.end -= over(slip_rate(last, kappa, theta), fall)


@apart
def _carry(
    waves: Array, kappa: Number, found: Records, pieces: Records, panels: Records, given: Records,
    whole: Records,     start: Array,
) -> None:  # fmt: skip
    """Carry a path into the complex plane, the force at its begin `start` (2,); it ends as that at the end.

    `given` has the real panels, `whole` the real pieces.
    """
    count = found[0].pieces
    tx, ty = start[0], start[1]
    for i in range(count):
        row, before = pieces[i], whole[i]
        follows = i > 0 and whole[i - 1].end == before.begin
        followed = i + 1 < count and whole[i + 1].begin == before.end
        row.begin = pieces[i - 1].end if follows else before.begin + 0.0j
        row.end = before.end + 0.0j
        if not follows and found[0].how == OPENS:
            row.begin = _zero_of_limit(waves, row.begin)
            tx, ty = 0.0j, 0.0j
        if not followed and found[0].how == OPENS:
            row.end = _zero_of_limit(waves, row.end)
        row.tx, row.ty = tx, ty
        at = curves_at(waves, row.begin)
        if before.motion == STICK:
            offset_x, offset_y = tx - at.x, ty - at.y / kappa
            if not follows and found[0].how == OPENS and before.end - before.begin < SHORTEST:
                row.end += row.begin - before.begin
            elif followed and whole[i + 1].motion == SLIP:
                row.end = _end_of_stick(waves, kappa, offset_x, offset_y, row.end)
            at = curves_at(waves, row.end)
            tx, ty = offset_x + at.x, offset_y + at.y / kappa
            continue
        first = before.first
        if before.count == 0:
            continue
        if not follows and found[0].how == OPENS:
            theta = given[first].start + 0.0j
            for _ in range(ROUNDS):
                F, slope, _, _ = turning(at, kappa, theta)
                theta -= over(F, slope)
            panels[first].start = theta
        else:
            panels[first].start = _direction(given[first].start, tx, ty)
        sticks = followed and whole[i + 1].motion == STICK
        _carry_slip(waves, kappa, row, before, panels, given, sticks)
        theta = panels[first + before.count - 1].theta[STAGES - 1]
        at = curves_at(waves, row.end)
        tx, ty = at.limit * np.cos(theta), at.limit * np.sin(theta)
    start[0], start[1] = tx, ty


@apart
def _carried(
    waves: Array, kappa: Number, found: Records, pieces: Records, panels: Records,
    out_pieces: Records, out_panels: Records,
) -> None:  # fmt: skip
    """Fill the complex pieces and panels of a path; where it closes, its begin goes with its end."""
    count, filled = found[0].pieces, found[0].panels
    for i in range(count):
        row, given = out_pieces[i], pieces[i]
        row.motion, row.began, row.first, row.count = given.motion, given.began, given.first, given.count
        row.begin, row.end, row.tx, row.ty = given.begin, given.end, given.tx, given.ty
    for i in range(filled):
        panel, known = out_panels[i], panels[i]
        panel.begin, panel.end, panel.start = known.begin, known.end, known.start
        for j in range(STAGES):
            panel.theta[j] = known.theta[j]
    start = np.empty(2, np.complex128)
    if found[0].how == SETTLES:
        at = curves_at(waves, 0.0j)
        start[0], start[1] = at.x, at.y / kappa
        if pieces[0].began != UNLOADED:
            share = over(at.limit, np.sqrt(start[0] * start[0] + start[1] * start[1]))
            start[0], start[1] = share * start[0], share * start[1]
    tx, ty = pieces[0].tx + 0.0j, pieces[0].ty + 0.0j
    rounds = ROUNDS if found[0].how == CLOSES else 1
    for _ in range(rounds):
        if found[0].how == CLOSES:
            start[0], start[1] = tx, ty
        _carry(waves, kappa, found, out_pieces, out_panels, panels, pieces, start)
        memory = found[0].factor * (found[0].px * found[0].mx + found[0].py * found[0].my)
        along = found[0].factor * (found[0].px * (start[0] - tx) + found[0].py * (start[1] - ty))
        step = over(along, 1.0 - memory)
        tx, ty = start[0] + step * found[0].mx, start[1] + step * found[0].my


@apart
def carried_gradient(
    U: Array, ks: Integer, all_ks: Integer, of_motion: Integer, N: Array, row: Array, found: Records,
    pieces: Records, panels: Records, w: Real, by_U: Array, by_row: Array, by_N: Array,
) -> None:  # fmt: skip
    """Add the gradient of the weighted friction by the two motions, the row and the load, at complex numbers.

    `found`, `pieces` and `panels` are the real ones of `circle_path`.
    """
    n, size = U.shape[1], N.size
    waves = np.empty((3, 2, all_ks[-1] + 1), np.complex128)
    kt, second, mu = row[KT], row[KT_SECOND], row[MU]
    curves_of(U, ks, N, all_ks, kt, mu, waves)
    kappa = kt / second
    carried = np.empty(found[0].pieces, CARRIED_PIECE)
    turned = np.empty(found[0].panels, CARRIED_PANEL)
    _carried(waves, kappa, found, pieces, panels, carried, turned)
    weights = np.empty((1, 2, n), np.complex128)
    for a in range(2):
        for i in range(n):
            weights[0, a, i] = w[a, i]
    F, G = np.empty((2, n), np.complex128), np.empty((3, 3 * size + 1), np.complex128)
    circle_gradient(waves, kappa, ks, all_ks, of_motion, found, carried, turned, weights, F, G)
    line = G[0]
    by_row[KT] += line[3 * size] / second
    by_row[KT_SECOND] -= line[3 * size] * kt / (second * second)
    for i in range(n):
        by_u, by_w = line[of_motion[i]], line[size + of_motion[i]]
        by_U[0, i] += kt * by_u
        by_U[1, i] += kt * by_w
        by_row[KT] += by_u * U[0, i] + by_w * U[1, i]
    for j in range(size):
        by_row[MU] += line[2 * size + j] * N[j]
        by_N[j] += mu * line[2 * size + j]


@compiled
def _without_friction(U: Real, dU: Real, w: Real, row: Real, drow: Real) -> tuple[Real, Real, Real]:
    """Return motions, direction and weights of the normal force alone, of a contact that does not slide.

    The rows of numbers are changed in place.
    """
    still, direction, weights = U.copy(), dU.copy(), w.copy()
    fill_block(still[:2], 0.0)
    fill_block(direction[:2], 0.0)
    fill_block(weights[:2], 0.0)
    row[MU], row[KT], row[KT_SECOND] = 1.0, 1.0, 1.0
    drow[MU], drow[KT], drow[KT_SECOND] = 0.0, 0.0, 0.0
    return still, direction, weights


@apart
def _differentiate(
    U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, all_ks: Integer, state: int,
    found: Records, pieces: Records, panels: Records, intervals: Real, w: Real, dU: Real, drow: Real,
    dload: Real, out_U: Real, out_row: Real, out_load: Real,
) -> None:  # fmt: skip
    """Fill the second derivatives of a contact that is pressed, from its path."""
    (m, n), size = U.shape, coefficient_count(all_ks)
    of_motion, of_load = positions(ks, all_ks), positions(load_ks, all_ks)
    turned, pressed = np.empty((m, n), np.complex128), np.empty(load.size, np.complex128)
    moved, N = np.empty(row.size, np.complex128), np.empty(size, np.complex128)
    for a in range(m):
        for i in range(n):
            turned[a, i] = U[a, i] + 1j * TINY * dU[a, i]
    for j in range(row.size):
        moved[j] = row[j] + 1j * TINY * drow[j]
    for j in range(load.size):
        pressed[j] = load[j] + 1j * TINY * dload[j]
    load_of(turned, 2, pressed, moved[KN], of_motion, of_load, N)
    by_U, by_row = np.zeros((2, n), np.complex128), np.zeros(row.size, np.complex128)
    by_N = np.zeros(size, np.complex128)
    carried_gradient(turned, ks, all_ks, of_motion, N, moved, found, pieces, panels, w, by_U, by_row, by_N)
    for a in range(2):
        for i in range(n):
            out_U[a, i] = by_U[a, i].imag / TINY
    for j in range(row.size):
        out_row[j] = by_row[j].imag / TINY
    through_load(
        2, U, dU, ks, all_ks, of_motion, of_load, row, drow, w, state, intervals, N.real.copy(),
        N.imag / TINY, by_N.imag / TINY, by_N.real.copy(), out_U, out_row, out_load,
    )  # fmt: skip


@apart
def circle_law_second(
    U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, cos_table: Real, sin_table: Real, w: Real,
    dU: Real, drow: Real, dload: Real, out_U: Real, out_row: Real, out_load: Real,
) -> int:  # fmt: skip
    """Differentiate `solver.contacts.kernels.circle.circle_law.coulomb_circle` (as in the contract).

    Without friction the numbers of the friction have no second derivatives: NaN.
    """
    given, moved = with_second(row, drow)
    rubs = given[MU] > 0.0 and given[KT] > 0.0 and given[KT_SECOND] > 0.0
    motion, direction, weights = U, dU, w
    if not rubs:
        motion, direction, weights = _without_friction(U, dU, w, given, moved)
    all_ks = merged(ks, load_ks)
    intervals, found = np.empty((all_ks[-1] + 2, 2)), np.zeros(1, FOUND)
    state, pieces, panels = whole_path(
        motion, ks, load, load_ks, given, cos_table, sin_table, found, intervals
    )
    if state < 0 or state == FAILED:
        return FAILED
    fill_block(out_U, 0.0)
    fill(out_row, 0.0)
    fill(out_load, 0.0)
    if state != SEPARATED:
        _differentiate(
            motion, ks, load, load_ks, given, all_ks, state, found, pieces, panels,
            intervals[: found[0].intervals], weights, direction, moved, dload, out_U, out_row, out_load,
        )  # fmt: skip
    tie_second(row, out_row)
    if not rubs:
        out_row[MU], out_row[KT] = np.nan, np.nan
        if not math.isnan(row[KT_SECOND]):
            out_row[KT_SECOND] = np.nan
        if drow[MU] != 0.0 or drow[KT] != 0.0 or drow[KT_SECOND] != 0.0:
            fill_block(out_U, np.nan)
    return state
