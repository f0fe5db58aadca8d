"""Continuation: whole responses without a stall, any parameter both ways, folds, kinks, every way to end.

With a given load and a damped structure the response is unique: elastic Coulomb friction is monotone in the
velocity, and the closed form keeps that for any number of harmonics. So these branches have no folds; where
folds are wanted, the structure is given negative damping, which friction holds.
"""

import math
from collections.abc import Callable

import numpy as np
import pytest
from contact_cases import central_difference
from each import each
from lumped_structure import lumped
from scene_cases import bladed_disk, loose_mass, mixed_disk, oscillator, two_dof
from walked_branches import UNSTABLE, walked, with_damping

import solver
from solver import BranchStatus, ContinuationSettings, Predictor, Scene, march, solve, sweep
from solver.balance.balance import build
from solver.balance.kernels.output import RESIDUAL
from solver.balance.workspace import Workspace

RESPONSES: dict[str, Callable[[], Scene]] = {
    **{f"two-dof N1={N1:g}": lambda N1=N1: two_dof(N1=N1) for N1 in (0.0, 30.0, 200.0)},
    **{
        f"bladed-disk N0={N0:g}": lambda N0=N0: bladed_disk(N0=N0)
        for N0 in (40.0, 80.0, 100.0, 200.0, 500.0, 1000.0, 3000.0)
    },
    **{
        f"bladed-disk N1={N1:g}": lambda N1=N1: bladed_disk(N1=N1)
        for N1 in (0.0, 100.0, 200.0, 300.0, 400.0, 500.0)
    },
}
PATHS = {
    "damper.N0": (5.0, 400.0),
    "damper.N1": (-150.0, 150.0),
    "damper.N1_ratio": (0.0, 2.0),
    "damper.N1_phase": (-3.0, 3.0),
    "damper.kt": (3.0, 3000.0),
    "damper.mu": (0.01, 2.0),
    "excitation.amplitude": (10.0, 500.0),
    "excitation.phase": (-3.0, 3.0),
    "structure.k1": (50.0, 400.0),
    "structure.k2": (10.0, 100.0),
}
DISK_PATHS = {
    "shroud.N0": (20.0, 3000.0),
    "shroud.N1": (0.0, 400.0),
    "shroud.kt": (1e5, 1e8),
    "root.N0": (1.0, 5000.0),
    "root.kt": (2e5, 2e7),
    "structure.disk_next": (0.0, 1e6),
}


def band_of(scene: Scene) -> tuple[float, float]:
    return scene.observe.band


# Every scene with one predictor or two, each of the three with scenes of both kinds.
@pytest.mark.few(4)
@pytest.mark.parametrize("predictor", Predictor)
@pytest.mark.parametrize("name", RESPONSES)
def test_whole_responses(predictor: Predictor, name: str):
    """From end to end of the band, up and down, every point converged, nothing turned or stalled."""
    scene = RESPONSES[name]()
    low, high = band_of(scene)
    settings = ContinuationSettings(predictor=predictor)
    up = sweep(scene, settings=settings)
    down = sweep(scene, start=high, stop=low, settings=settings)
    for branch in (up, down):
        assert branch.status is BranchStatus.COMPLETED
        assert branch.residuals.max() <= 1e-9
        assert branch.folds == 0
        assert branch.stepped_over <= 2
        assert branch.values.min() == pytest.approx(low, rel=1e-15)
        assert branch.values.max() == pytest.approx(high, rel=1e-15)
        assert len(branch.values) < 1000
    assert up.peak is not None
    assert down.peak is not None
    assert up.peak.value == pytest.approx(down.peak.value, rel=1e-9)


def test_paper_band_of_two_dof():
    branch = sweep(two_dof(), start=0.2, stop=2.6)
    assert branch.reached
    assert (branch.values[0], branch.values[-1]) == (0.2, 2.6)


@pytest.mark.parametrize(
    "name", ["two-dof N1=30", "two-dof N1=200", "bladed-disk N0=200", "bladed-disk N1=400"]
)
def test_points_are_what_solving_gives(name: str):
    """In full stick the mean depends on the way there; everything else is the same."""
    scene = RESPONSES[name]()
    branch = sweep(scene)
    rng = np.random.default_rng(1)
    for i in rng.choice(len(branch.values), 12, replace=False):
        solution = solve(scene, frequency_hz=float(branch.values[i]))
        scale = solution.half_peak_to_peak
        assert branch.half_peak_to_peak[i] == pytest.approx(scale, rel=1e-7)
        np.testing.assert_allclose(branch.observed[i, 1:], solution.observed[1:], atol=1e-7 * scale)
        if "mean_undetermined" not in solution.flags:
            assert branch.amplitude[i] == pytest.approx(solution.max_abs, rel=1e-7)
            assert branch.mean[i] == pytest.approx(solution.mean, abs=1e-7 * scale)


@pytest.mark.parametrize(
    ("scene", "rel"),
    [(two_dof(), 1e-5), (two_dof(N1=200.0), 5e-5), (two_dof(N0=40.0, N1=20.0, N1_phase=1.0), 1e-5)],
    ids=["slipping", "separating", "out of phase"],
)
def test_points_against_time_marching(scene: Scene, rel: float):
    branch = sweep(scene, start=0.6, stop=2.6, harmonics=31)
    rng = np.random.default_rng(4)
    for i in rng.choice(len(branch.values), 3, replace=False):
        marched = march(scene, frequency_hz=float(branch.values[i]))
        assert marched.converged
        assert branch.half_peak_to_peak[i] == pytest.approx(marched.half_peak_to_peak, rel=rel)


@pytest.mark.parametrize(
    ("scene", "path", "ends", "frequency_hz"),
    [
        *[(two_dof(), path, ends, 1.05) for path, ends in PATHS.items()],
        *[(two_dof(N1=130.0), path, ends, 2.2) for path, ends in PATHS.items()],
        *[(bladed_disk(), path, ends, 755.0) for path, ends in DISK_PATHS.items()],
    ],
    ids=lambda value: value if isinstance(value, str) else None,
)
def test_any_parameter_both_ways(scene: Scene, path: str, ends: tuple[float, float], frequency_hz: float):
    """There and back: the same points as solving the scene with that value, and the same at both ends."""
    there = sweep(scene, path, *ends, frequency_hz=frequency_hz, harmonics=7)
    back = sweep(scene, path, ends[1], ends[0], frequency_hz=frequency_hz, harmonics=7)
    for branch in (there, back):
        assert branch.reached
        assert branch.residuals.max() <= 1e-9
        assert branch.values.min() == ends[0]
        assert branch.values.max() == ends[1]
        for i in (0, len(branch.values) // 2, -1):
            moved = scene.with_values({path: float(branch.values[i])})
            solution = solve(moved, frequency_hz=frequency_hz, harmonics=7)
            assert branch.half_peak_to_peak[i] == pytest.approx(solution.half_peak_to_peak, rel=1e-7)
    assert there.half_peak_to_peak[-1] == pytest.approx(back.half_peak_to_peak[0], rel=1e-8)
    assert there.half_peak_to_peak[0] == pytest.approx(back.half_peak_to_peak[-1], rel=1e-8)


@pytest.mark.parametrize("scene", [mixed_disk(), loose_mass()], ids=["mixed disk", "loose mass"])
def test_other_scenes(scene: Scene):
    branch = sweep(scene, harmonics=7)
    assert branch.reached
    assert branch.residuals.max() <= 1e-9


@pytest.mark.parametrize("count", [20, pytest.param(120, marks=pytest.mark.long)])
def test_random_oscillators(count: int):
    """Cusps at the edge of full stick, touching loads, stiff contacts, little damping: none turns back."""
    rng = np.random.default_rng(2)
    for _ in range(count):
        kt = 10.0 ** rng.uniform(-1.0, 1.5)
        contact = {
            "kt": kt,
            "mu": 0.3,
            "N0": 10.0 ** rng.uniform(-1.0, 2.0),
            "N1_ratio": float(rng.choice([0.0, 0.5, 0.9, 1.0, 1.2, 2.0, 5.0])),
            "N1_phase": rng.uniform(-3.14, 3.14),
        }
        scene = oscillator(contact, k=1.0, c=10.0 ** rng.uniform(-2.5, -1.0))
        branch = sweep(
            scene, start=0.03, stop=0.5 * math.sqrt(1.0 + kt), harmonics=int(rng.choice([3, 7, 11]))
        )
        assert branch.reached, contact
        assert branch.folds == 0
        assert branch.residuals.max() <= 1e-9


CUSPS = [
    ({"kt": 20.8052048774, "N0": 14.4829237142, "N1_ratio": 0.9, "N1_phase": -0.1923}, 0.01045436, 3),
    (
        {"kt": 18.68817628485532, "N0": 54.794177906445505, "N1_ratio": 1.2, "N1_phase": -2.3954},
        0.02200713,
        11,
    ),
    ({"kt": 14.2599290623, "N0": 16.8534847764, "N1_ratio": 1.0, "N1_phase": 2.8597}, 0.03126382, 7),
]


@pytest.mark.parametrize(("contact", "c", "harmonics"), CUSPS, ids=["full stick", "separation", "sharp peak"])
def test_cusps(contact: dict[str, float], c: float, harmonics: int):
    """The amplitude rises steeply and falls as steeply: the way on and the way back look alike."""
    scene = oscillator({"mu": 0.3, **contact}, k=1.0, c=c)
    branch = sweep(scene, start=0.03, stop=0.5 * math.sqrt(1.0 + contact["kt"]), harmonics=harmonics)
    assert branch.reached


@each("predictor", Predictor)
@each("harmonics", [3, 11, 21])
def test_the_known_kink(harmonics: int, predictor: Predictor):
    """Edge of full stick near 1.610 Hz, where both limits touch at once."""
    k1, k2 = 4.0 * math.pi**2, 2.0 * math.pi**2
    scene = two_dof(N1=30.0).with_values({"structure.k1": k1, "structure.k2": k2})
    settings = ContinuationSettings(predictor=predictor)
    for ends in ((0.2, 2.5), (2.5, 0.2), (1.58, 1.64)):
        branch = sweep(scene, start=ends[0], stop=ends[1], harmonics=harmonics, settings=settings)
        assert branch.reached
        assert branch.residuals.max() <= 1e-9
    changes = branch.values[1:][np.diff(branch.states[:, 0]) != 0]
    assert changes.size
    assert np.abs(changes - 1.610).min() < 0.005


@pytest.mark.parametrize(
    ("scene", "path", "ends", "frequency_hz"),
    [
        (two_dof(), "frequency", (0.9, 1.3), None),
        (two_dof(N1=150.0), "damper.N0", (60.0, 130.0), 1.1),
        (bladed_disk(), "shroud.N1", (20.0, 90.0), 755.0),
        (two_dof(), "structure.k2", (30.0, 50.0), 1.05),
    ],
    ids=["frequency", "N0", "N1", "spring"],
)
def test_tangents_against_solving_again(
    scene: Scene, path: str, ends: tuple[float, float], frequency_hz: float | None
):
    branch = sweep(scene, path, *ends, frequency_hz=frequency_hz, harmonics=7)
    workspace = Workspace.of(branch.balance)
    for i in (3, len(branch.values) // 2):
        u, p = branch.solutions[i, :-1], float(branch.solutions[i, -1])
        exact = branch.tangents[i, :-1] / branch.tangents[i, -1]

        def solution(x: float, u: np.ndarray = u, p: float = p) -> np.ndarray:
            return workspace.solve(p + x, u).u

        errors = [np.abs(central_difference(solution, step * p) - exact).max() for step in (1e-4, 1e-5, 1e-6)]
        assert min(errors) < 1e-6 * np.abs(exact).max()
        slope = branch.slopes[i] / branch.tangents[i, -1]
        measures = workspace.measure(u.copy(), p)
        assert measures is not None
        assert slope == pytest.approx(measures.values[3], rel=1e-8)


@each("predictor", Predictor)
@each(
    ("path", "damping", "ends", "frequency_hz", "turns"),
    [
        ("frequency", -0.02, (0.05, 0.4), None, (0.17265, 0.17113)),
        ("frequency", -0.05, (0.05, 0.4), None, (0.17254, 0.15851)),
        ("excitation.amplitude", -0.05, (0.1, 8.0), 0.17, (1.11, 0.80)),
        ("excitation.amplitude", -0.1, (0.1, 8.0), 0.17, (1.13, 0.30)),
        ("damper.N0", -0.05, (10.0, 1.0), 0.17, (4.50, 6.26)),
    ],
)
def test_folds_are_passed(
    path: str,
    damping: float,
    ends: tuple[float, float],
    frequency_hz: float | None,
    turns: tuple[float, float],
    predictor: Predictor,
):
    balance = with_damping(UNSTABLE, path, damping, frequency_hz)
    branch = walked(balance, *ends, predictor)
    assert branch.status is BranchStatus.COMPLETED
    assert branch.measures[:, RESIDUAL].max() <= 1e-9
    assert branch.turns == pytest.approx(turns, rel=0.02)
    assert branch.values[-1] == ends[1]
    # Between the folds there are three solutions, each its own.
    middle = float(np.mean(branch.turns))
    crossings = np.flatnonzero(np.diff(np.sign(branch.values - middle)))
    assert crossings.size == 3
    workspace = Workspace.of(balance)
    found = [workspace.solve(balance.parameter.inside(middle), branch.solutions[i, :-1]) for i in crossings]
    assert all(point.converged for point in found)
    sizes = sorted(float(np.abs(point.u).max()) for point in found)
    assert min(np.diff(sizes)) > 0.02 * sizes[0]


def test_a_branch_that_never_comes_back_turns():
    """With so much negative damping there is no small solution for light loads."""
    branch = walked(with_damping(UNSTABLE, "damper.N0", -0.1, 0.17), 10.0, 1.0)
    assert branch.status is BranchStatus.TURNED_BACK
    assert branch.turns == pytest.approx([4.42], abs=0.01)
    assert branch.values.max() <= 10.0
    assert "turned" in branch.status.value


def twins() -> Scene:
    """Two equal oscillators, weakly joined and equally driven."""
    return Scene.from_dict(
        {
            "name": "twins",
            "structure": lumped(
                {"a": 1.0, "b": 1.0}, ("a", "ground", 1.0, 0.05), ("b", "ground", 1.0, 0.05), ("a", "b", 0.01)
            ),
            "contacts": [
                {"name": dof, "between": [dof, "ground"], "kt": 0.5, "mu": 0.3, "N0": 5.0} for dof in "ab"
            ],
            "excitation": [{"dof": dof, "amplitude": 1.0} for dof in "ab"],
            "observe": {"dof": "a", "band": [0.05, 0.4]},
        }
    )


def test_branch_points_are_passed_straight_on():
    """Equal motion of both stays a solution where unequal motion branches off it."""
    balance = with_damping(twins(), "frequency", -0.02)
    branch = walked(balance, 0.05, 0.4)
    assert branch.status is BranchStatus.COMPLETED
    workspace = Workspace.of(balance)
    signs = []
    for solution in branch.solutions:
        _, point = workspace.evaluate(solution[:-1].copy(), float(solution[-1]))
        signs.append(np.linalg.slogdet(point.jacobian)[0])
    assert len(branch.turns) == 2
    assert np.count_nonzero(np.diff(signs)) == 4  # two folds, two branch points
    first, second = branch.solutions[:, :-1].reshape(len(branch.values), 2, -1).transpose(1, 0, 2)
    np.testing.assert_allclose(first, second, atol=1e-9 * np.abs(first).max())


def test_one_solution_whatever_the_guess():
    """Newton from wild guesses: no other solution is found, as the theory says."""
    rng = np.random.default_rng(8)
    for scene, frequency_hz in ((two_dof(N1=200.0), 1.198), (bladed_disk(N1=400.0), 755.0)):
        workspace = Workspace.of(build(scene, harmonics=7))
        omega = 2.0 * math.pi * frequency_hz
        truth = workspace.solve(omega).u
        reached = 0
        for _ in range(60):
            guess = truth + rng.normal(size=truth.size) * np.abs(truth).max() * 10.0 ** rng.uniform(-2.0, 1.0)
            found = workspace.solve(omega, guess)
            assert found.converged
            np.testing.assert_allclose(found.u, truth, atol=1e-7 * np.abs(truth).max())
            reached += 1
        assert reached == 60


@pytest.mark.parametrize("predictor", Predictor)
@pytest.mark.parametrize(("level", "damping"), [(0.3, -0.05), (0.5, -0.1)])
def test_folds_that_are_kinks_are_passed(level: float, damping: float, predictor: Predictor):
    """At the edge of full stick the branch turns back at a sharp corner, and later forward again."""
    scene = UNSTABLE.with_values({"excitation.amplitude": level})
    found = walked(with_damping(scene, "frequency", damping), 0.05, 0.4, predictor)
    assert found.status is BranchStatus.COMPLETED
    assert found.values[-1] == pytest.approx(0.4)
    turns = np.count_nonzero(np.diff(np.sign(np.diff(found.values))))
    assert turns >= 2
    assert turns % 2 == 0


def test_a_response_that_is_lost_from_one_end_is_followed_from_the_other():
    """Lightly pressed shrouds: from 280 Hz a sweep meets another branch, which turns and leaves the band."""
    scene = solver.load_scene("shroud-3d").with_values({"shroud.N0": 10.0})
    points: list[float] = []
    branch = solver.sweep(scene, on_points=lambda at, _: points.extend(at))
    assert branch.status is BranchStatus.COMPLETED
    assert (branch.values[0], branch.values[-1]) == (520.0, 280.0)
    assert branch.measures[:, RESIDUAL].max() <= 1e-9
    assert points[0] == 520.0
    # Given where to begin it stays there.
    lost = solver.sweep(scene, guess=np.zeros(branch.balance.n_unknowns))
    assert lost.status is BranchStatus.TURNED_BACK
