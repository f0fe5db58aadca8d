"""Derivatives of frequency and damping at an amplitude against central differences."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import solver
from solver.modes.mode_curve import ModeState, correct
from solver.modes.mode_start import begin, phase_of
from solver.modes.nonlinear_mode import pose
from tests.cases.matrix_cases import chain_raw
from tests.cases.random_scenes import random_scene


def _along(path: str, state: ModeState, found: solver.NonlinearMode, step: float) -> np.ndarray:
    """Central differences of (frequency, ζ), each solved at the amplitude of a point."""
    value = found.scene.value(path)
    step *= abs(value) or 1.0
    sides = []
    for sign in (1.0, -1.0):
        there = found.scene.with_values({path: value + sign * step})
        problem = pose(there, found.mode, None, found.n_harmonics, whole=found.whole_matrices)
        # A phase that is given is that of a force, here in other modes.
        phase = state.phase if problem.turns else phase_of(problem.equations)
        solved = correct(problem.equations, replace(state, phase=phase / np.linalg.norm(phase)))
        if not solved.converged:  # other ports may lead there
            low = state.log_amplitude
            solved = begin(problem.equations, problem.mode, problem.rest, low, turns=problem.turns)
        assert solved.converged, path
        sides.append(solved.state.y[-2:] / (2.0 * math.pi, 1.0))
    return np.asarray(sides[0] - sides[1]) / (2.0 * step)


def _check(scene: solver.Scene, paths: list[str], **keys: Any) -> None:
    found = solver.nonlinear_mode(scene, errors=False, **keys)
    assert found.points
    chosen = range(1, len(found.points), max(1, len(found.points) // 3))
    gradient = solver.mode_gradient(found, paths, points=chosen)
    for row, i in enumerate(chosen):
        size = np.array((found.frequency_hz[i], max(found.damping_ratio[i], 1e-3)))
        for column, path in enumerate(paths):
            got = np.array([gradient.frequency_hz[row, column], gradient.damping_ratio[row, column]])
            wanted, rough = (_along(path, found.points[i], found, h) for h in (1e-5, 4e-5))
            scale = size / (abs(scene.value(path)) or 1.0)
            # Where the curve bends sharply the differences are no better than they agree.
            room = 1e-6 * np.abs(wanted) + 2e-7 * scale + 0.2 * np.abs(wanted - rough)
            assert np.all(np.abs(got - wanted) <= room), (path, i, got, wanted, rough)


@pytest.mark.parametrize("seed", [1, pytest.param(4, marks=pytest.mark.long)])
def test_every_path_of_a_random_scene(seed: int) -> None:
    scene, _, _ = random_scene(seed)
    # Amplitude and phase of the excitation do not touch a mode; an N1 of 0 calls for even harmonics.
    paths = [p for p in scene.parameter_paths() if p.split(".")[-1] in ("kt", "mu", "N0", "N1_phase")]
    _check(scene, paths, amplitudes=(0.05, 5.0), harmonics=5)


def test_parameters_of_the_structure_and_of_loads_that_move() -> None:
    raw = chain_raw()
    raw["structure"]["springs"][0]["name"] = "foot"
    scene = solver.Scene.from_dict(raw)
    paths = ["structure.foot", "one.N0", "one.N1", "one.N1_phase", "one.kt", "two.mu", "excitation.phase"]
    _check(scene, paths, amplitudes=(0.02, 2.0), harmonics=5)


def test_a_mass_counts_in_the_amplitude_too() -> None:
    raw = chain_raw()
    raw["structure"]["masses"] = {"a": {"m": 1.0, "name": "heavy"}, "b": 0.7, "c": 0.4}
    raw["structure"]["springs"][1]["c"] = 0.3
    raw["structure"]["springs"][1]["name"] = "lossy"
    raw["contacts"][0].pop("N1")
    _check(
        solver.Scene.from_dict(raw),
        ["structure.heavy", "structure.lossy"],
        amplitudes=(0.02, 2.0),
        harmonics=5,
    )


@pytest.mark.parametrize("name", ["bladed-disk", pytest.param("shroud-3d", marks=pytest.mark.long)])
def test_shipped_disks(name: str) -> None:
    scene = solver.load_scene(name)
    paths = [p for p in scene.parameter_paths() if p.startswith("shroud.") and p.endswith(("N0", "kt", "mu"))]
    _check(scene, paths, amplitudes=(1e-5, 2e-4), harmonics=3)


@pytest.mark.long
def test_a_place_of_a_damper_in_space() -> None:
    scene = solver.load_scene("platform-wedge")
    # At 1.294e-3 √kg m the curve folds: a step aside from a point beyond falls back on the branch before.
    _check(scene, ["wedge.angle", "speed", "wedge.mass"], amplitudes=(1e-3, 1.28e-3), harmonics=3)


def test_an_unknown_path_is_named() -> None:
    found = solver.nonlinear_mode(solver.load_scene("two-dof"), amplitudes=(0.1, 0.2), harmonics=1)
    with pytest.raises(solver.SettingError, match=r"damper\.N9"):
        solver.mode_gradient(found, ["damper.N9"])
    with pytest.raises(solver.SettingError, match="points"):
        solver.mode_gradient(found, ["damper.N0"], points=[99])
