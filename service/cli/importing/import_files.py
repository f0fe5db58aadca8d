"""The files of `stickslip import`: which is M, K and C, which names the rows, and the rows of the DOFs."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from service.cli.options.inputs import relative
from service.errors import InputError

if TYPE_CHECKING:
    from service.cli.importing.import_reduction import ImportOptions
    from solver.matrices.load_set import MatrixSet

MOST_UNNAMED = 200


@dataclass(frozen=True, slots=True, kw_only=True)
class Sources:
    """What a scene is made of."""

    roles: Annotated[dict[str, Path], "File of each of M, K and C, or of ``modes``."]
    mapping: Annotated[Path | None, "File of the labels of the rows."]
    units: Annotated[str, "Of the files."]
    parts: Annotated[
        dict[str, Path | None],
        "File of each part of the sector that mistuning may scale; None for K and M of the whole.",
    ] = field(default_factory=dict)

    def table(self, target: Path) -> dict[str, object]:
        """The table [structure] of a scene at `target` that refers to the files."""
        table: dict[str, object] = {"kind": "matrices"}
        table |= {role: relative(path, target) for role, path in self.roles.items()}
        if self.mapping is not None:
            table["mapping"] = relative(self.mapping, target)
        if self.units != "SI":
            table["units"] = self.units
        return table


def sources(asked: ImportOptions) -> Sources:
    """Sort the files given by what they are."""
    from solver.matrices.matrix_files import MAPPING, MatrixFileError, sorted_files
    from solver.matrices.values import UNITS

    if asked.units not in UNITS:
        raise InputError(
            f"`--units` must be one of {', '.join(UNITS)} (mm: mm, t, N, s; in: in, lbf s²/in, lbf, s), "
            f"got {asked.units!r}"
        )
    given = [path for name in asked.files if (path := existing_file("FILES", name)) is not None]
    mapping = existing_file("FILES", asked.mapping or None)
    try:
        roles = sorted_files(given, mapping)
    except MatrixFileError as error:
        raise InputError(f"`FILES`: {error}") from error
    rows = roles.pop(MAPPING, None)
    return Sources(roles=roles, mapping=rows, units=asked.units, parts=_parts(asked.mistune))


def _parts(texts: Sequence[str] | None) -> dict[str, Path | None]:
    """What --mistune names, with the file of each."""
    from solver.matrices.sectors.sector_parts import WHOLE, check_part_names

    found: dict[str, Path | None] = {}
    for text in texts or ():
        name, equals, file = text.partition("=")
        if (name in WHOLE) == bool(equals) or (equals and not Path(file).is_file()):
            got = f"there is no file {file!r}" if equals and name not in WHOLE else f"got {text!r}"
            raise InputError(
                f"`--mistune` must be K, M, or the name of a part and its file, NAME=FILE: {got}"
            )
        if name in found:
            raise InputError(f"`--mistune` names {name!r} twice; keep one")
        try:
            check_part_names([] if name in WHOLE else [name])
        except ValueError as error:
            raise InputError(f"`--mistune`: {error}") from error
        found[name] = Path(file) if equals else None
    return found


def read_sources(found: Sources, deck: Path | None) -> MatrixSet | None:
    """The matrices in SI units, along the global axes whatever frames the deck has; None for modes."""
    from solver.matrices.load_set import PART, in_si, read_set
    from solver.matrices.matrix_files import MatrixFileError
    from solver.matrices.node_frames import in_global
    from solver.matrices.readers.numbers_in_text import FormatError
    from solver.matrices.sectors.decks import read_deck

    if "modes" in found.roles:
        return None
    parts = {PART + name: path for name, path in found.parts.items() if path is not None}
    try:
        given = in_si(read_set(found.roles | parts, found.mapping), found.units)
    except MatrixFileError as error:
        raise InputError(f"`FILES`: {error}") from error
    try:
        return in_global(given, None if deck is None else read_deck(deck, elements=True))
    except (FormatError, OSError, ValueError) as error:
        raise InputError(f"`--nodes`: {error}") from error


def existing_file(option: str, text: str | None) -> Path | None:
    """A file that is to be read; None if none was named.

    Raises
    ------
    InputError
        There is no such file.
    """
    if text is not None and not Path(text).is_file():
        raise InputError(f"`{option}`: there is no file {text!r}")
    return None if text is None else Path(text)


def dof_table(
    texts: Sequence[str] | None, found: Sources, given: MatrixSet | None, *, patches: bool = False
) -> dict[str, int | str]:
    """Names of DOFs, each with its row or label; all rows of a small model if none is named.

    Parameters
    ----------
    patches : whether patches name DOFs too, so that none need be named here.
    """
    if not texts:
        return {} if patches else _all_rows(found, given)
    table: dict[str, int | str] = {}
    for text in texts:
        name, row = _dof(text)
        if name in table:
            raise InputError(f"`--dof` names {name!r} twice; keep one")
        table[name] = row
    return table


def _dof(text: str) -> tuple[str, int | str]:
    from solver.matrices.labels import label

    name, equals, row = text.rpartition("=")
    if equals and name and re.fullmatch(r"[0-9]{1,12}", row):
        return name, int(row)
    wanted = label(row)
    if wanted is None or bool(equals) != bool(name):
        raise InputError(
            "`--dof` takes NAME=ROW with a row from 0 or a label, for example tip=399 or tip=1203.UX, "
            f"got {text!r}"
        )
    return name or str(wanted).replace(".", "-"), str(wanted)


def _all_rows(found: Sources, given: MatrixSet | None) -> dict[str, int | str]:
    from solver.matrices.matrix_files import MatrixFileError, read_modes

    if given is not None:
        size = next(iter(given.matrices.values())).shape[0]
    else:
        try:
            size = read_modes(found.roles["modes"]).size
        except MatrixFileError as error:
            raise InputError(f"`FILES`: {error}") from error
    if size > MOST_UNNAMED:
        example = "tip=399" if given is None or given.labels is None else f"tip={given.labels[-1]}"
        raise InputError(f"`--dof` is needed: the model has {size} rows, name those that you use ({example})")
    if given is not None and given.labels is not None:
        return {str(label).replace(".", "-"): str(label) for label in given.labels}
    return {f"x{row}": row for row in range(size)}


def rows_of(table: Mapping[str, int | str], given: MatrixSet) -> dict[str, int]:
    """The rows that a table of DOFs names."""
    from solver.matrices.labels import label

    rows: dict[str, int] = {}
    for name, row in table.items():
        wanted = label(row) if isinstance(row, str) else None
        at = row if isinstance(row, int) else None if wanted is None else given.row(wanted)
        if at is None:
            raise InputError(f"`--dof`: {name!r} {given.no_row(str(row))}")
        rows[name] = at
    return rows
