"""Continuation: every way a branch ends, its settings, what it holds, bad arguments."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
from each import each
from scene_cases import bladed_disk, oscillator, two_dof

from solver import BranchStatus, ContinuationSettings, SettingError, sweep
from solver.balance.kernels.output import MAX_ABS
from solver.continuation.stretches import Course
from solver.jit.fourier import to_complex


def test_undamped():
    """Without damping the motion grows without bound towards the resonance; the steps end before it."""
    scene = oscillator({"kt": 0.3, "mu": 0.3, "N0": 0.5}, k=1.0)
    branch = sweep(scene, start=0.05, stop=0.3, harmonics=3)
    assert branch.status is BranchStatus.UNDAMPED
    assert not branch.reached
    assert branch.residuals.max() <= 1e-9
    assert branch.values[-1] == pytest.approx(1.0 / (2.0 * math.pi), rel=1e-6)
    assert "no damping" in branch.to_json()["status"]


def test_no_start():
    """At the resonance itself there is no bounded motion to start from."""
    scene = oscillator({"kt": 0.3, "mu": 0.3, "N0": 0.5}, k=1.0)
    branch = sweep(scene, start=1.0 / (2.0 * math.pi), stop=0.3, harmonics=3)
    assert branch.status is BranchStatus.UNDAMPED
    assert len(branch.values) == 0
    assert branch.peak is None
    assert branch.band is None
    obj = json.loads(json.dumps(branch.to_json(), allow_nan=False))
    assert obj["points"] == 0
    assert obj["peak"] is None
    assert obj["largest_residual"] is None


def test_too_many_points():
    branch = sweep(two_dof(), settings=ContinuationSettings(most_points=50, largest_step=0.01))
    assert branch.status is BranchStatus.TOO_MANY_POINTS
    assert not branch.reached
    assert len(branch.values) >= 50
    assert branch.values[-1] < 2.6


def test_stopped_by_the_caller():
    asked = []

    def enough() -> bool:
        asked.append(True)
        return len(asked) == 2

    fine = ContinuationSettings(largest_step=0.01)
    branch = sweep(two_dof(), should_stop=enough, settings=fine)
    assert branch.status is BranchStatus.STOPPED
    assert len(asked) == 2
    assert 2 <= len(branch.values) < sweep(two_dof(), settings=fine).values.size
    assert branch.residuals.max() <= 1e-9


def test_progress_rises_to_one():
    seen: list[tuple[float, int]] = []
    branch = sweep(
        two_dof(), start=2.6, stop=0.2, on_progress=lambda share, points: seen.append((share, points))
    )
    shares, points = zip(*seen, strict=True)
    assert list(points) == sorted(points)
    assert all(0.0 <= share <= 1.0 for share in shares)
    assert seen[-1] == (1.0, len(branch.values))


def test_a_guess_is_used():
    branch = sweep(two_dof(), start=1.0, stop=1.1)
    again = sweep(two_dof(), start=1.1, stop=1.2, course=Course(guess=branch.solutions[-1, :-1]))
    assert again.reached
    assert again.amplitude[0] == pytest.approx(branch.amplitude[-1], rel=1e-9)
    fresh = sweep(two_dof(), start=1.1, stop=1.2)
    assert again.newton_iterations < fresh.newton_iterations


def test_settings_change_the_cost_not_the_answer():
    usual = sweep(two_dof())
    fine = sweep(two_dof(), settings=ContinuationSettings(range_length=30.0, largest_step=0.1))
    loose = sweep(two_dof(), settings=ContinuationSettings(wanted_iterations=5, largest_turn=0.6))
    assert usual.peak is not None
    assert len(fine.values) > 2 * len(usual.values) > 2 * len(loose.values) * 0.5
    for branch in (fine, loose):
        assert branch.reached
        assert branch.peak is not None
        assert branch.peak.value == pytest.approx(usual.peak.value, rel=1e-9)


def test_what_a_branch_holds():
    scene = bladed_disk()
    branch = sweep(scene, harmonics=5)
    count = len(branch.values)
    assert branch.parameter == "frequency"
    assert branch.coefficients.shape == (count, 2, 11)
    assert branch.observed.shape == (count, 11)
    assert branch.states.shape == (count, 2)
    tau = np.linspace(0.0, 2.0 * np.pi, 2000)
    turning = np.exp(1j * np.outer(np.arange(6), tau))
    x = (to_complex(branch.observed) @ turning).real
    np.testing.assert_allclose(np.abs(x).max(axis=1), branch.amplitude, rtol=1e-4)
    np.testing.assert_allclose(0.5 * np.ptp(x, axis=1), branch.half_peak_to_peak, rtol=1e-4)
    np.testing.assert_allclose(branch.observed[:, 0], branch.mean)
    np.testing.assert_array_equal(branch.measures[:, MAX_ABS], branch.amplitude)
    obj = json.loads(json.dumps(branch.to_json(), allow_nan=False))
    assert obj["parameter"] == branch.values.tolist()
    assert obj["amplitude"] == branch.amplitude.tolist()
    assert obj["peak"] == {"value": branch.peak.value, "at": branch.peak.at} if branch.peak else None
    assert obj["band_hz"] == branch.band.width if branch.band else None
    assert obj["points"] == count
    assert obj["completed"] is True
    assert obj["unit"] == "Hz"


@each(
    ("arguments", "name", "value"),
    [
        ({"start": 0.0, "stop": 1.0}, "start", 0.0),
        ({"start": 1.0, "stop": math.inf}, "stop", math.inf),
        ({"start": 1.0, "stop": 1e300}, "stop", 1e300),
        ({"start": 1.0, "stop": 1.0}, "stop", 1.0),
        ({"start": "1", "stop": 2.0}, "start", "1"),
        ({"start": True, "stop": 2.0}, "start", True),
        ({"parameter": "damper.N0", "start": 1.0, "stop": 2.0}, "frequency_hz", None),
        ({"parameter": "damper.N0", "start": -1.0, "stop": 2.0, "frequency_hz": 1.0}, "start", -1.0),
        ({"parameter": "damper.N0", "start": 1.0, "stop": 1e300, "frequency_hz": 1.0}, "stop", 1e300),
        ({"parameter": "damper.N0", "start": 1.0, "frequency_hz": 1.0}, "stop", None),
        ({"parameter": "damper.N0", "stop": 1.0, "frequency_hz": 1.0}, "start", None),
        ({"parameter": "damper.kt", "start": math.nan, "stop": 2.0, "frequency_hz": 1.0}, "start", None),
        ({"parameter": "damper.N7", "start": 1.0, "stop": 2.0, "frequency_hz": 1.0}, "path", "damper.N7"),
        ({"parameter": "damper.mu", "start": 0.1, "stop": 2.0, "frequency_hz": -1.0}, "frequency_hz", -1.0),
        ({"limit": 0.0}, "limit", 0.0),
        ({"limit": math.nan}, "limit", None),
        ({"limit": "1"}, "limit", "1"),
        ({"harmonics": -1}, "harmonics", -1),
    ],
)
def test_bad_arguments_name_field_and_value(arguments: dict[str, Any], name: str, value: object):
    with pytest.raises(SettingError) as error:
        sweep(two_dof(), **arguments)
    assert error.value.name == name
    assert f"`{name}`" in str(error.value)
    if value is not None:
        assert error.value.value == value
        assert repr(value) in str(error.value)
