"""Scene files that go to a service: as they are, or with the files of matrices they name uploaded first."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service.errors import InputError
from service.jobs.common.scenes import UPLOAD, Place, named_files, with_named

if TYPE_CHECKING:
    from service.client.client import Client

_DECK = "inp"  # word of the format of a deck, which may have any ending


@dataclass(frozen=True, slots=True)
class SceneWithFiles:
    """The tables of a scene file, and the folder in which the files it names are."""

    tables: Mapping[str, Any]
    folder: Path


def scene_to_submit(path: str) -> dict[str, Any] | SceneWithFiles:
    """A scene file for the body of a request; one that names files of matrices waits for their upload.

    Raises
    ------
    SceneError
        If it cannot be read, or is wrong and names no files.
    """
    import solver
    from solver.scene.toml import load_raw

    raw = load_raw(path)
    structure = raw.get("structure")
    named = (
        isinstance(structure, Mapping)
        and structure.get("kind") == "matrices"
        and bool(named_files(structure))
    )
    return SceneWithFiles(raw, Path(path).parent) if named else solver.load_scene(path).to_dict()


def uploaded(client: Client, body: Mapping[str, Any]) -> dict[str, Any]:
    """The body with its scene's files uploaded and referred to by their ids.

    Raises
    ------
    InputError
        If a file cannot be read.
    """
    scene = body.get("scene")
    if not isinstance(scene, SceneWithFiles):
        return dict(body)
    structure = dict(scene.tables["structure"])
    known: dict[tuple[str, bool], str] = {}
    labels = _labels_beside(structure, scene.folder)
    if labels is not None:
        structure["mapping"] = str(labels)
    sent = {}
    for place, name in named_files(structure).items():
        if not name.startswith(UPLOAD):
            once = name, place[-1] == "nodes"
            known[once] = known.get(once) or _sent(client, scene.folder / name, place)
            sent[place] = known[once]
    return {**body, "scene": {**scene.tables, "structure": with_named(structure, sent)}}


def _labels_beside(structure: Mapping[str, Any], folder: Path) -> Path | None:
    """The file that names the rows, where DOFs are named by node and only its place says so."""
    from solver.matrices.files import labels_beside

    dofs = structure.get("dofs")
    by_node = isinstance(dofs, Mapping) and any(isinstance(row, str) for row in dofs.values())
    cyclic = structure.get("cyclic")
    by_node = by_node or (isinstance(cyclic, Mapping) and not {"low", "high", "nodes"}.isdisjoint(cyclic))
    if not by_node or "mapping" in structure:
        return None
    files = [folder / structure[key] for key in ("M", "K", "C") if isinstance(structure.get(key), str)]
    found = next(filter(None, map(labels_beside, files)), None)
    return None if found is None else found.absolute()


def _sent(client: Client, file: Path, place: Place) -> str:
    key = place[-1]
    try:
        data = file.read_bytes()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"`{key}` of the scene: {str(file)!r} cannot be read: {reason}") from error
    form = _DECK if place == ("cyclic", "nodes") else None
    return UPLOAD + client.upload(data, f"{place[0]}{file.suffix}", form).id
