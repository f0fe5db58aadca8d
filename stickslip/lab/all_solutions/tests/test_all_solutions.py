"""All solutions, uniqueness, branch switching and residual forces: against the march and brute force."""

import json
import math
from typing import Any

import numpy as np
import pytest
from history_scenes import BOX, moving_plane, plane_scene
from marched_map import MarchedMap
from moving_scenes import bending_scene, moving_scene
from scene_cases import duffing, two_dof

from solver import (
    Scene,
    SettingError,
    amplitude_range,
    bifurcations,
    march,
    solve,
    solve_all,
    sweep,
    switch_branches,
    uniqueness,
)
from solver.balance.balance import build
from solver.balance.simplifications import Effects
from stickslip.lab.all_solutions.solution_search import SolutionSearch


def test_seven_responses_of_one_spring_that_bends():
    """Between two folds of the branch that leaves the symmetric one; each repeats when it is marched."""
    found = solve_all(duffing(), frequency_hz=0.2664, harmonics=9, starts=8)
    assert len(found.solutions) == 7
    assert found.missing == 0
    assert not found.complete
    assert sum(each.sign for each in found.solutions) == 1
    means = sorted(each.solution.mean for each in found.solutions)
    np.testing.assert_allclose(means, [-m for m in reversed(means)], atol=1e-8)
    for each in found.solutions:
        assert each.stability is not None
        assert each.stability.stable == (each.sign > 0)
        marched = MarchedMap(each.solution, steps=256)
        before = marched.numbers(marched.state)
        assert marched.refine() < 1e-10
        assert np.abs(marched.numbers(marched.state) - before).max() < 1e-2 * marched.size


def test_both_tangents_at_a_branch_point_and_what_leaves_it():
    branch = sweep(duffing(), harmonics=11)
    (mark,) = bifurcations(branch).marks
    assert mark.kind.name == "BRANCH_POINT"
    (switched,) = switch_branches(branch)
    along, across = switched.tangents
    assert abs(along @ across) < 0.05
    assert np.linalg.norm(across) == pytest.approx(1.0)
    first, second = switched.branches
    assert first.reached
    assert second.reached
    np.testing.assert_allclose(first.mean[-1], -second.mean[-1], rtol=1e-6)
    assert abs(first.mean[-1]) > 0.1
    # What left there comes back to the same place from the other side.
    other = sweep(duffing(), "frequency", 0.35, 0.2, harmonics=11)
    (same,) = bifurcations(other).marks
    assert same.at == pytest.approx(mark.at, rel=1e-6)
    assert json.loads(json.dumps(switched.to_json(), allow_nan=False))["mark"]["kind"] == "branch_point"


def test_three_responses_between_the_folds_of_a_rubbing_contact():
    scene = bending_scene(0)
    branch = sweep(scene, harmonics=9)
    upper, lower = (mark.at for mark in bifurcations(branch).marks)
    middle = 0.5 * (upper + lower)
    found = solve_all(scene, frequency_hz=middle, harmonics=9, starts=5)
    assert [each.sign for each in found.solutions] == [1, -1, 1]
    assert found.to_json()["unique"] == "not known"
    assert json.loads(json.dumps(found.to_json(), allow_nan=False))["missing_by_signs"] == 0


def test_one_response_under_given_loads_is_complete():
    found = solve_all(two_dof(), frequency_hz=1.2, harmonics=5)
    assert found.complete
    assert found.starts == 0
    (only,) = found.solutions
    assert (
        only.solution.half_peak_to_peak == solve(two_dof(), frequency_hz=1.2, harmonics=5).half_peak_to_peak
    )


def solutions_by_search(scene: Scene, frequency_hz: float, seed: int) -> int:
    balance = build(scene, harmonics=5, effects=Effects(even_harmonics=True))
    search = SolutionSearch(balance, 2.0 * math.pi * frequency_hz)
    search.keep(search.workspace.solve(search.omega), "solve")
    search.everywhere(10, np.random.default_rng(seed), None, None)
    return len(search.known)


@pytest.mark.parametrize("seed", [0, 3, pytest.param(2, marks=pytest.mark.long)])
def test_where_one_response_is_proven_random_starts_find_no_other(seed: int):
    scene, frequency_hz = moving_scene(seed)
    found = uniqueness(scene, 4.0 * frequency_hz)
    assert found.proven
    search = SolutionSearch(
        build(scene, harmonics=5, effects=Effects(even_harmonics=True)), 8.0 * math.pi * frequency_hz
    )
    search.keep(search.workspace.solve(search.omega), "solve")
    search.everywhere(10, np.random.default_rng(seed), None, None)
    assert len(search.known) == 1


@pytest.mark.long
@pytest.mark.parametrize("seed", range(30))
def test_nothing_is_proven_where_several_responses_are(seed: int):
    scene = bending_scene(seed)
    branch = sweep(scene, harmonics=7)
    stretches = bifurcations(branch).stretches
    for first, last in stretches:
        for i in range(first, last + 1, 5):
            assert not uniqueness(scene, float(branch.values[i])).proven


@pytest.mark.long
@pytest.mark.parametrize("seed", range(40))
def test_proofs_beside_a_search(seed: int):
    scene, frequency_hz = moving_scene(seed)
    for factor in (0.2, 1.0, 4.0):
        at = factor * frequency_hz
        if not uniqueness(scene, at).proven:
            continue
        assert solutions_by_search(scene, at, seed) == 1


def held(N0: float) -> Scene:
    """A part whose load moves sticks all the time; a stop makes the vibration depend on its mean."""
    contacts: list[dict[str, Any]] = [
        {
            "name": "held", "law": "elastic-normal", "between": ["x", "ground"],
            "normal_between": ["y", "ground"],
            "kt": 1.0, "mu": 0.5, "kn": 1.0, "N0": N0, "prestressed": True,
        },
        {"name": "stop", "law": "gap", "between": ["x", "ground"], "k": 2.0, "gap": 0.3},
    ]  # fmt: skip
    return Scene.from_dict(
        {
            "name": "held",
            "structure": {
                "kind": "lumped", "masses": {"x": 1.0, "y": 1.0},
                "springs": [{"between": [dof, "ground"], "k": 1.0, "c": 0.2} for dof in ("x", "y")],
            },
            "contacts": contacts,
            "excitation": [{"dof": "x", "amplitude": 0.5}, {"dof": "y", "amplitude": 0.3, "phase": 0.8}],
            "observe": {"dof": "x", "band": [0.05, 0.5]},
        }
    )  # fmt: skip


def test_residual_forces_beside_marches_from_other_tractions():
    solution = solve(held(4.0), frequency_hz=0.15, harmonics=25)
    found = amplitude_range(solution)
    assert found is not None
    assert found.contacts == ("held",)
    low, high = found.half_peak_to_peak
    least, most = found.max_abs
    assert high > 1.01 * low
    reached = []
    for traction in np.linspace(-1.4, 1.4, 5):
        marched = march(held(4.0), frequency_hz=0.15, tractions={"held": float(traction)})
        assert marched.converged
        reached.append(marched.max_abs)
        assert low * (1.0 - 1e-3) < marched.half_peak_to_peak < high * (1.0 + 1e-3)
        assert least * (1.0 - 1e-3) < marched.max_abs < most * (1.0 + 1e-3)
    assert max(reached) - min(reached) > 0.4 * (most - least)


def test_residual_forces_under_given_loads_move_the_mean_alone():
    solution = solve(two_dof(N0=1e4), frequency_hz=1.2, harmonics=5)
    found = amplitude_range(solution)
    assert found is not None
    assert found.exact
    assert found.mean == solution.mean_range
    assert found.half_peak_to_peak == (solution.half_peak_to_peak,) * 2
    assert amplitude_range(solve(two_dof(), frequency_hz=1.2, harmonics=5)) is None


def test_of_two_directions_that_slip_apart_one_keeps_what_it_slipped_on_its_way():
    solution = solve(
        plane_scene({"N0": 100.0, "kt": 123.2448494}, BOX), frequency_hz=2.843074977332252, harmonics=25
    )
    rest = march(solution.scene, frequency_hz=2.843074977332252)
    found = amplitude_range(solution)
    assert found is not None
    assert found.exact
    assert found.max_abs[0] <= rest.max_abs <= found.max_abs[1]


def test_one_direction_that_slips_under_a_moving_load_is_not_searched():
    found = amplitude_range(solve(moving_plane(), frequency_hz=1.02188))
    assert found is not None
    assert found.contacts == ("c",)
    assert math.isnan(found.max_abs[0])


@pytest.mark.parametrize(("name", "value"), [("starts", -1), ("starts", 2.5), ("seed", -3)])
def test_bad_settings_are_named(name: str, value: Any):
    with pytest.raises(SettingError, match=f"`{name}` must be a whole number"):
        solve_all(two_dof(), frequency_hz=1.2, **{name: value})
