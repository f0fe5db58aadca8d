"""Exports of rigs: whatever stands between cells and in front of decimals, and headings of one's own.

A text is laid out into lines of cells; for each heading is chosen what it is and in which unit; the same
lines in the words of `csv_text` are then read as any other file, so that what is wrong has its line.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from optim.errors import DataError
from optim.identification.data.measured import known_columns
from optim.identification.data.table import Dimension, known_units, split_head, unit_of
from optim.identification.readers.csv_text import FromText, described

SEPARATORS = (";", "\t", ",", "|")
LEFT_OUT = ""
FORCE = "excitation.amplitude"
_LOOKED_AT = 200  # lines
_NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)(e[+-]?\d+)?", re.IGNORECASE)
_COMMA = re.compile(r"[+-]?\d*,\d+(e[+-]?\d+)?", re.IGNORECASE)
_ROUND = re.compile(r"^(?P<name>.*?)\s*(?:\(\s*(?P<round>[^()]*?)\s*\)|\bin\s+(?P<word>\S+))\s*$")
_SPELLED = {
    "μm": "µm",
    "grad": "deg",
    "°": "deg",
    "upm": "1/min",
    "u/min": "1/min",
    "rpm": "1/min",
    "m/s^2": "m/s2",
    "m/s²": "m/s2",
}
# What a heading says of itself, in the languages rigs are set to, the most telling first.
_WORDS: tuple[tuple[str, str], ...] = (
    (r"half.*peak|halbe.*spitze", "half_peak_to_peak"),
    (r"phas", "phase"),
    (r"freq", "frequency"),
    (r"spitze|peak|max|scheitel", "max_abs"),
    (r"real", "real"),
    (r"imag", "imag"),
    (r"ampl|weg|auslenk|displ|beschl|accel|geschw|veloc|schwing", "amplitude"),
    (r"kraft|force|erreg", FORCE),
)


@dataclass(frozen=True, slots=True)
class Choice:
    """What a column is: a name of `known_columns`, a parameter path, or nothing; its unit, None for SI."""

    quantity: str
    unit: str | None = None

    @classmethod
    def told(cls, text: str) -> tuple[str, Choice]:
        """Return heading and choice of ``HEADING=QUANTITY[:UNIT]``.

        Raises
        ------
        DataError
            It has another form.
        """
        heading, sign, rest = text.rpartition("=")
        if not sign or not heading.strip():
            raise DataError("column", text, "must be HEADING=QUANTITY:UNIT, such as Weg=amplitude:mm")
        quantity, _, unit = rest.partition(":")
        return heading.strip(), cls(quantity.strip(), _spelled(unit.strip()) or None)


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """How a text is laid out."""

    separator: Annotated[str, "Between cells."]
    decimal: Annotated[str, "Before decimals."]
    head_line: Annotated[int, "Of the headings, from 1."]
    heads: Annotated[tuple[str, ...], "As they stand there, with the units that a line below them has."]
    rows: Annotated[Mapping[int, Sequence[str]], "Line to its cells."]


def layout_of(text: str, name: str) -> Layout:
    """Return how a text is laid out.

    Parameters
    ----------
    text : of a file.
    name : of the file, for messages.

    Raises
    ------
    DataError
        No line of numbers stands below a line of headings.
    """
    lines = {
        number: line for number, line in enumerate(text.removeprefix("\ufeff").splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    }  # fmt: skip
    separator = _separator(list(lines.values())[-_LOOKED_AT:])
    cells = {
        number: [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]
        for number, line in lines.items()
    }
    first = next(
        (number for number, row in cells.items() if _numbers(row, separator) * 2 > sum(map(bool, row))), None
    )
    above = [number for number in cells if first is not None and number < first]
    if first is None or not above:
        raise DataError(
            name, f"{len(lines)} lines", "must have a line of headings and rows of numbers below it", line=1
        )
    heads, head_line = cells[above[-1]], above[-1]
    if len(above) > 1 and len(cells[above[-2]]) == len(heads) and all(_is_unit(cell) for cell in heads):
        head_line = above[-2]
        heads = [
            f"{head} [{unit.strip('[]()')}]" if unit.strip("[]()") else head
            for head, unit in zip(cells[head_line], heads, strict=True)
        ]
    rows = {number: row for number, row in cells.items() if number >= first}
    commas = sum(bool(_COMMA.fullmatch(cell)) for row in rows.values() for cell in row)
    return Layout(
        separator=separator, decimal="," if separator != "," and commas else ".", head_line=head_line,
        heads=tuple(heads), rows=rows,
    )  # fmt: skip


def _separator(lines: Sequence[str]) -> str:
    """Return what stands between the cells: what most lines have equally often, at least once."""
    best, most = ",", 0
    for one in SEPARATORS:
        counts = Counter(len(next(csv.reader([line], delimiter=one))) for line in lines)
        cells, how_often = max(counts.items(), key=lambda item: (item[1], item[0])) if counts else (1, 0)
        if cells > 1 and how_often > most:
            best, most = one, how_often
    return best


def _numbers(row: Sequence[str], separator: str) -> int:
    return sum(bool(_NUMBER.fullmatch(cell)) and not (separator == "," and "," in cell) for cell in row)


def _is_unit(cell: str) -> bool:
    plain = _spelled(cell.strip("[]()"))
    return plain in ("", "-") or any(unit_of(dimension, plain) for dimension in Dimension)


def _spelled(unit: str) -> str:
    return _SPELLED.get(unit.lower(), unit)


def heading_unit(heading: str) -> tuple[str, str | None]:
    """Return the name and the unit of a heading, in brackets of either form or behind ``in``."""
    name, unit = split_head(heading)
    if unit is None and (match := _ROUND.match(heading)):
        found = _spelled(match["round"] or match["word"] or "")
        if any(unit_of(dimension, found) for dimension in Dimension):
            return match["name"], found
    return name, None if unit is None else _spelled(unit)


def guesses(layout: Layout, paths: frozenset[str]) -> tuple[Choice, ...]:
    """Return what the columns are likely to be, each once; those that say nothing are left out."""
    known, taken, found = known_columns(), set[str](), []
    for index, heading in enumerate(layout.heads):
        name, unit = heading_unit(heading)
        numeric = any(_NUMBER.fullmatch(row[index]) for row in layout.rows.values() if index < len(row))
        quantity = name if name in known or name in paths else _guess(name, unit, paths)
        if quantity in taken or not numeric or not _fits(quantity, unit, paths):
            quantity = LEFT_OUT
        taken.add(quantity)
        found.append(Choice(quantity, unit if quantity else None))
    return tuple(found)


def _guess(name: str, unit: str | None, paths: frozenset[str]) -> str:
    for pattern, quantity in _WORDS:
        if re.search(pattern, name, re.IGNORECASE) and _fits(quantity, unit, paths):
            return quantity
    by_unit = (
        (Dimension.FREQUENCY, "frequency"),
        (Dimension.ANGLE, "phase"),
        (Dimension.LENGTH, "amplitude"),
    )
    return next((quantity for dimension, quantity in by_unit if unit and unit_of(dimension, unit)), LEFT_OUT)


def _fits(quantity: str, unit: str | None, paths: frozenset[str]) -> bool:
    """Whether a quantity is known here and may have the unit."""
    if quantity in paths:
        return quantity != FORCE or unit_of(Dimension.FORCE, unit) is not None
    known = known_columns()
    return quantity in known and unit_of(known[quantity].dimension, unit) is not None


def units_for(quantity: str, paths: frozenset[str]) -> tuple[str, ...]:
    """Return the units a column of a quantity may be in; none of a parameter but a force, which is in SI."""
    if quantity in paths:
        return known_units(Dimension.FORCE) if quantity == FORCE else ()
    known = known_columns()
    return known_units(known[quantity].dimension) if quantity in known else ()


def read_export(
    text: str,
    name: str,
    paths: frozenset[str],
    choices: Mapping[str, Choice],
    conditions: Mapping[str, str] | None = None,
) -> FromText:
    """Read a text with what its columns are.

    Parameters
    ----------
    text, name : of the file.
    paths : parameter paths of the scene.
    choices : heading to what it is, with or without its unit; headings that are not there are left out.
    conditions : keys of a head with their values, for all rows.

    Raises
    ------
    DataError
        What is wrong, with its line in the export.
    """
    layout = layout_of(text, name)
    unknown = [
        heading
        for heading in choices
        if heading not in layout.heads and heading not in map(_name_of, layout.heads)
    ]
    if unknown:
        raise DataError(
            name, unknown[0], f"must be a heading: {', '.join(layout.heads)}", line=layout.head_line
        )
    chosen = {}
    for index, heading in enumerate(layout.heads):
        choice = choices.get(heading, choices.get(_name_of(heading)))
        if choice is not None and choice.quantity != LEFT_OUT:
            unit = choice.unit if choice.unit is not None else heading_unit(heading)[1]
            chosen[index] = (choice.quantity, unit)
    factors = {
        index: _factor(name, layout, *choice) for index, choice in chosen.items() if choice[0] in paths
    }
    lines = [line if line.lstrip().startswith("#") else "" for line in text.splitlines()]
    heads = [
        quantity if unit is None or index in factors else f"{quantity} [{unit}]"
        for index, (quantity, unit) in chosen.items()
    ]
    lines[layout.head_line - 1] = ",".join(heads)
    for number, row in layout.rows.items():
        cells = [row[index] if index < len(row) else "" for index in chosen]
        plain = [cell.replace(",", ".") if layout.decimal == "," else cell for cell in cells]
        lines[number - 1] = ",".join(
            _scaled(cell, factors.get(index, 1.0)) for index, cell in zip(chosen, plain, strict=True)
        )  # fmt: skip
    return described(
        "\n".join([*lines, *(f"# {key} = {value}" for key, value in (conditions or {}).items())]), name, paths
    )


def _name_of(heading: str) -> str:
    return heading_unit(heading)[0]


def _factor(name: str, layout: Layout, quantity: str, unit: str | None) -> float:
    """Return what a number in the unit of a parameter is in SI."""
    found = unit_of(Dimension.FORCE, unit) if quantity == FORCE else unit_of(Dimension.NUMBER, unit or None)
    if found is None and quantity == FORCE:
        raise DataError(
            name,
            unit,
            f"must be in {', '.join(known_units(Dimension.FORCE))}",
            line=layout.head_line,
            column=quantity,
        )
    return 1.0 if found is None else found.factor


def _scaled(cell: str, factor: float) -> str:
    if factor == 1.0 or not _NUMBER.fullmatch(cell):
        return cell
    return repr(float(cell) * factor)


def text_of(path: Path) -> str:
    """Return the text of a file in UTF-8, or in the code page of western Windows.

    Raises
    ------
    DataError
        It cannot be read.
    """
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise DataError(str(path), str(error), "must be a text file") from error
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("cp1252", errors="replace")
