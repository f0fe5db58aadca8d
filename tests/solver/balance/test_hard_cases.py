"""Hard cases: each converges with a residual that others confirm, or ends with an honest status.

A solution is confirmed by the sampled friction law, by the matrices of all degrees of freedom, by the power
balance and by time marching (`referee`); a branch by its residuals and by not turning back, because with a
damped structure and given loads elastic Coulomb friction is monotone and the response unique.
"""

from __future__ import annotations

import math
from itertools import islice

import numpy as np
import pytest
from hard_scenes import HARD, Hard, together, weakly_damped
from referee import law_error, lost_power, motion_error
from scene_cases import bladed_disk, two_dof
from walked_branches import UNSTABLE, Walked, walked, with_damping

from solver import BranchStatus, ContinuationSettings, Solution, SolutionStatus, march, solve, sweep
from solver.balance.balance import build
from solver.balance.kernels.output import RESIDUAL
from solver.balance.workspace import Workspace
from solver.contacts.kernels.stick_slip_events import LIFTING
from solver.continuation.branches.sweep import walk_branch
from solver.continuation.stretches import Course
from solver.marching.march_result import MarchStatus

LAW = 3e-4  # of the largest friction force: what sampling leaves
BALANCED = 1e-8
NO_TURN = 1e-6  # of the range of the parameter: a step over a kink may step back by so much
MOST_POINTS = 3000

RATCHETING = "loose mass, floor slips"
TOO_STIFF = "kt = 1e+09 k"
COSTLY = "kt = 1e+06 k"  # half of the time of all


def confirm(solution: Solution) -> None:
    """Look at a solution independently."""
    assert solution.residual <= 1e-9
    assert law_error(solution) <= LAW
    assert motion_error(solution) <= BALANCED
    assert lost_power(solution) <= BALANCED


@pytest.mark.few(2)
@pytest.mark.parametrize("name", [name for name in HARD if name != RATCHETING])
def test_solve(name: str):
    hard = HARD[name]
    solution = solve(hard.scene, frequency_hz=hard.frequency_hz, harmonics=hard.harmonics)
    assert solution.converged
    confirm(solution)
    if hard.march is not None:
        marched = march(hard.scene, frequency_hz=hard.frequency_hz)
        assert marched.converged
        assert solution.half_peak_to_peak == pytest.approx(marched.half_peak_to_peak, rel=hard.march)


def test_a_part_that_ratchets():
    """The loose mass under a varying load, its floor slipping: no periodic motion, as time marching sees."""
    hard = HARD[RATCHETING]
    assert hard.band is not None
    assert solve(hard.scene, frequency_hz=hard.frequency_hz).status is SolutionStatus.RATCHETS
    for start, stop in (hard.band, hard.band[::-1]):
        branch = sweep(hard.scene, start=start, stop=stop)
        assert branch.status is BranchStatus.RATCHETS
    marched = march(hard.scene, frequency_hz=hard.frequency_hz, max_periods=3000)
    assert marched.status is MarchStatus.RATCHETS


def test_a_contact_too_stiff_to_be_swept():
    """Its deformation is 1e-9 of its motion: the branch ends early, with the reason."""
    hard = HARD[TOO_STIFF]
    assert hard.band is not None
    settings = ContinuationSettings(most_points=60)
    for start, stop in (hard.band, hard.band[::-1]):
        assert sweep(hard.scene, start=start, stop=stop, settings=settings).status is BranchStatus.TOO_STIFF


SWEPT = [name for name, hard in HARD.items() if hard.band and name not in (RATCHETING, TOO_STIFF)]


@pytest.mark.few(keep=set(SWEPT) - {COSTLY})
@pytest.mark.parametrize("name", SWEPT)
def test_sweep(name: str):
    hard = HARD[name]
    assert hard.band is not None
    peaks = [whole_branch(hard, ends) for ends in (hard.band, hard.band[::-1])]
    assert peaks[0] == pytest.approx(peaks[1], rel=1e-7)


def whole_branch(hard: Hard, ends: tuple[float, float]) -> float:
    """Sweep a band, look at the branch, and return the largest half peak-to-peak at its two ends."""
    settings = ContinuationSettings(most_points=MOST_POINTS)
    branch = sweep(hard.scene, start=ends[0], stop=ends[1], harmonics=hard.harmonics, settings=settings)
    assert branch.status is BranchStatus.COMPLETED
    assert branch.residuals.max() <= 1e-9
    steps = np.diff(branch.values) * np.sign(ends[1] - ends[0])
    assert steps.min() >= -NO_TURN * abs(ends[1] - ends[0])
    assert branch.stepped_over <= 2
    for i in (0, len(branch.values) // 2):
        solution = solve(hard.scene, frequency_hz=float(branch.values[i]), harmonics=hard.harmonics)
        assert branch.half_peak_to_peak[i] == pytest.approx(solution.half_peak_to_peak, rel=1e-7)
    return float(max(branch.half_peak_to_peak[0], branch.half_peak_to_peak[-1]))


@pytest.mark.parametrize(
    ("path", "ends"),
    [
        ("damper.N0", (1e-9, 1e9)),
        ("damper.N1", (0.0, 1000.0)),
        ("damper.kt", (1e-3, 1e6)),
        ("damper.mu", (0.0, 5.0)),
        ("excitation.amplitude", (1e-9, 1e4)),
    ],
)
def test_from_end_to_end_of_a_parameter(path: str, ends: tuple[float, float]):
    """Both ends as solving gives them, whichever way."""
    for start, stop in (ends, ends[::-1]):
        branch = sweep(two_dof(), path, start, stop, frequency_hz=1.198)
        assert branch.reached
        assert branch.residuals.max() <= 1e-9
        for i in (0, -1):
            solution = solve(two_dof().with_values({path: float(branch.values[i])}), frequency_hz=1.198)
            assert branch.half_peak_to_peak[i] == pytest.approx(solution.half_peak_to_peak, rel=1e-7)


def test_all_contacts_switch_at_one_instant():
    solution = solve(together(30.0), frequency_hz=700.0, harmonics=7)
    confirm(solution)
    roots = [contact for contact in solution.contacts if "root" in contact.name]
    assert len(roots) == 4
    for root in roots:
        assert root.state.value == "stick and slip"
        np.testing.assert_allclose(root.force, roots[0].force, atol=1e-9 * np.abs(roots[0].force).max())


@pytest.mark.parametrize("kt", [0.5, 50.0])
def test_no_damping_but_the_contact(kt: float):
    """At the free resonance the contact alone limits the motion: it no longer depends on the damping."""
    at = 1.0 / (2.0 * math.pi)
    one, other = (solve(weakly_damped(c, N0=3.0, kt=kt), frequency_hz=at) for c in (1e-6, 1e-10))
    for mine, its in zip(one.contacts, other.contacts, strict=True):
        np.testing.assert_allclose(mine.slip, its.slip, atol=1e-5 * np.abs(its.slip).max())
    # The motion is the difference of what force and contact do, 1e10 times as large: its last bits are lost.
    assert one.half_peak_to_peak == pytest.approx(other.half_peak_to_peak, rel=3e-4)
    for solution in (one, other):
        assert abs(solution.half_peak_to_peak - one.half_peak_to_peak) <= solution.error_estimate
        assert lost_power(solution) <= 1e-4  # what cancels is 1e10 times as large


def test_monotone_with_separation():
    """Why there are no folds: two motions never pull closer together than the law allows, lifting or not.

    Along the branch dr/du keeps the sign of its determinant, with the contact open a part of the period.
    """
    for scene, band in ((two_dof(N1=200.0), (0.3, 2.6)), (bladed_disk(N1=500.0), (500.0, 900.0))):
        branch = sweep(scene, start=band[0], stop=band[1], harmonics=7)
        assert branch.reached
        assert np.count_nonzero(branch.states == LIFTING) > 10
        workspace = Workspace.of(branch.balance)
        signs = set()
        for solution in branch.solutions:
            _, point = workspace.evaluate(solution[:-1].copy(), float(solution[-1]))
            signs.add(float(np.linalg.slogdet(point.jacobian)[0]))
        assert signs == {1.0}


@pytest.mark.parametrize(
    ("path", "ends", "N1", "damping", "turns"),
    [
        ("excitation.amplitude", (0.1, 8.0), 8.0, -0.05, (1.26349, 1.13531, 1.30915, 0.57237)),
        ("excitation.amplitude", (0.1, 8.0), 15.0, -0.02, (1.75496, 1.71996, 2.00889, 1.41493)),
        ("damper.N0", (10.0, 1.0), 8.0, -0.05, (3.76412, 4.46830, 2.51256, 7.32067)),
    ],
)
def test_folds_with_separation(
    path: str, ends: tuple[float, float], N1: float, damping: float, turns: tuple[float, ...]
):
    """Where the structure has negative damping there are folds, also with the contact open at times."""
    scene = UNSTABLE.with_values({"damper.N1": N1})
    branch = walked(with_damping(scene, path, damping, 0.17), *ends)
    assert branch.status is BranchStatus.COMPLETED
    assert branch.measures[:, RESIDUAL].max() <= 1e-9
    assert branch.turns == pytest.approx(turns, rel=0.02)


def test_an_isolated_branch_is_reached():
    """Over the force to a large motion, then over the frequency: a closed curve that no sweep meets."""
    over_force = walked(with_damping(UNSTABLE, "excitation.amplitude", -0.05, 0.1605), 0.1, 8.0)
    assert over_force.status is BranchStatus.COMPLETED
    force = 0.3
    crossings = np.flatnonzero(np.diff(np.sign(over_force.values - force)))
    assert crossings.size == 3
    balance = with_damping(UNSTABLE.with_values({"excitation.amplitude": force}), "frequency", -0.05)
    workspace = Workspace.of(balance)
    ends = []
    for guess in crossings[1:]:
        for stop in (0.4, 0.05):
            half = closed(workspace, 0.1605, stop, over_force.solutions[guess, :-1])
            assert half.status is BranchStatus.TURNED_BACK
            assert len(half.turns) == 1
            ends.append((half.values.min(), half.values.max()))
    low, high = min(end[0] for end in ends), max(end[1] for end in ends)
    assert (low, high) == (pytest.approx(0.16004, abs=2e-5), pytest.approx(0.16178, abs=2e-5))
    small = walked(balance, 0.05, 0.18)
    assert small.status is BranchStatus.COMPLETED
    assert len(small.turns) == 0
    assert np.abs(small.solutions[:, :-1]).max() < 2.0
    assert min(np.abs(over_force.solutions[i, :-1]).max() for i in crossings[1:]) > 20.0


def closed(workspace: Workspace, start: float, stop: float, guess: np.ndarray) -> Walked:
    """Half of a closed curve: from one of its points until the branch is back at that frequency."""
    stretches = list(islice(walk_branch(workspace, start, stop, ContinuationSettings(), guess.copy()), 20))
    solutions = np.concatenate([stretch.solutions for stretch in stretches])
    return Walked(
        status=stretches[-1].status,
        values=workspace.balance.parameter.all_outside(solutions[:, -1].copy()),
        solutions=solutions,
        measures=np.concatenate([stretch.measures for stretch in stretches]),
    )


def test_a_branch_reached_over_the_load_goes_on_over_the_frequency():
    """N1 from none to separation, then the frequency: the same branch as without the detour."""
    over_load = sweep(two_dof(), "damper.N1", 0.0, 150.0, frequency_hz=1.1)
    assert over_load.reached
    scene = two_dof(N1=150.0)
    even = Workspace.of(build(scene)).balance.n_unknowns == over_load.balance.n_unknowns
    guess = over_load.solutions[-1, :-1] if even else None
    detour = sweep(scene, start=1.1, stop=2.6, course=Course(guess=guess))
    straight = sweep(scene, start=1.1, stop=2.6)
    assert detour.reached
    assert detour.peak is not None
    assert straight.peak is not None
    assert detour.peak.value == pytest.approx(straight.peak.value, rel=1e-9)
    assert detour.half_peak_to_peak[-1] == pytest.approx(straight.half_peak_to_peak[-1], rel=1e-8)


def test_what_fails_says_so():
    """Nothing that did not converge passes for a number."""
    undamped = weakly_damped(0.0, N0=0.1)
    solution = solve(undamped, frequency_hz=1.0 / (2.0 * math.pi))
    assert not solution.converged
    numbers = (solution.max_abs, solution.half_peak_to_peak, solution.mean, solution.error_estimate)
    assert all(math.isnan(number) for number in numbers)
    assert solution.contacts == ()
    assert "no damping" in solution.status.value
    assert len(sweep(undamped, start=1.0 / (2.0 * math.pi), stop=0.3).values) == 0
