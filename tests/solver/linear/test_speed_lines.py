"""An engine-order line, along which the speed follows the frequency, against each speed on its own."""

import math
from typing import Any

import numpy as np
import pytest

import optim
import solver
from solver.balance.balance import build, more_harmonics
from solver.balance.workspace import Workspace
from solver.contacts.kernels.columns import N0
from solver.errors import SceneError, SettingError
from solver.linear.natural_frequencies import natural_frequencies
from solver.scene.scene import Scene
from solver.sensitivity.gradient import Sensitivities

JT, JP, K = 0.02, 0.03, 4000.0
ORDER = 3.0
AMPLITUDE = {"path": "excitation.amplitude", "table": [[0.0, 0.5], [1000.0, 1.0], [2000.0, 2.0]]}
LOAD = {"path": "rub.N0", "polynomial": [0.2, 0.0, 2e-7]}
CONTACT = {"name": "rub", "between": ["a", "ground"], "kt": 800.0, "mu": 0.3, "N0": 1.0, "N1_ratio": 0.3}


def rotor(**more: Any) -> dict[str, Any]:
    springs = [{"between": [dof, "ground"], "k": K, "c": 0.3, "name": f"k{dof}"} for dof in "ab"]
    return {
        "name": "rotor", "structure": {"kind": "lumped", "masses": {"a": JT, "b": JT}, "springs": springs},
        "couplings": [
            {"on": "a", "of": "b", "antisymmetric": True, "gyroscopic": JP},
            {"on": "b", "of": "b", "k_omega2": 5e-3},
        ],
        "speed_order": ORDER, "with_speed": [LOAD, AMPLITUDE], "contacts": [CONTACT],
        "excitation": {"dof": "a", "amplitude": 7.0}, "observe": {"dof": "a", "band": [40.0, 110.0]},
    } | more  # fmt: skip


def at_speed(raw: dict[str, Any], frequency_hz: float) -> Scene:
    """The same at a fixed speed, every number written out."""
    speed = 60.0 * frequency_hz / ORDER
    given = {key: value for key, value in raw.items() if key not in ("speed_order", "with_speed")}
    force = raw["excitation"] | {"amplitude": 0.5 + speed * 2.5e-4 + speed**2 * 2.5e-7}
    contacts = [contact | {"N0": 0.2 + 2e-7 * speed**2} for contact in raw["contacts"]]
    return Scene.from_dict(given | {"speed": speed, "excitation": force, "contacts": contacts})


def test_a_sweep_along_the_line_is_solved_at_each_speed() -> None:
    raw = rotor()
    branch = solver.sweep(Scene.from_dict(raw), "speed", 900.0, 2100.0, harmonics=5)
    assert branch.reached
    assert branch.speeds_rpm is not None
    assert branch.speeds_rpm[[0, -1]] == pytest.approx([900.0, 2100.0])
    for i in (0, len(branch.values) // 3, -1):
        at = float(branch.values[i])
        wanted = solver.solve(at_speed(raw, at), frequency_hz=at, harmonics=5)
        assert branch.amplitude[i] == pytest.approx(wanted.max_abs, rel=1e-8)
    assert branch.peak is not None
    there = solver.solve(Scene.from_dict(raw), frequency_hz=branch.peak.at, harmonics=5)
    assert there.max_abs == pytest.approx(branch.peak.value, rel=1e-8)
    marched = solver.march(Scene.from_dict(raw), frequency_hz=70.0)
    found = solver.solve(Scene.from_dict(raw), frequency_hz=70.0, harmonics=41)
    assert found.half_peak_to_peak == pytest.approx(marched.half_peak_to_peak, rel=1e-5)


def test_the_error_along_the_line_is_what_more_harmonics_change() -> None:
    scene = Scene.from_dict(rotor())
    few, many = (solver.sweep(scene, harmonics=count) for count in (5, 21))
    assert few.peak is not None
    assert many.peak is not None
    assert abs(many.peak.value - few.peak.value) <= few.error_estimate <= 1e-3 * few.peak.value
    assert solver.sweep(scene, accuracy=1e-4).reached
    wide, built = more_harmonics(build(scene, harmonics=5), 11).system, build(scene, harmonics=11).system
    assert wide.contacts[:, N0].tolist() == built.contacts[:, N0].tolist() == [0.2]


def test_gradients_along_the_line_are_differences() -> None:
    scene = Scene.from_dict(rotor())
    paths = ("structure.ka", "structure.kb", "rub.kt", "rub.mu")
    balance = build(scene, harmonics=5)
    at = 71.0
    u = Workspace.of(balance).solve(2.0 * math.pi * at).u
    found = Sensitivities(balance, paths).gradient(u, at)

    def amplitude(where: Scene, hz: float) -> float:
        return solver.solve(where, frequency_hz=hz, harmonics=5).max_abs

    for path, slope in zip(paths, found.by_parameters, strict=True):
        value = scene.value(path)
        high, low = (amplitude(scene.with_values({path: by * value}), at) for by in (1.0 + 1e-5, 1.0 - 1e-5))
        assert slope == pytest.approx((high - low) / (2e-5 * value), rel=3e-6), path
    along = (amplitude(scene, at + 1e-4) - amplitude(scene, at - 1e-4)) / 2e-4
    assert found.by_frequency == pytest.approx(along, rel=1e-6)


def test_whirl_along_the_line_is_the_closed_form() -> None:
    """Jt ω² ± Jp ω²/e = k."""
    raw = rotor(couplings=rotor()["couplings"][:1], with_speed=[], contacts=[])
    exact = np.sqrt(K / (JT + JP / ORDER * np.array([1.0, -1.0]))) / (2.0 * math.pi)
    scene = Scene.from_dict(raw)
    assert natural_frequencies(scene, stuck=False) == pytest.approx(exact, rel=1e-9)
    diagram = optim.campbell_diagram(scene, speeds_rpm=[900.0, 2100.0], orders=[3, 5], harmonics=1)
    of_five = np.sqrt(K / (JT + JP / 5.0 * np.array([1.0, -1.0]))) / (2.0 * math.pi)
    assert diagram.orders[0].open_hz == pytest.approx(exact.tolist(), rel=1e-9)
    assert diagram.orders[1].open_hz == pytest.approx(of_five.tolist(), rel=1e-9)
    peaks = sorted(crossing.frequency_hz for crossing in diagram.orders[1].crossings)
    assert peaks == pytest.approx(of_five.tolist(), rel=5e-3)


def test_centrifugal_loads_of_bodies_follow_the_line() -> None:
    body = {
        "name": "wedge", "mass": 0.01, "inertia": 1e-6, "plane": "xy", "radius_of_rotation": 0.2,
        "out": [0.0, 1.0, 0.0],
    }  # fmt: skip
    springs = [
        {"between": ["wedge.y", "ground"], "k": 5e3, "c": 0.5},
        {"between": ["wedge.x", "ground"], "k": 1e3},
        {"between": ["wedge.rz", "ground"], "k": 1.0},
    ]
    raw = rotor(
        bodies=[body], couplings=[], with_speed=[], contacts=[],
        observe={"dof": "wedge.y", "band": [40.0, 110.0]}, excitation={"dof": "wedge.y", "amplitude": 0.3},
    )  # fmt: skip
    raw["structure"] = raw["structure"] | {"springs": raw["structure"]["springs"] + springs}
    branch = solver.sweep(Scene.from_dict(raw), harmonics=2)
    for i in (1, -1):
        spin = 2.0 * math.pi * branch.values[i] / ORDER
        assert branch.mean[i] == pytest.approx(0.01 * 0.2 * spin**2 / 5e3, rel=1e-9)


@pytest.mark.long
def test_a_design_along_the_line_is_better() -> None:
    scene = Scene.from_dict(rotor())
    found = optim.design(scene, variables={"rub.kt": (100.0, 3000.0)}, harmonics=3)
    given = solver.sweep(scene, harmonics=3).peak
    at = scene.with_values(found.optimum)
    again = solver.sweep(at, harmonics=3).peak
    assert given is not None
    assert again is not None
    assert found.peak.value == pytest.approx(again.value, rel=1e-6)
    assert again.value < given.value


def test_a_fixed_speed_sets_what_follows_it() -> None:
    raw = {key: value for key, value in rotor().items() if key != "speed_order"}
    scene = Scene.from_dict(raw | {"speed": 1500.0})
    assert scene.value("rub.N0") == pytest.approx(0.65)
    assert scene.with_values({"speed": 2000.0}).value("excitation.amplitude") == pytest.approx(2.0)
    assert Scene.from_dict(scene.to_dict()) == scene
    with pytest.raises(SettingError, match="follows the speed"):
        scene.with_values({"rub.N0": 1.0})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"speed": 100.0}, "`speed_order` stands in place of `speed`"),
        (
            {"with_speed": [{"path": "rub.kt", "polynomial": [1.0]}]},
            "`path` must be `excitation.amplitude` or",
        ),
        ({"with_speed": [LOAD, LOAD]}, "follows the speed twice"),
        ({"with_speed": [{"path": "rub.N0"}]}, "needs `polynomial` or `table`"),
        ({"speed_order": None}, "needs the `speed`"),
    ],
)
def test_what_is_wrong_is_said(change: dict[str, Any], message: str) -> None:
    raw = {key: value for key, value in (rotor() | change).items() if value is not None}
    with pytest.raises(SceneError, match=message):
        Scene.from_dict(raw)


def test_no_tracks_and_no_loads_that_follow() -> None:
    scene = Scene.from_dict(rotor())
    with pytest.raises(SettingError, match="along an engine-order line"):
        solver.track_peak(scene, parameter="rub.kt", start=500.0, stop=1000.0)
    with pytest.raises(SettingError, match="follows the speed"):
        solver.sweep(scene, "rub.N0", 0.5, 1.0, frequency_hz=70.0)
    with pytest.raises(SettingError, match="follows the speed"):
        Sensitivities(build(scene, harmonics=3), ("rub.N1_ratio",))
