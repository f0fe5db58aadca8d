"""The judge of every answer: it passes what full matrices pass, and refuses what is a little off."""

import math
import time
from dataclasses import replace

import numpy as np
import pytest
from floating_bars import Bar
from floating_scenes import floating_scene
from moving_scenes import moving_scene
from random_scenes import random_scene
from referee import lost_power

from solver import BranchStatus, ContinuationSettings, Scene, solve_all, sweep
from solver.balance.balance import build
from solver.balance.kernels.mechanics import ALLOWED, unaccounted
from solver.balance.kernels.output import LOST
from solver.balance.workspace import Workspace
from solver.continuation.branches.sweep import walk_branch
from solver.continuation.stretches import balanced_part
from solver.response.solve import describe, described_at

Drawn = tuple[Scene, float, int]


def _middle(seed: int) -> Drawn:
    scene = floating_scene(seed)
    return scene, 0.5 * sum(scene.observe.band), 7


def _bar(seed: int) -> Drawn:
    bar = replace(Bar.of(seed), n=6)
    return bar.scene(), bar.frequency_hz, 7


KINDS = {
    "lumped": random_scene, "moving": lambda seed: (*moving_scene(seed), 7), "floating": _middle, "bar": _bar,
}  # fmt: skip


@pytest.mark.few(5)
@pytest.mark.parametrize("seed", range(40))
@pytest.mark.parametrize("kind", KINDS)
def test_it_passes_answers_and_refuses_what_is_off(kind: str, seed: int) -> None:
    scene, frequency_hz, harmonics = KINDS[kind](seed)
    workspace, omega = Workspace.of(build(scene, harmonics=harmonics)), 2.0 * math.pi * frequency_hz
    found = workspace.solve(omega)
    if not found.converged:
        pytest.skip("no answer to judge")
    solution = describe(workspace, found, frequency_hz, time.perf_counter())
    assert solution.converged
    assert lost_power(solution) < ALLOWED
    workspace.forces(found.u, omega)
    passed = unaccounted(workspace.system, workspace.linear, found.u, workspace.point)
    assert passed <= ALLOWED
    _, point = workspace.forces(found.u, omega)
    if not np.any(point.F.reshape(len(point.F), -1)[:, int(workspace.balance.system.ks[0] == 0) :]):
        return  # no contact carries anything that vibrates: there is no power to lose
    off = found.u * (1.0 + 1e-3 * np.random.default_rng(seed).choice([-1.0, 1.0], found.u.size))
    workspace.forces(off, omega)
    assert not workspace.obeys(off)
    refused = describe(workspace, replace(found, u=off), frequency_hz, time.perf_counter())
    assert not refused.converged
    assert math.isnan(refused.max_abs)


def test_every_point_of_a_branch_is_judged() -> None:
    for seed in (3, 5, 8):
        scene, _, harmonics = random_scene(seed)
        branch = sweep(scene, harmonics=harmonics)
        assert branch.measures[:, LOST].max() <= ALLOWED
        for i in (0, len(branch.values) // 2, len(branch.values) - 1):
            assert lost_power(described_at(branch, i)) < ALLOWED


def test_a_point_that_fails_is_none_of_the_branch() -> None:
    scene, _, harmonics = random_scene(3)
    workspace = Workspace.of(build(scene, harmonics=harmonics))
    stretch = next(walk_branch(workspace, *scene.observe.band, ContinuationSettings()))
    assert balanced_part(workspace, stretch) is stretch
    stretch.measures[2, LOST] = 10.0 * ALLOWED
    cut = balanced_part(workspace, stretch)
    assert len(cut.solutions) == 2
    assert cut.status is BranchStatus.STALLED


@pytest.mark.parametrize("force", [1100.0, 3000.0])
def test_bars_above_friction_have_no_peak_and_no_solution(force: float) -> None:
    """Light masses that fly as far as inertia lets them: forces there are rounding."""
    bar = Bar(n=4, force=force, stiffness_ratio=20.0, mass=1e-6, frequency_hz=0.01)
    branch = sweep(bar.scene(), harmonics=5)
    assert not branch.reached
    assert branch.peak is None
    assert not solve_all(bar.scene(), frequency_hz=0.01, harmonics=5, starts=2).solutions
