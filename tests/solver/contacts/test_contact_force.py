"""The closed-form contact force: reference values, a crude march, every derivative on every smooth piece."""

import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from contact_cases import (
    Case,
    closing_cases,
    crude_force,
    derivative_errors,
    evaluate,
    load_zeros,
    random_case,
    values,
)
from each import each
from force_cases import NAMES, REFERENCE, TRANSITIONS, critical, reference_case

from solver.contacts.kernels import stick_slip_events as events
from solver.jit import fourier


@pytest.mark.parametrize("name", NAMES)
def test_reference_values(name: str):
    answer = evaluate(reference_case(name))
    np.testing.assert_allclose(answer.F, REFERENCE[name]["force"], rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_reference_derivatives(name: str):
    errors = derivative_errors(reference_case(name))
    assert errors is not None
    assert max(errors.values()) < 1e-6


@pytest.mark.parametrize("seed", range(4))
def test_force_against_a_crude_march(seed: int):
    """Random contacts of every state; the march's own error is judged from two steps."""
    rng = np.random.default_rng(seed)
    states: Counter[str] = Counter()
    errors = []
    for _ in range(125):
        case = random_case(rng)
        answer = evaluate(case)
        coarse, fine = crude_force(case, 2**12), crude_force(case, 2**14)
        error = np.abs(answer.F - fine).max() / max(case.scale, 1e-300)
        assert error < np.abs(fine - coarse).max() / max(case.scale, 1e-300) + 1e-6
        errors.append(error)
        states[answer.state] += 1
    assert min(states[state] for state in ("stuck", "slipping", "lifting", "separated")) >= 1
    assert np.median(errors) < 1e-6


@pytest.mark.parametrize("harmonics", [2, 8, 40, 120])
def test_every_random_contact_has_an_answer(harmonics: int):
    """Sticks of any length; the helper refuses a march that fills its table without getting anywhere."""
    rng = np.random.default_rng(harmonics)
    for _ in range(3000 if harmonics < 40 else 500):
        assert np.isfinite(evaluate(random_case(rng, harmonics)).F).all()


@each("kt_over_limit", [0.5, 1.0, 3.0, 1e4])
@each("N0", [0.0, 1e-12, 99.0, 100.0 * (1 - 1e-15), 100.0, 100.0 * (1 + 1e-15), 300.0])
@each("mu", [0.0, 0.3])
def test_ties(kt_over_limit: float, N0: float, mu: float):
    """Limits reached exactly, loads that touch zero, motion in phase with the load, no friction."""
    for phase, motion in ((0.0, (1.0, 0.0)), (np.pi / 2, (1.0, 0.5)), (np.pi, (1.0, 0.0)), (1.0, (0.0, 0.0))):
        N = np.array([N0, 100.0 * np.cos(phase), -100.0 * np.sin(phase)])
        U = np.array([0.0, *motion, 0.0, 0.0, 0.1 * motion[1], 0.0])
        case = Case(U=U, N=N, kt=kt_over_limit * 30.0, mu=mu)
        assert np.abs(evaluate(case).F - crude_force(case, 2**13)).max() <= 1e-5 * 100.0


def test_short_separations_are_not_missed():
    """A dip of the load below zero between two grid points, while it is negative elsewhere too."""
    N = np.array([0.6, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0])  # four equal dips
    N[1] = 0.3985  # only just lifts one of them
    case = Case(U=np.array([0.0, 3.0, 4.0]), N=100.0 * N, kt=60.0, mu=0.4)
    assert len(load_zeros(case.N)) == 8
    assert np.abs(evaluate(case).F - crude_force(case, 2**14)).max() < 1e-5


def test_derivatives_of_random_contacts():
    """All derivatives in all states, to 1e-6 of the largest entry."""
    rng = np.random.default_rng(7)
    seen: Counter[str] = Counter()
    for _ in range(150):
        case = random_case(rng, 12)
        best = math.inf
        for step in (1e-4, 1e-5, 1e-6, 1e-7):
            errors = derivative_errors(case, step)
            best = min(best, math.inf if errors is None else max(errors.values()))
            if best < 1e-6:
                break
        assert best < 1e-6
        seen[evaluate(case).state] += 1
    assert min(seen[state] for state in ("stuck", "slipping", "lifting", "separated")) >= 3


@each("distance", [-1e-2, -1e-4, 1e-4, 1e-2])
@each("name", TRANSITIONS)
def test_derivatives_on_both_sides_of_a_transition(name: str, distance: float):
    transition = TRANSITIONS[name]
    case = transition.family(critical(transition) + abs(transition.high) * distance)
    assert evaluate(case).state == (transition.before if distance < 0.0 else transition.after)
    errors = derivative_errors(case, abs(distance) / 40.0)
    assert errors is not None
    assert max(errors.values()) < 1e-6, errors


@each("name", TRANSITIONS)
def test_the_force_is_continuous_across_a_transition(name: str):
    transition = TRANSITIONS[name]
    x = critical(transition)
    gap = 1e-9 * abs(x)
    before, after = (evaluate(transition.family(x + step)) for step in (-gap, gap))
    assert before.pattern != after.pattern
    assert np.abs(after.F - before.F).max() < 1e-6


@pytest.mark.few(4)
@pytest.mark.parametrize("seed", range(30))
def test_the_force_is_continuous_where_a_contact_closes(seed: int):
    """It sticks or slips at once, and slips briefly within a grid interval: 2e-3 of the force were missed."""
    for case in closing_cases(np.random.default_rng(seed)):
        crude = crude_force(case, 2**16)
        assert np.abs(evaluate(case).F - crude).max() <= 2e-5 * np.abs(crude).max()
        for off in (1e-5, 1e-7, 1e-9, 1e-11, 1e-13):
            more, less = (evaluate(replace(case, mu=case.mu * (1.0 + sign * off))).F for sign in (1.0, -1.0))
            assert np.abs(more - less).max() <= (3.0 * math.sqrt(off) + 1e-9) * np.abs(more).max()


@pytest.mark.parametrize("name", ["after separation: stick becomes slip", "reference"])
def test_the_onset_after_separation_counts(name: str):
    """The moment of reattachment moves with the load: without that term dF/dN is wrong by tens of percent."""
    if name == "reference":
        case = reference_case("separation")
        case = replace(case, U=0.5 * case.U)
    else:
        case = TRANSITIONS[name].family(1.0)
    answer = evaluate(case)
    term = np.zeros_like(answer.dF_dN)
    after = answer.segments[
        (answer.segments["motion"] == events.STICK) & (answer.segments["began"] == events.AFTER_SEPARATION)
    ]
    assert len(after) == 1
    begin, end = after[0][["begin", "end"]]
    at = np.array([begin])
    rate = case.kt * values(fourier.derivative(case.U), at) / values(fourier.derivative(case.N), at)
    nodes, weights = np.polynomial.legendre.leggauss(200)
    tau = begin + (end - begin) * 0.5 * (nodes + 1.0)
    moments = fourier.basis(tau, case.n_harmonics).T @ weights * 0.5 * (end - begin) / np.pi
    moments[0] *= 0.5
    term = rate * np.outer(moments, fourier.basis(at, (case.N.size - 1) // 2)[0])
    errors = derivative_errors(case)
    assert errors is not None
    assert errors["dF_dN"] < 1e-6
    assert np.abs(term).max() > 0.1 * np.abs(answer.dF_dN).max()


def test_force_and_derivatives_scale():
    """F is homogeneous of degree one in (u, N), and in (kt, mu); of degree zero in shifts of time."""
    rng = np.random.default_rng(3)
    for _ in range(50):
        case = random_case(rng, 9)
        answer = evaluate(case)
        twice = evaluate(replace(case, U=2.0 * case.U, N=2.0 * case.N))
        np.testing.assert_allclose(twice.F, 2.0 * answer.F, atol=1e-12 * case.scale)
        np.testing.assert_allclose(
            case.kt * answer.dF_dkt + case.mu * answer.dF_dmu, answer.F, atol=1e-12 * case.scale
        )
        euler = answer.dF_dU @ case.U + answer.dF_dN @ case.N
        np.testing.assert_allclose(euler, answer.F, atol=1e-10 * case.scale)
        if answer.state in ("slipping", "lifting"):
            turn = 2.0 * np.pi * rng.uniform()
            moved = evaluate(replace(case, U=shifted(case.U, turn), N=shifted(case.N, turn)))
            np.testing.assert_allclose(moved.F, shifted(answer.F, turn), atol=1e-10 * case.scale)


def shifted(q: np.ndarray, turn: float) -> np.ndarray:
    """Coefficients of q(tau + turn)."""
    amplitudes = fourier.to_complex(q)
    return fourier.to_real(amplitudes * np.exp(1j * turn * np.arange(amplitudes.size)))


def test_a_brief_slip_within_one_grid_interval():
    """A stiff contact slips back and forth between two points of the grid: nothing is missed."""
    kt, mu, N = 1e12, 0.3, np.array([200.0, 60.0, 0.0])
    rng = np.random.default_rng(5)
    for _ in range(15):
        U = np.concatenate([[0.0], rng.normal(size=22) * np.repeat(np.arange(1, 12.0) ** -1.5, 2)]) * 1e-4
        case = Case(U=U, N=N, kt=kt, mu=mu)
        crude = crude_force(case, 400_000)
        np.testing.assert_allclose(evaluate(case).F, crude, atol=1e-4 * np.abs(crude).max())
