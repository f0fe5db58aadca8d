"""The `stickslip` command."""

from __future__ import annotations

from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; the arguments are those of the process if not given.

    Returns
    -------
    The exit status: 0 done, 1 the computation did not reach its goal, 2 bad input.
    """
    # Worker processes import the main module anew: only the command itself needs what follows.
    from service.cli.app import run

    return run(arguments)
