"""Second derivatives of `solver.contacts.kernels.circle.law` with the circular limit, behind the contract.

The arguments are those of `solver.contacts.kernels.second_laws`.
"""

from __future__ import annotations

import math

import numpy as np

from solver.contacts.kernels.circle.hessian import TINY, carried_gradient
from solver.contacts.kernels.circle.law import whole_path
from solver.contacts.kernels.circle.state import FOUND
from solver.contacts.kernels.columns import KN, KT, KT_SECOND, MU
from solver.contacts.kernels.coulomb.law import load_of, with_second
from solver.contacts.kernels.coulomb.second_law import through_load, tie_second
from solver.contacts.kernels.stick_slip_events import FAILED, SEPARATED
from solver.jit.decorators import compiled
from solver.jit.fourier import Integer, Real, coefficient_count, merged, positions
from solver.jit.lapack import fill, fill_block
from solver.jit.records import Records
from solver.jit.separate import apart


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
    """Differentiate `solver.contacts.kernels.circle.law.coulomb_circle` (as in the contract).

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
