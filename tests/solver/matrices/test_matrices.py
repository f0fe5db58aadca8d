"""Structures from matrices: files, inline values, refusals, and answers against other descriptions."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from each import each
from matrix_cases import beam, beam_scene, chain_raw, hb_text, inline, write_scene
from scipy import sparse
from scipy.io import mmread, mmwrite, savemat

import solver
from solver.errors import SceneError, SettingError
from solver.matrices.load_set import MatrixFileError, read_matrix, read_modes
from solver.matrices.readers.matrix_market import read_matrix_market
from solver.matrices.readers.numbers_in_text import FormatError
from solver.scene.scene import Scene, load_scene

A = np.array([[4.0, -1.5, 0.0], [-1.5, 3.0, 0.25], [0.0, 0.25, 2.0]])
# Laid out by hand after the guide: 5I14 in line 2; A3, 11X, 4I14 in line 3; 2A16, 2A20 in line 4.
RSA = (
    "Three masses by hand".ljust(72) + "BYHAND  \n"
    "             3             1             1             1             0\n"
    "RSA                        3             3             5             0\n"
    "(4I4)           (5I4)           (5D12.4)            \n"
    "   1   3   5   6\n"
    "   1   2   2   3   3\n"
    "  4.0000D+00 -1.5000D+00  3.0000D+00  0.2500D+00  2.0000D+00\n"
)


def writers() -> dict[str, Callable[[Path], object]]:
    def rows(path: Path, **arrays: Any) -> None:
        np.savez(path, **arrays)

    return {
        "dense.npz": lambda p: np.savez(p, A),
        "keyed.npz": lambda p: rows(p, M=np.eye(3), K=A),
        "csr.npz": lambda p: sparse.save_npz(p, sparse.csr_array(A)),
        "coo.npz": lambda p: sparse.save_npz(p, sparse.coo_array(A)),
        "old-coo.npz": lambda p: sparse.save_npz(p, sparse.coo_matrix(A)),
        "dia.npz": lambda p: sparse.save_npz(p, sparse.dia_array(A)),
        "bsr.npz": lambda p: sparse.save_npz(p, sparse.bsr_array(A)),
        "plain.npy": lambda p: np.save(p, A),
        "keyed.mat": lambda p: savemat(p, {"M": np.eye(3), "K": sparse.csc_array(A)}),
        "alone.mat": lambda p: savemat(p, {"stiffness": A}),
        "general.mtx": lambda p: mmwrite(p, sparse.coo_array(A), symmetry="general"),
        "symmetric.mtx": lambda p: mmwrite(p, sparse.coo_array(A), symmetry="symmetric"),
        "array.mtx": lambda p: mmwrite(p, A),
        "hand.rsa": lambda p: p.write_text(RSA),
        "made.rsa": lambda p: p.write_text(hb_text(A, "RSA")),
        "made.hb": lambda p: p.write_text(hb_text(A, "RUA")),
        "made.rb": lambda p: p.write_text(hb_text(A, "RSA", rutherford=True)),
        "rhs.rua": lambda p: p.write_text(hb_text(A, "RUA", right_hand_side=True)),
    }


@each("name", writers())
def test_every_format_gives_the_matrix(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    writers()[name](path)
    found = read_matrix(path, "K").toarray()
    assert np.array_equal(found, A)


def test_unsymmetric_harwell_boeing_keeps_both_triangles(tmp_path: Path) -> None:
    B = A + np.triu(np.ones((3, 3)), 1)
    (tmp_path / "b.rua").write_text(hb_text(B, "RUA"))
    assert np.array_equal(read_matrix(tmp_path / "b.rua", "K").toarray(), B)


@pytest.mark.parametrize(
    ("field", "value"),
    [("1.5E+1", 15.0), ("1.5D-3", 1.5e-3), ("1.5-3", 1.5e-3), ("1.5+02", 150.0), ("-.5", -0.5), ("7", 7e-4)],
)
def test_numbers_are_read_as_fortran_reads_them(field: str, value: float, tmp_path: Path) -> None:
    text = RSA.replace("  4.0000D+00", field.rjust(12))
    (tmp_path / "x.rsa").write_text(text)
    assert read_matrix(tmp_path / "x.rsa", "K").toarray()[0, 0] == value


def test_a_scale_factor_divides_numbers_without_an_exponent(tmp_path: Path) -> None:
    text = RSA.replace("(5D12.4)   ", "(1P,5F12.4)").replace("  4.0000D+00", "      4.0000")
    (tmp_path / "x.rsa").write_text(text)
    found = read_matrix(tmp_path / "x.rsa", "K").toarray()
    assert (found[0, 0], found[1, 1]) == (0.4, 3.0)


DAMAGED = {
    "no pointers": (RSA.replace("   1   3   5   6", "   1   3   x   6"), "line 5, column 9: '   x'"),
    "short value": (RSA.replace("  2.0000D+00", "  2.0000D"), "line 7, column 49: '  2.0000D'"),
    "cut off": (RSA.rsplit("\n", 2)[0] + "\n", "line 7 is missing"),
    "row out of range": (RSA.replace("   1   2   2   3   3", "   1   2   2   3   9"), "line 6: a row index"),
    "pointers fall": (RSA.replace("   1   3   5   6", "   1   5   3   6"), "line 5: pointers must rise"),
    "complex": (RSA.replace("RSA", "CSA"), "line 3: the type must be RSA"),
    "pattern": (RSA.replace("RSA", "PSA"), "pattern without values"),
    "elements": (RSA.replace("RSA", "RSE"), "unassembled elements"),
    "bad format": (RSA.replace("(4I4)", "(4X4)"), "line 4: '(4X4)'"),
    "bad count": (
        RSA.replace("RSA                        3", "RSA                        z"),
        "line 3, column 15",
    ),
    "one line": ("nothing", "line 2 is missing"),
    "too few lines": (RSA.replace("(5D12.4)", "(3D12.4)"), "line 2: 5 numbers of kind value, 3 a line"),
    "not text": ("", "not ASCII"),
}


@each("case", DAMAGED)
def test_a_damaged_harwell_boeing_file_names_its_line(case: str, tmp_path: Path) -> None:
    text, message = DAMAGED[case]
    path = tmp_path / "k.rsa"
    path.write_bytes(text.encode() or b"\xff\xfe")
    with pytest.raises(MatrixFileError) as caught:
        read_matrix(path, "K")
    assert message in str(caught.value)
    assert str(path) in str(caught.value)


def broken(tmp_path: Path) -> dict[str, tuple[Path, str]]:
    paths = {name: tmp_path / name for name in ("text.npz", "cut.npz", "keys.npz", "a.mtx", "p.mtx", "m.mat",
             "i.npy", "r.npy", "z.npy", "n.npy", "o.npy", "bad.npz", "no.npz", "x.txt")}  # fmt: skip
    paths["text.npz"].write_text("M = 1")
    np.savez(paths["cut.npz"], K=np.eye(40))
    paths["cut.npz"].write_bytes(paths["cut.npz"].read_bytes()[:900])
    np.savez(paths["keys.npz"], mass=np.eye(2), stiffness=np.eye(2))
    paths["a.mtx"].write_text("%%MatrixMarket matrix coordinate real general\n2 2 2\n1 1 1.0\n2 z 1.0\n")
    paths["p.mtx"].write_text("%%MatrixMarket matrix coordinate pattern symmetric\n2 2 1\n1 1\n")
    paths["m.mat"].write_bytes(b"MATLAB 7.3 MAT-file" + bytes(200))
    np.save(paths["i.npy"], np.array([["a"]]))
    np.save(paths["r.npy"], np.ones((2, 3)))
    np.save(paths["z.npy"], np.eye(2) * 1j)
    np.save(paths["n.npy"], np.diag([1.0, np.nan]))
    np.save(paths["o.npy"], np.array([{}]), allow_pickle=True)
    np.savez(paths["bad.npz"], format="csr", shape=[2, 2], data=[1.0], indices=[7], indptr=[0, 1, 1])
    messages = {
        "text.npz": "begins with b'M = ' at byte 0", "cut.npz": "damaged", "keys.npz": "named `K`",
        "a.mtx": "ine 4", "p.mtx": "line 1: a pattern", "m.mat": "-v7", "i.npy": "real numbers",
        "r.npy": "square matrix, got 2 x 3", "z.npy": "real numbers", "n.npy": "got nan in row 1, column 1",
        "o.npy": "damaged", "bad.npz": "damaged", "no.npz": "No such file", "x.txt": "must end in .npz",
    }  # fmt: skip
    return {name: (paths[name], message) for name, message in messages.items()}


def test_every_damaged_file_is_named(tmp_path: Path) -> None:
    for name, (path, message) in broken(tmp_path).items():
        with pytest.raises(MatrixFileError) as caught:
            read_matrix(path, "K")
        assert message in str(caught.value), name
        assert str(path) in str(caught.value)


def test_files_are_found_beside_the_scene_and_kept_by_content(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = load_scene(write_scene(tmp_path))
    monkeypatch.chdir("/")
    assert load_scene(tmp_path / "scene.toml") == scene
    again = Scene.from_dict(json.loads(json.dumps(scene.to_dict())))
    assert again == scene
    assert hash(again.structure) == hash(scene.structure)
    assert again.to_dict() == scene.to_dict()
    np.savez(tmp_path / "K.npz", K=2.0 * beam(4)[1])
    assert load_scene(tmp_path / "scene.toml") != scene


def test_a_request_never_opens_a_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_scene(tmp_path)
    monkeypatch.chdir(tmp_path)
    raw = inline(*beam(4), {"tip": 6, "mid": 2})
    for key in ("M", "K", "modes"):
        table = raw["structure"] | {key: f"{tmp_path}/K.npz"}
        with pytest.raises(SceneError) as caught:
            Scene.from_dict({**raw, "structure": table})
        pointers = {issue.pointer: issue.said() for issue in caught.value.issues}
        assert "inline" in pointers[f"/structure/{key}"]


def wrong() -> dict[str, tuple[dict[str, Any], str, str]]:
    M, K = beam(2)
    lopsided = K.copy()
    lopsided[0, 1] += 1.0
    return {
        "asymmetric": ({"K": lopsided.tolist()}, "/structure/K", "`K` must be symmetric"),
        "sizes": ({"K": K[:3, :3].tolist()}, "/structure", "`K` must have 4 rows"),
        "not a number": ({"K": [[float("nan")]]}, "/structure/K", "must be finite"),
        "text": ({"K": [["1"]]}, "/structure/K", "must hold numbers, got '1'"),
        "ragged": ({"K": [[1.0], [1.0, 2.0]]}, "/structure/K", "row 1 has 2 numbers"),
        "huge": ({"K": {"size": 10**9, "rows": [], "columns": [], "values": []}}, "/structure/K", "`size`"),
        "far entry": (
            {"K": {"size": 4, "rows": [4], "columns": [0], "values": [1]}}, "/structure/K", "from 0 to 3",
        ),
        "no mass": ({"M": np.diag([1.0, 1, 0, 1]).tolist()}, "/structure", "got 0 on the diagonal of row 2"),
        "indefinite": ({"M": (M - 0.2 * np.eye(4)).tolist()}, "/structure", "`M` must be positive definite"),
        "row": ({"dofs": {"tip": 4, "mid": 0}}, "/structure", "'tip' must have a row from 0 to 3, got 4"),
        "one row twice": ({"dofs": {"tip": 1, "mid": 1}}, "/structure/dofs", "row 1 is named twice"),
        "one name twice": ({"dofs": ["tip", "mid", "tip"]}, "/structure/dofs", "names 'tip' twice"),
        "name": ({"dofs": {"tip": 2, "m d": 1}}, "/structure/dofs", "letters, digits"),
        "ground": ({"dofs": {"tip": 2, "mid": 0, "ground": 1}}, "/structure/dofs/ground", "reserved"),
        "missing": ({"K": None}, "/structure", "`K` is missing"),
        "both": ({"modes": {"omega2": [1.0], "modes": [[1.0]] * 4}}, "/structure", "remove M, K"),
        "misspelt": ({"stifness": 1.0}, "/structure/stifness", "not a key of a matrices structure"),
        "springs": ({"springs": []}, "/structure/springs", "not a key of a matrices structure"),
        "keep_modes": ({"keep_modes": 3}, "/structure/keep_modes", "not a key"),
        "damping": ({"damping_ratio": -0.1}, "/structure/damping_ratio", ">= 0"),
    }  # fmt: skip


@each("case", wrong())
def test_each_mistake_names_key_and_value(case: str) -> None:
    change, pointer, message = wrong()[case]
    raw = inline(*beam(2), {"tip": 2, "mid": 0})
    with pytest.raises(SceneError) as caught:
        Scene.from_dict({**raw, "structure": raw["structure"] | change})
    found = {issue.pointer: issue.said() for issue in caught.value.issues}
    assert message in found[pointer]


def test_contacts_know_neither_the_next_sector_nor_an_engine_order() -> None:
    raw = inline(*beam(2), {"tip": 2, "mid": 0})
    raw["contacts"] = [{"name": "c", "between": ["tip", "mid@next"], "kt": 1.0, "mu": 0.1, "N0": 1.0}]
    raw["excitation"] |= {"engine_order": 1}
    with pytest.raises(SceneError) as caught:
        Scene.from_dict(raw)
    messages = " ".join(issue.said() for issue in caught.value.issues)
    assert "has no next sector" in messages
    assert "remove it from a matrices one" in messages


def test_only_the_damping_is_a_parameter_of_the_structure() -> None:
    scene = beam_scene(4)
    path = "structure.stiffness_proportional_damping"
    assert scene.with_values({path: 2e-4}).value(path) == 2e-4
    with pytest.raises(SettingError, match="must be a number >= 0"):
        scene.with_values({path: -1.0})
    with pytest.raises(SettingError, match=r"structure\.k1"):
        scene.with_values({"structure.k1": 1.0})
    with pytest.raises(SettingError, match="cyclic"):
        solver.annulus(scene)


@pytest.mark.parametrize("dofs", [["a", "b", "c"], {"c": 2, "a": 0, "b": 1}])
def test_a_lumped_scene_written_as_matrices_answers_the_same(dofs: Any) -> None:
    lumped = chain_raw()
    M, K = np.diag([1.0, 0.7, 0.4]), np.array([[300.0, -120, 0], [-120, 220, -100.0], [0, -100, 100]])
    beta = lumped["structure"]["stiffness_proportional_damping"]
    structure = {"kind": "matrices", "M": M.tolist(), "K": K.tolist(), "dofs": dofs,
                 "stiffness_proportional_damping": beta}  # fmt: skip
    full = structure | {"C": (beta * K).tolist(), "stiffness_proportional_damping": 0.0}
    expected = solver.solve(Scene.from_dict(lumped), frequency_hz=1.3)
    assert expected.converged
    for table in (structure, full):
        scene = Scene.from_dict({**lumped, "structure": table})
        found = solver.solve(scene, frequency_hz=1.3)
        scale = np.abs(expected.observed).max()
        assert np.abs(found.observed - expected.observed).max() < 1e-12 * scale
        order = [scene.structure.dofs.index(dof) for dof in ("a", "b", "c")]
        assert np.abs(solver.motion(found)[order] - solver.motion(expected)).max() < 1e-11 * scale
        taken, wanted = solver.power_balance(found), solver.power_balance(expected)
        assert taken.viscous_w == pytest.approx(wanted.viscous_w, rel=1e-9)


def test_modes_answer_as_their_matrices_do(tmp_path: Path) -> None:
    M, K = beam(6)
    from scipy.linalg import eigh

    omega2, phi = eigh(K, M)
    np.savez(
        tmp_path / "modes.npz", frequencies_hz=np.sqrt(omega2) / (2 * np.pi), modes=phi, damping_ratio=0.01
    )
    tables = {"tip": 10, "mid": 4}
    by_matrices = inline(M, K, tables)
    by_matrices["structure"]["damping_ratio"] = 0.01
    path = tmp_path / "modal.json"
    path.write_text(
        json.dumps({**by_matrices, "structure": {"kind": "matrices", "modes": "modes.npz", "dofs": tables}})
    )
    modal, full = load_scene(path), Scene.from_dict(by_matrices)
    assert modal.structure.modes.modes.shape == (2, 12)  # only the rows in use are kept
    assert Scene.from_dict(modal.to_dict()) == modal
    found, expected = (solver.solve(s, frequency_hz=3.0) for s in (modal, full))
    assert found.max_abs == pytest.approx(expected.max_abs, rel=1e-9)
    np.savez(tmp_path / "bad.npz", modes=phi)
    with pytest.raises(MatrixFileError, match="`modes` and one of"):
        read_modes(tmp_path / "bad.npz")


@each("symmetry", ["general", "symmetric", "skew-symmetric", "hermitian"])
@each("dense", [True, False])
def test_matrix_market_is_read_as_scipy_reads_it(symmetry: str, dense: bool, tmp_path: Path) -> None:
    matrix = np.random.default_rng(1).standard_normal((5, 5)) * (
        1.0 if symmetry != "hermitian" else 1.0 + 0.5j
    )
    matrix[0, 3] = 0.0
    matrix = {"general": matrix, "symmetric": matrix + matrix.T, "skew-symmetric": matrix - matrix.T,
              "hermitian": matrix + matrix.conj().T}[symmetry]  # fmt: skip
    path = tmp_path / "A.mtx"
    mmwrite(path, matrix if dense else sparse.coo_array(matrix), comment="a\nb", symmetry=symmetry)
    assert symmetry in path.read_text()
    expected = mmread(path, spmatrix=False)
    found = read_matrix_market(path).toarray()
    assert np.array_equal(found, expected if dense else expected.toarray())


@each(
    ("text", "message"),
    [
        ("", "line 1 must be '%%MatrixMarket matrix"),
        ("%%MatrixMarket matrix coordinate real\n", "line 1 must be"),
        ("%%MatrixMarket matrix coordinate real round\n1 1 1\n1 1 1\n", "line 1 must name"),
        ("%%MatrixMarket matrix array real general\n% a\n\n", "line 4 is missing"),
        ("%%MatrixMarket matrix array real general\n% a\n2 x\n", "line 3 must hold the numbers"),
        ("%%MatrixMarket matrix array real general\n1000000 1000000\n1\n", "ends after 1 numbers"),
        ("%%MatrixMarket matrix array real symmetric\n2 3\n1\n", "line 2: a symmetric matrix is square"),
        ("%%MatrixMarket matrix coordinate real general\n2 2 1\n% c\n1 3 1.0\n", "line 4: a row or column"),
        ("%%MatrixMarket matrix coordinate real general\n2 2 1\n1.5 1 1.0\n", "line 3: a row or column"),
        ("%%MatrixMarket matrix coordinate real general\n2 2 1\n1 1 1.0\n1 1 1.0\n", "sizes says 3"),
    ],
)  # fmt: skip
def test_a_damaged_matrix_market_file_names_its_line(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "A.mtx"
    path.write_text(text)
    with pytest.raises(FormatError) as caught:
        read_matrix_market(path)
    assert message in str(caught.value)
