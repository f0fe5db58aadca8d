"""The way the kernels run in this process: settled when the first of them is imported, and never changed."""

from __future__ import annotations

import os
from enum import StrEnum
from importlib.util import find_spec
from typing import Final

from solver.jit import compiler_process


class Way(StrEnum):
    """What stands behind a kernel."""

    COMPILED = "compiled"  # machine code, kept on disk
    PLAIN = "plain"  # the same by what Numba documents alone
    INTERPRETED = "interpreted"  # the Python that it is


def _settled() -> Way:
    """Return the way that `STICKSLIP_KERNELS` names in the environment, or that of a small problem.

    Else they are compiled where Numba is; another process does it if they are not on disk.
    """
    asked = os.environ.get(compiler_process.SETTING)
    if asked:
        if asked not in tuple(Way):
            raise ValueError(f"{compiler_process.SETTING} is {asked!r}, and must be one of {', '.join(Way)}")
        return Way(asked)
    if compiler_process.interprets() or find_spec("numba") is None:
        return Way.INTERPRETED
    compiler_process.ready()
    return Way.COMPILED


WAY: Final = _settled()
