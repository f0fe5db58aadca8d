"""What is in matrices that were uploaded, what is wrong with them, and a scene that begins with them.

All of it runs in the reader's process (`service.uploads.inspection`): files, factorisations and modes are a
stranger's.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from solver.errors import FieldError, Issue, SceneError, Shown

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from solver.matrices.load_set import MatrixSet
    from solver.matrices.sectors.sector_reduction import ReducedSector
    from solver.scene.scene import Scene


MOST_LABELS = 400
MOST_SOUGHT = 20_000
"""Rows of a model whose lowest frequencies are looked for before it is reduced."""
_SHOWN = 10


def look(asked: Mapping[str, Any]) -> dict[str, Any]:
    """What the files of a structure hold; with its DOFs also the scene, and what its structure resolves to.

    SceneError with pointers into the scene that is asked for. `asked`: `files` or `structure` (whose keys
    name files of the working directory), and for a scene `name`, `contacts`, `excitation` and `observe`.
    """
    from solver.matrices.load_set import MatrixSet, read_modes

    structure = dict(asked["structure"] or _sorted(asked["files"]))
    report: dict[str, Any] = {"structure": structure, "notes": [], "sets": deck_of(structure)}
    given = MatrixSet(matrices={})
    tables = {"kind": "matrices", **structure}
    if "modes" in structure:
        modes = read_modes(Path(structure["modes"]))
        report |= {"rows": modes.size, "modes": int(modes.omega2.size), "matrices": []}
        omega2: NDArray[Any] | None = modes.omega2
    elif isinstance(structure.get("diameters"), str):
        report |= reduced_sector(structure)
        omega2 = None
    else:
        given = _read(tables)
        entries = [
            {"name": key, "rows": int(matrix.shape[0]), "entries": int(matrix.nnz)}
            for key, matrix in given.matrices.items()
        ]
        report |= {"rows": given.size, "matrices": entries, "held": given.held, **_named(given)}
        # A sector alone is not held where it meets the others: its own frequencies say nothing.
        known = structure.get("dofs") or structure.get("sectors") is not None
        omega2 = None if known else _lowest(given, report["notes"])
    if structure.get("dofs"):
        return report | _scene(asked, structure, tables, given, report["notes"])
    return report | _frequencies(given, omega2, report["notes"])


def _sorted(files: list[str]) -> dict[str, Any]:
    from solver.matrices.load_set import sorted_files

    rest, found = told_apart(files)
    if "diameters" in found:
        return found
    return found | {role: path.name for role, path in sorted_files([Path(name) for name in rest]).items()}


def _read(tables: dict[str, Any]) -> MatrixSet:
    """The matrices, refused if they are no structure."""
    from solver.matrices.diagnostics import refuse
    from solver.matrices.scene_files import read_matrices

    missing = [key for key in "MK" if key not in tables]
    if missing:
        words = {"M": "mass", "K": "stiffness"}
        raise SceneError(
            [Issue(("structure", key), f"(the {words[key]} matrix) is missing") for key in missing]
        )
    given = read_matrices(tables, Path())
    try:
        refuse(given, reduced=True)
    except FieldError as error:
        raise SceneError([error.issue.below("structure")]) from error
    return given


def _named(given: MatrixSet) -> dict[str, Any]:
    """The labels of the rows, and the mass they tell."""
    from solver.matrices.diagnostics import total_mass

    mass = total_mass(given)
    found: dict[str, Any] = {"mass": mass and {"direction": mass[0], "kg": mass[1]}, "labels": None}
    if given.labels is not None:
        found["labels"] = {
            "first": [str(label) for label in given.labels[:MOST_LABELS]],
            "components": sorted({label.component for label in given.labels}),
            "nodes": [min(label.node for label in given.labels), max(label.node for label in given.labels)],
        }
    return found


def _lowest(given: MatrixSet, notes: list[str]) -> NDArray[Any] | None:
    """The lowest ω² [rad²/s²]; None, with a note, if they are not known before the model is reduced."""
    import numpy as np
    from scipy.sparse import csc_array

    from solver.matrices.craig_bampton import held_modes, interior
    from solver.matrices.diagnostics import refuse

    matrices = given.matrices
    size = matrices["K"].shape[0]
    if size > MOST_SOUGHT:
        return None
    try:
        refuse(given, reduced=False)
        K, M = csc_array(matrices["K"]), csc_array(matrices["M"])
        whole = interior(K, M, np.arange(size), np.arange(0))
        return held_modes(whole, min(size, _SHOWN + 6), None)[0]
    except ValueError as error:
        notes.append(str(error))
        return None


def _frequencies(given: MatrixSet, omega2: NDArray[Any] | None, notes: list[str]) -> dict[str, Any]:
    from solver.matrices.diagnostics import notes as notes_of

    if omega2 is None:
        return {"frequencies_hz": None}
    notes += notes_of(given, omega2)
    return {"frequencies_hz": [math.sqrt(max(float(v), 0.0)) / (2.0 * math.pi) for v in omega2[:_SHOWN]]}


def _scene(
    asked: Mapping[str, Any],
    structure: dict[str, Any],
    tables: dict[str, Any],
    given: MatrixSet,
    notes: list[str],
) -> dict[str, Any]:
    """The scene that is asked for, on the structure as it is kept."""
    from solver.matrices.diagnostics import refuse
    from solver.matrices.scene_files import as_kept, with_files
    from solver.matrices.values import MOST_DOFS, as_json

    if structure.get("sectors") is not None:
        kept, disk = _sector(asked, structure, given)
        answer = None if disk is None else kept_answer(disk)
        scene, omega2 = started(asked, kept)
        return {
            "scene": {**scene.to_dict(), "structure": {"kind": "matrices", **structure}},
            "resolved": as_json(kept), "reduction": answer, **_frequencies(given, omega2, notes),
        }  # fmt: skip
    reduced = None
    if given.matrices:
        size = given.size
        if size > MOST_DOFS and "keep_modes" not in tables:
            raise SceneError.of(
                ("structure", "keep_modes"), _TOO_LARGE.format(size=size, most=MOST_DOFS), named=False
            )
        try:
            refuse(given, reduced="keep_modes" in tables)
        except FieldError as error:
            raise SceneError([error.issue.at("structure", "keep_modes")]) from error
        kept, reduced = as_kept(tables, given.matrices)
    else:
        kept = with_files({"structure": tables}, Path())["structure"]  # type: ignore[assignment]
    scene, omega2 = started(asked, kept)
    body = scene.to_dict()
    return {
        "scene": {**body, "structure": {"kind": "matrices", **structure}},
        "resolved": as_json(kept),
        "reduction": None if reduced is None else reduced.facts(scene.structure.dofs),
        **_frequencies(given, omega2, notes),
    }


def _sector(
    asked: Mapping[str, Any], structure: dict[str, Any], given: MatrixSet
) -> tuple[dict[str, Any], ReducedSector | None]:
    """The structure of a sector as its scene keeps it, refused if its matrices are none."""
    from solver.matrices.diagnostics import refuse

    if not given.matrices:
        return kept_sector(structure, asked["excitation"], None)
    cyclic = structure.get("cyclic")
    try:
        refuse(given, reduced=isinstance(cyclic, Mapping) and "keep_modes" in cyclic)
    except FieldError as error:
        raise SceneError([error.issue.below("structure")]) from error
    return kept_sector(structure, asked["excitation"], given.size)


_TOO_LARGE = (
    "the model has {size} rows, {most} are the most as they stand: reduce it onto the DOFs named and some "
    "modes of the rest, say 20"
)


FORCE = 1.0
FRICTION = 0.3
_FORCE_AT_OPTIMUM = 1.3
"""Friction over excitation, both in the mode: near the least peak of one mode with a stiff contact."""


def started(asked: Mapping[str, Any], structure: Mapping[str, Any]) -> tuple[Scene, NDArray[np.float64]]:
    """A scene on a structure, and the squares of its natural frequencies without contacts [rad²/s²].

    The band is an octave on each side of the first elastic frequency. A contact begins as stiff as the
    structure is where it acts, under a load whose friction is of the size of the excitation in that mode:
    values to begin a search from. SceneError with everything that is wrong.

    Parameters
    ----------
    asked : `name`, `contacts` (each `name` and `between`), `excitation` and `observe` (each its `dof`). Of
        a sector the excitation also has its `engine_order`, whose nodal diameter counts.
    structure : its tables, files read.
    """
    from solver.linear.assembly import linear_model
    from solver.matrices.diagnostics import rigid_body_modes
    from solver.matrices.normal_modes import undamped_modes
    from solver.scene.scene import Scene
    from solver.scene.scene_records import MatricesStructure

    given = {key: value for key, value in asked["excitation"].items() if value is not None}
    raw = {
        "name": asked["name"], "structure": dict(structure),
        "contacts": [{**contact, "kt": 1.0, "mu": FRICTION, "N0": 1.0} for contact in asked["contacts"]],
        "excitation": {**given, "amplitude": FORCE},
        "observe": {**asked["observe"], "band": [1.0, 2.0]},
    }  # fmt: skip
    scene = Scene.from_dict(raw)
    if not isinstance(scene.structure, MatricesStructure):
        raise TypeError(f"the structure is of kind {scene.structure.kind}")
    model = linear_model(scene)
    at = model.diameters(np.ones(1, np.int64))
    K, _, M = (each[0] for each in model.plain(at))
    found = undamped_modes(K, M)
    order = np.argsort(found.omega2)
    omega2 = found.omega2[order]
    moving = dict(zip(scene.structure.dofs, model.shapes @ found.psi[:, order], strict=True))
    rigid = rigid_body_modes(omega2)
    first = min(rigid, omega2.size - 1)
    hz = math.sqrt(max(float(omega2[first]), 0.0)) / (2.0 * math.pi) or 1.0
    pushed = float(abs(moving[given["dof"]][first]))
    rubbing = model.ports_at(at)[0] @ found.psi[:, order]

    def load(rubbed: float) -> float:  # whose friction is of the size of the excitation, both in one mode [N]
        ratio = pushed / rubbed if rubbed > 1e-3 * pushed else 10.0
        return _FORCE_AT_OPTIMUM * FORCE * max(ratio, 0.1) / FRICTION

    contacts = [
        {
            **contact, "kt": _digits(1.0 / float(np.sum(np.abs(moved[rigid:]) ** 2) or 1.0)), "mu": FRICTION,
            "N0": _digits(load(float(abs(moved[first])))),
        }
        for contact, moved in zip(asked["contacts"], rubbing, strict=True)
    ]  # fmt: skip
    raw |= {"contacts": contacts}
    raw["observe"] = {**asked["observe"], "band": [_digits(0.5 * hz, 6), _digits(2.0 * hz, 6)]}
    return Scene.from_dict(raw), omega2


def _digits(value: float, digits: int = 3) -> float:
    return float(f"{value:.{digits}g}")


MOST_SETS = 400
_NODES = ("structure", "cyclic", "nodes")
_FIRST = 6


def told_apart(files: Sequence[str]) -> tuple[list[str], dict[str, Any]]:
    """Files of matrices and labels, and what a structure says of the others: a deck, a reduced sector.

    SceneError for more than one deck.
    """
    from solver.matrices.load_set import array_names
    from solver.matrices.readers import reader_registry as registry

    decks = [name for name in files if Path(name).suffix.lower() in registry.suffixes("nodes")]
    if len(decks) > 1:
        raise SceneError.of(_NODES, "one deck tells the nodes", Shown(", ".join(decks)), named=False)
    rest = [name for name in files if name not in decks]
    found: dict[str, Any] = {"cyclic": {"nodes": decks[0]}} if decks else {}
    if (
        len(rest) == 1
        and Path(rest[0]).suffix.lower() == ".npz"
        and "diameters" in array_names(Path(rest[0]))
    ):
        return [], found | {"diameters": rest[0]}
    return rest, found


def deck_of(structure: Mapping[str, Any]) -> list[dict[str, Any]] | None:
    """The sets of the deck that a structure names, each with how many nodes it has; None without a deck.

    SceneError if it cannot be read, or includes other files.
    """
    from solver.matrices.readers.numbers_in_text import FormatError
    from solver.matrices.sectors.loading import check_alone, read_deck

    cyclic = structure.get("cyclic")
    name = cyclic.get("nodes") if isinstance(cyclic, Mapping) else None
    if not isinstance(name, str):
        return None
    try:
        check_alone(Path(name))
        sets = read_deck(Path(name)).sets
    except FormatError as error:
        raise SceneError.of(_NODES, f"`nodes`: {name!r}: {error}", named=False) from error
    return [{"name": key, "nodes": len(sets[key])} for key in sorted(sets)[:MOST_SETS]]


def reduced_sector(structure: Mapping[str, Any]) -> dict[str, Any]:
    """What the file of a reduced sector holds: its coordinates and nodal diameters.

    SceneError if it is none.
    """
    from solver.matrices.load_set import MatrixFileError
    from solver.matrices.sectors.sector_reduction import read_sector

    try:
        found, was, _ = read_sector(Path(structure["diameters"]))
    except MatrixFileError as error:
        raise SceneError.of(("structure", "diameters"), f"`diameters`: {error}", named=False) from error
    return {"rows": found.size, "modes": was["modes"], "matrices": [], "diameters": list(found.diameters)}


def kept_sector(
    structure: Mapping[str, Any], excitation: Mapping[str, Any], rows: int | None
) -> tuple[dict[str, Any], ReducedSector | None]:
    """The tables of a sector as a scene keeps them, and the reduction if they ask for one.

    SceneError for a model too large as it stands, boundaries that do not match, or anything else that cannot
    be used. `rows`: of its matrices; None for a reduced one.
    """
    from solver.matrices.scene_files import sector_with_files
    from solver.matrices.sectors.loading import MOST_SECTORS
    from solver.matrices.values import MOST_DOFS

    sectors, cyclic = structure["sectors"], structure.get("cyclic") or {}
    if type(sectors) is not int or not 1 <= sectors <= MOST_SECTORS:
        got = Shown(str(sectors)[:80])
        raise SceneError.of(("structure", "sectors"), f"must be a whole number from 1 to {MOST_SECTORS}", got)
    if rows is not None and rows > MOST_DOFS and isinstance(cyclic, Mapping) and "keep_modes" not in cyclic:
        message = (
            f"the sector has {rows} rows, {MOST_DOFS} are the most as they stand: reduce it onto the DOFs "
            "named and some modes of the rest at each nodal diameter, say 20"
        )
        raise SceneError.of(("structure", "cyclic", "keep_modes"), message, named=False)
    if "keep_modes" in structure:
        wanted = "of a sector stands in `cyclic`: it is reduced at each nodal diameter"
        raise SceneError.of(("structure", "keep_modes"), wanted)
    order = excitation.get("engine_order")
    return sector_with_files({"kind": "matrices", **structure}, Path(), [order if type(order) is int else 0])


def kept_answer(reduced: ReducedSector) -> dict[str, Any]:
    """What the reduction of a sector kept, and what it is good for."""
    return {
        "modes": reduced.modes, "highest_hz": reduced.highest_hz, "good_to_hz": reduced.good_to_hz,
        "held_hz": reduced.quality[0].held_hz.tolist(),
        "static_residual": max(quality.static_residual for quality in reduced.quality),
        "mass_carried": {},
        "diameters": [
            {
                "diameter": n, "good_to_hz": quality.good_to_hz,
                "frequencies_hz": quality.system_hz[:_FIRST].tolist(),
            }
            for n, quality in zip(reduced.matrices.diameters, reduced.quality, strict=True)
        ],
    }  # fmt: skip
