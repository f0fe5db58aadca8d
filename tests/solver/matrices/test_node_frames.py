"""Nodes with frames of their own: decks of three programs against matrices written in the global frame."""

import json
import math
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from deck_frames import abaqus, ansys, nastran, turned
from each import each
from fe_files import coordinate, dmig
from scipy.linalg import eigh
from scipy.sparse import coo_array, csr_array
from sector_files import SECTORS, sector_files

import solver
from service.cli import main
from solver.errors import SceneError
from solver.matrices.decks.deck import GLOBAL, CoordinateKind, CoordinateSystem, Deck, frames
from solver.matrices.load_set import MatrixSet, in_global
from solver.matrices.readers.numbers_in_text import FormatError, Label
from solver.matrices.sectors.loading import boundaries, check_alone, read_deck
from solver.scene.scene import MatricesStructure

Array = np.ndarray
LOW, HIGH = [1, 2, 3], [7, 8, 9]
WRITERS = {"nastran": nastran, "ansys": ansys, "abaqus": abaqus}


@lru_cache(maxsize=1)
def ring() -> tuple[Array, Array, dict[int, Array]]:
    """M, K and the places of the nodes of the sector."""
    files = {name: data.decode() for name, data in sector_files().items()}
    found = []
    for name in ("ring.mas", "ring.sti"):
        A = np.zeros((27, 27))
        for line in files[name].splitlines():
            i, j, value = line.split()
            A[int(i) - 1, int(j) - 1] = A[int(j) - 1, int(i) - 1] = float(value)
        found.append(A)
    rows = [line.split(",") for line in files["ring.inp"].splitlines()[1:10]]
    return found[0], found[1], {int(r[0]): np.array(r[1:], float) for r in rows}


def frequencies(M: Array, K: Array, pairs: list[tuple[int, int, Array]], n: int) -> Array:
    """ω² at a nodal diameter: q_high = R q_low e^{jnα}, written out in full matrices."""
    turn = np.exp(2j * math.pi * n / SECTORS)
    P = np.eye(len(M), dtype=complex)
    for low, high, R in pairs:
        P[3 * high : 3 * high + 3] = 0.0
        P[3 * high : 3 * high + 3, 3 * low : 3 * low + 3] = R * turn
    P = P[:, [i for i in range(len(M)) if not any(3 * h <= i < 3 * h + 3 for _, h, _ in pairs)]]
    return np.asarray(eigh(P.conj().T @ K @ P, P.conj().T @ M @ P, eigvals_only=True))


def told(path: Path, M: Array, K: Array, axis: Array, labels: list[Label] | None = None) -> list[Array]:
    """ω² of every nodal diameter as the importer has them."""
    named = labels or [Label(node, c) for node in range(1, 10) for c in ("UX", "UY", "UZ")]
    raw = MatrixSet(matrices={"M": coo_array(M), "K": coo_array(K)}, labels=tuple(named))
    found = in_global(raw, read_deck(path))
    ends = boundaries({"low": LOW, "high": HIGH, "axis": list(axis)}, found, SECTORS, path.parent)
    gone = ends.elimination(len(M), SECTORS)
    parts = [gone.of(csr_array(found.matrices[key])) for key in "KM"]
    return [
        eigh(*(np.asarray(p.at(n, SECTORS).toarray()) for p in parts), eigvals_only=True)
        for n in range(SECTORS // 2 + 1)
    ]


@pytest.mark.parametrize("decks", [20, pytest.param(70, marks=pytest.mark.long)])
@pytest.mark.parametrize("program", list(WRITERS))
def test_random_decks_give_the_frequencies_of_matrices_in_the_global_frame(
    program: str, decks: int, tmp_path: Path
) -> None:
    M, K, at = ring()
    bare = 0
    for seed in range(decks):
        rng = np.random.default_rng([seed, len(program)])
        tilt = turned(rng.normal(size=3), rng.uniform(-3, 3))
        axis, own = tilt @ np.array([0.0, 0.0, 1.0]), np.kron(np.eye(9), tilt)
        path, axes = WRITERS[program](rng, {node: tilt @ place for node, place in at.items()}, tmp_path)
        T = np.zeros((27, 27))
        for node, R in axes.items():
            T[3 * node - 3 : 3 * node, 3 * node - 3 : 3 * node] = R
        Mg, Kg = (own @ A @ own.T for A in (M, K))
        R = turned(axis, 2 * math.pi / SECTORS)
        pairs = [(low - 1, high - 1, R) for low, high in zip(LOW, HIGH, strict=True)]
        ours = told(path, T.T @ Mg @ T, T.T @ Kg @ T, axis)
        for n, values in enumerate(ours):
            np.testing.assert_allclose(values, frequencies(Mg, Kg, pairs, n), rtol=2e-6, err_msg=f"{seed}")
        wrong = frequencies(T.T @ Mg @ T, T.T @ Kg @ T, pairs, 2)
        bare += bool(abs(wrong[0] / ours[2][0] - 1.0) < 1e-4)
    assert bare <= 0.3 * decks, "the frames must matter in most decks"


def held(
    axes: dict[int, Array], away: list[int], M: Array, K: Array
) -> tuple[Array, Array, list[Label], Array]:
    """Matrices in frames of the nodes, the rows `away` held; labels, and the columns of what moves."""
    T = np.zeros((27, 27))
    for node, R in axes.items():
        T[3 * node - 3 : 3 * node, 3 * node - 3 : 3 * node] = R
    kept = [i for i in range(27) if i not in away]
    labels = [Label(i // 3 + 1, ("UX", "UY", "UZ")[i % 3]) for i in kept]
    return (T.T @ M @ T)[np.ix_(kept, kept)], (T.T @ K @ T)[np.ix_(kept, kept)], labels, T[:, kept]


def cylinder(places: dict[int, Array]) -> dict[int, Array]:
    angles = {node: math.atan2(p[1], p[0]) for node, p in places.items()}
    return {node: turned(np.array([0.0, 0.0, 1.0]), a) for node, a in angles.items()}


def nastran_cylinder(path: Path, places: dict[int, Array]) -> Path:
    grids = [f"GRID,{n},,{p[0]:.12E},{p[1]:.12E},{p[2]:.12E},7" for n, p in places.items()]
    path.write_text("\n".join(["CORD2C,7,,0.,0.,0.,0.,0.,1.", ",1.,0.,0.", *grids]) + "\n")
    return path


@pytest.mark.parametrize("away", [[0, 18], [1, 19, 10], [2, 20], [0, 1, 18, 19]])
def test_boundaries_held_in_a_cylindrical_system_turn_with_the_sector(
    away: list[int], tmp_path: Path
) -> None:
    M, K, places = ring()
    axes = cylinder(places)
    Mh, Kh, labels, T = held(axes, away, M, K)
    ours = told(nastran_cylinder(tmp_path / "m.bdf", places), Mh, Kh, np.array([0.0, 0.0, 1.0]), labels)
    for n in range(SECTORS // 2 + 1):
        turn = np.exp(2j * math.pi * n / SECTORS)
        P = np.eye(T.shape[1], dtype=complex)
        high = [i for i, label in enumerate(labels) if label.node in HIGH]
        for i in high:  # in a cylinder about the axis a component of the next sector is that of this one
            P[i] = 0.0
            P[i, labels.index(Label(labels[i].node - 6, labels[i].component))] = turn
        P = P[:, [i for i in range(len(labels)) if i not in high]]
        np.testing.assert_allclose(
            ours[n], eigh(P.conj().T @ Kh @ P, P.conj().T @ Mh @ P, eigvals_only=True), rtol=1e-8
        )


def test_a_boundary_held_in_a_frame_that_does_not_turn_is_refused(tmp_path: Path) -> None:
    M, K, places = ring()
    path, axes = ansys(np.random.default_rng(8), places, tmp_path)
    Mh, Kh, labels, _ = held(axes, [0, 18], M, K)
    with pytest.raises(
        SceneError, match="node 1 of the boundaries or its partner 7 is held along an axis of its own"
    ):
        told(path, Mh, Kh, np.array([0.0, 0.0, 1.0]), labels)


def test_rows_of_calculix_stay_and_a_note_says_so(tmp_path: Path) -> None:
    M, K, places = ring()
    deck = read_deck(nastran_cylinder(tmp_path / "m.bdf", places))
    labels = tuple(Label(n, c) for n in places for c in ("UX", "UY", "UZ"))
    found = MatrixSet(matrices={"M": coo_array(M), "K": coo_array(K)}, labels=labels, global_rows=True)
    same = in_global(found, deck)
    assert np.array_equal(same.matrices["K"].toarray(), K)
    assert "CalculiX stores" in same.remarks[0]


def nastran_ring(folder: Path) -> tuple[Array, Array, Array, list[str]]:
    """M, K, and K as NASTRAN writes it, along a cylinder's axes; the import of its files."""
    M, K, places = ring()
    Ml, Kl, _, _ = held(cylinder(places), [], M, K)
    numbers = [(i // 3 + 1, i % 3 + 1) for i in range(27)]
    (folder / "m.pch").write_text(dmig("MAAX", Ml, numbers) + dmig("KAAX", Kl, numbers))
    deck = nastran_cylinder(folder / "m.bdf", places)
    return M, K, Kl, ["import", f"{folder}/m.pch", "--out", f"{folder}/o.toml", "--nodes", str(deck)]


def test_the_import_turns_rows_says_so_and_gives_a_damping(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    M, K, _, args = nastran_ring(tmp_path)
    args += ["--sectors", "6", "--low", "1,2,3", "--high", "7,8,9", "--dof", "tip=5.UX"]
    assert main([*args, "--reduce", "--modes", "8", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    R = turned(np.array([0.0, 0.0, 1.0]), 2 * math.pi / SECTORS)
    truth = frequencies(M, K, [(0, 6, R), (1, 7, R), (2, 8, R)], 2)
    two = next(row for row in said["reduction"]["diameters"] if row["diameter"] == 2)
    assert two["frequencies_hz"][0] == pytest.approx(math.sqrt(truth[0]) / (2 * math.pi), rel=1e-4)
    assert any("9 nodes move along axes of their own" in note for note in said["notes"])
    assert any("damping_ratio = 0.001" in note for note in said["notes"])
    assert "damping_ratio = 0.001" in (tmp_path / "o.toml").read_text()


@each(
    ("text", "said"),
    [
        ("GRID,1,,1.,0.,0.,9\n", "no coordinate system 9"),
        ("CORD1C,4,1,2,3\nGRID,1,4,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,3,,0.,1.,0.\n", "defined by itself"),
        ("GRID,1,,0.,0.,0.\nGRID,1,,1.,0.,0.\n", "GRID 1 is there already"),
        ("CORD2C,4,,0.,0.,0.,0.,0.,1.\n+,0.,0.,2.\nGRID,1,4,1.,0.,0.\n", "points lie on one line"),
        ("GRID,1,,0.,0.,0.\n=,*(1),=,*(1.)\n", "line 2 repeats an entry"),
        ("N,1,0,0,0\nNROTAT,ALL\n", "line 2: NROTAT makes or changes nodes"),
        ("CSYS,2\nN,1,1,20,30\n", "coordinate system 2, which is not read"),
        ("*NODE, SYSTEM=S\n1, 1., 20., 30.\n", "SYSTEM=S, which is not read"),
        ("*NODE\n1, 1., 0., 0.\n*NGEN\n1, 5\n", r"\*NGEN makes or moves nodes"),
        ("*NODE\n1,1.,0.,0.\n*TRANSFORM, NSET=X, TYPE=C\n0.,0.,0.,0.,0.,1.\n", "names the set 'X'"),
        ("*NODE\n1,1.,0.,0.\n*NSET, NSET=A, ELSET=B\n", "is that of elements"),
        (
            "*PART, NAME=P\n*NODE\n1,1.,0.,0.\n*END PART\n*ASSEMBLY, NAME=A\n*INSTANCE, NAME=I, PART=P\n"
            "*END INSTANCE\n*INSTANCE, NAME=J, PART=P\n1.,0.,0.\n*END INSTANCE\n*END ASSEMBLY\n",
            "is the second one",
        ),
        (
            "*PART, NAME=P\n*NODE\n1,1.,0.,0.\n*END PART\n*ASSEMBLY, NAME=A\n*INSTANCE, NAME=I, PART=P\n"
            "*END INSTANCE\n*NODE\n1, 0.,0.,9.\n*END ASSEMBLY\n",
            "of the assembly has the node 1",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_read_is_named(text: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "deck.txt"
    path.write_text(text)
    with pytest.raises(FormatError, match=said):
        read_deck(path)


def test_a_node_on_the_axis_of_its_cylinder_is_refused() -> None:
    cylinder_z = CoordinateSystem(CoordinateKind.CYLINDRICAL, GLOBAL.origin, GLOBAL.axes)
    deck = Deck(nodes={1: (0.0, 0.0, 3.0)}, systems={1: cylinder_z})
    with pytest.raises(ValueError, match="node 1 moves along the axes of a cylindrical system"):
        frames(deck, [1])


@pytest.mark.parametrize(
    "text",
    [
        "*NODE,\nINPUT=other.txt\n",
        "*INCLUDE,\n input=other.txt\n*NODE\n1,0,0,0\n",
        "INCLUDE 'a.bdf'\nGRID,1,,0.,0.,0.\n",
    ],
)
def test_a_stranger_may_not_include_files_in_any_way(text: str, tmp_path: Path) -> None:
    path = tmp_path / "deck.inp"
    path.write_text(text)
    with pytest.raises(FormatError, match="includes another file"):
        check_alone(path)


@pytest.mark.parametrize(
    ("empty", "reduce"), [("low", False), ("low", True), ("high", False), ("high", True)]
)
def test_masses_on_one_boundary_alone_count_for_both(
    empty: str, reduce: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    M, K, _ = ring()
    M = M.copy()
    rows = range(9) if empty == "low" else range(18, 27)
    M[rows, rows] = 0.0
    for name, data in sector_files().items():
        (tmp_path / name).write_bytes(data)
    (tmp_path / "ring.mas").write_text(coordinate(M))
    files = [str(tmp_path / name) for name in ("ring.mas", "ring.sti")]
    args = ["import", *files, "--out", str(tmp_path / "o.toml"), "--sectors", "6", "--low", "LOW",
            "--high", "HIGH", "--nodes", str(tmp_path / "ring.inp"), "--dof", "tip=2.UZ",
            "--dof", "hub=4.UX", "--json"]  # fmt: skip
    assert main([*args, *(["--reduce", "--modes", "8"] if reduce else [])]) == 0
    said = json.loads(capsys.readouterr().out)["frequencies_hz"][:3]
    R = turned(np.array([0.0, 0.0, 1.0]), 2 * math.pi / SECTORS)
    truth = frequencies(M, K, [(0, 6, R), (1, 7, R), (2, 8, R)], 1)
    assert said == pytest.approx(np.sqrt(truth[:3]) / (2 * math.pi), rel=1e-5 if reduce else 1e-9)


def test_rows_without_mass_on_both_boundaries_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    M, _, _ = ring()
    M = M.copy()
    node = [0, 1, 2, 18, 19, 20]
    M[node, node] = 0.0
    for name, data in sector_files().items():
        (tmp_path / name).write_bytes(data)
    (tmp_path / "ring.mas").write_text(coordinate(M))
    files = [str(tmp_path / name) for name in ("ring.mas", "ring.sti")]
    args = ["import", *files, "--out", str(tmp_path / "o.toml"), "--sectors", "6", "--low", "LOW",
            "--high", "HIGH", "--nodes", str(tmp_path / "ring.inp"), "--dof", "tip=4.UX"]  # fmt: skip
    assert main(args) == 2
    assert "row 0 (1.UX)" in capsys.readouterr().err


def test_a_structure_that_refers_to_files_is_turned_whenever_it_is_loaded(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _, K, Kl, args = nastran_ring(tmp_path)
    assert main([*args, "--dof", "x=8.UX", "--dof", "y=8.UY"]) == 0
    capsys.readouterr()
    structure = solver.load_scene(tmp_path / "o.toml").structure
    assert isinstance(structure, MatricesStructure)
    assert structure.K is not None
    rows = structure.dofs.rows
    np.testing.assert_allclose(structure.K.array[np.ix_(rows, rows)], K[21:23, 21:23], rtol=1e-8)
    assert abs(Kl[21, 21] / K[21, 21] - 1.0) > 1e-3
