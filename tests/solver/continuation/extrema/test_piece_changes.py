"""Small maxima where contacts change the pieces of their laws, judged by points solved each by itself."""

import numpy as np
import pytest
from light_points import PointSolver
from light_scenes import light_scene

import solver

# Seed of a lightly damped scene, and a stretch of frequencies in Hz in which contacts change what they do: a
# resonance crosses while one begins to slip, a mean moves over before one is stuck, a mean changes its side.
STRETCHES = [(617, 2.15602, 2.15607), (736, 91.709, 91.7115), (801, 1.3222, 1.3232)]
POINTS = 401


def maxima(hz: np.ndarray, amplitude: np.ndarray) -> list[tuple[float, float]]:
    """Frequencies and heights of the maxima that stand out by a thousandth from what is beside them."""
    found = []
    for i in range(1, hz.size - 1):
        if amplitude[i - 1] < amplitude[i] >= amplitude[i + 1]:
            dips = amplitude[: i + 1].min(), amplitude[i:].min()
            if max(dips) < (1.0 - 1e-3) * amplitude[i]:
                found.append((float(hz[i]), float(amplitude[i])))
    return found


def check(branch: solver.Branch, expected: list[tuple[float, float]], apart: float) -> None:
    assert expected
    assert branch.peak_certificate.known
    for at, value in expected:
        near = [peak for peak in branch.peaks if abs(peak.at - at) <= 2.0 * apart]
        assert near, f"no peak at {at} Hz"
        # A point of the grid may be below a corner; maxima of 1e-4 beside a change are left.
        assert max(peak.value for peak in near) == pytest.approx(value, rel=3e-4)
        assert max(peak.value for peak in near) > value * (1.0 - 1e-4)


@pytest.mark.parametrize("downwards", [False, True])
@pytest.mark.parametrize(("seed", "low", "high"), STRETCHES)
def test_a_maximum_between_two_points_of_the_continuation(seed, low, high, downwards):
    scene, _, harmonics = light_scene(seed)
    hz = np.linspace(low, high, POINTS)
    expected = maxima(hz, PointSolver(scene, harmonics).amplitudes(hz))
    start, stop = scene.observe.band[::-1] if downwards else scene.observe.band
    branch = solver.sweep(scene, start=start, stop=stop, harmonics=harmonics)
    check(branch, expected, hz[1] - hz[0])


def test_a_maximum_where_blades_begin_to_slip_one_after_the_other():
    raw = solver.load_scene("bladed-disk").to_dict()
    raw["structure"]["sectors"] = 3
    raw["observe"]["band"] = [700.0, 820.0]
    disk = solver.mistuned(solver.Scene.from_dict(raw), of="tip", values=[1.0, 1.02, 0.97])
    raw = disk.to_dict()
    raw["observe"]["dof"] = "tip@2"
    scene = solver.Scene.from_dict(raw)
    hz = np.linspace(742.66, 742.74, 81)
    amplitude = [solver.solve(scene, frequency_hz=float(f), harmonics=3).max_abs for f in hz]
    expected = maxima(hz, np.array(amplitude))
    check(solver.sweep(scene, harmonics=3), expected, hz[1] - hz[0])
