"""CSV and other text: lines ``# key = value``, a line of column heads, then rows of numbers.

Whatever stands between cells, in front of decimals and between thousands is told from the whole; lines above
the headings and a line of units below them are told apart.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from optim.identification.data.measured_table import Table, split_head
from optim.identification.readers.data_readers import DataFormat, Head, complex_apart, read_head, table_of
from optim.identification.readers.text_layout import (
    COMMA,
    DECIMAL,
    LEFT_OUT,
    POINT,
    Choice,
    Layout,
    columns_of,
    contradiction,
    heading_unit,
    layout_of,
    text_of,
)
from optim.problem.checks import DataError
from optim.problem.variables import Real


@dataclass(frozen=True, slots=True, kw_only=True)
class FromText:
    """What a text of CSV says: its table in SI units, and the same in the words of a description."""

    table: Table
    job_table: dict[str, Any]


def read_csv(path: Path, paths: frozenset[str], words: Mapping[str, str] | None = None) -> list[Table]:
    """Read a file.

    Raises
    ------
    DataError
        What is wrong, with its line.
    """
    return [read_text(text_of(path), path.name, paths, said=words or {}).table]


def read_text(
    text: str, name: str, paths: frozenset[str], choices: Mapping[str, Choice] | None = None,
    said: Mapping[str, str] | None = None,
) -> FromText:  # fmt: skip
    """Read a text.

    Parameters
    ----------
    text, name : of a file.
    paths : parameter paths of the scene.
    choices : heading to what it is, with or without its unit; headings that are not there are left out.
        Without it every heading says itself what it is.
    said : what is said of the whole besides: keys of a head with their values.

    Raises
    ------
    DataError
        What is wrong, with its line.
    """
    remarks = {
        number: line
        for number, line in enumerate(text.splitlines(), start=1)
        if line.lstrip().startswith("#")
    }
    head = read_head(name, remarks, paths, FORMAT.words)
    beside = read_head(
        name, dict(enumerate(f"{key} = {value}" for key, value in (said or {}).items())), paths, FORMAT.words
    )
    words = {**head.words, **beside.words}
    decimal = words.pop(DECIMAL, None)
    head = Head(conditions={**head.conditions, **beside.conditions}, words=words)
    layout = layout_of(text, name)
    chosen = _chosen(layout, name, choices)
    lines = list(layout.rows)
    for line, row in layout.rows.items():
        _check_width(name, layout, line, row, chosen)
    columns = [(heads, layout.column(index)) for index, heads in chosen.items()]
    numbers = columns_of(name, columns, lines, decimal=decimal, comma_between=layout.separator == ",")
    heads, parts = complex_apart(name, list(chosen.values()), numbers)
    table = table_of(
        name, heads, parts, head, paths, lines=np.array(lines, np.int64), head_line=layout.head_line
    )
    return FromText(table=table, job_table=_job_table(heads, parts, head))


def _chosen(layout: Layout, name: str, choices: Mapping[str, Choice] | None) -> dict[int, str]:
    """Return the columns that count, each with its head in the words of files here."""
    if choices is None:
        split = [heading_unit(heading) for heading in layout.heads]
        return {index: _head(*one) for index, one in enumerate(split)}
    names = [heading_unit(heading)[0] for heading in layout.heads]
    unknown = [heading for heading in choices if heading not in layout.heads and heading not in names]
    if unknown:
        wanted = f"must be a heading: {', '.join(layout.heads)}"
        raise DataError(name, unknown[0], wanted, line=layout.head_line)
    chosen = {}
    for index, heading in enumerate(layout.heads):
        choice = choices.get(heading, choices.get(names[index]))
        if choice is None or choice.quantity == LEFT_OUT:
            continue
        unit = choice.unit if choice.unit is not None else heading_unit(heading)[1]
        if wrong := contradiction(heading, choice.quantity, unit):
            raise DataError(name, choice.quantity, wrong, line=layout.head_line, column=heading)
        chosen[index] = _head(choice.quantity, unit)
    return chosen


def _head(quantity: str, unit: str | None) -> str:
    return quantity if unit is None else f"{quantity} [{unit}]"


def _check_width(
    name: str, layout: Layout, line: int, row: list[str] | Any, chosen: Mapping[int, str]
) -> None:
    """Refuse a row that ends before a column that counts, or goes on behind the last heading."""
    wanted = f"must have {len(layout.heads)} numbers, as the heads have columns"
    if any(row[len(layout.heads) :]):
        commas = "; decimal commas between commas must stand in quotes" if layout.separator == "," else ""
        raise DataError(name, f"{len(row)}", wanted + commas, line=line)
    if any(index >= len(row) for index in chosen):
        raise DataError(name, f"{len(row)}", wanted, line=line)


def _job_table(heads: list[str], numbers: list[Real], head: Head) -> dict[str, Any]:
    """Return the columns as lists with their units, conditions and words beside them."""
    split = [split_head(text) for text in heads]
    return {
        **head.words,
        **{name: column.tolist() for (name, _), column in zip(split, numbers, strict=True)},
        "units": {name: unit for name, unit in split if unit is not None},
        "conditions": dict(head.conditions),
    }


FORMAT = DataFormat(
    name="CSV",
    suffixes=(".csv", ".tsv", ".txt", ".lvm"),
    help="Units in the heads, `amplitude [mm]`; conditions in lines `# shroud.N0 = 200` or in columns of "
    "that name; commas, semicolons, tabs or bars between.",
    read=read_csv,
    words={DECIMAL: f"`{POINT}` or `{COMMA}`, where 1.446 can be two numbers."},
)
