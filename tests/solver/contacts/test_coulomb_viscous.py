"""Friction with a dashpot that acts while it sticks: closed forms, `coulomb`, brute force, the march."""

from __future__ import annotations

import math
import pickle
from typing import Any

import numpy as np
import pytest
from lumped_structure import lumped

import solver
from solver.contacts.kernels.columns import OMEGA
from solver.contacts.kernels.laws import law_force, law_number
from solver.contacts.kernels.stick_slip_events import SEGMENT
from solver.contacts.laws.history.coulomb_viscous import ViscousContact
from solver.jit import fourier
from solver.jit.trig_polynomial import grid_size, grid_tables
from solver.response.wear import contact_wear

HZ = 0.2
VISCOUS: dict[str, Any] = {
    "name": "d", "law": "coulomb-viscous", "between": ["b", "ground"], "kt": 0.7, "c": 0.2, "mu": 0.5,
    "N0": 0.6,
}  # fmt: skip


def scene(force: float = 0.5, **contact: Any) -> solver.Scene:
    given = {key: value for key, value in {**VISCOUS, **contact}.items() if value is not None}
    return solver.Scene.from_dict(
        {
            "name": "damped",
            "structure": lumped({"a": 1.0, "b": 0.5}, ("a", "ground", 1.0, 0.02), ("a", "b", 0.6, 0.01)),
            "contacts": [given],
            "excitation": {"dof": "a", "amplitude": force},
            "observe": {"dof": "a", "band": [0.05, 0.4]},
        }
    )


@pytest.mark.parametrize("hz", [0.05, 0.2, 0.6])
@pytest.mark.parametrize("c", [0.0, 0.01, 0.3, 20.0])
def test_what_sticks_is_a_spring_and_a_dashpot(c: float, hz: float) -> None:
    omega = 2.0 * math.pi * hz
    a, b = 1.0 + 0.02j * omega, 0.6 + 0.01j * omega
    Z = np.array([[a + b - omega**2, -b], [-b, b + 0.7 + 1j * omega * c - 0.5 * omega**2]])
    found = solver.solve(scene(c=c, N0=1e6), frequency_hz=hz, harmonics=3)
    assert found.max_abs == pytest.approx(0.5 * abs(np.linalg.inv(Z)[0, 0]), rel=1e-10)


def test_without_the_dashpot_it_is_coulomb_with_separation_too() -> None:
    for load in ({}, {"N1": 0.9, "N1_phase": 0.4}):
        one, other = (
            solver.solve(scene(**load, law=law, c=c), frequency_hz=HZ, harmonics=11)
            for law, c in (("coulomb-viscous", 0.0), ("coulomb", None))
        )
        assert one.converged
        assert one.max_abs == pytest.approx(other.max_abs, rel=1e-9)


def random_case(seed: int) -> tuple[solver.Scene, float]:
    """Loss factors of the contact from 0.003 to 10, from far below to far above its limit."""
    rng = np.random.default_rng(seed)
    hz, k = rng.uniform(0.06, 0.35), 10.0 ** rng.uniform(-1.5, 1.5)
    c = 10.0 ** rng.uniform(-2.5, 1.0) * k / (2.0 * math.pi * hz)
    force = 10.0 ** rng.uniform(-1.0, 0.5)
    return scene(force, kt=k, c=c, N0=10.0 ** rng.uniform(-1.3, 0.7)), hz


@pytest.mark.few(24)
@pytest.mark.parametrize("seed", range(24))
def test_the_balance_is_what_marching_gives(seed: int) -> None:
    """Where it sticks all the time a mean may be left from how it began, and the answer says so."""
    given, hz = random_case(seed)
    found, referee = solver.solve(given, frequency_hz=hz, harmonics=15), solver.march(given, frequency_hz=hz)
    assert found.converged
    assert referee.converged
    near = 3.0 * found.error_estimate + 2e-6 * referee.half_peak_to_peak
    assert found.half_peak_to_peak == pytest.approx(referee.half_peak_to_peak, abs=near)
    assert (found.contacts[0].state.name == "STUCK") == ("mean_undetermined" in found.flags)
    if "mean_undetermined" not in found.flags:
        assert found.max_abs == pytest.approx(referee.max_abs, abs=near)


def brute(U: np.ndarray, load: np.ndarray, contact: ViscousContact, omega: float, count: int) -> np.ndarray:
    """The force over the second of two periods of a motion, cut at the limit in small steps."""
    tau = np.linspace(0.0, 4.0 * np.pi, 2 * count, endpoint=False)
    top = (U.size - 1) // 2
    k = np.repeat(np.arange(1, top + 1), 2)
    basis = fourier.basis(tau, top)
    turned = np.zeros_like(basis)  # its derivative by τ
    turned[:, 1::2], turned[:, 2::2] = -k[::2] * basis[:, 2::2], k[::2] * basis[:, 1::2]
    held = contact.kt * (basis @ U) + contact.c * omega * (turned @ U)
    limit = contact.mu * (fourier.basis(tau, (load.size - 1) // 2) @ load)
    force, slipped = np.zeros(tau.size), 0.0  # kt w
    for i in range(tau.size):
        bound = max(limit[i], 0.0)
        force[i] = min(max(held[i] - slipped, -bound), bound)
        slipped = held[i] - force[i]
    return force[count:]


def test_a_contact_in_another_process_is_the_same() -> None:
    """Also one given by functions, whose class is made; the frequency that neither knows is no NaN."""
    dahl = {"name": "e", "law": "dahl", "between": ["a", "ground"], "sigma": 2.0, "limit": 0.4}
    given = solver.Scene.from_dict({**scene().to_dict(), "contacts": [VISCOUS, dahl]})
    assert pickle.loads(pickle.dumps(given)) == given


@pytest.mark.parametrize("load", [{}, {"N1": 0.9, "N1_phase": 0.4}])
def test_shares_of_the_period_are_those_of_small_steps(load: dict[str, float]) -> None:
    """Those of wear, in which the frequency counts."""
    given = scene(1.0, **load)
    found = solver.solve(given, frequency_hz=HZ, harmonics=15)
    assert found.converged
    contact, count = given.contacts[0], 40_000
    assert isinstance(contact, ViscousContact)
    motions, normal = found.contacts[0].motions, contact.load.coefficients
    force = brute(motions[0], normal, contact, 2.0 * math.pi * HZ, count)
    tau = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    limit = contact.mu * np.maximum(fourier.basis(tau, (normal.size - 1) // 2) @ normal, 0.0)
    slip, separation = (np.abs(force) >= limit * (1.0 - 1e-9)) & (limit > 0.0), limit == 0.0
    shares = contact_wear(found)["d"].shares
    assert shares is not None
    wanted = (float(np.mean(~slip & ~separation)), float(np.mean(slip)), float(np.mean(separation)))
    assert 0.0 < wanted[0] < 1.0
    assert tuple(shares) == pytest.approx(wanted, abs=3e-4)


@pytest.mark.parametrize("seed", range(6))
def test_force_and_derivatives_of_random_motions_are_those_of_small_steps(seed: int) -> None:
    """Loads that vary and open the contact, and the Jacobian, parameters and frequency by differences."""
    rng = np.random.default_rng(seed)
    n, omega = 11, 10.0 ** rng.uniform(-1, 1)
    U, load = rng.normal(size=n), np.array([1.0, *rng.normal(size=2)])
    numbers = {"kt": 1.0, "c": 10.0 ** rng.uniform(-2, 1) / omega, "mu": 0.7}
    contact = ViscousContact(
        law="coulomb-viscous", name="d", between=("a", "ground"), N0=1.0, **numbers
    ).at_frequency(omega)  # fmt: skip
    count = 20_000
    force = brute(U, load, contact, omega, count)
    tau = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    np.testing.assert_allclose(
        contact.force_at(U[None, :], load, tau), force, atol=2e-3 * np.abs(force).max()
    )
    F, dF_dU, _ = kernel(U, load, contact, omega)
    basis = fourier.basis(tau, (n - 1) // 2)
    wanted = 2.0 * (basis.T @ force) / count
    wanted[0] *= 0.5
    np.testing.assert_allclose(F, wanted, atol=1e-4 * np.abs(wanted).max())
    step = 1e-6
    for i, unit in enumerate(np.eye(n)):
        high, low = (kernel(U + s * unit, load, contact, omega)[0] for s in (step, -step))
        np.testing.assert_allclose(dF_dU[:, i], (high - low) / (2.0 * step), atol=2e-4)
    columns = {key: contact.PARAMETERS[key].column for key in numbers} | {"omega": OMEGA}
    for key, column in columns.items():
        value = omega if key == "omega" else getattr(contact, key)
        moved = [value * (1.0 + s) for s in (step, -step)]
        high, low = (
            kernel(U, load, contact, each)[0] if key == "omega"
            else kernel(U, load, contact.model_copy(update={key: each}), omega)[0]
            for each in moved
        )  # fmt: skip
        slope = kernel(U, load, contact, omega, column)[2]
        difference = (high - low) / (2.0 * step * value)
        np.testing.assert_allclose(slope, difference, atol=2e-4 * (1.0 + np.abs(difference).max()))


def kernel(
    U: np.ndarray, load: np.ndarray, contact: ViscousContact, omega: float, by: int | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Force, Jacobian and derivative by one column of its row."""
    n, top = U.size, (U.size - 1) // 2
    row = np.zeros(40)
    contact.fill(row, top)
    row[OMEGA] = omega
    slope = np.zeros(row.size)
    if by is not None:
        slope[by] = 1.0
    ks, load_ks = np.arange(top + 1), np.arange((load.size - 1) // 2 + 1)
    cosines, sines = grid_tables(grid_size(top), top)
    F, dF_dU, dF_dp = np.zeros((1, n)), np.zeros((1, n, n)), np.zeros((1, n))
    law_force(
        law_number(contact.kernel), U[None, :], ks, load, load_ks, row, slope, np.zeros(load.size), cosines,
        sines, np.zeros(400, SEGMENT), F, dF_dU, dF_dp,
    )  # fmt: skip
    return F[0], dF_dU[0], dF_dp[0]


def test_the_dashpot_is_designed_with_exact_gradients() -> None:
    start, paths = scene(N1=0.2), ["d.c", "d.kt", "d.mu", "d.N0", "d.N1"]
    found = solver.sweep(start, start=0.17, stop=0.171, harmonics=9)
    hz = float(found.values[0])
    gradient = solver.Sensitivities(found.balance, paths).gradient(found.solutions[0][:-1], hz).by_parameters
    for path, slope in zip(paths, gradient, strict=True):
        high, low = (
            solver.solve(
                start.with_values({path: start.value(path) + s}), frequency_hz=hz, harmonics=9
            ).max_abs
            for s in (1e-5, -1e-5)
        )
        assert slope == pytest.approx((high - low) / 2e-5, rel=1e-4, abs=1e-7), path


def test_what_it_cannot_do_is_said() -> None:
    with pytest.raises(solver.SettingError, match=r"`d.N1` must be constant beside a dashpot in stick"):
        solver.march(scene(N1=0.3), frequency_hz=HZ)
    with pytest.raises(solver.SceneError, match="`c` must be"):
        scene(c=-0.1)
    with pytest.raises(solver.SceneError, match="`c`"):
        scene(c=None)
    given = scene().contacts[0]
    with pytest.raises(solver.SettingError, match="must be one `at_frequency`"):
        given.force_at(np.ones((1, 3)), np.ones(1), np.zeros(1))
    assert given.second_kernel is None
    with pytest.raises(solver.SettingError, match=r"says how it is perturbed \(coulomb-viscous does not\)"):
        solver.stability(solver.solve(scene(), frequency_hz=HZ, harmonics=5))
    with pytest.raises(solver.SettingError, match=r"d .*coulomb-viscous"):
        solver.track_peak(scene(), parameter="d.N0", start=0.2, stop=0.8)
