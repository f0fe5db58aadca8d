"""Designs on the performance curve of one mode, beside exact designs and what they say of themselves."""

import math

import numpy as np
import pytest

import optim
import solver
from optim.problem.problem_keys import TOLERANCE

LOADS = {"damper.N0": (20.0, 1000.0)}


def test_one_curve_designs_the_load_of_two_masses() -> None:
    scene = solver.load_scene("two-dof")
    found = optim.design(scene, variables=LOADS, method="performance-curve")
    exact = optim.design(scene, variables=LOADS)
    assert found.reached, found.status
    assert found.curve is not None
    assert found.peak is not None
    assert exact.peak is not None
    assert (found.curve.shared, found.curve.curves) == (True, 1)
    # An optimum is flat: what the curve is off by costs little.
    assert found.peak.value == pytest.approx(exact.peak.value, rel=5e-3)
    assert found.peak.value >= exact.peak.value * (1.0 - 1e-9)
    branch = solver.sweep(scene.with_values(dict(found.optimum)))
    assert branch.peak is not None
    assert found.peak.value == pytest.approx(branch.peak.value, rel=1e-9)
    assert found.curve.error == pytest.approx(found.curve.synthesised / branch.peak.value - 1.0, abs=1e-9)
    assert abs(found.curve.error) > 1e-3
    assert found.curve.estimate == pytest.approx(found.curve.error, abs=1e-3)
    assert found.curve.suffices


def test_a_tolerance_that_is_missed_is_said() -> None:
    scene = solver.load_scene("two-dof")
    found = optim.design(scene, variables=LOADS, method="performance-curve", tolerance=1e-3, harmonics=5)
    assert found.status is optim.DesignStatus.CURVE_OFF
    assert not found.reached
    assert found.curve is not None
    assert not found.curve.suffices


@pytest.mark.parametrize(
    ("given", "name"),
    [
        ({"method": "performance-curve", "max_band_hz": 1.0}, "method"),
        ({"tolerance": 0.1}, "tolerance"),
        ({"method": "performance-curve", "tolerance": 2.0}, "tolerance"),
    ],
)
def test_what_a_curve_can_not_judge_is_refused(given: dict[str, object], name: str) -> None:
    with pytest.raises(optim.DesignError, match=name):
        optim.design(solver.load_scene("two-dof"), variables=LOADS, **given)  # type: ignore[arg-type]


@pytest.mark.long
def test_a_curve_for_each_design_has_two_variables() -> None:
    scene = solver.load_scene("two-dof").with_values({"damper.N1": 0.0})
    wanted = {"damper.N0": (40.0, 400.0), "damper.kt": (20.0, 60.0)}
    found = optim.design(scene, variables=wanted, method="performance-curve", harmonics=5)
    exact = optim.design(scene, variables=wanted, harmonics=5)
    assert found.curve is not None
    assert not found.curve.shared
    assert found.peak is not None
    assert exact.peak is not None
    assert found.peak.value == pytest.approx(exact.peak.value, rel=0.02)


@pytest.mark.long
def test_one_load_of_the_contacts_of_a_finite_element_disk() -> None:
    wanted = {"lower.N0,upper.N0": (10.0, 500.0)}
    scene = solver.load_scene("fe-disk")
    # With five harmonics the response lacks the peak that is highest with ten, from which the curve of one
    # mode is 6 % off.
    off = optim.design(scene, variables=wanted, method="performance-curve", harmonics=5)
    assert off.status is optim.DesignStatus.CURVE_OFF
    assert off.problem.harmonics == 10
    found = optim.design(scene, variables=wanted, method="performance-curve", tolerance=0.1, harmonics=5)
    assert found.curve is not None
    assert found.curve.shared
    assert found.reached
    assert TOLERANCE < abs(found.curve.error) < 0.1
    assert found.curve.estimate == pytest.approx(found.curve.error, abs=2e-3)
    assert math.isfinite(found.curve.seconds_saved)
    exact = optim.design(scene, variables=wanted, harmonics=5)
    assert found.peak is not None
    assert exact.peak is not None
    assert found.peak.value == pytest.approx(exact.peak.value, rel=0.01)
    assert np.isfinite(found.optimality)
