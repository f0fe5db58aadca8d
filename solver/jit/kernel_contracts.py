"""Contracts of kernels called by number: their types, and how Python calls them where machine code does not.

In the plain way, which asks Numba for what it documents alone, so that a new Numba cannot strand us, a kernel
calls them through Python; interpreted, everything is Python. `solver.jit.slots` is the compiled way.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any, TypeAlias, TypeVar

import numpy as np

from solver.jit.way import WAY, Way

if WAY is Way.PLAIN:
    import numba

_Function = TypeVar("_Function", bound=Callable[..., Any])

Form: TypeAlias = Any
"""A NumPy type of a number, ``(such a type, dimensions)`` of a contiguous array, a list of both, or None."""
FLOAT, COMPLEX, INTEGER = np.float64, np.complex128, np.int64


def of_numba(form: Form) -> Any:
    """Return Numba's type; a list is its tuple."""
    from numba import from_dtype, types

    if form is None:
        return types.none
    if isinstance(form, list):
        return types.BaseTuple.from_types([of_numba(one) for one in form])
    if isinstance(form, tuple):
        number, dimensions = form
        return types.Array(of_numba(number), dimensions, "C")
    return from_dtype(np.dtype(form))


class Kernels:
    """The kernels of a contract by their numbers."""

    def __init__(self, known: tuple[str, ...]) -> None:
        self._names, self._made = list(known), dict[int, Any]()

    def number(self, kernel: str) -> int:
        """Return the number of a kernel, ``module:NAME``."""
        if kernel not in self._names:
            module, _, name = kernel.partition(":")
            getattr(import_module(module), name)
            self._names.append(kernel)
        return self._names.index(kernel)

    def put(self, number: int, kernel: Any) -> None:
        """Have a function of the contract called by a number."""
        self._made[number] = kernel

    def __call__(self, number: int, *arguments: Any) -> Any:
        """Call a kernel."""
        if number not in self._made:
            if not 0 <= number < len(self._names):
                raise RuntimeError("no kernel of the contract has this number in this process")
            module, _, name = self._names[number].partition(":")
            self._made[number] = getattr(import_module(module), name)
        return self._made[number](*arguments)


def numbered(arguments: tuple[Form, ...], result: Form, known: tuple[str, ...] = ()) -> Any:
    """Make the function it decorates the contract of kernels called by number, see `solver.jit.slots`."""
    del arguments  # Python asks for no types
    kernels = Kernels(known)
    if WAY is Way.INTERPRETED:
        return lambda _function: kernels
    returned, by_number = of_numba(result), kernels.__call__

    def decorate(function: _Function) -> _Function:
        del function
        if result is None:

            def call(number, *given):  # type: ignore[no-untyped-def]
                with numba.objmode():
                    by_number(number, *given)
        else:

            def call(number, *given):  # type: ignore[no-untyped-def]
                with numba.objmode(found=returned):
                    found = by_number(number, *given)
                return found  # noqa: RET504 - a block of Python may not return

        contract: Any = numba.njit(call)
        contract.number, contract.put = kernels.number, kernels.put
        typed: _Function = contract
        return typed

    return decorate
