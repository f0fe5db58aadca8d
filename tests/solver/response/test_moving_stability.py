"""Stability under loads that move, in space, with gaps and springs that bend, against the march."""

import time

import numpy as np
import pytest
from law_scene_cases import CUBIC, GAP, RUB, scene
from marched_map import MarchedMap
from moving_scenes import KINDS, bending_scene, moving_scene

from solver import Branch, Scene, SettingError, Solution, bifurcations, solve, stability, sweep
from solver.balance.workspace import PointSolution, Workspace
from solver.response.contact_response import ContactState
from solver.response.solve import describe
from solver.response.stability.floquet import scene_monodromy
from solver.results.known import Stable


def matrix_of(solution: Solution) -> np.ndarray:
    motions = tuple(np.array(contact.motions) for contact in solution.contacts)
    return scene_monodromy(solution.scene, solution.frequency_hz, motions).matrix


def solution_at(branch: Branch, i: int) -> Solution:
    found = PointSolution(converged=True, u=branch.solutions[i, :-1].copy(), iterations=0, residual=0.0)
    return describe(Workspace.of(branch.balance), found, float(branch.values[i]), time.perf_counter())


def agrees(solution: Solution, within: float) -> MarchedMap:
    """Compare the matrix with marched differences around the motion that the march repeats."""
    marched = MarchedMap(solution)
    assert marched.refine() < 1e-10
    expected, found = marched.jacobian(), matrix_of(solution)
    assert found.shape == expected.shape
    np.testing.assert_allclose(found, expected, atol=within * max(np.abs(expected).max(), 1.0))
    return marched


def leaves(marched: MarchedMap, matrix: np.ndarray, periods: int) -> float:
    """By what a perturbation along the leading direction has grown some periods later."""
    values, vectors = np.linalg.eig(matrix)
    order = np.argsort(-np.abs(values))
    # What is 1 but for rounding neither grows nor decays.
    leading = next(i for i in order if abs(abs(values[i]) - 1.0) > 1e-9)
    way = vectors[:, leading].real
    way *= 1e-5 * marched.size / np.abs(way).max()
    here = marched.numbers(marched.state)
    there = marched.march(marched.moved(way), periods)
    return float(np.abs(marched.numbers(there) - here).max() / np.abs(way).max())


@pytest.mark.parametrize("seed", range(len(KINDS)), ids=KINDS)
def test_matrix_of_every_law_against_the_march(seed: int):
    scene, frequency_hz = moving_scene(seed)
    solution = solve(scene, frequency_hz=frequency_hz, harmonics=41)
    agrees(solution, 3e-4)
    assert stability(solution).stable


@pytest.mark.long
@pytest.mark.parametrize("seed", range(6, 48))
def test_random_scenes_return_as_the_multipliers_say(seed: int):
    scene, frequency_hz = moving_scene(seed)
    solution = solve(scene, frequency_hz=frequency_hz, harmonics=41)
    assert solution.converged
    marched = agrees(solution, 3e-4)
    found = stability(solution)
    grown = leaves(marched, matrix_of(solution), 40)
    assert found.stable == (grown < 1.0)
    assert grown == pytest.approx(found.radius**40, abs=0.2)


def unstable_point(seed: int) -> tuple[Branch, int] | None:
    branch = sweep(bending_scene(seed), harmonics=21)
    stretches = bifurcations(branch).stretches
    return (branch, sum(stretches[0]) // 2) if stretches else None


def departs(seed: int) -> bool:
    """Whether there is a stretch that is not stable; it is then left, and the points before it come back."""
    found = unstable_point(seed)
    if found is None:
        return False
    branch, middle = found
    solution = solution_at(branch, middle)
    assert not stability(solution).stable
    marched = agrees(solution, 2e-2)
    radius = stability(solution).radius
    assert leaves(marched, matrix_of(solution), 12) > 0.3 * radius**12 > 1.0
    # Stuck at its limit a contact gives way one way and not the other: no one matrix is the differences.
    first = bifurcations(branch).stretches[0][0]
    points = (solution_at(branch, i) for i in range(first // 2, first))
    before = next(each for each in points if all(c.state is not ContactState.STUCK for c in each.contacts))
    assert stability(before).stable
    assert leaves(agrees(before, 2e-2), matrix_of(before), 60) < 1.0
    return True


def test_between_folds_of_a_rubbing_contact_the_motion_is_left():
    assert departs(0)


@pytest.mark.long
def test_between_folds_of_random_contacts_the_motion_is_left():
    assert sum(departs(seed) for seed in range(1, 13)) >= 6


def test_folds_of_a_rubbing_contact_are_passed_and_marked():
    branch = sweep(bending_scene(0), harmonics=11)
    found, whole = bifurcations(branch), bifurcations(branch, multipliers=True)
    assert branch.reached
    assert branch.folds == 2
    assert [mark.kind.name for mark in found.marks] == ["FOLD", "FOLD"]
    assert (found.known_by, whole.known_by) == ("determinant", "multipliers")
    np.testing.assert_array_equal(found.unstable, whole.unstable)
    ((first, last),) = found.stretches
    assert (first - 1, last) == tuple(mark.after for mark in found.marks)
    for mark in found.marks:
        near = np.sort(np.abs(branch.values - mark.at))[:3]
        assert near.max() < 0.01
        beyond = mark.at > branch.values[[mark.after, mark.after + 1]].max() - 1e-9
        below = mark.at < branch.values[[mark.after, mark.after + 1]].min() + 1e-9
        assert beyond or below


def test_nothing_is_marked_where_the_response_is_the_only_one():
    scene, _ = moving_scene(1)
    raw = scene.to_dict()
    raw["contacts"] = [
        {"name": "c", "law": "coulomb", "between": ["x0", "ground"], "kt": 1.0, "mu": 0.3, "N0": 1.0}
    ]
    found = bifurcations(sweep(type(scene).from_dict(raw), harmonics=3))
    assert found.known_by == "uniqueness"
    assert not found.marks
    assert not found.unstable.any()


def test_a_law_that_does_not_say_is_refused(monkeypatch: pytest.MonkeyPatch):
    scene, frequency_hz = moving_scene(3)
    solution = solve(scene, frequency_hz=frequency_hz, harmonics=5)
    monkeypatch.setattr(type(scene.contacts[0]), "perturbed", lambda *_: None)
    with pytest.raises(SettingError, match="must have contacts whose law says how it is perturbed"):
        stability(solution)


@pytest.mark.parametrize("law", ["gap", "elastic-normal"])
@pytest.mark.parametrize("phase", [0.0, 0.7])
def test_what_touches_without_a_force_has_no_multipliers(law: str, phase: float):
    """It moves by rounding, which opened and closed it: multipliers of 0.8 to 2.2, by the origin of time."""
    touch = {"gap": GAP | {"between": ["v", "ground"], "gap": 0.0}, "elastic-normal": RUB | {"N0": 0.0}}
    raw = scene(CUBIC, touch[law]).to_dict()
    raw["structure"]["springs"] = raw["structure"]["springs"][:2]  # nothing between u and v: v is at rest
    raw["excitation"] = {"dof": "u", "amplitude": 1.0, "phase": phase}
    solution = solve(Scene.from_dict(raw), frequency_hz=0.2, harmonics=5)
    assert solution.converged
    with pytest.raises(SettingError, match="touches without a force"):
        stability(solution)
    assert solution.stability.stable is Stable.NOT_KNOWN
