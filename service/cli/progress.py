"""Progress on a terminal: bars, and a word about a slow first run. In a pipe: nothing."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

OnProgress = Callable[[float, int], None]

_PATIENCE_SECONDS = 4.0
_FIRST_RUN = "still at it: a first run after an installation compiles its kernels, which takes about a minute"


def on_terminal() -> bool:
    """Whether somebody watches."""
    return sys.stderr.isatty()


@contextmanager
def bar(label: str, counted: str = "points") -> Iterator[OnProgress | None]:
    """A progress bar on standard error for the length of a block; None where nobody watches.

    Parameters
    ----------
    label : what is going on.
    counted : what the second number of a progress report counts.
    """
    with bars([label], counted) as reporters:
        yield reporters[0]


@contextmanager
def bars(labels: Sequence[str], counted: str) -> Iterator[Sequence[OnProgress | None]]:
    """A progress bar for each label, as `bar`."""
    if not on_terminal():
        yield [None] * len(labels)
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn(),
        TextColumn("{task.fields[counted]}"),
    )  # fmt: skip
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        tasks = [progress.add_task(label, total=1.0, counted="") for label in labels]
        yield [partial(_advance, progress, task, counted) for task in tasks]


@contextmanager
def patience() -> Iterator[None]:
    """Say something on a terminal if the block takes long: it may be compiling."""
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


def _advance(progress: Progress, task: TaskID, counted: str, fraction: float, count: int) -> None:
    progress.update(task, completed=fraction, counted=f"{count} {counted}")
