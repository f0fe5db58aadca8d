"""Performance curves against peaks of whole responses, and the curves they come from."""

import math

import numpy as np
import pytest

import solver
from tests.cases.mode_cases import one_mass

LEVEL = "excitation.amplitude"


def _exact(scene: solver.Scene, factor: float, harmonics: int) -> float:
    branch = solver.sweep(scene.with_values({LEVEL: factor * scene.value(LEVEL)}), harmonics=harmonics)
    assert branch.reached
    assert branch.peak is not None
    return branch.peak.value


def test_one_lightly_damped_mass_has_the_peaks_of_whole_responses() -> None:
    scene = one_mass(1.0, 39.478, 0.05, 3.0, 3.0).with_values({LEVEL: 3.0})
    found = solver.nonlinear_mode(scene, amplitudes=(0.1, 1e3), harmonics=7, errors=False)
    curve = solver.performance_curve(found)
    assert curve.scales
    for factor in (0.1, 0.3, 0.6, 1.1, 2.5):
        assert curve.at_excitation(factor)[0] == pytest.approx(_exact(scene, factor, 7), rel=0.02)


def test_a_load_is_an_excitation_turned_over() -> None:
    scene = one_mass(1.0, 39.478, 0.05, 3.0, 3.0).with_values({LEVEL: 3.0})
    found = solver.nonlinear_mode(scene, amplitudes=(0.1, 1e3), harmonics=7, errors=False)
    curve = solver.performance_curve(found)
    for factor in (0.2, 0.5):
        heavier = scene.with_values({"damper.N0": factor * scene.value("damper.N0")})
        own = solver.nonlinear_mode(heavier, amplitudes=(1e-2, 1e3), harmonics=7, errors=False)
        peak = solver.performance_curve(own).at_excitation(1.0)[0]
        assert curve.at_load(factor)[0] == pytest.approx(peak, rel=0.01)
    load, peak = curve.least
    assert curve.at_load(0.8 * load)[0] > peak < curve.at_load(1.25 * load)[0]


def test_constant_forces_do_not_scale() -> None:
    scene = one_mass(1.0, 39.478, 0.5, 30.0, 30.0)
    raw = scene.to_dict()
    raw["loads"] = [{"dof": "x", "force": 5.0}]
    found = solver.nonlinear_mode(
        solver.Scene.from_dict(raw), amplitudes=(0.3, 30.0), harmonics=5, errors=False
    )
    curve = solver.performance_curve(found)
    assert not curve.scales
    assert np.all(np.isnan(curve.load))
    assert math.isnan(curve.least[0])
    with pytest.raises(solver.SettingError, match="proportion"):
        solver.limit_cycles(found, -0.05).load_for(1.0)


def test_a_force_that_does_not_drive_the_mode_is_refused() -> None:
    scene = one_mass(1.0, 39.478, 0.5, 30.0, 30.0).with_values({LEVEL: 0.0})
    found = solver.nonlinear_mode(scene, amplitudes=(0.3, 3.0), harmonics=3, errors=False)
    with pytest.raises(solver.SettingError, match="drives the mode"):
        solver.performance_curve(found)


def test_a_mode_does_not_lead_over_into_another_in_a_higher_harmonic() -> None:
    # With short steps mode 1 of the two masses leads over into mode 2, moving in harmonic 2, from a = 1.4 on.
    found = solver.nonlinear_mode(solver.load_scene("two-dof"), amplitudes=(0.6, 1e3), errors=False)
    assert found.reached
    squares = found.dof_motions[:, :, 1:] ** 2
    # Both masses are 1 kg.
    first = squares[:, :, :2].sum(axis=(1, 2)) / squares.sum(axis=(1, 2))
    assert first.min() > 0.9
    bare = solver.load_scene("two-dof").model_copy(update={"contacts": ()})
    free = solver.nonlinear_mode(bare, amplitudes=(1.0, 2.0), harmonics=1)
    assert found.frequency_hz[-1] == pytest.approx(free.frequency_hz[0], rel=1e-3)
