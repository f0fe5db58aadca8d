"""Influence of the gas between blades, against modal damping ratios, the annulus and the time march."""

import math
from typing import Any

import pytest

import solver
from solver.balance.balance import build
from solver.balance.simplifications import Effects
from solver.balance.workspace import Workspace
from solver.errors import SceneError, SettingError
from solver.scene.scene import Scene
from solver.sensitivity.gradient import Sensitivities

M, K, KD, N, ORDER = 0.2, 9000.0, 700.0, 6, 2
SHROUD = {"name": "shroud", "between": ["tip", "tip@next"], "kt": 4000.0, "mu": 0.3, "N0": 0.6}


def disk(**more: Any) -> dict[str, Any]:
    """Six blades of one mass each, coupled by springs and by the gas."""
    springs = [{"between": ["tip", "ground"], "k": K}, {"between": ["tip", "tip@next"], "k": KD}]
    return {
        "name": "disk",
        "structure": {"kind": "cyclic", "sectors": N, "masses": {"tip": M}, "springs": springs},
        "contacts": [], "excitation": {"dof": "tip", "amplitude": 1.0, "engine_order": ORDER},
        "observe": {"dof": "tip", "band": [20.0, 60.0]},
    } | more  # fmt: skip


def angle(n: int) -> float:
    return 2.0 * math.pi * n / N


def omega_n(n: int) -> float:
    """Natural frequency of a nodal diameter [rad/s]."""
    return math.sqrt((K + KD * (2.0 - 2.0 * math.cos(angle(n)))) / M)


def blade(ratio: float) -> Scene:
    """The nodal diameter as a single mass with a damping ratio."""
    structure = {
        "kind": "lumped", "masses": {"tip": M}, "damping_ratio": ratio,
        "springs": [{"between": ["tip", "ground"], "k": M * omega_n(ORDER) ** 2}],
    }  # fmt: skip
    return Scene.from_dict(disk(structure=structure, excitation={"dof": "tip", "amplitude": 1.0}))


def test_aerodynamic_damping_is_the_modal_damping_ratio() -> None:
    """Dashpots between blades: c_n = c_0 + 2 c_1 cos θ_n, ζ = c_n / (2 m ω_n); in one blade and by waves."""
    c = [0.8, -0.15]
    total = c[0] + 2.0 * c[1] * math.cos(angle(ORDER))
    ratio = total / (2.0 * M * omega_n(ORDER))
    between = [{"damping": c[0]}, {"offset": 1, "damping": c[1]}, {"offset": -1, "damping": c[1]}]
    waves = [{"diameter": n, "damping": c[0] + 2.0 * c[1] * math.cos(angle(n))} for n in range(N)]
    for gas in ({"influence": between}, {"nodal_diameters": waves}):
        scene = Scene.from_dict(disk(aerodynamics=[{"dof": "tip"} | gas]))
        for at in (30.0, omega_n(ORDER) / (2.0 * math.pi), 45.0):
            found = solver.solve(scene, frequency_hz=at, harmonics=1).max_abs
            wanted = solver.solve(blade(ratio), frequency_hz=at, harmonics=1).max_abs
            assert found == pytest.approx(wanted, rel=1e-9)
        peaks = (solver.sweep(each, harmonics=1).peaks[0].value for each in (scene, blade(ratio)))
        assert next(peaks) == pytest.approx(next(peaks), rel=1e-9)


@pytest.mark.parametrize("diameter", [ORDER, -ORDER])
def test_imaginary_coefficients_tell_the_waves_apart(diameter: int) -> None:
    """Real influences that are not mutual, k_1 = −k_−1, damp one wave by k sin θ and feed the other."""
    k = 25.0
    influence = [{"offset": 1, "stiffness": k}, {"offset": -1, "stiffness": -k}, {"damping": 0.9}]
    order = diameter % N
    raw = disk(
        aerodynamics=[{"dof": "tip", "influence": influence}],
        excitation={"dof": "tip", "amplitude": 1.0, "engine_order": order},
    )
    scene, omega = Scene.from_dict(raw), 0.98 * omega_n(ORDER)
    imaginary = 2.0 * k * math.sin(angle(diameter))
    exact = 1.0 / abs(M * (omega_n(ORDER) ** 2 - omega**2) + 1j * (0.9 * omega + imaginary))
    at = omega / (2.0 * math.pi)
    assert solver.solve(scene, frequency_hz=at, harmonics=1).max_abs == pytest.approx(exact, rel=1e-9)
    assert solver.march(scene, frequency_hz=at).max_abs == pytest.approx(exact, rel=1e-7)


def waves_and_contacts() -> dict[str, Any]:
    waves = [
        {"diameter": n, "stiffness": 60.0 * math.cos(n), "imaginary": 200.0 + 120.0 * math.sin(angle(n))}
        for n in range(-2, 4)
    ]
    return disk(aerodynamics=[{"dof": "tip", "name": "gas", "nodal_diameters": waves}], contacts=[SHROUD])


def test_a_sector_with_friction_is_its_annulus() -> None:
    scene = Scene.from_dict(waves_and_contacts())
    one, whole = (
        solver.solve(scene, frequency_hz=38.0, harmonics=9, effects=effects)
        for effects in (None, Effects(every_sector=True))
    )
    assert one.contacts[0].state.value == "stick and slip"
    assert one.max_abs == pytest.approx(whole.max_abs, rel=1e-8)
    assert solver.power_balance(one).imbalance < 1e-9
    with pytest.raises(SettingError, match=r"k_imaginary.*cannot be marched"):
        solver.march(scene, frequency_hz=38.0)


def test_friction_and_influence_march_to_the_balance() -> None:
    influence = [
        {"damping": 3.0},
        {"offset": 1, "stiffness": 60.0, "damping": -0.4},
        {"offset": -2, "stiffness": 9.0},
    ]
    scene = Scene.from_dict(disk(aerodynamics=[{"dof": "tip", "influence": influence}], contacts=[SHROUD]))
    found = solver.solve(scene, frequency_hz=38.0, harmonics=41)
    marched = solver.march(scene, frequency_hz=38.0, tolerance=1e-9)
    assert found.contacts[0].state.value == "stick and slip"
    assert found.half_peak_to_peak == pytest.approx(marched.half_peak_to_peak, rel=2e-6)


def test_the_gradient_by_the_factor_is_a_difference() -> None:
    scene = Scene.from_dict(waves_and_contacts())
    balance = build(scene, harmonics=7)
    u = Workspace.of(balance).solve(2.0 * math.pi * 38.0).u
    found = Sensitivities(balance, ("gas.factor",)).gradient(u, 38.0).by_parameters[0]
    high, low = (
        solver.solve(scene.with_values({"gas.factor": at}), frequency_hz=38.0, harmonics=7).max_abs
        for at in (1.0 + 1e-5, 1.0 - 1e-5)
    )
    assert found == pytest.approx((high - low) / 2e-5, rel=1e-6)


def test_what_is_wrong_is_said() -> None:
    with pytest.raises(SceneError, match="needs `influence` or `nodal_diameters`"):
        Scene.from_dict(disk(aerodynamics=[{"dof": "tip"}]))
    with pytest.raises(SceneError, match="there is no DOF 'top'"):
        Scene.from_dict(disk(aerodynamics=[{"dof": "top", "influence": [{"damping": 1.0}]}]))
    uneven = [{"diameter": 1, "damping": 1.0}, {"diameter": -1, "damping": 2.0}]
    scene = Scene.from_dict(disk(aerodynamics=[{"dof": "tip", "nodal_diameters": uneven}]))
    with pytest.raises(SettingError, match="give what differs as `imaginary`"):
        solver.march(scene, frequency_hz=30.0)
