"""Second derivatives of `solver.contacts.kernels.circle.law` with the circular limit, behind the contract.

The arguments are those of `solver.contacts.kernels.second_laws`.
"""

from __future__ import annotations

import math

import numpy as np

from solver.contacts.kernels.circle.hessian import circle_second
from solver.contacts.kernels.circle.law import whole_path
from solver.contacts.kernels.circle.state import FOUND
from solver.contacts.kernels.columns import KT, KT_SECOND, MU
from solver.contacts.kernels.coulomb.law import with_second
from solver.contacts.kernels.coulomb.second_law import tie_second
from solver.contacts.kernels.stick_slip_events import FAILED
from solver.jit.decorators import compiled
from solver.jit.fourier import Integer, Real, merged
from solver.jit.lapack import fill_block
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
    top = merged(ks, load_ks)[-1]
    intervals, found = np.empty((top + 2, 2)), np.zeros(1, FOUND)
    state, pieces, panels = whole_path(
        motion, ks, load, load_ks, given, cos_table, sin_table, found, intervals
    )
    if state < 0 or state == FAILED:
        return FAILED
    circle_second(
        motion, ks, load, load_ks, given, state, found, pieces, panels, intervals[: found[0].intervals],
        weights, direction, moved, dload, out_U, out_row, out_load,
    )  # fmt: skip
    tie_second(row, out_row)
    if not rubs:
        out_row[MU], out_row[KT] = np.nan, np.nan
        if not math.isnan(row[KT_SECOND]):
            out_row[KT_SECOND] = np.nan
        if drow[MU] != 0.0 or drow[KT] != 0.0 or drow[KT_SECOND] != 0.0:
            fill_block(out_U, np.nan)
    return state
