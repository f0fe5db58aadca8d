"""Measured data in the text of CSV files: as tables of a job, with what is wrong by file, line and column."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from solver.errors import SceneError, SettingError
from solver.scene.scene import Scene

_ROWS = 6  # of an export, that show what stands in its columns
_SHOWN = 2000
"""Points of a run that are told besides."""


def read_measurements(scene: Scene, files: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Read the texts against a scene, each for itself.

    Parameters
    ----------
    scene : what was measured.
    files : `name` and `text` of each, and `columns` (heading to quantity and unit) where it is an export.

    Returns
    -------
    `files` have the `name` and the `table` of each that can be read, in the words of a job, and its `runs`
    with what they measured; `issues` have `file`, `line`, `column` (null where it is of the whole) and
    `detail`.
    """
    from optim.identification.readers.csv_text import read_text
    from optim.identification.readers.text_layout import Choice
    from optim.identification.reading import read_data

    paths = frozenset(scene.parameter_paths())
    read, issues = [], []
    for file in files:
        name = file["name"]
        try:
            given = {heading: Choice(**told) for heading, told in (file.get("columns") or {}).items()}
            from_text = read_text(file["text"], name, paths, given or None)
            runs = read_data(scene, [from_text])
            read.append({"name": name, "table": from_text.job_table, "runs": [_shown(run) for run in runs]})
        except (SceneError, SettingError) as error:
            issues.append(_issue(name, error))
    return {"files": read, "issues": issues}


def look_at(scene: Scene, files: Sequence[Mapping[str, str]]) -> dict[str, Any]:
    """Say how the texts of files are laid out, and what their columns are likely to be.

    Parameters
    ----------
    scene : what was measured.
    files : `name` and `text` of each.

    Returns
    -------
    `files` with `name`, `separator`, `decimal`, `head_line`, the number of `rows`, whether all is `known`,
    and `columns` with `heading`, `cells` of the first rows, `quantity` (empty: left out) and `unit`;
    `quantities` with the `units` that each may be in; `issues` as of `read_measurements`.
    """
    from optim.identification.data.measured import known_columns
    from optim.identification.readers.text_layout import FORCE, guesses, layout_of, units_for
    from optim.problem.checks import DataError

    paths = frozenset(scene.parameter_paths())
    found, issues = [], []
    for file in files:
        try:
            layout = layout_of(file["text"], file["name"])
        except DataError as error:
            issues.append(_issue(file["name"], error))
            continue
        columns = guesses(layout, paths)
        rows = [layout.rows[number] for number in [*layout.rows][:_ROWS]]
        found.append({
            "name": file["name"], "separator": layout.separator, "decimal": layout.decimal,
            "head_line": layout.head_line, "rows": len(layout.rows),
            "known": _is_known(layout, paths),
            "columns": [
                {"heading": heading, "quantity": choice.quantity, "unit": choice.unit,
                 "cells": [row[i] if i < len(row) else "" for row in rows]}
                for i, (heading, choice) in enumerate(zip(layout.heads, columns, strict=True))
            ],
        })  # fmt: skip
    names = {name: column.help for name, column in known_columns().items()}
    loads = sorted(path for path in paths if path.endswith((".N0", ".N1")))
    names |= dict.fromkeys((FORCE, *loads), "A condition of the rows.")
    quantities = [
        {"name": name, "words": words, "units": list(units_for(name, paths))} for name, words in names.items()
    ]
    return {"files": found, "quantities": quantities, "issues": issues}


def _is_known(layout: Any, paths: frozenset[str]) -> bool:
    """Whether the headings are those that files have here, so that nothing is to be chosen."""
    from optim.identification.data.measured import known_columns
    from optim.identification.data.measured_table import split_head

    known = known_columns()
    names = [split_head(heading)[0] for heading in layout.heads]
    return all(name in known or name in paths or name.startswith("harmonic_") for name in names)


def _issue(name: str, error: Any) -> dict[str, Any]:
    return {
        "file": name, "line": getattr(error, "line", None),
        "column": getattr(error, "column", "") or None, "detail": str(error),
    }  # fmt: skip


def _shown(run: Any) -> dict[str, Any]:
    """A run as it is drawn before anything is fitted: the data stand where a fit would."""
    import numpy as np

    told = run.to_json(run.observations, np.zeros(run.observations.size))
    count = len(told["x"])
    kept = np.unique(np.linspace(0, count - 1, min(count, _SHOWN)).round().astype(int)).tolist()
    return {
        "kind": told["kind"], "conditions": told["conditions"], "of": told.get("contact") or told.get("dof"),
        "points": count, "x": [told["x"][i] for i in kept], "data": [told["data"][i] for i in kept],
    }  # fmt: skip
