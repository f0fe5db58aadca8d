"""Responses in phase resonance against responses solved at their frequency and force."""

import math
from typing import Any

import numpy as np
import pytest

import solver
from solver.modes.mode_curve import correct
from stickslip.lab.controlled.phase_resonance import Driven
from solver.modes.nonlinear_mode import pose
from solver.modes.mode_start import begin
from tests.cases.mode_cases import one_mass, slider

LEVEL = "excitation.amplitude"


def _solved(found: solver.PhaseResonance, i: int, harmonics: int) -> solver.Solution:
    there = found.scene.with_values({LEVEL: float(found.excitation[i]) * found.scene.value(LEVEL)})
    return solver.solve(there, frequency_hz=float(found.frequency_hz[i]), harmonics=harmonics)


@pytest.mark.parametrize(
    ("name", "amplitudes"),
    [("two-dof", (0.3, 1.08)), ("bladed-disk", (1e-6, 3e-5)), ("fe-disk", (1e-7, 1e-4))],
)
def test_a_point_is_the_response_to_its_force(name: str, amplitudes: tuple[float, float]) -> None:
    found = solver.phase_resonance(solver.load_scene(name), amplitudes=amplitudes, harmonics=5)
    assert found.reached, found.status
    assert np.all(found.excitation > 0.0)
    n = len(found.amplitude)
    for i in range(0, n, max(1, n // 5)):
        solved = _solved(found, i, 5)
        assert solved.max_abs == pytest.approx(found.max_abs[i], rel=1e-6)


def test_where_resonance_and_antiresonance_meet_the_curve_turns_back() -> None:
    # The force is at m1, whose antiresonance with the damper stuck is that of m2 alone.
    found = solver.phase_resonance(solver.load_scene("two-dof"), amplitudes=(0.3, 100.0), harmonics=5)
    assert found.status is solver.NonlinearModeStatus.TURNED_BACK
    assert 1.0 < found.amplitude.max() < 1.2
    for i in (11, 15, len(found.amplitude) - 1):
        assert _solved(found, i, 5).max_abs == pytest.approx(found.max_abs[i], rel=1e-6)


def test_the_driven_mass_lags_by_a_quarter_of_a_period() -> None:
    scene = one_mass(1.0, 39.478, 0.5, 30.0, 30.0)
    found = solver.phase_resonance(scene, amplitudes=(0.3, 50.0), harmonics=7)
    for i in range(0, len(found.amplitude), 4):
        mean, cosine, sine = _solved(found, i, 7).observed[:3]
        assert abs(cosine) < 1e-7 * sine
        assert abs(mean) < 1e-7 * sine


def test_one_slider_with_one_harmonic_is_the_formula() -> None:
    found = solver.phase_resonance(one_mass(2.0, 50.0, 0.4, 30.0, 3.0), amplitudes=(0.01, 10.0), harmonics=1)
    for a, frequency, force in zip(found.amplitude, found.frequency_hz, found.excitation, strict=True):
        u = a / math.sqrt(2.0)
        stiffness, damping = slider(u, 30.0, 3.0)
        omega = math.sqrt((50.0 + stiffness) / 2.0)
        assert 2.0 * math.pi * frequency == pytest.approx(omega, rel=1e-10)
        assert force == pytest.approx((0.4 * omega + damping) * u, rel=1e-9)


def test_the_jacobian_is_that_of_differences() -> None:
    problem = pose(solver.load_scene("two-dof"), 1, None, 3, kind=Driven)
    equations = problem.equations
    point = correct(equations, begin(equations, problem.mode, problem.rest, math.log(1.6), turns=False).state)
    assert point.converged
    assert point.at is not None
    state, y = point.state, point.state.y
    for i in range(y.size + 1):
        step = 1e-6 * (1.0 if i == y.size else max(abs(y[i]), 1e-2))
        sides = []
        for sign in (1.0, -1.0):
            near, log_amplitude = y.copy(), state.log_amplitude
            if i < y.size:
                near[i] += sign * step
            else:
                log_amplitude += sign * step
            at = equations.evaluate(near, log_amplitude, state.phase, state.mode)
            assert at is not None
            sides.append(at.residual)
        got = point.at.by_log_amplitude if i == y.size else point.at.jacobian[:, i]
        np.testing.assert_allclose(got, (sides[0] - sides[1]) / (2.0 * step), rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize(
    ("change", "name"),
    [({LEVEL: 0.0}, "excitation"), ({}, "amplitudes")],
)
def test_what_cannot_be_is_refused_by_name(change: dict[str, float], name: str) -> None:
    scene: Any = one_mass(1.0, 39.478, 0.5, 30.0, 30.0).with_values(change)
    amplitudes = (0.1, 1.0) if change else (1.0, 0.1)
    with pytest.raises(solver.SettingError) as refused:
        solver.phase_resonance(scene, amplitudes=amplitudes)
    assert refused.value.name == name
