"""Progress on a terminal: a bar, and a word about a slow first run. In a pipe: nothing."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

OnProgress = Callable[[float, int], None]

_PATIENCE_SECONDS = 4.0
_FIRST_RUN = (
    "still working: the first run after an installation compiles its kernels, which takes about a minute"
)


def on_terminal() -> bool:
    """Whether the user watches."""
    return sys.stderr.isatty()


@contextmanager
def bar(label: str, counted: str = "points") -> Iterator[OnProgress | None]:
    """A progress bar on standard error for the length of a block; None where nobody watches.

    Parameters
    ----------
    label : what is going on.
    counted : what the second number of a progress report counts.
    """
    if not on_terminal():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn(),
        TextColumn("{task.fields[count]}"),
    )  # fmt: skip
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(label, total=1.0, count="")
        yield lambda fraction, count: progress.update(task, completed=fraction, count=f"{count} {counted}")


@contextmanager
def patience() -> Iterator[None]:
    """Say something on a terminal if the block takes long (it may be compiling)."""
    if not on_terminal():
        yield
        return
    timer = threading.Timer(_PATIENCE_SECONDS, lambda: sys.stderr.write(f"stickslip: {_FIRST_RUN}\n"))
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
