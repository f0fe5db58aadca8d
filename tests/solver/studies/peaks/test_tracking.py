"""Tracked peaks against sweeps, differences, the design search and published optima; every way to end."""

import math
from functools import cache

import numpy as np
import pytest
from peak_cases import case_a, highest, scene_of

import optim
import solver
from solver.errors import SettingError
from solver.studies.peaks.minimise_peak import least_peak
from solver.studies.peaks.track_peak import track_peak
from solver.studies.peaks.track_results import TrackStatus


@cache
def tracked(name: str, path: str, start: float, stop: float) -> solver.PeakTrack:
    return track_peak(scene_of(name), path, start, stop)


def is_exchange(track: solver.PeakTrack, value: float, within: float) -> bool:
    """Whether two peaks are equally high about there: which one leads, and the slope, then jump."""
    return any(abs(at - value) <= within * abs(value) for at, _ in track.exchanges)


RANGES = [
    ("case-a", "damper.N0", 10.0, 1500.0),
    ("two-dof", "damper.N0", 10.0, 1500.0),
    ("bladed-disk", "shroud.N0", 20.0, 3000.0),
]


def test_optimum_of_constant_load_as_other_codes_find_it() -> None:
    """Brute force with two public codes: 345 to 346 N, peak 6.7597 at 1.0869 Hz."""
    best = least_peak(case_a(), "damper.N0", 10.0, 1500.0)
    assert best.status is TrackStatus.TRACKED
    assert 344.9 < best.at < 346.0
    assert best.peak == pytest.approx(6.7596, abs=1e-4)
    assert best.active[0].frequency == pytest.approx(1.0869, abs=2e-4)


@pytest.mark.parametrize(("name", "path", "low", "high"), RANGES)
def test_optimum_is_that_of_the_design_search(name: str, path: str, low: float, high: float) -> None:
    best = least_peak(scene_of(name), path, low, high)
    design = optim.design(scene_of(name), variables={path: (low, high)})
    assert best.status is TrackStatus.TRACKED
    assert design.peak is not None
    assert best.peak <= design.peak.value * (1.0 + 1e-8)
    assert best.peak == pytest.approx(design.peak.value, rel=1e-7)
    assert best.at == pytest.approx(design.optimum[path], rel=1e-3)


@pytest.mark.parametrize(("name", "path", "low", "high"), RANGES)
def test_optimum_is_stationary_or_balanced(name: str, path: str, low: float, high: float) -> None:
    """One peak whose derivative is 0, or two equally high of opposite slopes; and no neighbour is lower."""
    best = least_peak(scene_of(name), path, low, high)
    slopes = [peak.slope for peak in best.active]
    if len(slopes) == 1:
        assert abs(slopes[0]) * best.at < 1e-6 * best.peak
    else:
        assert min(slopes) < 0.0 < max(slopes)
    assert highest(scene_of(name), path, best.at)[0] == pytest.approx(best.peak, rel=1e-9)
    for factor in (0.5, 0.9, 0.99, 0.999, 1.001, 1.01, 1.1, 2.0):
        assert highest(scene_of(name), path, best.at * factor)[0] >= best.peak * (1.0 - 1e-10)


def test_the_bladed_disk_s_two_peaks_are_equally_high() -> None:
    best = least_peak(solver.load_scene("bladed-disk"), "shroud.N0", 20.0, 3000.0)
    assert [peak.frequency for peak in best.active] == pytest.approx([753.28, 765.75], abs=0.01)
    assert best.at == pytest.approx(185.461, abs=1e-3)
    assert best.peak == pytest.approx(0.10026156e-3, rel=1e-7)


def test_the_least_does_not_depend_on_where_the_first_sweep_is() -> None:
    places = [
        least_peak(case_a(), "damper.N0", 10.0, 1500.0, first=N0).at for N0 in (10.0, 60.0, 345.0, 1500.0)
    ]
    assert places == pytest.approx([places[0]] * 4, rel=1e-8)


@pytest.mark.parametrize(("name", "path", "start", "stop"), RANGES)
def test_every_point_is_the_highest_peak_of_a_sweep(name: str, path: str, start: float, stop: float) -> None:
    track = tracked(name, path, start, stop)
    assert track.status is TrackStatus.TRACKED
    assert track.parameter[0] == pytest.approx(start)
    assert track.parameter[-1] == pytest.approx(stop)
    assert (np.diff(track.parameter) >= 0.0).all()
    for index in range(0, track.parameter.size, max(track.parameter.size // 6, 1)):
        value, at = highest(scene_of(name), path, float(track.parameter[index]))
        assert track.peak[index] == pytest.approx(value, rel=1e-8)
        if not is_exchange(track, float(track.parameter[index]), 1e-6):
            assert track.frequency[index] == pytest.approx(at, rel=1e-5)


@pytest.mark.parametrize(("name", "path", "start", "stop"), RANGES)
def test_nothing_higher_between_the_points(name: str, path: str, start: float, stop: float) -> None:
    """At values no one asked for: sweeps lie on the cubics through the tracked points."""
    track = tracked(name, path, start, stop)
    rng = np.random.default_rng(4)
    for value in np.exp(rng.uniform(math.log(start), math.log(stop), 12)):
        right = int(np.clip(np.searchsorted(track.parameter, value), 1, track.parameter.size - 1))
        ends = track.peak[[right - 1, right]]
        length = track.parameter[right] - track.parameter[right - 1]
        curve = 0.25 * length * np.abs(np.diff(track.slope[[right - 1, right]]))[0]
        found = highest(scene_of(name), path, float(value))[0]
        assert ends.min() - curve - 1e-9 * ends.max() <= found <= ends.max() + curve + 1e-9 * ends.max()


@pytest.mark.parametrize(("name", "path", "start", "stop"), RANGES)
def test_slopes_against_differences_of_sweeps(name: str, path: str, start: float, stop: float) -> None:
    track = tracked(name, path, start, stop)
    exchanges = np.array([at for at, _ in track.exchanges])
    checked = 0
    for index in range(2, track.parameter.size - 2, max(track.parameter.size // 8, 1)):
        value = float(track.parameter[index])
        step = 1e-4 * value
        if exchanges.size and np.abs(exchanges - value).min() < 5.0 * step:
            continue
        ends = [highest(scene_of(name), path, value + way * step)[0] for way in (-1.0, 1.0)]
        difference = (ends[1] - ends[0]) / (2.0 * step)
        assert track.slope[index] == pytest.approx(difference, rel=2e-3, abs=1e-5 * track.peak[index] / value)
        checked += 1
    assert checked >= 5


def test_a_peak_at_a_corner() -> None:
    """Where the contact just begins to slip the slope jumps, and the peak can sit on the corner."""
    track = tracked("two-dof", "damper.N0", 10.0, 1500.0)
    scene = scene_of("two-dof")
    for N0 in (600.0, 800.0, 1000.0):
        value, at = highest(scene, "damper.N0", N0)
        right = int(np.searchsorted(track.parameter, N0))
        left = right - 1
        below, above = (
            highest(scene.with_values({"damper.N0": N0}), "damper.N0", N0 * x)[0] for x in (0.999, 1.001)
        )
        slope = (above - below) / (0.002 * N0)
        assert min(track.slope[left], track.slope[right]) - 0.3 * abs(slope) < slope
        assert slope < max(track.slope[left], track.slope[right]) + 0.3 * abs(slope)
        assert track.peak[left] < value < track.peak[right]
        assert track.frequency[left] < at < track.frequency[right]


OTHERS = [
    ("two-dof", "damper.kt", 10.0, 80.0),
    ("two-dof", "damper.mu", 0.1, 1.0),
    ("two-dof", "damper.N1_ratio", 0.0, 1.4),
    ("two-dof", "damper.N1_phase", -1.0, 1.0),
    ("two-dof", "excitation.amplitude", 40.0, 300.0),
    ("bladed-disk", "shroud.kt", 3e6, 8e6),
    ("case-a", "structure.coupling", 10.0, 40.0),
]


@pytest.mark.few(3)
@pytest.mark.parametrize(("name", "path", "start", "stop"), OTHERS)
def test_other_parameters(name: str, path: str, start: float, stop: float) -> None:
    """Friction, stiffness, the ratio of the varying load, its phase, the level, a spring of the structure."""
    track = track_peak(scene_of(name), path, start, stop)
    assert track.status is TrackStatus.TRACKED
    for index in range(0, track.parameter.size, max(track.parameter.size // 5, 1)):
        value = highest(scene_of(name), path, float(track.parameter[index]))[0]
        assert track.peak[index] == pytest.approx(value, rel=1e-8)
    middle = track.parameter.size // 2
    while is_exchange(track, float(track.parameter[middle]), 1e-3):
        middle -= 1
    at = float(track.parameter[middle])
    step = 1e-4 * (abs(at) + 0.01 * (stop - start))
    below, above = (highest(scene_of(name), path, at + way * step)[0] for way in (-1.0, 1.0))
    slope = (above - below) / (2.0 * step)
    assert track.slope[middle] == pytest.approx(
        slope, rel=2e-3, abs=1e-5 * track.peak[middle] / (stop - start)
    )


def test_both_directions_agree() -> None:
    there, back = (tracked("case-a", "damper.N0", *ends) for ends in ((10.0, 1500.0), (1500.0, 10.0)))
    assert back.parameter[0] == 1500.0
    assert back.parameter[-1] == 10.0
    assert back.optimum.at == pytest.approx(there.optimum.at, rel=1e-9)
    assert back.peak[[0, -1]] == pytest.approx(there.peak[[-1, 0]], rel=1e-10)
    assert (np.diff(back.parameter) <= 0.0).all()


def test_the_level_scales_as_the_load() -> None:
    """Homogeneous of degree one: the optimum N0 is proportional to the excitation."""
    one = least_peak(case_a(), "damper.N0", 10.0, 1500.0)
    scene = case_a().with_values({"excitation.amplitude": 250.0})
    other = least_peak(scene, "damper.N0", 25.0, 3750.0)
    assert other.at == pytest.approx(2.5 * one.at, rel=1e-8)
    assert other.peak == pytest.approx(2.5 * one.peak, rel=1e-9)


def test_exchanges_are_where_two_peaks_are_equal() -> None:
    track = tracked("bladed-disk", "shroud.N0", 20.0, 3000.0)
    assert any(at == pytest.approx(track.optimum.at, rel=1e-8) for at, _ in track.exchanges)
    for at, peak in track.exchanges:
        branch = solver.sweep(scene_of("bladed-disk").with_values({"shroud.N0": at}))
        assert branch.peaks[0].value == pytest.approx(peak, rel=1e-7)
        assert branch.peaks[1].value == pytest.approx(peak, rel=1e-7)


def test_an_end_of_the_band_counts() -> None:
    """Below the resonance the highest amplitude is at the upper end of the band, whatever the load."""
    scene = case_a().model_copy(update={"observe": case_a().observe.model_copy(update={"band": (0.3, 0.7)})})
    track = track_peak(scene, "damper.N0", 50.0, 400.0)
    assert track.status is TrackStatus.TRACKED
    assert track.frequency == pytest.approx(0.7, rel=1e-9)
    assert any(line.at_band_end for line in track.competing)
    for index in (0, track.parameter.size // 2):
        value = highest(scene, "damper.N0", float(track.parameter[index]))[0]
        assert track.peak[index] == pytest.approx(value, rel=1e-9)


def test_json_has_the_keys_of_the_command() -> None:
    found = tracked("case-a", "damper.N0", 10.0, 1500.0).to_json()
    assert {"parameter", "peak", "frequency", "seconds", "slope", "optimum", "competing", "status"} <= set(
        found
    )
    assert len(found["parameter"]) == len(found["peak"]) == len(found["frequency"])  # type: ignore[arg-type]


def test_stopped_by_the_caller() -> None:
    seen: list[tuple[float, int]] = []
    track = track_peak(
        case_a(), "damper.N0", 50.0, 400.0, should_stop=lambda: bool(seen),
        on_progress=lambda share, count: seen.append((share, count)),
    )  # fmt: skip
    assert track.status is TrackStatus.STOPPED
    assert not track.reached
    assert seen[0][1] == 1


@pytest.mark.parametrize(
    ("path", "start", "stop", "more", "word"),
    [
        ("frequency", 1.0, 2.0, {}, "frequency"),
        ("damper.N9", 1.0, 2.0, {}, "N9"),
        ("damper.N0", 100.0, 100.0, {}, "differ"),
        ("damper.N0", -1.0, 100.0, {}, "-1.0"),
        ("damper.N0", 1.0, math.nan, {}, "nan"),
        ("damper.N0", 1.0, 100.0, {"checks": -1}, "checks"),
        ("damper.N0", 1.0, 100.0, {"harmonics": -2}, "harmonics"),
    ],
)
def test_bad_input_is_refused(path: str, start: float, stop: float, more: dict[str, int], word: str) -> None:
    with pytest.raises(SettingError, match=word):
        track_peak(case_a(), path, start, stop, **more)


def test_a_first_sweep_outside_the_range_is_refused() -> None:
    with pytest.raises(SettingError, match="first"):
        least_peak(case_a(), "damper.N0", 10.0, 100.0, first=200.0)
