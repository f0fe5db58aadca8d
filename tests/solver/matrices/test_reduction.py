"""Large models reduced: how good it is, free bodies, files of reduced models, checks of what is imported."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fe_files import abaqus_input, ansys_mapping, coordinate, dmig, hbmat, op4_text
from matrix_cases import beam
from scipy import linalg, sparse
from skfem import Basis, BilinearForm, ElementHex1, ElementVector, MeshHex
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

import solver
from service.cli import main
from solver.matrices.craig_bampton import Reduced, craig_bampton, write_reduced
from solver.matrices.load_set import read_matrix
from solver.matrices.normal_modes import undamped_modes
from solver.matrices.values import DofTable
from solver.scene.scene import load_scene

ROWS = 2 * 350  # above `interior.DENSE`: shift-invert


def free_beam(elements: int) -> tuple[np.ndarray, np.ndarray]:
    """A beam that nothing holds: the cantilever without the element at its clamp."""
    M, K = (A.copy() for A in beam(elements + 1))
    M[:2, :2] -= M[-2:, -2:]
    K[:2, :2] -= K[-2:, -2:]
    return M, K


def reduced(M: Any, K: Any, dofs: dict[str, int], modes: int | None, up_to: float | None = None) -> Reduced:
    pair = (sparse.coo_array(M), sparse.coo_array(K))
    return craig_bampton(*pair, None, DofTable(dofs), modes, up_to_hz=up_to)


@pytest.mark.parametrize(
    "dofs", [{"tip": 698}, {"tip": 698, "mid": 350}, {"root": 0, "slope": 1, "tip": 698}]
)
def test_the_error_of_each_frequency_is_estimated_from_above_and_closely(dofs: dict[str, int]) -> None:
    M, K = beam(350)
    found = reduced(M, K, dofs, 14)
    quality = found.quality
    exact = np.sqrt(undamped_modes(K, M).omega2[:17]) / (2 * np.pi)
    known = np.flatnonzero(np.isfinite(quality.system_error) & (quality.system_error > 1e-6))
    known = known[known < exact.size]
    true = quality.system_hz[known] / exact[known] - 1.0
    ratio = quality.system_error[known] / true
    assert known.size > 8
    assert ratio.min() > 0.98
    assert np.median(ratio) < 1.3
    good = quality.system_hz <= quality.good_to_hz
    assert np.abs(quality.system_hz[good] / exact[: good.sum()] - 1.0).max() <= 1.02e-3
    assert quality.good_to_hz > 0.3 * found.highest_hz
    assert quality.static_residual < 1e-8
    assert np.all((quality.mass_carried > 0.85) & (quality.mass_carried <= 1.0 + 1e-9))


def test_all_modes_carry_all_of_the_mass() -> None:
    """All of it in the end: of bricks, whose mass joins neighbours, with rows of their own."""
    mesh = MeshHex.init_tensor(np.linspace(0.0, 1.0, 24), np.linspace(0.0, 0.1, 3), np.linspace(0.0, 0.1, 3))
    basis = Basis(mesh, ElementVector(ElementHex1()), intorder=3)
    K = linear_elasticity(*lame_parameters(2.1e11, 0.3)).assemble(basis)
    M = BilinearForm(lambda u, v, _: 7850.0 * dot(u, v)).assemble(basis)
    held = np.flatnonzero(basis.doflocs[0] < 1e-9)
    free = np.setdiff1d(np.arange(M.shape[0]), held)
    K, M = (sparse.csr_array(A)[free][:, free] for A in (K, M))
    tip = np.flatnonzero(basis.doflocs[0, free] > 1.0 - 1e-9)
    dofs = {f"d{row}": int(row) for row in tip}
    for inner in (0, 40):
        # Rows of elements' own, with stiffness and a mass that some of their motions do without.
        rng = np.random.default_rng(inner)
        at = [tip[0] if i == 0 else i for i in range(inner)]
        joins = sparse.csr_array((rng.uniform(0.1, 1.0, inner), (range(inner), at)), (inner, free.size))
        mass = 1e-3 * M.diagonal().max()
        whole = sparse.block_array(
            [[M + mass * joins.T @ joins, mass * joins.T], [mass * joins, mass * sparse.eye_array(inner)]]
        )
        stiff = sparse.block_diag([K, K.diagonal().max() * sparse.eye_array(inner)])
        everything = reduced(whole, stiff, dofs, free.size + inner - len(dofs)).quality.mass_carried
        some = reduced(whole, stiff, dofs, 30).quality.mass_carried
        assert everything == pytest.approx(1.0, abs=1e-6)
        assert np.all((some > 0.1) & (some < 1.0))


def test_static_stiffness_is_exact() -> None:
    M, K = beam(350)
    found = reduced(M, K, {"tip": 698}, 0)
    assert 1.0 / found.matrices["K"][0, 0] == pytest.approx(np.linalg.inv(K)[698, 698], rel=1e-6)
    assert found.quality.good_to_hz == 0.0


def test_all_modes_up_to_a_frequency_are_kept() -> None:
    M, K = beam(350)
    held = np.delete(np.arange(ROWS), 698)
    omega2 = undamped_modes(K[np.ix_(held, held)], M[np.ix_(held, held)]).omega2
    exact = np.sqrt(omega2) / (2 * np.pi)
    found = reduced(M, K, {"tip": 698}, None, up_to=2500.0)
    assert found.modes == np.count_nonzero(exact <= 2500.0) > 16
    assert found.quality.held_hz == pytest.approx(exact[: found.modes], rel=1e-6)


@pytest.mark.parametrize("dofs", [{"tip": 698}, {"tip": 698, "root": 0}, {"tip": 698, "slope": 699}])
def test_free_bodies_keep_their_rigid_body_modes(dofs: dict[str, int]) -> None:
    """(βL)² of a free beam: 22.3733, 61.6728 (Blevins 1979, table 8-1)."""
    M, K = free_beam(350)
    found = reduced(M, K, dofs, 10)
    quality = found.quality
    assert quality.rigid_body_modes == 2
    length = 350.0 / 351.0
    wanted = np.array([22.3732854, 61.6728229]) / length**2 * np.sqrt(10.0) / (2 * np.pi)
    assert quality.system_hz[2:4] == pytest.approx(wanted, rel=1e-4)
    assert (quality.shift_hz > 0.0) == (len(dofs) == 1)


def test_a_rest_that_falls_apart_is_refused() -> None:
    M, K = (linalg.block_diag(*[A] * 5) for A in free_beam(60))
    with pytest.raises(ValueError, match=r"move freely in .* ways"):
        reduced(M, K, {"tip": 0, "slope": 1}, 12)


@pytest.mark.parametrize("suffix", [".npz", ".mat"])
def test_a_reduced_model_is_written_and_read_again(suffix: str, tmp_path: Path) -> None:
    M, K = beam(60)
    found = reduced(M, K, {"tip": 118, "mid": 60}, 6)
    path = tmp_path / f"reduced{suffix}"
    write_reduced(path, found, ["tip", "mid"])
    for key in ("M", "K"):
        assert np.array_equal(read_matrix(path, key).toarray(), found.matrices[key])
    with pytest.raises(ValueError, match=r"\.npz or \.mat"):
        write_reduced(tmp_path / "reduced.txt", found, ["tip", "mid"])


def command(arguments: str, capsys: pytest.CaptureFixture[str]) -> tuple[int, str, str]:
    status = main(arguments.split())
    captured = capsys.readouterr()
    return status, captured.out, captured.err


def labelled_files(folder: Path, elements: int) -> None:
    """A cantilever in the files of each program: nodes 1, 2, … from the root, UY and ROTZ."""
    M, K = beam(elements)
    pairs = [(node, dof) for node in range(1, elements + 1) for dof in (2, 6)]
    names = [(node, {2: "UY", 6: "ROTZ"}[dof]) for node, dof in pairs]
    for key, A in (("M", M), ("K", K)):
        word = {"M": "MASS", "K": "STIF"}[key]
        (folder / f"Job_{word}2.mtx").write_text(abaqus_input(A, pairs))
        (folder / f"{word.lower()}.matrix").write_text(hbmat(A))
        (folder / f"job.{'mas' if key == 'M' else 'sti'}").write_text(coordinate(A))
        (folder / f"{word.lower()}_mat.matrix").write_text(hbmat(A))
    (folder / "stif.mapping").write_text(ansys_mapping(names))
    (folder / "job.dof").write_text("".join(f"{node}.{dof}\n" for node, dof in pairs))
    (folder / "job.pch").write_text(dmig("KAAX", K, pairs) + dmig("MAAX", M, pairs))
    (folder / "job.op4").write_text(op4_text({"KAA": K, "MAA": M}, sparse=True, bigmat=True))


CALLS = {
    "abaqus": "Job_MASS2.mtx Job_STIF2.mtx", "abaqus swapped": "Job_STIF2.mtx Job_MASS2.mtx",
    "ansys": "mass.matrix stif.matrix",
    "words": "stif_mat.matrix mass_mat.matrix stif.mapping", "calculix": "job.sti job.mas", "dmig": "job.pch",
    "op4": "job.op4 job.dof", "op4 mapping": "job.op4 --mapping stif.mapping",
}  # fmt: skip


@pytest.mark.parametrize("case", CALLS)
def test_nodes_name_the_dofs_of_every_program(
    case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    labelled_files(tmp_path, 8)
    asked = f"import {CALLS[case]} --out s.toml --dof tip=8.UY --dof mid=4.2 --excite mid --json"
    status, out, err = command(asked, capsys)
    assert (status, err) == (0, "")
    assert json.loads(out)["frequencies_hz"][0] == pytest.approx(
        3.5160152685 * np.sqrt(10) / 2 / np.pi, rel=1e-4
    )
    scene = load_scene("s.toml")
    assert scene.structure.dofs.write() == {"tip": 14, "mid": 6}
    assert '"tip" = "8.UY"' in Path("s.toml").read_text()
    status, _, err = command(asked.replace("8.UY", "9.UY").replace("s.toml", "t.toml"), capsys)
    assert (status, "there is no node 9 in use (nodes 1 to 8)" in err) == (2, True)
    status, _, err = command(asked.replace("8.UY", "8.UX").replace("s.toml", "t.toml"), capsys)
    assert (status, "node 8 has the DOFs 8.UY, 8.ROTZ" in err) == (2, True)


def test_reduce_writes_a_model_that_answers_as_the_full_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    labelled_files(tmp_path, 60)
    files = "import job.sti job.mas --dof tip=60.UY --dof mid=30.UY --excite mid"
    assert command(f"{files} --out full.toml", capsys)[0] == 0
    assert command(f"{files} --out small.toml --reduce --modes 12 --units SI", capsys)[0] == 0
    status, out, _ = command(
        f"{files} --out again.toml --reduce --up-to 400 --reduced again.mat --json", capsys
    )
    facts = json.loads(out)["reduction"]
    assert status == 0
    assert facts["highest_hz"] <= 400.0 < 5.0 * facts["good_to_hz"]
    assert facts["mass_carried"]["tip"] > 0.8
    small, again, full = (load_scene(f"{name}.toml") for name in ("small", "again", "full"))
    assert (small.structure.M.size, again.structure.M.size) == (14, 2 + facts["modes"])
    wanted = solver.solve(full, frequency_hz=1.2).max_abs
    for scene in (small, again):
        assert solver.solve(scene, frequency_hz=1.2).max_abs == pytest.approx(wanted, rel=1e-5)
    assert "good to" in Path("small.toml").read_text()


def test_models_in_millimetres_become_si(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The same beam in mm, t, N, s: angles are not scaled as displacements are."""
    monkeypatch.chdir(tmp_path)
    M, K = beam(6)
    pairs = [(node, dof) for node in range(1, 7) for dof in (2, 6)]
    scale = np.array([1e-3**0.5, 1e3**0.5] * 6)
    for key, A in (("M", M), ("K", K)):
        (tmp_path / f"si-{key}.mtx").write_text(abaqus_input(A, pairs))
        (tmp_path / f"mm-{key}.mtx").write_text(abaqus_input(scale[:, None] * A * scale, pairs))
    for units, more in (("si", ""), ("mm", "--units mm")):
        asked = f"import {units}-M.mtx {units}-K.mtx --out {units}.toml --dof tip=6.UY {more}"
        assert command(asked, capsys)[0] == 0
    si, mm = (solver.solve(load_scene(f"{units}.toml"), frequency_hz=1.2) for units in ("si", "mm"))
    assert mm.max_abs == pytest.approx(si.max_abs, rel=1e-9)


def import_of(M: np.ndarray, K: np.ndarray, capsys: pytest.CaptureFixture[str], more: str = "") -> Any:
    pairs = [(node, dof) for node in range(1, len(M) // 2 + 1) for dof in (2, 6)]
    for name, A in (("M.mtx", M), ("K.mtx", K)):
        Path(name).write_text(abaqus_input(A, pairs, full=True))
    return command(f"import M.mtx K.mtx --out s.toml {more}", capsys)


def lopsided(K: np.ndarray) -> np.ndarray:
    changed = K.copy()
    changed[0, 2] += 1.0
    return changed


def without(A: np.ndarray, row: int) -> np.ndarray:
    changed = A.copy()
    changed[row] = changed[:, row] = 0.0
    return changed


REFUSED = {
    "asymmetric": (lambda M, K: (M, lopsided(K)), "", "row 0 (1.UY), column 2"),
    "negative mass": (lambda M, K: (-M, K), "", "on the diagonal of row 0 (1.UY), where a mass must be"),
    "negative stiffness": (lambda M, K: (M, -K), "", "a stiffness must be >= 0"),
    "massless": (lambda M, K: (without(M, 3), K), "", "but row 3 (2.ROTZ) is without mass"),
    "indefinite": (
        lambda M, K: (3.0 * np.diag(np.diag(M)) - 2.0 * M, K), "", "least eigenvalue",
    ),
    "reduce without a count": (lambda M, K: (M, K), "--reduce --dof tip=6.UY", "--modes N and --up-to HZ"),
    "modes without reduce": (lambda M, K: (M, K), "--modes 3", "go with --reduce"),
    "both ways": (lambda M, K: (M, K), "--reduce --modes 3 --keep-modes 3", "keep one of them"),
    "units": (lambda M, K: (M, K), "--units feet", "`--units` must be one of SI, mm, in"),
    "mapping": (lambda M, K: (M, K), "--mapping nowhere.dof", "no file 'nowhere.dof'"),
    "label": (lambda M, K: (M, K), "--dof tip=6.UZ", "node 6 has the DOFs 6.UY, 6.ROTZ"),
    "taken": (lambda M, K: (M, K), "--reduce --modes 3 --dof 6.UY --reduced M.npz", "exists already"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_no_structure_is_refused_with_what_to_do(
    case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("M.npz").write_text("mine")
    change, more, message = REFUSED[case]
    status, out, err = import_of(*change(*beam(6)), capsys, more)
    assert (status, out) == (2, "")
    assert message in " ".join(err.split())
    assert {path.name for path in tmp_path.iterdir()} == {"M.mtx", "K.mtx", "M.npz"}


def test_a_boundary_condition_by_penalty_is_told_where_rows_have_no_labels(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    M, K = beam(6)
    Path("M.mtx").write_text(coordinate(M))
    Path("K.mtx").write_text(coordinate(K + np.diag([1e36] + [0.0] * 11)))
    status, _, err = command("import M.mtx K.mtx --out s.toml", capsys)
    assert (status, "row 0 is held by a penalty: leave such DOFs out" in " ".join(err.split())) == (2, True)


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (slice(0, 10), "M has 12 rows, K has 10 rows: export all of them from one analysis"),
        (slice(0, 12), "row 4 is empty in M and K: these DOFs belong to no element"),
    ],
)
def test_rows_of_no_element_and_sizes_that_differ_are_refused(
    rows: slice, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    M, K = (without(A, 4) for A in beam(6))
    for name, A in (("M", M), ("K", K[rows, rows])):
        sparse.save_npz(f"{name}.npz", sparse.csr_array(A))
    status, _, err = command("import M.npz K.npz --out s.toml --dof tip=8", capsys)
    assert (status, message in " ".join(err.split())) == (2, True)


NOTES = {
    "free": (lambda: free_beam(6), "2 rigid-body modes: the body is not held"),
    "slow": (lambda: (beam(6)[0] * 1e6, beam(6)[1]), "are M and K in units that go together?"),
    "light": (lambda: (beam(6)[0] * 1e-9, beam(6)[1] * 1e-9), "its `units` are mm"),
    "unstable": (lambda: (beam(6)[0], beam(6)[1] - 200.0 * beam(6)[0]), "semidefinite: 1 negative"),
}  # fmt: skip


@pytest.mark.parametrize("case", NOTES)
def test_what_looks_wrong_is_said(
    case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    make, message = NOTES[case]
    status, out, _ = import_of(*make(), capsys, "--json")
    assert status == 0
    assert message in " ".join(json.loads(out)["notes"])
