"""Steps in leading motions are those of all motions; solutions are those of full matrices and the march."""

import math

import numpy as np
import pytest
from many_contacts import nodes_on_modes, parallel_sliders, wedge_of_points

from solver import Effects, Scene, load_scene, march, plan, solve, sweep, track_peak
from solver.balance.balance import build
from solver.balance.kernels.jacobian import factorise, step_back, step_back_transposed
from solver.balance.workspace import Workspace
from solver.contacts.kernels.system import UNHELD, evaluation_by_value
from solver.linear.assembly import linear_model
from solver.linear.condensation import leading_ports
from solver.scene.scene_harmonics import spread
from solver.sensitivity.gradient import Sensitivities
from solver.studies.memory import dense_bytes

TWO_PI = 2.0 * math.pi
EVERY = Effects(every_port=True)
# Scene, frequency [Hz], harmonics.
CASES = [
    (nodes_on_modes(0), 1.3, 5),
    (nodes_on_modes(1), 2.1, 4),
    (nodes_on_modes(2, law="coulomb-3d"), 1.1, 3),
    (wedge_of_points(6), 318.0, 5),
    (parallel_sliders(), 1.1, 7),
]
NAMES = ["nodes", "other nodes", "circle", "floating wedge", "sliders"]


def _both(scene: Scene, harmonics: int) -> tuple[Workspace, Workspace]:
    few = Workspace.of(build(scene, harmonics=harmonics))
    all_of_them = Workspace.of(build(scene, harmonics=harmonics, effects=EVERY))
    assert few.balance.n_leading <= 0.75 * few.balance.n_ports
    assert all_of_them.balance.n_leading == few.balance.n_ports
    return few, all_of_them


@pytest.mark.parametrize("imaginary", [0.0, 1.0], ids=["real", "complex"])
def test_ports_follow_from_as_few_as_their_rank(imaginary: float) -> None:
    rng = np.random.default_rng(3)
    follow = rng.normal(size=(20, 5))
    rows = follow @ (rng.normal(size=(2, 5, 30)) + 1j * imaginary * rng.normal(size=(2, 5, 30)))
    rows *= 10.0 ** rng.uniform(-6.0, 6.0, size=30)  # modes have sizes of their own
    found = leading_ports(rows, rows.conj())
    assert found.leading.size == 5
    again = np.einsum("cr,srm->scm", found.span, rows[:, found.leading])
    np.testing.assert_allclose(again, rows, rtol=1e-10, atol=1e-12 * np.abs(rows).max(axis=(0, 1)).min())


def test_ports_that_differ_by_a_phase_alone_do_not_follow() -> None:
    """Factors of ports are real: what is out of phase with the others is another motion."""
    rng = np.random.default_rng(5)
    in_phase, beside = (rng.normal(size=(20, 3)) @ rng.normal(size=(3, 30)) for _ in range(2))
    rows = (in_phase + 1j * beside)[None]
    found = leading_ports(rows, rows.conj())
    assert found.leading.size == 6
    again = np.einsum("cr,srm->scm", found.span, rows[:, found.leading])
    np.testing.assert_allclose(again, rows, rtol=1e-10, atol=1e-12)


def test_independent_motions_are_all_kept() -> None:
    rows = np.random.default_rng(3).normal(size=(1, 12, 12)) + 0j
    found = leading_ports(rows, rows.conj())
    assert found.leading.tolist() == list(range(12))
    assert found.span.shape == (12, 0)


@pytest.mark.parametrize(("scene", "at_hz", "harmonics"), CASES, ids=NAMES)
def test_factors_solve_what_the_whole_jacobian_does(scene: Scene, at_hz: float, harmonics: int) -> None:
    few, whole = _both(scene, harmonics)
    p = TWO_PI * at_hz
    found = whole.solve(p)
    assert found.converged
    u = found.u + 1e-3 * np.abs(found.u).max() * np.random.default_rng(1).normal(size=found.u.size)
    _, here = whole.evaluate(u, p)
    J, slope = here.jacobian.copy(), here.dr_dp.copy()
    norm, point = few.evaluate(u, p)
    size = np.abs(u).max()
    np.testing.assert_allclose(point.residual, here.residual, rtol=0.0, atol=1e-11 * size)
    np.testing.assert_allclose(point.dr_dp, slope, rtol=0.0, atol=1e-10 * np.abs(slope).max())
    np.testing.assert_allclose(point.jacobian, J, rtol=0.0, atol=1e-11 * np.abs(J).max())
    assert norm > 0.0
    rng = np.random.default_rng(2)
    right, tangent = rng.normal(size=u.size + 1), rng.normal(size=u.size + 1)
    sign = factorise(few.system, few.linear, few.point, tangent, 0.0, 0.0)
    assert sign == np.linalg.slogdet(J)[0]
    direct, transposed = right[:-1].copy(), right[:-1].copy()
    step_back(few.system, few.point, direct)
    step_back_transposed(few.system, few.point, transposed)
    for solved, exact in ((direct, J), (transposed, J.T)):
        expected = np.linalg.solve(exact, right[:-1])
        np.testing.assert_allclose(solved, expected, rtol=0.0, atol=1e-8 * np.abs(expected).max())
    bordered = np.block([[J, slope[:, None]], [0.7 * tangent[None, :-1], np.array([[0.3 * tangent[-1]]])]])
    sign = factorise(few.system, few.linear, few.point, tangent, 0.7, 0.3)
    assert sign == np.linalg.slogdet(bordered)[0]
    solved, expected = right.copy(), np.linalg.solve(bordered, right)
    step_back(few.system, few.point, solved)
    np.testing.assert_allclose(solved, expected, rtol=0.0, atol=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize("every_port", [False, True], ids=["leading ports", "all ports"])
def test_a_step_leaves_a_gauge_as_it_is(every_port: bool) -> None:
    """dr/du l = l where nothing holds a wedge along l: what is asked of a step along l is what it does."""
    scene, effects = load_scene("platform-wedge"), Effects(every_port=every_port)
    workspace = Workspace.of(build(scene, harmonics=3, effects=effects))
    assert (workspace.balance.n_leading < workspace.balance.n_ports) is not every_port
    found = workspace.solve(TWO_PI * 345.0)
    assert found.converged
    norm, point = workspace.forces(found.u, TWO_PI * 345.0)
    assert norm <= 1e-9
    unheld = int(point.counts[UNHELD])
    assert unheld >= 1
    nothing = np.zeros(found.u.size + 1)
    assert factorise(workspace.system, workspace.linear, workspace.point, nothing, 0.0, 0.0) != 0.0
    for gauge in point.gauge[:unheld]:
        along = np.zeros((workspace.balance.n_ports, workspace.balance.n_coefficients))
        along[:, 0] = gauge
        step = along.ravel().copy()
        step_back(workspace.system, workspace.point, step)
        np.testing.assert_allclose(step, along.ravel(), rtol=0.0, atol=1e-9 * np.abs(along).max())


@pytest.mark.parametrize("every_port", [False, True], ids=["leading ports", "all ports"])
def test_what_slips_stays_where_it_would_stick_unloaded(every_port: bool) -> None:
    """A start anywhere along the gauge ends where kt u₀ and F₀ of the contacts balance along it."""
    effects = Effects(every_port=every_port)
    workspace = Workspace.of(build(load_scene("platform-wedge"), harmonics=3, effects=effects))
    omega = TWO_PI * 345.0
    found = workspace.solve(omega)
    _, point = workspace.forces(found.u, omega)
    kt, n = workspace.balance.system.shift, workspace.balance.n_coefficients
    gauge = point.gauge[: point.counts[UNHELD]].copy()
    moved = found.u.reshape(-1, n).copy()
    moved[:, 0] += (1e-3 * np.abs(found.u).max() / np.abs(gauge).max()) * gauge.sum(axis=0)
    moved[:, 1] *= 1.01  # so that a step is taken
    again = workspace.solve_from(omega, moved.ravel())
    assert again.converged
    _, point = workspace.forces(again.u, omega)
    pull = kt * again.u[::n] - point.F[:, 0]
    assert np.abs(gauge @ pull).max() <= 1e-6 * (np.abs(gauge) @ np.abs(kt * moved[:, 0])).max()
    np.testing.assert_allclose(again.u, found.u, rtol=0.0, atol=1e-7 * np.abs(found.u).max())


@pytest.mark.parametrize(("scene", "at_hz", "harmonics"), CASES, ids=NAMES)
def test_solutions_and_their_gradients_are_the_same(scene: Scene, at_hz: float, harmonics: int) -> None:
    few, whole = _both(scene, harmonics)
    one, other = (each.solve(TWO_PI * at_hz) for each in (few, whole))
    assert one.converged
    assert other.converged
    np.testing.assert_allclose(one.u, other.u, rtol=0.0, atol=1e-10 * np.abs(other.u).max())
    owner = "damper" if scene.bodies else scene.contacts[0].name
    paths = [f"{owner}.{key}" for key in ("mu", "kt")]
    slopes = [
        Sensitivities(each.balance, paths).gradient(found.u, at_hz)
        for each, found in ((few, one), (whole, other))
    ]
    assert slopes[0].value == pytest.approx(slopes[1].value, rel=1e-10)
    np.testing.assert_allclose(slopes[0].by_parameters, slopes[1].by_parameters, rtol=1e-7)


@pytest.mark.parametrize(("scene", "at_hz", "harmonics"), CASES, ids=NAMES)
def test_motions_are_those_of_the_full_matrices(scene: Scene, at_hz: float, harmonics: int) -> None:
    """Z x = f − Lᵀ F in all coordinates, with the forces of the contacts at the solution."""
    few, _ = _both(scene, harmonics)
    omega = TWO_PI * at_hz
    found = few.solve(omega)
    assert found.converged
    point, ks = evaluation_by_value(few.point), few.balance.system.ks
    model = linear_model(few.balance.scene)
    n, L = model.K0.shape[0], np.real(model.contact_here)
    full = spread(point.F, ks, np.arange(ks[-1] + 1))
    motions = spread(found.u.reshape(point.F.shape), ks, np.arange(ks[-1] + 1))
    for k in range(int(ks[-1]) + 1):
        force, motion = full[:, :1] + 0j, motions[:, :1] + 0j
        if k > 0:
            force, motion = (
                part[:, 2 * k - 1 : 2 * k] - 1j * part[:, 2 * k : 2 * k + 1] for part in (full, motions)
            )
        driven = np.zeros(n, np.complex128)
        for term in model.forces:
            if term.harmonic == k:
                driven += term.amplitude * (np.exp(1j * term.phase) if k else 1.0) * term.vector
        Z = model.K0 + 1j * k * omega * model.C0 - (k * omega) ** 2 * model.M
        left = Z @ np.linalg.lstsq(Z, driven - L.T @ force[:, 0], rcond=None)[0] - (
            driven - L.T @ force[:, 0]
        )
        assert np.abs(left).max() <= 1e-9 * max(np.abs(driven).max(), np.abs(force).max())
        if np.linalg.matrix_rank(Z) == n:
            x = np.linalg.solve(Z, driven - L.T @ force[:, 0])
            np.testing.assert_allclose(L @ x, motion[:, 0], rtol=0.0, atol=1e-8 * np.abs(found.u).max())


def test_branches_are_the_same() -> None:
    scene = nodes_on_modes(0)
    one, other = (
        sweep(scene, start=0.9, stop=1.5, harmonics=3, effects=effects) for effects in (None, EVERY)
    )
    assert one.reached
    assert other.reached
    assert one.peak is not None
    assert other.peak is not None
    assert one.peak.value == pytest.approx(other.peak.value, rel=1e-10)
    assert one.peak.at == pytest.approx(other.peak.at, rel=1e-9)


def test_tracked_peaks_are_the_same() -> None:
    """Their steps are solved for in the leading motions, second derivatives and all."""
    scene = nodes_on_modes(0, law="elastic-normal")
    level = scene.excitation[0].amplitude
    one, other = (
        track_peak(scene, "excitation.amplitude", level, 1.5 * level, harmonics=3, checks=1, effects=effects)
        for effects in (None, EVERY)
    )
    for track in (one, other):
        assert track.reached
    for kind in ("peak", "frequency", "slope"):
        few, every = (getattr(track, kind)[[0, -1]] for track in (one, other))
        np.testing.assert_allclose(few, every, rtol=1e-7 if kind == "slope" else 1e-9)


def test_the_march_agrees() -> None:
    """Of one mass on many sliders: one motion leads ten."""
    scene = parallel_sliders()
    assert build(scene, harmonics=1).n_leading == 1
    solution = solve(scene, frequency_hz=1.1, harmonics=41)
    assert solution.converged
    marched = march(scene, frequency_hz=1.1)
    assert marched.converged
    assert solution.half_peak_to_peak == pytest.approx(marched.half_peak_to_peak, rel=1e-5)


def test_the_plan_says_what_a_step_is_solved_for() -> None:
    scene = nodes_on_modes(0)
    (found,) = [effect for effect in plan(scene).effects if effect.name.startswith("every motion")]
    assert not found.used
    assert "10 follow from 6" in found.reason
    (asked,) = [effect for effect in plan(scene, effects=EVERY).effects if effect.name == found.name]
    assert asked.used


def test_memory_follows_the_leading_motions() -> None:
    """A hundred nodes on 40 modes stay below the gigabyte that matrices of all unknowns would take."""
    scene = nodes_on_modes(0, nodes=100, modes=40, law="coulomb-3d")
    assert dense_bytes(scene, 5).total < 2**30
    several = nodes_on_modes(0, nodes=8, modes=40, law="coulomb-3d")
    point = evaluation_by_value(Workspace.of(build(several, harmonics=2)).point)
    assert point.jacobian.shape == (24 * 5, 24 * 5)  # nothing follows from others
    spanned = evaluation_by_value(Workspace.of(build(nodes_on_modes(0, nodes=20), harmonics=2)).point)
    assert spanned.jacobian.size == 0
    assert spanned.lu.shape == (6 * 5 + 1, 6 * 5 + 1)
