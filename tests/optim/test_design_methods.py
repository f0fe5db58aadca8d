"""The methods of the design layer: they agree, with brute force too, and say which conditions hold."""

from functools import cache

import numpy as np
import pytest

import optim
import solver
from optim.problem.checks import DesignError
from optim.problem.design_problem import Method
from optim.results.design_result import DesignResult, DesignStatus

SCENES = {"two-dof": ("damper.N0", 20.0, 500.0), "bladed-disk": ("shroud.N0", 20.0, 3000.0)}
METHODS = ("tracked", "minimax", "ipopt")


@cache
def best(name: str, method: str) -> DesignResult:
    path, low, high = SCENES[name]
    return optim.design(solver.load_scene(name), variables={path: (low, high)}, method=method)


def peak(scene: solver.Scene, path: str, value: float) -> float:
    branch = solver.sweep(scene.with_values({path: value}))
    assert branch.reached
    return branch.peaks[0].value


@pytest.mark.few(3)
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("method", METHODS)
def test_the_methods_agree(name: str, method: str) -> None:
    result, reference = best(name, method), best(name, "tracked")
    path = SCENES[name][0]
    assert result.status is DesignStatus.OPTIMAL
    assert result.method is Method(method)
    assert result.peak is not None
    assert reference.peak is not None
    assert result.peak.value == pytest.approx(reference.peak.value, rel=1e-8)
    assert result.optimum[path] == pytest.approx(reference.optimum[path], rel=1e-5)


@pytest.mark.parametrize("name", SCENES)
def test_auto_is_the_tracked_peak_for_one_variable(name: str) -> None:
    path, low, high = SCENES[name]
    result = optim.design(solver.load_scene(name), variables={path: (low, high)}, basins=1)
    assert result.method is Method.TRACKED
    assert result.optimum[path] == pytest.approx(best(name, "tracked").optimum[path], rel=1e-9)
    assert result.work <= 5.0


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("method", METHODS)
def test_every_result_says_which_conditions_hold(name: str, method: str) -> None:
    result = best(name, method)
    found = result.conditions
    assert found is not None
    assert found.residual < 1e-6
    assert found.violation == 0.0
    assert sum(multiplier for _, multiplier in found.rows) == pytest.approx(1.0)
    assert all(multiplier >= 0.0 for _, multiplier in found.rows)
    active = [row for row, multiplier in found.rows if multiplier > 1e-6]
    assert len(active) == {"two-dof": 1, "bladed-disk": 2}[name]
    heights = [row.value for row in active]
    assert max(heights) == pytest.approx(min(heights), rel=1e-7)
    if name == "bladed-disk":
        assert sorted(row.at_hz for row in active) == pytest.approx([753.279, 765.750], abs=2e-3)


@pytest.mark.few(6)
@pytest.mark.parametrize("name", SCENES)
def test_the_optimum_equals_brute_force(name: str) -> None:
    """A grid over the range, then finer and finer ones around its best down to steps of 1e-4 of the range."""
    path, low, high = SCENES[name]
    scene = solver.load_scene(name)
    grid = np.geomspace(low, high, 41)
    values = {float(x): peak(scene, path, float(x)) for x in grid}
    for step in (8e-3, 1e-3, 1e-4):
        centre = min(values, key=lambda x: values[x])
        near = centre + step * (high - low) * np.arange(-8, 9)
        values |= {float(x): peak(scene, path, float(x)) for x in near if low <= x <= high}
    lowest = min(values.values())
    result = best(name, "tracked")
    assert result.peak is not None
    assert result.peak.value <= lowest * (1.0 + 1e-9)
    # The peak moves by its slope on each side of an exchange of peaks, within half a step of the grid.
    slopes = [abs(float(row.gradient[0])) for row in result.evaluation.peaks[:2]]  # type: ignore[union-attr]
    assert lowest - result.peak.value <= 1e-6 * lowest + max(slopes) * 1e-4 * (high - low)
    exact = peak(scene, path, result.optimum[path])
    assert exact == pytest.approx(result.peak.value, rel=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("name", SCENES)
def test_the_optimum_equals_brute_force_on_the_whole_fine_grid(name: str) -> None:
    """Steps of 1e-4 of the logarithmic range over all of it: 10001 responses."""
    path, low, high = SCENES[name]
    scene = solver.load_scene(name)
    peaks = [peak(scene, path, float(x)) for x in np.geomspace(low, high, 10001)]
    result = best(name, "tracked")
    assert result.peak is not None
    assert result.peak.value <= min(peaks) * (1.0 + 1e-9)
    assert min(peaks) == pytest.approx(result.peak.value, rel=2e-5)


@pytest.mark.parametrize(
    "f0", [1.0, 1e4, *(pytest.param(f0, marks=pytest.mark.long) for f0 in (10.0, 1e2, 1e3))]
)
@pytest.mark.parametrize("method", ["tracked", "minimax"])
def test_the_optimum_is_in_proportion_to_the_force(f0: float, method: str) -> None:
    scene = solver.load_scene("two-dof")
    one = best("two-dof", method)
    scaled = optim.design(
        scene.with_values({"excitation.amplitude": f0}),
        variables={"damper.N0": (0.2 * f0, 5.0 * f0)},
        method=method,
    )
    assert scaled.reached
    tolerance = 1e-9 if method == "tracked" else 1e-6
    assert scaled.optimum["damper.N0"] / f0 == pytest.approx(one.optimum["damper.N0"] / 100.0, rel=tolerance)
    assert scaled.peak.value / f0 == pytest.approx(one.peak.value / 100.0, rel=1e-10)  # type: ignore[union-attr]


@pytest.mark.long
def test_minimax_and_ipopt_agree_with_a_limit_on_the_band() -> None:
    scene = solver.load_scene("bladed-disk")
    found = [
        optim.design(
            scene, variables={"shroud.N0": (20.0, 3000.0)}, limit=0.08e-3, max_band_hz=40.0, method=method
        )
        for method in ("minimax", "ipopt")
    ]
    assert all(result.reached for result in found)
    assert found[0].optimum["shroud.N0"] == pytest.approx(found[1].optimum["shroud.N0"], rel=1e-6)
    assert found[0].peak.value == pytest.approx(found[1].peak.value, rel=1e-7)  # type: ignore[union-attr]
    assert found[0].band_hz == pytest.approx(40.0, rel=1e-9)


@pytest.mark.parametrize("method", ["minimax", "ipopt"])
def test_a_response_with_one_peak_alone(method: str) -> None:
    found = optim.design(
        solver.load_scene("two-dof"),
        variables={"damper.N0": (20.0, 500.0)},
        cases=[{"band": [0.6, 1.6]}],
        method=method,
    )
    assert found.reached
    assert found.peak.value == pytest.approx(best("two-dof", "tracked").peak.value, rel=1e-9)  # type: ignore[union-attr]


SEVERAL = {"damper.N0": (20.0, 500.0), "damper.kt": (20.0, 40.0), "damper.N1_ratio": (0.0, 0.5)}


@pytest.mark.long
@pytest.mark.parametrize("count", [2, 3])
def test_minimax_and_ipopt_agree_with_several_variables(count: int) -> None:
    scene, variables = solver.load_scene("two-dof"), dict(list(SEVERAL.items())[:count])
    found = [optim.design(scene, variables=variables, method=method) for method in ("minimax", "ipopt")]
    assert all(result.reached for result in found)
    assert found[0].peak.value == pytest.approx(found[1].peak.value, rel=1e-8)  # type: ignore[union-attr]
    assert found[0].optimum["damper.N0"] == pytest.approx(found[1].optimum["damper.N0"], rel=1e-4)
    bounds = {(name, side) for name, side, _ in found[0].conditions.bounds}  # type: ignore[union-attr]
    assert bounds == {("damper.kt", "upper"), ("damper.N1_ratio", "lower")} & {
        (name, side) for name in variables for side in ("lower", "upper")
    }


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"method": "newton"}, ["method", "tracked", "ipopt", "newton"]),
        ({"method": "tracked", "max_band_hz": 1.0}, ["method", "without limits"]),
        (
            {"method": "tracked", "variables": {"damper.N0": (20.0, 500.0), "damper.kt": (20.0, 40.0)}},
            ["method", "one variable"],
        ),
        ({"basins": 0}, ["basins", "0"]),
        ({"basins": 1.5}, ["basins", "1.5"]),
    ],
)
def test_a_method_that_does_not_fit_is_refused(arguments: dict[str, object], words: list[str]) -> None:
    with pytest.raises(DesignError) as caught:
        optim.design(solver.load_scene("two-dof"), **arguments)  # type: ignore[arg-type]
    for word in words:
        assert word in str(caught.value)
