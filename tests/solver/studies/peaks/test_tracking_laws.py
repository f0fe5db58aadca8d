"""Peaks followed over a parameter for the laws beside `coulomb`: against sweeps and brute force over them."""

import math
from typing import Any

import numpy as np
import pytest
from law_scene_cases import DAHL, GAP, PLANE, RUB, scene
from peak_cases import highest
from space_cases import SPACE, in_space

import optim
from optim.problem.checks import DesignError
from solver.errors import SettingError
from solver.scene.scene import Scene
from solver.studies.peaks.minimise_peak import least_peak
from solver.studies.peaks.track_peak import track_peak
from solver.studies.peaks.track_results import TrackStatus

PLAIN: dict[str, Any] = {"kt": 1.0, "mu": 0.3, "N0": 0.4}
RANGES: dict[str, tuple[Scene, str, float, float]] = {
    "elastic-normal": (scene(RUB), "c0.N0", 0.2, 20.0),
    "gap": (scene(GAP, PLAIN), "c1.N0", 0.05, 5.0),
    "coulomb-2d, box": (scene({**PLANE, "limit": "box"}), "c0.N0", 0.05, 5.0),
    "coulomb-3d": (in_space(SPACE), "c0.N0", 0.05, 20.0),
    "coulomb-3d, box": (in_space({**SPACE, "limit": "box"}), "c0.N0", 0.05, 20.0),
}


@pytest.mark.few(3)
@pytest.mark.parametrize(
    "law",
    [law if law != "coulomb-3d" else pytest.param(law, marks=pytest.mark.long) for law in RANGES],
)
def test_the_least_peak_of_a_law_is_that_of_brute_force(law: str) -> None:
    """No sweep anywhere is lower; a fine search around the least agrees to 1e-6."""
    there, path, low, high = RANGES[law]
    best = least_peak(there, path, low, high)
    assert best.status is TrackStatus.TRACKED
    assert low < best.at < high
    for value in np.geomspace(low, high, 9):
        assert highest(there, path, float(value))[0] >= best.peak * (1.0 - 1e-8)
    around = [highest(there, path, best.at * (1.0 + share))[0] for share in (-1e-4, -1e-5, 0.0, 1e-5, 1e-4)]
    assert min(around) == pytest.approx(best.peak, rel=1e-6)


@pytest.mark.few(2)
@pytest.mark.parametrize("law", ["elastic-normal", "gap", pytest.param("coulomb-3d", marks=pytest.mark.long)])
def test_a_track_of_a_law_is_the_highest_peak_of_sweeps(law: str) -> None:
    """Height and slope: the slope against differences of sweeps."""
    there, path, low, high = RANGES[law]
    track = track_peak(there, path, low, high)
    assert track.status is TrackStatus.TRACKED
    for index in range(1, track.parameter.size - 1, max(track.parameter.size // 6, 1)):
        value = float(track.parameter[index])
        assert track.peak[index] == pytest.approx(highest(there, path, value)[0], rel=1e-6)
        if any(abs(math.log(at / value)) < 1e-2 for at, _ in track.exchanges):
            continue
        step = 1e-4 * value
        sides = [highest(there, path, value + side * step)[0] for side in (-1.0, 1.0)]
        slope = (sides[1] - sides[0]) / (2.0 * step)
        assert track.slope[index] == pytest.approx(slope, rel=1e-3, abs=1e-5 * track.peak[index] / value)


@pytest.mark.long
def test_the_design_search_tracks_a_load_that_moves() -> None:
    there, path, low, high = RANGES["elastic-normal"]
    tracked = optim.design(there, variables={path: (low, high)}, method="tracked")
    searched = optim.design(there, variables={path: (low, high)}, method="minimax")
    assert tracked.peak is not None
    assert searched.peak is not None
    assert tracked.peak.value == pytest.approx(searched.peak.value, rel=1e-6)


def test_peaks_of_a_law_without_second_derivatives_are_refused() -> None:
    there = scene(DAHL)
    with pytest.raises(SettingError, match=r"no second derivatives.*c0 \(dahl\)"):
        track_peak(there, "c0.limit", 0.1, 1.0)
    with pytest.raises(DesignError, match=r"second derivatives, which c0 \(dahl\)"):
        optim.design(there, variables={"c0.limit": (0.1, 1.0)}, method="tracked")
