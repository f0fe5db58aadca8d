"""Exact second derivatives: of the contact force, and of the amplitude by frequency and parameter."""

import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from contact_cases import STATES, Case, central_difference, evaluate, random_case
from each import each
from force_cases import NAMES, TRANSITIONS, critical, reference_case

import solver
from solver.balance.balance import build
from solver.balance.workspace import Workspace
from solver.contacts.kernels.coulomb.line_hessian import second_along
from solver.contacts.kernels.system import by_reference
from solver.continuation.extrema.kernels.amplitude_hessian import (
    AMPLITUDE,
    CURVE,
    DA_DP,
    DG_DP,
    SIGN,
    TAU,
    G,
    balance_at,
    choose_extremum,
    curvatures_at,
    find_extremum,
    new_summit,
    observe_at,
    slopes_at,
    solve_responses,
    summit_numbers,
    summit_step,
)
from solver.jit import fourier
from solver.scene.scene import Scene

_STATE_NUMBERS = {name: number for number, name in STATES.items()}


def second(case: Case, w: np.ndarray, dU: np.ndarray, dN: np.ndarray) -> np.ndarray:
    """Call the kernel: derivative of the gradient of w·F by U, N, kt and mu."""
    answer = evaluate(case)
    out_U, out_N = np.zeros(case.U.size), np.zeros(case.N.size)
    ks, load_ks = (fourier.all_harmonics((q.size - 1) // 2) for q in (case.U, case.N))
    by_kt, by_mu = second_along(
        case.U, ks, case.N, load_ks, case.kt, case.mu, _STATE_NUMBERS[answer.state], answer.segments,
        len(answer.segments), answer.dF_dU, answer.dF_dN, w, dU, dN, out_U, out_N,
    )  # fmt: skip
    return np.concatenate([out_U, out_N, [by_kt, by_mu]])


def gradient(case: Case, w: np.ndarray) -> np.ndarray:
    answer = evaluate(case)
    return np.concatenate([w @ answer.dF_dU, w @ answer.dF_dN, [w @ answer.dF_dkt, w @ answer.dF_dmu]])


def worst_error(case: Case, w: np.ndarray, dU: np.ndarray, dN: np.ndarray, step: float) -> float:
    """Relative error of each block against central differences; inf if the law changes its piece within."""
    pattern = evaluate(case).pattern

    def moved(x: float) -> np.ndarray | None:
        there = replace(case, U=case.U + x * dU, N=case.N + x * dN)
        return gradient(there, w) if evaluate(there).pattern == pattern else None

    difference = central_difference(moved, step)
    if difference is None:
        return math.inf
    exact, n, m = second(case, w, dU, dN), case.U.size, case.N.size
    errors = []
    for block in (slice(0, n), slice(n, n + m), slice(n + m, n + m + 1), slice(n + m + 1, None)):
        size = np.abs(difference[block]).max()
        error = np.abs(exact[block] - difference[block]).max()
        errors.append(error / size if size > 0.0 else error)
    return float(max(errors))


def best_error(case: Case, rng: np.random.Generator, *, with_load: bool, widest: float = 1e-3) -> float:
    """The error at the best of some steps: near an event a wide one leaves the piece, a short one rounds."""
    w = rng.normal(size=case.U.size)
    dU = rng.normal(size=case.U.size) * np.abs(case.U).max()
    dN = rng.normal(size=case.N.size) * (np.abs(case.N).max() if with_load else 0.0)
    return min(worst_error(case, w, dU, dN, widest * 10.0**-decade) for decade in np.arange(0.0, 4.5, 0.5))


@pytest.mark.parametrize("with_load", [False, True])
def test_second_derivatives_of_random_contacts(with_load: bool) -> None:
    """All of U, N, kt and mu, along the motion alone and with the load, in every state, to 1e-6."""
    rng = np.random.default_rng(11 + with_load)
    seen: Counter[str] = Counter()
    for _ in range(120):
        case = random_case(rng, 9)
        assert best_error(case, rng, with_load=with_load) < 1e-6
        seen[evaluate(case).state] += 1
    assert min(seen[state] for state in STATES.values()) >= 2


@pytest.mark.parametrize("name", NAMES)
def test_second_derivatives_of_reference_contacts(name: str) -> None:
    assert best_error(reference_case(name), np.random.default_rng(0), with_load=True) < 1e-6


@each("distance", [-1e-2, -1e-3, 1e-3, 1e-2])
@each("name", TRANSITIONS)
def test_second_derivatives_on_both_sides_of_a_transition(name: str, distance: float) -> None:
    transition = TRANSITIONS[name]
    case = transition.family(critical(transition) + abs(transition.high) * distance)
    rng = np.random.default_rng(5)
    assert best_error(case, rng, with_load=True, widest=abs(distance) / 10.0) < 1e-6


def test_the_second_derivative_is_symmetric() -> None:
    """aᵀ ∂²(w·F) b = bᵀ ∂²(w·F) a over motion and load."""
    rng = np.random.default_rng(2)
    for _ in range(60):
        case = random_case(rng, 7)
        w = rng.normal(size=case.U.size)
        a, b = ((rng.normal(size=case.U.size), rng.normal(size=case.N.size)) for _ in range(2))
        scale = np.abs(case.U).max(), np.abs(case.N).max()
        a, b = ((x * scale[0], y * scale[1]) for x, y in (a, b))
        size = case.U.size + case.N.size
        one, other = second(case, w, *a)[:size], second(case, w, *b)[:size]
        left, right = np.concatenate(b) @ one, np.concatenate(a) @ other
        magnitude = np.linalg.norm(one) * np.linalg.norm(np.concatenate(b)) + 1e-300
        assert abs(left - right) <= 1e-9 * magnitude


class Response:
    """The amplitude of a scene near one point, with its derivatives from the kernel."""

    def __init__(self, scene: Scene, parameter: str, frequency_hz: float) -> None:
        balance = build(scene, parameter, harmonics=7, frequency_hz=frequency_hz)
        self.omega, self.p = 2.0 * math.pi * frequency_hz, balance.parameter.inside(scene.value(parameter))
        self._system = by_reference(balance.system)
        self._summit = new_summit(self._system)
        found = Workspace.of(balance).solve(self.p)
        assert found.converged
        self._u = found.u
        self._tau: float | None = None
        self.here = self.at(self.omega, self.p)
        self._tau = float(self.here[TAU])

    def at(self, omega: float, p: float) -> np.ndarray:
        """The numbers of a summit, see `kernels.amplitude_hessian`, at the solution for (omega, p)."""
        system, summit, u = self._system, self._summit, self._u.copy()
        numbers = summit_numbers(summit)
        for _ in range(20):
            norm = balance_at(system, u, omega, p, summit)
            assert solve_responses(system, summit)
            if norm < 3e-14:
                break
            u -= summit_step(summit)
        observe_at(system, summit)
        if self._tau is None:
            choose_extremum(system, summit)
        tau = numbers[TAU] if self._tau is None else self._tau
        assert numbers[SIGN] in (1.0, -1.0)
        assert find_extremum(system, summit, tau)
        assert slopes_at(system, summit)
        curvatures_at(system, u, summit)
        return numbers.copy()


def two_dof(values: dict[str, float]) -> Scene:
    return solver.load_scene("two-dof").with_values(values)


@pytest.mark.parametrize("separated", [False, True])
@pytest.mark.parametrize(
    "parameter",
    ["damper.N0", "damper.N1", "damper.kt", "damper.mu", "damper.N1_ratio", "damper.N1_phase",
     "excitation.amplitude", "excitation.phase"],
)  # fmt: skip
def test_amplitude_of_two_dof(parameter: str, separated: bool) -> None:
    """With a load that varies in phase a little, and with one that separates the contact."""
    values = {"damper.N1_ratio": 1.5} if separated else {}
    check(Response(two_dof({**values, "damper.N1_phase": 0.4}), parameter, 1.1))


@pytest.mark.parametrize("parameter", ["shroud.N0", "shroud.kt", "shroud.mu", "root.kt"])
def test_amplitude_of_the_bladed_disk(parameter: str) -> None:
    check(Response(solver.load_scene("bladed-disk"), parameter, 750.0))


@pytest.mark.parametrize("kind", ["mass", "spring", "damper"])
def test_amplitude_by_a_structural_parameter(kind: str) -> None:
    """The dense form: the matrices themselves change, and their derivatives by the frequency with them."""
    spring = {"name": "tuned", "between": ["m1", "m2"], "k": 20.0, "c": 0.5}
    scene = Scene.model_validate(
        {
            "name": "tuned",
            "structure": {
                "kind": "lumped", "masses": {"m1": {"m": 1.0, "name": "first"}, "m2": 1.2},
                "springs": [{"between": ["m1", "ground"], "k": 40.0, "c": 0.5}, spring],
                "dampers": [{"name": "dashpot", "between": ["m2", "ground"], "c": 0.3}],
            },
            "contacts": [{"name": "slider", "between": ["m2", "ground"], "kt": 30.0, "mu": 0.3, "N0": 60.0,
                          "N1": 20.0}],
            "excitation": {"dof": "m1", "amplitude": 60.0},
            "observe": {"dof": "m2", "band": [0.2, 2.0]},
        }
    )  # fmt: skip
    path = {"mass": "structure.first", "spring": "structure.tuned", "damper": "structure.dashpot"}[kind]
    check(Response(scene, path, 0.85))


def check(response: Response) -> None:
    """Compare slopes with differences of the amplitude, and curvatures with differences of the slopes."""
    here, omega, p = response.here, response.omega, response.p

    def by_omega(column: int, step: float) -> np.ndarray | None:
        return central_difference(lambda x: response.at(omega + x, p)[column], step * omega)

    def by_p(column: int, step: float) -> np.ndarray | None:
        return central_difference(lambda x: response.at(omega, p + x)[column], step * (abs(p) or 1.0))

    for exact, difference, column in (
        (here[G], by_omega, AMPLITUDE), (here[DA_DP], by_p, AMPLITUDE), (here[CURVE], by_omega, G),
        (here[DG_DP], by_p, G), (here[DG_DP], by_omega, DA_DP),
    ):  # fmt: skip
        errors = [abs(difference(column, step) - exact) for step in (1e-3, 1e-4, 1e-5)]
        assert min(errors) < 1e-6 * abs(exact) + 1e-12 * here[AMPLITUDE] / omega
