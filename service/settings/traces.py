"""Traces: off unless the setting `traces` is on, and then free of cost but one look at a name.

What makes and sends spans stands in the lab. A job carries the trace of the request that handed it in
(`traceparent`, W3C Trace Context) through the database to the service that takes it and to the process that
computes it, each of which adds a span.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Protocol

from solver.lab import from_lab

_spans: Any = None  # what makes them, where there are any


class Open(Protocol):
    """A span that began; ended by whoever hears of the end."""

    @property
    def carried(self) -> str | None:
        """What a job carries of it."""

    def end(self, **attributes: Any) -> None:
        """It is over."""


def configure(*, on: bool) -> None:
    """Send the spans of this process, if they are wanted.

    ConfigurationError if the extra `traces` is not installed.
    """
    global _spans
    _spans = None
    if on:
        spans = from_lab("traces.spans")
        spans.configure()
        _spans = spans


def begin(name: str, carried: str | None, **attributes: Any) -> Open | None:
    """Begin a span below what a job carries; None where there are no traces."""
    opened: Open | None = _spans and _spans.begin(name, carried, **attributes)
    return opened


@contextmanager
def span(name: str, carried: str | None, **attributes: Any) -> Iterator[None]:
    """Have a span below what a job carries over the block."""
    opened = begin(name, carried, **attributes)
    try:
        yield
    finally:
        if opened is not None:
            opened.end()


def current() -> str | None:
    """What a job is to carry that is handed in by the request under way."""
    carried: str | None = _spans and _spans.current()
    return carried


def flush() -> None:
    """Send what was not sent yet, if that is quick: the process ends."""
    if _spans is not None:
        _spans.flush()
