"""Stability: multipliers against closed forms, the marched return map, folds, growth in time."""

import json
import math
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np
import pytest
from mistuned_cases import VALUES, disk
from return_map import Return
from scene_cases import bladed_disk, loose_mass, oscillator, two_dof

from solver import (
    ContinuationSettings,
    Scene,
    SettingError,
    annulus,
    branch_stability,
    march,
    mistuned,
    solve,
    stability,
    sweep,
)
from solver.balance.balance import Balance, build
from solver.balance.workspace import Workspace
from solver.contacts.pieces.piece import StatePiece, spring
from solver.continuation.branches.sweep import walk_branch
from solver.jit.fourier import to_full
from solver.linear.assembly import linear_model
from solver.marching.kernels import taylor as kernel
from solver.marching.march_equations import equations_of_motion
from solver.response.solution import Solution
from solver.response.stability.floquet import scene_monodromy
from solver.response.stability.monodromy import PERIOD, LinearPart, Monodromy, PeriodElement, monodromy
from solver.response.stability.multipliers import Growth, growth_of

UNSTABLE = oscillator({"kt": 0.5, "mu": 0.3, "N0": 5.0}, k=1.0, c=0.05)


def poles(M: np.ndarray, C: np.ndarray, K: np.ndarray) -> np.ndarray:
    n = len(M)
    return np.linalg.eigvals(
        np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    )


def sorted_by_value(values: np.ndarray) -> np.ndarray:
    return np.sort_complex(np.round(values, 12))


def matrix_of(solution: Solution) -> Monodromy:
    motions = tuple(np.array(contact.motions) for contact in solution.contacts)
    return scene_monodromy(solution.scene, solution.frequency_hz, motions)


LINEAR = {
    "no friction": (two_dof(mu=0.0, N1=0.0), 0.0),
    "no load": (two_dof(N0=0.0, N1=0.0), 0.0),
    "stuck": (two_dof(N0=1e7), 30.0),
}


@pytest.mark.parametrize("name", LINEAR)
def test_linear_limits_have_the_multipliers_of_their_poles(name: str):
    scene, kt = LINEAR[name]
    solution = solve(scene, frequency_hz=1.3, harmonics=3)
    found, model = stability(solution), linear_model(scene)
    K = model.K0 + kt * model.contact_here.T @ model.contact_here
    expected = np.exp(poles(model.M, model.C0, K) / 1.3)
    moving = found.multipliers[np.abs(found.multipliers) > 1e-12]
    np.testing.assert_allclose(sorted_by_value(moving), sorted_by_value(expected), atol=1e-11)
    assert found.neutral == (1 if name == "stuck" else 0)
    assert found.stable
    assert found.radius == pytest.approx(np.abs(expected).max(), rel=1e-11)


@pytest.mark.few(6)
@pytest.mark.parametrize(
    ("scene", "frequency_hz", "harmonics"),
    [
        (two_dof(), 1.198, 101),
        (two_dof(N1=200.0), 1.198, 101),
        (two_dof(N1=150.0, N1_phase=1.0), 0.9, 101),
        (two_dof(N1=60.0), 0.5, 101),
        (loose_mass(), 1.2, 101),
        (mistuned(disk(sectors=4), of="root", values=VALUES[:4]), 3.4, 61),
        pytest.param(disk(2, N1=40.0), 3.3, 101, marks=pytest.mark.long),
        pytest.param(disk(1, "standing", sectors=3), 3.4, 61, marks=pytest.mark.long),
    ],
    ids=["slipping", "separating", "out of phase", "slow", "loose", "mistuned", "cyclic", "standing"],
)
def test_matrix_against_the_marched_return_map(scene: Scene, frequency_hz: float, harmonics: int):
    returns = Return(scene, frequency_hz, steps=512)
    found = matrix_of(solve(scene, frequency_hz=frequency_hz, harmonics=harmonics))
    assert found.sliders == tuple(returns.sliders)
    np.testing.assert_allclose(found.matrix, returns.jacobian(), atol=1e-5 * np.abs(found.matrix).max())


@pytest.mark.long
def test_multipliers_of_the_shipped_disk_do_not_depend_on_the_harmonics():
    few, many = (stability(solve(bladed_disk(), frequency_hz=755.0, harmonics=h)) for h in (21, 81))
    assert few.neutral == many.neutral == 8
    assert few.stable
    assert few.multipliers.size == 2 * 32 + 4
    assert few.radius == pytest.approx(many.radius, rel=1e-5)


@dataclass(frozen=True, kw_only=True)
class Point:
    """A periodic motion of the undamped oscillator's kin with negative damping."""

    slip: np.ndarray
    frequency_hz: float
    determinant: float
    matrix: np.ndarray
    multipliers: np.ndarray


def with_damping(damping: float, harmonics: int) -> Balance:
    balance = build(UNSTABLE, harmonics=harmonics)
    dampings = np.full_like(balance.system.dampings, damping)
    return replace(balance, system=balance.system._replace(dampings=dampings))


def states_of(slip: np.ndarray) -> tuple[StatePiece, ...]:
    (contact,) = UNSTABLE.contacts
    motions = slip[None, :]
    (part,) = contact.perturbed(motions, contact.normal_load(motions)) or ()
    return part.pieces


def negative_map(damping: float, frequency_hz: float, slip: np.ndarray) -> Monodromy:
    model = linear_model(UNSTABLE)
    structure = LinearPart(M=model.M, C=np.array([[damping]]), K=model.K0)
    element = PeriodElement(ports=model.contact_here, pieces=states_of(slip))
    return monodromy(structure, (element,), PERIOD * frequency_hz)


def branch_points(damping: float, start: float, stop: float, harmonics: int) -> list[Point]:
    """Every point of a branch of the oscillator with negative damping."""
    balance = with_damping(damping, harmonics)
    workspace, points = Workspace.of(balance), []
    for stretch in islice(walk_branch(Workspace.of(balance), start, stop, ContinuationSettings()), 20):
        for row in stretch.solutions:
            _, evaluation = workspace.evaluate(row[:-1].copy(), float(row[-1]))
            frequency_hz = float(row[-1]) / PERIOD
            slip = to_full(row[:-1], balance.system.ks, harmonics)
            found = negative_map(damping, frequency_hz, slip)
            points.append(
                Point(
                    slip=slip,
                    frequency_hz=frequency_hz,
                    determinant=float(np.linalg.slogdet(evaluation.jacobian)[0]),
                    matrix=found.matrix,
                    multipliers=np.linalg.eigvals(found.reduced),
                )
            )
    return points


@pytest.mark.parametrize("damping", [-0.05, pytest.param(-0.02, marks=pytest.mark.long)])
def test_a_multiplier_goes_through_one_at_each_fold(damping: float):
    """The determinant of the balance changes its sign where that of 1 - multipliers does."""
    points = branch_points(damping, 0.05, 0.4, 21)
    frequencies = [point.frequency_hz for point in points]
    assert np.count_nonzero(np.diff(np.sign(np.diff(frequencies)))) == 2
    beyond = np.array([np.prod(1.0 - point.multipliers).real for point in points])
    determinants = [point.determinant for point in points]
    assert np.sign(beyond).tolist() == determinants
    assert set(determinants) == {1.0, -1.0}
    between = [point.multipliers for point in points if point.determinant < 0.0]
    for multipliers in between:
        real = multipliers[np.abs(multipliers.imag) < 1e-9].real
        assert np.count_nonzero(real > 1.0) == 1
        assert growth_of(multipliers[np.argsort(-np.abs(multipliers))]) is Growth.FOLD


def trajectory(point: Point, damping: float, move: np.ndarray, periods: int) -> np.ndarray:
    """(x, v) at the ends of periods, from a point's motion moved by (x, v, place of the slider if held)."""
    omega, (contact,) = PERIOD * point.frequency_hz, UNSTABLE.contacts
    system = equations_of_motion(UNSTABLE, omega).system
    system = system._replace(B=system.B._replace(value=np.full_like(system.B.value, damping / omega)))
    orders = np.arange(1, point.slip.size // 2 + 1)
    x, v = point.slip[0] + point.slip[1::2].sum(), float(orders @ point.slip[2::2])
    (here,) = [piece for piece in states_of(point.slip) if piece.holds_at(0.0)]
    mode, force = (1 if v > 0.0 else -1), math.copysign(contact.mu * contact.N0, v)
    if here.memory:
        onset = point.slip[0] + sum(
            point.slip[2 * k - 1] * math.cos(k * here.begin) + point.slip[2 * k] * math.sin(k * here.begin)
            for k in orders
        )
        mode, force = kernel.STICK, math.copysign(contact.mu * contact.N0, onset) + contact.kt * (x - onset)
        force += contact.kt * (move[0] - move[2])
    state = kernel.State(
        np.array([x + move[0]]), np.array([v + move[1]]), np.array([force]), np.array([mode]),
        np.zeros((1, 1)),
    )  # fmt: skip
    one, many = np.zeros(0), np.zeros((1, 0))
    record = kernel.Record(one, one, many, many, many)
    states = [(state.x[0], state.v[0])]
    for _ in range(periods):
        kernel.run_periods(system, state, 256, 0.0, 0, record, np.empty(1))
        states.append((state.x[0], state.v[0]))
    return np.array(states)


@pytest.mark.parametrize("damping", [-0.05, pytest.param(-0.02, marks=pytest.mark.long)])
def test_perturbations_grow_and_decay_in_time_as_the_matrix_says(damping: float):
    """The motion between the folds is left, the small one is come back to."""
    points = branch_points(damping, 0.16, 0.18, 41)
    first = next(i for i, point in enumerate(points) if point.determinant < 0.0)
    between = [point for point in points if point.determinant < 0.0]
    small = max(points[:first], key=lambda point: -np.abs(point.multipliers).max())
    middle = between[len(between) // 2]
    for point, grows in ((small, False), (middle, True)):
        radius = np.abs(point.multipliers).max()
        assert (radius > 1.0) == grows
        values, vectors = np.linalg.eig(point.matrix)
        size = np.abs(point.slip).max()
        move = 1e-5 * size * vectors[:, np.abs(values).argmax()].real
        left, right = (trajectory(point, damping, sign * move, 4) for sign in (1.0, -1.0))
        for periods in range(1, 5):
            expected = 2.0 * (np.linalg.matrix_power(point.matrix, periods) @ move)[:2]
            np.testing.assert_allclose((left - right)[periods], expected, atol=2e-3 * np.abs(expected).max())
        later = trajectory(point, damping, 1e3 * move, 500)
        distance = np.abs(later - later[0]).max(axis=1)[-50:] / size
        assert (distance.min() > 0.1) if grows else (distance.max() < 0.02)


def driven_from_behind() -> Scene:
    """The oscillator with negative damping as a scene: a structure given by its matrices."""
    raw = UNSTABLE.to_dict()
    raw["structure"] = {"kind": "matrices", "M": [[1.0]], "K": [[1.0]], "C": [[-0.05]], "dofs": ["x"]}
    return Scene.from_dict(raw)


@pytest.mark.parametrize(
    ("frequency_hz", "growth", "neutral"),
    [(0.05, Growth.TORUS, 1), (0.17, Growth.TORUS, 1), (0.175, Growth.NONE, 0), (0.2, Growth.NONE, 0)],
)
def test_negative_damping_is_held_by_slip_alone(frequency_hz: float, growth: Growth, neutral: int):
    """Stuck, nothing takes out the power that negative damping puts in: another motion is reached."""
    scene = driven_from_behind()
    solution = solve(scene, frequency_hz=frequency_hz)
    found = stability(solution)
    marched = march(scene, frequency_hz=frequency_hz, max_periods=2000)
    assert found.growth is growth
    assert found.neutral == neutral
    if found.stable:
        assert marched.converged
        assert marched.half_peak_to_peak == pytest.approx(solution.half_peak_to_peak, rel=1e-5)
    else:
        expected = np.exp(poles(np.eye(1), np.array([[-0.05]]), np.array([[1.5]])) / frequency_hz)
        np.testing.assert_allclose(np.sort_complex(found.multipliers), np.sort_complex(expected), rtol=1e-10)
        assert marched.half_peak_to_peak > 2.0 * solution.half_peak_to_peak


def test_friction_with_a_given_load_is_always_stable():
    rng = np.random.default_rng(5)
    for _ in range(40):
        contact = {
            "kt": 10.0 ** rng.uniform(-1.0, 1.5),
            "mu": 0.3,
            "N0": 10.0 ** rng.uniform(-1.0, 1.5),
            "N1_ratio": float(rng.choice([0.0, 0.5, 1.2, 3.0])),
            "N1_phase": rng.uniform(-3.0, 3.0),
        }
        scene = oscillator(contact, k=1.0, c=10.0 ** rng.uniform(-2.0, -1.0))
        found = stability(solve(scene, frequency_hz=10.0 ** rng.uniform(-1.5, 0.0)))
        assert found.stable, contact
        assert found.radius < 1.0


def test_the_sector_has_the_multipliers_of_the_annulus():
    scene = disk(2, N1=40.0)
    one, whole = (stability(solve(s, frequency_hz=3.3, harmonics=11)) for s in (scene, annulus(scene)))
    assert one.neutral == whole.neutral
    np.testing.assert_allclose(np.abs(one.multipliers), np.abs(whole.multipliers), atol=1e-8)


def test_one_sector_alone():
    """What would join the sector to itself is not there."""
    found = stability(solve(disk(0, sectors=1), frequency_hz=3.3, harmonics=5))
    assert found.stable
    assert found.multipliers.size + found.neutral in (4, 5)


def free_mass(N0: float) -> Scene:
    """A mass that nothing but a contact holds."""
    return Scene.from_dict(
        {
            "name": "free",
            "structure": {"kind": "lumped", "masses": {"a": 1.0},
                          "dampers": [{"between": ["a", "ground"], "c": 0.3}]},
            "contacts": [{"name": "c", "between": ["a", "ground"], "kt": 5.0, "mu": 0.5, "N0": N0}],
            "excitation": {"dof": "a", "amplitude": 3.0},
            "observe": {"dof": "a", "band": [0.1, 1.0]},
        }
    )  # fmt: skip


@pytest.mark.parametrize(("N0", "held"), [(100.0, 1), (2.0, 0)])
def test_neutral_multipliers(N0: float, held: int):
    """The slider of a stuck contact; the place of a mass that its slipping contact lets stand anywhere."""
    solution = solve(free_mass(N0), frequency_hz=0.3, harmonics=11)
    found, whole = stability(solution), matrix_of(solution)
    assert (solution.contacts[0].state.value == "stuck") == bool(held)
    assert found.neutral == 1
    assert found.stable
    assert found.radius < 1.0
    every = np.linalg.eigvals(whole.matrix)
    assert np.abs(every - 1.0).min() < 1e-12
    assert every.size == found.multipliers.size + 1


def test_points_of_branches():
    scene = two_dof()
    branch = sweep(scene, start=0.8, stop=1.3, harmonics=7)
    picked = [0, len(branch.values) // 2, -1]
    for i, found in zip(picked, branch_stability(branch, picked), strict=True):
        value = float(branch.values[i])
        single = stability(solve(scene, frequency_hz=value, harmonics=7))
        assert found.frequency_hz == value
        np.testing.assert_allclose(np.abs(found.multipliers), np.abs(single.multipliers), atol=1e-6)
    assert len(branch_stability(branch)) == len(branch.values)
    loads = sweep(scene, "damper.N0", 40.0, 80.0, frequency_hz=1.1, harmonics=7)
    (end,) = branch_stability(loads, [-1])
    single = stability(solve(scene.with_values({"damper.N0": 80.0}), frequency_hz=1.1, harmonics=7))
    assert end.frequency_hz == pytest.approx(1.1)
    np.testing.assert_allclose(np.abs(end.multipliers), np.abs(single.multipliers), atol=1e-6)
    with pytest.raises(SettingError, match="`points` must be indices of a branch"):
        branch_stability(branch, [len(branch.values)])


@pytest.mark.parametrize(
    ("multipliers", "growth"),
    [
        ([], Growth.NONE),
        ([0.9, 0.1], Growth.NONE),
        ([1.1, 0.1], Growth.FOLD),
        ([-1.1, 0.1], Growth.PERIOD_DOUBLING),
        ([0.9 + 0.9j, 0.9 - 0.9j], Growth.TORUS),
        ([1.0 + 1e-12], Growth.NONE),
    ],
)
def test_kinds_of_growth(multipliers: list[complex], growth: Growth):
    assert growth_of(np.array(multipliers, dtype=complex)) is growth


def test_a_preloaded_stop_changes_the_stiffness_only():
    """A contact without a slider: its multipliers are those of two springs in turn."""
    M, C, K = np.eye(1), np.array([[0.1]]), np.array([[1.0]])
    stop = spring(1.0, 3.0, np.array([[2.0]]))
    element = PeriodElement(ports=np.eye(1), pieces=(stop,))
    found = monodromy(LinearPart(M=M, C=C, K=K), (element,), 1.0)

    def over(angle: float, k: float) -> np.ndarray:
        values, vectors = np.linalg.eig(np.array([[0.0, 1.0], [-k, -0.1]]))
        return ((vectors * np.exp(values * angle)) @ np.linalg.inv(vectors)).real

    expected = over(PERIOD - 3.0, 1.0) @ over(2.0, 3.0) @ over(1.0, 1.0)
    np.testing.assert_allclose(found.matrix, expected, atol=1e-13)
    assert found.neutral == 0
    turned = stop.earlier(2.5)
    again = monodromy(LinearPart(M=M, C=C, K=K), (replace(element, pieces=(turned,)),), 1.0)
    np.testing.assert_allclose(
        np.sort_complex(np.linalg.eigvals(again.matrix)),
        np.sort_complex(np.linalg.eigvals(expected)),
        atol=1e-12,
    )


def test_json():
    obj = json.loads(json.dumps(stability(solve(two_dof(), frequency_hz=1.2)).to_json(), allow_nan=False))
    assert obj["stable"] is True
    assert obj["growth"] == "no perturbation grows"
    assert obj["radius"] == pytest.approx(abs(complex(*obj["multipliers"][0])))
    assert set(obj) == {"stable", "growth", "radius", "neutral", "multipliers", "frequency_hz", "seconds"}


def test_stability_in_the_json_of_a_solution_on_request_only():
    solution = solve(two_dof(), frequency_hz=1.2, harmonics=3)
    asked = solution.to_json(with_stability=True)
    assert "stability" not in solution.to_json()
    stable: object = stability(solution).to_json() | {"seconds": 0.0}
    assert asked["stability"] | {"seconds": 0.0} == stable  # type: ignore[operator]
    assert {key: value for key, value in asked.items() if key != "stability"} == solution.to_json()
    nothing = solve(
        oscillator({"kt": 0.3, "mu": 0.3, "N0": 0.5}, k=1.0), frequency_hz=0.5 / math.pi, harmonics=3
    )
    assert nothing.to_json(with_stability=True)["stability"] is None


def test_only_of_a_solution():
    scene = oscillator({"kt": 0.3, "mu": 0.3, "N0": 0.5}, k=1.0)
    with pytest.raises(SettingError, match="`solution` must have converged"):
        stability(solve(scene, frequency_hz=1.0 / (2.0 * math.pi), harmonics=3))
