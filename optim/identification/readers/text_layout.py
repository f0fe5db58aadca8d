"""How a text is laid out, and what its headings say.

Its encoding is told by a byte order mark, else by what the bytes can be; then what stands between its cells,
where the headings are, where the rows begin; of headings of rigs' exports what a column is said to be, what
it is likely to be, and what it cannot be.

A cell such as 1.446 can be two numbers. What it is, the other cells of its column tell, or the other columns
of the file; where nothing tells it, it is asked.
"""

from __future__ import annotations

import codecs
import csv
import math
import re
from collections import Counter
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated

import numpy as np

from optim.identification.data.measured import known_columns
from optim.identification.data.measured_table import (
    Dimension,
    Scaling,
    any_unit,
    known_units,
    no_motion,
    split_head,
    unit_of,
)
from optim.problem.checks import DataError
from optim.problem.variables import Real
from solver.jit.fourier import Complex

DECIMAL = "decimal"
"""The word that says which it is."""
POINT, COMMA = "point", "comma"
_BETWEEN = {POINT: ".", COMMA: ","}
_PLAIN = str.maketrans(dict.fromkeys("\u00a0\u202f\u2009", " ") | {"\u2019": "'", "\u2212": "-"})
_OF_A_NUMBER = re.compile(r"[+-]?(nan|inf|infinity)", re.IGNORECASE)
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
    if _OF_A_NUMBER.fullmatch(cell):
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
    if decimal not in (None, *_BETWEEN):
        raise DataError(source, decimal, f"`{DECIMAL}` must be {POINT} or {COMMA}")
    named = [(name, [plain(cell) for cell in cells]) for name, cells in columns]
    quoted = any("," in cell for _, cells in named for cell in cells)
    mark = "." if comma_between and not quoted and decimal is None else _BETWEEN.get(decimal or "")
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


_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
_BYTES = 4096  # of a text, by which its encoding is told


def text_of(path: Path) -> str:
    """Return the text of a file.

    Raises
    ------
    DataError
        It cannot be read.
    """
    try:
        raw = path.read_bytes()
        if raw.startswith(b"PK"):
            raise DataError(str(path), "a zip archive", "must be text, of a table (.xlsx) its export as CSV")
        return decoded(raw)
    except OSError as error:
        raise DataError(str(path), str(error), "must be a text file") from error


def decoded(raw: bytes) -> str:
    """Return bytes as text: in UTF-8, UTF-16 or UTF-32, else in the code page of western Windows."""
    for mark, encoding in _MARKS:
        if raw.startswith(mark):
            return raw.decode(encoding, errors="replace")
    first = raw[:_BYTES]
    # Of letters and digits in UTF-16 every other byte is zero; text in one byte each has none.
    for at, encoding in ((1, "utf-16-le"), (0, "utf-16-be")):
        if 2 * first[at::2].count(0) > len(first[at::2]) > 0:
            return raw.decode(encoding, errors="replace")
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("cp1252", errors="replace")


SEPARATORS = (";", "\t", ",", "|")
_LINES = 200  # that are looked at
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
    separator = _separator(list(lines.values())[-_LINES:])
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


LEFT_OUT = ""
FORCE = "excitation.amplitude"
# What a heading says of itself, in the languages rigs are set to, the most telling first.
_WORDS: tuple[tuple[str, str], ...] = (
    (r"half.*peak|halbe.*spitze", "half_peak_to_peak"),
    (r"phas", "phase"),
    (r"freq|fréq", "frequency"),
    (r"spitze|peak|max|scheitel", "max_abs"),
    (r"real", "real"),
    (r"imag", "imag"),
    (r"ampl|weg|auslenk|displ|déplac|depl|beschl|accel|accél|geschw|veloc|vitesse|schwing", "amplitude"),
    (r"kraft|force|erreg", FORCE),
)
_PEAK_TO_PEAK = r"(?:pe?a?k|spitze|crête|p)[\s-]?(?:to|zu|à|2)?[\s-]?(?:pe?a?k|spitze|crête|p)\b"
_SCALINGS = (
    (Scaling.RMS, re.compile(r"\brms|\beff(?:ekti[vf]\w*|icace)?\b|\bRMS", re.IGNORECASE)),
    (Scaling.PEAK_TO_PEAK, re.compile(rf"(?<!half )(?<!halbe )(?<!half_)\b{_PEAK_TO_PEAK}", re.IGNORECASE)),
)
# What is no response at a DOF, whatever its unit.
_NO_RESPONSE = (
    ("a coherence", r"coher|kohär|cohér"),
    (
        "a spectral density",
        r"\bpsd\b|\basd\b|\besd\b|spectral.density|leistungsdichte|spektraldichte|densité",
    ),
    ("an auto spectrum, of squares", r"auto.?(?:spec|spek|pow)|power.spec|leistungsspek|interspec|\bgxx\b"),
    ("a cross spectrum, of products", r"cross.?(?:spec|pow)|kreuz.?(?:spek|leis)|\bgxy\b"),
    ("a transmissibility, a motion over a motion", r"transmiss|übertragungsfaktor"),
    ("in decibels", r"\bdB\b"),
)
_BY_FORCE = re.compile(
    r"\bfrf\b|frequency.response|frequenzgang|recept|complian|nachgieb|mobili|accelerance|inertance",
    re.IGNORECASE,
)
_ORDERS = ((2, r"accel|accél|beschl"), (1, r"veloc|vitesse|geschw"), (0, r"displ|déplac|auslenk|\bweg\b"))
_NOT_OVER = re.compile(r"\btime\b|\bzeit\b|\btemps\b", re.IGNORECASE)


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
        return heading.strip(), cls(quantity.strip(), unit.strip() or None)


def guesses(layout: Layout, paths: frozenset[str]) -> tuple[Choice, ...]:
    """Return what the columns are likely to be, each once; those that say nothing are left out."""
    known, taken, found = known_columns(), set[str](), []
    for index, heading in enumerate(layout.heads):
        name, unit = heading_unit(heading)
        numeric = any(map(is_number, layout.column(index)))
        quantity = name if name in known or name in paths else _guess(name, unit, paths)
        scaling = _scaling(name)
        if quantity in ("amplitude", "max_abs") and scaling and unit and unit_of(Dimension.MOTION, unit):
            quantity = "amplitude" if scaling is Scaling.RMS else "half_peak_to_peak"
            unit = f"{unit} {scaling.value}"
        if (
            quantity in taken
            or not numeric
            or not _fits(quantity, unit, paths)
            or contradiction(heading, quantity, unit)
        ):
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


def _scaling(name: str) -> Scaling | None:
    return next((each for each, pattern in _SCALINGS if pattern.search(name)), None)


def contradiction(heading: str, quantity: str, unit: str | None) -> str:
    """Return what is wrong with taking a column for a quantity, as far as its heading says; empty if nothing.

    Parameters
    ----------
    heading : as it stands there.
    quantity : that it is to be, in a unit.
    """
    known = known_columns()
    name = heading_unit(heading)[0]
    if quantity in ("frequency", "resonance_frequency") and _NOT_OVER.search(name):
        return "is a time by its heading: a response is over the frequency"
    if name == quantity or quantity not in known or known[quantity].dimension is not Dimension.MOTION:
        return ""
    motion = unit_of(Dimension.MOTION, unit)
    for what, pattern in _NO_RESPONSE:
        if re.search(pattern, name, re.IGNORECASE):
            return f"is {what} by its heading, not a motion at a DOF: leave it out"
    if motion is None or no_motion(unit or ""):
        return ""  # the unit itself is refused
    scaling = _scaling(name)
    if scaling is not None and motion.scaling is None:
        there = unit or "m"
        return (
            f"is {scaling.value} by its heading: say so by the unit, `{there} {scaling.value}`, which is "
            f"{'√2 times' if scaling is Scaling.RMS else 'halved to'} the amplitude, or `{there} pk`"
        )
    if _BY_FORCE.search(name) and not motion.per_force:
        return "is a motion by a force by its heading: give its unit, such as mm/N or m/s2/N"
    said = [order for order, pattern in _ORDERS if re.search(pattern, name, re.IGNORECASE)]
    if said and motion.order not in said:
        what = ("a displacement", "a velocity", "an acceleration")[said[0]]
        return f"is {what} by its heading: give its unit, such as {('mm', 'mm/s', 'm/s2')[said[0]]}"
    if unit is None and re.search(r"phas|kraft|force", name, re.IGNORECASE):
        return "is no motion by its heading: give its unit"
    return ""


def units_for(quantity: str, paths: frozenset[str]) -> tuple[str, ...]:
    """Return the units a column of a quantity may be in; none of a parameter but a force, which is in SI."""
    if quantity in paths:
        return known_units(Dimension.FORCE) if quantity == FORCE else ()
    known = known_columns()
    return known_units(known[quantity].dimension) if quantity in known else ()
