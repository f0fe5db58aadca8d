"""Viscoelastic stiffness k_inf + Σ k_j iωτ_j / (1 + iωτ_j): judged by closed forms, NumPy, SciPy, marches."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from each import each
from lumped_structure import lumped
from scipy.integrate import solve_ivp

import optim
import solver
from solver.balance.balance import build
from solver.balance.workspace import Workspace
from solver.linear.assembly import linear_model, structure_derivative

HZ = 0.17


def branch(on: str, point: str, k: float, tau: float, of: str | None = None, **more: Any) -> dict[str, Any]:
    ends = {} if of is None else {"of": of}
    return {"kind": "maxwell", "on": on, "point": point, "k": k, "tau": tau, **ends, **more}


PADS = [
    branch("a", "z", 0.8, 1.3, name="pad"),
    branch("a", "y", 0.3, 0.4, of="b", name="mid"),
    branch("b", "w", 0.2, 5.0, of="a", name="mid_slow"),
]
SCENE: dict[str, Any] = {
    "name": "pads",
    "structure": lumped({"a": 1.0, "b": 0.7}, ("a", "ground", 1.0, 0.02), ("a", "b", 0.5)),
    "couplings": PADS,
    "contacts": [{"name": "d", "between": ["b", "ground"], "kt": 0.7, "mu": 0.5, "N0": 0.6}],
    "excitation": {"dof": "a", "amplitude": 0.5},
    "observe": {"dof": "b", "band": [0.05, 0.4]},
}


def scene(values: dict[str, float] | None = None, **more: Any) -> solver.Scene:
    return solver.Scene.from_dict({**SCENE, **more}).with_values(values or {})


@each("tau", [1e-3, 0.2, 1.0, 7.0, 1e4])
@each("hz", [0.05, 0.2, 1.7])
def test_an_oscillator_with_a_branch_is_its_closed_form(hz: float, tau: float) -> None:
    one = {
        "structure": lumped({"a": 2.0}, ("a", "ground", 3.0)), "contacts": [],
        "couplings": [branch("a", "z", 1.4, tau)], "observe": {"dof": "a", "band": [0.01, 2.0]},
    }  # fmt: skip
    omega = 2.0 * math.pi * hz
    stiffness = 3.0 + 1.4 * 1j * omega * tau / (1.0 + 1j * omega * tau) - 2.0 * omega**2
    found = solver.solve(scene(**one), frequency_hz=hz, harmonics=3)
    assert found.max_abs == pytest.approx(0.5 / abs(stiffness), rel=1e-10)


def random_matrix(rng: np.random.Generator) -> tuple[dict[str, Any], np.ndarray, list[Any]]:
    """One to five masses with random branches: the scene, M and K, and the branches as patterns, k and τ."""
    n = int(rng.integers(1, 6))
    dofs = [f"x{i}" for i in range(n)]
    masses = {dof: float(10.0 ** rng.uniform(-1, 1)) for dof in dofs}
    springs = [(dof, "ground", float(10.0 ** rng.uniform(-1, 1)), 0.01) for dof in dofs]
    couplings, patterns = [], []
    for i in range(int(rng.integers(1, 6))):
        on = int(rng.integers(n))
        of = int(rng.integers(n + 1))
        k, tau = float(10.0 ** rng.uniform(-3, 3)), float(10.0 ** rng.uniform(-4, 4))
        couplings.append(branch(dofs[on], f"p{i}", k, tau, of=None if of in (n, on) else dofs[of]))
        along = np.eye(n)[on]
        patterns.append((along if of in (n, on) else along - np.eye(n)[of], k, tau))
    raw = {
        "structure": lumped(masses, *springs), "couplings": couplings, "contacts": [],
        "excitation": {"dof": dofs[0], "amplitude": 1.0},
        "observe": {"dof": dofs[-1], "band": [0.01, 1.0]},
    }  # fmt: skip
    K, C = np.diag([k for _, _, k, _ in springs]), 0.01 * np.eye(n)
    return raw, np.stack([np.diag(list(masses.values())), K, C]), patterns


@each("seed", range(20))
def test_random_structures_are_the_complex_matrix(seed: int) -> None:
    rng = np.random.default_rng(seed)
    raw, (M, K, C), patterns = random_matrix(rng)
    omega = float(10.0 ** rng.uniform(-2, 1.5))
    Z = K + 1j * omega * C - omega**2 * M
    for along, k, tau in patterns:
        Z = Z + k * 1j * omega * tau / (1.0 + 1j * omega * tau) * np.outer(along, along)
    truth = np.linalg.solve(Z, np.eye(len(M))[0])[-1]
    found = solver.solve(scene(**raw), frequency_hz=omega / (2.0 * math.pi), harmonics=1)
    assert found.max_abs == pytest.approx(abs(truth), rel=1e-8)


def test_the_mean_sees_the_relaxed_stiffness() -> None:
    load = [{"dof": "a", "amplitude": 0.5}, {"dof": "a", "amplitude": 0.3, "harmonic": 0}]
    found = solver.solve(scene(contacts=[], excitation=load), frequency_hz=HZ, harmonics=3)
    assert found.mean == pytest.approx(0.3, rel=1e-12)  # of a spring of 1 N/m: b hangs at a


def test_the_same_as_matrices() -> None:
    M, K, C = np.diag([1.0, 0.7]), [[1.5, -0.5], [-0.5, 0.5]], [[0.02, 0.0], [0.0, 0.0]]
    given = {"kind": "matrices", "M": M.tolist(), "K": K, "C": C, "dofs": ["a", "b"]}
    found, other = (solver.solve(each, frequency_hz=HZ) for each in (scene(structure=given), scene()))
    assert found.max_abs == pytest.approx(other.max_abs, rel=1e-10)
    referee = solver.march(scene(structure=given), frequency_hz=HZ)
    assert referee.max_abs == pytest.approx(solver.march(scene(), frequency_hz=HZ).max_abs, rel=1e-8)


@pytest.mark.parametrize("base", [{"ground": {"a": 1.0, "b": 1.0}}, {"driven": {"a": 1.0}}])
def test_a_base_moves_them(base: dict[str, Any]) -> None:
    """Counted from the ground masses are pushed by −m y''; a driven DOF has the motion prescribed."""
    moved = {**base, "motion": "displacement", "amplitude": 0.3}
    given = scene({"d.N0": 1e6}, excitation=moved, observe={**SCENE["observe"], "relative": True})
    w = 2.0j * math.pi * HZ
    M, K = np.diag([1.0, 0.7]), np.array([[1.5, -0.5], [-0.5, 1.2]]) + 0j
    K[0, 0] += 0.02 * w
    for along, k, tau in (((1, 0), 0.8, 1.3), ((1, -1), 0.3, 0.4), ((1, -1), 0.2, 5.0)):
        K += k * w * tau / (1.0 + w * tau) * np.outer(along, along)
    Z = K + w**2 * M
    if "ground" in base:
        seen = np.linalg.solve(Z, -(w**2) * 0.3 * np.array([1.0, 0.7]))[1]
    else:
        seen = -Z[1, 0] * 0.3 / Z[1, 1] - 0.3
    found = solver.solve(given, frequency_hz=HZ, harmonics=1)
    assert found.max_abs == pytest.approx(abs(seen), rel=1e-9)
    assert solver.march(given, frequency_hz=HZ).max_abs == pytest.approx(abs(seen), rel=1e-5)
    assert solver.stability(found).stable is True


def test_slopes_of_the_matrices_are_differences() -> None:
    at = np.zeros(1, np.int64), np.ones(1, np.bool_)
    for path in ("pad.k", "pad.tau", "mid.tau", "structure.loss_factor"):
        given = scene(structure={**SCENE["structure"], "loss_factor": 0.1})
        value = given.value(path)
        slope = structure_derivative(given, path).at(*at)
        steps = (given.with_values({path: value + sign * 1e-3}) for sign in (1.0, -1.0))
        above, below = (linear_model(each).at(*at) for each in steps)
        for mine, high, low in zip(slope, above, below, strict=True):
            np.testing.assert_allclose(mine, (high - low) / 2e-3, atol=1e-10)


@pytest.mark.parametrize("path", ["pad.k", "pad.tau", "mid.k", "mid_slow.tau"])
def test_gradients_are_differences(path: str) -> None:
    found = solver.sweep(scene(), start=0.1, stop=0.25, harmonics=7)
    hz, u = float(found.values[4]), found.solutions[4][:-1]
    gradient = solver.Sensitivities(found.balance, [path]).gradient(u, hz).by_parameters[0]
    value, step = scene().value(path), 1e-5
    high, low = (
        solver.solve(scene({path: value + s}), frequency_hz=hz, harmonics=7).max_abs for s in (step, -step)
    )
    assert gradient == pytest.approx((high - low) / (2.0 * step), rel=1e-6)


def closed_amplitude(values: dict[str, float]) -> float:
    """Of b without friction, from the complex matrix."""
    omega, pads = 2.0 * math.pi * HZ, [{**pad} for pad in PADS]
    for path, value in values.items():
        next(pad for pad in pads if pad["name"] == path.split(".")[0])[path.split(".")[1]] = value
    own = np.array([[1.5 + 0.02j * omega - omega**2, -0.5], [-0.5, 0.5 - 0.7 * omega**2]])
    for pad, along in zip(pads, ([1.0, 0.0], [1.0, -1.0], [1.0, -1.0]), strict=True):
        turn = 1j * omega * pad["tau"]
        own += pad["k"] * turn / (1.0 + turn) * np.outer(along, along)
    return 0.5 * abs(np.linalg.inv(own)[1, 0])


def test_second_derivatives_are_differences_of_the_closed_form() -> None:
    """Also of a structure that has no contacts."""
    paths, start = ["pad.tau", "mid.k", "mid_slow.tau"], scene(contacts=[])
    balance = build(start, harmonics=1)
    found = Workspace.of(balance).solve(2.0 * math.pi * HZ)
    hessian = solver.Sensitivities(balance, paths).hessian(found.u, HZ).hessian
    for i, j in np.ndindex(3, 3):
        total, steps = 0.0, [1e-3 * start.value(paths[each]) for each in (i, j)]
        for a, b in np.ndindex(2, 2):
            moved = {path: start.value(path) for path in paths}
            moved[paths[i]] += (0.5 - a) * steps[0]
            moved[paths[j]] += (0.5 - b) * steps[1]
            total += (-1.0) ** (a + b) * closed_amplitude(moved)
        assert hessian[i, j] == pytest.approx(total / (steps[0] * steps[1]), rel=1e-5, abs=1e-8)


@pytest.mark.parametrize(
    "paths", [("pad.k", "pad.tau"), ("structure.k", "structure.loss_factor"), ("speed", "rotor.gyroscopic")]
)
def test_paths_whose_product_the_matrices_have_are_for_gradients(paths: tuple[str, str]) -> None:
    """There the second derivative of the matrices by both is not 0, as the Hessian takes it."""
    rotor = {"name": "rotor", "on": "a", "of": "b", "antisymmetric": True, "gyroscopic": 0.02}
    structure: Any = lumped({"a": 1.0, "b": 0.7}, ("a", "ground", 1.0, 0.02), ("a", "b", 0.5))
    structure = {**structure, "loss_factor": 0.03}
    structure["springs"][0]["name"] = "k"
    given = scene(structure=structure, couplings=[*PADS, rotor], speed=100.0)
    balance = build(given, harmonics=3)
    found = Workspace.of(balance).solve(2.0 * math.pi * HZ)
    for path in paths:
        assert np.isfinite(solver.Sensitivities(balance, [path, "d.N0"]).hessian(found.u, HZ).hessian).all()
    with pytest.raises(solver.SettingError, match="only gradients"):
        solver.Sensitivities(balance, paths).hessian(found.u, HZ)


@pytest.mark.parametrize("path", ["frequency", "pad.tau"])
def test_the_slope_of_the_balance_is_its_difference(path: str) -> None:
    balance = build(scene(), path, harmonics=7, frequency_hz=None if path == "frequency" else HZ)
    workspace, u = Workspace.of(balance), np.random.default_rng(1).normal(size=balance.n_unknowns)
    p = 2.0 * math.pi * HZ if path == "frequency" else 1.3
    exact = workspace.evaluate(u, p)[1].dr_dp.copy()
    high, low = (workspace.evaluate(u, p + s)[1].residual.copy() for s in (1e-6, -1e-6))
    np.testing.assert_allclose(exact, (high - low) / 2e-6, atol=1e-7 * np.abs(exact).max())


@pytest.mark.parametrize(("path", "stop"), [("pad.k", 3.0), ("pad.tau", 30.0)])
def test_a_sweep_in_its_numbers_ends_where_a_response_is(path: str, stop: float) -> None:
    start = scene().value(path)
    along = solver.sweep(scene(), path, frequency_hz=HZ, start=start, stop=stop, harmonics=7)
    there = solver.solve(scene({path: stop}), frequency_hz=HZ, harmonics=7)
    assert along.amplitude[-1] == pytest.approx(there.max_abs, rel=1e-8)


def test_the_balance_with_friction_is_what_marching_gives() -> None:
    found = solver.solve(scene(), frequency_hz=HZ, harmonics=51)
    referee = solver.march(scene(), frequency_hz=HZ)
    assert found.max_abs == pytest.approx(referee.max_abs, rel=1e-6)
    power = solver.power_balance(found)
    assert power.input_w == pytest.approx(power.viscous_w + power.friction_w, rel=1e-6)


def generator(stuck: float) -> np.ndarray:
    """The state matrix of positions, velocities and the elongations of the dashpots of z, y and w."""
    A = np.zeros((7, 7))
    A[0, 2] = A[1, 3] = 1.0
    forces = np.zeros((3, 7))  # k (difference of ends − elongation)
    forces[0, [0, 4]] = 0.8, -0.8
    forces[1, [0, 1, 5]] = 0.3, -0.3, -0.3
    forces[2, [1, 0, 6]] = 0.2, -0.2, -0.2
    A[2, :3], A[3, :2] = [-1.5, 0.5, -0.02], [0.5, -0.5 - stuck]
    A[2] += -forces[0] - forces[1] + forces[2]
    A[3] += forces[1] - forces[2]
    A[3] /= 0.7
    A[4:] = forces / np.array([[0.8 * 1.3], [0.3 * 0.4], [0.2 * 5.0]])
    return A


def test_a_run_from_rest_is_what_scipy_integrates() -> None:
    found = solver.transient(
        scene(contacts=[]), begin_hz=HZ, end_hz=HZ, ramp_seconds=60.0, from_rest=True, tolerance=1e-8
    )
    A, push = generator(0.0), np.eye(7)[2] * 0.5
    referee = solve_ivp(
        lambda t, s: A @ s + push * math.cos(2.0 * math.pi * HZ * t), (0.0, 60.0), np.zeros(7),
        method="DOP853", rtol=1e-10, atol=1e-12, max_step=0.02,
    )  # fmt: skip
    assert found.max_abs == pytest.approx(np.abs(referee.y[1]).max(), rel=1e-4)


@pytest.mark.parametrize("stuck", [0.7, 0.0])
def test_multipliers_are_those_of_the_first_order_equations(stuck: float) -> None:
    given = scene({"d.N0": 1e6}) if stuck else scene(contacts=[])
    judged = solver.stability(solver.solve(given, frequency_hz=HZ, harmonics=1))
    expected = np.exp(np.linalg.eigvals(generator(stuck)) / HZ)
    assert np.sort(np.abs(judged.multipliers)) == pytest.approx(np.sort(np.abs(expected)), abs=1e-9)


def test_a_disk_written_out_is_the_tuned_one() -> None:
    from solver.scene.cyclic.annulus import annulus

    shipped = solver.load_scene("bladed-disk")
    tip = shipped.observe.dof
    pads = [branch(tip, "z", 3e5, 2e-4, name="pad"), branch(tip, "y", 2e5, 1e-4, of=tip, offset=1)]
    disk = solver.Scene.from_dict({**shipped.to_dict(), "couplings": pads})
    whole = annulus(disk)
    assert solver.Scene.from_dict(whole.to_dict()) == whole
    tuned, written = (solver.solve(each, frequency_hz=750.0, harmonics=3) for each in (disk, whole))
    assert written.max_abs == pytest.approx(tuned.max_abs, rel=1e-8)
    finer, referee = (
        solver.solve(disk, frequency_hz=735.0, harmonics=31),
        solver.march(disk, frequency_hz=735.0),
    )
    assert finer.half_peak_to_peak == pytest.approx(referee.half_peak_to_peak, rel=1e-5)
    without = solver.solve(shipped, frequency_hz=750.0, harmonics=3).max_abs
    assert abs(tuned.max_abs / without - 1.0) > 0.02


def test_a_relaxation_time_is_designed() -> None:
    found = optim.design(scene(), variables={"d.N0": (0.1, 4.0), "pad.tau": (0.1, 10.0)}, harmonics=5)
    assert found.reached, found.status
    best = found.optimum

    def peak(**factors: float) -> float:
        changed = {path: best[path] * factors.get(path[-2:], 1.0) for path in best}
        return solver.sweep(scene(changed), harmonics=5).peak.value

    assert found.peak.value == pytest.approx(peak(), rel=1e-6)
    assert found.peak.value <= min(peak(N0=0.95), peak(N0=1.05), peak(au=0.9), peak(au=1.1))


def test_a_nonlinear_mode_of_stuck_contacts_is_the_eigenvalue() -> None:
    found = solver.nonlinear_mode(scene({"d.N0": 1e6}), 1, amplitudes=[0.1, 0.2], harmonics=1)
    M, K, omega = np.diag([1.0, 0.7]), np.array([[1.5, -0.5], [-0.5, 1.2]]), 1.0
    for _ in range(60):  # K(ω) φ = ω² (1 + 2iζ) M φ, the first of them
        D = K + 1j * omega * np.diag([0.02, 0.0])
        for along, k, tau in (((1, 0), 0.8, 1.3), ((1, -1), 0.3, 0.4), ((1, -1), 0.2, 5.0)):
            D = D + k * 1j * omega * tau / (1.0 + 1j * omega * tau) * np.outer(along, along)
        value = min(np.linalg.eigvals(np.linalg.solve(M, D)), key=abs)
        omega = math.sqrt(value.real)
    assert 2.0 * math.pi * found.frequency_hz[0] == pytest.approx(omega, rel=1e-8)
    assert found.damping_ratio[0] == pytest.approx(value.imag / (2.0 * value.real), rel=1e-8)


def test_what_is_wrong_is_told() -> None:
    wrong = [branch("q", "a", -1.0, 1.0), branch("a", "z", 1.0, 1.0, of="a"), branch("a", "z", 1.0, 1.0)]
    with pytest.raises(solver.SceneError) as refused:
        scene(couplings=wrong)
    said = {issue.pointer: issue.said() for issue in refused.value.issues}
    assert "there is no DOF 'q'" in said["/couplings/0/on"]
    assert "that of another DOF" in said["/couplings/0/point"]
    assert "must be > 0" in said["/couplings/0/k"]
    assert "two different ends" in said["/couplings/1"]
    assert "is taken by /couplings/1/point" in said["/couplings/2/point"]
    with pytest.raises(solver.SettingError, match=r"`pad.tau` must be a number > 0"):
        scene({"pad.tau": 0.0})
    with pytest.raises(solver.SettingError, match=r"point without inertia"):
        solver.solve(scene({"d.kt": math.inf}), frequency_hz=HZ)
    joined = scene(contacts=[{**SCENE["contacts"][0], "between": ["z", "ground"]}])
    with pytest.raises(solver.SettingError, match=r"must not be a point without inertia"):
        solver.march(joined, frequency_hz=HZ)
    with pytest.raises(solver.SettingError, match=r"must not join a point without inertia"):
        solver.stability(solver.solve(joined, frequency_hz=HZ))
