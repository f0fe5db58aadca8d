"""The Pareto front of peak against band: brute force, its slope, its ends, statuses, bad input."""

import itertools
import json
import math
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

import optim
import solver
from optim.results.studies_result import ParetoStatus, front_of
from optim.views.plots.figures import pareto_figure

LIMIT = 0.08e-3
DISK = solver.load_scene("bladed-disk")
TWO = solver.load_scene("two-dof")


@cache
def front() -> optim.ParetoResult:
    return optim.pareto_front(DISK, variables={"shroud.N0": (20.0, 3000.0)}, limit=LIMIT, points=6)


def peak_and_band(load: float) -> tuple[float, float]:
    branch = solver.sweep(DISK.with_values({"shroud.N0": load}), limit=LIMIT)
    assert branch.peak is not None
    assert branch.band is not None
    return branch.peak.value, branch.band.width


def test_the_front_runs_from_the_least_peak_to_the_narrowest_band() -> None:
    result = front()
    assert result.status is ParetoStatus.COMPLETE
    assert len(result.points) + len(result.dominated) == 6
    for one, other in pairwise(result.points):
        assert one.peak < other.peak
        assert one.band_hz > other.band_hz
    least = optim.design(DISK, variables={"shroud.N0": (20.0, 3000.0)}).peak
    assert result.points[0].peak == pytest.approx(least.value, rel=1e-9)  # type: ignore[union-attr]
    for point in result.points:
        assert point.intervals
        assert sum(high - low for low, high in point.intervals) == pytest.approx(point.band_hz, rel=1e-9)


def test_no_design_of_a_grid_beats_a_point_of_the_front() -> None:
    for load in np.geomspace(20.0, 3000.0, 40):
        peak, band = peak_and_band(float(load))
        assert not any(peak < p.peak * (1 - 1e-7) and band < p.band_hz * (1 - 1e-7) for p in front().points)


def test_the_slope_is_that_of_neighbouring_designs() -> None:
    for point in front().points[1:-1]:
        load, step = point.values["shroud.N0"], 1e-4 * point.values["shroud.N0"]
        (low_peak, low_band), (peak, band) = (peak_and_band(load + sign * step) for sign in (-1.0, 1.0))
        assert point.slope == pytest.approx((peak - low_peak) / (band - low_band), rel=1e-4)
        assert point.hz_per_metre == pytest.approx(-1.0 / point.slope)


def test_the_slopes_of_two_points_enclose_the_line_between_them() -> None:
    for one, other in pairwise(front().points[1:-1]):
        line = (other.peak - one.peak) / (other.band_hz - one.band_hz)
        assert other.slope < line < one.slope < 0.0


def test_the_front_leaves_a_least_peak_between_two_equal_ones_at_a_slope() -> None:
    first = front().points[0]
    step = 1e-5 * first.values["shroud.N0"]
    peak, band = peak_and_band(first.values["shroud.N0"] + step)
    assert first.slope == pytest.approx((peak - first.peak) / (band - first.band_hz), rel=1e-2)
    assert first.slope < 0.0


def test_the_knee_lies_below_the_line_between_the_ends() -> None:
    result = front()
    assert result.knee is not None
    assert 0 < result.knee < len(result.points) - 1


def test_what_is_dominated_is_said() -> None:
    points = front().points
    worse = replace(points[2], peak=points[2].peak * 1.01, band_hz=points[2].band_hz * 1.01)
    kept, dominated = front_of([worse, *reversed(points), points[1]])
    assert kept == points
    assert dominated == (points[1], worse)


@pytest.mark.long
def test_two_variables_at_half_power() -> None:
    variables = {"damper.N0": (20.0, 500.0), "damper.N1_ratio": (0.0, 0.5)}
    result = optim.pareto_front(TWO, variables=variables, points=3, harmonics=3)
    assert result.status in (ParetoStatus.COMPLETE, ParetoStatus.PARTIAL)
    for point in result.points[1:-1]:
        held = optim.design(
            TWO,
            variables=variables,
            max_band_hz=point.band_hz * (1 + 1e-4),
            start=dict(point.values),
            harmonics=3,
        ).peak
        assert held is not None
        assert held.value == pytest.approx(
            point.peak * (1 + 1e-4 * point.slope * point.band_hz / point.peak), rel=1e-6
        )


def test_one_design_that_is_best_in_both_is_no_front() -> None:
    result = optim.pareto_front(TWO, variables={"damper.N0": (20.0, 30.0)}, limit=4.0)
    assert result.status is ParetoStatus.NO_TRADE_OFF
    assert result.reached
    assert len(result.points) == 1


def test_an_end_that_is_not_found_says_why() -> None:
    scene = TWO.with_values({"damper.mu": 0.0})
    result = optim.pareto_front(scene, variables={"damper.N0": (20.0, 300.0)})
    assert result.status is ParetoStatus.NO_END
    assert result.ends[-1].status is optim.DesignStatus.FLAT
    assert not result.reached
    json.dumps(result.to_json(), allow_nan=False)


@pytest.mark.parametrize("after", [5, 150])
def test_it_can_be_stopped(after: int) -> None:
    asked = itertools.count()
    result = optim.pareto_front(
        TWO, variables={"damper.N0": (20.0, 500.0)}, should_stop=lambda: next(asked) > after
    )
    assert result.status is ParetoStatus.STOPPED
    json.dumps(result.to_json(), allow_nan=False)


def test_progress_rises_to_one_and_the_json_is_strict() -> None:
    seen: list[float] = []
    result = optim.pareto_front(
        TWO, variables={"damper.N0": (20.0, 500.0)}, points=4, on_progress=lambda share, _: seen.append(share)
    )
    assert seen == sorted(seen)
    assert seen[-1] == 1.0
    answer = json.loads(json.dumps(result.to_json(), allow_nan=False))
    assert [p["peak"] for p in answer["points"]] == [p.peak for p in result.points]
    assert answer["points"][-1]["slope"] is None or math.isfinite(answer["points"][-1]["slope"])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"points": 2}, ["points", ">= 3", "2"]),
        ({"points": 5.0}, ["points", "5.0"]),
        ({"limit": 0.0}, ["limit", "0.0"]),
        ({"variables": {"dumper.N0": (1.0, 2.0)}}, ["dumper.N0", "damper.N0"]),
        ({"method": "luck"}, ["method", "luck"]),
    ],
)
def test_bad_input_is_named(arguments: dict[str, object], words: list[str]) -> None:
    with pytest.raises((optim.DesignError, solver.SettingError)) as caught:
        optim.pareto_front(TWO, **arguments)  # type: ignore[arg-type]
    for word in words:
        assert word in str(caught.value)


def test_the_picture_shows_the_front_the_knee_and_the_frequencies_at_risk() -> None:
    page = pareto_figure(front().to_json())
    risk = page.axes[1]
    words = "\n".join(text.get_text() for text in page.findobj(lambda artist: hasattr(artist, "get_text")))
    assert "knee: shroud.N0" in words
    assert "Hz wider" in words
    drawn = [
        line for axes in page.axes[:1] for line in axes.lines if len(line.get_xdata()) == len(front().points)
    ]
    assert sorted(drawn[0].get_xdata()) == pytest.approx(sorted(p.band_hz for p in front().points))
    bars = sum(len(p.intervals) for p in front().points)
    assert len(risk.lines) == bars + len(front().points)


def test_a_front_of_what_contacts_alone_hold_is_of_half_peak_to_peak() -> None:
    """The mean of the platforms is free: a front of max|x| had no point that is known."""
    wedge, variable = solver.load_scene("platform-wedge"), "wedge.mass"
    found = optim.pareto_front(wedge, variables={variable: (0.03, 0.06)}, points=4)
    assert found.status is ParetoStatus.COMPLETE
    assert found.measured.measure == "half_peak_to_peak"
    centred = wedge.model_copy(
        update={"observe": wedge.observe.model_copy(update={"measure": "half_peak_to_peak"})}
    )
    for mass in np.geomspace(0.03, 0.06, 12):
        branch = solver.sweep(centred.with_values({variable: float(mass)}))
        assert branch.peak is not None
        assert branch.band is not None
        peak, band = branch.peak.value, branch.band.width
        assert not any(peak < p.peak * (1 - 1e-6) and band < p.band_hz * (1 - 1e-6) for p in found.points)
