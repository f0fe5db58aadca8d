"""Amplitudes held on the flank of a peak: each row is a response, and lower than the highest peak there."""

from __future__ import annotations

import numpy as np
import pytest

import solver
from solver.continuation.extrema.kernels.peak_continuation import HEIGHT, OMEGA, P, Z
from solver.studies.peaks.minimise_peak import _PACE
from solver.studies.peaks.tracker import Tracker


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_rows_are_responses_below_the_highest_peak(way: float) -> None:
    scene = solver.load_scene("two-dof")
    path = f"{scene.contacts[0].name}.N0"
    at = scene.value(path)
    tracker = Tracker(scene, path, 0.5 * at, 2.0 * at, 5, None, _PACE)
    z = tracker.scale.inside(at)
    look = tracker.look(z)
    end = tracker.scale.high if way > 0.0 else tracker.scale.low
    tracker._hold(look, end, 0.8 * look.top, 0.02)
    (line,) = tracker.lines
    assert line.held
    assert len(line.rows) > 2
    assert np.all(np.diff(line.rows[:, Z]) > 0.0)
    np.testing.assert_allclose(line.rows[:, HEIGHT], 0.8 * 1.02 * look.top, rtol=5e-3)
    for row in line.rows[:: max(1, len(line.rows) // 4)]:
        there = scene.with_values({path: float(row[P])})
        found = solver.solve(there, frequency_hz=float(row[OMEGA]) / (2.0 * np.pi), harmonics=5)
        # Of two maxima in a period the one that was highest at first is held: the other may be higher.
        assert (1.0 - 1e-8) * row[HEIGHT] <= found.max_abs <= 1.01 * row[HEIGHT]
        assert solver.sweep(there, harmonics=5).peak.value > row[HEIGHT]
