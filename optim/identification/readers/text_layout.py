"""How a text is laid out, and what its headings say.

Its encoding is told by a byte order mark, else by what the bytes can be; then what stands between its cells,
where the headings are, where the rows begin; of headings of rigs' exports what a column is said to be, what
it is likely to be, and what it cannot be.
"""

from __future__ import annotations

import codecs
import csv
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

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
from optim.identification.readers.number_texts import decimal_of, is_number
from optim.problem.checks import DataError

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
        return decoded(path.read_bytes())
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
