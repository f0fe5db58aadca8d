"""Where the machine code of the kernels is kept on disk, and how several processes share it.

Numba looks only at the file a function stands in, so a caller would go on using the old machine code of a
callee that changed in another file. The folder is therefore named by a hash of every kernel source: change
one and all are compiled anew (`solver.jit.folder`). The machine code of kernels from outside the
package lies there too; it is that of one state of the file they stand in.

Numba writes its index without a lock: of two processes that save at once, one may lose its entry, or find the
machine code of the other under its own. Here one saves at a time, and none reads meanwhile.
"""

from __future__ import annotations

import contextlib
import hashlib
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import llvmlite.binding
from numba.core import caching, event
from numba.core.runtime import rtsys

from solver.jit.folder import folder
from solver.jit.timer import took

try:
    import fcntl
except ImportError:  # Windows has no such lock
    fcntl = None  # type: ignore[assignment]


CACHE_FOLDER = str(folder())


class _Compiling(event.Listener):
    """Takes the time that a thread compiles out of what is reported."""

    def __init__(self) -> None:
        self._begun = threading.local()

    def on_start(self, _event: object) -> None:
        if (depth := getattr(self._begun, "depth", 0)) == 0:
            self._begun.at = time.perf_counter()
        self._begun.depth = depth + 1

    def on_end(self, _event: object) -> None:
        self._begun.depth -= 1
        if self._begun.depth == 0:
            took(time.perf_counter() - self._begun.at)


event.register("numba:compile", _Compiling())


@contextlib.contextmanager
def _locked(*, alone: bool) -> Iterator[None]:
    """Have the folder, alone or with others who only read, until the block ends."""
    Path(CACHE_FOLDER).mkdir(parents=True, exist_ok=True)
    with open(Path(CACHE_FOLDER) / "lock", "w") as file:
        # Some network file systems have no locks; there it is as it would be without this.
        if fcntl is not None:
            with contextlib.suppress(OSError):
                fcntl.flock(file, fcntl.LOCK_EX if alone else fcntl.LOCK_SH)
        yield


class _Locator(caching._CacheLocator):
    """Tells Numba the folder, and when the machine code there is out of date."""

    def __init__(self, place: str, stamp: str) -> None:
        self._place, self._stamp = place, stamp

    @classmethod
    def from_function(cls, function: Any, file: str) -> _Locator:
        stamp = "named by its sources"
        package, *rest = function.__module__.split(".")
        if package != "solver" or {"kernels", "jit"}.isdisjoint(rest):
            stamp = hashlib.sha256(Path(file).read_bytes()).hexdigest()
        return cls(f"{function.__module__}-{function.__code__.co_firstlineno}", stamp)

    def get_cache_path(self) -> str:
        return CACHE_FOLDER

    def get_source_stamp(self) -> str:
        return self._stamp

    def get_disambiguator(self) -> str:
        # Numba itself takes the last part of the module's name, which modules of several folders share.
        return self._place


class _Serialised(caching.CompileResultCacheImpl):
    _locator_classes: ClassVar = [_Locator]


class _Alone(_Serialised):
    """Keeps of a kernel that no other is linked with, beside its machine code, its name only.

    Numba keeps the whole code for the compiler, to put it into callers, and parses it when it loads: a third
    of what loading a kernel costs.
    """

    def reduce(self, cres: Any) -> Any:
        (library, kind, (machine_code, _)), *rest = super().reduce(cres)
        called = {cres.fndesc.llvm_func_name, cres.fndesc.llvm_cpython_wrapper_name}
        named = [
            function.name for function in cres.library.get_defined_functions() if function.name in called
        ]
        code = llvmlite.binding.parse_assembly(
            "".join(f'define void @"{name}"() {{ ret void }}' for name in named)
        )
        return ((library, kind, (machine_code, code.as_bitcode())), *rest)


class KernelCache(caching.Cache):
    """The machine code of one kernel, for each types of its arguments; `linked`: callers may contain it."""

    def __init__(self, function: Any, *, linked: bool = True) -> None:
        self._impl_class = _Serialised if linked else _Alone
        super().__init__(function)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return what was saved for these types, or None.

        Numba would first fill its tables of what can be compiled, for which it imports SciPy: a third of the
        time in which a process starts. Machine code needs only the runtime; to compile, Numba fills them.
        """
        rtsys.initialize(target_context)
        with _locked(alone=False), self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)

    def save_overload(self, sig: Any, data: Any) -> None:
        """Save what was compiled for these types."""
        with _locked(alone=True):
            super().save_overload(sig, data)
