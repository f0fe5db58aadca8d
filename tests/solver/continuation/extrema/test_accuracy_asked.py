"""An accuracy asked for: met by estimate and in truth, with few harmonics, or an honest word."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
from random_scenes import random_scene
from scene_cases import bladed_disk, loose_mass, oscillator, two_dof

from service.cli import main
from solver import BranchStatus, Scene, SettingError, SolutionStatus, branch_errors, solve, sweep
from solver.continuation.branches import adaptive_harmonics as adaptive
from solver.continuation.stretches import Course

CASES = {
    "slipping": (two_dof(), 1.2),
    "separating": (two_dof(N1=200.0), 1.2),
    "disk": (bladed_disk(), 700.0),
    "disk, super-harmonic": (bladed_disk(N1=400.0), 600.0),
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("accuracy", [1e-2, 1e-4])
def test_met_and_not_by_too_much(name: str, accuracy: float):
    scene, frequency_hz = CASES[name]
    truth = solve(scene, frequency_hz=frequency_hz, harmonics=121).max_abs
    solution = solve(scene, frequency_hz=frequency_hz, accuracy=accuracy)
    assert solution.reached
    assert solution.error_estimate <= accuracy * solution.max_abs
    assert abs(solution.max_abs - truth) <= accuracy * truth
    if solution.n_harmonics > adaptive.FIRST_HARMONICS:
        fewer = solve(scene, frequency_hz=frequency_hz, harmonics=solution.n_harmonics - 1)
        assert fewer.error_estimate > accuracy * fewer.max_abs


def test_more_accuracy_takes_more_harmonics():
    scene, frequency_hz = CASES["disk"]
    counts = [solve(scene, frequency_hz=frequency_hz, accuracy=10.0**-i).n_harmonics for i in (1, 2, 3, 4)]
    assert counts == sorted(counts)
    assert counts[-1] > 2 * counts[1]


def test_random_scenes_meet_it_in_truth():
    met = []
    for seed in range(2000, 2016):
        scene, frequency_hz, _ = random_scene(seed)
        solution = solve(scene, frequency_hz=frequency_hz, accuracy=1e-3)
        assert solution.reached, seed
        truth = solve(scene, frequency_hz=frequency_hz, harmonics=61).max_abs
        met.append(abs(solution.max_abs - truth) <= 1e-3 * truth)
    assert np.mean(met) >= 0.9


def test_out_of_reach_says_so(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(adaptive, "MOST_HARMONICS", 15)
    scene, frequency_hz = CASES["disk"]
    solution = solve(scene, frequency_hz=frequency_hz, accuracy=1e-7)
    assert solution.status is SolutionStatus.ACCURACY_NOT_REACHED
    assert solution.converged
    assert not solution.reached
    assert solution.n_harmonics == 15
    assert solution.error_estimate > 1e-7 * solution.max_abs
    branch = sweep(scene, "frequency", 690.0, 710.0, accuracy=1e-7)
    assert branch.status is BranchStatus.ACCURACY_NOT_REACHED
    assert not branch.reached
    assert branch.balance.n_harmonics == 15


def test_no_solution_stays_no_solution():
    """A loose mass that ratchets away has no periodic motion, whatever the harmonics."""
    solution = solve(loose_mass(floor=30.0), frequency_hz=1.7, accuracy=1e-2)
    assert solution.status is SolutionStatus.RATCHETS
    assert math.isnan(solution.max_abs)


def test_the_range_of_a_motion_without_a_mean():
    solution = solve(loose_mass(floor=30.0, N1=0.0), frequency_hz=1.7, accuracy=1e-3)
    assert solution.reached
    fine = solve(loose_mass(floor=30.0, N1=0.0), frequency_hz=1.7, harmonics=61)
    assert solution.half_peak_to_peak == pytest.approx(fine.half_peak_to_peak, rel=1e-3)


def test_a_linear_scene_needs_the_first_harmonics_only():
    solution = solve(oscillator(k=2.0, c=0.1), frequency_hz=0.2, accuracy=1e-9)
    assert solution.reached
    assert solution.n_harmonics == adaptive.FIRST_HARMONICS
    branch = sweep(oscillator(k=2.0, c=0.1), "frequency", 0.1, 0.4, accuracy=1e-9)
    assert branch.reached
    assert branch.balance.n_harmonics == adaptive.FIRST_HARMONICS


@pytest.mark.few(3)
@pytest.mark.parametrize(
    ("scene", "accuracy"), [(two_dof(), 1e-3), (two_dof(N1=200.0), 1e-2), (bladed_disk(), 1e-2)]
)
def test_a_branch(scene: Scene, accuracy: float):
    branch = sweep(scene, accuracy=accuracy)
    assert branch.reached
    assert branch.peak is not None
    assert branch.error_estimate <= accuracy * branch.peak.value
    fine = sweep(scene, harmonics=61)
    assert fine.peak is not None
    assert abs(branch.peak.value - fine.peak.value) <= accuracy * fine.peak.value
    allowed = accuracy * np.maximum(branch.amplitude, 0.1 * branch.amplitude.max())
    indices = range(0, len(branch.values), 5)
    assert np.mean(branch_errors(branch, indices) <= allowed[list(indices)]) >= 0.9


def test_a_branch_over_another_parameter():
    branch = sweep(two_dof(), "damper.N0", 20.0, 200.0, frequency_hz=1.2, accuracy=1e-3)
    assert branch.reached
    for index in (0, len(branch.values) // 2, -1):
        scene = two_dof(N0=float(branch.values[index]))
        truth = solve(scene, frequency_hz=1.2, harmonics=61).max_abs
        assert abs(branch.amplitude[index] - truth) <= 2e-3 * truth


def test_a_stopped_branch_stays_stopped():
    assert sweep(two_dof(), accuracy=1e-3, should_stop=lambda: True).status is BranchStatus.STOPPED


@pytest.mark.parametrize("accuracy", [0.0, -1.0, 1.0, math.nan, True, "fine"])
def test_bad_accuracies(accuracy: Any):
    with pytest.raises(SettingError, match="`accuracy`"):
        solve(two_dof(), frequency_hz=1.2, accuracy=accuracy)
    with pytest.raises(SettingError, match="`accuracy`"):
        sweep(two_dof(), accuracy=accuracy)


def test_a_guess_has_its_own_harmonics():
    with pytest.raises(SettingError, match="guess"):
        sweep(two_dof(), accuracy=1e-3, course=Course(guess=np.zeros(23)))


def test_on_the_command_line(capsys: pytest.CaptureFixture[str]):
    assert main(["solve", "bladed-disk", "--frequency", "700", "--accuracy", "1e-4", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["n_harmonics"] > 11
    assert found["error_estimate"] <= 1e-4 * found["max_abs"]
    assert main(["sweep", "two-dof", "--accuracy", "1e-3", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["error_estimate"] <= 1e-3 * found["peak"]["value"]
    assert main(["solve", "two-dof", "--frequency", "1.2", "--accuracy", "2"]) == 2
    assert "--accuracy" in capsys.readouterr().err


def test_out_of_reach_on_the_command_line(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(adaptive, "MOST_HARMONICS", 15)
    assert main(["solve", "bladed-disk", "--frequency", "700", "--accuracy", "1e-7"]) == 1
    told = capsys.readouterr()
    assert "accuracy asked for was not reached" in told.err
    assert "max|x|" in told.out
