"""Second derivatives of the contact laws behind one contract: along a direction, contracted with weights.

    second(U, ks, load, load_ks, row, cos_table, sin_table, w, dU, drow, dload, out_U, out_row, out_load)
        → state

The first seven arguments are those of a law (`solver.contacts.kernels.laws`), w (m, n) are weights of the
force coefficients. `out_U` (m, n), `out_row` (COLUMNS,) and `out_load` are filled with the derivative along
(dU, drow, dload) of the gradient of w·F by the motions of all ports, the row of the contact table and the
coefficients of the given load, which are taken for independent of the row's numbers of that load. The state
is the law's, or FAILED. The class of a law names such a kernel, or says by none that it has no second
derivatives.
"""

from __future__ import annotations

from numba import types

from solver.contacts.kernels.columns import SECOND_KERNELS
from solver.jit.decorators import compiled
from solver.jit.fourier import Integer, Real
from solver.jit.numbered import numbered

_VECTOR, _TABLE = (types.Array(types.float64, dimensions, "C") for dimensions in (1, 2))
_HARMONICS = types.Array(types.int64, 1, "C")
_ARGUMENTS = (
    _TABLE, _HARMONICS, _VECTOR, _HARMONICS, _VECTOR, _TABLE, _TABLE, _TABLE, _TABLE, _VECTOR, _VECTOR,
    _TABLE, _VECTOR, _VECTOR,
)  # fmt: skip


@numbered(_ARGUMENTS, types.int64, SECOND_KERNELS)
def call_second(
    number: int, U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, cos_table: Real,
    sin_table: Real, w: Real, dU: Real, drow: Real, dload: Real, out_U: Real, out_row: Real, out_load: Real,
) -> int:  # fmt: skip
    """Differentiate by the kernel of this number; see the module for the arguments."""
    # What stands here is the contract; a kernel is called in its place.
    raise TypeError(number)


@compiled
def law_second(
    number: int, U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, cos_table: Real,
    sin_table: Real, w: Real, dU: Real, drow: Real, dload: Real, out_U: Real, out_row: Real, out_load: Real,
) -> int:  # fmt: skip
    """Differentiate any law that can be, from Python too; see the module for the arguments."""
    return call_second(
        number, U, ks, load, load_ks, row, cos_table, sin_table, w, dU, drow, dload, out_U, out_row, out_load
    )


def second_number(kernel: str) -> int:
    """Return the number of a kernel of second derivatives, ``module:NAME``, ready to be called."""
    number: int = call_second.number(kernel)
    return number
