"""The formats of files with measured data, and what they share: column heads, lines of a head, their columns.

A further format is one module and one line in `SHIPPED`; one from outside the package is named by
`solver.extensions`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np

from optim.errors import DataError
from optim.identification.data.measured import known_columns, known_words
from optim.identification.data.table import Table, Unit, known_units, split_head, unit_of
from optim.problem.variables import Real
from solver.errors import Place
from solver.extensions import Kinds
from solver.jit.fourier import Integer
from solver.wording import listing, nearest

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
        Callable[[Path, frozenset[str]], list[Table]],
        "From a path and the names a scene has (parameter paths) to the tables in it.",
    ]


FORMATS: Kinds[DataFormat] = Kinds(DataFormat, "format", lambda one: one.suffixes, SHIPPED, "FORMAT")
data_formats = FORMATS.every


def read_file(path: Path, paths: frozenset[str]) -> list[Table]:
    """Read the tables of a file by its ending.

    Parameters
    ----------
    path : of the file.
    paths : parameter paths, which columns and lines of a head may name.

    Raises
    ------
    DataError
        A file that is not there or has an unknown ending, or what is wrong in it.
    """
    formats = FORMATS.known()
    if path.suffix.lower() not in formats:
        raise DataError(str(path), path.suffix, f"must end in {', '.join(formats)}")
    if not path.is_file():
        raise DataError(str(path), str(path), "must be a file that is there")
    return formats[path.suffix.lower()].read(path, paths)


_PAIR = re.compile(r"^\s*#?\s*(?P<key>[A-Za-z_][\w.@-]*)\s*[=:]\s*(?P<value>.+?)\s*$")
_HARMONIC = re.compile(r"harmonic_(?P<number>[1-9]\d*)")
KIND_WORD = "kind"


@dataclass(frozen=True, slots=True, kw_only=True)
class Head:
    """What stands before the rows: values of parameter paths, and words."""

    conditions: dict[str, float]
    words: dict[str, str]


def read_head(source: str, lines: Mapping[int, str], paths: frozenset[str]) -> Head:
    """Read lines ``key = value``, each by its number; a line without = or : is a remark.

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
        elif key == KIND_WORD or key in known_words():
            words[key] = value
        elif "." in key:
            raise _unknown_path(source, number, key, paths)
    return Head(conditions=conditions, words=words)


def _unknown_path(source: str, line: int | None, key: str, paths: frozenset[str]) -> DataError:
    known = sorted(paths)
    return DataError(source, key, f"must be a parameter path of the scene{nearest(key, known)}", line=line)


def _condition(source: str, number: int | None, key: str, text: str) -> float:
    try:
        value = float(text.split("#")[0])
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise DataError(source, text, f"`{key}` must be a finite number in its SI unit", line=number)
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
    words = dict(head.words)
    for text, values in zip(heads, columns, strict=True):
        name, unit_text = split_head(text)
        if told := _HARMONIC.fullmatch(name):
            name, words["harmonic"] = "amplitude", told["number"]
        if name in named:
            raise DataError(source, name, "must be a column once", line=head_line, place=place)
        if name in paths:
            named[name] = values
            continue
        if name not in known:
            wanted = (
                f"must be one of {', '.join(known)}, or a parameter path of the scene"
                f"{nearest(name, [*known, *sorted(paths)])}"
            )
            raise DataError(source, name, wanted, line=head_line, place=place)
        unit = unit_of(known[name].dimension, unit_text)
        if unit is None:
            wanted = f"must be in {listing(known_units(known[name].dimension))}"
            raise DataError(source, unit_text, wanted, line=head_line, column=name, place=place)
        named[name], units[name] = values * unit.factor, unit
    return Table(
        source=source, columns=named, units=units, conditions=head.conditions, words=words,
        lines=np.zeros(0, np.int64) if lines is None else lines, place=place,
    )  # fmt: skip
