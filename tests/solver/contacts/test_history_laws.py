"""The laws given by functions: forces against closed forms and integrators, responses against the march.

The referees: closed loops of Dahl's and Iwan's elements, SciPy's DOP853 for the equation of Bouc and Wen,
quadrature for a regularised force, and time marching, which follows Iwan's sliders each by itself and
integrates the rates of the others in its own steps.
"""

import math
from typing import Any

import numpy as np
import pytest
from contact_cases import central_difference
from law_cases import Element, Force, evaluate, jacobian
from law_scene_cases import scene
from scipy.integrate import quad, solve_ivp

import solver
from solver.balance.balance import build
from solver.balance.workspace import Workspace
from solver.contacts.kernels import columns
from solver.contacts.laws.law_registry import laws
from solver.jit import fourier

OMEGA = 2.0 * math.pi * 0.19
IWAN: dict[str, Any] = {"law": "iwan", "limit": 0.8, "k": 2.0, "chi": -0.5, "beta": 0.3}
BOUC_WEN: dict[str, Any] = {
    "law": "bouc-wen", "k": 2.0, "alpha": 0.1, "beta": 0.9, "gamma": 0.4, "n": 1.5,
}  # fmt: skip
DAHL: dict[str, Any] = {"law": "dahl", "sigma": 2.0, "limit": 0.6, "k": 0.1}
TANH: dict[str, Any] = {"law": "coulomb-tanh", "mu": 0.3, "N0": 2.0, "v0": 0.4}
CASES = {"iwan": IWAN, "bouc-wen": BOUC_WEN, "dahl": DAHL, "coulomb-tanh": TANH}


def row_of(given: dict[str, Any], highest: int) -> np.ndarray:
    (contact,) = scene(given).contacts
    row = np.zeros(columns.COLUMNS)
    contact.fill(row, highest)
    row[columns.OMEGA] = OMEGA
    return row


def force_of(given: dict[str, Any], U: np.ndarray, slope: np.ndarray | None = None) -> Force:
    return evaluate(element_of(given, U), slope)


def element_of(given: dict[str, Any], U: np.ndarray) -> Element:
    law = laws()[given["law"]]
    return Element(law=law.KERNEL, U=U[None], row=row_of(given, max((U.size - 1) // 2, 1)))


def random_motion(seed: int, harmonics: int = 5) -> np.ndarray:
    count = 2 * harmonics + 1
    return np.random.default_rng(seed).normal(size=count) / (1.0 + np.arange(count)) ** 1.2


@pytest.mark.parametrize("case", CASES)
def test_the_kernel_has_the_derivatives_of_its_force(case: str) -> None:
    """But for what lies between the nodes, which do not move along."""
    given = {**CASES[case], "samples": 1024}
    element = element_of(given, random_motion(3))
    here = evaluate(element)
    size = np.abs(jacobian(here)).max()

    def moved(row: np.ndarray, U: np.ndarray) -> np.ndarray:
        return evaluate(Element(law=element.law, U=U, row=row)).F[0]

    for i, unit in enumerate(np.eye(element.U.size)):
        slope = central_difference(lambda x, d=unit: moved(element.row, element.U + x * d), 1e-5)
        assert jacobian(here)[:, i] == pytest.approx(slope, abs=(5e-3 if case == "iwan" else 2e-4) * size)
    law = laws()[case]
    for column in [*(quantity.column for quantity in law.PARAMETERS.values()), columns.OMEGA]:
        unit = np.eye(columns.COLUMNS)[column]
        slope = central_difference(lambda x, d=unit: moved(element.row + x * d, element.U), 1e-6)
        found = evaluate(element, unit).dF_dp[0]
        assert found == pytest.approx(slope, abs=1e-6 * max(np.abs(slope).max(), 1e-3))


@pytest.mark.parametrize("case", CASES)
def test_the_negative_motion_has_the_negative_force(case: str) -> None:
    U = random_motion(4)
    assert pytest.approx(-force_of(CASES[case], U).F, abs=1e-9) == force_of(CASES[case], -U).F


def test_dahls_loop_is_the_closed_one() -> None:
    """With exponent 1: f = Fc − (Fc + fm) exp(−σ (u + U)/Fc) as it rises, fm = Fc tanh(σ U/Fc)."""
    sigma, limit, size = 2.0, 0.6, 0.35
    U = np.zeros(11)
    U[1] = size
    F = force_of({"law": "dahl", "sigma": sigma, "limit": limit, "samples": 1024}, U).F[0]
    top = limit * math.tanh(sigma * size / limit)
    decay = math.exp(-2.0 * sigma * size / limit)
    rising = 2.0 * size * limit - (limit + top) * limit / sigma * (1.0 - decay)
    assert -math.pi * size * F[2] == pytest.approx(2.0 * rising, rel=1e-7)

    def in_phase(tau: float) -> float:  # from −U at τ = −π to U at τ = 0
        return (limit - (limit + top) * math.exp(-sigma * (size * math.cos(tau) + size) / limit)) * math.cos(
            tau
        )

    assert F[1] == pytest.approx(2.0 / math.pi * quad(in_phase, -math.pi, 0.0)[0], rel=1e-7)


def test_bouc_wen_is_what_an_integrator_gives() -> None:
    U = random_motion(7, 3)
    top, k, alpha, beta, gamma, n = 3, 2.0, 0.1, 0.9, 0.4, 1.5

    def motion(tau: float) -> tuple[float, float]:
        waves = range(1, top + 1)
        u = U[0] + sum(U[2 * q - 1] * math.cos(q * tau) + U[2 * q] * math.sin(q * tau) for q in waves)
        v = sum(q * (U[2 * q] * math.cos(q * tau) - U[2 * q - 1] * math.sin(q * tau)) for q in waves)
        return u, v

    def rate(tau: float, z: np.ndarray) -> list[float]:
        v = motion(tau)[1]
        return [v - beta * abs(v) * abs(z[0]) ** (n - 1.0) * z[0] - gamma * v * abs(z[0]) ** n]

    count, turns = 8192, 24
    tau = np.linspace(0.0, 2.0 * math.pi, count, endpoint=False)
    z0 = 0.0
    for turn in range(turns):
        at = tau if turn == turns - 1 else None
        found = solve_ivp(
            rate, (0.0, 2.0 * math.pi), [z0], method="DOP853", rtol=1e-9, atol=1e-11, max_step=0.1, t_eval=at
        )
        z0 = float(found.y[0, -1])
    u = np.array([motion(t)[0] for t in tau])
    force = k * (alpha * u + (1.0 - alpha) * found.y[0])
    expected = 2.0 / count * (fourier.basis(tau, top).T @ force)
    expected[0] *= 0.5
    found_there = force_of({**BOUC_WEN, "samples": 1024}, U).F[0]
    assert found_there == pytest.approx(expected, abs=2e-6)


def test_a_regularised_force_is_its_integral() -> None:
    U = np.zeros(23)
    U[2] = 0.5  # u = 0.5 sin τ, v = 0.5 ω cos τ
    share = 0.5 * OMEGA / TANH["v0"]
    integral = quad(lambda tau: math.tanh(share * math.cos(tau)) * math.cos(tau), 0.0, 2.0 * math.pi)[0]
    F = force_of(TANH, U).F[0]
    assert F[1] == pytest.approx(TANH["mu"] * TANH["N0"] * integral / math.pi, rel=1e-10)
    assert F[2] == pytest.approx(0.0, abs=1e-12)


def segalman(given: dict[str, Any]) -> tuple[float, float]:
    """φ_max and R of the paper, from the numbers of a contact."""
    chi, beta = given["chi"], given["beta"]
    share = beta + (chi + 1.0) / (chi + 2.0)
    top = given["limit"] * (1.0 + beta) / (given["k"] * share)
    return top, given["limit"] * (chi + 1.0) / (top ** (chi + 2.0) * share)


def test_iwans_loss_grows_with_the_power_of_the_paper() -> None:
    """D = 4 R u^(χ+3)/((χ + 2)(χ + 3)) in microslip."""
    top, R = segalman(IWAN)
    chi = IWAN["chi"]
    sizes = top * np.array([0.03, 0.1, 0.3, 0.9])
    losses = []
    for size in sizes:
        U = np.zeros(23)
        U[1] = size
        losses.append(-math.pi * size * force_of({**IWAN, "samples": 2048}, U).F[0, 2])
    expected = 4.0 * R * sizes ** (chi + 3.0) / ((chi + 2.0) * (chi + 3.0))
    assert np.array(losses) == pytest.approx(expected, rel=1e-2)
    slope = np.polyfit(np.log(sizes), np.log(losses), 1)[0]
    assert slope == pytest.approx(chi + 3.0, abs=5e-3)


def test_iwans_backbone_is_that_of_the_paper() -> None:
    """F = k u − R u^(χ+2)/((χ + 1)(χ + 2)) up to φ_max, then the limit: of its sliders, drawn from rest."""
    top, R = segalman(IWAN)
    chi = IWAN["chi"]
    (contact,) = scene(IWAN).contacts
    stiff, strong = np.array(contact.sliders).T
    for share in (0.01, 0.1, 0.5, 0.99, 2.0):
        u = share * top
        expected = IWAN["k"] * u - R * u ** (chi + 2.0) / ((chi + 1.0) * (chi + 2.0))
        found = float(np.minimum(stiff * u, strong).sum())
        assert found == pytest.approx(expected if share < 1.0 else IWAN["limit"], rel=2e-3)
    assert stiff.sum() == pytest.approx(IWAN["k"])


@pytest.mark.parametrize("case", CASES)
def test_the_response_is_that_of_the_march(case: str) -> None:
    found = solver.solve(scene(CASES[case]), frequency_hz=0.19, harmonics=11)
    referee = solver.march(scene(CASES[case]), frequency_hz=0.19)
    assert found.converged
    assert referee.converged
    off = abs(found.half_peak_to_peak - referee.half_peak_to_peak)
    assert off <= 2e-4 * referee.half_peak_to_peak
    assert off <= found.error_estimate + 1e-7 * referee.half_peak_to_peak


@pytest.mark.parametrize("case", CASES)
def test_few_nodes_are_in_the_error_estimate(case: str) -> None:
    coarse = solver.solve(scene({**CASES[case], "samples": 44}), frequency_hz=0.19, harmonics=11)
    fine = solver.solve(scene({**CASES[case], "samples": 2048}), frequency_hz=0.19, harmonics=11)
    assert coarse.converged
    assert abs(coarse.max_abs - fine.max_abs) <= coarse.error_estimate + fine.error_estimate


KEYS = {"iwan": "chi", "bouc-wen": "n", "dahl": "limit", "coulomb-tanh": "v0"}


@pytest.mark.parametrize(("case", "key"), KEYS.items())
def test_its_parameters_have_gradients(case: str, key: str) -> None:
    path, hz = f"c0.{key}", 0.19
    value = CASES[case][key]

    def amplitude(value: float, hz: float = hz) -> float:
        return solver.solve(scene({**CASES[case], key: value}), frequency_hz=hz, harmonics=7).max_abs

    balance = build(scene(CASES[case]), harmonics=7)
    found = Workspace.of(balance).solve(2.0 * math.pi * hz)
    gradient = solver.Sensitivities(balance, [path]).gradient(found.u, hz)
    step = 1e-4 * abs(value)
    slope = (amplitude(value + step) - amplitude(value - step)) / (2.0 * step)
    assert gradient.by_parameters[0] == pytest.approx(slope, rel=2e-3)
    along = (amplitude(value, hz + 1e-6) - amplitude(value, hz - 1e-6)) / 2e-6
    assert gradient.by_frequency == pytest.approx(along, rel=2e-3)


@pytest.mark.parametrize("case", ["iwan", "dahl"])
def test_its_friction_work_is_the_area_of_its_loop(case: str) -> None:
    found = solver.solve(scene(CASES[case]), frequency_hz=0.19, harmonics=11)
    work = solver.contact_wear(found)["c0"].work.value
    u, force = solver.hysteresis_loop(found, "c0", samples=8192)
    area = float(0.5 * (force + np.roll(force, -1)) @ (np.roll(u, -1) - u))
    assert work == pytest.approx(area, rel=1e-3)
    assert work > 0.0


def test_a_steep_law_gets_more_nodes_by_itself() -> None:
    """With σ U/Fc = 400 and 64 nodes the steps of its rate would not be stable."""
    U = np.zeros(7)
    U[1] = 1.0
    few, many = (
        force_of({"law": "dahl", "sigma": 160.0, "limit": 0.4, "samples": samples}, U).F[0]
        for samples in (64, 8192)
    )
    assert few == pytest.approx(many, abs=1e-3)


def test_the_plan_says_how_it_is_followed() -> None:
    (reason,) = (e.reason for e in solver.plan(scene(DAHL)).effects if e.name == "law of c0")
    assert reason == (
        "the law dahl followed over 16 nodes a harmonic between its reversals, derivatives by a complex step "
        "of its functions, exact to rounding"
    )
    (even,) = (e for e in solver.plan(scene(IWAN)).effects if e.name == "even harmonics and mean")
    assert not even.used


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({**IWAN, "chi": -1.0}, "`chi` must be > -1, got -1.0"),
        ({**DAHL, "limit": 0.0}, "`limit` must be > 0 N, got 0.0"),
        ({**BOUC_WEN, "n": 0.5}, "`n` must be >= 1, got 0.5"),
        ({**TANH, "samples": 8}, "`samples` must be >= 32, got 8"),
    ],
)
def test_a_bad_number_is_told(given: dict[str, Any], words: str) -> None:
    with pytest.raises(solver.SceneError) as refused:
        scene(given)
    assert words in str(refused.value)


def test_hessians_are_refused_by_name() -> None:
    with pytest.raises(solver.SettingError, match=r"no second derivatives, .*: c0 \(dahl\)"):
        solver.track_peak(scene(DAHL), "c0.limit", start=0.6, stop=0.7, harmonics=3)
    with pytest.raises(solver.SettingError, match="c0"):
        solver.stability(solver.solve(scene(DAHL), frequency_hz=0.19, harmonics=3))
