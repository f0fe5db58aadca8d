"""The functions of a law made ready to be called by kernels: compiled, or called as Python.

Numba compiles a plain function as it compiles a kernel, and keeps the machine code; one that is compiled by
its author (`numba.njit`) is taken as it is. What Numba cannot compile is called as Python, slow but right;
where kernels are interpreted, all are.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from solver.contacts.kernels.columns import MOST_OWN
from solver.contacts.kernels.history.partials import BY_COMPLEX_STEP, BY_DIFFERENCES, BY_HAND
from solver.contacts.laws.history.function_law import Derivatives, HistoryLaw
from solver.errors import SettingError
from solver.jit.decorators import kept
from solver.jit.kernel_contracts import of_numba
from solver.jit.law_functions import FORMS, TABLES
from solver.jit.way import WAY, Way

if WAY is not Way.INTERPRETED:
    import numba
    from numba.core.errors import NumbaError

WAYS = {
    Derivatives.BY_HAND: BY_HAND, Derivatives.COMPLEX_STEP: BY_COMPLEX_STEP,
    Derivatives.DIFFERENCES: BY_DIFFERENCES,
}  # fmt: skip
_numbers = itertools.count(1)
_SIZES = [10.0**power for power in range(-9, 1)]  # m, m/s and of states, at which both ways must agree
_AGREES = 1e-5
_STEP = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class Ready:
    """A law in this process."""

    number: Annotated[int, "By which kernels call its functions."]
    derivatives: Annotated[Derivatives, "How they are found."]
    compiled: Annotated[bool, "Whether Numba compiled all of its functions."]
    kept: Annotated[tuple[Any, ...], "What must live as long as the machine code is called."]


@cache
def ready(law: HistoryLaw) -> Ready:
    """Return a law ready to be called; compiled or loaded when first asked for.

    Raises
    ------
    SettingError
        A function does not return what it must.
    """
    number = next(_numbers)
    made = {place: _made(place, function) for place, function in law.functions.items()}
    compiled = all(of_numba for _, of_numba in made.values())
    kernels = {place: kernel for place, (kernel, _) in made.items()}
    derivatives = law.derivatives
    if derivatives is None and law.slopes is not None:
        derivatives = Derivatives.BY_HAND
    if compiled and derivatives in (None, Derivatives.COMPLEX_STEP):
        waves = _complex_kernels(law)
        if waves is not None and (derivatives is not None or _agree(law, kernels, waves)):
            kernels |= waves
            derivatives = Derivatives.COMPLEX_STEP
    if derivatives is None or (derivatives is not Derivatives.BY_HAND and kernels.keys() == made.keys()):
        derivatives = Derivatives.DIFFERENCES
    for place, kernel in kernels.items():
        TABLES[place].put(number, kernel)
    return Ready(number=number, derivatives=derivatives, compiled=compiled, kept=tuple(kernels.values()))


def _made(place: str, function: Callable[..., Any]) -> tuple[Any, bool]:
    """Return a function compiled for its contract, and whether Numba compiled it and not only its call."""
    if WAY is Way.INTERPRETED:
        return _interpreted(place, getattr(function, "py_func", function)), True
    try:
        return _compiled(place, function), True
    except NumbaError:
        if hasattr(function, "py_func"):
            raise
    return _compiled(place, numba.njit(_as_python(place, function))), False


def _compiled(place: str, function: Callable[..., Any]) -> Any:
    arguments, result = FORMS[place]
    wanted = tuple(of_numba(one) for one in arguments)
    kernel: Any = function
    if not hasattr(function, "py_func"):
        kernel = numba.njit(nogil=True, error_model="numpy")(function)
        if Path(function.__code__.co_filename).is_file():
            kept(kernel, function)
    kernel.compile(wanted)
    found = next(one.return_type for one in kernel.nopython_signatures if one.args == wanted)
    if found != of_numba(result):
        raise _wrong(place, str(found))
    return kernel


def _wrong(place: str, found: str) -> SettingError:
    wanted = "must return a float on every way" if FORMS[place][1] is not None else "must return nothing"
    return SettingError(place.removeprefix("complex_"), found, wanted)


def _interpreted(place: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that is called as Python, tried once."""
    arguments, result = FORMS[place]
    with np.errstate(all="ignore"):
        found = function(*(_example(one) for one in arguments))
    if isinstance(found, np.generic | float) is (result is None):
        raise _wrong(place, type(found).__name__)
    return function


def _example(form: Any) -> Any:
    number, *dimensions = form if isinstance(form, tuple) else (form,)
    return np.full([MOST_OWN] * dimensions[0], 0.5, number) if dimensions else number(0.5)


def _as_python(place: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that calls another as Python, from machine code."""
    if place == "force":

        def force(u, v, state, p):  # type: ignore[no-untyped-def]
            with numba.objmode(found="float64"):
                found = float(function(u, v, state, p))
            return found  # noqa: RET504 - a block of Python may not return

        return force
    if place == "step":

        def step(u, v, du, dt, last, state, p):  # type: ignore[no-untyped-def]
            with numba.objmode(found="float64"):
                found = float(function(u, v, du, dt, last, state, p))
            return found  # noqa: RET504 - a block of Python may not return

        return step
    if place in ("rate", "rate_slopes"):

        def rate(u, v, state, p, out):  # type: ignore[no-untyped-def]
            with numba.objmode():
                function(u, v, state, p, out)

        return rate

    def step_slopes(u, v, du, dt, last, state, p, out):  # type: ignore[no-untyped-def]
        with numba.objmode():
            function(u, v, du, dt, last, state, p, out)

    return step_slopes


def _complex_kernels(law: HistoryLaw) -> dict[str, Any] | None:
    """Return the functions compiled for complex numbers, None if they do not take them."""
    functions = {f"complex_{at}": one for at, one in law.functions.items() if not at.endswith("slopes")}
    if WAY is Way.INTERPRETED:
        try:
            return {place: _made(place, function)[0] for place, function in functions.items()}
        except (TypeError, ValueError, SettingError):
            return None
    try:
        return {place: _compiled(place, function) for place, function in functions.items()}
    except (NumbaError, NotImplementedError, SettingError):  # the second: what it types and cannot lower
        return None


def _agree(law: HistoryLaw, kernels: dict[str, Any], waves: dict[str, Any]) -> bool:
    """Whether complex steps give what differences give, in random places of every size.

    A function that takes complex numbers may still not be one of them: `abs` and a comparison of sizes are
    not. Places at which differences of two step sizes do not agree, near a corner, do not count.
    """
    rng = np.random.default_rng(0)
    p = np.zeros(MOST_OWN)
    for i, parameter in enumerate(law.parameters.values()):
        low, high = max(parameter.least, -10.0), min(parameter.most, 10.0)
        inside = low + (high - low) * rng.uniform(0.2, 0.8)
        p[i] = inside if parameter.default is None else parameter.default
    places = ["step"] if law.step is not None else [one for one in ("rate", "force") if one in kernels]
    inputs = 4 if law.step is not None else 2
    for size in _SIZES:
        at = size * rng.normal(size=inputs + law.states)
        for place in places:
            for column in range(at.size):
                way = np.eye(at.size)[column]
                step = _called(waves[f"complex_{place}"], law, place, at + 1e-30j * way, p + 0j).imag / 1e-30
                slopes = [
                    (
                        _called(kernels[place], law, place, at + h * way, p)
                        - _called(kernels[place], law, place, at - h * way, p)
                    )
                    / (2.0 * h)
                    for h in (_STEP * size, 3.0 * _STEP * size)
                ]
                scale = max(np.abs(slopes[0]).max(), np.abs(step).max(), 1e-300)
                steady = np.abs(slopes[0] - slopes[1]).max() <= _AGREES * scale
                if steady and not np.abs(step - slopes[0]).max() <= 10.0 * _AGREES * scale:
                    return False
    return True


def _called(kernel: Any, law: HistoryLaw, place: str, at: Any, p: Any) -> Any:
    """Return what a function gives, as an array."""
    out = np.zeros(law.states, at.dtype)
    if place == "rate":
        kernel(at[0], at[1], at[2:].copy(), p, out)
        return out
    if place == "force":
        return np.array([kernel(at[0], at[1], at[2:].copy(), p)])
    force = kernel(at[0], at[1], at[2], at[3], at[4:].copy(), out, p)
    return np.append(out, force)
