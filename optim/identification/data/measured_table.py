"""A table of measured numbers in SI units, the units of columns, and the checks all kinds of data share."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Annotated

import numpy as np

from optim.identification.data.measured_units import Unit
from optim.problem.checks import DataError
from optim.problem.variables import Real
from solver.errors import Place
from solver.jit.fourier import Integer

_HEAD = re.compile(r"^\s*(?P<name>[^\[\]]*?)\s*(?:\[\s*(?P<unit>[^\[\]]*?)\s*\])?\s*$")


def split_head(text: str) -> tuple[str, str | None]:
    """Return name and unit of a column head, ``amplitude [mm]``; no unit is None."""
    match = _HEAD.match(text)
    if match is None:
        return text.strip(), None
    return match["name"], match["unit"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """Rows measured under conditions."""

    source: Annotated[str, "The file, or the place in a description; messages begin with it."]
    columns: Annotated[Mapping[str, Real], "Name to (n,) numbers, in Hz, m (or m/s, m/s²), deg, N, s."]
    units: Annotated[Mapping[str, Unit], "Name to what unit it had, of columns of a motion."] = field(
        default_factory=dict
    )
    path_units: Annotated[Mapping[str, str], "Unit that a column of a parameter path names."] = field(
        default_factory=dict
    )
    conditions: Annotated[
        Mapping[str, float],
        "Parameter path to the value it had for all rows; a column named as a path has a value for each row.",
    ] = field(default_factory=dict)
    words: Annotated[Mapping[str, str], "What else the head says: ``dof``, ``contact``, ``kind``."] = field(
        default_factory=dict
    )
    lines: Annotated[Integer, "Line of each row in the file, (n,); empty where there are no lines."] = field(
        default_factory=lambda: np.zeros(0, np.int64)
    )
    place: Annotated[Place, "Where it stands in a description."] = ("data",)

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()), ()))

    def line(self, row: int) -> int | None:
        """Return the line of a row, if it has one."""
        return int(self.lines[row]) if row < self.lines.size else None

    def error(self, row: int, column: str, wanted: str, value: object = None) -> DataError:
        """Return the refusal of a number."""
        shown = float(self.columns[column][row]) if value is None else value
        source = self.source if self.lines.size else f"{self.source}, row {row}"
        return DataError(
            source, shown, wanted, line=self.line(row), column=column, place=self.place
        )  # fmt: skip

    def refusal(self, value: object, wanted: str) -> DataError:
        """Return the refusal of the whole."""
        return DataError(self.source, value, wanted, place=self.place)

    def need(self, fewest: int, what: str) -> None:
        """Raise DataError unless there are so many rows."""
        if len(self) < fewest:
            raise self.refusal(f"{len(self)} rows", f"must have at least {fewest} {what}")

    def number(self, word: str, default: float) -> float:
        """Return a number of the head.

        Raises
        ------
        DataError
            It is no number > 0.
        """
        text = self.words.get(word)
        if text is None:
            return default
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not (math.isfinite(value) and value > 0.0):
            raise self.refusal(text, f"`{word}` must be a number > 0")
        return value


def check_numbers(table: Table) -> None:
    """Raise DataError at the first number that is none, or infinite; and for no rows at all."""
    if not len(table):
        raise table.refusal("0 rows", "must have rows of numbers")
    for name, values in table.columns.items():
        if len(values) != len(table):
            wanted = f"must have {len(table)} numbers as the other columns"
            raise DataError(table.source, len(values), wanted, column=name, place=table.place)
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            raise table.error(
                int(bad[0]), name, "must be a finite number: leave the whole row out if it is missing"
            )


def check_sign(table: Table, column: str, *, positive: bool) -> None:
    """Raise DataError at the first number below 0, or not above."""
    values = table.columns[column]
    bad = np.flatnonzero(values <= 0.0 if positive else values < 0.0)
    if bad.size:
        raise table.error(int(bad[0]), column, "must be > 0" if positive else "must be >= 0")


def check_monotone(table: Table, column: str) -> None:
    """Raise DataError where a column turns back or repeats itself."""
    steps = np.diff(table.columns[column])
    way = np.sign(steps[0]) if steps.size else 1.0
    bad = np.flatnonzero(steps * way <= 0.0) if way != 0.0 else np.zeros(1, np.int64)
    if bad.size:
        wanted = (
            "must go on upward or downward as the sweep did: sort the rows, average repeated ones, and put "
            "sweeps there and back into runs of their own"
        )
        raise table.error(int(bad[0]) + 1, column, wanted)


def runs_of(table: Table, paths: Sequence[str]) -> Iterator[Table]:
    """Yield the rows of each run: those that follow each other under the same conditions, columns `paths`."""
    if not paths:
        yield table
        return
    values = np.column_stack([table.columns[path] for path in paths])
    changes = np.flatnonzero(np.any(np.diff(values, axis=0) != 0.0, axis=1)) + 1
    ends = [0, *changes.tolist(), len(table)]
    for first, end in pairwise(ends):
        kept = {name: column[first:end] for name, column in table.columns.items() if name not in paths}
        here = {path: float(values[first, i]) for i, path in enumerate(paths)}
        yield replace(
            table, columns=kept, conditions={**table.conditions, **here}, lines=table.lines[first:end],
            source=table.source,
        )  # fmt: skip
