"""Designs of the platform wedge against points that are solved one by one, without a sweep."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import optim
import solver
from optim import DesignStatus
from optim.criteria.constraint_rows import DesignEvaluation
from optim.criteria.evaluation import evaluate
from optim.methods import enough_harmonics
from optim.problem.design_problem import Problem, pose
from solver import BranchStatus, Scene

HARMONICS = 3
BAND = (300.0, 420.0)  # Hz


def highest_by_points(scene: Scene, measure: str, harmonics: int, n: int, finer: int = 1) -> float:
    """The highest `measure` of the motion in the band [m] by solutions from nothing.

    `n` of them over the band, `finer` in each interval of these that has a high end, since two peaks that
    hold a design may be closer than the intervals are wide, and a search about the tops of all.
    """

    def at(hz: float) -> float:
        found = solver.solve(scene, frequency_hz=float(hz), harmonics=harmonics)
        return float(getattr(found, measure)) if found.converged else math.nan

    coarse = np.linspace(*BAND, n)
    values = np.array([at(hz) for hz in coarse])
    high = np.nan_to_num(values) >= 0.9 * np.nanmax(values)
    between = [
        np.linspace(*coarse[i : i + 2], finer + 1)[1:-1] for i in range(n - 1) if high[i] or high[i + 1]
    ]
    grid = np.concatenate([coarse, *between])
    values = np.concatenate([values, [at(hz) for hz in grid[n:]]])
    assert np.isfinite(values).mean() > 0.95
    order = np.argsort(grid)
    grid, values = grid[order], np.nan_to_num(values[order])
    best = values.max()
    for i in np.flatnonzero(values >= 0.99 * best):
        if i in (0, grid.size - 1) or values[i] < max(values[i - 1], values[i + 1]):
            continue
        top = minimize_scalar(
            lambda hz: -at(hz), bounds=(grid[i - 1], grid[i + 1]), method="bounded",
            options={"xatol": 1e-9},
        )  # fmt: skip
        best = max(best, -top.fun)
    return float(best)


def _is_least(
    scene: Scene,
    found: optim.DesignResult,
    bounds: dict[str, tuple[float, float]],
    steps: tuple[float, ...],
    *points: int,
) -> None:
    """Its peak is that of the points, and no point beside it within the bounds is lower."""
    assert found.peak is not None
    assert found.known is not None
    by = found.known.measure, found.problem.harmonics, *points
    values = {path: float(value) for path, value in found.optimum.items()}
    here = highest_by_points(scene.with_values(values), *by)
    assert found.peak.value == pytest.approx(here, rel=1e-6)
    for path, value in values.items():
        for step in steps:
            if not bounds[path][0] <= value * (1.0 + step) <= bounds[path][1]:
                continue
            beside = highest_by_points(scene.with_values({**values, path: value * (1.0 + step)}), *by)
            assert beside >= here * (1.0 - 1e-6), (path, step)


@pytest.mark.long
def test_a_stiffer_face_is_better_up_to_its_bound() -> None:
    scene = solver.load_scene("platform-wedge").with_values({"wedge.mass": 0.0042})
    bounds = {"wedge.kt": (5e6, 8e7)}
    found = optim.design(scene, variables=bounds, harmonics=HARMONICS)
    assert found.status is DesignStatus.AT_BOUND
    _is_least(scene, found, bounds, (-1e-3,), 25)


@pytest.mark.long
@pytest.mark.parametrize(
    ("variables", "status"),
    [
        ({"wedge.angle": (0.1, 0.8)}, DesignStatus.OPTIMAL),
        ({"wedge.mass": (0.003, 0.009)}, DesignStatus.OPTIMAL),
        ({"wedge.mass": (0.0038, 0.006), "wedge.angle": (0.2, 0.6)}, DesignStatus.AT_BOUND),
    ],
    ids=["angle", "mass", "mass and angle"],
)
def test_the_best_wedge_is_that_of_points(
    variables: dict[str, tuple[float, float]], status: DesignStatus
) -> None:
    scene = solver.load_scene("platform-wedge").with_values({"wedge.mass": 0.0042})
    found = optim.design(scene, variables=variables, harmonics=HARMONICS)
    assert found.status is status
    _is_least(scene, found, variables, (-1e-2, -1e-3, -1e-5, 1e-5, 1e-3, 1e-2), 61, 10)


@pytest.mark.long
def test_a_heavier_wedge_than_max_x_asks_for_is_best_by_half_peak_to_peak() -> None:
    """The mean is free: a grid of sweeps by half peak to peak judges, and twice the harmonics agree."""
    scene = solver.load_scene("platform-wedge")
    found = optim.design(scene, variables={"wedge.mass": (0.005, 0.05)}, harmonics=HARMONICS)
    assert found.status is DesignStatus.AT_BOUND
    assert found.known is not None
    assert found.peak is not None
    assert found.known.measure == "half_peak_to_peak"
    assert found.optimum["wedge.mass"] == pytest.approx(0.05, rel=1e-9)
    observed = scene.model_copy(
        update={"observe": scene.observe.model_copy(update={"measure": "half_peak_to_peak"})}
    )
    for mass in np.geomspace(0.005, 0.05, 15):
        swept = solver.sweep(observed.with_values({"wedge.mass": float(mass)}), harmonics=HARMONICS)
        if swept.reached:
            assert swept.peak is not None
            assert swept.peak.value >= found.peak.value * (1.0 - 1e-9)
    best = solver.sweep(observed.with_values(dict(found.optimum)), harmonics=2 * HARMONICS)
    assert best.peak is not None
    assert best.peak.value == pytest.approx(found.peak.value, rel=1e-9)


@pytest.mark.parametrize(
    ("name", "variable"),
    [
        ("bladed-disk", "shroud.N0"), ("fe-disk", "shroud.N0"), ("platform-cylinder", "cylinder.mass"),
        ("platform-wedge", "wedge.mass"), ("shroud-3d", "shroud.N0"), ("two-dof", "damper.N0"),
    ],
)  # fmt: skip
def test_every_shipped_scene_says_what_is_designed_by_itself(name: str, variable: str) -> None:
    scene = solver.load_scene(name)
    (found,) = pose(scene).variables
    value = scene.value(variable)
    assert (found.name, found.low, found.high) == (variable, value / 10.0, value * 15.0)


def test_a_response_that_is_lost_from_one_end_is_followed_from_the_other() -> None:
    scene = solver.load_scene("platform-wedge").with_values({"wedge.mass": 0.0071338})
    up = solver.sweep(scene, harmonics=11)
    assert up.reached
    assert (up.values[0], up.values[-1]) == BAND[::-1]
    found = evaluate(pose(scene), {"wedge.mass": 0.0071338}, gradients=False)
    assert found.good
    down = solver.sweep(scene, start=BAND[1], stop=BAND[0], harmonics=11)
    assert down.peak is not None
    assert found.peaks[0].value == pytest.approx(down.peak.value, rel=1e-9)


def test_a_design_far_above_the_best_is_not_followed() -> None:
    scene = solver.load_scene("platform-wedge")
    known = evaluate(pose(scene), {"wedge.mass": 0.012}, gradients=False)
    assert evaluate(pose(scene), {"wedge.mass": 0.012}, gradients=False, most=1.01 * known.objective).good
    assert not evaluate(pose(scene), {"wedge.mass": 0.012}, gradients=False, most=0.9 * known.objective).good


def test_a_branch_that_leaves_the_limit_at_once_has_few_points() -> None:
    light = evaluate(pose(solver.load_scene("platform-wedge")), {"wedge.mass": 0.0004}, most=1.1e-3)
    (response,) = light.responses
    assert response.branch.status is BranchStatus.TOO_HIGH
    assert len(response.branch.values) < 20


def test_the_measure_is_asked_of_another_response_where_that_amid_the_range_is_lost(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem = pose(solver.load_scene("platform-wedge"), variables={"wedge.mass": (0.001, 0.03)}, harmonics=3)
    middle = problem.variables[0].outside(0.5)

    def lost_amid(posed: Problem, values: Mapping[str, float], **more: Any) -> DesignEvaluation:
        if values["wedge.mass"] == middle:
            return DesignEvaluation(values=values, responses=(), rows=())
        return evaluate(posed, values, **more)

    monkeypatch.setattr(enough_harmonics, "evaluate", lost_amid)
    measured, told = enough_harmonics.by_first_response(problem, None)
    assert [one.good for one in told] == [False, True]
    assert measured.cases[0].scene.observe.measure == "half_peak_to_peak"


@pytest.mark.long
@pytest.mark.parametrize("name", ["wedge", "cylinder"])
def test_the_default_design_of_a_shipped_damper_is_the_best_of_a_grid(name: str) -> None:
    """By half peak to peak of responses over a grid of masses, both ways, and by marches at its peak."""
    scene = solver.load_scene(f"platform-{name}")
    found = optim.design(scene)
    assert found.status is DesignStatus.AT_BOUND
    assert found.peak is not None
    assert found.known is not None
    assert found.known.measure == "half_peak_to_peak"
    assert found.optimum[f"{name}.mass"] == pytest.approx(0.06)
    best = scene.with_values(dict(found.optimum))
    marched = solver.march(best, frequency_hz=found.peak.at, max_periods=4000)
    assert marched.half_peak_to_peak == pytest.approx(found.peak.value, rel=1e-3)
    observed = scene.model_copy(
        update={"observe": scene.observe.model_copy(update={"measure": "half_peak_to_peak"})}
    )
    seen = 0
    for mass in np.geomspace(0.0016, 0.06, 25):
        for ends in (BAND, BAND[::-1]):
            swept = solver.sweep(
                observed.with_values({f"{name}.mass": float(mass)}), start=ends[0], stop=ends[1],
                settings=solver.ContinuationSettings(highest=100.0 * found.peak.value),
            )  # fmt: skip
            higher = swept.amplitude.max() >= found.peak.value * (1.0 - 1e-9)
            assert higher or not swept.reached, mass
            seen += bool(higher)
    assert seen > 40
