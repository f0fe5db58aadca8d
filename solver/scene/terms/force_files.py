"""Forces on many DOFs from a file that a scene names: rows of DOF, factor and maybe phase."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path

from solver.errors import Issue, SceneError, pointer


def with_force_files(raw: Mapping[str, object], folder: Path) -> dict[str, object]:
    """Return the tables of a scene with the files of its forces read.

    Raises
    ------
    SceneError
        A file that cannot be read, or a row that is no DOF with one or two numbers.
    """
    given = raw.get("excitation")
    rows = given if isinstance(given, list) else [given]
    if not any(isinstance(row, dict) and isinstance(row.get("forces"), str) for row in rows):
        return dict(raw)
    found = [
        {**row, "forces": _read(folder / row["forces"], i if isinstance(given, list) else None)}
        if isinstance(row, dict) and isinstance(row.get("forces"), str)
        else row
        for i, row in enumerate(rows)
    ]
    return {**raw, "excitation": found if isinstance(given, list) else found[0]}


def _read(path: Path, number: int | None) -> dict[str, list[float]]:
    where = pointer("excitation", *(() if number is None else (number,)), "forces")

    def refused(why: str) -> SceneError:
        return SceneError([Issue(pointer=where, message=f"`forces`: {str(path)!r} {why}")])

    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        raise refused(f"cannot be read: {error}") from error
    table: dict[str, list[float]] = {}
    for line, row in enumerate(csv.reader(text.splitlines()), start=1):
        cells = [cell.strip() for cell in row]
        if not any(cells) or cells[0].startswith("#") or (line == 1 and cells[0].lower() == "dof"):
            continue
        try:
            numbers = [float(cell) for cell in cells[1:]]
        except ValueError:
            numbers = []
        if not 1 <= len(numbers) <= 2 or cells[0] in table:
            raise refused(f"line {line} must be a DOF, its factor and maybe a phase, none twice, got {row!r}")
        table[cells[0]] = [*numbers, 0.0][:2]
    if not table:
        raise refused("names no DOF")
    return table
