"""One sector of a disk in uploaded files: its deck, and the scene that begins with it.

It runs in the reader's process, as `service.uploads.matrix_summary`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from solver.errors import SceneError, Shown

if TYPE_CHECKING:
    from solver.matrices.sectors.sector_reduction import ReducedSector

MOST_SETS = 400
_NODES = ("structure", "cyclic", "nodes")
_FIRST = 6


def told_apart(files: Sequence[str]) -> tuple[list[str], dict[str, Any]]:
    """Files of matrices and labels, and what a structure says of the others: a deck, a reduced sector.

    Raises
    ------
    SceneError
        More than one deck.
    """
    from solver.matrices.matrix_files import array_names
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

    Raises
    ------
    SceneError
        It cannot be read, or includes other files.
    """
    from solver.matrices.readers.numbers_in_text import FormatError
    from solver.matrices.sectors.decks import check_alone, read_deck

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

    Raises
    ------
    SceneError
        It is none.
    """
    from solver.matrices.matrix_files import MatrixFileError
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

    Parameters
    ----------
    rows : of its matrices; None for a reduced one.

    Raises
    ------
    SceneError
        A model too large as it stands, boundaries that do not match, or anything else that cannot be used.
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
