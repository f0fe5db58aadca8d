"""The design problem on the paper's scenes: optimum, shape, limits, every status, bad input."""

import math
from functools import cache

import numpy as np
import pytest
from each import each

import optim
import solver
from optim.criteria.evaluation import evaluate
from optim.problem.checks import DesignError
from optim.problem.design_problem import pose
from optim.results.design_result import DesignStatus


def peak_of(scene: solver.Scene, values: dict[str, float]) -> float:
    """The highest peak of a design, by a sweep."""
    problem = pose(scene, variables={path: (0.5 * value, 2.0 * value) for path, value in values.items()})
    return evaluate(problem, values, gradients=False).peaks[0].value


@cache
def best(name: str, path: str, start: float | None) -> optim.DesignResult:
    begin = None if start is None else {path: start}
    return optim.design(solver.load_scene(name), variables={path: (20.0, 3000.0)}, start=begin)


@pytest.mark.parametrize("start", [None, 20.0, 61.7, 900.0, 3000.0])
def test_two_dof_optimum_is_between_100_and_110_newton(start: float | None) -> None:
    result = best("two-dof", "damper.N0", start)
    assert result.status is DesignStatus.OPTIMAL
    assert 100.0 <= result.optimum["damper.N0"] <= 110.0
    assert result.peak is not None
    assert result.peak.value == pytest.approx(best("two-dof", "damper.N0", None).peak.value, rel=1e-7)  # type: ignore[union-attr]


@pytest.mark.parametrize("start", [None, 20.0, 333.0, 3000.0])
def test_bladed_disk_peak_falls_below_a_tenth_of_a_millimetre(start: float | None) -> None:
    result = best("bladed-disk", "shroud.N0", start)
    assert result.status is DesignStatus.OPTIMAL
    assert result.peak is not None
    assert result.peak.value < 0.1005e-3
    assert sum("peak" in what for what in result.active) == 2, "two peaks are equally high at this optimum"
    assert sum(result.multipliers) == pytest.approx(1.0)
    assert result.optimality < 1e-6


@pytest.mark.parametrize(("name", "path"), [("two-dof", "damper.N0"), ("bladed-disk", "shroud.N0")])
def test_no_neighbour_of_the_optimum_is_better(name: str, path: str) -> None:
    result = best(name, path, None)
    assert result.peak is not None
    scene = solver.load_scene(name)
    for factor in (0.5, 0.8, 0.95, 0.99, 0.999, 1.001, 1.01, 1.05, 1.25, 2.0):
        there = peak_of(scene, {path: result.optimum[path] * factor})
        assert there >= result.peak.value * (1.0 - 1e-9)


def test_the_shape_of_the_paper_steep_below_90_and_flat_to_1000_newton() -> None:
    scene = solver.load_scene("bladed-disk")

    def peak(N0: float) -> float:
        return peak_of(scene, {"shroud.N0": N0})

    least = best("bladed-disk", "shroud.N0", None).peak.value  # type: ignore[union-attr]
    assert peak(60.0) > 20.0 * least
    assert peak(80.0) > 4.0 * least
    assert all(peak(N0) < 1.3 * least for N0 in (100.0, 200.0, 500.0, 1000.0))
    assert peak(200.0) == pytest.approx(0.1016e-3, rel=1e-3)
    assert peak(3000.0) > 2.0 * least


def test_the_optimum_scales_with_the_force() -> None:
    scene = solver.load_scene("two-dof")
    one = optim.design(scene, variables={"damper.N0": (50.0, 200.0)})
    scaled = optim.design(
        scene.with_values({"excitation.amplitude": 1.0}), variables={"damper.N0": (0.5, 2.0)}
    )
    assert scaled.optimum["damper.N0"] * 100.0 == pytest.approx(one.optimum["damper.N0"], rel=1e-6)
    assert scaled.peak.value * 100.0 == pytest.approx(one.peak.value, rel=1e-9)  # type: ignore[union-attr]


def test_a_limit_on_the_band_is_kept_and_costs_peak() -> None:
    scene = solver.load_scene("bladed-disk")
    free = best("bladed-disk", "shroud.N0", None)
    limited = optim.design(scene, variables={"shroud.N0": (20.0, 3000.0)}, limit=0.08e-3, max_band_hz=40.0)
    assert limited.status is DesignStatus.OPTIMAL
    assert limited.band_hz == pytest.approx(40.0, rel=1e-4)
    assert limited.peak.value > free.peak.value  # type: ignore[union-attr]
    assert "band limit of 40 Hz" in limited.active


def test_several_variables_beat_one() -> None:
    scene = solver.load_scene("two-dof")
    result = optim.design(
        scene,
        variables={"damper.N0": (20.0, 500.0), "damper.kt": (10.0, 60.0), "damper.N1_ratio": (0.0, 0.5)},
    )
    assert result.status is DesignStatus.AT_BOUND
    assert result.reached
    assert result.peak.value < best("two-dof", "damper.N0", None).peak.value  # type: ignore[union-attr]
    assert any("upper bound of damper.kt" in what for what in result.active)


def test_springs_of_the_structure_can_be_designed() -> None:
    scene = solver.load_scene("two-dof")
    result = optim.design(scene, variables={"structure.k2": (35.0, 45.0)})
    assert result.reached
    for k2 in (35.0, 38.0, 40.0, 42.0, 45.0):
        there = peak_of(scene, {"structure.k2": k2})
        assert there >= result.peak.value * (1.0 - 1e-9)  # type: ignore[union-attr]


def test_without_friction_there_is_nothing_to_choose() -> None:
    scene = solver.load_scene("two-dof").with_values({"damper.mu": 0.0})
    result = optim.design(scene, variables={"damper.N0": (20.0, 3000.0)})
    assert result.status is DesignStatus.FLAT
    assert not result.reached


def test_a_band_that_no_design_keeps_says_so_and_gives_the_narrowest() -> None:
    scene = solver.load_scene("two-dof")
    result = optim.design(scene, variables={"damper.N0": (90.0, 130.0)}, limit=1.0, max_band_hz=0.01)
    assert result.status is DesignStatus.INFEASIBLE
    assert result.band_hz is not None
    assert result.band_hz > 0.01


def test_a_search_can_be_stopped_and_keeps_the_best_so_far() -> None:
    count = 0

    def stop() -> bool:
        nonlocal count
        count += 1
        return count > 12

    result = optim.design(solver.load_scene("two-dof"), method="minimax", should_stop=stop)
    assert result.status is DesignStatus.STOPPED
    assert not result.reached
    assert result.optimum


def test_progress_rises_to_one_and_the_sweeps_end_with_the_optimum() -> None:
    seen: list[tuple[float, int]] = []
    result = optim.design(
        solver.load_scene("two-dof"),
        method="minimax",
        on_progress=lambda share, count: seen.append((share, count)),
    )
    shares = [share for share, _ in seen]
    assert shares == sorted(shares)
    assert seen[-1] == (1.0, result.evaluations)
    assert len(result.sweeps) == len(result.sweep_values) == result.evaluations
    assert result.sweep_values[-1] == result.optimum
    assert result.sweeps[-1].peak.value == pytest.approx(result.peak.value, rel=1e-13)  # type: ignore[union-attr]
    assert result.sweeps[-1].reached


def test_the_json_has_the_keys_of_the_contract() -> None:
    answer = best("two-dof", "damper.N0", None).to_json()
    assert {"optimum", "peak", "band_hz", "evaluations", "seconds", "active", "status"} <= set(answer)
    assert set(answer["peak"]) == {"value", "at"}  # type: ignore[call-overload]


@each(
    ("arguments", "words"),
    [
        ({"variables": {}}, ["variables"]),
        ({"variables": {"damper.N0": (100.0, 20.0)}}, ["variables.damper.N0", "low < high"]),
        ({"variables": {"damper.N0": (100.0, math.nan)}}, ["variables.damper.N0", "finite"]),
        ({"variables": {"damper.N0": 100.0}}, ["variables.damper.N0", "two numbers", "100.0"]),
        ({"variables": {"damper.N0": (-5.0, 20.0)}}, ["damper.N0", ">= 0", "-5.0"]),
        ({"variables": {"frequency": (1.0, 2.0)}}, ["frequency"]),
        ({"variables": {"dumper.N0": (1.0, 2.0)}}, ["dumper.N0", "damper.N0"]),
        ({"limit": -1.0}, ["limit", "-1.0"]),
        ({"limit": math.inf}, ["limit", "inf"]),
        ({"max_band_hz": 0.0}, ["max_band_hz", "0.0"]),
        ({"harmonics": -3}, ["harmonics", "-3"]),
        ({"harmonics": 2.5}, ["harmonics", "2.5"]),
        ({"start": {"damper.kt": 3.0}}, ["start", "damper.N0"]),
        (
            {"variables": {"damper.N0": (20.0, 30.0)}, "start": {"damper.N0": 31.0}},
            ["start.damper.N0", "31.0"],
        ),
    ],
)
def test_bad_input_names_the_argument_and_the_value(arguments: dict[str, object], words: list[str]) -> None:
    with pytest.raises((DesignError, solver.SettingError)) as caught:
        optim.design(solver.load_scene("two-dof"), **arguments)  # type: ignore[arg-type]
    for word in words:
        assert word in str(caught.value)


def test_a_scene_without_contacts_needs_variables() -> None:
    raw = solver.load_scene("two-dof").to_dict()
    raw["contacts"] = []
    with pytest.raises(DesignError, match="no friction contact"):
        optim.design(solver.Scene.from_dict(raw))


def test_the_default_variable_is_the_load_that_the_fluctuation_follows() -> None:
    result = optim.design(solver.load_scene("bladed-disk"))
    assert list(result.optimum) == ["shroud.N0"]
    assert np.isfinite(result.optimum["shroud.N0"])
