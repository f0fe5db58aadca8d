"""The functions of a law that follows the history of its motion, behind contracts; each law has one number.

A law in rate form has a rate of its state and a force,

    rate(u, v, state, p, out)               out = d(state)/dt
    force(u, v, state, p) → force

one in samples a step from the sample before, which fills the state and returns the force,

    step(u, v, du, dt, last, state, p) → force

with the motion u [m], its velocity v [m/s], its change du [m] in the time dt [s] since the sample before, and
the law's parameters p in their order. Derivatives by hand fill the rows (states, force) of

    rate_slopes(u, v, state, p, out)             columns u, v, states, parameters
    step_slopes(u, v, du, dt, last, state, p, out)   columns u, v, du, dt, states, parameters

The complex ones are the same functions for a complex step.
"""

from __future__ import annotations

from typing import Any

from solver.jit.fourier import Complex, Real
from solver.jit.kernel_contracts import COMPLEX, FLOAT
from solver.jit.separate import numbered

_VECTOR, _TABLE, _WAVE = (FLOAT, 1), (FLOAT, 2), (COMPLEX, 1)

FORMS = {
    "rate": ((FLOAT, FLOAT, _VECTOR, _VECTOR, _VECTOR), None),
    "force": ((FLOAT, FLOAT, _VECTOR, _VECTOR), FLOAT),
    "step": ((FLOAT, FLOAT, FLOAT, FLOAT, _VECTOR, _VECTOR, _VECTOR), FLOAT),
    "complex_rate": ((COMPLEX, COMPLEX, _WAVE, _WAVE, _WAVE), None),
    "complex_force": ((COMPLEX, COMPLEX, _WAVE, _WAVE), COMPLEX),
    "complex_step": ((COMPLEX, COMPLEX, COMPLEX, COMPLEX, _WAVE, _WAVE, _WAVE), COMPLEX),
    "rate_slopes": ((FLOAT, FLOAT, _VECTOR, _VECTOR, _TABLE), None),
    "step_slopes": ((FLOAT, FLOAT, FLOAT, FLOAT, _VECTOR, _VECTOR, _VECTOR, _TABLE), None),
}
"""The types of the arguments and of the result of every function a law may have."""


@numbered(*FORMS["rate"])
def call_rate(number: int, u: float, v: float, state: Real, p: Real, out: Real) -> None:
    """Fill the rate of the state of the law of this number."""
    raise TypeError(number)


@numbered(*FORMS["force"])
def call_force(number: int, u: float, v: float, state: Real, p: Real) -> float:
    """Return the force of the law of this number."""
    raise TypeError(number)


@numbered(*FORMS["step"])
def call_step(
    number: int, u: float, v: float, du: float, dt: float, last: Real, state: Real, p: Real
) -> float:
    """Fill the state at the next sample and return the force there."""
    raise TypeError(number)


@numbered(*FORMS["complex_rate"])
def call_complex_rate(number: int, u: complex, v: complex, state: Complex, p: Complex, out: Complex) -> None:
    """As `call_rate` with complex numbers."""
    raise TypeError(number)


@numbered(*FORMS["complex_force"])
def call_complex_force(number: int, u: complex, v: complex, state: Complex, p: Complex) -> complex:
    """As `call_force` with complex numbers."""
    raise TypeError(number)


@numbered(*FORMS["complex_step"])
def call_complex_step(
    number: int, u: complex, v: complex, du: complex, dt: complex, last: Complex, state: Complex, p: Complex
) -> complex:
    """As `call_step` with complex numbers."""
    raise TypeError(number)


@numbered(*FORMS["rate_slopes"])
def call_rate_slopes(number: int, u: float, v: float, state: Real, p: Real, out: Real) -> None:
    """Fill the derivatives of rate and force by hand."""
    raise TypeError(number)


@numbered(*FORMS["step_slopes"])
def call_step_slopes(
    number: int, u: float, v: float, du: float, dt: float, last: Real, state: Real, p: Real, out: Real
) -> None:
    """Fill the derivatives of step and force by hand."""
    raise TypeError(number)


TABLES: dict[str, Any] = {
    "rate": call_rate, "force": call_force, "step": call_step, "complex_rate": call_complex_rate,
    "complex_force": call_complex_force, "complex_step": call_complex_step,
    "rate_slopes": call_rate_slopes, "step_slopes": call_step_slopes,
}  # fmt: skip
"""The contract of each of these functions."""
