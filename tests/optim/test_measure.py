"""What is minimised is what the result is judged by: max|x|, or half peak to peak where the mean is free."""

import math
from typing import Any

import numpy as np
import pytest

import optim
import solver
from optim.problem.checks import DesignError
from optim.results.design_result import DesignStatus
from solver.balance.balance import build
from solver.balance.workspace import Workspace
from solver.errors import SettingError
from solver.scene.scene import Scene
from solver.sensitivity.gradient import Sensitivities

HALF = "half_peak_to_peak"


def lopsided(load: float = 5.2, **observe: Any) -> Scene:
    """Two harmonics make the motion lopsided; `keeps` may have slipped on the way, and then keeps a force."""
    return Scene.from_dict({
        "name": "lopsided",
        "structure": {"kind": "lumped", "masses": {"a": 1.0, "b": 0.5}, "springs": [
            {"between": ["a", "ground"], "k": 40.0, "c": 0.5}, {"between": ["a", "b"], "k": 20.0, "c": 0.2},
        ]},
        "contacts": [
            {"name": "slides", "between": ["a", "b"], "kt": 30.0, "mu": 0.3, "N0": 1.5},
            {"name": "keeps", "between": ["a", "ground"], "kt": 25.0, "mu": 0.4, "N0": load},
        ],
        "excitation": [
            {"dof": "a", "amplitude": 1.0}, {"dof": "b", "amplitude": 0.3, "harmonic": 2, "phase": 0.7},
        ],
        "observe": {"dof": "b", "band": [0.5, 2.2], **observe},
    })  # fmt: skip


def highest(scene: Scene, around: float) -> float:
    """Half peak to peak of the highest of many solutions about a frequency."""
    grid = around + np.linspace(-0.02, 0.02, 41)
    found = [solver.solve(scene, frequency_hz=float(hertz), harmonics=7) for hertz in grid]
    return max(each.half_peak_to_peak for each in found)


def test_a_scene_may_observe_half_peak_to_peak() -> None:
    """Its peak is the highest of the solutions by that measure, and of the march."""
    scene = lopsided(measure=HALF)
    assert Scene.from_dict(scene.to_dict()) == scene
    branch = solver.sweep(scene, harmonics=7)
    assert branch.peak is not None
    there = solver.solve(scene, frequency_hz=branch.peak.at, harmonics=7)
    assert branch.peak.value == pytest.approx(there.half_peak_to_peak, rel=1e-9)
    assert there.max_abs > 1.01 * there.half_peak_to_peak
    dense = highest(scene, branch.peak.at)
    assert dense <= branch.peak.value * (1.0 + 1e-9)
    assert dense == pytest.approx(branch.peak.value, rel=1e-4)
    assert branch.known.measure == HALF
    marched = solver.march(scene, frequency_hz=branch.peak.at).half_peak_to_peak
    assert abs(marched - branch.peak.value) <= branch.known.error


def test_gradients_of_half_peak_to_peak_are_differences() -> None:
    scene, hertz = lopsided(measure=HALF), 0.9
    paths = ("slides.N0", "slides.kt", "excitation.amplitude")
    balance = build(scene, harmonics=7)
    u = Workspace.of(balance).solve(2.0 * math.pi * hertz).u
    found = Sensitivities(balance, paths).gradient(u, hertz)
    for path, slope in zip(paths, found.by_parameters, strict=True):
        value = scene.value(path)
        high, low = (
            solver.solve(
                scene.with_values({path: (1.0 + step) * value}), frequency_hz=hertz, harmonics=7
            ).half_peak_to_peak
            for step in (1e-5, -1e-5)
        )
        assert slope == pytest.approx((high - low) / (2e-5 * value), rel=1e-5), path


def test_a_design_whose_mean_is_free_minimises_half_peak_to_peak() -> None:
    variables = {"slides.N0": (0.2, 6.0)}
    found = optim.design(lopsided(), variables=variables, harmonics=7)
    assert found.status is DesignStatus.OPTIMAL
    assert found.known.measure == HALF
    assert found.peak is not None
    assert found.known.value == pytest.approx(found.peak.value, rel=1e-12)
    best = found.optimum["slides.N0"]
    assert highest(lopsided().with_values({"slides.N0": best}), found.peak.at) <= found.peak.value * (
        1 + 1e-9
    )
    for beside in (0.95, 1.05):
        other = lopsided().with_values({"slides.N0": beside * best})
        assert highest(other, found.peak.at) > found.peak.value
    of_max_abs = optim.design(lopsided(load=20.0), variables=variables, harmonics=7)
    assert of_max_abs.known.measure == "max_abs"
    assert abs(of_max_abs.optimum["slides.N0"] / best - 1.0) > 1e-3


def test_half_peak_to_peak_has_no_tracked_peak() -> None:
    scene = lopsided(measure=HALF)
    with pytest.raises(SettingError, match="followed by sweeps, not by its peak"):
        solver.track_peak(scene, "slides.N0", 1.0, 2.0, harmonics=3)
    with pytest.raises(DesignError, match="half peak to peak is observed"):
        optim.design(scene, variables={"slides.N0": (0.2, 6.0)}, method="tracked")
