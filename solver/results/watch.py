"""What a caller may give to watch a computation and to stop it."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

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


@contextmanager
def stopped_by_interrupt() -> Iterator[ShouldStop]:
    """Ctrl-C ends what runs in the block with what it has so far; a second one ends it at once.

    Gives what `should_stop` takes; None, and Ctrl-C as it was, outside of the main thread and where the
    program handles Ctrl-C itself.
    """
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or before is not signal.default_int_handler:
        yield None
        return
    asked = threading.Event()

    def ask(number: int, frame: FrameType | None) -> None:
        del number, frame
        asked.set()
        signal.signal(signal.SIGINT, before)
        sys.stderr.write("stickslip: ends with the best so far; Ctrl-C again ends at once\n")

    signal.signal(signal.SIGINT, ask)
    try:
        yield asked.is_set
    finally:
        signal.signal(signal.SIGINT, before)
