"""Bodies that nothing but contacts holds: dampers that float between blades, and those that ratchet away."""

import numpy as np
import pytest
from floating_cases import DAMPER, pulled, two_blades, underplatform
from floating_scenes import floating_scene
from light_points import PointSolver
from scene_cases import two_dof

from solver import (
    BranchStatus,
    ContinuationSettings,
    Scene,
    SolutionStatus,
    march,
    solve,
    stability,
    sweep,
)
from solver.balance.balance import build
from solver.balance.kernels.mechanics import unaccounted
from solver.balance.kernels.output import LOST
from solver.balance.workspace import Workspace
from solver.contacts.kernels.system import UNHELD
from solver.continuation.branches.point_by_point import walk_by_points
from solver.continuation.branches.sweep import walk_branch
from solver.continuation.stretches import balanced_part, joined
from solver.linear.condensation import loose_motions
from solver.marching.march_result import MarchStatus

ENDED = (BranchStatus.COMPLETED, BranchStatus.RATCHETS)


@pytest.mark.parametrize("load", [20.0, 60.0, 150.0])
def test_the_underplatform_damper(load: float):
    """Both ways to the end, with the peak that single points have."""
    scene, peaks = underplatform(load), []
    for start, stop in ((250.0, 550.0), (550.0, 250.0)):
        branch = sweep(scene, start=start, stop=stop)
        assert branch.status is BranchStatus.COMPLETED
        assert branch.peak is not None
        peaks.append(branch.peak)
    assert peaks[0].value == pytest.approx(peaks[1].value, rel=1e-8)
    at = peaks[0].at
    assert solve(scene, frequency_hz=at).half_peak_to_peak == pytest.approx(peaks[0].value, rel=1e-9)
    points = np.sort([at, *np.linspace(0.97 * at, 1.03 * at, 99), *np.linspace(250.0, 550.0, 301)])
    highest = PointSolver(scene, branch.balance.n_harmonics).amplitudes(points).max()
    assert highest == pytest.approx(peaks[0].value, rel=1e-9)
    known = DAMPER["peaks"].get(str(load))
    assert known is None or peaks[0].value == pytest.approx(known["peak"], rel=1e-5)


def test_two_blades_with_a_damper_between_them():
    """Against time marching: 3.0984e-3 m at 317.428 Hz."""
    solution = solve(two_blades(), frequency_hz=317.428, harmonics=121)
    assert solution.half_peak_to_peak == pytest.approx(3.098366359e-3, rel=1e-6)
    assert "mean_undetermined" in solution.flags
    branch = sweep(two_blades(), harmonics=61)
    assert branch.peak is not None
    assert branch.peak.value == pytest.approx(3.0984e-3, rel=1e-4)


def test_the_mean_of_a_damper_that_sticks_is_known():
    solution = solve(two_blades(N0=1e5), frequency_hz=317.428)
    assert "mean_undetermined" not in solution.flags
    assert solution.mean == 0.0


def test_a_static_force_on_a_blade_leaves_the_damper_where_it_is():
    """The damper slips both ways and follows no mean: the vibration is that without the force."""
    scene = pulled(two_blades(), "b1", 30.0)
    for frequency_hz in (317.0, 317.4, 318.0):
        solution, free = (solve(each, frequency_hz=frequency_hz) for each in (scene, two_blades()))
        assert solution.converged
        assert solution.half_peak_to_peak == pytest.approx(free.half_peak_to_peak, rel=1e-7)
        assert solution.mean == pytest.approx(30.0 / 4e5, rel=1e-6)
        assert "mean_undetermined" in solution.flags
    for start, stop in ((250.0, 450.0), (450.0, 250.0)):
        assert sweep(scene, start=start, stop=stop).status is BranchStatus.COMPLETED


def test_a_static_force_on_the_damper_itself():
    """It is held where the contacts stick, and drives the damper away where they slip."""
    scene = pulled(two_blades(), "d", 5.0)
    held = solve(scene, frequency_hz=150.0)
    assert held.converged
    assert sum(contact.force[0] for contact in held.contacts) == pytest.approx(5.0, rel=1e-6)
    assert solve(scene, frequency_hz=317.4).status is SolutionStatus.RATCHETS
    branch = sweep(scene, start=150.0, stop=450.0)
    assert branch.status is BranchStatus.RATCHETS
    assert 150.0 < branch.values[-1] < 317.4
    beyond = float(branch.values[-1]) + 1.0
    assert solve(scene, frequency_hz=beyond).status is SolutionStatus.RATCHETS
    marched = march(scene, frequency_hz=317.4)
    assert marched.status is MarchStatus.RATCHETS
    assert marched.drift > 0.0


def test_more_than_all_contacts_can_hold():
    """A force above the friction limits, however still the rest is: nothing of the size of kilometres."""
    pressed = two_blades(N0=500.0)
    assert solve(pulled(pressed, "d", 310.0), frequency_hz=50.0).status is SolutionStatus.RATCHETS
    assert solve(pulled(pressed, "d", 200.0), frequency_hz=50.0).converged


@pytest.mark.parametrize("left", [0.0, 1e-10, -1e-10, 1e-7])
def test_a_rigid_body_mode_that_rounding_left_a_stiffness(left: float):
    """A body of three masses from matrices, its rigid-body mode not quite free, with a static load."""
    K = np.diag([4e5, 4.1e5, 0.0, 0.0, 0.0])
    K[2:, 2:] = 1e8 * np.array([[1.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    K[2:, 2:] += left * 1e3 * np.ones((3, 3))
    L = np.array([[-1.0, 0.0, 1.0, 0.0, 0.0], [0.0, -1.0, 0.0, 0.0, 1.0]])
    kt = np.array([1e6, 2e6])
    found = loose_motions(K, L, kt)
    assert found.shape == (1, 2)
    np.testing.assert_allclose(np.abs(found), 1.0 / np.sqrt(3e6), rtol=1e-6)


@pytest.mark.parametrize("left", [0.0, 1e-10, -1e-7, 0.1])
def test_a_static_load_on_a_body_whose_rigid_body_mode_is_not_quite_free(left: float):
    """Held within what the contacts can hold, driven away beyond it, and never kilometres from its place."""
    K = np.diag([4e5, 4.1e5, 0.0, 0.0])
    K[2:, 2:] = 1e9 * np.array([[1.0, -1.0], [-1.0, 1.0]]) + 0.5 * left * np.ones((2, 2))
    dofs = {"b1": 0, "b2": 1, "d1": 2, "d2": 3}
    raw = {
        "name": "rounded",
        "structure": {
            "kind": "matrices", "K": K.tolist(), "M": np.diag([0.1, 0.1, 0.003, 0.002]).tolist(),
            "C": np.diag([0.5, 0.5, 0.0, 0.0]).tolist(), "dofs": dofs,
        },
        "contacts": [
            {"name": name, "between": ends, "kt": 1e6, "mu": 0.3, "N0": 500.0}
            for name, ends in (("left", ["d1", "b1"]), ("right", ["d2", "b2"]))
        ],
        "observe": {"dof": "b1", "band": [250.0, 450.0]},
    }  # fmt: skip
    ways = {}
    for pull in (120.0, 310.0):
        forces = [{"dof": "b1", "amplitude": 20.0}, {"dof": "d1", "amplitude": pull, "harmonic": 0}]
        ways[pull] = solve(Scene.from_dict({**raw, "excitation": forces}), frequency_hz=200.0)
    assert ways[310.0].status is SolutionStatus.RATCHETS
    held = ways[120.0]
    assert held.max_abs == pytest.approx(1.98190985e-4, rel=1e-5)
    assert sum(contact.force[0] for contact in held.contacts) == pytest.approx(120.0, rel=1e-5)


@pytest.mark.parametrize("pull", [120.0, -120.0])
def test_a_body_pressed_on_or_pulled_off_by_a_static_load(pull: float):
    """Its load moves with it: pressed on it carries the pull, pulled off there is no number at all."""
    scene = Scene.from_dict(
        {
            "name": "pulled-off",
            "structure": {
                "kind": "lumped",
                "masses": {"b": 0.1, "bn": 0.1, "dt": 0.005, "dn": 0.005},
                "springs": [{"between": [dof, "ground"], "k": 4e5, "c": 0.5} for dof in ("b", "bn")],
            },
            "contacts": [
                {
                    "name": "c", "law": "elastic-normal", "between": ["dt", "b"], "kt": 1e6, "kn": 1e6,
                    "normal_between": ["dn", "bn"], "mu": 0.3, "N0": 10.0,
                }
            ],
            "excitation": [
                {"dof": "b", "amplitude": 20.0}, {"dof": "dn", "amplitude": pull, "harmonic": 0},
            ],
            "observe": {"dof": "b", "band": [250.0, 450.0]},
        }
    )  # fmt: skip
    solution = solve(scene, frequency_hz=200.0)
    assert solution.converged == (pull > 0.0)
    if solution.converged:
        assert solution.contacts[0].load[0] == pytest.approx(pull, rel=1e-9)


def test_what_a_soft_spring_holds_is_no_loose_part():
    K, L, kt = np.diag([4e5, 100.0]), np.array([[-1.0, 1.0]]), np.array([1e6])
    assert loose_motions(K, L, kt).shape == (0, 1)
    K[1, 1] = 0.0
    assert loose_motions(K, L, kt).shape == (1, 1)


def test_the_determinant_keeps_its_sign_where_the_mean_is_a_gauge():
    scene = pulled(two_blades(), "b1", 30.0)
    branch = sweep(scene, start=250.0, stop=450.0)
    workspace, signs, means = Workspace.of(branch.balance), set(), []
    for point, tangent in zip(branch.solutions, branch.tangents, strict=True):
        _, evaluation = workspace.evaluate(point[:-1].copy(), float(point[-1]))
        signs.add(float(np.linalg.slogdet(evaluation.jacobian)[0]))
        if evaluation.counts[UNHELD] > 0:
            means.append(np.abs(tangent[:-1].reshape(2, -1)[:, 0]).max() / np.abs(tangent[:-1]).max())
    assert signs == {1.0}
    assert len(means) > 10
    assert max(means) < 1e-6


def test_stability_of_a_floating_damper():
    """The largest multiplier apart from the gauge's is how a marched perturbation decays."""
    found = stability(solve(two_blades(), frequency_hz=317.428, harmonics=31))
    assert found.stable


def test_no_means_where_symmetry_leaves_none():
    assert build(two_blades()).system.ks[0] == 1
    assert build(pulled(two_blades(), "b1", 1.0)).system.ks[0] == 0
    assert not len(build(two_dof()).system.loose)


def checked(seed: int) -> str:
    """Solve and sweep a random scene; return what is wrong, or nothing."""
    scene = floating_scene(seed)
    low, high = scene.observe.band
    for frequency_hz in np.linspace(low, high, 3):
        solution = solve(scene, frequency_hz=float(frequency_hz))
        if solution.status is SolutionStatus.NOT_CONVERGED:
            return f"seed {seed}: no solution at {frequency_hz} Hz"
    ways = [sweep(scene, start=start, stop=stop) for start, stop in ((low, high), (high, low))]
    if any(branch.status not in ENDED for branch in ways):
        return f"seed {seed}: {[branch.status.name for branch in ways]}"
    for branch in ways:
        if len(branch.values) and branch.residuals.max() > 1e-9:
            return f"seed {seed}: residual {branch.residuals.max()}"
        if branch.status is BranchStatus.RATCHETS and len(branch.values):
            step = 1e-2 * (high - low) * (1.0 if branch.stop > branch.start else -1.0)
            ahead = [float(branch.values[-1]) + share * step for share in (1e-4, 1e-3, 1e-2, 0.1, 1.0)]
            if all(solve(scene, frequency_hz=f).status is not SolutionStatus.RATCHETS for f in ahead):
                return f"seed {seed}: nothing ratchets beyond {branch.values[-1]} Hz"
    return ""


@pytest.mark.few(keep=(0, 2, 4, 197))
@pytest.mark.parametrize("seed", range(200))
def test_random_floating_scenes(seed: int):
    assert checked(seed) == ""


def test_a_damper_that_sticks_now_and_then_in_a_disk():
    """Its stiffness without contacts is singular, perhaps but for rounding: no range of the mean from it."""
    solution = solve(floating_scene(10), frequency_hz=floating_scene(10).observe.band[0])
    assert solution.converged
    low, high = solution.mean_range
    assert np.isnan(low) or high - low <= 1e3 * solution.half_peak_to_peak


@pytest.mark.long
def test_the_rest_of_a_branch_by_points():
    """A drive by points ends where the branch does, as ratcheting; where a part stands costs no steps."""
    held, driven = (pulled(two_blades(), dof, 5.0) for dof in ("b1", "d"))
    for scene, start, stop in ((held, 310.0, 325.0), (driven, 300.0, 315.0)):
        branch = sweep(scene, start=start, stop=stop, harmonics=5)
        workspace, inside = Workspace.of(branch.balance), branch.balance.parameter.inside
        ends = float(inside(start)), float(inside(stop))
        first = next(walk_branch(workspace, start, stop, ContinuationSettings())).first(1)
        rest = joined(list(walk_by_points(workspace, first, ends[1], ends[1] - ends[0], 0.0)))
        assert rest.status is branch.status
        last = float(branch.balance.parameter.outside(rest.solutions[-1, -1]))
        assert last == pytest.approx(float(branch.values[-1]), abs=1e-4)
        assert len(rest.solutions) < 200


def test_a_branch_ends_before_a_mean_force_drives_a_part():
    """A point whose mean forces do not balance is no point of a branch, however small its residual."""
    scene = pulled(two_blades(), "b1", 30.0)
    workspace = Workspace.of(build(scene, harmonics=5))
    found = next(walk_branch(workspace, 250.0, 300.0, ContinuationSettings()))
    assert balanced_part(workspace, found) is found
    told = found.measures[:7, LOST].copy()
    # Far away, the contacts' mean forces are lost in the rounding of where the part stands.
    n = workspace.balance.n_coefficients
    found.solutions[7:, :-1:n] += 1e9 * workspace.balance.system.loose[0]
    other = Workspace.of(workspace.balance)
    for row, measures in zip(found.solutions, found.measures, strict=True):
        other.forces(u := row[:-1].copy(), float(row[-1]))
        # As the walk measures every point; where nothing was moved, to the last digit.
        measures[LOST] = unaccounted(other.system, other.linear, u, other.point)
    assert np.array_equal(found.measures[:7, LOST], told)
    cut = balanced_part(workspace, found)
    assert len(cut.solutions) == 7
    assert cut.status is BranchStatus.STALLED


@pytest.mark.long
@pytest.mark.parametrize("seed", [16, 46, 50, 197])
def test_what_ratchets_drifts_by_the_same_each_period(seed: int):
    """Time marching finds the drift where `solve` says there is no periodic motion."""
    scene = floating_scene(seed)
    low, high = scene.observe.band
    found = next(
        f for f in np.linspace(low, high, 41)
        if solve(scene, frequency_hz=float(f), harmonics=31).status is SolutionStatus.RATCHETS
    )  # fmt: skip
    marched = march(scene, frequency_hz=float(found), max_periods=20_000)
    assert marched.status is MarchStatus.RATCHETS
