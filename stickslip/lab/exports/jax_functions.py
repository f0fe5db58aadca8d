"""Answers as functions of JAX, differentiable forward and backward by their exact derivatives.

    import jax
    import stickslip.jax

    jax.config.update("jax_enable_x64", True)
    peak = stickslip.jax.peak(scene, ["shroud.N0", "shroud.kt"])
    jax.grad(peak)(jax.numpy.array([300.0, 2e6]))

They work below `jax.jit`, `jax.grad`, `jax.jvp` and `jax.vmap`, which takes one after the other; of second
derivatives nothing is known to JAX.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import ParamSpec, TypeAlias

from stickslip.lab.exports import exact_functions as functions
from stickslip.lab.exports.exact_functions import ExactFunction
from solver.errors import MissingExtraError, SettingError
from solver.jit.fourier import Real

try:
    import jax
    import numpy as np
except ModuleNotFoundError as error:
    raise MissingExtraError("jax", "jax") from error

_Given = ParamSpec("_Given")
OfArrays: TypeAlias = Callable[[jax.Array], jax.Array]


def of_arrays(exact: ExactFunction) -> OfArrays:
    """The function of an array (n_paths,) of 64 bits, whose value is an array ().

    Raises
    ------
    SettingError
        When it is called: JAX computes with 32 bits, which cut the values off, or the shape is wrong.
    """
    count = len(exact.paths)

    def here(values: jax.Array) -> tuple[Real, Real]:
        found, slopes = exact(np.asarray(values))
        return np.asarray(found), slopes

    def both(x: jax.Array) -> tuple[jax.Array, jax.Array]:
        shapes = (jax.ShapeDtypeStruct((), np.float64), jax.ShapeDtypeStruct((count,), np.float64))
        found: tuple[jax.Array, jax.Array] = jax.pure_callback(here, shapes, x, vmap_method="sequential")
        return found

    def with_tangent(primals: tuple[jax.Array], tangents: tuple[jax.Array]) -> tuple[jax.Array, jax.Array]:
        found, slopes = both(*primals)
        return found, slopes @ tangents[0]

    value = jax.custom_jvp(lambda x: both(x)[0])
    value.defjvp(with_tangent)

    def checked(x: jax.Array) -> jax.Array:
        given = jax.numpy.asarray(x)
        if given.shape != (count,):
            raise SettingError("x", given.shape, f"must have the shape ({count},): {', '.join(exact.paths)}")
        if given.dtype != np.float64:
            wanted = 'must be float64: jax.config.update("jax_enable_x64", True) before the first array'
            raise SettingError("x", str(given.dtype), wanted)
        answer: jax.Array = value(given)
        return answer

    return checked


def _for_jax(made: Callable[_Given, ExactFunction]) -> Callable[_Given, OfArrays]:
    @functools.wraps(made)
    def function(*given: _Given.args, **named: _Given.kwargs) -> OfArrays:
        return of_arrays(made(*given, **named))

    return function


solve = _for_jax(functions.solve)
peak = _for_jax(functions.peak)
least_peak = _for_jax(functions.least_peak)
damping_ratio = _for_jax(functions.damping_ratio)
