"""Responses at a held amplitude against responses solved, swept and marched at the force found."""

import math

import numpy as np
import pytest

import solver
from tests.cases.mode_cases import one_mass, slider

LEVEL = "excitation.amplitude"


def _under(found: solver.HeldAmplitude, factor: float) -> solver.Scene:
    return found.scene.with_values({LEVEL: factor * found.scene.value(LEVEL)})


@pytest.mark.parametrize(
    ("name", "amplitude", "harmonics"),
    [
        ("two-dof", 1.0, 5),
        pytest.param("two-dof", 20.0, 5, marks=pytest.mark.long),
        pytest.param("bladed-disk", 1e-4, 7, marks=pytest.mark.long),
        pytest.param("fe-disk", 1e-5, 5, marks=pytest.mark.long),
        pytest.param("shroud-3d", 1e-5, 5, marks=pytest.mark.long),
        pytest.param("platform-cylinder", 3.4e-4, 11, marks=pytest.mark.long),  # begins with fewer harmonics
    ],
)
def test_every_point_is_the_response_to_its_force(name: str, amplitude: float, harmonics: int) -> None:
    found = solver.held_amplitude(
        solver.load_scene(name), amplitude, harmonics=harmonics, errors=False, stability=False
    )
    assert found.reached, found.status
    assert np.all(found.excitation > 0.0)
    n = len(found.frequency_hz)
    for i in range(0, n, max(1, n // 6)):
        there = _under(found, float(found.excitation[i]))
        solved = solver.solve(there, frequency_hz=float(found.frequency_hz[i]), harmonics=harmonics)
        assert solved.harmonics[1] == pytest.approx(amplitude, rel=1e-7)
        assert solved.max_abs == pytest.approx(found.max_abs[i], rel=1e-6)


def test_the_march_has_the_amplitude_that_was_held() -> None:
    found = solver.held_amplitude(solver.load_scene("two-dof"), 3.0, harmonics=15, errors=False)
    i = len(found.frequency_hz) // 3
    assert found.stable[i]
    frequency = float(found.frequency_hz[i])
    marched = solver.march(_under(found, float(found.excitation[i])), frequency_hz=frequency)
    assert marched.converged
    assert marched.max_abs == pytest.approx(found.max_abs[i], rel=2e-3)


def test_the_least_force_has_its_peak_there() -> None:
    # One mass: max|x| and harmonic 1 are stationary together but for what higher harmonics add.
    scene = one_mass(1.0, 39.478, 0.5, 30.0, 30.0)
    found = solver.held_amplitude(scene, 3.0, start=0.5, stop=2.0, harmonics=1, errors=False, stability=False)
    factor, at = found.least
    branch = solver.sweep(_under(found, factor), start=0.5, stop=2.0, harmonics=1)
    assert branch.peak is not None
    assert branch.peak.value == pytest.approx(3.0, rel=1e-8)
    assert branch.peak.at == pytest.approx(at, rel=1e-4)


def test_one_slider_with_one_harmonic_is_the_formula() -> None:
    a, m, k, c = 2.5, 1.0, 39.478, 0.5
    found = solver.held_amplitude(
        one_mass(m, k, c, 30.0, 30.0), a, start=0.5, stop=2.0, harmonics=1, errors=False, stability=False
    )
    stiffness, lost = slider(a, 30.0, 30.0)
    omega = 2.0 * math.pi * found.frequency_hz
    force = a * np.hypot(k + stiffness - m * omega**2, c * omega + lost)
    np.testing.assert_allclose(found.excitation, force, rtol=1e-9)
    phase = -np.degrees(np.arctan2(c * omega + lost, k + stiffness - m * omega**2))
    np.testing.assert_allclose(found.phase_deg, phase, atol=1e-6)


def test_the_error_estimate_holds_what_more_harmonics_change() -> None:
    scene = one_mass(1.0, 39.478, 0.5, 30.0, 30.0)
    few, many = (
        solver.held_amplitude(scene, 3.0, start=1.0, stop=1.01, harmonics=h, stability=False) for h in (1, 21)
    )
    change = abs(few.excitation[0] - many.excitation[0])
    assert change > 0.0
    assert 0.3 * change < few.excitation_error[0] < 3.0 * change


@pytest.mark.parametrize(
    ("given", "name"),
    [
        ({"amplitude": 0.0}, "amplitude"),
        ({"amplitude": 1e-300}, "amplitude"),
        ({"amplitude": 1.0, "start": 2.0, "stop": 1.0}, "stop"),
        ({"amplitude": 1.0, "start": -1.0}, "start"),
        ({"amplitude": 1.0, "dof": "m9"}, "dof"),
        ({"amplitude": 1.0, "harmonics": 0}, "harmonics"),
    ],
)
def test_what_can_not_be_is_refused(given: dict[str, float], name: str) -> None:
    with pytest.raises(solver.SettingError) as refused:
        solver.held_amplitude(solver.load_scene("two-dof"), **given)  # type: ignore[arg-type]
    assert refused.value.name == name


def test_a_kink_is_where_a_contact_begins_to_slip() -> None:
    # The amplitude of m1 is held; that of m2, where the damper is, is larger near its own resonance.
    scene = solver.load_scene("two-dof").with_values({"damper.N1": 0.0})
    found = solver.held_amplitude(scene, 0.3, dof="m1", harmonics=3, errors=False, stability=False)
    assert [name for _, _, name in found.changes] == ["damper", "damper"]
    states = []
    for at in found.changes[0][:2]:
        i = int(np.argmin(np.abs(found.frequency_hz - at)))
        there = _under(found, float(found.excitation[i]))
        states.append(solver.solve(there, frequency_hz=at, harmonics=3).contacts[0].state.value)
    assert states == ["stuck", "stick and slip"]
