"""Compiling beside what is computed: a process whose kernels are not on disk need not wait for the compiler.

Small problems begin interpreted while another process compiles, larger ones wait for it behind a line that
says so. Whichever it is, a process keeps to it: see `solver.jit.way`. Of several processes one compiles.
"""

from __future__ import annotations

import contextlib
import math
import os
import platform
import subprocess
import sys
import time
import zlib
from collections.abc import Callable, Iterator, Mapping
from enum import StrEnum
from importlib.util import find_spec
from pathlib import Path
from typing import IO, Any

from solver.jit.folder import folder, processor, take

try:
    import fcntl
except ImportError:  # Windows has no such lock
    fcntl = None  # type: ignore[assignment]

SETTING = "STICKSLIP_KERNELS"
COMPILER = "service.warm_up"  # what is run to compile: a module of a layer above, known here by its name
SMALL = 2000.0  # unknowns × solves, see `cost`: less than a minute interpreted, as long as compiling takes
SOLVES = {"solve": 1.0, "sweep": 8.0, "design": 35.0}
"""How many times as long as one response each study takes; what is not here is never small."""
_CHEAP = {
    "frequency_hz", "harmonics", "variables", "method", "start", "stop", "on_progress", "should_stop",
    "on_best",
}  # fmt: skip
"""Keys with which it takes no longer; with all others it is not small."""
_PAUSE, _LINE, _PATIENCE = 0.25, 10.0, 30.0  # s: between two looks, two lines, and for a compiler to begin
_TRIES = 3
_interprets = False


class Stage(StrEnum):
    """What is compiled first, and all of it."""

    FIRST = "first"  # a response and a design with Coulomb friction
    ALL = "all"


def _mark(stage: Stage) -> Path:
    """Return what tells that a stage is compiled, for this kind of processor: machine code is for one."""
    lines = [line for line in processor() if line.startswith(("model name", "flags", "Features"))]
    told = "".join((platform.machine(), platform.processor(), *lines))
    return folder() / f"{stage}.{zlib.crc32(told.encode()):08x}"


def on_disk(stage: Stage = Stage.FIRST) -> bool:
    """Return whether the kernels of a stage are compiled: for this processor, or as they came."""
    return _mark(stage).exists() or take()


def compiled(stage: Stage) -> None:
    """Note that the kernels of a stage are on disk."""
    _mark(stage).touch()


def _progress() -> Path:
    return folder() / "progress"


def note(done: int, found: int) -> None:
    """Tell other processes how far the compiler is."""
    with contextlib.suppress(OSError):  # it is told again
        _progress().write_text(f"{done} of {found}", "utf-8")


def told() -> str:
    """Return how far the process that compiles is."""
    try:
        far = _progress().read_text("utf-8")
    except OSError:
        far = ""
    return f"{far} kernels so far" if far else "it begins"


@contextlib.contextmanager
def compiling(*, wait: bool) -> Iterator[bool]:
    """Be the one process that compiles until the block ends.

    Parameters
    ----------
    wait : until it can be; else False is given where another one is.
    """
    with open(folder() / "compiling", "w", encoding="utf-8") as file:
        yield fcntl is None or any(_locked(file, wait=wait) for _ in range(_TRIES))


def _locked(file: IO[str], *, wait: bool) -> bool:
    try:
        fcntl.flock(file, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
    except BlockingIOError:
        time.sleep(_PAUSE / _TRIES)  # perhaps somebody only looked whether it is locked
        return False
    except OSError:
        return True  # some network file systems have no locks
    return True


def is_compiled_elsewhere() -> bool:
    """Return whether another process compiles."""
    with compiling(wait=False) as mine:
        return not mine


def begin() -> None:
    """Have another process compile, which outlives this one; nothing if one does so already."""
    if is_compiled_elsewhere():
        return
    _progress().unlink(missing_ok=True)
    process = subprocess.Popen(
        [sys.executable, "-m", COMPILER, "--beside"], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL, start_new_session=True, env={**os.environ, SETTING: "compiled"},
    )  # fmt: skip
    process.returncode = 0  # nobody waits for its end


def wait(stage: Stage = Stage.FIRST) -> None:
    """Return when the kernels of a stage are on disk; say how far it is.

    Where the process that compiles fails, whatever is missing is compiled, and fails, where it is called.
    """
    begun, said, alive = time.monotonic(), -_LINE, False
    while not on_disk(stage):
        elapsed = time.monotonic() - begun
        elsewhere = is_compiled_elsewhere()
        if not elsewhere and (alive or elapsed > _PATIENCE):
            break
        alive = alive or elsewhere
        if elapsed - said >= _LINE:
            said = elapsed
            sys.stderr.write(f"stickslip: waits for the compiler, once for this version: {told()}\n")
        time.sleep(_PAUSE)


def cost(kind: str, scene: Any, asked: Mapping[str, Any]) -> float:
    """Return how much a study of a scene takes with the keys asked for, in the unit of `SMALL`.

    A contact of several motions has their directions to find: it takes about the third power of their number.
    """
    harmonics, usual = asked.get("harmonics", 11), asked.get("method", "auto") == "auto"
    if kind not in SOLVES or not asked.keys() <= _CHEAP or not isinstance(harmonics, int) or not usual:
        return math.inf
    unknowns = (2 * harmonics + 1) * sum(len(one.stiffnesses) ** 3 for one in scene.contacts)
    return unknowns * SOLVES[kind] * len(asked.get("variables") or "1")


def ready() -> None:
    """Have compiled kernels on disk: wait for the process that compiles, if this one has a choice."""
    if is_open():
        begin()
        wait()


def missing() -> bool:
    """Return whether kernels are to be compiled, and are not on disk."""
    return not os.environ.get(SETTING) and find_spec("numba") is not None and not on_disk()


def is_open() -> bool:
    """Return whether they are missing, and the way of this process is not settled yet."""
    settled = _interprets or hasattr(sys.modules.get("solver.jit.way"), "WAY")
    return not settled and missing()


def prepare(cost_of_it: Callable[[], float]) -> None:
    """Have the kernels ready before something is computed, and timed: on disk, or interpreted if it is small.

    To be called before the first kernel is imported; nothing happens where the way is settled.
    """
    if not is_open():
        return
    if cost_of_it() > SMALL:
        ready()
        return
    begin()
    interpret()
    sys.stderr.write(
        f"stickslip: computed without waiting for the compiler, which runs beside ({told()}) and serves what "
        "is asked next\n"
    )


def interpret() -> bool:
    """Have this process interpret its kernels if its way is open; return whether it does."""
    global _interprets
    _interprets = _interprets or is_open()
    return _interprets


def interprets() -> bool:
    """Return whether this process chose to interpret its kernels."""
    return _interprets
