"""The `stickslip` command."""

from __future__ import annotations

import gc
from collections.abc import Sequence

# New objects after which the collector looks for cycles. What a process loads to begin with stays: with
# Python's 700 it is looked through two hundred times, up to a tenth of the time of a short command.
_NEW_OBJECTS = 10_000


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; the arguments are those of the process if not given.

    Returns
    -------
    The exit status: 0 done, 1 the computation did not reach its goal, 2 bad input.
    """
    before = gc.get_threshold()
    gc.set_threshold(_NEW_OBJECTS, *before[1:])
    try:
        # Worker processes import the main module anew: only the command itself needs what follows.
        from service.cli.app import run

        return run(arguments)
    finally:
        gc.set_threshold(*before)
