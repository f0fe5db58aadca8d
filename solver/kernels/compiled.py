"""How the inner loops are compiled: one decorator, so that every kernel has the same arithmetic and cache.

`reassoc` and `contract` let the compiler vectorise sums and fuse multiply-adds; NaN and infinity keep their
IEEE meaning, because a NaN residual is how a failed evaluation is noticed.

Numba's disk cache looks only at the file a function stands in, so a caller would go on using the old machine
code of a callee that changed in another file. The cache folder is therefore named by a hash of every kernel
source: change one and all are compiled anew.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.extending import intrinsic

_Function = TypeVar("_Function", bound=Callable[..., Any])


def _source_hash() -> str:
    """Return a hash of the kernels' sources and of what compiles them."""
    here = Path(__file__).parent
    digest = hashlib.sha256(numba.__version__.encode())
    for source in (*sorted(here.glob("*.py")), here.parent / "fourier.py", here.parent / "marching.py"):
        if source.exists():
            digest.update(source.name.encode() + source.read_bytes())
    return digest.hexdigest()[:16]


def _cache_folder() -> str:
    """Return a writable folder for the machine code of exactly these sources."""
    asked = os.environ.get("NUMBA_CACHE_DIR")
    home = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    for root in [asked] if asked else [home, tempfile.gettempdir()]:
        folder = Path(root) / "stickslip-kernels" / _source_hash()
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            return str(folder)
    return tempfile.mkdtemp(prefix="stickslip-kernels-")


CACHE_FOLDER = _cache_folder()


def compiled(function: _Function) -> _Function:
    """Compile a kernel: cached on disk, without the GIL, IEEE special values kept."""
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = CACHE_FOLDER
    try:
        kernel: _Function = numba.njit(
            cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "contract"}
        )(function)
    finally:
        numba.config.CACHE_DIR = before
    return kernel


@intrinsic
def out_of_line(context: Any) -> Any:  # noqa: ARG001
    """Keep the kernel this is called in out of its callers, which otherwise are compiled with all of it."""

    def mark(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
        builder.function.attributes.add("noinline")
        return context.get_dummy_value()

    return numba.types.none(), mark
