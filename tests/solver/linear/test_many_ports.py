"""Receptances of many ports against plain sums and full matrices, and what is kept of them."""

import math

import numba
import numpy as np
import pytest

from benchmarks.classes import lap_joint
from benchmarks.problems import chain
from benchmarks.space import masses, plate
from solver import Effects, Scene, march, solve
from solver.balance.balance import build, more_harmonics
from solver.balance.workspace import Workspace
from solver.contacts.kernels.system import (
    DENSE,
    MODES,
    POLES,
    System,
    by_reference,
    evaluation_by_value,
    new_receptance,
    receptance_by_value,
)
from solver.continuation.extrema.error_estimate import truncation_error
from solver.jit import eigen
from solver.linear.assembly import linear_model
from solver.linear.kernels.receptance import PAIRS_UP_TO, fill_jets, new_jets, receptance
from solver.sensitivity.gradient import Sensitivities

TWO_PI = 2.0 * math.pi
PORTS, MODES_KEPT = 15, 24
_of_jets = numba.njit(lambda jets: jets.A)


def _random_system(kind: str, seed: int) -> System:
    """Return the system of a chain with other modes: real or not, poles of real structures or any."""
    rng = np.random.default_rng(seed)
    system = build(chain(PORTS, sliders=True), harmonics=4).system
    assert system.leading.size == PORTS > PAIRS_UP_TO
    form = MODES if "modes" in kind else POLES
    x, y = rng.normal(size=(2, 1, PORTS, MODES_KEPT)) + 1j * rng.normal(size=(2, 1, PORTS, MODES_KEPT))
    values = rng.uniform(0.5, 400.0, MODES_KEPT) + 0j
    if kind == "modes":
        x, y = x.real + 0j, y.real + 0j
    elif kind == "turning modes":
        y = x.conj()
    else:
        values = -rng.uniform(0.05, 0.5, MODES_KEPT) + 1j * rng.uniform(0.5, 20.0, MODES_KEPT)
    if kind == "poles of a real structure":  # the last two do not oscillate
        for m in range(0, MODES_KEPT - 2, 2):
            values[m + 1] = values[m].conjugate()
            x[..., m + 1], y[..., m + 1] = x[..., m].conj(), y[..., m].conj()
        values[-2:], x[..., -2:], y[..., -2:] = values[-2:].real, x[..., -2:].real, y[..., -2:].real
    observed, forces = rng.normal(size=(2, MODES_KEPT)) + 0j
    return system._replace(
        form=form, eigenvalues=values[None], dampings=rng.uniform(0.1, 0.4, (1, MODES_KEPT)),
        contact_modes=np.ascontiguousarray(x), contact_duals=np.ascontiguousarray(y),
        observe_modes=observed[None], modal_forces=np.tile(forces, (system.ks.size, 1)),
    )  # fmt: skip


def _summed(system: System, i: int, omega: float) -> np.ndarray:
    """Return Σ x yᵀ/d of harmonic number i."""
    speed = system.ks[i] * omega
    d = 1j * speed - system.eigenvalues[0]
    if system.form == MODES:
        d = system.eigenvalues[0] - speed**2 + 1j * speed * system.dampings[0]
    return (system.contact_modes[0] / d) @ system.contact_duals[0].T


@pytest.mark.parametrize("kind", ["modes", "turning modes", "poles", "poles of a real structure"])
@pytest.mark.parametrize("seed", [0, 1])
def test_products_are_the_sums_and_their_slopes(kind: str, seed: int) -> None:
    system, omega, step = _random_system(kind, seed), 3.3, 1e-5
    out, jets = new_receptance(by_reference(system)), new_jets(by_reference(system))
    receptance(by_reference(system), omega, out)
    fill_jets(by_reference(system._replace(kind=1, level_reference=1.0)), omega, 1.0, jets)
    A, orders = receptance_by_value(out).A, _of_jets(jets)
    for i in range(system.ks.size):
        exact = _summed(system, i, omega)
        before, after = _summed(system, i, omega - step), _summed(system, i, omega + step)
        slope, bend = (after - before) / (2.0 * step), (after - 2.0 * exact + before) / step**2
        size = np.abs(exact).max()
        np.testing.assert_allclose(A[0, i], exact, rtol=0.0, atol=1e-13 * size)
        np.testing.assert_allclose(A[1, i], slope, rtol=0.0, atol=1e-7 * max(np.abs(slope).max(), size))
        np.testing.assert_allclose(orders[0, i], exact, rtol=0.0, atol=1e-13 * size)
        np.testing.assert_allclose(orders[1, i], A[1, i], rtol=0.0, atol=1e-12 * np.abs(A[1]).max())
        np.testing.assert_allclose(orders[2, i], bend, rtol=0.0, atol=1e-3 * max(np.abs(bend).max(), size))


@pytest.mark.parametrize("form", [MODES, POLES, DENSE], ids=["modes", "poles", "matrices"])
def test_a_structure_parameter_and_the_frequency_move_it_as_differences_do(form: int) -> None:
    raw = chain(PORTS, sliders=True).to_dict()
    raw["structure"]["springs"][3]["name"] = "third"
    if form != MODES:
        raw["structure"]["dampers"] = [{"name": "pot", "between": ["m2", "m4"], "c": 3.0}]
    scene = Scene.from_dict(raw)
    path = "structure.third" if form == DENSE else "frequency"
    balance = build(scene, path, harmonics=3, frequency_hz=1.1 if form == DENSE else None)
    assert balance.system.form == form
    p = balance.parameter.inside(scene.value(path) if form == DENSE else 1.1)
    workspace, step = Workspace.of(balance), 1e-6 * p
    names = ("A", "u_linear", "B", "x_linear")
    sides = []
    for at in (p - step, p + step):
        found = workspace.receptance(at)
        sides.append({name: getattr(found, name)[0].copy() for name in names})
    found = workspace.receptance(p)
    for name in names:
        value, slope = getattr(found, name)
        differences = (sides[1][name] - sides[0][name]) / (2.0 * step)
        np.testing.assert_allclose(
            slope, differences, rtol=0.0, atol=1e-7 * max(np.abs(slope).max(), np.abs(value).max() / p)
        )


@pytest.mark.parametrize("nodes", [5, 16])
def test_a_joint_that_sticks_is_its_full_matrices(nodes: int) -> None:
    """Equal parts have poles that meet: they are found all the same."""
    scene, frequency = lap_joint(nodes, amplitude=3.0), 100.0
    found = solve(scene, frequency_hz=frequency, harmonics=3)
    assert found.converged
    assert all(contact.state.value == "stuck" for contact in found.contacts)
    model, omega = linear_model(scene), TWO_PI * frequency
    assert build(scene, harmonics=3).system.form == POLES
    kt = np.array([k for contact in scene.contacts for k in contact.stiffnesses])
    K = model.K0 + model.contact_here.T @ (kt[:, None] * model.contact_here)
    force = sum(term.amplitude * term.vector for term in model.forces if term.harmonic == 1)
    x = np.linalg.solve(K + 1j * omega * model.C0 - omega**2 * model.M, force)
    assert found.max_abs == pytest.approx(abs(model.observe @ x), rel=1e-10)
    assert found.newton_iterations <= 1


def test_nodes_that_slip_are_what_the_march_finds() -> None:
    scene = masses(6, "coulomb-3d")
    found = solve(scene, frequency_hz=0.9, harmonics=15)
    assert {contact.state.value for contact in found.contacts} == {"stuck", "stick and slip"}
    assert build(scene).n_leading > PAIRS_UP_TO
    marched = march(scene, frequency_hz=0.9)
    assert marched.converged
    assert found.half_peak_to_peak == pytest.approx(marched.half_peak_to_peak, rel=1e-7)


@pytest.mark.parametrize("amplitude", [40.0, 120.0, 200.0])
def test_contacts_in_space_that_stick_leave_the_newton_step(amplitude: float) -> None:
    scene = lap_joint(12, amplitude=amplitude)
    every = solve(scene, frequency_hz=100.0, harmonics=3, effects=Effects(every_contact=True))
    found = solve(scene, frequency_hz=100.0, harmonics=3)
    assert found.converged
    assert found.max_abs == pytest.approx(every.max_abs, rel=1e-10)
    assert found.error_estimate == pytest.approx(every.error_estimate, rel=1e-6)
    stuck = [contact.state.value == "stuck" for contact in found.contacts]
    assert all(stuck) == (amplitude == 40.0)
    workspace = Workspace.of(build(scene, harmonics=3))
    at = workspace.solve(TWO_PI * 100.0)
    workspace.measure(at.u, TWO_PI * 100.0)
    held = evaluation_by_value(workspace.point).counts[1]
    # A node may stick all the time with a pull left of when it slipped: that depends on the motion.
    assert 0 < held <= 3 * sum(stuck)
    assert held == 3 * len(stuck) or not all(stuck)


def test_what_was_filled_is_filled_anew_where_it_must_be() -> None:
    """At another frequency, for another parameter, and after a gradient, which turns it round in place."""
    balance = build(lap_joint(12, amplitude=120.0), harmonics=3)
    workspace, fresh = Workspace.of(balance), Workspace.of(balance)
    p = TWO_PI * 100.0
    exact = fresh.receptance(p).A.copy()
    for at in (p, 1.1 * p, p, p):
        found = workspace.receptance(at).A
    np.testing.assert_array_equal(found, exact)
    at = workspace.solve(p)
    assert at.converged
    slopes = Sensitivities(balance, ("c0.mu", "c11.kt"))
    first, second = (slopes.gradient(at.u, 100.0) for _ in range(2))
    np.testing.assert_array_equal(first.by_parameters, second.by_parameters)
    np.testing.assert_array_equal(workspace.receptance(p).A, exact)
    scaled = new_receptance(workspace.system)
    receptance(workspace.system, p, scaled)
    receptance_by_value(scaled).u_linear[...] = 7.0  # as the excitation is raised from nothing
    receptance(workspace.system, p, scaled)
    np.testing.assert_array_equal(receptance_by_value(scaled).u_linear, fresh.receptance(p).u_linear)


def test_eigenvectors_of_values_that_meet_belong_together() -> None:
    """Three equal oscillators with damping, coupled through nothing: left and right vectors are dual."""
    rng = np.random.default_rng(0)
    one = np.array([[-0.1, -3.0], [2.0, 0.0]])
    mixed = np.linalg.qr(rng.normal(size=(60, 60)))[0]
    state = mixed @ np.kron(np.eye(30), one) @ mixed.T
    values, left, right = eigen.two_sided(state)
    dual = left.conj().T @ right
    off = np.abs(dual - np.diag(np.diag(dual))).max()
    assert off <= 1e-9 * np.abs(np.diag(dual)).min()
    np.testing.assert_allclose((right * values) @ np.linalg.inv(right), state, atol=1e-9)


def test_matrices_see_the_mean_at_rest_with_more_harmonics_too() -> None:
    """Damping and inertia of the mean are none, also where the balance is widened for an estimate."""
    scene = lap_joint(2)
    few = build(scene, harmonics=2, effects=Effects(whole_matrices=True))
    assert few.system.form == DENSE
    wider = Workspace.of(more_harmonics(few, 9))
    built = Workspace.of(build(scene, harmonics=9, effects=Effects(whole_matrices=True)))
    for left, right in zip(wider.receptance(600.0), built.receptance(600.0), strict=True):
        np.testing.assert_allclose(left, right, rtol=1e-9, atol=1e-12 * np.abs(right).max())


def test_an_estimate_through_leading_ports_is_that_of_all() -> None:
    for scene, frequency in ((plate(25, 12), 1.1), (lap_joint(12, amplitude=120.0), 100.0)):
        balance = build(scene, harmonics=3)
        every = build(scene, harmonics=3, effects=Effects(every_port=True))
        at = Workspace.of(balance).solve(TWO_PI * frequency)
        assert at.converged
        few, all_of_them = (
            truncation_error(Workspace.of(each), at.u, TWO_PI * frequency) for each in (balance, every)
        )
        assert few.max_abs == pytest.approx(all_of_them.max_abs, rel=1e-6)
        assert few.half_peak_to_peak == pytest.approx(all_of_them.half_peak_to_peak, rel=1e-6)
