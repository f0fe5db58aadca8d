"""The estimated error of a performance curve against whole responses, and its gradient by differences."""

import math
import sys

import numpy as np
import pytest

import solver
from solver.modes.peaks.peak_correction import corrected_peak, peak_at_excitation
from solver.modes.peaks.performance import performance_over
from tests.cases.random_scenes import random_scene

LEVEL = "excitation.amplitude"
TOLERANCE = 0.05


def _exact(scene: solver.Scene, factor: float, harmonics: int) -> float:
    branch = solver.sweep(scene.with_values({LEVEL: factor * scene.value(LEVEL)}), harmonics=harmonics)
    return branch.peak.value if branch.reached and branch.peak is not None else math.nan


def test_the_correction_is_the_peak_of_the_whole_response() -> None:
    scene = solver.load_scene("two-dof")
    curve = performance_over(scene, (0.3, 4.0), harmonics=5)
    for factor in (0.6, 1.4):
        found, exact = corrected_peak(curve, factor), _exact(scene, factor, 5)
        assert abs(found.synthesised / exact - 1.0) > 5e-3
        assert found.peak == pytest.approx(exact, rel=1e-3)


def test_the_gradient_is_that_of_differences() -> None:
    scene = solver.load_scene("two-dof")
    paths = ("damper.N0", "damper.kt", "structure.k1")

    def peak(values: dict[str, float]) -> float:
        there = scene.with_values(values)
        return peak_at_excitation(performance_over(there, (0.5, 1.0), 1, harmonics=3), 0.9).peak

    found = peak_at_excitation(performance_over(scene, (0.5, 1.0), 1, harmonics=3), 0.9, paths)
    for path, slope in zip(paths, found.gradient, strict=True):
        value = scene.value(path)
        step = 1e-4 * value
        wanted = (peak({path: value + step}) - peak({path: value - step})) / (2.0 * step)
        assert slope == pytest.approx(wanted, rel=1e-5)


@pytest.mark.long
def test_how_often_the_verdict_is_right_over_random_scenes() -> None:
    """Counts of verdicts at 5 %: right, wrong either way, and not known, which counts as no."""
    right = wrong = unknown = unseen = 0
    for seed in range(1, 61):
        scene, _, _ = random_scene(seed)
        try:
            curve = performance_over(scene, (0.2, 5.0), harmonics=5)
            verdicts = [(f, corrected_peak(curve, f)) for f in (0.3, 1.0, 3.0)]
        except solver.SettingError:  # a scene whose excitation drives no mode of its band
            continue
        for factor, found in verdicts:
            exact = _exact(scene, factor, 5)
            if not math.isfinite(exact) or not math.isfinite(found.synthesised):
                unseen += 1
                continue
            holds = abs(found.synthesised / exact - 1.0) <= TOLERANCE
            if not math.isfinite(found.peak):
                unknown += 1
            elif found.suffices(TOLERANCE) == holds:
                right += 1
            else:
                wrong += 1
    counts = f"right {right}, wrong {wrong}, not known {unknown}, no curve or response {unseen}"
    sys.stdout.write(f"verdicts of 60 random scenes: {counts}\n")
    known = right + wrong
    assert known >= 60
    assert right / known >= 0.85
    assert np.isfinite(known)
