"""The `stickslip` command."""

from __future__ import annotations

import atexit
import contextlib
import gc
import os
import sys
from collections.abc import Sequence

# New objects after which the collector looks for cycles. What a process loads to begin with stays: with
# Python's 700 it is looked through two hundred times, up to a tenth of the time of a short command.
_NEW_OBJECTS = 100_000


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
        from service.cli.table import run

        return run(arguments)
    finally:
        gc.set_threshold(*before)


def process() -> int:
    """Run the command as a process of its own, which ends at once when its work is done.

    What the numerical packages hold is not taken apart piece by piece, a fifth of a short command: it goes
    with the process. All that is registered to happen at its end happens before.
    """
    ended: list[int] = []

    def leave() -> None:
        # Where output cannot be written any more, or what was raised is to be shown, Python ends as it does.
        with contextlib.suppress(OSError, ValueError):
            sys.stdout.flush()
            sys.stderr.flush()
            if ended:
                os._exit(ended[0])

    atexit.register(leave)  # the first that is registered runs last
    ended.append(main())
    return ended[0]
