"""What a caller may give to watch a computation and to stop it."""

from __future__ import annotations

from collections.abc import Callable

OnProgress = Callable[[float, int], None] | None
ShouldStop = Callable[[], bool] | None


def part_of(
    on_progress: OnProgress, begin: float, end: float, before: int = 0, *, counting: bool = True
) -> OnProgress:
    """What to give to a part of a computation, from `begin` to `end` of the whole.

    Its counts go on from `before`, or stand still there if they are of something else (`counting`).
    """
    if on_progress is None:
        return None
    return lambda share, count: on_progress(begin + share * (end - begin), before + count * counting)
