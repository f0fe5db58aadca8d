"""The outline of a sector's mesh: edges counted by hand, files that keep it, what is wrong with one."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from each import each
from scipy.linalg import eigh
from sector_files import DOFS, SECTORS, TABLES, scene_of, sector_files

import solver
from service.cli import main
from solver.matrices.readers.numbers_in_text import FormatError
from solver.matrices.sectors.elimination import elimination, phase_factor
from solver.matrices.sectors.loading import read_deck
from solver.matrices.sectors.outline import KEYS, SectorOutline, outline_of
from solver.matrices.sectors.sector_reduction import read_sector
from solver.views.shapes import deflection_shape, mode_shape, shape_of_motion

CUBE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
HIGHER = [(x, y, 2) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
MESHES: dict[str, tuple[list[tuple[int, ...]], str, list[list[int]], int]] = {
    "a brick": (CUBE, "C3D8R", [[1, 2, 3, 4, 5, 6, 7, 8]], 12),
    # The faces of both are in one plane where they meet: the four edges there are not drawn.
    "two bricks": (CUBE + HIGHER, "C3D8", [[1, 2, 3, 4, 5, 6, 7, 8], [5, 6, 7, 8, 9, 10, 11, 12]], 16),
    "a tetrahedron": (CUBE[:2] + CUBE[3:5], "C3D4", [[1, 2, 3, 4]], 6),
    "a wedge": (CUBE[:3] + CUBE[4:7], "C3D6", [[1, 2, 3, 4, 5, 6]], 9),
    "flat shells": (CUBE[:4] + [(2, 0, 0), (2, 1, 0)], "S4", [[1, 2, 3, 4], [2, 5, 6, 3]], 6),
    "bent shells, one of them turned over": (CUBE[:6], "S4", [[1, 2, 3, 4], [1, 2, 6, 5]], 7),
    "nothing that is drawn": (CUBE, "B31", [[1, 2]], 0),
}


def written(folder: Path, places: list[tuple[int, ...]], kind: str, elements: list[list[int]]) -> Path:
    lines = ["*NODE", *(f"{i}, {x}., {y}., {z}." for i, (x, y, z) in enumerate(places, start=1))]
    lines.append(f"*Element, type={kind}, elset=ALL")
    for number, nodes in enumerate(elements, start=1):
        text = [str(one) for one in (number, *nodes)]
        # A long element goes on in the next line.
        lines += [", ".join(text[:6]) + ",", ", ".join(text[6:])] if len(text) > 6 else [", ".join(text)]
    (folder / "mesh.inp").write_text("\n".join(lines) + "\n")
    return folder / "mesh.inp"


@pytest.mark.parametrize("mesh", MESHES)
def test_edges_are_drawn_where_a_surface_ends_or_is_bent(mesh: str, tmp_path: Path) -> None:
    places, kind, elements, count = MESHES[mesh]
    deck = read_deck(written(tmp_path, places, kind, elements), elements=True)
    found, nodes = outline_of(deck, [1], [2], metres=1e-3)
    assert len(nodes) == len(found.points)
    assert len(found.edges) == count
    length = np.linalg.norm(found.points[found.edges[:, 0]] - found.points[found.edges[:, 1]], axis=1)
    assert np.all(length > 0.0)
    if count:
        assert length.max() < 1.5e-3  # edges, no diagonals of faces but those of triangles
    else:
        assert len(found.points) == len(places)  # the nodes stand for the mesh
    np.testing.assert_allclose(found.points[found.high], [[1e-3, 0.0, 0.0]])
    assert not read_deck(tmp_path / "mesh.inp").elements  # which costs nothing unless it is asked for


def test_the_shipped_sector_meets_the_next_one() -> None:
    structure: Any = solver.load_scene("fe-disk").structure
    found: SectorOutline = structure.outline
    angle = 2.0 * math.pi / structure.sectors
    turn = [
        [math.cos(angle), -math.sin(angle), 0.0],
        [math.sin(angle), math.cos(angle), 0.0],
        [0.0, 0.0, 1.0],
    ]
    low, high = found.points[found.low] @ np.array(turn).T, found.points[found.high]
    away = np.linalg.norm(low[:, None] - high[None], axis=2)
    assert away.min(axis=0).max() < 2e-5
    assert away.min(axis=1).max() < 2e-5
    radius = np.hypot(*found.points[:, :2].T)
    assert (radius.min(), radius.max()) == pytest.approx((0.09, 0.305), rel=1e-4)  # docs/fe/disk.py
    for contact in solver.load_scene("fe-disk").contacts:
        place = np.array(contact.at)  # type: ignore[attr-defined]
        assert np.linalg.norm(found.points - place, axis=1).min() < 2e-5


def test_a_reduced_sector_and_a_scene_keep_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name, data in sector_files().items():
        Path(name).write_bytes(data)
    words = ["import", "ring.mas", "ring.sti", "--mapping", "ring.dof", "--nodes", "ring.inp", "--low", "LOW",
             "--high", "HIGH", "--sectors", str(SECTORS)]  # fmt: skip
    words += [text for name, label in DOFS.items() for text in ("--dof", f"{name}={label}")]
    assert main([*words, "--out", "whole.toml"]) == 0
    assert main([*words, "--out", "small.toml", "--reduce", "--modes", "3"]) == 0
    outlines = [solver.load_scene(name).structure.outline for name in ("whole.toml", "small.toml")]  # type: ignore[union-attr]
    kept = read_sector(tmp_path / "small-reduced.npz")[2]
    whole, small = outlines
    assert kept is not None and whole is not None and small == kept  # noqa: PT018
    assert all(np.array_equal(getattr(whole, key), getattr(kept, key)) for key in KEYS)
    assert (len(whole.moved), len(kept.moved)) == (27, 0)  # each node along each axis by its row
    assert (len(kept.points), len(kept.edges), kept.low.tolist(), kept.high.tolist()) == (
        9, 0, [0, 1, 2], [6, 7, 8]
    )  # fmt: skip
    for name in ("whole.toml", "small.toml"):
        scene = solver.load_scene(name)
        assert solver.Scene.from_dict(json.loads(json.dumps(scene.to_dict()))) == scene


def shapes_and_full(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, **changes: Any
) -> tuple[tuple[Any, Any], Any]:
    """A ring reduced with all its modes and as it is, as scenes, and the structure of the latter."""
    monkeypatch.chdir(tmp_path)
    for name, data in sector_files().items():
        Path(name).write_bytes(data)
    full = {"M": "ring.mas", "K": "ring.sti", "mapping": "ring.dof", "dofs": DOFS}
    joined = {**TABLES, "nodes": "ring.inp"}
    raw, free = scene_of({**full, "cyclic": joined}), 18 - len(DOFS)
    small = scene_of({**full, "cyclic": {**joined, "keep_modes": free}}) | changes
    whole = raw | changes
    scenes = []
    for name, table in (("small.json", small), ("whole.json", whole)):
        table["excitation"]["engine_order"] = 1  # which meets every nodal diameter
        Path(name).write_text(json.dumps(table))
        scenes.append(solver.load_scene(name))
    return (scenes[0], scenes[1]), scenes[1].structure


@pytest.mark.parametrize("reduced", [True, False])
def test_the_mesh_of_a_mode_is_that_of_the_full_sector(
    reduced: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenes, full = shapes_and_full(tmp_path, monkeypatch, contacts=[])
    scene, off = scenes[not reduced], 2e-3 if reduced else 1e-6
    gone = elimination(27, full.cyclic.low_rows, full.cyclic.high_rows, full.cyclic.axis, SECTORS)
    for n in (0, 2, 3):
        K, M = (gone.of(matrix.array).at(n, SECTORS) for matrix in (full.K, full.M))
        squares, vectors = eigh(K, M)
        wave = (gone.here + phase_factor(n, SECTORS) * gone.beyond) @ vectors[:, 0]
        shape = mode_shape(scene, 1, nodal_diameter=n)
        assert shape.picture.notes == []
        assert shape.frequency_hz == pytest.approx(math.sqrt(squares[0]) / (2.0 * math.pi), rel=1e-6)
        found = shape.motions[0, -1, :9].ravel()
        turn = np.vdot(found, wave) / abs(np.vdot(found, wave))
        np.testing.assert_allclose(found * turn, wave, atol=off * np.abs(wave).max())
        told = [found[3 * 5 + 2], found[3 * 3]]  # the rim and the hub, by the places of their labels
        again = shape_of_motion(scene, tuple(DOFS), np.array(told), shape.frequency_hz, {}, n)
        np.testing.assert_allclose(
            again.motions[0, -1, :9].ravel(), found, atol=2.0 * off * np.abs(found).max()
        )


@pytest.mark.parametrize("reduced", [True, False])
def test_the_mesh_of_all_sectors_is_that_of_one_wave(
    reduced: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = shapes_and_full(tmp_path, monkeypatch)[0][not reduced]
    solved = [
        solver.solve(scene, frequency_hz=40.0, harmonics=3, effects=solver.Effects(every_sector=every))
        for every in (False, True)
    ]
    one, whole = (deflection_shape(scene, solution) for solution in solved)
    assert (len(one.motions), len(whole.motions)) == (1, SECTORS)
    size = np.abs(one.motions[:, :, :9]).max()
    assert size > 0.0
    for j in range(SECTORS):
        turns = np.exp(1j * one.harmonics * j * one.turn)[:, None, None]
        np.testing.assert_allclose(whole.motions[j, :, :9], turns * one.motions[0, :, :9], atol=1e-5 * size)


def test_a_file_without_the_motion_of_the_mesh_is_read(tmp_path: Path) -> None:
    scene = solver.load_scene("fe-disk")
    shipped = Path(solver.__file__).parent / "scene" / "shipped"
    with np.load(shipped / "fe-disk.npz") as found:
        old = {key: found[key] for key in found.files if key not in ("outline_patterns", "outline_shares")}
    np.savez(tmp_path / "fe-disk.npz", **old)
    (tmp_path / "disk.toml").write_text((shipped / "fe-disk.toml").read_text())
    before = solver.load_scene(tmp_path / "disk.toml")
    shapes = [mode_shape(each, 1, nodal_diameter=3) for each in (before, scene)]
    assert [shape.motions[0, 0, :114].any() for shape in shapes] == [False, True]
    assert "at rest" in " ".join(shapes[0].picture.notes)
    assert shapes[1].picture.notes == []
    # Points of the mesh where contacts are move as the DOFs of the nodes there.
    points = np.array(shapes[1].picture.points)
    for i in range(114, len(points)):
        near = int(np.linalg.norm(points[:114] - points[i], axis=1).argmin())
        moved = shapes[1].motions[0, 0]
        np.testing.assert_allclose(moved[near], moved[i], atol=1e-3 * np.abs(moved).max())


BAD: dict[str, tuple[Any, str]] = {
    "no table": ([], "must be a table"),
    "a key": ({"points": []}, "the keys points, edges, low, high"),
    "flat": ({"points": [1.0, 2.0], "edges": [], "low": [], "high": []}, "rows of 3 numbers"),
    "ragged": ({"points": [[1.0], [2.0, 3.0]], "edges": [], "low": [], "high": []}, "rows of one length"),
    "text": ({"points": [["a", 0, 0]], "edges": [], "low": [], "high": []}, "must hold numbers"),
    "not finite": ({"points": [[math.nan, 0, 0]], "edges": [], "low": [], "high": []}, "finite"),
    "not whole": ({"points": [[0, 0, 0]], "edges": [], "low": [0.5], "high": []}, "whole numbers"),
    "nowhere": ({"points": [[0, 0, 0]], "edges": [[0, 1]], "low": [], "high": []}, "points from 0 to 0"),
    "moved nowhere": (
        {"points": [[0, 0, 0]], "edges": [], "low": [], "high": [], "moved": [[3, 0, 1]]},
        "axes of",
    ),
    "too many": ({"points": [[0, 0, 0]] * 10_001, "edges": [], "low": [], "high": []}, "at most 10000"),
}


@each("case", BAD)
def test_what_is_wrong_with_an_outline_is_said(case: str) -> None:
    given, words = BAD[case]
    raw: dict[str, Any] = solver.load_scene("fe-disk").to_dict()
    raw["structure"] = {**raw["structure"], "outline": given}
    with pytest.raises(solver.SceneError, match=words):
        solver.Scene.from_dict(raw)


def test_rows_that_the_matrices_lack_move_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    raw = shapes_and_full(tmp_path, monkeypatch)[0][1].to_dict()
    raw["structure"]["outline"]["moved"][0][1] = 27
    with pytest.raises(solver.SceneError, match="`moved` of the outline must name rows from 0 to 26, got 27"):
        solver.Scene.from_dict(raw)


def test_an_element_that_is_damaged_is_named(tmp_path: Path) -> None:
    for elements, words in (
        ([[1, 2, 3]], "must have 8 nodes each"),
        ([[1, 2, 3, 4, 5, 6, 7, 99]], "node 99"),
    ):
        path = written(tmp_path, CUBE, "C3D8", elements)
        with pytest.raises((FormatError, ValueError), match=words):
            outline_of(read_deck(path, elements=True), [1], [2])
    path.write_text(path.read_text().replace("1, 1, 2", "1, one, 2"))
    with pytest.raises(FormatError, match="line 11 must hold an element"):
        read_deck(path, elements=True)
