"""A user's own matrices: what may be wrong with them, each with a message that says what to do."""

from pathlib import Path

import numpy as np
import pytest
from fe_files import abaqus_input, ansys_mapping, hbmat
from scipy.io import mmwrite
from scipy.sparse import coo_array

import optim
import solver
from service.cli import main

COUNT = 6
M = np.diag(np.linspace(0.01, 0.02, COUNT))
K = 1e6 * (2.0 * np.eye(COUNT) - np.eye(COUNT, k=1) - np.eye(COUNT, k=-1))
LABELS = [(node, 2) for node in range(11, 11 + COUNT)]
CONTACT = {"name": "damper", "between": ["middle", "ground"], "kt": 1e6, "mu": 0.3, "N0": 10.0}


def swapped_sign(row: int) -> np.ndarray:
    mass = M.copy()
    mass[row, row] *= -1.0
    return mass


def indefinite() -> np.ndarray:
    mass = M.copy()
    mass[2, 3] = mass[3, 2] = 0.05
    return mass


def market(name: str, A: np.ndarray, symmetry: str, first: int = 0) -> None:
    """A MatrixMarket file, from its `first` line on."""
    mmwrite(name, coo_array(A), symmetry=symmetry)
    lines = Path(name).read_text().splitlines(keepends=True)
    Path(name).write_text("".join(lines[first:]))


def imported(*words: str) -> int:
    return main(["import", *words, "--out", "own.toml"])


WRONG = {
    "K not symmetric": ((M, K + np.diag(np.full(COUNT - 1, 1e4), 1)), "leave out gyroscopic terms"),
    "lower triangle": ((np.tril(M), np.tril(K)), "lower triangle alone is there; fill the other one"),
    "upper triangle": ((M, np.triu(K)), "upper triangle alone is there; fill the other one"),
    "negative mass": ((swapped_sign(3), K), "are the files in the order M K C?"),
    "indefinite mass": ((indefinite(), K), "is a triangle missing, or the file not M?"),
    "sizes": ((M[1:, 1:], K), "M has 5 rows, K has 6 rows: export all of them from one analysis"),
    "the same twice": ((K, K), "are the same matrix: give the mass and the stiffness"),
    "no mass": ((np.diag([0.0, *np.diag(M)[1:]]), K), "reduce the model onto the DOFs in use"),
    "not finite": ((M, np.where(K[0, 0] == K, np.nan, K)), "must hold finite numbers, got nan in row 0"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_matrices_are_refused_with_what_to_do(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (mass, stiffness), words = WRONG[name]
    np.savez("own.npz", M=mass, K=stiffness)
    assert imported("own.npz", "--dof", "tip=5") == 2
    assert words in capsys.readouterr().err
    assert not Path("own.toml").exists()


@pytest.mark.parametrize(
    ("first", "symmetry", "words"),
    [
        (1, "general", "line 1 is a comment of MatrixMarket, whose first line must be `%%MatrixMarket"),
        (2, "general", "line 1 counts rows, columns and entries, as in MatrixMarket"),
        (2, "symmetric", "line 1 counts rows, columns and entries, as in MatrixMarket"),
    ],
)
def test_matrix_market_without_its_first_line_is_not_taken_for_abaqus(
    first: int, symmetry: str, words: str,
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    market("own-M.mtx", M, symmetry)
    market("own-K.mtx", K, symmetry)
    assert imported("own-M.mtx", "own-K.mtx", "--dof", "tip=5") == 0
    Path("own.toml").unlink()
    market("own-K.mtx", K, symmetry, first)
    assert imported("own-M.mtx", "own-K.mtx", "--dof", "tip=5") == 2
    assert words in capsys.readouterr().err


def test_files_under_a_wrong_name_or_alone_say_what_they_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("k.mtx").write_text(hbmat(K))
    Path("m.mtx").write_text(abaqus_input(M, LABELS))
    assert imported("m.mtx", "k.mtx", "--dof", "tip=16.UY") == 2
    assert "HBMAT of Ansys): let its name end in .matrix or .rsa" in capsys.readouterr().err
    assert imported("m.mtx", "--dof", "tip=16.UY") == 2
    assert "give the file of the other one too, in the order M K C" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("dof", "words"),
    [
        ("tip=99.UY", "there is no node 99 in use (nodes 11 to 16)"),
        ("tip=16.UX", "node 16 has the DOFs 16.UY"),
        ("tip=60", "must have a row from 0 to 5, got 60"),
    ],
)
def test_labels_that_are_not_there_are_told(
    dof: str, words: str,
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    for name, A in (("m", M), ("k", K)):
        Path(f"{name}.mtx").write_text(abaqus_input(A, LABELS))
    assert imported("m.mtx", "k.mtx", "--dof", dof) == 2
    assert words in capsys.readouterr().err


@pytest.mark.parametrize(
    ("mass", "stiffness", "words"),
    [
        (1e-3, 1e-3, "if that is in tonnes (a model in mm, t, N, s), its `units` are mm"),
        (1e-9, 1e6, "are M and K in units that go together?"),
        (1e9, 1e-9, "are M and K in units that go together?"),
        (1e10, 1e9, "is M in kg, and not the stiffness?"),
    ],
)
def test_units_that_cannot_be_meant_are_noted(
    mass: float, stiffness: float, words: str,
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    for name, A in (("m", mass * 1e-1 * M), ("k", stiffness * K)):
        Path(f"{name}.mtx").write_text(abaqus_input(A, LABELS))
    assert imported("m.mtx", "k.mtx", "--dof", "tip=16.UY") == 0
    said = " ".join(capsys.readouterr().out.split())
    assert words in said
    assert "frequencies and mass with those of your program; else see --units" in said


def test_the_same_model_from_two_programs_has_the_same_best_damper(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("k.matrix").write_text(hbmat(K))
    Path("m.matrix").write_text(hbmat(M))
    Path("k.mapping").write_text(ansys_mapping([(node, "UY") for node, _ in LABELS]))
    # The other model is in mm, t, N and s.
    Path("job_STIF1.mtx").write_text(abaqus_input(1e-3 * K, LABELS))
    Path("job_MASS1.mtx").write_text(abaqus_input(1e-3 * M, LABELS))
    found = []
    ansys, abaqus = ("k.matrix", "m.matrix", "k.mapping"), ("job_STIF1.mtx", "job_MASS1.mtx", "--units", "mm")
    for files in (ansys, abaqus):
        assert imported(*files, "--dof", "tip=16.UY", "--dof", "middle=13.UY") == 0
        raw = solver.load_scene("own.toml").to_dict()
        structure = {**raw["structure"], "damping_ratio": 1e-3}  # type: ignore[dict-item]
        scene = solver.Scene.from_dict({**raw, "structure": structure, "contacts": [CONTACT]})
        found.append(optim.design(scene, variables={"damper.N0": (0.1, 100.0)}, harmonics=3))
        Path("own.toml").unlink()
    assert found[0].reached
    assert found[1].optimum["damper.N0"] == pytest.approx(found[0].optimum["damper.N0"], rel=1e-5)
