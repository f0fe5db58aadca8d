"""A structure in few motions for its contacts: against all motions, and what the command says of it."""

import contextlib
import importlib.util
import io
import itertools
import json
import runpy
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import solver
from service.cli import main
from solver.errors import SettingError
from solver.linear.assembly import linear_model
from solver.scene.scene import Scene
from solver.studies.contact_reduction import peak_error, reduce_for_contacts

FACE = Path(__file__).resolve().parents[3] / "docs" / "fe" / "face.py"
BRICKS = (2, 1, 4, 2)  # along shank, platform, airfoil and chord: six nodes on the face
PATCH = "plat=FACE:ground,normal=y,kt=2e7,kn=4e7,mu=0.3,N0=60"


@dataclass(frozen=True)
class Blade:
    folder: Path
    full: Scene  # in all motions
    small: Scene  # as the command makes it
    said: dict[str, Any]


@pytest.fixture(scope="module")
def blade(tmp_path_factory: pytest.TempPathFactory) -> Blade:
    if importlib.util.find_spec("skfem") is None:
        pytest.skip("scikit-fem, which makes the matrices, is not installed")
    folder = tmp_path_factory.mktemp("face")
    _, nodes, _ = runpy.run_path(str(FACE))["write"](folder, BRICKS)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        command = ["import", "face-M.npz", "face-K.npz", "face.dof", "--nodes", "face.inp", "--patch", PATCH]
        command += ["--dof", f"tip={nodes}.UY", "--force", "tip=1"]
        assert main([*command, "--out", "full.toml", "--reduce", "--modes", "40"]) == 0
        said = as_json([*command, "--out", "small.toml", "--json"])
    full, small = (solver.load_scene(folder / f"{name}.toml") for name in ("full", "small"))
    return Blade(folder, full, small, said)


def as_json(command: list[str]) -> dict[str, Any]:
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        assert main(command) == 0
    return json.loads(out.getvalue())


def test_the_scene_has_few_motions_and_every_node_of_the_face(blade: Blade) -> None:
    motions = blade.said["reduction"]["motions"]
    modes = blade.small.structure.modes
    assert modes is not None
    assert modes.omega2.size == motions["count"] <= 20 < len(blade.full.structure.dofs) + 40
    assert blade.small.structure.dofs == blade.full.structure.dofs
    assert len(blade.small.contacts) == 6
    assert motions["error"] <= 2e-3
    assert all(0.5 < share < 1.0 for share in motions["mass_carried"].values())
    assert "modes = " in (blade.folder / "small.toml").read_text()


@pytest.mark.parametrize("load", [0.0, 60.0, 2000.0])
def test_responses_are_those_in_all_motions(blade: Blade, load: float) -> None:
    """Free, in partial slip, and stuck; with more harmonics than the error was told with."""
    full, small = (
        solver.sweep(each.with_values({"plat.N0": load}), harmonics=3) for each in (blade.full, blade.small)
    )
    assert full.reached
    assert small.reached
    assert small.peak.value == pytest.approx(full.peak.value, rel=2e-3)
    assert small.peak.at == pytest.approx(full.peak.at, rel=1e-4)


@pytest.mark.parametrize("load", [60.0, 2000.0])
@pytest.mark.parametrize("count", [6, 20])
def test_the_error_told_is_that_of_the_peak(blade: Blade, load: float, count: int) -> None:
    scene = blade.full.with_values({"plat.N0": load})
    found = reduce_for_contacts(scene, count)
    few, every = (solver.sweep(each, harmonics=1).peak.value for each in (found.scene, scene))
    assert found.error is not None
    told, true = found.error, abs(few / every - 1.0)
    if load == 60.0:  # it slips: no other force is tried
        assert told == pytest.approx(true, rel=1e-2, abs=2e-7)
    else:  # it sticks: the error where it slips counts too
        assert told >= true * 0.99


def test_motions_are_orthonormal_and_diagonal_in_both_matrices(blade: Blade) -> None:
    found, model = reduce_for_contacts(blade.full, 12), linear_model(blade.full)
    phi = found.motions
    np.testing.assert_allclose(phi.T @ model.M @ phi, np.eye(phi.shape[1]), atol=1e-9)
    kept = phi.T @ model.K0 @ phi
    np.testing.assert_allclose(kept, np.diag(found.modes.omega2), atol=1e-9 * np.abs(kept).max())


def test_what_contacts_alone_hold_keeps_its_motion_as_one_body() -> None:
    """A chain of masses that lies on three sliders: its stiffness is singular with the contacts free."""
    n = 40
    K = 1e6 * (2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    K[0, 0] = K[-1, -1] = 1e6
    scene = Scene.from_dict(
        {
            "name": "chain",
            "structure": {
                "kind": "matrices", "M": np.eye(n).tolist(), "K": K.tolist(), "damping_ratio": 0.002,
                "dofs": {f"x{i}": i for i in range(n)},
            },
            "contacts": [
                {"name": f"pad{i}", "between": [f"x{i}", "ground"], "kt": 2e5, "mu": 0.3, "N0": 30.0}
                for i in (5, 20, 30)
            ],
            "excitation": {"dof": "x39", "amplitude": 10.0},
            "observe": {"dof": "x39", "band": [5.0, 30.0]},
        }
    )  # fmt: skip
    found = reduce_for_contacts(scene)
    assert found.modes.omega2.size <= 20
    assert found.modes.omega2[0] <= 1e-9 * found.modes.omega2[1]
    assert found.error is not None
    assert found.error <= 2e-3
    few, every = (solver.sweep(each, harmonics=5) for each in (found.scene, scene))
    assert few.peak.value == pytest.approx(every.peak.value, rel=2e-3)


def test_what_is_no_pair_of_matrices_is_refused(blade: Blade) -> None:
    for scene in (blade.small, solver.load_scene("two-dof")):
        with pytest.raises(SettingError, match="must be `matrices` with M and K alone"):
            reduce_for_contacts(scene)


def test_no_peak_tells_no_error(blade: Blade) -> None:
    def elsewhere(scene: Scene) -> Scene:
        return scene.model_copy(update={"observe": scene.observe.model_copy(update={"band": (10.0, 20.0)})})

    assert peak_error(elsewhere(blade.full), elsewhere(blade.small)) is None


def test_modes_alone_says_how_many_motions(blade: Blade, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(blade.folder)
    command = ["import", "face-M.npz", "face-K.npz", "face.dof", "--nodes", "face.inp", "--patch", PATCH]
    command += ["--dof", "tip=6.UY", "--modes", "9", "--out", "nine.toml"]
    assert main(command) == 0
    assert solver.load_scene("nine.toml").structure.modes.omega2.size == 9


def test_damping_keeps_every_dof_of_the_faces(
    blade: Blade, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(blade.folder)
    command = ["import", "face-M.npz", "face-K.npz", "face-K.npz", "face.dof", "--nodes", "face.inp"]
    assert main([*command, "--patch", PATCH, "--dof", "tip=6.UY", "--out", "damped.toml"]) == 0
    structure = solver.load_scene("damped.toml").structure
    assert structure.modes is None
    assert structure.C is not None
    assert "every DOF of the faces is kept" in " ".join(capsys.readouterr().out.split())


CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))


@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed (calculix-ccx)")
def test_rows_of_elements_alone_are_named_and_weigh_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """CalculiX gives its bricks of incompatible modes nine rows each, whose mass has not their rank."""
    monkeypatch.chdir(tmp_path)
    grid = list(itertools.product(range(3), range(3), range(5)))
    number = {place: i for i, place in enumerate(grid, start=1)}
    deck = ["*NODE", *(f"{number[k, j, i]}, {0.02 * i}, {0.01 * j}, {0.002 * k}" for k, j, i in grid)]
    deck += ["*ELEMENT, TYPE=C3D8I, ELSET=E"]
    for e, (k, j, i) in enumerate(itertools.product(range(2), range(2), range(4)), start=1):
        deck.append(f"{e}, " + ", ".join(str(number[k + c, j + b, i + a]) for a, b, c in CORNERS))
    sets = {"FOOT": [at for at in grid if at[2] == 0], "FACE": [at for at in grid if at[2] > 2 and not at[0]]}
    for name, places in sets.items():
        deck += [f"*NSET, NSET={name}", *(str(number[at]) for at in places)]
    deck += ["*MATERIAL, NAME=S", "*ELASTIC", "2.1e11, 0.3", "*DENSITY", "7850."]
    deck += ["*SOLID SECTION, ELSET=E, MATERIAL=S", "*BOUNDARY", "FOOT, 1, 3", "*STEP"]
    deck += ["*FREQUENCY, SOLVER=MATRIXSTORAGE", "4", "*END STEP", ""]
    Path("block.inp").write_text("\n".join(deck))
    subprocess.run(["ccx", "block"], capture_output=True, timeout=100, check=False)
    command = ["import", "block.sti", "block.mas", "--nodes", "block.inp", "--dof", "tip=45.UZ"]
    patch = "foot=FACE:ground,normal=-z,kt=2e7,kn=4e7,mu=0.3,N0=300"
    assert main([*command, "--patch", patch, "--out", "block.toml"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "252 rows (144 of them elements' own, such as incompatible modes)" in said
    # In the first of four bricks along x the motion rises from 0 at the foot: a third of its mass moves.
    assert float(said.split("mass ")[1].split(" g")[0]) == pytest.approx(
        1e3 * 7850.0 * 0.08 * 0.02 * 0.004 * (3.0 + 1.0 / 3.0) / 4.0, rel=1e-3
    )
    assert solver.load_scene("block.toml").structure.modes is not None
