"""Sweeps over rigid contacts: Den Hartog's closed form, single solves from rest, `march`, brute force."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar
from test_rigid import one_mass, pressed, random_scene, with_stops, without_stops

import stickslip
from solver.continuation.branch import Branch
from stickslip.lab.proofs.exact.exact_branch import ExactBranch
from solver.results.known import Stable
from solver.studies.peaks.track_peak import track_peak


def damped(F: float, c: float) -> stickslip.Scene:
    """The mass of Den Hartog with a dashpot."""
    raw = one_mass(F).to_dict()
    raw["structure"]["springs"][0]["c"] = c
    return stickslip.Scene.from_dict(raw)


def amplitude(hz: float, F: float) -> float:
    return without_stops(2.0 * math.pi * hz, F)


@pytest.mark.few(3)
@pytest.mark.parametrize(("F", "low", "high"), [(0.2, 0.6, 0.95), (0.4, 1.08, 1.6), (0.6, 0.75, 0.9)])
def test_every_point_is_den_hartogs(F: float, low: float, high: float) -> None:
    """Both ways; the band ends where his amplitude is the limit."""
    start, stop = (each / (2.0 * math.pi) for each in (low, high))
    limit = 0.5 * (amplitude(start, F) + amplitude(stop, F))
    edge = brentq(lambda hz: amplitude(hz, F) - limit, start, stop, xtol=1e-15)
    for begin, end in ((start, stop), (stop, start)):
        found = stickslip.sweep(one_mass(F), start=begin, stop=end, limit=limit)
        assert isinstance(found, ExactBranch)
        assert found.reached
        assert found.values[0] == begin
        assert found.values[-1] == end
        assert found.amplitude == pytest.approx([amplitude(hz, F) for hz in found.values], rel=1e-10)
        assert found.band is not None
        assert [each.at for each in found.band.edges] == pytest.approx([edge], rel=1e-9)
        assert found.peak is not None
        assert found.peak.value == pytest.approx(max(amplitude(start, F), amplitude(stop, F)), rel=1e-10)
        assert not found.peak.interior
        # nothing is stepped over: straight lines between the points lie near the curve
        ascending = np.argsort(found.values)
        between = np.linspace(min(begin, end), max(begin, end), 200)
        straight = np.interp(between, found.values[ascending], found.amplitude[ascending])
        exact = np.array([amplitude(hz, F) for hz in between])
        assert np.abs(straight - exact).max() < 0.03 * exact.max()


def test_over_another_parameter() -> None:
    """Over the load at a fixed frequency, with stops and without."""
    b = 1.5
    found = stickslip.sweep(one_mass(0.2), "f.N0", 0.3, 0.75, frequency_hz=b / (2.0 * math.pi))
    assert found.reached
    assert found.band is None
    assert found.amplitude[0] == pytest.approx(without_stops(b, 0.3), rel=1e-10)
    assert found.amplitude[-1] == pytest.approx(with_stops(b, 0.75), rel=1e-10)
    with pytest.raises(stickslip.SettingError, match="frequency_hz"):
        stickslip.sweep(one_mass(0.2), "f.N0", 0.3, 0.75)


def test_a_resonance_without_damping_ends_the_branch() -> None:
    found = stickslip.sweep(one_mass(0.4), start=0.155, stop=0.17)
    assert found.status is stickslip.branches.BranchStatus.UNDAMPED
    assert found.values[-1] < 0.5 / math.pi
    assert found.bifurcations.marks[-1].why == found.status.value


def test_friction_above_a_quarter_of_pi_of_the_force_bounds_it() -> None:
    bounded = stickslip.sweep(one_mass(0.8), start=0.17, stop=0.2)
    assert bounded.reached
    assert bounded.amplitude[-1] == pytest.approx(with_stops(0.4 * math.pi, 0.8), rel=1e-10)
    i = int(np.argmax(bounded.amplitude))
    marched = stickslip.march(one_mass(0.8), frequency_hz=float(bounded.values[i]))
    near = 5e-5 + 3.0 * marched.error_estimate
    assert bounded.amplitude[i] == pytest.approx(marched.max_abs, rel=near)


@pytest.mark.few(2)
@pytest.mark.parametrize(
    ("scene", "low", "high"), [(damped(0.7, 0.1), 0.1, 0.2), (damped(0.4, 0.02), 0.13, 0.19)]
)
def test_the_highest_peak_is_the_maximum_of_single_solves(
    scene: stickslip.Scene, low: float, high: float
) -> None:
    """Brute force: each of its responses is found from rest."""
    found = stickslip.sweep(scene, start=low, stop=high)
    assert found.peak is not None
    assert found.peak.interior

    def lower(hz: float) -> float:
        return -stickslip.solve(scene, frequency_hz=float(hz)).max_abs

    grid = np.linspace(low, high, 31)
    i = int(np.argmin([lower(hz) for hz in grid]))
    best = minimize_scalar(
        lower, bounds=(grid[i - 1], grid[i + 1]), method="bounded", options={"xatol": 1e-9}
    )
    assert found.peak.value == pytest.approx(-best.fun, rel=1e-9)
    assert found.peak.at == pytest.approx(best.x, rel=1e-5)
    marched = stickslip.march(scene, frequency_hz=found.peak.at)
    assert found.peak.value == pytest.approx(marched.max_abs, rel=1e-4)
    assert found.band is not None
    for edge in found.band.edges:
        there = stickslip.solve(scene, frequency_hz=edge.at).max_abs
        assert there == pytest.approx(found.peak.value / math.sqrt(2.0), rel=1e-8)
    assert found.error_estimate <= 1e-9 * found.peak.value
    assert found.mean_undetermined is False
    assert found.peak_stability[0].stable is Stable.YES
    assert not found.bifurcations.unstable.any()


@pytest.mark.few(keep=(3,))
@pytest.mark.parametrize("seed", [0, 1, 3])
def test_random_scenes_are_what_single_solves_find(seed: int) -> None:
    """Elastic contacts, gaps, loads that vary and move beside rigid ones."""
    scene, hz = random_scene(seed)
    found = stickslip.sweep(scene, start=0.95 * hz, stop=1.05 * hz)
    assert found.reached
    for i in range(0, len(found.values), max(len(found.values) // 5, 1)):
        alone = stickslip.solve(scene, frequency_hz=float(found.values[i]))
        if not alone.converged or "history_dependent" in alone.flags:
            continue
        assert found.half_peak_to_peak[i] == pytest.approx(alone.half_peak_to_peak, rel=1e-8)
        if "mean_undetermined" not in alone.flags:
            assert found.amplitude[i] == pytest.approx(alone.max_abs, rel=1e-8)


def test_where_a_rigid_normal_contact_opens_the_branch_ends() -> None:
    found = stickslip.sweep(pressed(math.inf, N0=1.2), start=0.12, stop=0.3)
    assert found.status is stickslip.branches.BranchStatus.RIGID_OPENS
    assert 0.12 < found.values[-1] < 0.3
    opens = pressed(math.inf, N0=1.2)
    assert stickslip.march(opens, frequency_hz=float(found.values[-1]) - 0.01).converged
    assert not stickslip.march(opens, frequency_hz=float(found.values[-1]) + 0.01).converged
    nothing = stickslip.sweep(pressed(math.inf, N0=0.5), start=0.12, stop=0.3)
    assert nothing.status is stickslip.branches.BranchStatus.RIGID_OPENS
    assert len(nothing.values) == 0
    assert nothing.peak is None
    assert nothing.to_json()["points"] == 0
    assert len(nothing.to_dataset().variables["parameter"].values) == 0


def test_it_is_shown_as_every_branch() -> None:
    """Words, JSON, arrays, a picture."""
    scene = damped(0.4, 0.05)
    found = stickslip.sweep(scene, start=0.12, stop=0.2, harmonics=5)
    told = json.loads(json.dumps(found.to_json(), allow_nan=False))
    assert told["stability_known_by"] == "multipliers"
    assert told["band_known"] is False
    data = found.to_dataset()
    assert data.variables["amplitude"].values.tolist() == found.amplitude.tolist()
    assert set(data.variables["state"].values.ravel().tolist()) == {"stick and slip"}
    assert found.coefficients.shape == (len(found.values), 1, 11)
    assert "peak" in repr(found)
    assert found.known.relative < 1e-8
    assert found.known.peaks_open
    assert found.plot().axes


def test_it_is_watched_and_stopped() -> None:
    seen: list[float] = []
    heights: list[float] = []
    shares: list[float] = []
    found = stickslip.sweep(
        damped(0.4, 0.05), start=0.1, stop=0.2,
        course=stickslip.branches.Course(
            on_points=lambda values, amplitudes: (seen.extend(values), heights.extend(amplitudes))
        ),
        on_progress=lambda share, _count: shares.append(share), should_stop=lambda: len(seen) == 7,
    )  # fmt: skip
    assert found.status is stickslip.branches.BranchStatus.STOPPED
    assert len(seen) == 7
    assert seen == sorted(seen)
    assert shares == sorted(shares)
    assert set(seen) <= set(found.values.tolist())
    settings = stickslip.branches.ContinuationSettings(most_points=4)
    few = stickslip.sweep(damped(0.4, 0.05), start=0.1, stop=0.2, settings=settings)
    assert few.status is stickslip.branches.BranchStatus.TOO_MANY_POINTS


def test_what_needs_a_balance_refuses_by_name() -> None:
    scene = damped(0.4, 0.05)
    for study in (
        lambda: stickslip.design(scene, variables={"f.N0": (0.1, 1.0)}),
        lambda: track_peak(scene, "f.N0", 0.1, 1.0),
        lambda: stickslip.response_map(scene, "f.N0", 0.1, 1.0),
    ):
        with pytest.raises(stickslip.SettingError, match=r"f\.kt"):
            study()
    branch = stickslip.sweep(scene, start=0.1, stop=0.12)
    with pytest.raises(stickslip.SettingError, match="orbits"):
        stickslip.branches.switch_branches(branch)
    assert not isinstance(branch, Branch)
    for name in ("guess", "resume"):
        with pytest.raises(stickslip.SettingError, match=name):
            stickslip.sweep(scene, course=stickslip.branches.Course(**{name: np.zeros(3)}))
    for start, stop, limit, key in (
        (0.1, 0.1, None, "stop"),
        (-1.0, 1.0, None, "start"),
        (0.1, 0.2, -1.0, "limit"),
    ):
        with pytest.raises(stickslip.SettingError, match=key):
            stickslip.sweep(scene, start=start, stop=stop, limit=limit)
