"""What people read of results, and how the command prints: tables for them, a JSON object for programs."""

from __future__ import annotations

import json
import os
import shutil
import sys
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from itertools import zip_longest
from typing import TYPE_CHECKING, Any

from solver.results import units
from solver.results.told import Block, ResultTable, Summary

if TYPE_CHECKING:
    from service.jobs.kind_registry import Json, Tell

_PIPE_WIDTH = 120
_BOLD, _DIM = "1", "2"
_LISTED = 6
_DEEPEST = 3  # of objects inside objects: what is deeper is in the JSON


def print_json(obj: Mapping[str, object]) -> None:
    """Print one JSON object on one line."""
    sys.stdout.write(json.dumps(obj, allow_nan=False, ensure_ascii=False) + "\n")


def say(text: str) -> None:
    """Print a line."""
    sys.stdout.write(text + "\n")


def print_pairs(title: str, pairs: Iterable[tuple[str, str]]) -> None:
    """Print a heading and names with their values, one a line."""
    listed = list(pairs)
    column = max((len(name) for name, _ in listed), default=0) + 2
    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else _PIPE_WIDTH
    say("\n".join(_styled(line, _BOLD) for line in textwrap.wrap(title, width) or [""]))
    for name, value in listed:
        first, *more = textwrap.wrap(value, max(width - column, 1), break_on_hyphens=False) or [""]
        say(_styled(name.ljust(column), _DIM) + first)
        for line in more:
            say(" " * column + line)


def print_table(title: str, columns: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print rows under column heads, columns of numbers aligned right.

    What identifies a thing, in a column `id`, stands whole on one line, to be copied: other columns fold.
    """
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.table import Table

    made = Table(box=SIMPLE_HEAD, pad_edge=False, show_edge=False)
    listed = list(rows)
    numbers = ResultTable(title, columns, listed).numbers
    for index, (column, right) in enumerate(zip_longest(columns, numbers)):
        whole = max((len(row[index]) for row in listed), default=0) if column == "id" else None
        made.add_column(column, justify="right" if right else "left", overflow="fold", min_width=whole)
    for row in listed:
        made.add_row(*row)
    width = None if sys.stdout.isatty() else _PIPE_WIDTH
    console = Console(highlight=False, markup=False, emoji=False, width=width)
    console.print(title, style="bold")
    console.print(made)


def print_told(blocks: Iterable[Block]) -> None:
    """Print what is told of a result, an empty line before each further heading."""
    for place, block in enumerate(blocks):
        if place and block.title:
            say("")
        if isinstance(block, ResultTable):
            print_table(block.title, block.columns, block.rows)
        else:
            print_pairs(block.title, block.pairs)


def told(kind: str, result: Json, tell: Tell | None) -> tuple[Block, ...]:
    """What people read of a result: as its kind says; of which nothing is said, by its keys."""
    found = Summary(kind, by_keys(result)) if tell is None else tell(result)
    return (found,) if isinstance(found, Summary) else tuple(found)


def by_keys(table: Json, before: str = "", depth: int = 1) -> list[tuple[str, str]]:
    """Names and values of what is one number or word, of long lists how long they are; null says nothing."""
    found: list[tuple[str, str]] = []
    for key, value in table.items():
        if isinstance(value, Mapping):
            found += by_keys(value, f"{before}{key}.", depth + 1) if depth < _DEEPEST else []
        elif value is not None:
            found.append((before + key, _shown(value)))
    return found


def _shown(value: Any) -> str:
    """A value in a few words."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str) or not isinstance(value, Sequence):
        return units.number(value) if isinstance(value, float) else str(value)
    few = len(value) <= _LISTED and not any(isinstance(one, Mapping | list) for one in value)
    return ", ".join(map(_shown, value)) if few else f"{len(value)} values"


def _styled(text: str, style: str) -> str:
    """Text in a style, where somebody watches a terminal that has styles and wants them."""
    plain = not sys.stdout.isatty() or "NO_COLOR" in os.environ or os.environ.get("TERM") == "dumb"
    return text if plain else f"\x1b[{style}m{text}\x1b[0m"
