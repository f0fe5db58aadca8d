"""CSV: lines ``# key = value``, a line of column heads, then rows of numbers."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from optim.errors import DataError
from optim.identification.data.table import Table, split_head
from optim.identification.readers.registry import DataFormat, Head, read_head, table_of
from solver.jit.fourier import Real

_SEPARATORS = (";", "\t", ",")
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")


def read_csv(path: Path, paths: frozenset[str]) -> list[Table]:
    """Read a file.

    Raises
    ------
    DataError
        What is wrong, with its line.
    """
    try:
        text = path.read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(str(path), str(error), "must be a text file in UTF-8") from error
    return [read_text(text, path.name, paths).table]


@dataclass(frozen=True, slots=True, kw_only=True)
class FromText:
    """What a text of CSV says: its table in SI units, and the same in the words of a description."""

    table: Table
    job_table: dict[str, Any]


def described(text: str, name: str, paths: frozenset[str]) -> FromText:
    """Read a text that came under a name.

    Raises
    ------
    DataError
        What is wrong, with its line.
    """
    return read_text(text.removeprefix("\ufeff"), name, paths)


def read_text(text: str, name: str, paths: frozenset[str]) -> FromText:
    """Read a text.

    Parameters
    ----------
    text : of a file.
    name : of the file, for messages.
    paths : parameter paths of the scene.

    Raises
    ------
    DataError
        What is wrong, with its line.
    """
    lines = {number: line.strip() for number, line in enumerate(text.splitlines(), start=1) if line.strip()}
    remarks = {number: line for number, line in lines.items() if line.startswith("#")}
    rows = {number: line for number, line in lines.items() if not line.startswith("#")}
    head = read_head(name, remarks, paths)
    if len(rows) < 2:
        raise DataError(
            name, f"{len(rows)} lines", "must have a line of column heads and rows of numbers",
            line=next(iter(rows), 1),
        )  # fmt: skip
    head_line = next(iter(rows))
    separator = next((one for one in _SEPARATORS if one in rows[head_line]), ",")
    heads = [text.strip().strip('"') for text in rows.pop(head_line).split(separator)]
    _check_heads(name, head_line, heads)
    numbers = np.array([_row(name, line, text, separator, heads) for line, text in rows.items()])
    at = np.array(list(rows), np.int64)
    table = table_of(name, heads, list(numbers.T), head, paths, lines=at, head_line=head_line)
    return FromText(table=table, job_table=_job_table(heads, numbers, head))


def _job_table(heads: list[str], numbers: Real, head: Head) -> dict[str, Any]:
    """Return the columns as lists with their units, conditions and words beside them."""
    split = [split_head(text) for text in heads]
    return {
        **head.words,
        **{name: column.tolist() for (name, _), column in zip(split, numbers.T, strict=True)},
        "units": {name: unit for name, unit in split if unit is not None},
        "conditions": dict(head.conditions),
    }


def _check_heads(source: str, line: int, heads: list[str]) -> None:
    """Refuse a first line of numbers: the columns have no names."""
    try:
        first = [float(text) for text in heads]
    except ValueError:
        return
    raise DataError(
        source, first, "must be the names of the columns, such as frequency,amplitude [mm]", line=line
    )


def _row(source: str, line: int, text: str, separator: str, heads: list[str]) -> list[float]:
    cells = [cell.strip() for cell in text.split(separator)]
    if len(cells) != len(heads):
        wanted = f"must have {len(heads)} numbers, as the heads have columns"
        raise DataError(source, f"{len(cells)}", wanted, line=line)
    return [_number(source, line, name, cell, separator) for name, cell in zip(heads, cells, strict=True)]


def _number(source: str, line: int, column: str, cell: str, separator: str) -> float:
    try:
        return float(cell)
    except ValueError:
        # Between semicolons or tabs a comma can stand for nothing but decimals.
        if separator != "," and _DECIMAL_COMMA.fullmatch(cell):
            return float(cell.replace(",", "."))
        wanted = "must be a number with a decimal point"
        if not cell:
            wanted = "must be a number: leave the whole row out if it is missing"
        raise DataError(source, cell, wanted, line=line, column=column) from None


FORMAT = DataFormat(
    name="CSV",
    suffixes=(".csv", ".tsv", ".txt"),
    help="Units in the heads, `amplitude [mm]`; conditions in lines `# shroud.N0 = 200` or in columns of "
    "that name; commas, semicolons or tabs between.",
    read=read_csv,
)
