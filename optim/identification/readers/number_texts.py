"""Numbers as texts: decimal points or commas, thousands, exponents and complex ones, told by whole columns.

A cell such as 1.446 can be two numbers. What it is, the other cells of its column tell, or the other columns
of the file; where nothing tells it, it is asked.
"""

from __future__ import annotations

import math
import re
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from optim.problem.checks import DataError
from optim.problem.variables import Real
from solver.jit.fourier import Complex

DECIMAL = "decimal"
"""The word that says which it is."""
POINT, COMMA = "point", "comma"
_MARKS = {POINT: ".", COMMA: ","}
_PLAIN = str.maketrans(dict.fromkeys("\u00a0\u202f\u2009", " ") | {"\u2019": "'", "\u2212": "-"})
_WORDS = re.compile(r"[+-]?(nan|inf|infinity)", re.IGNORECASE)
_SIGN = re.compile(
    r"(?<=[^eEdD+-])[+-]{1,2}(?=(?:[^+-]|(?<=[eEdD])[+-])*$)"
)  # before an imaginary part, also +-


@dataclass(frozen=True, slots=True)
class NumberFormat:
    """How numbers are written."""

    decimal: str
    group: str = ""


_FORMATS = tuple(
    NumberFormat(decimal, group)
    for decimal, other in ((".", ","), (",", "."))
    for group in ("", other, " ", "'")
)


@cache
def _pattern(form: NumberFormat) -> re.Pattern[str]:
    decimal, group = re.escape(form.decimal), re.escape(form.group)
    grouped = rf"[1-9]\d{{0,2}}(?:{group}\d{{3}})+(?:{decimal}\d*)?|" if form.group else ""
    return re.compile(rf"[+-]?(?:{grouped}(?:\d+(?:{decimal}\d*)?|{decimal}\d+)(?:[eEdD][+-]?\d+)?)")


def plain(cell: str) -> str:
    """Return a cell with one kind of space, apostrophe and minus."""
    return cell.translate(_PLAIN).strip()


def is_number(cell: str) -> bool:
    """Whether a cell is a number in any way of writing one."""
    return any(_value(plain(cell), form) is not None for form in _FORMATS)


def decimal_of(cells: Iterable[str]) -> str:
    """Return what stands before decimals: a comma if any cell can be a number in no other way."""
    points, commas = ([form for form in _FORMATS if form.decimal == mark] for mark in ".,")
    for cell in map(plain, cells):
        if all(_value(cell, form) is None for form in points) and any(
            _value(cell, form) is not None for form in commas
        ):
            return ","
    return "."


def _real(cell: str, form: NumberFormat) -> float | None:
    if _WORDS.fullmatch(cell):
        return math.nan if "nan" in cell.lower() else float(cell)
    if not _pattern(form).fullmatch(cell):
        return None
    bare = cell.replace(form.group, "") if form.group else cell
    return float(bare.replace(form.decimal, ".").replace("D", "e").replace("d", "e"))


def _value(cell: str, form: NumberFormat) -> complex | float | None:
    """Return the number of a cell, complex of 1+2i, (1+-2j) or 2i; None if it is none."""
    bare = cell[1:-1] if cell.startswith("(") and cell.endswith(")") else cell
    if not bare.endswith(("i", "j")):
        return _real(cell, form)
    bare = re.sub(r"\s*([+-])\s*", r"\1", bare[:-1].rstrip("*"))
    sign = _SIGN.search(bare)
    real, imag = (bare[: sign.start()], sign[0][-1] + bare[sign.end() :]) if sign else ("0", bare)
    x, y = _real(real, form), _real(imag if imag[-1:].isdigit() or imag[-1:] in ".," else f"{imag}1", form)
    return None if x is None or y is None else complex(x, y)


def columns_of(
    source: str, columns: Sequence[tuple[str, Sequence[str]]], lines: Sequence[int], *, decimal: str | None,
    comma_between: bool,
) -> list[Real | Complex]:  # fmt: skip
    """Return the numbers of columns.

    Parameters
    ----------
    source : the file, for messages.
    columns : name and cells, (n,) each.
    lines : of the rows, (n,).
    decimal : `POINT` or `COMMA` where that is said; None where it is to be told.
    comma_between : whether commas stand between the cells: a comma within one was quoted.

    Raises
    ------
    DataError
        A cell that is no number, with its line; or numbers that can be two, with the word that settles it.
    """
    if decimal not in (None, *_MARKS):
        raise DataError(source, decimal, f"`{DECIMAL}` must be {POINT} or {COMMA}")
    named = [(name, [plain(cell) for cell in cells]) for name, cells in columns]
    quoted = any("," in cell for _, cells in named for cell in cells)
    mark = "." if comma_between and not quoted and decimal is None else _MARKS.get(decimal or "")
    forms = [form for form in _FORMATS if mark in (None, form.decimal)]
    found = [_readings(source, name, cells, lines, forms) for name, cells in named]
    sure = [set(readings) for readings in found if len(set(readings.values())) == 1]
    common = set(forms).intersection(*(each for each in sure if len({form.decimal for form in each}) == 1))
    told = common if len({form.decimal for form in common}) == 1 else set[NumberFormat]()
    return [
        np.array(_only(source, name, cells, readings, told))
        for (name, cells), readings in zip(named, found, strict=True)
    ]


_Reading = tuple[complex | float, ...]


def _readings(
    source: str, name: str, cells: Sequence[str], lines: Sequence[int], forms: Sequence[NumberFormat]
) -> dict[NumberFormat, _Reading]:
    """Return what a column can be, by the way its numbers are written."""
    found = {}
    for form in forms:
        values = tuple(value for cell in cells if (value := _value(cell, form)) is not None)
        if len(values) == len(cells):
            found[form] = values
    if found:
        return found
    for cell, line in zip(cells, lines, strict=True):
        if all(_value(cell, form) is None for form in forms):
            wanted = (
                "must be a number" if cell else "must be a number: leave the whole row out if it is missing"
            )
            raise DataError(source, cell, wanted, line=line, column=name)
    raise _mixed(source, name, next((cell for cell in cells if "," in cell), cells[0]))


def _mixed(source: str, name: str, cell: str) -> DataError:
    wanted = "must have the same decimal and thousands separators as the rest of its column and the file"
    return DataError(source, cell, wanted, column=name)


def _only(
    source: str, name: str, cells: Sequence[str], readings: Mapping[NumberFormat, _Reading],
    told: Container[NumberFormat],
) -> _Reading:  # fmt: skip
    """Return the one reading of a column, by what the other columns tell if it alone does not."""
    likely = {form: values for form, values in readings.items() if form in told} or readings
    even = {values for form, values in likely.items() if not _uneven(cells, form)}
    if len(even) == 1:
        return even.pop()
    different = sorted(even, key=lambda values: [abs(value) for value in values])
    if not different:
        raise _mixed(source, name, next(cell for cell in cells if "." in cell or "," in cell))
    at = next(i for i in range(len(cells)) if len({values[i] for values in different}) > 1)
    wanted = (
        f"can be {different[0][at]:.10g} or {different[-1][at]:.10g}: say which by `{DECIMAL}={POINT}` or "
        f"`{DECIMAL}={COMMA}` behind the name of the file, FILE:{DECIMAL}={POINT}, or in a line "
        f"`# {DECIMAL} = {POINT}` of it"
    )
    raise DataError(source, cells[at], wanted, column=name)


def _uneven(cells: Sequence[str], form: NumberFormat) -> bool:
    """Whether thousands are apart in some cells and not in others."""
    if form.group not in (".", ","):
        return False
    whole = [cell.partition(form.decimal)[0] for cell in cells]
    return any(form.group in cell for cell in whole) and any(re.search(r"\d{4}", cell) for cell in whole)
