"""The folder on disk of the machine code of exactly these sources, found without Numba.

It is named by a hash of every kernel source and of Numba's version. Nothing else is asked of them, so that
all copies of the same sources, wherever they lie and whenever they were written, share one folder.
"""

from __future__ import annotations

import hashlib
import os
import stat
import tempfile
from functools import cache
from importlib.metadata import version
from pathlib import Path

_NO_CODE = ("beside", "timer", "folder", "interpreted", "lapack_loading", "parallel", "shipped", "way")
"""Modules of this folder that the machine code does not depend on."""


def _source_hash() -> str:
    """Return a hash of the kernels' sources and of what compiles them."""
    home = Path(__file__).parent.parent.parent
    jit = [one for one in home.glob("solver/jit/*.py") if one.stem not in _NO_CODE]
    kernels = [*home.glob("solver/**/kernels/**/*.py"), *home.glob("stickslip/lab/*/kernels/*.py")]
    digest = hashlib.sha256(version("numba").encode())
    for source in (*sorted(jit), *sorted(kernels)):
        digest.update(source.relative_to(home).as_posix().encode() + source.read_bytes())
    return digest.hexdigest()[:16]


@cache
def folder() -> Path:
    """Return a writable folder for the machine code of exactly these sources."""
    asked = os.environ.get("NUMBA_CACHE_DIR")
    home = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    for root in [asked] if asked else [home, None]:
        try:
            found = (Path(root) / "stickslip-kernels" if root else _temporary()) / _source_hash()
            found.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(found, os.W_OK):
            return found
    return Path(tempfile.mkdtemp(prefix="stickslip-kernels-"))


def _temporary() -> Path:
    """Return this user's own temporary folder; OSError if somebody else could put machine code there."""
    if not hasattr(os, "getuid"):  # on Windows each user has a folder for temporary files
        return Path(tempfile.gettempdir()) / "stickslip-kernels"
    folder = Path(tempfile.gettempdir()) / f"stickslip-kernels-{os.getuid()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    found = folder.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid() or found.st_mode & 0o022:
        raise PermissionError(f"{folder} is not this user's alone")
    return folder
