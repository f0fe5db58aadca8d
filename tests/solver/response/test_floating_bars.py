"""Bars that sliders alone hold: light masses, far below any resonance, of the static size of their loads."""

import math

import pytest
from floating_bars import Bar

from solver import power_balance, solve, sweep
from solver.response.solution import SolutionStatus

BARS = 100


@pytest.mark.few(20)
@pytest.mark.parametrize("seed", range(BARS))
def test_a_floating_bar_moves_as_its_loading_history_says(seed: int) -> None:
    bar = Bar.of(seed)
    found = solve(bar.scene(), frequency_hz=bar.frequency_hz, harmonics=11)
    assert found.status is SolutionStatus.CONVERGED
    static = bar.quasi_static()
    assert abs(found.max_abs - static) <= found.error_estimate + (1e-4 + bar.inertia) * static
    assert power_balance(found).imbalance < 1e-6
    assert found.seconds < 20.0


@pytest.mark.parametrize("ground", [1e-6, 1e-3, 1.0, 1e3])
def test_a_soft_spring_to_ground_changes_nothing(ground: float) -> None:
    bar = Bar(n=8, force=600.0, stiffness_ratio=200.0, mass=1e-6, frequency_hz=0.01)
    found = solve(bar.scene(ground), frequency_hz=0.01, harmonics=11)
    assert found.status is SolutionStatus.CONVERGED
    assert found.max_abs == pytest.approx(bar.quasi_static(), rel=0.02)
    assert power_balance(found).imbalance < 1e-6


def test_a_sweep_of_a_floating_bar_has_the_static_size() -> None:
    bar = Bar(n=4, force=600.0, stiffness_ratio=20.0, mass=1e-6, frequency_hz=0.02)
    branch = sweep(bar.scene(), harmonics=11)
    assert branch.reached
    assert branch.seconds < 5.0
    assert max(peak.value for peak in branch.peaks) == pytest.approx(bar.quasi_static(), rel=0.02)


@pytest.mark.parametrize("force", [1100.0, 3000.0])
def test_more_than_friction_holds_has_no_answer_that_loses_power(force: float) -> None:
    """A mass of a milligram would fly 1e9 m: beyond what rounding leaves of its contacts."""
    bar = Bar(n=4, force=force, stiffness_ratio=20.0, mass=1e-6, frequency_hz=0.01)
    found = solve(bar.scene(), frequency_hz=0.01)
    assert found.status in (SolutionStatus.POWER_LOST, SolutionStatus.NOT_CONVERGED)
    assert math.isnan(found.max_abs)
