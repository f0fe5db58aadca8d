"""How the inner loops are compiled: one decorator, so that every kernel has the same arithmetic and cache.

`reassoc` and `contract` let the compiler vectorise sums and fuse multiply-adds; NaN and infinity keep their
IEEE meaning, because a NaN residual is how a failed evaluation is noticed.

A kernel marked with `compiled` becomes part of each kernel that calls it: right for short ones. Longer ones
are marked with `apart`, of `solver.jit.separate`.

In the plain way everything is `numba.njit`: the code of a kernel becomes part of each that calls it, nothing
is kept on disk, and a process compiles for minutes. Interpreted, kernels are the Python that they are: a
debugger, `print` and coverage see them, Numba is not needed; the same numbers to rounding, some hundred times
slower.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from solver.jit.way import WAY, Way

if WAY is not Way.INTERPRETED:
    import numba
if WAY is Way.COMPILED:
    from solver.jit.borrowed import Borrowing
    from solver.jit.cache import KernelCache

_Function = TypeVar("_Function", bound=Callable[..., Any])
_FASTMATH = {"reassoc", "contract"}


def compiled(function: _Function, *, linked: bool = True) -> _Function:
    """Compile a kernel: cached on disk, without the GIL, IEEE special values kept.

    What is not `linked` never becomes part of a kernel that calls it.

    One whose name begins with an underscore is for other kernels alone: without the code by which Python
    would call it, a tenth of the compilation is saved.
    """
    if WAY is Way.INTERPRETED:
        return function
    inner, kept_on_disk = function.__name__.startswith("_"), WAY is Way.COMPILED
    kernel: Any = numba.njit(
        nogil=True,
        error_model="numpy",
        fastmath=_FASTMATH,
        no_cpython_wrapper=inner and kept_on_disk,
        no_cfunc_wrapper=kept_on_disk,
        **({"pipeline_class": Borrowing} if kept_on_disk else {}),
    )(function)
    typed: _Function = kernel
    if not kept_on_disk:
        return typed
    kernel._cache = KernelCache(function, linked=linked)  # what `cache=True` does, with a cache of our own
    if inner:
        kernel._insert = lambda *_: None  # into what Python may call
        kernel._compile_for_args = _refuse
    return typed


def kept(kernel: Any, function: Callable[..., Any]) -> None:
    """Have the machine code of a kernel that Numba compiles as it likes kept on disk."""
    if WAY is Way.COMPILED:
        kernel._cache = KernelCache(function)


def _refuse(*_: object, **__: object) -> None:
    raise TypeError("a kernel whose name begins with an underscore is called by kernels, not by Python")
