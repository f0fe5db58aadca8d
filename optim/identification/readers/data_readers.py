"""The formats of files with measured data, and what they share: column heads, lines of a head, their columns.

A further format is one module and one line in `SHIPPED`; one from outside the package is named by
`solver.extensions`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import numpy as np

from optim.identification.data.measured import known_columns, known_words
from optim.identification.data.measured_table import Scaling, Table, Unit, split_head, unit_of, wanted_unit
from optim.problem.checks import DataError
from optim.problem.variables import Real
from solver.errors import Place
from solver.extensions import Kinds
from solver.jit.fourier import Complex, Integer
from solver.wording import comma_hint, nearest

SHIPPED = (
    "optim.identification.readers.csv_text",
    "optim.identification.readers.parquet",
    "optim.identification.readers.universal",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class DataFormat:
    """A format of files with measured data."""

    name: Annotated[str, "What people call it."]
    suffixes: Annotated[tuple[str, ...], "Endings, lower case, with their dots."]
    help: Annotated[str, "How units and conditions stand in it, a sentence of Markdown."]
    read: Annotated[
        Callable[..., list[Table]],
        "From a path and the names a scene has (parameter paths) to the tables in it; where the file is "
        "given with some of `words`, these with what they say as a third argument.",
    ]
    words: Annotated[
        Mapping[str, str], "What may be said of a file behind its name to read it, each with its meaning."
    ] = field(default_factory=dict)


FORMATS: Kinds[DataFormat] = Kinds(DataFormat, "format", lambda one: one.suffixes, SHIPPED, "FORMAT")
data_formats = FORMATS.every


def format_of(path: Path) -> DataFormat:
    """Return the format of a file by its ending.

    Raises
    ------
    DataError
        An unknown ending.
    """
    formats = FORMATS.known()
    if path.suffix.lower() not in formats:
        raise DataError(str(path), path.suffix, f"must end in {', '.join(formats)}")
    return formats[path.suffix.lower()]


def read_file(path: Path, paths: frozenset[str], words: Mapping[str, str] | None = None) -> list[Table]:
    """Read the tables of a file by its ending.

    Parameters
    ----------
    path : of the file.
    paths : parameter paths, which columns and lines of a head may name.
    words : what is said of the file, of the words its format has.

    Raises
    ------
    DataError
        A file that is not there or has an unknown ending, or what is wrong in it.
    """
    form = format_of(path)
    if not path.is_file():
        raise DataError(str(path), str(path), "must be a file that is there")
    return form.read(path, paths, words) if words else form.read(path, paths)


_PAIR = re.compile(r"^\s*#?\s*(?P<key>[A-Za-z_][\w.@-]*)\s*[=:]\s*(?P<value>.+?)\s*$")
_HARMONIC = re.compile(r"harmonic_(?P<number>[1-9]\d*)")
KIND_WORD = "kind"


@dataclass(frozen=True, slots=True, kw_only=True)
class Head:
    """What stands before the rows: values of parameter paths, and words."""

    conditions: dict[str, float]
    words: dict[str, str]


def read_head(
    source: str, lines: Mapping[int, str], paths: frozenset[str], besides: Container[str] = ()
) -> Head:  # fmt: skip
    """Read lines ``key = value``, each by its number; a line without = or : is a remark.

    Parameters
    ----------
    besides : words that it may have besides those of the kinds of data.

    Raises
    ------
    DataError
        A key with a dot that is no parameter path, or a condition that is no number.
    """
    conditions: dict[str, float] = {}
    words: dict[str, str] = {}
    for number, text in lines.items():
        match = _PAIR.match(text)
        if match is None:
            continue
        key, value = match["key"], match["value"]
        if key in paths:
            conditions[key] = _condition(source, number, key, value)
        elif key == KIND_WORD or key in known_words() or key in besides:
            words[key] = value
        elif "." in key:
            wanted = f"must be a parameter path of the scene{nearest(key, sorted(paths))}"
            raise DataError(source, key, wanted, line=number)
    return Head(conditions=conditions, words=words)


def _condition(source: str, number: int | None, key: str, text: str) -> float:
    try:
        value = float(text.split("#")[0])
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        wanted = f"`{key}` must be a finite number in its SI unit{comma_hint(text)}"
        raise DataError(source, text, wanted, line=number)
    return value


def table_of(
    source: str, heads: Sequence[str], columns: Sequence[Real], head: Head, paths: frozenset[str], *,
    lines: Integer | None = None, head_line: int | None = None, place: Place = ("data",),
) -> Table:  # fmt: skip
    """Return a table in SI units of columns with heads such as ``amplitude [mm]``.

    Parameters
    ----------
    source, place : where it stands.
    heads : names with units; a name is one of `known_columns` or a parameter path; ``harmonic_3`` is the
        amplitude of harmonic 3.
    columns : numbers of each.
    head : conditions and words for all rows.
    lines : of the rows; head_line : of the heads.

    Raises
    ------
    DataError
        An unknown column, one that is there twice, or an unknown unit.
    """
    known = known_columns()
    named: dict[str, Real] = {}
    units: dict[str, Unit] = {}
    path_units: dict[str, str] = {}
    words = dict(head.words)
    for text, values in zip(heads, columns, strict=True):
        name, unit_text = split_head(text)
        if told := _HARMONIC.fullmatch(name):
            name, words["harmonic"] = "amplitude", told["number"]
        if name in named:
            raise DataError(source, name, "must be a column once", line=head_line, place=place)
        if name in paths:
            named[name] = values
            if unit_text is not None:
                path_units[name] = unit_text
            continue
        if name not in known:
            wanted = (
                f"must be one of {', '.join(known)}, or a parameter path of the scene"
                f"{nearest(name, [*known, *sorted(paths)])}"
            )
            raise DataError(source, name, wanted, line=head_line, place=place)
        dimension = known[name].dimension
        unit = unit_of(dimension, unit_text)
        wrong = wanted_unit(dimension, unit_text) if unit is None else _wrong_scaling(name, unit)
        if unit is None or wrong:
            raise DataError(source, unit_text, wrong, line=head_line, column=name, place=place)
        named[name], units[name] = values * unit.factor, unit
    return Table(
        source=source, columns=named, units=units, path_units=path_units, conditions=head.conditions,
        words=words,
        lines=np.zeros(0, np.int64) if lines is None else lines, place=place,
    )  # fmt: skip


def numbers_of(source: str, name: str, values: Iterable[object], place: Place = ("data",)) -> np.ndarray:
    """Return the numbers of a column.

    Raises
    ------
    DataError
        One is none, with its row.
    """
    cells = list(values)
    for row, value in enumerate(cells):
        if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, float, complex, np.number)):
            wanted = "must be a number: leave the whole row out if it is missing"
            raise DataError(f"{source}, row {row}", value, wanted, column=name, place=place)
    return np.array(cells)


def _wrong_scaling(name: str, unit: Unit) -> str:
    """Return what is wrong with a column in RMS or peak to peak: no factor makes peaks of them."""
    if unit.scaling is Scaling.RMS and name not in (*_OF_ONE_HARMONIC, "sd"):
        return "is RMS: only of one harmonic, `amplitude`, is √2 times that its amplitude"
    if unit.scaling is Scaling.PEAK_TO_PEAK and name not in (*_OF_ONE_HARMONIC, "sd", "half_peak_to_peak"):
        return "is peak to peak: half of it is `half_peak_to_peak`, or of one harmonic `amplitude`"
    return ""


_OF_ONE_HARMONIC = ("amplitude", "real", "imag")


def complex_apart(
    source: str, heads: Sequence[str], columns: Sequence[Real | Complex]
) -> tuple[list[str], list[Real]]:  # fmt: skip
    """Return columns with complex ones as their real and imaginary parts, `real` and `imag` of `amplitude`.

    Raises
    ------
    DataError
        Complex numbers in another column.
    """
    names: list[str] = []
    numbers: list[Real] = []
    for text, column in zip(heads, columns, strict=True):
        if not np.iscomplexobj(column):
            names.append(text)
            numbers.append(np.asarray(column, np.float64))
            continue
        name, unit = split_head(text)
        if name != "amplitude":
            raise DataError(
                source, complex(column[0]), "complex numbers are those of `amplitude`", column=name
            )
        names += [part if unit is None else f"{part} [{unit}]" for part in ("real", "imag")]
        numbers += [column.real, column.imag]
    return names, numbers
