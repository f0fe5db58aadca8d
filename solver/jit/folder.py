"""The folder on disk of the machine code of exactly these sources, found without Numba.

It is named by a hash of every kernel source and of Numba's version. Nothing else is asked of them, so that
all copies of the same sources, wherever they lie and whenever they were written, share one folder.

An archive of kernels for any processor of a kind may lie beside this file, named by the same hash. It is
unpacked into the folder, and from then on they are used, and compiled, for that kind of processor.
"""

from __future__ import annotations

import hashlib
import os
import platform
import stat
import sys
import tarfile
import tempfile
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

_NO_CODE = ("compiler_process", "eigen", "folder", "parallel", "timer", "way")
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


CPU_NAME, CPU_FEATURES = "NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES"


class Target(NamedTuple):
    """A kind of processor."""

    name: str  # for the compiler
    features: str  # likewise
    needs: frozenset[str]  # what Linux calls the features that not every such machine has


# The level of the x86-64 psABI: what the compiler may use, and the same by Linux's words.
_V3 = (
    "64bit", "avx", "avx2", "bmi", "bmi2", "cmov", "crc32", "cx16", "cx8", "f16c", "fma", "fxsr", "lzcnt",
    "mmx", "movbe", "popcnt", "sahf", "sse", "sse2", "sse3", "sse4.1", "sse4.2", "ssse3", "xsave",
)  # fmt: skip
_NEEDED = {"abm", "avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "movbe", "popcnt", "sse4_2", "ssse3", "xsave"}
_TARGETS = {
    "x86_64": Target("x86-64-v3", ",".join(f"+{one}" for one in _V3), frozenset(_NEEDED)),
    "aarch64": Target("generic", "+neon", frozenset({"asimd"})),
}


def processor() -> list[str]:
    """Return what Linux tells of the first processor, line by line; nothing elsewhere."""
    try:
        return Path("/proc/cpuinfo").read_text("utf-8").partition("\n\n")[0].splitlines()
    except OSError:
        return []


def target() -> Target | None:
    """Return the kind of this processor; None if it is none, or has not what it needs."""
    kind = _TARGETS.get(platform.machine())
    found = next((line for line in processor() if line.startswith(("flags", "Features"))), "")
    return kind if kind is not None and kind.needs <= set(found.partition(":")[2].split()) else None


def archive(place: Path | None = None) -> Path:
    """Return where the archive for these sources is, whether it is there or not."""
    return (place or Path(__file__).parent) / f"{folder().name}-{platform.machine()}.tar.gz"


def pack(place: Path | None = None) -> Path:
    """Put what is compiled into the archive."""
    with tarfile.open(archive(place), "w:gz", compresslevel=9) as packed:
        for file in sorted(folder().glob("*.nb?")):
            packed.add(file, file.name)
    return archive(place)


def take() -> bool:
    """Use the kernels that came with the package, if there are some for this processor; unpacked once.

    It makes settings that Numba reads when it is imported: afterwards they are not used.
    """
    kind, asked = target(), os.environ.get(CPU_NAME)
    if kind is None or asked not in (None, kind.name) or (asked is None and "numba" in sys.modules):
        return False
    mark = folder() / f"shipped.{kind.name}"
    if not mark.exists():
        if not archive().exists():
            return False
        # Whoever reads or unpacks at this moment finds every file whole.
        with tempfile.TemporaryDirectory(dir=folder()) as unpacked, tarfile.open(archive()) as packed:
            packed.extractall(unpacked, filter="data")
            for file in sorted(Path(unpacked).iterdir()):
                file.replace(folder() / file.name)
        mark.touch()
    os.environ[CPU_NAME], os.environ[CPU_FEATURES] = kind.name, kind.features
    return True
