"""Faces of meshes that lie on each other: pairs, areas, and what `stickslip import --patch` makes of them."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from each import each
from scipy.io import mmwrite
from scipy.sparse import coo_array
from scipy.spatial import Voronoi

import solver
from service.cli import main
from solver.balance.balance import build
from solver.balance.workspace import Workspace
from solver.linear.assembly import linear_model
from solver.matrices.mortar import face
from solver.matrices.sectors.elimination import rotation
from solver.matrices.sectors.loading import Deck
from solver.sensitivity.gradient import Sensitivities

TWO_PI = 2.0 * math.pi
OMEGA = TWO_PI * 40.0


def grid(n: int = 3, *, first: int = 1, width: float = 0.02) -> dict[int, tuple[float, float, float]]:
    """Nodes of a square of n x n nodes."""
    along = np.linspace(0.0, width, n)
    places = [(float(x), float(y), 0.0) for y in along for x in along]
    return dict(enumerate(places, start=first))


def test_nodes_of_a_square_own_what_is_nearest_to_them() -> None:
    deck = Deck(grid(3), {})
    found = face(deck, list(deck.nodes), None)
    whole = 0.02**2
    np.testing.assert_allclose(found.areas, whole * np.array([1, 2, 1, 2, 4, 2, 1, 2, 1]) / 16, rtol=1e-12)
    assert found.plane is not None
    np.testing.assert_allclose(np.abs(found.plane), [0.0, 0.0, 1.0], atol=1e-12)
    assert [second for _, second in found.pairs] == [None] * 9


@pytest.mark.parametrize("seed", range(5))
def test_areas_of_a_turned_irregular_face_are_those_of_its_voronoi_cells(seed: int) -> None:
    rng = np.random.default_rng(seed)
    along = np.linspace(0.0, 1.0, 6)
    flat = np.array([(x, y) for y in along for x in along])
    inner = ((flat > 0.01) & (flat < 0.99)).all(axis=1)
    flat[inner] += rng.uniform(-0.01, 0.01, (int(inner.sum()), 2))
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    places = np.column_stack([flat, np.zeros(len(flat))]) @ turn + rng.normal(size=3)
    deck = Deck({i: (float(x), float(y), float(z)) for i, (x, y, z) in enumerate(places, start=1)}, {})
    found = face(deck, list(deck.nodes), None)
    assert found.areas.sum() == pytest.approx(1.0, rel=1e-12)
    # Mirror images on all four sides make every cell of the square end at its edge.
    mirrored = [flat, flat * [-1, 1], flat * [1, -1], flat * [-1, 1] + [2, 0], flat * [1, -1] + [0, 2]]
    cells = Voronoi(np.vstack(mirrored))
    for i in np.flatnonzero(inner):
        corners = cells.vertices[cells.regions[cells.point_region[i]]]
        x, y = corners.T
        area = 0.5 * abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))
        # Right but where a triangle is obtuse, here by little.
        assert found.areas[i] == pytest.approx(area, rel=2e-2)


def test_a_row_of_nodes_owns_lengths_and_has_no_plane() -> None:
    deck = Deck({4: (0.0, 0.0, 0.0), 7: (3.0, 0.0, 0.0), 9: (1.0, 0.0, 0.0)}, {})
    found = face(deck, [4, 7, 9], None)
    np.testing.assert_allclose(found.areas, [0.5, 1.0, 1.5])
    assert found.plane is None


def test_faces_are_paired_by_position_in_any_order_and_across_sectors() -> None:
    nodes = grid(3) | grid(3, first=101)
    second = list(range(109, 100, -1))
    found = face(Deck(nodes, {}), list(range(1, 10)), second)
    assert found.pairs == [(i, i + 100) for i in range(1, 10)]
    # The second face as it lies in its own sector, a turn before the place where it touches.
    turn = rotation((0.0, 0.0, 1.0), 2.0 * math.pi / 12)
    behind = np.array([nodes[i] for i in range(101, 110)]) @ turn
    turned = nodes | {
        i: (float(x), float(y), float(z)) for i, (x, y, z) in zip(range(101, 110), behind, strict=True)
    }
    assert face(Deck(turned, {}), list(range(1, 10)), second, turn).pairs == found.pairs


@pytest.mark.parametrize(
    ("change", "first", "second", "words"),
    [
        ({}, [1, 2, 2], None, "node 2 is twice"),
        ({}, [1, 99], None, "node 99 is not in the deck"),
        ({}, [], None, "no nodes"),
        (
            {103: (0.021, 0.0, 0.0)},
            [1, 2, 3],
            [101, 102, 103],
            "2 nodes touch none .* \\(3, 103\\)",
        ),
        ({}, [1, 2], [101, 102, 103], "1 nodes touch none of the other face \\(103\\)"),
    ],
)
def test_faces_that_do_not_fit_are_refused_with_their_nodes(
    change: dict[int, Any], first: list[int], second: list[int] | None, words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        face(Deck(grid(3) | grid(3, first=101) | change, {}), first, second)


@pytest.fixture
def model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A block on springs on a face of 3 x 3 nodes of another one; matrices, names of rows, deck in mm."""
    monkeypatch.chdir(tmp_path)
    nodes = list(range(1, 10)) + list(range(101, 110))
    labels = [f"{node}.{axis}" for node in nodes for axis in (1, 2, 3)]
    size = len(labels)
    rng = np.random.default_rng(3)
    loose = rng.normal(size=(size, size))
    K = 2e5 * np.eye(size) + 1e3 * (loose @ loose.T)
    mmwrite(tmp_path / "K.mtx", coo_array(K), symmetry="symmetric")
    mmwrite(tmp_path / "M.mtx", coo_array(np.diag(rng.uniform(1e-4, 2e-4, size))), symmetry="symmetric")
    (tmp_path / "rows.dof").write_text("\n".join(labels) + "\n")
    deck = "*NODE\n"
    for node, (x, y, z) in (grid(3, width=20.0) | grid(3, first=101, width=20.0)).items():
        deck += f"{node}, {x}, {y}, {z}\n"
    deck += "*NSET, NSET=TOP, GENERATE\n1, 9\n*NSET, NSET=FOOT, GENERATE\n101, 109\n"
    (tmp_path / "deck.inp").write_text(deck)
    return tmp_path


IMPORT = ("import", "M.mtx", "K.mtx", "--mapping", "rows.dof", "--units", "mm", "--nodes", "deck.inp")
PATCH = "face=TOP:FOOT,normal=z,kt=1.6e6,kn=3.2e6,mu=0.3,N0=160"


def test_a_patch_of_two_sets_is_the_contacts_written_by_hand(model: Path) -> None:
    assert main([*IMPORT, "--out", "scene.toml", "--patch", PATCH, "--force", "n5x=3"]) == 0
    scene = solver.load_scene(model / "scene.toml")
    shares = np.array([1, 2, 1, 2, 4, 2, 1, 2, 1]) / 16
    raw = scene.to_dict()
    assert raw["dampers"][0]["shape"] == "patch"
    by_hand = {key: value for key, value in raw.items() if key != "dampers"}
    by_hand["contacts"] = [
        {"name": f"p{i}", "law": "coulomb-3d", "between": [f"n{i + 1}", f"n{i + 101}"], "prestressed": True,
         "at": [0.01 * (i % 3), 0.01 * (i // 3), 0.0], "normal": [0.0, 0.0, 1.0], "mu": 0.3,
         "kt": 1.6e6 * share, "kn": 3.2e6 * share, "N0": 160.0 * share}
        for i, share in enumerate(shares)
    ]  # fmt: skip
    other = solver.Scene.from_dict(by_hand)
    np.testing.assert_allclose(linear_model(scene).contact_here, linear_model(other).contact_here, atol=1e-15)
    answers = [solver.solve(each, frequency_hz=40.0, harmonics=3) for each in (scene, other)]
    assert answers[0].status == answers[1].status
    assert answers[0].half_peak_to_peak == pytest.approx(answers[1].half_peak_to_peak, rel=1e-9)


def test_numbers_of_a_patch_set_all_of_its_points(model: Path) -> None:
    assert main([*IMPORT, "--out", "scene.toml", "--patch", PATCH, "--force", "n5x=400"]) == 0
    scene = solver.load_scene(model / "scene.toml").with_values(
        {"face.N0": 320.0, "face.mu": 0.2, "face.kt": 1e9}
    )
    assert sum(contact.N0 for contact in scene.contacts) == pytest.approx(320.0)
    assert {contact.mu for contact in scene.contacts} == {0.2}
    sides = [
        Sensitivities(balance, ["face.N0"]).gradient(Workspace.of(balance).solve(OMEGA).u, OMEGA / TWO_PI)
        for balance in (build(scene.with_values({"face.N0": load}), harmonics=3) for load in (319.9, 320.1))
    ]
    slope = (sides[1].value - sides[0].value) / 0.2
    assert abs(slope) > 1e-4 * sides[0].value  # it slips
    assert np.mean([side.by_parameters[0] for side in sides]) == pytest.approx(slope, rel=1e-4)


def test_contacts_and_forces_of_the_command_stand_in_the_scene(model: Path) -> None:
    arguments = ["--dof", "a=1.UX", "--dof", "b=101.UX", "--dof", "c=9.UZ"]
    arguments += [
        "--contact",
        "pad=a:b,kt=1e6,mu=0.3,N0=100",
        "--contact",
        "stop=c:ground,law=gap,k=1e5,gap=1e-4",
    ]
    arguments += ["--force", "a=2", "--force", "c=-1.5", "--observe", "c"]
    assert main(["import", "M.mtx", "K.mtx", "--mapping", "rows.dof", "--out", "scene.toml", *arguments]) == 0
    scene = solver.load_scene(model / "scene.toml")
    assert [contact.name for contact in scene.contacts] == ["pad", "stop"]
    assert scene.excitation[0].parts == (("a", 2.0, 0.0), ("c", -1.5, 0.0))
    assert scene.observe.dof == "c"


@each(
    ("arguments", "words"),
    [
        (("--patch", "face=TOP:FOOT,kt=1,kn=1,mu=0.3"), "needs normal=x, -y or such as 0/1/0"),
        (("--patch", "face=TOP:FEET,normal=z,kt=1,kn=1,mu=0.3"), "no set 'FEET'; it has FOOT, TOP"),
        (("--patch", "face=TOP"), "takes NAME=A:B,KEY=VALUE"),
        (("--patch", "face=ground:TOP,normal=z"), "must be a set of nodes, got 'ground'"),
        (("--patch", "face=TOP:FOOT@next,normal=z,kt=1,kn=1,mu=0.3"), "next sector: give --sectors N"),
        (("--patch", "face=TOP:FOOT,normal=z,kt=-1,kn=1,mu=0.3"), "kt"),
        (("--patch", "face=TOP:FOOT,normal=z,kt=1,kt=2"), "names a key twice"),
        (("--contact", "pad=n1x"), "takes NAME=A:B,KEY=VALUE"),
        (("--contact", "pad=n1x:n2x,kt=1e6,mu=0.3"), "N0"),
        (("--force", "n5x"), "takes DOF=NEWTON"),
        (("--force", "n5x=1", "--force", "n5x=2"), "names 'n5x' twice"),
        (("--force", "n5x=1", "--excite", "n5x"), "exclude each other"),
    ],
)
def test_what_the_command_cannot_use_is_named_and_nothing_is_left(
    model: Path, capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], words: str
) -> None:
    before = sorted(path.name for path in model.iterdir())
    patch = () if "--patch" in arguments else ("--patch", PATCH)
    assert main([*IMPORT, "--out", "scene.toml", *patch, *arguments]) != 0
    assert words in " ".join(capsys.readouterr().err.split())
    assert sorted(path.name for path in model.iterdir()) == before
