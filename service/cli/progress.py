"""Progress on a terminal: bars. In a pipe: nothing."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID


def on_terminal() -> bool:
    """Whether somebody watches."""
    return sys.stderr.isatty()


class Reporter:
    """One bar: how far it is, and the best design so far."""

    def __init__(self, progress: Progress, task: TaskID, counted: str) -> None:
        self._progress, self._task, self._counted = progress, task, counted

    def __call__(self, fraction: float, count: int) -> None:
        """Move the bar."""
        self._progress.update(self._task, completed=fraction, counted=f"{count} {self._counted}")

    def best(self, found: Mapping[str, Any]) -> None:
        """Say the best design so far, which is given as JSON."""
        self._progress.update(self._task, best=told_best(found))


def told_best(found: Mapping[str, Any]) -> str:
    """The best design so far in a few words."""
    from solver.results import units
    from solver.scene.parameter_paths import parameter

    values = [parameter(name.split(",")[0].strip(), value) for name, value in found["values"].items()]
    peak = "" if found["peak"] is None else f": {units.length(found['peak'])}"
    doubt = "" if found["verified"] else ", to be verified"
    broken = "" if found["feasible"] else ", breaks a limit"
    return f"best {', '.join(values)}{peak}{doubt}{broken}"


class _WhenTold(Reporter):
    """A bar that is there from its first report on."""

    def __init__(self, begin: Callable[[], Reporter | None]) -> None:
        self._begin = cache(begin)

    def __call__(self, fraction: float, count: int) -> None:
        """Show the bar and move it."""
        if reporter := self._begin():
            reporter(fraction, count)

    def best(self, found: Mapping[str, Any]) -> None:
        """Show the bar and say the best design so far."""
        if reporter := self._begin():
            reporter.best(found)


@contextmanager
def bar(label: str, counted: str = "points") -> Iterator[Reporter | None]:
    """A progress bar on standard error for the length of a block; None where nobody watches.

    Parameters
    ----------
    label : what is going on.
    counted : what the second number of a progress report counts.
    """
    if not on_terminal():
        yield None
        return
    with ExitStack() as stack:

        def begin() -> Reporter | None:
            return stack.enter_context(bars([label], counted))[0]

        yield _WhenTold(begin)


@contextmanager
def bars(labels: Sequence[str], counted: str) -> Iterator[Sequence[Reporter | None]]:
    """A progress bar for each label, as `bar`."""
    if not on_terminal():
        yield [None] * len(labels)
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn(),
        TextColumn("{task.fields[counted]}"), TextColumn("{task.fields[best]}"),
    )  # fmt: skip
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        tasks = [progress.add_task(label, total=1.0, counted="", best="") for label in labels]
        yield [Reporter(progress, task, counted) for task in tasks]
