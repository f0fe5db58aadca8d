"""What a right answer obeys exactly: energy, homogeneity, units, symmetry, limits, time origin, annulus."""

from __future__ import annotations

import math

import numpy as np
import pytest

import solver
from solver import fourier

# scene, changed values, frequency: stick-slip, separation, and both contacts of the bladed disk.
CASES = {
    "two-dof": ("two-dof", {}, 1.198),
    "two-dof constant load": ("two-dof", {"damper.N1": 0.0}, 1.1),
    "two-dof phase": ("two-dof", {"damper.N1": 60.0, "damper.N1_phase": 1.0}, 0.95),
    "two-dof separation": ("two-dof", {"damper.N1": 200.0}, 1.198),
    "bladed-disk": ("bladed-disk", {}, 755.0),
    "bladed-disk separation": ("bladed-disk", {"shroud.N1": 400.0}, 750.0),
    "bladed-disk root slips": ("bladed-disk", {"root.N0": 60.0}, 740.0),
}
every_case = pytest.mark.parametrize("case", CASES)


def _scene(case: str) -> tuple[solver.Scene, float]:
    name, values, frequency = CASES[case]
    return solver.load_scene(name).with_values(values), frequency


def _solved(scene: solver.Scene, frequency: float, harmonics: int = 11) -> solver.Solution:
    solution = solver.solve(scene, frequency_hz=frequency, harmonics=harmonics)
    assert solution.converged
    return solution


def _loads(scene: solver.Scene, factor: float) -> dict[str, float]:
    """Every normal load of a scene times a factor."""
    values = {}
    for contact in scene.contacts:
        values[f"{contact.name}.N0"] = contact.N0 * factor
        if contact.N1_ratio is None:
            values[f"{contact.name}.N1"] = contact.N1_value * factor
    return values


@every_case
@pytest.mark.parametrize("harmonics", [1, 5, 11, 31])
def test_power_supplied_is_power_lost(case: str, harmonics: int) -> None:
    scene, frequency = _scene(case)
    power = solver.power_balance(_solved(scene, frequency, harmonics))
    assert power.friction_w >= 0.0
    assert power.input_w == pytest.approx(power.viscous_w + power.friction_w, rel=1e-10)


@every_case
@pytest.mark.parametrize("factor", [1e-6, 0.3, 1e4])
def test_force_and_loads_together_scale_the_response(case: str, factor: float) -> None:
    scene, frequency = _scene(case)
    one = _solved(scene, frequency)
    amplitude = scene.value("excitation.amplitude") * factor
    scaled = _solved(
        scene.with_values(_loads(scene, factor) | {"excitation.amplitude": amplitude}), frequency
    )
    np.testing.assert_allclose(
        scaled.observed / factor, one.observed, rtol=0.0, atol=1e-10 * np.abs(one.observed).max()
    )


@every_case
def test_the_unit_of_length_does_not_matter(case: str) -> None:
    """In millimetres and tonnes, newtons and seconds stay and the same motion has thousandfold numbers."""
    scene, frequency = _scene(case)
    raw = scene.to_dict()
    structure = raw["structure"]
    assert isinstance(structure, dict)
    structure["masses"] = {
        name: {**mass, "m": mass["m"] * 1e-3} if isinstance(mass, dict) else mass * 1e-3
        for name, mass in structure["masses"].items()
    }
    for spring in structure["springs"]:
        spring["k"] *= 1e-3
        if "c" in spring:
            spring["c"] *= 1e-3
    for contact in raw["contacts"]:  # type: ignore[union-attr]
        contact["kt"] *= 1e-3
    millimetres = _solved(solver.Scene.from_dict(raw), frequency)
    metres = _solved(scene, frequency)
    np.testing.assert_allclose(
        millimetres.observed * 1e-3, metres.observed, rtol=0.0, atol=1e-10 * np.abs(metres.observed).max()
    )


@pytest.mark.parametrize("case", ["two-dof constant load", "bladed-disk root slips"])
def test_a_constant_load_moves_odd_harmonics_only(case: str) -> None:
    scene, frequency = _scene(case)
    scene = scene.with_values({f"{contact.name}.N1": 0.0 for contact in scene.contacts})
    solution = _solved(scene, frequency, 12)
    assert solution.harmonics[3] > 1e-4 * solution.harmonics[1]
    assert solution.harmonics[0::2].max() <= 1e-11 * solution.max_abs


@pytest.mark.parametrize("frequency", [0.5, 1.2151, 2.3])
def test_a_huge_load_gives_the_stuck_structure_and_none_the_free_one(frequency: float) -> None:
    scene = solver.load_scene("two-dof")
    k1, k2, c, kt = 157.91367041742973, 39.47841760435743, 0.5, 30.0
    omega = 2.0 * math.pi * frequency
    for N0, added in ((1e9, kt), (0.0, 0.0)):
        K = np.array([[k1 + k2, -k2], [-k2, k2 + added]])
        C = np.array([[2.0 * c, -c], [-c, c]])
        x = np.linalg.solve(K - omega**2 * np.eye(2) + 1j * omega * C, np.array([100.0, 0.0]))
        there = _solved(scene.with_values({"damper.N0": N0}), frequency)
        assert there.max_abs == pytest.approx(abs(x[1]), rel=1e-10)


@pytest.mark.parametrize("case", ["two-dof", "two-dof phase", "two-dof separation", "bladed-disk separation"])
def test_the_origin_of_time_does_not_matter(case: str) -> None:
    scene, frequency = _scene(case)
    turn = 0.7
    values = {"excitation.phase": scene.value("excitation.phase") + turn}
    for contact in scene.contacts:
        values[f"{contact.name}.N1_phase"] = contact.N1_phase + turn
    here, there = _solved(scene, frequency), _solved(scene.with_values(values), frequency)
    shift = np.exp(1j * turn * np.arange(here.n_harmonics + 1))
    np.testing.assert_allclose(
        fourier.to_complex(there.observed), fourier.to_complex(here.observed) * shift,
        rtol=0.0, atol=1e-9 * here.max_abs,
    )  # fmt: skip


@pytest.mark.parametrize("case", ["bladed-disk", "bladed-disk separation", "bladed-disk root slips"])
def test_one_sector_is_the_whole_annulus(case: str) -> None:
    scene, frequency = _scene(case)
    sector, whole = _solved(scene, frequency, 5), _solved(solver.annulus(scene), frequency, 5)
    np.testing.assert_allclose(
        whole.observed, sector.observed, rtol=0.0, atol=1e-9 * np.abs(sector.observed).max()
    )


@pytest.mark.parametrize("case", ["two-dof", "two-dof separation", "two-dof phase"])
def test_the_balance_approaches_the_time_march_as_harmonics_are_added(case: str) -> None:
    scene, frequency = _scene(case)
    march = solver.march(scene, frequency_hz=frequency)
    assert march.converged
    errors = [
        abs(_solved(scene, frequency, harmonics).max_abs - march.max_abs) / march.max_abs
        for harmonics in (3, 9, 27, 81)
    ]
    assert errors[-1] < 1e-7
    assert errors[-1] < 1e-2 * errors[1] < errors[0]
