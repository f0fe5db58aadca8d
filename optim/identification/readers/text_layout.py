"""How a text is laid out: what stands between its cells, where the headings are, where the rows begin."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

from optim.identification.data.measured_table import split_head
from optim.identification.data.measured_units import any_unit
from optim.identification.readers.number_texts import decimal_of, is_number
from optim.problem.checks import DataError

SEPARATORS = (";", "\t", ",", "|")
_LOOKED_AT = 200  # lines
_ROUND = re.compile(r"^(?P<name>.*?)\s*(?:\((?P<round>.*)\)|\bin\s+(?P<word>\S+))\s*$")
_UNIVERSAL = re.compile(r"\s{4}-1\s*\n\s*\d+b?\b")


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """How a text is laid out."""

    separator: Annotated[str, "Between cells."]
    head_line: Annotated[int, "Of the headings, from 1."]
    heads: Annotated[tuple[str, ...], "As they stand there, with the units that a line below them has."]
    rows: Annotated[Mapping[int, Sequence[str]], "Line to its cells."]

    @property
    def decimal(self) -> str:
        """What stands before decimals."""
        return decimal_of(cell for row in self.rows.values() for cell in row)

    def column(self, index: int) -> list[str]:
        """Return the cells below a heading; empty where a row ends before."""
        return [row[index] if index < len(row) else "" for row in self.rows.values()]


def layout_of(text: str, name: str) -> Layout:
    """Return how a text is laid out.

    Headings are the first line without a number, as wide as most rows are, above a row with numbers (between
    them there may be a line of units).

    Parameters
    ----------
    text : of a file.
    name : of the file, for messages.

    Raises
    ------
    DataError
        There are no such lines.
    """
    if _UNIVERSAL.match(text):
        raise DataError(name, text[:20], "is a universal file: give the file, ending in .uff, to the command")
    lines = {
        number: line for number, line in enumerate(text.removeprefix("\ufeff").splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    }  # fmt: skip
    separator = _separator(list(lines.values())[-_LOOKED_AT:])
    cells = {
        number: [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]
        for number, line in lines.items()
    }
    order, rows = list(cells), list(cells.values())
    numeric = [any(map(is_number, row)) for row in rows]
    wide = Counter(_width(row) for row, has in zip(rows, numeric, strict=True) if has)
    width = max(wide, key=lambda cells: (wide[cells], cells), default=0)
    units_below = [all(map(_is_unit, row)) for row in rows[1:-1]] + [False]
    begins = [at + 1 + units for at, units in enumerate(units_below[: len(rows) - 1])]
    above = [at for at, first in enumerate(begins) if numeric[first] and not numeric[at]]
    at = next((each for each in above if _width(rows[each]) >= width), next(iter(above), None))
    if at is None:
        wanted = (
            "must have a line of column heads, the names of the columns such as frequency,amplitude [mm], "
            "and rows of numbers below it"
        )
        raise DataError(name, f"{len(lines)} lines", wanted, line=next(iter(lines), 1))
    units = rows[at + 1] if begins[at] == at + 2 else []
    told = max(_width(rows[at]), *(_width(row) for row in rows[begins[at] :]))
    return Layout(
        separator=separator, head_line=order[at], heads=tuple(_with_units(rows[at], units)[:told]),
        rows={order[each]: rows[each] for each in range(begins[at], len(rows))},
    )  # fmt: skip


def _with_units(heads: Sequence[str], units: Sequence[str]) -> list[str]:
    """Return headings with the units of a line below them."""
    if len(units) != len(heads):
        return list(heads)
    return [f"{head} [{bare(unit)}]" if bare(unit) else head for head, unit in zip(heads, units, strict=True)]


def _width(row: Sequence[str]) -> int:
    """Return up to which cell a row has anything."""
    return max((at for at, cell in enumerate(row, start=1) if cell), default=0)


def _separator(lines: Sequence[str]) -> str:
    """Return what stands between the cells: what most lines have equally often, at least once."""
    best, most = ",", 0
    for one in SEPARATORS:
        counts = Counter(len(next(csv.reader([line], delimiter=one))) for line in lines)
        cells, how_often = max(counts.items(), key=lambda item: (item[1], item[0])) if counts else (1, 0)
        if cells > 1 and how_often > most:
            best, most = one, how_often
    return best


def bare(unit: str) -> str:
    """Return a unit without brackets around all of it."""
    inner = unit[1:-1] if unit[:1] + unit[-1:] in ("[]", "()") else unit
    return inner if inner.count("(") == inner.count(")") and not re.match(r"[^(]*\)", inner) else unit


def _is_unit(cell: str) -> bool:
    return bare(cell) in ("", "-") or any_unit(bare(cell))


def heading_unit(heading: str) -> tuple[str, str | None]:
    """Return the name and the unit of a heading, in brackets of either form or behind ``in``."""
    name, unit = split_head(heading)
    if unit is None and (match := _ROUND.match(heading)):
        found = match["round"] or match["word"] or ""
        if any_unit(found.strip()):
            return match["name"], found.strip()
    return name, unit
