"""Gyroscopic, unsymmetric and hysteretic terms against closed forms, the time march and differences."""

import math
from typing import Any

import numpy as np
import pytest

import solver
from solver.balance.balance import build
from solver.balance.workspace import Workspace
from solver.errors import SceneError, SettingError
from solver.linear.natural_frequencies import natural_frequencies
from solver.scene.scene import Scene
from solver.sensitivity.gradient import Sensitivities

JT, JP, K_TILT, ZETA = 0.02, 0.03, 4000.0, 0.01  # kg m², kg m², N m, 1
CONTACT = {"name": "rub", "between": ["a", "ground"], "kt": 800.0, "mu": 0.3, "N0": 0.4}


def rotor(speed: float = 3000.0, **more: Any) -> dict[str, Any]:
    """A disk that tilts about two axes on an isotropic support, driven by a moment about one of them."""
    structure = {
        "kind": "lumped", "masses": {"a": JT, "b": JT}, "damping_ratio": ZETA,
        "springs": [
            {"between": ["a", "ground"], "k": K_TILT, "name": "ka"},
            {"between": ["b", "ground"], "k": K_TILT, "name": "kb"},
        ],
    }  # fmt: skip
    coupling = {"on": "a", "of": "b", "antisymmetric": True, "gyroscopic": JP}
    return {
        "name": "rotor", "structure": structure, "couplings": [coupling], "speed": speed, "contacts": [],
        "excitation": {"dof": "a", "amplitude": 1.0}, "observe": {"dof": "a", "band": [20.0, 200.0]},
    } | more  # fmt: skip


def as_matrices(raw: dict[str, Any]) -> dict[str, Any]:
    """The same rotor by its matrices."""
    zero = [[0.0, 0.0], [0.0, 0.0]]
    structure = {
        "kind": "matrices", "M": [[JT, 0.0], [0.0, JT]], "K": [[K_TILT, 0.0], [0.0, K_TILT]], "C": zero,
        "G": [[0.0, JP], [-JP, 0.0]], "dofs": ["a", "b"], "damping_ratio": [ZETA, ZETA],
    }  # fmt: skip
    return raw | {"structure": structure, "couplings": []}


def whirl(speed: float) -> np.ndarray[Any, Any]:
    """Backward and forward whirl [Hz] of the tilting disk, Jt ω² ± Jp Ω ω − k = 0."""
    spin = JP * speed * math.pi / 30.0
    root = math.sqrt(spin**2 + 4.0 * JT * K_TILT)
    return np.array([root - spin, root + spin]) / (2.0 * JT) / (2.0 * math.pi)


@pytest.mark.parametrize("speed", [0.0, 3000.0, 12000.0])
@pytest.mark.parametrize("way", [rotor, lambda speed: as_matrices(rotor(speed))])
def test_whirl_is_the_closed_form(way: Any, speed: float) -> None:
    found = natural_frequencies(Scene.from_dict(way(speed)), stuck=False)
    assert found == pytest.approx(whirl(speed), rel=1e-9)


@pytest.mark.parametrize("way", [rotor, lambda: as_matrices(rotor())])
def test_the_response_is_that_of_both_whirls(way: Any) -> None:
    scene = Scene.from_dict(way())
    spin, omega = 100.0 * math.pi, 2.0 * math.pi * 60.0
    # z = x + iy of an isotropic rotor: forward and backward amplitude of half the moment each.
    c = 2.0 * ZETA * math.sqrt(K_TILT * JT)
    forward = 0.5 / (K_TILT - JT * omega**2 + JP * spin * omega + 1j * omega * c)
    backward = 0.5 / (K_TILT - JT * omega**2 - JP * spin * omega + 1j * omega * c)
    assert solver.solve(scene, frequency_hz=60.0).max_abs == pytest.approx(abs(forward + backward), rel=1e-9)


@pytest.mark.parametrize("way", [rotor, lambda **more: as_matrices(rotor(**more))])
def test_a_rubbing_rotor_marches_to_its_balance(way: Any) -> None:
    scene = Scene.from_dict(way(contacts=[CONTACT]))
    found = solver.solve(scene, frequency_hz=44.0, harmonics=61)
    marched = solver.march(scene, frequency_hz=44.0, tolerance=1e-9)
    assert found.contacts[0].state.value == "stick and slip"
    assert found.half_peak_to_peak == pytest.approx(marched.half_peak_to_peak, rel=2e-6)
    assert solver.power_balance(found).imbalance < 1e-9


def test_a_sweep_meets_both_whirls() -> None:
    branch = solver.sweep(Scene.from_dict(rotor()), harmonics=1)
    peaks = sorted(peak.at for peak in branch.peaks if peak.interior)
    assert peaks == pytest.approx(whirl(3000.0).tolist(), rel=1e-3)


def test_a_sweep_in_the_speed_is_solved_at_each() -> None:
    raw = rotor(contacts=[CONTACT])
    raw["couplings"] += [{"on": "a", "of": "a", "k_omega2": 3e-3}]
    branch = solver.sweep(Scene.from_dict(raw), "speed", 500.0, 4000.0, frequency_hz=50.0, harmonics=5)
    assert branch.reached
    for i in (3, len(branch.values) // 2, -1):
        at = Scene.from_dict(raw | {"speed": float(branch.values[i])})
        assert branch.amplitude[i] == pytest.approx(
            solver.solve(at, frequency_hz=50.0, harmonics=5).max_abs, rel=1e-8
        )


def test_gradients_are_differences() -> None:
    raw = rotor(contacts=[CONTACT])
    raw["structure"] |= {"loss_factor": 0.02, "damping_ratio": [0.01, 0.03]}
    raw["structure"]["springs"][1]["k"] = 5000.0
    raw["couplings"] += [
        {"on": "b", "of": "a", "k": 300.0},
        {"on": "a", "of": "a", "k_omega2": 3e-3, "k_imaginary": 40.0},
    ]
    scene = Scene.from_dict(raw)
    paths = ("speed", "structure.ka", "structure.loss_factor", "rub.N0", "rub.kt")
    balance = build(scene, harmonics=7)
    u = Workspace.of(balance).solve(2.0 * math.pi * 47.0).u
    gradient = Sensitivities(balance, paths).gradient(u, 47.0).by_parameters
    for path, slope in zip(paths, gradient, strict=True):
        value = scene.value(path)
        step = 1e-5 * value
        high, low = (
            solver.solve(scene.with_values({path: at}), frequency_hz=47.0, harmonics=7).max_abs
            for at in (value + step, value - step)
        )
        assert slope == pytest.approx((high - low) / (2.0 * step), rel=2e-6), path


def test_structural_damping_is_a_complex_stiffness() -> None:
    raw = rotor(speed=0.0)
    raw["structure"] |= {"loss_factor": 0.05, "damping_ratio": 0.0}
    scene, omega = Scene.from_dict(raw), 2.0 * math.pi * 70.0
    exact = 1.0 / abs(K_TILT * (1.0 + 0.05j) - JT * omega**2)
    assert solver.solve(scene, frequency_hz=70.0, harmonics=1).max_abs == pytest.approx(exact, rel=1e-12)
    with pytest.raises(SettingError, match=r"loss_factor.*cannot be marched"):
        solver.march(scene, frequency_hz=70.0)
    rubbing = Scene.from_dict(raw | {"contacts": [CONTACT]})
    with pytest.raises(SettingError, match="no structural damping"):
        solver.stability(solver.solve(rubbing, frequency_hz=70.0, harmonics=5))


def test_damping_ratios_are_those_of_the_modes() -> None:
    M, K = np.diag([1.0, 2.0, 1.5]), np.array([[30.0, -10.0, 0.0], [-10.0, 25.0, -8.0], [0.0, -8.0, 20.0]])
    ratios = [0.01, 0.04]
    structure = {"kind": "matrices", "M": M.tolist(), "K": K.tolist(), "dofs": ["x", "y", "z"]}
    raw = rotor() | {
        "structure": structure | {"damping_ratio": ratios}, "couplings": [], "speed": None,
        "excitation": {"dof": "x", "amplitude": 1.0}, "observe": {"dof": "z", "band": [0.1, 2.0]},
    }  # fmt: skip
    raw.pop("speed")
    values, phi = np.linalg.eigh(K / np.sqrt(np.outer(np.diag(M), np.diag(M))))
    phi = phi / np.sqrt(np.diag(M))[:, None]
    omega, zeta = 2.0 * math.pi * 0.7, np.array([0.01, 0.04, 0.04])
    exact = abs(np.sum(phi[2] * phi[0] / (values - omega**2 + 2j * zeta * np.sqrt(values) * omega)))
    scene = Scene.from_dict(raw)
    assert solver.solve(scene, frequency_hz=0.7, harmonics=1).max_abs == pytest.approx(exact, rel=1e-12)
    assert solver.march(scene, frequency_hz=0.7).max_abs == pytest.approx(exact, rel=1e-8)
    assert Scene.from_dict(scene.to_dict()) == scene


def test_an_unsymmetric_matrix_must_be_declared() -> None:
    raw = as_matrices(rotor())
    raw["structure"]["K"] = [[K_TILT, 30.0], [-30.0, K_TILT]]
    with pytest.raises(SceneError, match="set `symmetric` = false"):
        Scene.from_dict(raw)
    raw["structure"]["symmetric"] = False
    scene, omega, spin = Scene.from_dict(raw), 2.0 * math.pi * 55.0, 100.0 * math.pi
    c = 2.0 * ZETA * math.sqrt(K_TILT * JT)
    G = np.array([[0.0, JP], [-JP, 0.0]])
    Z = np.array(raw["structure"]["K"]) + 1j * omega * (c * np.eye(2) + spin * G) - omega**2 * JT * np.eye(2)
    exact = abs(np.linalg.inv(Z)[0, 0])
    assert solver.solve(scene, frequency_hz=55.0, harmonics=1).max_abs == pytest.approx(exact, rel=1e-11)
    assert solver.march(scene, frequency_hz=55.0).max_abs == pytest.approx(exact, rel=1e-8)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"speed": None}, "`gyroscopic` needs the `speed`"),
        ({"couplings": [{"on": "a", "of": "c", "k": 1.0}]}, "there is no DOF 'c'"),
        ({"couplings": [{"on": "a", "of": "b", "offset": 1}]}, "`offset` = 1 needs a cyclic structure"),
        ({"couplings": [{"on": "a", "of": "a", "antisymmetric": True}]}, "couples two different DOFs"),
        ({"aerodynamics": [{"dof": "a", "influence": [{}]}]}, "between the blades of a cyclic structure"),
    ],
)
def test_what_is_wrong_is_said(change: dict[str, Any], message: str) -> None:
    raw = {key: value for key, value in (rotor() | change).items() if value is not None}
    with pytest.raises(SceneError, match=message):
        Scene.from_dict(raw)
