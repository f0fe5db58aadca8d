"""Kernels that are compiled on their own: their callers know an address, not the code.

Numba puts the code of a callee into each of its callers, and optimises it there again: what lies under ten
callers is compiled ten times and more. A kernel marked with `apart` is compiled once. Its callers hold a slot
that is empty at first; the call that finds it so asks Python for the address, which loads the machine code
from the cache or compiles it. The cost is one load and one comparison a call.

For a caller to be compiled before its callee, or in another process, the type of the result has to be known:
it is read from the annotation, and checked when the callee is compiled.

Kernels of one contract are called by their numbers through a table of addresses: a caller knows the contract
alone, so kernels may be added without compiling any caller anew. A kernel gets its number, and its address a
place in the table, when Python first asks for the number; none is ever given to another kernel.
"""

from __future__ import annotations

import _thread
import ctypes
import functools
import importlib
import inspect
import pickle
import sys
import threading
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any, Protocol, TypeVar

import llvmlite.binding
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.extending import lower_builtin, type_callable
from numba.core.typing import signature

from solver.jit.decorators import compiled
from solver.jit.kernel_contracts import Form, of_numba

_Function = TypeVar("_Function", bound=Callable[..., Any])

_RESULTS = {
    "None": types.none, "bool": types.boolean, "int": types.int64, "float": types.float64,
    "complex": types.complex128,
}  # fmt: skip
_RESOLVER = "stickslip_address_of_kernel"
_WORD = ir.IntType(64)


class Watcher(Protocol):
    """Is told of kernels, each named by a pickle of itself and its types."""

    def called(self, name: bytes) -> None:
        """A call of this kernel was compiled."""

    def listed(self, name: bytes) -> None:
        """A call was compiled that reaches this kernel if its number is given."""

    def needed(self, name: bytes) -> None:
        """This kernel is about to run for the first time, and to be compiled if nobody did."""


class _Apart:
    """A kernel as Python and other kernels call it."""

    def __init__(self, kernel: Any) -> None:
        self._kernel = kernel
        self.__name__: str
        self.__qualname__: str
        functools.update_wrapper(self, kernel.py_func)

    def __call__(self, *arguments: Any) -> Any:
        return self._kernel(*arguments)

    def name(self, form: Any) -> bytes:
        """Return a name for the kernel with these types, by which any process finds it."""
        return kernel_name(self, form)

    def announce(self, form: Any) -> None:
        """Tell who watches that a call of it was compiled."""
        if (watcher := watching()) is not None:
            watcher.called(self.name(form))

    def result_of(self, arguments: tuple[types.Type, ...]) -> types.Type:
        """Return the type of the result; the kernel is compiled only where its annotation does not say."""
        written = str(self._kernel.py_func.__annotations__.get("return", ""))
        parts = written.removeprefix("tuple[").removesuffix("]").split(", ")
        if not all(part in _RESULTS for part in parts):
            return self._compile(arguments).signature.return_type
        found = [_RESULTS[part] for part in parts]
        return types.BaseTuple.from_types(found) if written.startswith("tuple[") else found[0]

    def _compile(self, arguments: tuple[types.Type, ...]) -> Any:
        """Return what Numba compiled, or loaded, for these types."""
        self._kernel.compile(arguments)
        return self._kernel.overloads[arguments]

    def address(self, arguments: tuple[types.Type, ...], promised: types.Type) -> int:
        """Return the address of the machine code.

        Raises
        ------
        TypeError
            The annotation of the result is wrong.
        """
        made = self._compile(arguments)
        if made.signature.return_type != promised:
            raise TypeError(f"{self.__qualname__} returns {made.signature.return_type}, not {promised}")
        address: int = made.library.get_pointer_to_function(made.fndesc.llvm_func_name)
        return address


def apart(function: _Function) -> _Function:
    """Compile a kernel on its own, see above; for all whose body is long beside a call."""
    kernel: Any = _Apart(compiled(function, linked=False))

    def result(_context: Any) -> Any:
        def of(*arguments: types.Type) -> Any:
            return signature(kernel.result_of(arguments), *arguments)

        of.pysig = inspect.signature(function)  # type: ignore[attr-defined]
        return of

    def call(context: Any, builder: Any, form: Any, arguments: Any) -> Any:
        return _call(context, builder, form, arguments, kernel)

    type_callable(kernel)(result)
    lower_builtin(kernel, types.VarArg(types.Any))(call)
    typed: _Function = kernel
    return typed


def _call(context: Any, builder: Any, form: Any, arguments: Any, kernel: _Apart) -> Any:
    """Emit the call of a kernel by the address in its slot."""
    return call_at(context, builder, loaded(context, builder, kernel, form), form, arguments)


def loaded(context: Any, builder: Any, kernel: Any, form: Any) -> Any:
    """Emit the load of the address in a kernel's slot, which is filled if it is empty."""
    name = kernel_name(kernel, form)
    kernel.announce(form)
    slot = _slot(builder.module, f"{kernel.__name__}.{zlib.crc32(name):08x}")
    address = builder.load_atomic(slot, "acquire", 8)
    filled = cgutils.alloca_once_value(builder, address)
    with cgutils.if_unlikely(builder, builder.icmp_unsigned("==", address, _WORD(0))):
        found = _ask(builder, slot, name)
        with cgutils.if_unlikely(builder, builder.icmp_unsigned("==", found, _WORD(0))):
            reason = f"the kernel {kernel.__module__}.{kernel.__name__} could not be compiled"
            context.call_conv.return_user_exc(builder, RuntimeError, (reason,))
        builder.store_atomic(found, slot, "release", 8)
        builder.store(found, filled)
    return builder.load(filled)


def call_at(context: Any, builder: Any, address: Any, form: Any, arguments: Any) -> Any:
    """Emit the call of the kernel at an address; what it raises is raised on."""
    made = context.call_conv.get_function_type(form.return_type, form.args)
    callee = builder.inttoptr(address, made.as_pointer())
    status, result = context.call_conv.call_function(builder, callee, form.return_type, form.args, arguments)
    with cgutils.if_unlikely(builder, status.is_error):
        context.call_conv.return_status_propagate(builder, status)
    return result


def kernel_name(kernel: Any, form: Any) -> bytes:
    """Return a name for a kernel with these types, by which any process finds it."""
    return pickle.dumps((kernel.__module__, kernel.__name__, tuple(form.args), form.return_type))


def _slot(module: Any, name: str) -> Any:
    """Return the place of an address in this module: one for each kernel and types of its arguments."""
    name = f"slot.{name}"
    if name in module.globals:
        return module.globals[name]
    slot = cgutils.add_global_variable(module, _WORD, name)
    slot.linkage, slot.initializer, slot.align = "internal", _WORD(0), 8
    return slot


def _ask(builder: Any, slot: Any, name: bytes) -> Any:
    """Emit the call of `_address_of`."""
    kept = f"{slot.name}.name"
    text = builder.module.globals.get(kept) or cgutils.global_constant(
        builder.module, kept, cgutils.make_bytearray(name)
    )
    form = ir.FunctionType(_WORD, [cgutils.voidptr_t, _WORD])
    resolver = cgutils.get_or_insert_function(builder.module, form, _RESOLVER)
    return builder.call(resolver, [builder.bitcast(text, cgutils.voidptr_t), _WORD(len(name))])


_addresses: dict[bytes, int] = {}
_watcher: Watcher | None = None


def watching() -> Watcher | None:
    """Return who is told of kernels, if anybody is."""
    return _watcher


@contextmanager
def watched(watcher: Watcher) -> Iterator[None]:
    """Have a watcher told of kernels until the block ends."""
    global _watcher
    before, _watcher = _watcher, watcher
    try:
        yield
    finally:
        _watcher = before


def make(name: bytes) -> int:
    """Return the address of a kernel, compiled or loaded if need be."""
    if name not in _addresses:
        module, kernel, arguments, promised = pickle.loads(name)
        _addresses[name] = getattr(importlib.import_module(module), kernel).address(arguments, promised)
    return _addresses[name]


def made_address(name: bytes) -> int:
    """Return the address of a kernel about to be called; as `make`, but whoever makes it is awaited."""
    if _watcher is not None and name not in _addresses:
        _watcher.needed(name)
    return make(name)


@ctypes.CFUNCTYPE(ctypes.c_uint64, ctypes.c_void_p, ctypes.c_uint64)
def _address_of(text: int, size: int) -> int:
    """Return the address that machine code asks for, or 0 after the reason was printed."""
    try:
        return made_address(ctypes.string_at(text, size))
    except KeyboardInterrupt:
        # Nothing can be raised through machine code: its caller gets an error, and the interrupt with it.
        _thread.interrupt_main()
    except Exception:  # noqa: BLE001
        sys.excepthook(*sys.exc_info())
    return 0


llvmlite.binding.add_symbol(_RESOLVER, ctypes.cast(_address_of, ctypes.c_void_p).value)


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
