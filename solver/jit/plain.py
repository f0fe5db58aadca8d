"""Kernels by what Numba documents alone, so that a new Numba cannot strand us.

Everything is `numba.njit`. The code of a kernel becomes part of each that calls it, and nothing is kept on
disk: a process compiles for minutes. What is called by its number is called through Python.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numba
from numba import types

from solver.jit.interpreted import Kernels
from solver.jit.kernel_forms import Form, of_numba

_Function = TypeVar("_Function", bound=Callable[..., Any])
FASTMATH = {"reassoc", "contract"}


def apart(function: _Function) -> _Function:
    """Compile a kernel, see `solver.jit.decorators` and `solver.jit.slots`."""
    kernel: _Function = numba.njit(nogil=True, error_model="numpy", fastmath=FASTMATH)(function)
    return kernel


def numbered(arguments: tuple[Form, ...], result: Form, known: tuple[str, ...] = ()) -> Any:
    """Make the function it decorates the contract of kernels called by number, see `kernel_tables`."""
    del arguments
    kernels, returned = Kernels(known), of_numba(result)
    by_number = kernels.call

    def decorate(function: _Function) -> _Function:
        del function
        if returned == types.none:

            def call(number, *given):  # type: ignore[no-untyped-def]
                with numba.objmode():
                    by_number(number, given)
        else:

            def call(number, *given):  # type: ignore[no-untyped-def]
                with numba.objmode(found=returned):
                    found = by_number(number, given)
                return found  # noqa: RET504 - a block of Python may not return

        contract: Any = numba.njit(call)
        contract.number, contract.put = kernels.number, kernels.put
        typed: _Function = contract
        return typed

    return decorate
