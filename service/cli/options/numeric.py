"""Options that take a number."""

from __future__ import annotations

from typing import Any

import typer

from service.cli.options.inputs import number, whole_number


def amount(flag: str, metavar: str, words: str) -> Any:
    """An option that takes a real number, with the words of its help."""
    return typer.Option(flag, metavar=metavar, parser=number, help=words)


def count(flag: str, metavar: str, words: str) -> Any:
    """An option that takes a whole number, with the words of its help."""
    return typer.Option(flag, metavar=metavar, parser=whole_number, help=words)
