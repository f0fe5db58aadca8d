"""What a caller may give to watch a computation and to stop it, and the progress bar that it shows by itself.

The bar is there where somebody watches: a terminal or a notebook. It writes one line to standard error, first
after a second, and wipes it at the end, so that what is quick and what runs in a pipe, a service or a test
leaves no trace. ``on_progress=…`` takes its place, and the variable STICKSLIP_PROGRESS, 0 or 1, says whether
there is one.
"""

from __future__ import annotations

import functools
import inspect
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import ParamSpec, TypeVar

from solver.results import units

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


PATIENCE = 1.0  # s without a bar
PAUSE = 0.1  # s between two looks of it
WIDTH = 24
SETTING = "STICKSLIP_PROGRESS"

_Given = ParamSpec("_Given")
_Found = TypeVar("_Found")
_within = threading.local()


def is_watched() -> bool:
    """Whether somebody sees standard error: a terminal, or the notebook of a kernel."""
    said = os.environ.get(SETTING, "")
    if said in ("0", "1"):
        return said == "1"
    kernels = sys.modules.get("ipykernel.kernelapp")
    in_kernel = kernels is not None and kernels.IPKernelApp.initialized()
    return in_kernel or bool(sys.stderr is not None and sys.stderr.isatty())


class Bar:
    """A line of text with a bar; a function of (share done, count so far)."""

    def __init__(self, label: str, clock: Callable[[], float] = time.monotonic) -> None:
        self._label, self._clock = label, clock
        self._begun = self._last = clock()
        self._length = 0

    def __call__(self, share: float, count: int) -> None:
        """Draw the line anew, if it is time."""
        now = self._clock()
        if now - self._begun < PATIENCE or now - self._last < PAUSE:
            return
        self._last = now
        share = min(max(share, 0.0), 1.0)
        done, elapsed = round(share * WIDTH), now - self._begun
        left = f", {units.quantity(elapsed * (1.0 / share - 1.0), 's')} left" if share > 0.02 else ""
        bar = f"{'█' * done}{'·' * (WIDTH - done)}"
        line = f"{self._label} |{bar}| {100.0 * share:3.0f} %, {count}, {units.quantity(elapsed, 's')}{left}"
        self._write(f"\r{line.ljust(self._length)}")
        self._length = len(line)

    def close(self) -> None:
        """Wipe the line."""
        if self._length:
            self._write(f"\r{' ' * self._length}\r")
            self._length = 0

    def _write(self, text: str) -> None:
        sys.stderr.write(text)
        sys.stderr.flush()


def shows_progress(label: str) -> Callable[[Callable[_Given, _Found]], Callable[_Given, _Found]]:
    """Give a function that takes `on_progress` a bar of its own where none is given and somebody watches.

    Computations within another one have none.
    """

    def with_bar(function: Callable[_Given, _Found]) -> Callable[_Given, _Found]:
        if "on_progress" not in inspect.signature(function).parameters:
            raise TypeError(f"{function.__name__} takes no `on_progress`")

        @functools.wraps(function)
        def watched(*args: _Given.args, **kwargs: _Given.kwargs) -> _Found:
            outermost = not getattr(_within, "another", False)
            if not outermost:
                return function(*args, **kwargs)
            bar = None
            if kwargs.get("on_progress") is None and is_watched():
                bar = Bar(label)
                kwargs["on_progress"] = bar
            _within.another = True
            try:
                return function(*args, **kwargs)
            finally:
                _within.another = False
                if bar is not None:
                    bar.close()

        return watched

    return with_bar
