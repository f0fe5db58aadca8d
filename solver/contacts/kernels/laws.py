"""The contact laws behind one contract: a function of one element, which may have several relative motions.

    law(U, ks, load, load_ks, row, slope, dload, cos_table, sin_table, segments, F, dF_dU, dF_dp)
        → (state, piece)

An element has m ports, each a relative motion with n coefficients: U and F are (m, n), dF_dU is (m·m, n, n)
with ∂F_a/∂U_b in block a·m + b. `row` holds the parameters in the columns of the contact table and `load` the
given normal load; `slope` and `dload` are their derivatives by λ, and dF_dp (m, n) the force's. The state is
one of `solver.contacts.kernels.stick_slip_events` or of `solver.contacts.kernels.columns`; the piece numbers
the smooth piece of the law. `segments` is scratch; the law of a Jenkins element leaves its segments there.

Columns beyond those of the elastic Coulomb law: each law has its own meaning for them. A law's class
(`solver.contacts.laws`) names its kernel, which is called by its number.

Second derivatives have a contract of their own: along a direction, contracted with weights,

    second(U, ks, load, load_ks, row, cos_table, sin_table, w, dU, drow, dload, out_U, out_row, out_load)
        → state

where w (m, n) are weights of the force coefficients. `out_U` (m, n), `out_row` (COLUMNS,) and `out_load` are
filled with the derivative along (dU, drow, dload) of the gradient of w·F by the motions of all ports, the row
of the contact table and the coefficients of the given load, which are taken for independent of the row's
numbers of that load. The state is the law's, or FAILED. The class of a law names such a kernel, or says by
none that it has no second derivatives.
"""

from __future__ import annotations

from solver.contacts.kernels.columns import KERNELS, SECOND_KERNELS
from solver.contacts.kernels.stick_slip_events import SEGMENT
from solver.jit.decorators import compiled
from solver.jit.fourier import Integer, Real
from solver.jit.kernel_contracts import FLOAT, INTEGER
from solver.jit.kernel_records import Records
from solver.jit.separate import numbered

_VECTOR, _TABLE, _BLOCKS = (FLOAT, 1), (FLOAT, 2), (FLOAT, 3)
_HARMONICS, _SEGMENTS = (INTEGER, 1), (SEGMENT, 1)
_ARGUMENTS = (
    _TABLE, _HARMONICS, _VECTOR, _HARMONICS, _VECTOR, _VECTOR, _VECTOR, _TABLE, _TABLE, _SEGMENTS, _TABLE,
    _BLOCKS, _TABLE,
)  # fmt: skip


@numbered(_ARGUMENTS, [INTEGER, INTEGER], KERNELS)
def call_law(
    number: int, U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, slope: Real, dload: Real,
    cos_table: Real, sin_table: Real, segments: Records, F: Real, dF_dU: Real, dF_dp: Real,
) -> tuple[int, int]:  # fmt: skip
    """Evaluate the law whose kernel has this number; see the module for the arguments."""
    # What stands here is the contract; a kernel is called in its place.
    raise TypeError(number)


@compiled
def law_force(
    number: int, U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, slope: Real, dload: Real,
    cos_table: Real, sin_table: Real, segments: Records, F: Real, dF_dU: Real, dF_dp: Real,
) -> tuple[int, int]:  # fmt: skip
    """Evaluate any law, from Python too; see the module for the arguments."""
    return call_law(
        number, U, ks, load, load_ks, row, slope, dload, cos_table, sin_table, segments, F, dF_dU, dF_dp
    )


def law_number(kernel: str) -> int:
    """Return the number of a law's kernel, ``module:NAME``, ready to be called."""
    number: int = call_law.number(kernel)
    return number


_SECOND = (
    _TABLE, _HARMONICS, _VECTOR, _HARMONICS, _VECTOR, _TABLE, _TABLE, _TABLE, _TABLE, _VECTOR, _VECTOR,
    _TABLE, _VECTOR, _VECTOR,
)  # fmt: skip


@numbered(_SECOND, INTEGER, SECOND_KERNELS)
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
