"""Large linear parts: sums over modes to rounding, decompositions kept, reduction, import, marching."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matrix_cases import beam, beam_scene, chain_raw, inline
from scipy import sparse

import solver
from service.cli import main
from solver.balance.balance import build
from solver.balance.workspace import Workspace
from solver.contacts.kernels.system import DENSE, MODES, POLES
from solver.errors import SceneError, SettingError
from solver.linear.modal import decompose
from solver.matrices.normal_modes import undamped_modes
from solver.matrices.readers.harwell_boeing import read_harwell_boeing
from solver.scene.scene import Scene, load_scene


def with_contacts(n: int, structure: dict[str, Any], seed: int = 3) -> Scene:
    """A random structure of n DOFs with three contacts."""
    rng = np.random.default_rng(seed)
    R = rng.normal(size=(n, n)) / np.sqrt(n)
    K, M = 400.0 * (R @ R.T + 0.3 * np.eye(n)), np.eye(n) + 0.1 * (R + R.T)
    raw = inline(M, K, {"p": 0, "q": n - 1, "r": n // 2})
    raw["structure"] |= structure
    if structure.get("C") == "local":
        raw["structure"]["C"] = {"size": n, "rows": [1, 2], "columns": [1, 2], "values": [0.8, 0.4]}
    joined = [("p", "ground"), ("p", "q"), ("q", "r")]
    raw["contacts"] = [
        {"name": f"c{i}", "between": ends, "kt": 20.0, "mu": 0.3, "N0": 2.0} for i, ends in enumerate(joined)
    ]
    raw["excitation"] = [{"dof": "p", "amplitude": 3.0}, {"dof": "r", "amplitude": 1.0, "harmonic": 3}]
    return Scene.from_dict(raw)


@pytest.mark.parametrize(
    ("n", "structure", "form"),
    [
        (7, {"stiffness_proportional_damping": 1e-3}, MODES),
        (60, {"damping_ratio": 0.01, "mass_proportional_damping": 0.2}, MODES),
        (300, {"stiffness_proportional_damping": 1e-3, "mass_proportional_damping": 0.1}, MODES),
        (40, {"stiffness_proportional_damping": 1e-3, "C": "local"}, POLES),
    ],
)
def test_the_sum_over_modes_is_the_inverse_to_rounding(n: int, structure: dict[str, Any], form: int) -> None:
    from solver.linear.assembly import linear_model

    scene = with_contacts(n, structure)
    workspace = Workspace.of(build(scene, harmonics=5))
    assert workspace.balance.system.form == form
    model, omega, step = linear_model(scene), 23.0, 1e-5
    found = [np.array(a) for a in workspace.receptance(omega)]

    def direct(k: int, w: float) -> np.ndarray:
        return np.linalg.inv(model.K0 + 1j * k * w * model.C0 - (k * w) ** 2 * model.M)

    for i, k in enumerate(workspace.balance.system.ks):
        Z, L = direct(int(k), omega), model.contact_here
        force = sum(f.amplitude * f.vector for f in model.forces if f.harmonic == k) + np.zeros(n)
        slope = (direct(int(k), omega + step) - direct(int(k), omega - step)) / (2.0 * step)
        exact = (L @ Z @ L.T, L @ Z @ force, model.observe @ Z @ L.T, model.observe @ Z @ force)
        tolerance = 1e-13 if form == MODES else 1e-11
        for value, wanted in zip(found, exact, strict=True):
            assert np.abs(value[0, i] - wanted).max() <= tolerance * np.abs(Z).max() * 50
        assert found[0][1, i] == pytest.approx(L @ slope @ L.T, rel=1e-6, abs=1e-7 * np.abs(slope).max())


def test_low_frequencies_are_accurate_however_fine_the_mesh() -> None:
    """The cantilever's first (βL)² = 3.5160152685 (Blevins 1979, table 8-1); mesh error 1e-9 from 50 on."""
    for elements in (50, 250):
        found = undamped_modes(*reversed(beam(elements)))
        assert np.sqrt(found.omega2[0] / 10.0) == pytest.approx(1.8751040687119611**2, rel=2e-7)
    M, K = beam(40)
    free = K.copy()
    free[:2, :2] -= K[-2:, -2:]  # the element at the clamp taken off
    found = undamped_modes(free, M)
    assert found.sigma > 0.0
    assert np.abs(found.omega2[:2]).max() < 1e-5 * found.omega2[2]


def test_a_structure_is_decomposed_once_whatever_its_contacts_are() -> None:
    scene = beam_scene(30)
    build(scene)
    before = decompose.cache_info()
    for value in (1.0, 2.0, 3.0):
        build(scene.with_values({"c.N0": value, "c.kt": 10.0 * value, "excitation.amplitude": value}))
    solver.solve(scene, frequency_hz=2.0)
    after = decompose.cache_info()
    assert after.misses == before.misses
    assert after.hits >= before.hits + 4
    build(scene.with_values({"structure.mass_proportional_damping": 0.3}))
    assert decompose.cache_info().misses == before.misses + 1


def test_a_fine_mesh_with_proportional_damping_keeps_its_modes() -> None:
    """Rounding spoils the orthogonality of 500 modes, not their use: the response is a coarser mesh's."""
    fine, coarse = beam_scene(250), beam_scene(50)
    assert build(fine).system.form == MODES
    found, expected = (solver.solve(scene, frequency_hz=1.1) for scene in (fine, coarse))
    assert found.converged
    assert found.max_abs == pytest.approx(expected.max_abs, rel=1e-4)


def test_modes_that_nothing_sees_are_left_out() -> None:
    """Two beams that nothing joins: the one without contacts, forces and observer has no share."""
    (M, K), zero = beam(3), np.zeros((6, 6))
    raw = inline(
        np.block([[M, zero], [zero, M]]), np.block([[K, zero], [zero, 3.7 * K]]), {"tip": 4, "mid": 0}
    )
    raw["structure"]["stiffness_proportional_damping"] = 1e-3
    assert build(Scene.from_dict(raw)).system.eigenvalues.shape[1] == 6


def test_the_damping_can_be_continued_in() -> None:
    path = "structure.stiffness_proportional_damping"
    scene = beam_scene(3)
    workspace = Workspace.of(build(scene, path, frequency_hz=1.2, harmonics=5))
    assert workspace.balance.system.form == DENSE
    moved = Workspace.of(build(scene.with_values({path: 1.5e-3}), harmonics=5))
    here, there = workspace.receptance(1.5e-3).A, moved.receptance(2.0 * np.pi * 1.2).A
    assert np.abs(here[0] - there[0]).max() < 1e-10 * np.abs(there[0]).max()


def test_marching_with_a_full_mass_matrix_is_the_balance() -> None:
    """The chain in mixed coordinates, so that no matrix is diagonal but the contacts are the same."""
    raw = chain_raw()
    M, K = np.diag([1.0, 0.7, 0.4]), np.array([[300.0, -120, 0], [-120, 220, -100.0], [0, -100, 100]])
    T = np.array([[1.0, 0, 0], [0.3, 1, 0.4], [0, 0, 1.0]])  # b is a mixture, a and c stay
    structure = {"kind": "matrices", "M": (T.T @ M @ T).tolist(), "K": (T.T @ K @ T).tolist(),
                 "dofs": ["a", "x", "c"], "stiffness_proportional_damping": 8e-3}  # fmt: skip
    raw["structure"]["stiffness_proportional_damping"] = 8e-3
    raw["excitation"]["dof"] = "a"
    lumped = Scene.from_dict(raw)
    mixed = Scene.from_dict({**raw, "structure": structure})
    expected = solver.march(lumped, frequency_hz=1.3, tolerance=1e-9)
    found = solver.march(mixed, frequency_hz=1.3, tolerance=1e-9)
    assert found.converged
    assert found.max_abs == pytest.approx(expected.max_abs, rel=1e-6)
    assert solver.solve(mixed, frequency_hz=1.3, harmonics=41).max_abs == pytest.approx(
        found.max_abs, rel=2e-3
    )
    modal = undamped_modes(T.T @ K @ T, T.T @ M @ T)
    table = {"omega2": modal.omega2.tolist(), "modes": modal.phi.tolist()}
    by_modes = {k: v for k, v in structure.items() if k not in "MK"} | {"modes": table}
    again = solver.march(Scene.from_dict({**raw, "structure": by_modes}), frequency_hz=1.3, tolerance=1e-9)
    assert again.max_abs == pytest.approx(expected.max_abs, rel=1e-6)
    few = {"omega2": table["omega2"][:1], "modes": modal.phi[:, :1].tolist()}
    with pytest.raises(SettingError, match="tell its DOFs in use apart"):
        solver.march(Scene.from_dict({**raw, "structure": by_modes | {"modes": few}}), frequency_hz=1.3)


def plate_files(folder: Path, elements: int) -> tuple[np.ndarray, np.ndarray]:
    M, K = beam(elements)
    sparse.save_npz(folder / "M.npz", sparse.csr_array(M))
    sparse.save_npz(folder / "K.npz", sparse.csr_array(K))
    return M, K


def reduced_scene(folder: Path, elements: int, **structure: Any) -> Path:
    raw = inline(np.eye(1), np.eye(1), {"tip": 2 * elements - 2, "mid": elements - 2})
    raw["structure"] |= {"M": "M.npz", "K": "K.npz", "stiffness_proportional_damping": 1e-3, **structure}
    path = folder / "scene.json"
    path.write_text(json.dumps(raw))
    return path


def test_a_reduced_model_keeps_the_low_frequencies(tmp_path: Path) -> None:
    M, K = plate_files(tmp_path, 60)
    scene = load_scene(reduced_scene(tmp_path, 60, keep_modes=10))
    assert scene.structure.M.size == 12
    assert scene.structure.reduction.dofs == 120
    assert Scene.from_dict(scene.to_dict()) == scene
    low = undamped_modes(scene.structure.K.array, scene.structure.M.array).omega2
    assert low[:4] == pytest.approx(undamped_modes(K, M).omega2[:4], rel=5e-4)
    told = {effect.name: effect.reason for effect in solver.plan(scene).effects}
    assert "120 DOFs were reduced to the 2 in use and 10 modes" in told["reduction of the model"]
    assert "the 12 linear DOFs are eliminated" in told["condensation"]
    assert "given by its matrices" in told["one sector for the annulus"]
    full = load_scene(reduced_scene(tmp_path, 60))
    found, expected = (solver.solve(s, frequency_hz=1.0) for s in (scene, full))
    assert found.max_abs == pytest.approx(expected.max_abs, rel=1e-5)
    everything = load_scene(reduced_scene(tmp_path, 60, keep_modes=118))
    assert solver.solve(everything, frequency_hz=1.0).max_abs == pytest.approx(expected.max_abs, rel=1e-8)


def test_a_model_too_large_says_what_to_do_and_is_reduced_when_asked(tmp_path: Path) -> None:
    size = 2500
    chain = sparse.diags_array(
        [-np.ones(size - 1), np.full(size, 2.0), -np.ones(size - 1)], offsets=[-1, 0, 1]
    )
    sparse.save_npz(tmp_path / "M.npz", sparse.csr_array(sparse.eye_array(size)))
    sparse.save_npz(tmp_path / "K.npz", sparse.csr_array(1e6 * chain))
    with pytest.raises(SceneError, match=r"2500 rows.*keep_modes"):
        load_scene(reduced_scene(tmp_path, 40))
    scene = load_scene(reduced_scene(tmp_path, 40, keep_modes=12))
    assert (scene.structure.M.size, scene.structure.reduction.modes) == (14, 12)
    with pytest.raises(SceneError, match="whole number from 0"):
        load_scene(reduced_scene(tmp_path, 40, keep_modes=-1))
    with pytest.raises(SceneError, match="row from 0 to 2499"):
        load_scene(reduced_scene(tmp_path, 40, keep_modes=3, dofs={"tip": 2500, "mid": 0}))
    sparse.save_npz(tmp_path / "K.npz", sparse.csr_array(sparse.block_diag([1e6 * chain.tocsr()[:2000, :2000],
                    sparse.csr_array((500, 500))])))  # fmt: skip
    with pytest.raises(SceneError, match="move freely"):
        load_scene(reduced_scene(tmp_path, 40, keep_modes=3))


def command(arguments: str, capsys: pytest.CaptureFixture[str]) -> tuple[int, str, str]:
    status = main(arguments.split())
    captured = capsys.readouterr()
    return status, captured.out, captured.err


def test_import_writes_a_scene_that_plan_and_solve_take(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    plate_files(tmp_path, 20)
    (tmp_path / "scenes").mkdir()
    asked = "import K.npz M.npz --out scenes/beam.toml --dof tip=38 --dof mid=18 --excite mid --json"
    status, out, err = command(asked, capsys)
    assert (status, err) == (0, "")
    assert json.loads(out)["frequencies_hz"][0] == pytest.approx(
        3.5160152685 * np.sqrt(10) / 2 / np.pi, rel=1e-5
    )
    scene = load_scene("scenes/beam.toml")
    assert scene.structure.M.size == 40
    text = (tmp_path / "scenes/beam.toml").read_text()
    (tmp_path / "scenes/beam.toml").write_text(text.replace("# [[", "[[").replace("\n# ", "\n"))
    with pytest.raises(SceneError):
        load_scene("scenes/beam.toml")
    ready = text.replace("# [[", "[[")
    for key in ("name", "between", "kt", "mu", "N0"):
        ready = ready.replace(f"\n# {key} =", f"\n{key} =")
    ready = ready.replace("# stiffness_proportional_damping", "stiffness_proportional_damping")
    (tmp_path / "scenes/beam.toml").write_text(ready)
    assert command("plan scenes/beam.toml", capsys)[0] == 0
    assert command("solve scenes/beam.toml --frequency 1.5", capsys)[0] == 0


REFUSED = {
    "import nowhere.npz --out a.toml": "no file 'nowhere.npz'",
    "import M.npz K.npz --out a.txt --dof a=1": "`--out` must end in .toml",
    "import M.npz K.npz --out old.toml --dof a=1": "exists already",
    "import M.npz K.npz --out a.toml --dof a": "`--dof` takes NAME=ROW",
    "import M.npz K.npz --out a.toml --dof a=1 --dof a=2": "names 'a' twice",
    "import M.npz K.npz --out a.toml --dof a=99": "'a' must have a row from 0 to 39",
    "import M.npz K.npz --out a.toml --dof a=1 --observe b": "there is no DOF 'b'",
    "import M.npz K.npz --out a.toml --dof a=1 --from 9 --to 3": "0 < from < to",
    "import K.npz --out a.toml": "must hold M and K, or modes",
    "import bad.mtx K.npz --out a.toml --dof a=1": "bad.mtx",
    "import M.npz K.npz K.npz K.npz --out a.toml": "got 4 files",
}


@pytest.mark.parametrize("asked", REFUSED)
def test_bad_imports_leave_nothing_behind(
    asked: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    plate_files(tmp_path, 20)
    (tmp_path / "old.toml").write_text("mine")
    (tmp_path / "bad.mtx").write_text("%%MatrixMarket matrix coordinate real general\n1 1")
    before = sorted(tmp_path.iterdir())
    status, out, err = command(asked, capsys)
    assert (status, out) == (2, "")
    assert REFUSED[asked] in err
    assert sorted(tmp_path.iterdir()) == before
    assert (tmp_path / "old.toml").read_text() == "mine"


def test_scipy_refuses_what_our_reader_reads(tmp_path: Path) -> None:
    """The reason for a reader of our own: symmetric Harwell-Boeing files."""
    from matrix_cases import hb_text
    from scipy.io import hb_read

    path = tmp_path / "k.rsa"
    path.write_text(hb_text(beam(3)[1], "RSA"))
    with pytest.raises((ValueError, NotImplementedError)):
        hb_read(path, spmatrix=False)
    assert np.array_equal(read_harwell_boeing(path).toarray(), beam(3)[1])
