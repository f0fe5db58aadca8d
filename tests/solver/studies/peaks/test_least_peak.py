"""The least highest peak against brute force, its cost, its basins, and every way to end."""

import inspect
import math
from functools import cache

import numpy as np
import pytest
from peak_cases import case_a, highest, scene_of
from random_scenes import random_scene
from scene_cases import oscillator

import solver
from solver.errors import SettingError
from solver.studies.peaks.minimise_peak import least_peak
from solver.studies.peaks.survey import Allowance, sweep_within
from solver.studies.peaks.track_results import LeastPeak, TrackStatus

DESIGNS = [
    ("two-dof", "damper.N0", 10.0, 500.0),
    ("two-dof", "damper.N0", 20.0, 3000.0),
    ("bladed-disk", "shroud.N0", 20.0, 3000.0),
    ("case-a", "damper.N0", 20.0, 3000.0),
]
KNOWN = {
    "two-dof": (104.788256, 2.34617315),
    "bladed-disk": (185.460902, 1.00261561e-4),
    "case-a": (344.947138, 6.75957872),
}


@cache
def best_of(name: str, path: str, low: float, high: float) -> LeastPeak:
    return least_peak(scene_of(name), path, low, high)


@pytest.mark.parametrize(("name", "path", "low", "high"), DESIGNS)
def test_the_optimum(name: str, path: str, low: float, high: float) -> None:
    """The figures of tracking everything closely, found by other code before."""
    best = best_of(name, path, low, high)
    assert best.status is TrackStatus.TRACKED
    at, peak = KNOWN[name]
    assert best.at == pytest.approx(at, rel=1e-8)
    assert best.peak == pytest.approx(peak, rel=5e-9)


@pytest.mark.parametrize(("name", "path", "low", "high"), DESIGNS)
def test_it_costs_at_most_five_responses(name: str, path: str, low: float, high: float) -> None:
    best = best_of(name, path, low, high)
    assert best.sweeps == 2
    assert 2.0 < best.work < 5.0


@pytest.mark.parametrize(("name", "path", "low", "high"), DESIGNS)
def test_no_sweep_nearby_is_lower(name: str, path: str, low: float, high: float) -> None:
    best = best_of(name, path, low, high)
    for share in (-1e-2, -1e-3, -1e-4, -1e-5, -1e-6, 0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2):
        value, _ = highest(scene_of(name), path, best.at * (1.0 + share))
        assert value >= best.peak * (1.0 - 1e-8)


@pytest.mark.parametrize("points", [16, pytest.param(241, marks=pytest.mark.long)])
@pytest.mark.parametrize(("name", "path", "low", "high"), DESIGNS)
def test_no_sweep_anywhere_is_lower(name: str, path: str, low: float, high: float, points: int) -> None:
    best = best_of(name, path, low, high)
    for value in np.geomspace(low, high, points):
        assert highest(scene_of(name), path, float(value))[0] >= best.peak * (1.0 - 1e-8)


@pytest.mark.parametrize(("name", "path", "low", "high"), DESIGNS)
def test_the_branch_at_the_optimum_needs_no_other_sweep(
    name: str, path: str, low: float, high: float
) -> None:
    best = best_of(name, path, low, high)
    assert best.branch is not None
    assert best.branch.reached
    assert best.branch.balance.scene.value(path) == best.at
    assert best.branch.peak is not None
    assert best.branch.peak.value == pytest.approx(best.peak, rel=1e-9)
    assert best.branch.band is not None
    for active in best.active:
        distances = [abs(peak.at - active.frequency) for peak in best.branch.peaks]
        assert min(distances) < 1e-6 * active.frequency


def test_the_disk_s_two_peaks_are_equally_high() -> None:
    best = best_of("bladed-disk", "shroud.N0", 20.0, 3000.0)
    assert [peak.value for peak in best.active] == pytest.approx([best.peak] * 2, rel=1e-10)
    assert [peak.frequency for peak in best.active] == pytest.approx([753.279, 765.750], abs=1e-3)
    assert min(peak.slope for peak in best.active) < 0.0 < max(peak.slope for peak in best.active)


@pytest.mark.few(3)
@pytest.mark.parametrize("first", [20.0, 60.0, 100.0, 150.0, 400.0, 1000.0, 3000.0])
def test_it_does_not_depend_on_where_the_first_sweep_is(first: float) -> None:
    best = least_peak(scene_of("bladed-disk"), "shroud.N0", 20.0, 3000.0, first=first)
    assert best.status is TrackStatus.TRACKED
    assert best.peak == pytest.approx(1.002615614e-4, rel=1e-8)
    assert best.at == pytest.approx(185.460902, rel=1e-8)


OTHERS = [
    ("two-dof", "damper.kt", 10.0, 80.0),
    ("two-dof", "damper.mu", 0.05, 2.0),
    ("two-dof", "damper.N1_ratio", 0.0, 1.4),
    ("two-dof", "excitation.amplitude", 40.0, 300.0),
    ("bladed-disk", "shroud.kt", 3e6, 8e6),
    ("bladed-disk", "shroud.mu", 0.05, 2.0),
    ("bladed-disk", "root.N0", 50.0, 5000.0),
    ("case-a", "structure.coupling", 10.0, 40.0),
]


@pytest.mark.few(4)
@pytest.mark.parametrize("points", [15, pytest.param(121, marks=pytest.mark.long)])
@pytest.mark.parametrize(("name", "path", "low", "high"), OTHERS)
def test_other_parameters_against_brute_force(
    name: str, path: str, low: float, high: float, points: int
) -> None:
    best = least_peak(scene_of(name), path, low, high)
    assert best.status.proven
    assert highest(scene_of(name), path, best.at)[0] == pytest.approx(best.peak, rel=1e-8)
    spaced = np.geomspace if low > 0.0 else np.linspace
    for value in spaced(low, high, points):
        assert highest(scene_of(name), path, float(value))[0] >= best.peak * (1.0 - 1e-8)


def test_two_peaks_close_beside_each_other() -> None:
    """Under a constant load two peaks of the disk, 0.2 Hz apart, are equally high in a sharp minimum.

    Following in long steps passes from one to the other unseen, and cubics hide the minimum between rows.
    """
    scene = scene_of("bladed-disk").with_values({"shroud.N1_ratio": 0.0})
    best = least_peak(scene, "shroud.N0", 20.0, 3000.0)
    assert best.status is TrackStatus.TRACKED
    assert best.at == pytest.approx(552.283, abs=1e-2)
    assert best.peak == pytest.approx(9.7768092e-5, rel=1e-7)
    slopes = [peak.slope for peak in best.active]
    assert min(slopes) < 0.0 < max(slopes)
    for value in np.geomspace(20.0, 3000.0, 21):
        assert highest(scene, "shroud.N0", float(value))[0] >= best.peak * (1.0 - 1e-8)


@pytest.mark.few(3)
@pytest.mark.parametrize("points", [13, pytest.param(81, marks=pytest.mark.long)])
@pytest.mark.parametrize("ratio", [0.6, 1.5, 2.5])
def test_loads_that_vary_as_far_as_separation(ratio: float, points: int) -> None:
    """Many peaks, high and narrow: where lines only have to be high enough no cubic may dip below that."""
    scene = scene_of("bladed-disk").with_values({"shroud.N1_ratio": ratio})
    best = least_peak(scene, "shroud.N0", 20.0, 3000.0)
    assert best.status is TrackStatus.TRACKED
    assert best.sweeps <= 12
    for value in np.geomspace(20.0, 3000.0, points):
        assert highest(scene, "shroud.N0", float(value))[0] >= best.peak * (1.0 - 1e-8)


def check_random(seed: int, points: int) -> None:
    """The load of the first contact over two decades against a grid."""
    scene, _, _ = random_scene(seed)
    contact = scene.contacts[0]
    path, N0 = f"{contact.name}.N0", float(contact.N0)
    best = least_peak(scene, path, 0.1 * N0, 10.0 * N0, harmonics=5)
    if not best.status.proven:
        assert best.status in (TrackStatus.UNPROVEN, TrackStatus.OTHER_BRANCH)
        return
    for value in np.geomspace(0.1 * N0, 10.0 * N0, points):
        branch = solver.sweep(scene.with_values({path: float(value)}), harmonics=5)
        if branch.reached:
            assert branch.peak is not None
            assert branch.peak.value >= best.peak * (1.0 - 1e-8)


@pytest.mark.few(keep=(2,))
@pytest.mark.parametrize(
    ("seed", "points"),
    [*((seed, 13) for seed in (2, 8, 14, 30, 34, 37, 48, 72)), *((seed, 41) for seed in range(100, 140))],
)
def test_random_scenes_against_brute_force(seed: int, points: int) -> None:
    check_random(seed, points)


def test_the_optimum_is_the_first_basin() -> None:
    best = best_of("bladed-disk", "shroud.N0", 20.0, 3000.0)
    assert best.basins[0].at == best.at
    assert best.basins[0].peak == best.peak
    assert best.basins[0].solved
    assert best.basins[0].proven


def test_thorough_checks_basins_by_sweeps() -> None:
    """The bladed disk has a second minimum near 110 N, where other peaks are equally high."""
    best = least_peak(scene_of("bladed-disk"), "shroud.N0", 20.0, 3000.0, basins=4, thorough=True)
    assert best.peak == pytest.approx(1.002615614e-4, rel=1e-8)
    assert [basin.peak for basin in best.basins] == sorted(basin.peak for basin in best.basins)
    proven = [basin for basin in best.basins if basin.proven]
    assert len(proven) >= 2
    for basin in proven:
        scene = scene_of("bladed-disk")
        value, _ = highest(scene, "shroud.N0", basin.at)
        assert value == pytest.approx(basin.peak, rel=1e-7)
        for factor in (0.995, 1.005):
            assert highest(scene, "shroud.N0", basin.at * factor)[0] > value


def test_a_peak_that_does_not_depend_on_the_parameter() -> None:
    """Without friction no normal load changes anything."""
    best = least_peak(case_a().with_values({"damper.mu": 0.0}), "damper.N0", 20.0, 3000.0)
    assert best.status is TrackStatus.FLAT
    assert best.status.proven
    assert 20.0 <= best.at <= 3000.0
    assert best.sweeps == 1
    assert best.branch is not None
    assert best.peak == pytest.approx(
        highest(case_a().with_values({"damper.mu": 0.0}), "damper.N0", 33.0)[0], rel=1e-9
    )


@pytest.mark.parametrize(("low", "high", "end"), [(20.0, 80.0, 80.0), (500.0, 1000.0, 500.0)])
def test_an_optimum_at_a_bound_says_so(low: float, high: float, end: float) -> None:
    best = least_peak(case_a(), "damper.N0", low, high)
    assert best.status is TrackStatus.AT_BOUND
    assert best.status.proven
    assert "wider" in best.status.value
    assert best.at == end
    assert best.peak == pytest.approx(highest(case_a(), "damper.N0", end)[0], rel=1e-9)


def test_no_response_says_so() -> None:
    """An undamped mass driven at its resonance from the beginning of the band on has no bounded motion."""
    scene = oscillator({"kt": 0.3, "mu": 0.3, "N0": 0.5}, k=1.0)
    observe = scene.observe.model_copy(update={"band": (1.0 / (2.0 * math.pi), 0.3)})
    best = least_peak(scene.model_copy(update={"observe": observe}), "damper.N0", 0.1, 0.6, harmonics=3)
    assert best.status is TrackStatus.UNDAMPED
    assert not best.status.proven
    assert math.isnan(best.at)
    assert best.sweeps == 5


def test_progress_and_stop() -> None:
    seen: list[tuple[float, int]] = []
    best = least_peak(
        case_a(), "damper.N0", 20.0, 3000.0, on_progress=lambda share, count: seen.append((share, count))
    )
    assert seen[0][1] == 1
    assert seen[-1] == (1.0, best.sweeps)
    assert [share for share, _ in seen] == sorted(share for share, _ in seen)


def test_stopped_before_the_first_sweep() -> None:
    best = least_peak(case_a(), "damper.N0", 20.0, 3000.0, should_stop=lambda: True)
    assert best.status is TrackStatus.STOPPED
    assert not best.status.proven
    assert math.isnan(best.peak)
    assert best.basins == ()
    assert best.branch is None
    assert best.work == 0.0
    assert best.to_json()["peak"] is None


def test_stopped_before_the_proof() -> None:
    """What was followed is told, but not as proven."""
    seen: list[int] = []
    best = least_peak(
        case_a(), "damper.N0", 20.0, 3000.0, on_progress=lambda _share, count: seen.append(count),
        should_stop=lambda: bool(seen),
    )  # fmt: skip
    assert best.status is TrackStatus.STOPPED
    assert best.sweeps == 1
    assert best.branch is None
    assert not any(basin.proven for basin in best.basins)
    assert best.peak <= highest(case_a(), "damper.N0", best.at)[0] * (1.0 + 1e-8)


def test_a_response_that_takes_far_longer_is_given_up_with_all_its_work(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It has no peaks to be followed; one that takes as long as others has those of a sweep."""
    allowance, scene = Allowance(None), scene_of("bladed-disk")
    whole = sweep_within(scene, 11, None, allowance)
    assert whole.reached
    assert [peak.value for peak in whole.peaks] == [peak.value for peak in solver.sweep(scene).peaks]
    allowance.measure([1])
    monkeypatch.setattr("solver.studies.peaks.survey.LONGEST", 0.1)
    short = sweep_within(scene, 11, None, allowance)
    assert not short.reached
    assert not short.peaks
    assert allowance.longest < short.newton_iterations <= whole.newton_iterations


@pytest.mark.parametrize("basins", [0, -1, 1.5, True])
def test_a_number_of_basins_that_is_none_is_refused(basins: object) -> None:
    with pytest.raises(SettingError, match="basins"):
        least_peak(case_a(), "damper.N0", 20.0, 3000.0, basins=basins)  # type: ignore[arg-type]


def test_it_is_public() -> None:
    assert inspect.unwrap(solver.least_peak) is inspect.unwrap(least_peak)
    assert solver.Basin.__name__ == "Basin"
