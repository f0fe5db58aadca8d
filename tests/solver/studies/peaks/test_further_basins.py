"""Further basins by the coarse stage: what they cost, against sweeps, and that the proof stays as it is."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from peak_cases import highest, scene_of
from random_scenes import random_scene

import optim
import solver
from solver.studies.peaks.minimise_peak import least_peak
from solver.studies.peaks.track_results import LeastPeak, TrackStatus
from solver.studies.peaks.tracker import Tracker

DISK = ("bladed-disk", "shroud.N0", 20.0, 3000.0)


@cache
def disk(basins: int) -> LeastPeak:
    name, path, low, high = DISK
    return least_peak(scene_of(name), path, low, high, basins=basins)


def test_the_second_basin_of_the_disk_is_cheap() -> None:
    best = disk(2)
    assert best.status is TrackStatus.TRACKED
    assert best.work <= 4.9  # in sweeps, which take a sixth fewer iterations than tracks were made for
    assert best.sweeps <= 3
    first, second = best.basins[:2]
    assert first.proven
    assert second.at == pytest.approx(121.8387, rel=1e-6)
    assert second.solved
    assert second.peak == pytest.approx(1.02324128e-4, rel=1e-7)


def test_a_sweep_at_the_second_basin_of_the_disk_finds_nothing_higher() -> None:
    """And it is a minimum."""
    name, path, _, _ = DISK
    second = disk(2).basins[1]
    value, _ = highest(scene_of(name), path, second.at)
    assert value == pytest.approx(second.peak, rel=1e-7)
    for factor in (0.995, 1.005):
        assert highest(scene_of(name), path, second.at * factor)[0] > value


def test_thorough_finds_the_same_two() -> None:
    name, path, low, high = DISK
    thorough = least_peak(scene_of(name), path, low, high, basins=2, thorough=True)
    assert all(basin.proven for basin in thorough.basins[:2])
    for mine, other in zip(disk(2).basins[:2], thorough.basins[:2], strict=True):
        assert mine.at == pytest.approx(other.at, rel=1e-8)
        assert mine.peak == pytest.approx(other.peak, rel=1e-8)
    assert thorough.work > 2.0 * disk(2).work


@pytest.mark.parametrize(("low", "high"), [(10.0, 500.0), (20.0, 3000.0)])
def test_one_basin_costs_no_look(low: float, high: float) -> None:
    best = least_peak(scene_of("two-dof"), "damper.N0", low, high, basins=2)
    assert best.status is TrackStatus.TRACKED
    assert best.work <= 4.0
    assert best.sweeps == 2
    assert [basin.at for basin in best.basins] == [best.at]


@pytest.mark.parametrize("basins", [2, 5])
def test_the_proof_is_that_of_one_basin(basins: int) -> None:
    one, more = disk(1), disk(basins)
    assert (more.status, more.at, more.peak, more.active) == (one.status, one.at, one.peak, one.active)
    assert more.branch is not None
    assert more.branch.balance.n_harmonics == 11


def test_a_design_of_the_disk_lists_both() -> None:
    found = optim.design(scene_of("bladed-disk"))
    assert [(basin.settled, basin.proven) for basin in found.basins] == [(True, True), (True, False)]
    places = [next(iter(basin.values.values())) for basin in found.basins]
    assert places[:2] == pytest.approx([185.460902, 121.838693], rel=1e-6)


def test_progress_counts_the_looks() -> None:
    name, path, low, high = DISK
    seen: list[tuple[float, int]] = []
    best = least_peak(
        scene_of(name), path, low, high, basins=2, on_progress=lambda share, n: seen.append((share, n))
    )
    assert seen[-1] == (1.0, best.sweeps)
    assert [share for share, _ in seen] == sorted(share for share, _ in seen)


def test_stopped_before_the_look_the_optimum_is_proven_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """The caller says stop as soon as the second sweep, which proves the optimum, is made."""
    name, path, low, high = DISK
    swept: list[solver.Branch] = []

    def sweep(*args: Any, **more: Any) -> solver.Branch:
        swept.append(solver.sweep(*args, **more))
        return swept[-1]

    monkeypatch.setattr("solver.studies.peaks.survey.sweep", sweep)
    best = least_peak(scene_of(name), path, low, high, basins=2, should_stop=lambda: len(swept) >= 2)
    assert best.status is TrackStatus.TRACKED
    assert best.sweeps == 2
    assert best.at == disk(1).at


def test_a_glance_shows_peaks_nearly_where_they_are() -> None:
    name, path, low, high = DISK
    tracker = Tracker(scene_of(name), path, low, high, 11, None)
    z = tracker.scale.inside(132.0)
    glance, look = tracker.glance(z), tracker.look(z)
    assert glance.iterations < look.branch.newton_iterations
    top = glance.crests[0]
    assert top.omega / (2.0 * np.pi) == pytest.approx(look.branch.peaks[0].at, rel=3e-3)
    assert top.value == pytest.approx(look.top, rel=1e-2)
    assert not tracker.lines
    assert tracker.follow_guess(glance, top, (tracker.scale.low, tracker.scale.high), 0.97)
    assert not tracker.follow_guess(glance, top, (tracker.scale.low, tracker.scale.high), 0.97)
    assert tracker.lines[0].heights(np.array([z]))[0] == pytest.approx(look.top, rel=1e-9)


def check_random(seed: int, points: int) -> None:
    """No proven basin is wrong, none is better than listed, and no sweep is lower than the optimum."""
    scene, _, _ = random_scene(seed)
    path, N0 = f"{scene.contacts[0].name}.N0", float(scene.contacts[0].N0)
    one = least_peak(scene, path, 0.1 * N0, 10.0 * N0, harmonics=5)
    best = least_peak(scene, path, 0.1 * N0, 10.0 * N0, harmonics=5, basins=3)
    if not one.status.proven:
        return
    assert best.status.proven
    assert best.peak == pytest.approx(one.peak, rel=1e-8)

    def top(value: float) -> float:
        branch = solver.sweep(scene.with_values({path: value}), harmonics=5)
        return branch.peak.value if branch.reached and branch.peak is not None else np.inf

    for basin in best.basins:
        if basin.proven:
            assert top(basin.at) == pytest.approx(basin.peak, rel=1e-6)
        elif basin.solved:
            assert top(basin.at) >= basin.peak * (1.0 - 1e-6)
    for value in np.geomspace(0.1 * N0, 10.0 * N0, points):
        assert top(float(value)) >= best.peak * (1.0 - 1e-7)  # as far as a proof tells heights apart


@pytest.mark.few(40)
@pytest.mark.parametrize(
    ("seed", "points"), [(13, 5), *((seed, 61) for seed in (5, 6, 10, 13, 17, 34, *range(100, 130)))]
)
def test_random_scenes(seed: int, points: int) -> None:
    check_random(seed, points)


def test_minima_that_are_not_proven_are_told_apart() -> None:
    """A peak was followed to there; a higher one may stand beside it."""
    best = least_peak(scene_of("two-dof"), "damper.N0", 60.0, 150.0, harmonics=1)
    first = best.basins[0]
    basins = (first, *(replace(first, at=at, proven=proven) for at, proven in ((70.0, True), (80.0, False))))
    told = dict(pair for block in replace(best, basins=basins).blocks() for pair in block.pairs)
    assert told["other minima"].endswith(" at 70")
    assert told["perhaps other minima"].startswith("at least ")
    assert told["perhaps other minima"].endswith(" at 80")
    assert "other minima" not in dict(pair for block in best.blocks() for pair in block.pairs)
