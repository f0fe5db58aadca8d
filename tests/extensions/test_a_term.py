"""A term of the structure from outside: a damper to the ground whose constant depends on the speed.

One class, named once: it is read, solved, swept, differentiated, designed, marched, judged for stability and
written out over a disk. March, closed forms and differences are the referees.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
import pytest
from launch import COMMAND
from lumped_structure import lumped

import optim
import solver
from solver import extensions
from solver.contacts.fields import DofName, Signed
from solver.linear.assembly import linear_model
from solver.scene.cyclic.annulus import annulus
from solver.scene.json_schema import scene_schema
from solver.scene.linear_terms import Entry, LinearTerm, register, unregister

ROOT = Path(__file__).resolve().parent.parent.parent
SPIN = 3000.0 * 2.0 * math.pi / 60.0  # rad/s


class SpeedDamper(LinearTerm):
    """A damper to the ground with the constant c + c_per_speed Ω.

    Attributes
    ----------
    dof : str
        DOF it acts on.
    c : float
        Damping at rest [N s/m].
    c_per_speed : float
        What it gains per speed [N s/m per rad/s].
    """

    KIND = "speed-damper"
    DOFS = ("dof",)
    TURNING = ("c_per_speed",)
    PARAMETERS: ClassVar = {"c": "N s/m", "c_per_speed": "N s^2/m"}

    kind: Literal["speed-damper"]
    dof: DofName
    c: Signed
    c_per_speed: Signed = 0.0

    def entries(self, _sectors: int) -> tuple[Entry, ...]:
        """Its entry of C."""
        return (Entry(self.dof, self.dof, 0, 0.0, self.c, self.c_per_speed, 0.0),)


OIL = {"kind": "speed-damper", "name": "oil", "dof": "b", "c": 0.01, "c_per_speed": 1e-4}
SCENE: dict[str, Any] = {
    "name": "oiled",
    "structure": lumped({"a": 1.0, "b": 0.6}, ("a", "ground", 1.0, 0.01), ("a", "b", 0.8, 0.01)),
    "contacts": [{"name": "damper", "between": ["b", "ground"], "kt": 0.7, "mu": 0.5, "N0": 1.4}],
    "excitation": {"dof": "a", "amplitude": 0.3},
    "observe": {"dof": "b", "band": [0.08, 0.3]},
    "speed": 3000.0,
    "couplings": [OIL, {"on": "a", "of": "b", "antisymmetric": True, "gyroscopic": 1e-4}],
}
HZ, HARMONICS = 0.17, 31


@pytest.fixture(autouse=True)
def registered() -> Iterator[None]:
    """In this process."""
    register(SpeedDamper)
    yield
    unregister(SpeedDamper)


def scene(**values: float) -> solver.Scene:
    return solver.Scene.from_dict(SCENE).with_values({key.replace("__", "."): v for key, v in values.items()})


def test_the_matrices_have_it() -> None:
    model = linear_model(scene())
    _, C, _ = model.at(np.zeros(1, np.int64), np.ones(1, np.bool_))
    plain = solver.Scene.from_dict({**SCENE, "couplings": SCENE["couplings"][1:]})
    _, without, _ = linear_model(plain).at(np.zeros(1, np.int64), np.ones(1, np.bool_))
    assert C[0] - without[0] == pytest.approx(np.diag([0.0, 0.01 + 1e-4 * SPIN]), abs=1e-15)


def test_a_scene_is_written_back_and_read_again() -> None:
    assert solver.Scene.from_dict(scene().to_dict()) == scene()
    assert {"oil.c", "oil.c_per_speed", "speed"} <= set(scene().parameter_paths())
    assert scene(oil__c=0.2).value("oil.c") == 0.2


@pytest.mark.parametrize(("path", "step"), [("oil.c", 1e-6), ("oil.c_per_speed", 1e-8), ("speed", 0.1)])
def test_its_numbers_and_the_speed_have_gradients(path: str, step: float) -> None:
    def amplitude(value: float) -> float:
        changed = scene().with_values({path: value})
        return solver.solve(changed, frequency_hz=HZ, harmonics=11).max_abs

    branch = solver.sweep(scene(), start=HZ, stop=0.18, harmonics=11)
    slopes = solver.Sensitivities(branch.balance, [path])
    gradient = slopes.gradient(branch.solutions[0][:-1], HZ).by_parameters[0]
    value = scene().value(path)
    difference = (amplitude(value + step) - amplitude(value - step)) / (2.0 * step)
    assert gradient == pytest.approx(difference, rel=1e-5)


@pytest.mark.parametrize(("path", "stop"), [("oil.c", 0.1), ("oil.c_per_speed", 1e-3), ("speed", 9000.0)])
def test_a_sweep_in_its_numbers_ends_where_a_response_with_them_is(path: str, stop: float) -> None:
    start = scene().value(path)
    along = solver.sweep(scene(), path, frequency_hz=HZ, start=start, stop=stop, harmonics=11)
    there = solver.solve(scene().with_values({path: stop}), frequency_hz=HZ, harmonics=11)
    assert along.amplitude[-1] == pytest.approx(there.max_abs, rel=1e-8)
    assert along.amplitude[-1] != pytest.approx(along.amplitude[0], rel=1e-3)


def test_the_balance_is_what_marching_gives() -> None:
    found = solver.solve(scene(), frequency_hz=HZ, harmonics=HARMONICS)
    referee = solver.march(scene(), frequency_hz=HZ)
    assert found.converged
    assert referee.converged
    assert found.half_peak_to_peak == pytest.approx(referee.half_peak_to_peak, rel=1e-5)
    without = solver.Scene.from_dict({**SCENE, "couplings": SCENE["couplings"][1:]})
    assert solver.march(without, frequency_hz=HZ).half_peak_to_peak > 1.02 * referee.half_peak_to_peak


def test_a_load_is_designed_beside_it() -> None:
    found = optim.design(scene(), variables={"damper.N0": (0.1, 4.0), "oil.c": (0.005, 0.02)}, harmonics=5)
    assert found.reached, found.status
    best = found.optimum["damper.N0"]

    def peak(load: float, c: float = 0.02) -> float:
        return solver.sweep(scene(damper__N0=load, oil__c=c), harmonics=5).peak.value

    assert found.optimum["oil.c"] == pytest.approx(0.02, rel=1e-6)  # damping alone can only help
    assert found.peak.value == pytest.approx(peak(best), rel=1e-6)
    assert found.peak.value <= min(peak(load) for load in (0.7 * best, 0.98 * best, 1.02 * best, 1.4 * best))


@pytest.mark.parametrize("c_per_speed", [1e-4, -4e-4])
def test_multipliers_of_one_mass_are_those_of_its_oscillator(c_per_speed: float) -> None:
    raw = {
        "name": "one",
        "structure": lumped({"b": 0.6}, ("b", "ground", 1.0, 0.02)),
        "contacts": [{"name": "damper", "between": ["b", "ground"], "kt": 0.7, "mu": 0.5, "N0": 1e6}],
        "excitation": {"dof": "b", "amplitude": 0.3},
        "observe": {"dof": "b", "band": [0.08, 0.4]},
        "speed": 3000.0,
        "couplings": [{**OIL, "c_per_speed": c_per_speed}],
    }
    found = solver.solve(solver.Scene.from_dict(raw), frequency_hz=HZ, harmonics=3)
    judged = solver.stability(found)
    damping = 0.02 + 0.01 + c_per_speed * SPIN
    assert judged.radius == pytest.approx(math.exp(-damping / (2.0 * 0.6) / HZ), rel=1e-6)
    assert judged.stable is (damping > 0.0)


def test_every_sector_of_a_disk_has_its_own() -> None:
    raw = solver.load_scene("bladed-disk").to_dict()
    tip = solver.load_scene("bladed-disk").observe.dof
    disk = solver.Scene.from_dict({**raw, "speed": 3000.0, "couplings": [{**OIL, "dof": tip, "c": 0.5}]})
    whole = annulus(disk)
    assert [term.dof for term in whole.couplings] == [
        f"{tip}@{j}" for j in range(disk.structure.sector_count)
    ]
    assert whole.value("oil.c") == 0.5
    tuned = solver.solve(disk, frequency_hz=750.0, harmonics=3)
    written = solver.solve(whole, frequency_hz=750.0, harmonics=3)
    assert written.max_abs == pytest.approx(tuned.max_abs, rel=1e-9)
    assert tuned.max_abs < solver.solve(solver.Scene.from_dict(raw), frequency_hz=750.0, harmonics=3).max_abs


def test_what_is_wrong_is_told() -> None:
    wrong = {**SCENE, "couplings": [{**OIL, "dof": "c", "mu": 0.3}, {**OIL, "kind": "oil"}]}
    del wrong["speed"]
    with pytest.raises(solver.SceneError) as refused:
        solver.Scene.from_dict(wrong)
    said = {issue.pointer: issue.said() for issue in refused.value.issues}
    assert "there is no DOF 'c'" in said["/couplings/0/dof"]
    assert "is not a key of a coupling of the kind `speed-damper`; known keys:" in said["/couplings/0/mu"]
    assert (
        said["/couplings/0/c_per_speed"] == "`c_per_speed` needs the `speed` of rotation [1/min] of the scene"
    )
    assert (
        said["/couplings/1/kind"]
        == "`kind` must be one of coupling, maxwell, viscoelastic, speed-damper, got 'oil'"
    )
    line = {key: value for key, value in SCENE.items() if key != "speed"} | {"speed_order": 2000.0}
    with pytest.raises(solver.SettingError, match=r"along an engine-order line"):
        solver.sweep(solver.Scene.from_dict(line), "oil.c_per_speed", frequency_hz=HZ, start=0.0, stop=1e-3)


def test_a_scene_knows_it_while_it_is_registered() -> None:
    with pytest.raises(ValueError, match="speed-damper"):
        register(SpeedDamper)
    found = scene_schema()["$defs"]["SpeedDamper"]["properties"]
    assert found["c_per_speed"]["description"] == "What it gains per speed [N s/m per rad/s]."
    unregister(SpeedDamper)
    try:
        with pytest.raises(
            solver.SceneError, match=r"must be one of coupling, maxwell, viscoelastic, got 'speed-damper'"
        ):
            solver.Scene.from_dict(SCENE)
    finally:
        register(SpeedDamper)


@pytest.mark.long
def test_the_command_solves_it(tmp_path: Path) -> None:
    (tmp_path / "oiled.json").write_text(json.dumps(SCENE))
    environment = {
        **os.environ, extensions.VARIABLE: json.dumps(["test_a_term:SpeedDamper"]),
        "PYTHONPATH": os.pathsep.join((str(ROOT), str(ROOT / "tests" / "cases"), str(Path(__file__).parent))),
    }  # fmt: skip
    asked = (
        "solve",
        "oiled.json",
        "--frequency",
        str(HZ),
        "--harmonics",
        "5",
        "--set",
        "oil.c=0.05",
        "--json",
    )
    ended = subprocess.run(
        [*COMMAND, *asked], env=environment, cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert ended.returncode == 0, ended.stderr
    expected = solver.solve(scene(oil__c=0.05), frequency_hz=HZ, harmonics=5)
    assert json.loads(ended.stdout)["max_abs"] == pytest.approx(expected.max_abs, rel=1e-9)
