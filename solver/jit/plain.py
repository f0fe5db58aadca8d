"""Kernels by what Numba documents alone, so that a new Numba cannot strand us.

Everything is `numba.njit`. The code of a kernel becomes part of each that calls it, and nothing is kept on
disk: a process compiles for minutes. What is called by its number is called through Python.
"""

from __future__ import annotations

import importlib
import os
from collections.abc import Callable
from typing import Any, TypeVar

import numba
from numba import types

_Function = TypeVar("_Function", bound=Callable[..., Any])
PLAIN = os.environ.get("STICKSLIP_PLAIN_KERNELS", "") not in ("", "0")
"""Whether kernels are compiled this way: slow to start, nothing is kept on disk, but of any Numba."""
FASTMATH = {"reassoc", "contract"}


def apart(function: _Function) -> _Function:
    """Compile a kernel, see `solver.jit.decorators` and `solver.jit.slots`."""
    kernel: _Function = numba.njit(nogil=True, error_model="numpy", fastmath=FASTMATH)(function)
    return kernel


class _Kernels:
    """The kernels of a contract by their numbers."""

    def __init__(self, known: tuple[str, ...]) -> None:
        self._names, self._made = list(known), dict[int, Any]()

    def number(self, kernel: str) -> int:
        """Return the number of a kernel, ``module:NAME``."""
        if kernel not in self._names:
            self._names.append(kernel)
        return self._names.index(kernel)

    def put(self, number: int, kernel: Any) -> None:
        """Have a function of the contract called by a number."""
        self._made[number] = kernel

    def call(self, number: int, arguments: tuple[Any, ...]) -> Any:
        """Call a kernel."""
        if number not in self._made:
            if number >= len(self._names):
                raise RuntimeError("no kernel of the contract has this number in this process")
            module, _, name = self._names[number].partition(":")
            self._made[number] = getattr(importlib.import_module(module), name)
        return self._made[number](*arguments)


def numbered(arguments: tuple[types.Type, ...], result: types.Type, known: tuple[str, ...] = ()) -> Any:
    """Make the function it decorates the contract of kernels called by number, see `solver.jit.tables`."""
    del arguments
    kernels = _Kernels(known)
    by_number = kernels.call

    def decorate(function: _Function) -> _Function:
        del function
        if result == types.none:

            def call(number, *given):  # type: ignore[no-untyped-def]
                with numba.objmode():
                    by_number(number, given)
        else:

            def call(number, *given):  # type: ignore[no-untyped-def]
                with numba.objmode(found=result):
                    found = by_number(number, given)
                return found  # noqa: RET504 - a block of Python may not return

        contract: Any = numba.njit(call)
        contract.number, contract.put = kernels.number, kernels.put
        typed: _Function = contract
        return typed

    return decorate
