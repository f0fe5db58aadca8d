"""Kernels as the Python that they are: a debugger, `print` and coverage see them, and Numba is not needed.

The same numbers to rounding, some hundred times slower. What a kernel takes by reference is a plain object.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any, TypeVar

from solver.jit.kernel_forms import Form

_Function = TypeVar("_Function", bound=Callable[..., Any])


def apart(function: _Function) -> _Function:
    """Return a kernel as it is."""
    return function


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
        return self.call(number, arguments)

    def call(self, number: int, arguments: tuple[Any, ...]) -> Any:
        """Call a kernel."""
        if number not in self._made:
            if not 0 <= number < len(self._names):
                raise RuntimeError("no kernel of the contract has this number in this process")
            module, _, name = self._names[number].partition(":")
            self._made[number] = getattr(import_module(module), name)
        return self._made[number](*arguments)


def numbered(arguments: tuple[Form, ...], result: Form, known: tuple[str, ...] = ()) -> Any:
    """Make the function it decorates the contract of kernels called by number, see `kernel_tables`."""
    del arguments, result  # Python asks for no types
    return lambda _function: Kernels(known)


class Referenced:
    """A record by reference: an object with the fields of its class."""

    _fields: tuple[str, ...]

    def __init__(self, *values: Any) -> None:
        for field, value in zip(self._fields, values, strict=True):
            setattr(self, field, value)
