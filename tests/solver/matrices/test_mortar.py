"""Faces whose meshes do not match: patch tests, pairs of nodes where they do, and a cylinder on a flat.

Hertz's pressure and half width, and the stick zone of Cattaneo and Mindlin, judge the whole way from the
meshes to the response.
"""

from __future__ import annotations

import importlib.util
import math
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from each import each
from scipy.io import mmwrite
from scipy.sparse import coo_array

import solver
from service.cli import main
from solver.linear.assembly import linear_model
from solver.matrices.decks.deck import Deck, shape_of
from solver.matrices.mortar import MortarPair, mortar
from solver.matrices.sectors.loading import read_deck
from solver.scene.cyclic.annulus import annulus

ROOT = Path(__file__).resolve().parent.parent.parent.parent
Z = (0.0, 0.0, 1.0)


def square(
    counts: tuple[int, int], first: int, rng: np.random.Generator, *, loose: float = 0.0,
    low: tuple[float, float] = (0.0, 0.0), high: tuple[float, float] = (1.0, 1.0),
) -> tuple[dict[int, Any], np.ndarray]:  # fmt: skip
    """Nodes and quadrangles over a rectangle, its inner nodes moved by up to `loose` of a cell."""
    x, y = (np.linspace(0.0, 1.0, count + 1) for count in counts)
    flat = np.array([(a, b) for b in y for a in x])
    inner = ((flat > 0.0) & (flat < 1.0)).all(axis=1)
    flat[inner] += rng.uniform(-loose, loose, (int(inner.sum()), 2)) / np.array(counts)
    flat = np.array(low) + flat * (np.array(high) - np.array(low))
    corners = first + np.array(
        [(j * (counts[0] + 1) + i) for j in range(counts[1]) for i in range(counts[0])]
    )
    up = counts[0] + 1
    cells = corners[:, None] + np.array([0, 1, up + 1, up])
    return {first + i: (float(a), float(b), 0.0) for i, (a, b) in enumerate(flat)}, cells


def pushes(pair: MortarPair) -> dict[int, float]:
    """What an even pressure of 1 does to the nodes of the second face."""
    found: dict[int, float] = {}
    for weights, area in zip(pair.weights, pair.areas, strict=True):
        for node, weight in weights.items():
            found[node] = found.get(node, 0.0) + weight * area
    return found


def own_shares(nodes: dict[int, Any], cells: np.ndarray) -> dict[int, float]:
    """∫N of every node of a mesh of quadrangles, by the four points of Gauss of each, exact."""
    found = dict.fromkeys(nodes, 0.0)
    ends = 0.5 + np.array([-0.5, 0.5]) / math.sqrt(3.0)
    for cell in cells:
        corners = np.array([nodes[int(node)][:2] for node in cell])
        for s, t in ((s, t) for s in ends for t in ends):
            shapes = np.array([(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t])
            slopes = np.array([[t - 1, 1 - t, t, -t], [s - 1, -s, s, 1 - s]])
            for node, share in zip(cell, 0.25 * np.linalg.det(slopes @ corners) * shapes, strict=True):
                found[int(node)] += float(share)
    return found


def turned(nodes: dict[int, Any], turn: np.ndarray) -> dict[int, Any]:
    return {node: tuple(map(float, turn @ np.array(at))) for node, at in nodes.items()}


@each("elements", [True, False])
@each("seed", range(6))
def test_an_even_pressure_and_linear_motions_pass(seed: int, *, elements: bool) -> None:
    """Quadrangles of any size, or the triangles between nodes, in any direction."""
    rng = np.random.default_rng(seed)
    loose = 0.0 if elements else 0.3
    first, own = square(tuple(rng.integers(1, 7, 2)), 1, rng, loose=loose)
    second, other = square(tuple(rng.integers(1, 7, 2)), 1001, rng, loose=loose)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    kind = shape_of("S4")
    deck = Deck(turned(first | second, turn), {}, [(kind, own), (kind, other)] if elements else [])
    found = mortar(deck, list(first), list(second), 3.0 * turn @ Z)
    assert found.nodes == list(first)
    assert found.areas.sum() == pytest.approx(1.0, rel=1e-12)
    np.testing.assert_allclose([sum(each.values()) for each in found.weights], 1.0, rtol=1e-12)
    np.testing.assert_allclose(found.gaps, 0.0, atol=1e-12)
    got = pushes(found)
    if elements:
        wanted = own_shares(second, other)
        np.testing.assert_allclose(
            [got[node] for node in second], [wanted[node] for node in second], rtol=1e-12
        )
    middle = sum(push * np.array(second[node]) for node, push in got.items())
    np.testing.assert_allclose(middle, [0.5, 0.5, 0.0], rtol=1e-11)
    slope = rng.normal(size=(3, 3))
    for node, weights in zip(found.nodes, found.weights, strict=True):
        there = sum(weight * np.array(deck.nodes[each]) for each, weight in weights.items())
        np.testing.assert_allclose(slope @ there, slope @ np.array(deck.nodes[node]), atol=1e-11)


@pytest.mark.parametrize("seed", range(4))
def test_distorted_quadrangles_pass_it_as_far_as_integrals_of_quotients_go(seed: int) -> None:
    rng = np.random.default_rng(seed)
    (first, own), (second, other) = (square((4, 3), 1, rng, loose=0.2), square((5, 6), 101, rng, loose=0.2))
    kind = shape_of("S4")
    deck = Deck(first | second, {}, [(kind, own), (kind, other)])
    got, wanted = pushes(mortar(deck, list(first), list(second), Z)), own_shares(second, other)
    assert sum(got.values()) == pytest.approx(1.0, rel=1e-12)
    np.testing.assert_allclose([got[node] for node in second], [wanted[node] for node in second], rtol=1e-11)


@pytest.mark.parametrize("seed", range(4))
def test_lines_in_a_plane_pass_it_too(seed: int) -> None:
    rng = np.random.default_rng(seed)
    both = [np.concatenate([[0.0], np.sort(rng.uniform(0.0, 1.0, rng.integers(0, 9))), [1.0]]) for _ in "ab"]
    first, second = (
        {start + i: (float(x), 0.3 * float(x), 0.0) for i, x in enumerate(along)}
        for start, along in zip((1, 101), both, strict=True)
    )
    nodes = list(first)
    rng.shuffle(nodes)
    found = mortar(Deck(first | second), nodes, list(second), (-0.3, 1.0, 0.0))
    length = math.hypot(1.0, 0.3)
    assert found.areas.sum() == pytest.approx(length, rel=1e-12)
    got, steps = pushes(found), np.diff(both[1])
    wanted = 0.5 * length * (np.append(steps, 0.0) + np.append(0.0, steps))
    np.testing.assert_allclose([got[node] for node in second], wanted, rtol=1e-11)


def test_where_meshes_match_a_node_touches_one_alone() -> None:
    rng = np.random.default_rng(1)
    first, own = square((3, 4), 1, rng, loose=0.2)
    second = {node + 100: (x, y, 0.25) for node, (x, y, _) in first.items()}
    kind = shape_of("S4")
    found = mortar(Deck(first | second, {}, [(kind, own), (kind, own + 100)]), list(first), list(second), Z)
    for node, weights in zip(found.nodes, found.weights, strict=True):
        assert weights[node + 100] == pytest.approx(1.0, rel=1e-10)
        assert sum(map(abs, weights.values())) == pytest.approx(1.0, rel=1e-9)
    np.testing.assert_allclose(found.gaps, 0.25, rtol=1e-12)


def test_a_face_that_reaches_beyond_the_other_is_joined_where_they_overlap() -> None:
    rng = np.random.default_rng(2)
    first, _ = square((7, 5), 1, rng)
    second, _ = square((3, 4), 101, rng, low=(0.31, -0.5), high=(2.0, 0.47))
    found = mortar(Deck(first | second), list(first), list(second), Z)
    assert found.areas.sum() == pytest.approx(0.69 * 0.47, rel=1e-11)
    assert set(found.nodes) < set(first)
    np.testing.assert_allclose([sum(each.values()) for each in found.weights], 1.0, rtol=1e-9)
    assert sum(pushes(found).values()) == pytest.approx(0.69 * 0.47, rel=1e-11)


@pytest.mark.parametrize("beyond", [1e-3, 1e-4, 3e-5, 1e-5, 1e-6])
def test_slivers_of_facets_do_not_spoil_weights(beyond: float) -> None:
    """A corner of the second face lies just beyond a facet of the first, as by rounding of their places."""
    rng = np.random.default_rng(3)
    first, own = square((3, 3), 1, rng)
    end = 1.0 / 3.0 + beyond
    second, other = square((4, 5), 1001, rng, loose=0.2, low=(-0.6, -0.5), high=(end, end))
    kind = shape_of("S4")
    found = mortar(Deck(first | second, {}, [(kind, own), (kind, other)]), list(first), list(second), Z)
    assert found.areas.sum() == pytest.approx(end**2, rel=1e-5)
    for node, weights in zip(found.nodes, found.weights, strict=True):
        assert sum(weights.values()) == pytest.approx(1.0, rel=1e-7)
        there = sum(weight * np.array(second[each]) for each, weight in weights.items())
        np.testing.assert_allclose(there, first[node], atol=1e-7)


def test_faces_that_cannot_be_joined_are_refused() -> None:
    rng = np.random.default_rng(3)
    (first, own), (second, _) = square((2, 2), 1, rng), square((3, 3), 101, rng)
    away = {node + 100: (x + 5.0, y, z) for node, (x, y, z) in second.items()}
    deck = Deck(first | second | away, {}, [])
    for nodes, others, normal, words in (
        (list(first), list(second), (0.0, 0.0, 0.0), r"normal must be three numbers, not all 0, got \[0"),
        (list(first), list(away), Z, "do not lie over each other along the normal"),
        ([1, 1, 2], list(second), Z, "node 1 is twice in a face"),
        ([1, 2, 99], list(second), Z, "node 99 is not in the deck"),
        ([], list(second), Z, "a face has no nodes"),
        ([1], list(second), Z, "a face of a single node has no area"),
        ([1, 2, 3], list(second), Z, "either both lie along a line"),
    ):
        with pytest.raises(ValueError, match=words):
            mortar(deck, nodes, others, normal)
    half = Deck(first | second, {}, [(shape_of("S4"), own[:2])])
    with pytest.raises(ValueError, match="node 7 is no corner of a face of elements"):
        mortar(half, list(first), list(second), Z)


@pytest.fixture
def model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of two parts with faces of 9 and of 16 nodes, entered."""
    monkeypatch.chdir(tmp_path)
    return written(tmp_path, 3)


def written(tmp_path: Path, cells_across: int) -> Path:
    """Two parts on springs, the face of one 2 x 2 cells: matrices, names of rows, deck in mm."""
    rng = np.random.default_rng(3)
    (first, own), (second, other) = square((2, 2), 1, rng), square((cells_across,) * 2, 101, rng)
    labels = [f"{node}.{axis}" for node in (*first, *second) for axis in (1, 2, 3)]
    loose = rng.normal(size=(len(labels),) * 2)
    K = 2e5 * np.eye(len(labels)) + 1e3 * (loose @ loose.T)
    mmwrite(tmp_path / "K.mtx", coo_array(K), symmetry="symmetric")
    mass = rng.uniform(1e-4, 2e-4, len(labels))
    mmwrite(tmp_path / "M.mtx", coo_array(np.diag(mass)), symmetry="symmetric")
    (tmp_path / "rows.dof").write_text("\n".join(labels) + "\n")
    rows = [f"{node}, {20.0 * x}, {20.0 * y}, {z}\n" for node, (x, y, z) in (first | second).items()]
    sets = f"*NSET, NSET=TOP, GENERATE\n1, 9\n*NSET, NSET=FOOT, GENERATE\n101, {100 + len(second)}\n"
    cells = [f"{i}, {', '.join(map(str, cell))}\n" for i, cell in enumerate([*own, *other], start=1)]
    text = ["*NODE\n", *rows, "*ELEMENT, TYPE=S4\n", *cells, sets]
    (tmp_path / "deck.inp").write_text("".join(text))
    return tmp_path


IMPORT = ["import", "M.mtx", "K.mtx", "--mapping", "rows.dof", "--units", "mm", "--nodes", "deck.inp"]
FACE = "face=TOP:FOOT,pairing=mortar,normal=z,kt=1.6e6,kn=3.2e6,mu=0.3,N0=160"


def test_the_command_makes_a_patch_of_them(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*IMPORT, "--out", "scene.toml", "--patch", FACE, "--force", "n5x=400"]) == 0
    scene = solver.load_scene(model / "scene.toml")
    assert solver.Scene.from_dict(scene.to_dict()) == scene
    assert sum(contact.N0 for contact in scene.with_values({"face.N0": 320.0}).contacts) == pytest.approx(
        320.0
    )
    # A body moved as one does not move the contacts; every motion is that of the node less its weights.
    linear = linear_model(scene)
    rigid = np.array([1.0 if dof.endswith("y") else 0.0 for dof in linear.dofs])
    np.testing.assert_allclose(linear.contact_here @ rigid, 0.0, atol=1e-11)
    wanted = mortar(
        read_deck(model / "deck.inp", elements=True), list(range(1, 10)), list(range(101, 117)), Z
    )
    first = scene.forms[0][2]
    assert {t.dof: pytest.approx(t.factor) for t in first}["n1z"] == 1.0
    np.testing.assert_allclose(
        sorted(-t.factor for t in first if t.dof != "n1z"), sorted(wanted.weights[0].values()), atol=1e-12
    )
    found = solver.solve(scene, frequency_hz=40.0, harmonics=5)
    assert found.converged
    assert main([*IMPORT, "--out", "other.toml", "--patch", FACE.replace("mortar", "nearest")]) != 0
    assert "`pairing` must be nodes or mortar, got 'nearest'" in " ".join(capsys.readouterr().err.split())


def test_where_meshes_match_the_patch_is_that_of_nodes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(written(tmp_path, 2))
    for name, patch in (("one", FACE), ("other", FACE.replace("pairing=mortar,", ""))):
        assert main([*IMPORT, "--out", f"{name}.toml", "--patch", patch, "--force", "n5x=400"]) == 0
    one, other = (solver.load_scene(tmp_path / f"{name}.toml") for name in ("one", "other"))
    here, there = (linear_model(each).contact_here for each in (one, other))
    np.testing.assert_allclose(here, there, atol=1e-12)
    np.testing.assert_allclose([c.kn for c in one.contacts], [c.kn for c in other.contacts], rtol=1e-12)
    answers = [solver.solve(each, frequency_hz=40.0, harmonics=3) for each in (one, other)]
    assert answers[0].converged
    assert answers[0].max_abs == pytest.approx(answers[1].max_abs, rel=1e-9)


def test_spread_ends_are_checked(model: Path) -> None:
    assert main([*IMPORT, "--out", "scene.toml", "--patch", FACE, "--force", "n5x=4"]) == 0
    raw = solver.load_scene(model / "scene.toml").to_dict()
    contact = {
        "name": "c", "law": "coulomb-3d", "between": ["n1", "n101"], "at": [0.0, 0.0, 0.0], "normal": list(Z),
        "kt": 1e6, "kn": 1e6, "mu": 0.3, "N0": 1.0,
    }  # fmt: skip
    for more, words in (
        ({"spread": {"n101": 0.5, "n102": 0.4}}, "weights that sum to 1, got 0.9"),
        ({"spread": {"n101": 0.5, "ground": 0.5}}, "must name nodes or bodies"),
        ({"spread": {"n101": 0.5, "n999": 0.5}}, "`spread`: there is no body or node 'n999'"),
        ({"spread": {"n101": 0.5, "n102@next": 0.5}}, "`spread`: 'n102@next' needs a cyclic structure"),
        ({"spread": {"n101": 1.0}, "normal": None, "at": None}, "`spread` of a contact needs `normal`"),
    ):
        given = {key: value for key, value in {**contact, **more}.items() if value is not None}
        with pytest.raises(solver.SceneError, match=words):
            solver.Scene.from_dict({**raw, "contacts": [given]})


def test_a_spread_end_in_the_next_sector_is_that_of_the_whole_disk() -> None:
    """One sector as a wave, and all of them written out: the face turns with its sector."""
    sides = ("a", "b", "c")
    masses = {f"{side}{axis}": 1.0 for side in sides for axis in "xy"}
    raw = {
        "name": "disk",
        "structure": {
            "kind": "cyclic", "sectors": 5, "axis": [0.0, 0.0, 1.0], "masses": masses,
            "springs": [
                {"between": [dof, "ground"], "k": 2.0 + i, "c": 0.05} for i, dof in enumerate(masses)
            ],
        },
        "nodes": [
            {"name": side, "at": [1.0 + 0.1 * i, 0.0, 0.0], "dofs": {"x": f"{side}x", "y": f"{side}y"}}
            for i, side in enumerate(sides)
        ],
        "contacts": [
            {
                "name": "f", "between": ["a", "b@next"], "spread": {"b@next": 0.3, "c@next": 0.7},
                "at": [1.0, 0.0, 0.0], "normal": [0.0, 1.0, 0.0], "kt": 0.7, "mu": 0.4, "N0": 0.3,
            }
        ],
        "excitation": {"dof": "ax", "amplitude": 0.5, "engine_order": 1},
        "observe": {"dof": "ax", "band": [0.1, 0.4]},
    }  # fmt: skip
    scene = solver.Scene.from_dict(raw)
    one, whole = (solver.solve(each, frequency_hz=0.21, harmonics=7) for each in (scene, annulus(scene)))
    assert one.converged
    assert one.contacts[0].forces[0].any()
    assert one.max_abs == pytest.approx(whole.max_abs, rel=1e-9)


def cylinder() -> ModuleType:
    spec = importlib.util.spec_from_file_location("cylinder", ROOT / "docs" / "fe" / "cylinder.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("steps", "share", "wide", "high"),
    [
        (6, 0.5, 1e-2, 2e-3),
        pytest.param(12, 0.8, 5e-3, 5e-4, marks=pytest.mark.long),
        pytest.param(24, 0.5, 2e-3, 1e-4, marks=pytest.mark.long),
    ],
)
def test_a_cylinder_on_a_flat_is_that_of_hertz_cattaneo_and_mindlin(
    steps: int, share: float, wide: float, high: float
) -> None:
    page = cylinder()
    force = page.PRESSED
    found = page.tractions(page.cylinder_on_flat(steps, force=force, rub=share * page.MU * force))
    wanted, seen = page.ClosedForm.of(found.P, found.Q), page.Measured.of(found)
    assert 0.3 < found.Q / (page.MU * found.P) < 0.9
    assert seen.half_width == pytest.approx(wanted.half_width, rel=wide)
    assert seen.peak == pytest.approx(wanted.peak, rel=high)
    cell, stick = 1.05 * page.HALF_WIDTH / steps, wanted.stick * wanted.half_width
    assert seen.sticks_to - 0.1 * cell <= stick <= seen.slips_from + 0.1 * cell
    assert seen.slips_from - seen.sticks_to <= 1.05 * cell
