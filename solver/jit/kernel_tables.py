"""Kernels of one contract, which machine code calls by their numbers.

A call through a table of addresses: a caller knows the contract alone, so kernels may be added without
compiling any caller anew. A kernel gets its number, and its address a place in the table, when Python first
asks for the number; none is ever given to another kernel.
"""

from __future__ import annotations

import ctypes
import inspect
import pickle
import threading
from collections.abc import Callable
from importlib import import_module
from typing import Any, TypeVar

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.extending import lower_builtin, type_callable
from numba.core.typing import signature

from solver.jit.kernel_contracts import Form, of_numba
from solver.jit.slots import call_at, loaded, made_address, watching

_Function = TypeVar("_Function", bound=Callable[..., Any])
_WORD = ir.IntType(64)
MOST = 4096  # kernels of a contract


class _Table:
    """The addresses of the kernels of a contract, and the contract as kernels call it."""

    def __init__(self, function: Callable[..., Any], form: Any, known: tuple[str, ...]) -> None:
        self.__module__, self.__name__ = function.__module__, function.__name__
        self._form, self._known, self._names = form, known, list(known)
        self._lock = threading.Lock()
        self._addresses = (ctypes.c_uint64 * MOST)()

    def __call__(self, *_: object) -> None:
        """Only kernels call it."""
        raise TypeError(f"{self.__name__} is called by kernels, not by Python")

    def number(self, kernel: str) -> int:
        """Return the number of a kernel, ``module:NAME``, ready to be called.

        Raises
        ------
        TypeError
            It is no kernel of the contract.
        """
        if kernel in self._names and self._addresses[self._names.index(kernel)]:
            return self._names.index(kernel)
        module, _, name = kernel.partition(":")
        address = made_address(getattr(import_module(module), name).name(self._form))
        with self._lock:
            if kernel not in self._names:
                self._names.append(kernel)
            number = self._names.index(kernel)
            self._addresses[number] = address
        return number

    def put(self, number: int, kernel: Any) -> None:
        """Have a function of the contract called by a number: one that has no name."""
        code = kernel.overloads[tuple(self._form.args)]
        self._addresses[number] = code.library.get_pointer_to_function(code.fndesc.llvm_func_name)

    def announce(self, _form: object) -> None:
        """Tell who watches of the kernels that a call may reach: those whose numbers are always the same."""
        if (watcher := watching()) is None:
            return
        form = self._form
        for kernel in self._known:
            module, _, name = kernel.partition(":")
            watcher.listed(pickle.dumps((module, name, tuple(form.args), form.return_type)))

    def address(self, *_: object) -> int:
        """Return where the table lies."""
        return ctypes.addressof(self._addresses)


def numbered(arguments: tuple[Form, ...], result: Form, known: tuple[str, ...] = ()) -> Any:
    """Make the function it decorates, whose body is never run, the contract of kernels called by number.

    Parameters
    ----------
    arguments, result : types of the kernels, see `solver.jit.kernel_contracts`.
    known : kernels whose numbers, from 0 on, are the same in every process.

    The function takes the number and the arguments. A number nobody asked for is a RuntimeError.
    """

    wanted, returned = [of_numba(one) for one in arguments], of_numba(result)

    def decorate(function: _Function) -> _Function:
        form = signature(returned, *wanted)
        table: Any = _Table(function, form, known)

        def typed(_context: Any) -> Any:
            def of(number: types.Type, *given: types.Type) -> Any:
                fits = isinstance(number, types.Integer) and len(given) == len(wanted)
                if fits and all(map(_same, given, wanted)):
                    return signature(returned, types.int64, *given)
                return None

            of.pysig = inspect.signature(function)  # type: ignore[attr-defined]
            return of

        def call(context: Any, builder: Any, called: Any, given: Any) -> Any:
            start = loaded(context, builder, table, called)
            number, *rest = given
            outside = builder.icmp_unsigned(">=", number, _WORD(MOST))
            place = builder.select(outside, _WORD(0), number)
            slot = builder.gep(builder.inttoptr(start, _WORD.as_pointer()), [place])
            address = builder.select(outside, _WORD(0), builder.load(slot))
            with cgutils.if_unlikely(builder, builder.icmp_unsigned("==", address, _WORD(0))):
                reason = f"no kernel of {function.__name__} has this number in this process"
                context.call_conv.return_user_exc(builder, RuntimeError, (reason,))
            return call_at(context, builder, address, form, rest)

        type_callable(table)(typed)
        lower_builtin(table, types.VarArg(types.Any))(call)
        contract: _Function = table
        return contract

    return decorate


def _same(given: types.Type, wanted: types.Type) -> bool:
    """Whether a value is passed alike; that an array is never written makes no difference."""
    if not isinstance(wanted, types.Array):
        return bool(given == wanted)
    same = isinstance(given, types.Array) and given.dtype == wanted.dtype
    return bool(same and given.ndim == wanted.ndim and given.layout == "C")
