"""A scene file of kind ``matrices`` with its files read: their names replaced by what they hold."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import coo_array

from solver.errors import UNSAID, FieldError, Issue, SceneError, Shown
from solver.matrices.craig_bampton import Reduced, craig_bampton
from solver.matrices.load_set import (
    PART,
    MatrixFileError,
    MatrixSet,
    in_global,
    in_si,
    put_together,
    read_labelled,
    read_modes,
)
from solver.matrices.readers.numbers_in_text import label
from solver.matrices.sectors.loading import read_nodes, sector_kept
from solver.matrices.sectors.sector_reduction import ReducedSector
from solver.matrices.values import METRES, MOST_DOFS, UNITS, DofTable, Matrix, NormalModes

KEEP_MODES = "keep_modes"
MAPPING, IN_UNITS, NODES = "mapping", "units", "nodes"
_MATRICES = ("M", "K", "C", "G", "K_omega2")
_COUPLED = "couplings/{}/K"  # the key of the stiffness that a coupling names
_SKEW = {"K": "skew K", "C": "skew C"}  # what their symmetric parts leave


def with_files(raw: Mapping[str, object], folder: Path) -> dict[str, object]:
    """The tables of a scene with the files of its structure read; a scene of another kind as it is.

    Parameters
    ----------
    folder : where relative names of files begin.

    Raises
    ------
    SceneError
        A file that cannot be used, or a model too large as it stands; the pointer is that of the key.
    """
    structure = raw.get("structure")
    if not isinstance(structure, dict) or structure.get("kind") != "matrices":
        return dict(raw)
    tables = dict(structure)
    try:
        if isinstance(tables.get("modes"), str):
            tables["modes"] = read_modes(folder / tables["modes"])
    except MatrixFileError as error:
        raise _refusal("modes", f"`modes`: {error}", named=False) from error
    if tables.get("sectors") is not None:
        return {**raw, "structure": sector_with_files(tables, folder, _orders(raw))[0]}
    rows = raw.get("couplings")
    couplings = list(rows) if isinstance(rows, list) else []
    relaxing = {
        _COUPLED.format(i): str(row["K"])
        for i, row in enumerate(couplings)
        if isinstance(row, dict) and isinstance(row.get("K"), str)
    }
    found = read_matrices(tables, folder, relaxing)
    if isinstance(tables.get("modes"), NormalModes):
        tables = _rows_in_use(tables)
    kept, reduced = as_kept(tables, found.matrices, found.parts)
    for i, row in enumerate(couplings):
        key = _COUPLED.format(i)
        if key in found.parts:
            part = found.parts[key].toarray() if reduced is None else np.asarray(reduced.matrices[key])
            couplings[i] = {**row, "K": Matrix(part)}
    return {**raw, "structure": kept} | ({"couplings": couplings} if relaxing else {})


def sector_with_files(
    tables: dict[str, Any], folder: Path, orders: list[int]
) -> tuple[dict[str, Any], ReducedSector | None]:
    """The tables of a sector with their files read, and the reduction if they ask for one.

    Parameters
    ----------
    orders : engine orders of the excitation, which say at which nodal diameters it is reduced.

    Raises
    ------
    SceneError
        A file that cannot be used, boundaries that do not match; the pointer is that of the key.
    """
    given = dict(tables)
    metres = METRES.get(str(given.get(IN_UNITS, "SI")), 1.0)
    found = read_matrices(given, folder)
    return sector_kept(given, found, folder, orders, metres)


def _orders(raw: Mapping[str, object]) -> list[int]:
    """Engine orders of the excitation of a scene."""
    given = raw.get("excitation")
    rows = given if isinstance(given, list) else [given]
    found = [row.get("engine_order", 0) for row in rows if isinstance(row, dict)]
    return [order for order in found if type(order) is int] or [0]


def read_matrices(tables: dict[str, Any], folder: Path, beside: Mapping[str, str] | None = None) -> MatrixSet:
    """The matrices that the files of a structure hold, in SI units.

    `mapping`, `units` and `nodes` are taken out of `tables`, and labels among its DOFs become rows. Rows are
    along the global axes, whatever frames the deck gives to nodes (`nodes`, or that of `cyclic`). Files that
    stand `beside` those of the structure are read as its parts, under their keys.

    Raises
    ------
    SceneError
        A file that cannot be used, or a label that is not there; the pointer is that of the key.
    """
    paths = {key: folder / tables[key] for key in _MATRICES if isinstance(tables.get(key), str)}
    parts_given = tables.get("parts")
    if isinstance(parts_given, dict) and tables.get("sectors") is not None and paths:
        paths |= {PART + key: folder / name for key, name in parts_given.items() if isinstance(name, str)}
    paths |= {PART + key: folder / name for key, name in (beside or {}).items()}
    mapping, units = tables.pop(MAPPING, None), tables.pop(IN_UNITS, "SI")
    if mapping is not None and not isinstance(mapping, str):
        raise _refusal(MAPPING, "must be the name of a file", mapping)
    if units not in UNITS:
        raise _refusal(IN_UNITS, f"must be one of {', '.join(UNITS)}", units)
    cyclic = tables.get("cyclic")
    own, joined = tables.pop(NODES, None), cyclic.get(NODES) if isinstance(cyclic, dict) else None
    if not paths:
        return MatrixSet(matrices={})
    issues, parts = [], {}
    for key, path in paths.items():
        try:
            parts[key] = read_labelled(path, key)
        except MatrixFileError as error:
            own = beside is None or key.removeprefix(PART) not in beside
            steps = ("structure", key) if own else tuple(key.removeprefix(PART).split("/"))
            issues.append(Issue(steps, f"`{key if own else steps[-1]}`: {error}", named=False))
    if issues:
        raise SceneError(issues)
    try:
        found = in_si(put_together(parts, paths, None if mapping is None else folder / mapping), units)
    except MatrixFileError as error:
        raise _refusal(MAPPING, str(error), named=False) from error
    place = () if own is not None else ("cyclic",)
    deck = read_nodes(joined if own is None else own, folder, place)
    try:
        found = in_global(found, deck)
    except ValueError as error:
        raise SceneError.of(("structure", *place, NODES), f"`{NODES}`: {error}", named=False) from error
    if isinstance(tables.get("dofs"), dict):
        tables["dofs"] = {name: _row(name, row, found) for name, row in tables["dofs"].items()}
    return found


def _row(name: str, given: object, found: MatrixSet) -> object:
    """The row that a label such as 1203.UX names; anything else as it is."""
    if not isinstance(given, str):
        return given
    wanted = label(given)
    row = None if wanted is None else found.row(wanted)
    if row is None:
        raise SceneError.of(
            ("structure", "dofs", name), f"`dofs`: {name!r} {found.no_row(given)}", named=False
        )
    return row


def _refusal(key: str, wanted: str, got: object = UNSAID, *, named: bool = True) -> SceneError:
    return SceneError.of(("structure", key), wanted, got, named=named)


def _rows_in_use(tables: dict[str, Any]) -> dict[str, Any]:
    """Modes without the rows that no DOF of the scene names; as they are if the table of DOFs is bad."""
    try:
        dofs = DofTable.read(tables.get("dofs"))
    except ValueError:
        return tables
    modes: NormalModes = tables["modes"]
    if max(dofs.rows) >= modes.size:
        return tables
    kept = NormalModes(
        omega2=modes.omega2, modes=modes.modes[list(dofs.rows)], damping_ratio=modes.damping_ratio
    )
    return {**tables, "modes": kept, "dofs": {name: row for row, name in enumerate(dofs)}}


def as_kept(
    tables: dict[str, Any], sparse: dict[str, coo_array], parts: Mapping[str, coo_array] | None = None
) -> tuple[dict[str, Any], Reduced | None]:
    """Tables with the matrices as the scene keeps them: as they are, or reduced if `keep_modes` asks for it.

    Raises
    ------
    SceneError
        A model too large as it stands, or one that cannot be reduced so.
    """
    keep = tables.pop(KEEP_MODES, None)
    sizes = {key: matrix.shape[0] for key, matrix in sparse.items()}
    if keep is None:
        large = next((key for key in sizes if sizes[key] > MOST_DOFS), None)
        if large is not None:
            raise _refusal(
                large,
                f"has {sizes[large]} rows, {MOST_DOFS} are the most without reduction: `stickslip import "
                "--reduce` reduces them once onto the DOFs in use and modes of the rest; "
                f"`{KEEP_MODES}` = 40 (say) in [structure] does it whenever the scene is loaded",
            )
        return {**tables, **{key: Matrix(matrix.toarray()) for key, matrix in sparse.items()}}, None
    if isinstance(keep, bool) or not isinstance(keep, int) or not 0 <= keep <= MOST_DOFS:
        raise _refusal(KEEP_MODES, f"must be a whole number from 0 to {MOST_DOFS}", keep)
    if not {"M", "K"} <= set(sparse) or len(set(sizes.values())) != 1:
        what = ", ".join(f"{key} with {size} rows" for key, size in sizes.items()) or "none"
        raise _refusal(KEEP_MODES, "needs M and K (and C) from files, of one size", Shown(what))
    try:
        dofs = DofTable.read(tables.get("dofs"))
    except ValueError as error:
        raise _refusal("dofs", str(error), named=False) from error
    try:
        found = _reduced(sparse, parts or {}, dofs, keep, symmetric=tables.get("symmetric") is not False)
    except FieldError as error:
        raise SceneError([error.issue.below("structure")]) from error
    except ValueError as error:
        raise _refusal(KEEP_MODES, str(error), named=False) from error
    values = {key: np.asarray(value) for key, value in found.matrices.items() if key in _MATRICES}
    for key, skew in _SKEW.items():
        if skew in found.matrices:
            values[key] = values[key] + np.asarray(found.matrices[skew])
    matrices = {key: Matrix(value) for key, value in values.items()}
    reduction = {"dofs": sizes["M"], "modes": found.modes, "highest_hz": found.highest_hz}
    rows = {name: row for row, name in enumerate(dofs)}
    return {**tables, **matrices, "dofs": rows, "reduction": reduction}, found


def _reduced(
    sparse: dict[str, coo_array], parts: Mapping[str, coo_array], dofs: DofTable, keep: int, *,
    symmetric: bool,
) -> Reduced:  # fmt: skip
    """The reduction of all matrices onto the vectors of the symmetric parts of M and K."""
    others = {key: sparse[key] for key in _MATRICES[3:] if key in sparse} | dict(parts)
    given = dict(sparse)
    for key, skew in () if symmetric else _SKEW.items():
        if key in given:
            turned = given[key].T
            given[key], others[skew] = 0.5 * (given[key] + turned), 0.5 * (given[key] - turned)
    return craig_bampton(given["M"], given["K"], given.get("C"), dofs, keep, others=others)
