"""The estimate of a branch covers its highest peak, also where more harmonics put it elsewhere."""

import math
import time
from pathlib import Path

import numpy as np
import pytest
from branch_error_scenes import branch_scene
from scene_cases import oscillator

import solver
from solver import solve, sweep

DEFECTS = Path(__file__).parents[3] / "data" / "defects"
FEW = (1, 3, 5, 11)
# Of what is rounding in both responses.
ROUNDING = 1e-9


@pytest.mark.parametrize("harmonics", [1, 5])
def test_a_peak_that_few_harmonics_do_not_show(harmonics: int):
    """Where 3 ω meets a resonance: 0.0815 m at 2.6278 Hz; with one harmonic 0.0308 m at the band's end."""
    scene = solver.load_scene(str(DEFECTS / "B_branch_error_6.toml"))
    branch = sweep(scene, harmonics=harmonics)
    truth = solve(scene, frequency_hz=2.6277757238, harmonics=61)
    assert truth.max_abs == pytest.approx(0.0815464, rel=1e-4)
    assert branch.peak is not None
    error = abs(branch.peak.value - truth.max_abs)
    assert error <= branch.error_estimate <= 10.0 * error


def test_a_second_peak_that_is_the_highest():
    """With three harmonics the peak at 1.4836 Hz is the highest, truly that at 1.3476 Hz is, 5.3462 m."""
    branch = sweep(branch_scene(11), harmonics=3)
    truth = solve(branch_scene(11), frequency_hz=1.3475563597, harmonics=41)
    assert branch.peak is not None
    assert truth.max_abs > 1.02 * branch.peak.value
    assert truth.max_abs <= branch.peak.value + branch.error_estimate


def coverage(seeds: range, few: tuple[int, ...], many: int, seconds: float) -> tuple[list[bool], list[float]]:
    """Whether the estimate covers the error, and estimate over error where that is not rounding."""
    covered, ratios = [], []
    for seed in seeds:
        scene, begun = branch_scene(seed), time.perf_counter()
        fine = sweep(
            scene, harmonics=many, should_stop=lambda begun=begun: time.perf_counter() - begun > seconds
        )
        if not fine.reached or fine.peak is None:
            continue
        for harmonics in few:
            branch = sweep(scene, harmonics=harmonics)
            if not branch.reached or branch.peak is None:
                continue
            error = abs(branch.peak.value - fine.peak.value)
            allowed = branch.error_estimate + fine.error_estimate + ROUNDING * fine.peak.value
            covered.append(error <= allowed)
            if error > ROUNDING * fine.peak.value and math.isfinite(branch.error_estimate):
                ratios.append(branch.error_estimate / error)
    return covered, ratios


def test_estimates_cover_the_errors_of_random_branches():
    covered, ratios = coverage(range(12, 14), (1, 3), 31, 20.0)
    assert len(covered) == 4
    assert all(covered)
    assert np.median(ratios) < 10.0


@pytest.mark.long
@pytest.mark.parametrize("harmonics", FEW)
def test_estimates_cover_the_errors_of_many_random_branches(harmonics: int):
    covered, ratios = coverage(range(200), (harmonics,), 121, 600.0)
    assert len(covered) >= 150
    assert np.mean(covered) >= 0.95
    assert np.median(ratios) < 10.0


def test_a_linear_branch_has_no_error_but_rounding():
    branch = sweep(oscillator(k=2.0, c=0.1), "frequency", 0.1, 0.4)
    assert branch.error_estimate <= 1e-14 * branch.amplitude.max()


def test_a_resonance_wider_than_its_frequency_is_high_is_followed_from_above_zero():
    """The third engine order meets, with its seventh harmonic, a mode damped by shrouds under 500 N."""
    raw = solver.load_scene("bladed-disk").to_dict()
    raw["excitation"]["engine_order"] = 3
    scene = solver.Scene.from_dict(raw).with_values({"shroud.N0": 500.0, "shroud.kt": 4e6})
    branch = solver.sweep(scene, harmonics=3)
    assert branch.reached
    assert branch.peak is not None
    true = solver.sweep(scene, harmonics=41)
    assert true.peak is not None
    assert abs(true.peak.value - branch.peak.value) <= branch.error_estimate
