"""Scenes in other programs: files solved by SciPy alone, units run by fmpy; the march is the referee."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from certified_scenes import random_scene
from scipy.integrate import solve_ivp
from scipy.io import loadmat

import stickslip
from service.cli import main
from stickslip.export import save_fmu, save_mat

TWO = stickslip.load_scene("two-dof")
NEAR = 1e-6  # of the amplitude
Unit = Callable[..., Any]


def motion_of_a_file(file: Path, at: Any) -> Any:
    """The observed motion at instants, from rest, by SciPy and what the file says in `equations`.

    Friction forces f are states: f' = kt u', held to ±μN where it would leave that.
    """
    model = loadmat(file, simplify_cells=True)["model"]
    n, omega = int(np.sqrt(np.size(model["M"]))), 2.0 * np.pi * model["frequency_hz"]
    M, C, K, rows = (np.reshape(model[key], (-1, n)) for key in ("M", "C", "K", "force"))
    size, phase, order = (np.atleast_1d(model[key]) for key in ("amplitude", "phase", "harmonic"))
    of = {key: np.atleast_1d(each) for key, each in model["contacts"].items()}
    m, along, normal = of["kt"].size, of["along"].reshape(-1, n), of["normal"].reshape(-1, n)
    wave, lead = of["wave"].reshape(m, -1), of["wave_phase"].reshape(m, -1)
    k, gaps, inverse = np.arange(1, wave.shape[1] + 1), of["follows"] == 2, np.linalg.inv(M)
    rest = of["prestressed"] * np.maximum(of["N0"], 0.0)

    def rates(t: float, y: Any) -> Any:
        q, v, f = y[:n], y[n : 2 * n], y[2 * n :]
        load = of["N0"] + (wave * np.cos(k * omega * t + lead)).sum(axis=1) + of["kn"] * (normal @ q)
        rise = of["kn"] * (normal @ v) - (k * omega * wave * np.sin(k * omega * t + lead)).sum(axis=1)
        closed, top = load > 0.0, of["mu"] * np.maximum(load, 0.0)
        moves, rise = of["kt"] * (along @ v), of["mu"] * rise
        held = np.where(
            (f >= top) & (moves > rise), rise, np.where((f <= -top) & (moves < -rise), -rise, moves)
        )
        pushed = np.where(gaps, of["kt"] * np.maximum(along @ q - of["gap"], 0.0), np.clip(f, -top, top))
        given = rows.T @ (size * np.cos(order * omega * t + phase)) - C @ v - K @ q
        given -= along.T @ pushed + normal.T @ (of["presses"] * (np.maximum(load, 0.0) - rest))
        return np.concatenate([v, inverse @ given, np.where(closed & ~gaps, held, 0.0)])

    fine = {"rtol": 1e-9, "atol": 1e-10, "max_step": 0.1 / omega}
    found = solve_ivp(rates, (0.0, at[-1]), np.zeros(2 * n + m), "DOP853", t_eval=at, **fine)
    return np.reshape(model["observe"], n) @ found.y[:n]


SCENES = {
    "two-dof": (TWO, 1.2), "varies": (TWO.with_values({"damper.N1_ratio": 1.4, "damper.N0": 50.0}), 1.05),
    **{f"random {seed}": random_scene(seed) for seed in (5, 19, 24, 27, 28)},
}  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("name", SCENES)
def test_a_matlab_file_is_solved_by_scipy_alone(name: str, tmp_path: Path) -> None:
    scene, hz = SCENES[name]
    marched = stickslip.march(scene, frequency_hz=hz)
    save_mat(scene, tmp_path / "scene.mat", frequency_hz=hz)
    at = marched.periods / hz + marched.time[:: marched.time.size // 16]
    found = motion_of_a_file(tmp_path / "scene.mat", at)
    assert np.abs(found - marched.displacement[:: marched.time.size // 16]).max() <= NEAR * marched.max_abs


# Units for co-simulation


class Running:
    """A unit that fmpy runs."""

    def __init__(self, file: Path, folder: Path, build: Unit | None = None, **values: float) -> None:
        import fmpy.fmi2

        about = fmpy.read_model_description(str(file))
        self.at = {each.name: each.valueReference for each in about.modelVariables}
        fmpy.extract(str(file), str(folder))
        if build is not None:
            folder.with_name("build").mkdir()
            build(folder, folder.with_name("build"), generator="Unix Makefiles")
        self.unit = fmpy.fmi2.FMU2Slave(
            guid=about.guid, unzipDirectory=str(folder), modelIdentifier="model", instanceName="one"
        )
        self.unit.instantiate()
        self.unit.setupExperiment(startTime=0.0)
        self.set(**values)
        self.unit.enterInitializationMode()
        self.unit.exitInitializationMode()

    def set(self, **values: float) -> None:
        self.unit.setReal([self.at[name.replace("__", ".")] for name in values], list(values.values()))

    def get(self, name: str) -> float:
        return float(self.unit.getReal([self.at[name]])[0])

    def period(self, number: int, hz: float, count: int, name: str = "observed") -> Any:
        """A variable at instants of a period."""
        found = np.empty(count)
        for k in range(count):
            found[k] = self.get(name)
            self.unit.doStep((number + k / count) / hz, 1.0 / (count * hz))
        return found


@pytest.fixture
def running(tmp_path: Path) -> Iterator[Unit]:
    """Makes a unit of a scene and starts it."""
    pytest.importorskip("fmpy", reason="fmpy is not installed")
    if not any(map(shutil.which, ("cc", "gcc", "clang"))):
        pytest.skip("there is no C compiler")
    units: list[Running] = []

    def start(scene: stickslip.Scene, hz: float, **values: float) -> Running:
        file = tmp_path / f"{len(units)}.fmu"
        save_fmu(scene, file, frequency_hz=hz)
        units.append(Running(file, file.with_suffix(""), **values))
        return units[-1]

    yield start
    for each in units:
        each.unit.terminate()
        each.unit.freeInstance()


UNITS = SCENES | {"disk": (stickslip.load_scene("bladed-disk"), 700.0)}
UNITS |= {f"random {seed}": random_scene(seed) for seed in range(30) if seed not in (7, 16)}  # take minutes


@pytest.mark.few(18)
@pytest.mark.parametrize("name", UNITS)
def test_a_unit_moves_as_the_march_does(running: Unit, name: str) -> None:
    scene, hz = UNITS[name]
    marched = stickslip.march(scene, frequency_hz=hz)
    assert marched.converged
    unit = running(scene, hz)
    for number in range(marched.periods):
        unit.unit.doStep(number / hz, 1.0 / hz)
    found = unit.period(marched.periods, hz, marched.time.size)
    assert np.abs(found - marched.displacement).max() <= NEAR * marched.max_abs


def test_parameters_are_those_of_the_scene(running: Unit) -> None:
    other = {"damper.N0": 140.0, "damper.mu": 0.25}
    marched = stickslip.march(TWO.with_values(other), frequency_hz=1.1)
    unit = running(TWO, 1.2, frequency_hz=1.1, damper__N0=140.0, damper__mu=0.25)
    for number in range(marched.periods):
        unit.unit.doStep(number / 1.1, 1.0 / 1.1)
    force = unit.period(marched.periods, 1.1, marched.time.size, "damper.contact_force")
    assert np.abs(force - marched.contact_force[0]).max() <= NEAR * 0.25 * 140.0


def test_forces_are_inputs(running: Unit) -> None:
    """The scene's own force from outside, with three derivatives, moves it as from inside."""
    hz, count = 1.2, 256
    inside, outside = running(TWO, hz), running(TWO, hz, excitation__factor=0.0)
    at, turn, difference = outside.at["m1.force"], 2.0 * np.pi * hz, 0.0
    for k in range(6 * count):
        t = k / count / hz
        outside.unit.setReal([at], [100.0 * np.cos(turn * t)])
        for order in (1, 2, 3):
            slope = 100.0 * turn**order * np.cos(turn * t + order * np.pi / 2.0)
            outside.unit.setRealInputDerivatives([at], [order], [slope])
        for each in (inside, outside):
            each.unit.doStep(t, 1.0 / (count * hz))
        difference = max(difference, abs(inside.get("observed") - outside.get("observed")))
    assert difference <= NEAR


def test_a_state_is_saved_and_restored(running: Unit) -> None:
    unit = running(TWO, 1.2)
    unit.period(0, 1.2, 10)
    saved = unit.unit.getFMUState()
    bytes_ = unit.unit.serializeFMUState(saved)
    first = unit.period(1, 1.2, 10)
    unit.unit.setFMUState(unit.unit.deSerializeFMUstate(bytes_))
    assert unit.period(1, 1.2, 10).tolist() == first.tolist()


def test_a_unit_follows_the_standard_and_refuses_what_is_none_of_it(running: Unit, tmp_path: Path) -> None:
    from fmpy.fmi1 import FMICallException
    from fmpy.validation import validate_fmu

    unit = running(TWO, 1.2)
    assert validate_fmu(str(tmp_path / "0.fmu")) == []
    for set_or_get in (
        lambda: unit.set(damper__mu=0.2),  # after the initialization
        lambda: unit.unit.getReal([999]),
        lambda: unit.unit.setReal([unit.at["m1.force"]], [np.nan]),
        lambda: unit.unit.setReal([unit.at["observed"]], [0.0]),
        lambda: unit.unit.setRealInputDerivatives([unit.at["observed"]], [1], [0.0]),
        lambda: unit.unit.doStep(0.0, -1.0),
    ):
        with pytest.raises(FMICallException):
            set_or_get()


@pytest.mark.long
def test_whoever_imports_the_sources_compiles_them(
    running: Unit, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By CMake and the settings of fmpy."""
    from fmpy.build import build_platform_binary

    monkeypatch.setenv("PATH", str(Path(sys.executable).parent), prepend=":")
    if not (shutil.which("cmake") and shutil.which("make")):
        pytest.skip("there is no cmake or make")
    save_fmu(TWO, tmp_path / "sources.fmu", frequency_hz=1.2, sources_only=True)
    built = Running(tmp_path / "sources.fmu", tmp_path / "built", build_platform_binary)
    assert np.allclose(built.period(0, 1.2, 32), running(TWO, 1.2).period(0, 1.2, 32), rtol=1e-9, atol=0.0)
    built.unit.terminate()
    built.unit.freeInstance()


# What is refused


@contextmanager
def refused(text: str) -> Iterator[None]:
    with pytest.raises(stickslip.SettingError, match=text):
        yield


def test_what_is_not_carried_is_refused_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file, mat = tmp_path / "scene.fmu", tmp_path / "scene.mat"
    with refused("`shroud-0.law` must be coulomb, elastic-normal or gap .* got 'coulomb-3d'"):
        save_mat(stickslip.load_scene("shroud-3d"), mat, frequency_hz=700.0)
    with refused("`damper.kt` must be finite to be exported"):
        save_fmu(TWO.with_values({"damper.kt": np.inf}), file, frequency_hz=1.2)
    raw = TWO.to_dict()
    raw["structure"] = raw["structure"] | {"loss_factor": 0.01}
    with refused("`loss_factor` must be 0 to be exported"):
        save_mat(stickslip.Scene.from_dict(raw), mat, frequency_hz=1.2)
    with refused("`frequency_hz` must be"):
        save_mat(TWO, mat, frequency_hz=-1.0)
    with refused(r"`file` must end in \.mat"):
        save_mat(TWO, file, frequency_hz=1.2)
    with refused(r"`file` must end in \.fmu"):
        save_fmu(TWO, mat, frequency_hz=1.2)
    monkeypatch.setattr("stickslip.lab.exports.fmu.MOST", 1)
    with refused("2 coordinates"):
        save_fmu(TWO, file, frequency_hz=1.2)
    monkeypatch.undo()
    monkeypatch.setenv("PATH", "")
    with refused("`CC` must be a C compiler, or the unit be written as sources alone"):
        save_fmu(TWO, file, frequency_hz=1.2)
    save_fmu(TWO, file, frequency_hz=1.2, sources_only=True)
    assert [each.name for each in tmp_path.iterdir()] == ["scene.fmu"]


def test_the_command_writes_both(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def ended(name: str, hz: str, *more: str) -> int:
        return main(["export", "two-dof", "--out", str(tmp_path / name), "--frequency", hz, *more])

    assert (ended("a.mat", "1.2"), ended("a.fmu", "1.2", "--sources-only")) == (0, 0)
    assert all((tmp_path / name).stat().st_size > 1000 for name in ("a.mat", "a.fmu"))
    assert "contacts" in capsys.readouterr().out
    assert (ended("a.txt", "1.2"), ended("a.mat", "1.2", "--sources-only"), ended("a.mat", "0")) == (2, 2, 2)
    assert "`--frequency`" in capsys.readouterr().err
