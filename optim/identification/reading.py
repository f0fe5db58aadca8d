"""From files and tables to runs: conditions split, kinds told, numbers checked against the scene."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from optim.identification.data.measured import KINDS, DataKind, MeasuredRows, known_words
from optim.identification.data.measured_table import Dimension, Table, check_numbers, runs_of, unit_of
from optim.identification.readers.csv_text import FORMAT as CSV
from optim.identification.readers.csv_text import FromText, read_text
from optim.identification.readers.data_readers import (
    KIND_WORD,
    Head,
    complex_apart,
    format_of,
    numbers_of,
    read_file,
    read_head,
    table_of,
)
from optim.identification.readers.text_layout import Choice, text_of
from optim.problem.checks import DataError
from solver.errors import SettingError
from solver.scene.parameter_paths import find_parameter
from solver.scene.scene import Scene
from solver.wording import listing

MOST_RUNS = 200
MOST_POINTS = 100_000
_CONDITIONS, _UNITS = "conditions", "units"
_WITH_HEAD = re.compile(r"^(?P<file>.+?):(?P<pairs>[A-Za-z_][\w.@-]*=[^=,]+(?:,[A-Za-z_][\w.@-]*=[^=,]+)*)$")

Given = str | Path | Mapping[str, Any] | FromText


def read_data(scene: Scene, data: Sequence[Given], unknown: Sequence[str] = ()) -> tuple[MeasuredRows, ...]:
    """Read the runs of files and tables.

    Parameters
    ----------
    scene : what was measured.
    data : files, ``rig.csv`` or ``rig.uff:shroud.N0=200,dof=tip`` with conditions for all its rows; or tables
        ``{"frequency": […], "amplitude": […], "conditions": {path: value}, "units": {"amplitude": "mm"}}``.
    unknown : paths that are looked for, which no condition may set.

    Raises
    ------
    DataError
        What is wrong: the file and line, or the place in a table, and what would be right.
    """
    if isinstance(data, (str, Path, Mapping)) or not isinstance(data, Sequence) or not data:
        raise DataError("data", data, "must list files or tables, at least one")
    paths = frozenset(scene.parameter_paths())
    runs: list[MeasuredRows] = []
    for index, given in enumerate(data):
        for table in _tables(given, index, paths):
            runs += _runs(scene, table, paths, frozenset(unknown))
    points = sum(run.observations.size for run in runs)
    if len(runs) > MOST_RUNS or points > MOST_POINTS:
        wanted = f"must be at most {MOST_RUNS} runs and {MOST_POINTS} numbers"
        raise DataError("data", f"{len(runs)} runs, {points} numbers", wanted)
    return tuple(runs)


def with_columns(scene: Scene, data: Sequence[str], columns: Sequence[str]) -> list[Given]:
    """Return files with those in CSV read by what their columns are.

    Parameters
    ----------
    scene : what was measured.
    data : as for `read_data`.
    columns : ``HEADING=QUANTITY:UNIT`` of each column that counts; the others are left out. Of none the files
        as they are.

    Raises
    ------
    DataError
        What is wrong, with its line.
    """
    if not columns:
        return list(data)
    return [_of_text(scene, given, columns) if _is_csv(given) else given for given in data]


def job_tables(scene: Scene, data: Sequence[str], columns: Sequence[str] = ()) -> list[dict[str, Any]]:
    """Return files in CSV as the tables of a job; arguments as of `with_columns`.

    Raises
    ------
    DataError
        What is wrong, with its line; or a file is of another format.
    """
    for given in data:
        if not _is_csv(given):
            raise DataError("data", given, "must be a file in CSV (.csv) or JSON, to be submitted")
    return [_of_text(scene, given, columns).job_table for given in data]


def _split(given: str) -> tuple[Path, dict[str, str]]:
    """Return the file, and what is said behind its name."""
    match = _WITH_HEAD.match(given)
    pairs = match["pairs"].split(",") if match else []
    return Path(match["file"] if match else given), {
        key: value for key, _, value in (pair.partition("=") for pair in pairs)
    }


def _is_csv(given: str) -> bool:
    return _split(given)[0].suffix.lower() in CSV.suffixes


def _of_text(scene: Scene, given: str, columns: Sequence[str]) -> FromText:
    """Read a file in CSV, by what its columns are if that is given."""
    (file, said), paths = _split(given), frozenset(scene.parameter_paths())
    _said(file, said, paths)
    choices = dict(map(Choice.told, columns)) if columns else None
    return read_text(text_of(file), file.name, paths, choices, said)


def _said(file: Path, said: Mapping[str, str], paths: frozenset[str]) -> tuple[Head, dict[str, str]]:
    """Return what is said behind a file's name: of its rows, and to read it by the words of its format."""
    words = format_of(file).words if said else {}
    known = (KIND_WORD, *known_words(), *words)
    for key, value in said.items():
        if key not in paths and key not in known and "." not in key:
            wanted = f"`{key}` must be a parameter path, or one of {listing(known)}"
            raise DataError(f"{file.name}:{key}={value}", key, wanted)
    pairs = {
        at: f"{key} = {value}" for at, (key, value) in enumerate(said.items(), start=1) if key not in words
    }
    head = read_head(f"{file.name}:…", pairs, paths)
    return head, {key: value for key, value in said.items() if key in words}


def _tables(given: Given, index: int, paths: frozenset[str]) -> list[Table]:
    place = ("data", index)
    if isinstance(given, FromText):
        return [replace(given.table, place=place)]
    if isinstance(given, Mapping):
        return [_table_of(given, index, paths)]
    if not isinstance(given, (str, Path)):
        raise DataError(f"data[{index}]", given, "must be a file or a table", place=place)
    file, said = _split(str(given))
    head, words = _said(file, said, paths)
    return [
        replace(
            table, conditions={**table.conditions, **head.conditions}, words={**table.words, **head.words},
            place=place,
        )
        for table in read_file(file, paths, words)
    ]  # fmt: skip


def _table_of(given: Mapping[str, Any], index: int, paths: frozenset[str]) -> Table:
    """Return the table of a description, in the words of files."""
    source, place = f"data[{index}]", ("data", index)
    columns = {key: value for key, value in given.items() if isinstance(value, (list, tuple, np.ndarray))}
    conditions, units = given.get(_CONDITIONS, {}), given.get(_UNITS, {})
    for key, value in ((_CONDITIONS, conditions), (_UNITS, units)):
        if not isinstance(value, Mapping):
            raise DataError(source, value, f"`{key}` must be a table", place=(*place, key))
    words = {key: given[key] for key in given if key not in (*columns, _CONDITIONS, _UNITS)}
    pairs = [*conditions.items(), *words.items()]
    head: Head = read_head(source, dict(enumerate((f"{key} = {value}" for key, value in pairs), 1)), paths)
    lost = [key for key in (*conditions, *words) if key not in head.conditions and key not in head.words]
    if lost:
        wanted = "must be a column (a list), `conditions`, `units`, or a word such as dof or contact"
        raise DataError(source, lost[0], wanted, place=place)
    heads = [f"{name} [{units[name]}]" if name in units else name for name in columns]
    numbers = [numbers_of(source, name, values, (*place, name)) for name, values in columns.items()]
    heads, parts = complex_apart(source, heads, numbers)
    return table_of(source, heads, parts, head, paths, place=place)


def _runs(scene: Scene, table: Table, paths: frozenset[str], unknown: frozenset[str]) -> list[MeasuredRows]:
    """Read a table as runs of equal conditions."""
    check_numbers(table)
    # Columns of parameters in the units of the scene.
    columns = dict(table.columns)
    for path, text in table.path_units.items():
        found = find_parameter(scene, path)
        own = found.unit if found is not None else ""
        forces = (unit_of(Dimension.FORCE, own or "-"), unit_of(Dimension.FORCE, text))
        if None not in forces:
            columns[path] = columns[path] * (forces[1].factor if forces[1] else 1.0)
        elif _plain_unit(text) != _plain_unit(own):
            raise table.refusal(text, f"must be in {own or '1'}", path)
    table = replace(table, columns=columns)
    varied = [name for name in table.columns if name in paths]
    for path in (*varied, *table.conditions):
        if path in unknown:
            raise table.refusal(path, "must not be a condition of the data: it is looked for")
    kind = _kind(table, varied)
    runs = []
    for run in runs_of(table, varied):
        try:
            scene.with_values(dict(run.conditions))
        except SettingError as error:
            raise run.refusal(error.value, f"condition: {error}") from error
        runs.append(kind.read(scene, run))
    return runs


def _plain_unit(text: str) -> str:
    plain = re.sub(r"[\s^·*()]", "", text).replace("²", "2")
    return "" if plain in ("1", "-") else plain


def _kind(table: Table, varied: Sequence[str]) -> DataKind:
    """Return the kind a table says, or that its columns tell."""
    kinds = KINDS.known()
    word = table.words.get("kind")
    if word is not None and word not in kinds:
        raise table.refusal(word, f"`kind` must be one of {', '.join(kinds)}")
    names = [name for name in table.columns if name not in varied]
    told = [kind for kind in kinds.values() if any(set(group) <= set(names) for group in kind.marks)]
    if len(told) > 1:
        told = [kind for kind in told if set(names) <= {column.name for column in kind.columns}]
    fitting = [kinds[word]] if word is not None else told
    if len(fitting) != 1 or fitting[0] not in told:
        groups = [" + ".join(group) for kind in (fitting or kinds.values()) for group in kind.marks]
        raise table.refusal(", ".join(names), f"must have the columns {' or '.join(groups)}")
    kind = fitting[0]
    foreign = [name for name in names if name not in {column.name for column in kind.columns}]
    if foreign:
        raise table.refusal(", ".join(foreign), f"are no columns of the kind `{kind.name}`: leave them out")
    return kind
