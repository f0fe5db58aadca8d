"""Flutter held by friction against the march in time and the closed form of one slider."""

import math
from typing import Any

import numpy as np
import pytest

import solver
from tests.cases.mode_cases import one_mass, slider

M, K, C, KT, LIMIT = 1.0, 39.478, 0.5, 30.0, 30.0


def _fed(scene: solver.Scene, damping: float) -> solver.Scene:
    """The scene with a dashpot more, below 0 where gas feeds the mass, and nothing that drives it."""
    raw = scene.to_dict()
    raw["couplings"] = [{"on": "x", "of": "x", "c": damping}]
    return solver.Scene.from_dict(raw).with_values({"excitation.amplitude": 0.0})


def _march(scene: solver.Scene, frequency: float, start: float, **keys: Any) -> Any:
    begun = solver.MarchStart(displacements={"x": start})
    return solver.march(scene, frequency_hz=frequency, start=begun, **keys)


def _cycles(harmonics: int, aero: float) -> tuple[solver.Scene, solver.LimitCycles]:
    scene = one_mass(M, K, C, KT, LIMIT)
    found = solver.nonlinear_mode(scene, amplitudes=(0.3, 100.0), harmonics=harmonics, errors=False)
    return scene, solver.limit_cycles(found, aero)


def test_a_stable_cycle_is_where_the_march_ends_from_both_sides() -> None:
    aero = -0.09
    scene, found = _cycles(45, aero)
    assert [cycle.stable for cycle in found.cycles] == [True, False]
    assert [cycle.attracts for cycle in found.cycles] == [True, False]
    stable = found.cycles[0]
    there = _fed(scene, 2.0 * aero * 2.0 * math.pi * stable.frequency_hz * M)
    for factor in (0.7, 1.4):
        # The phase drifts by the rounding of the frequency: the march repeats no better than that.
        marched = _march(there, stable.frequency_hz, factor * stable.max_abs, tolerance=2e-7)
        assert marched.converged
        assert marched.half_peak_to_peak == pytest.approx(stable.max_abs, rel=1e-6)


def test_the_march_leaves_an_unstable_cycle_on_both_sides() -> None:
    aero = -0.09
    scene, found = _cycles(15, aero)
    unstable = found.cycles[1]
    assert max(abs(unstable.multipliers)) > 1.01
    there = _fed(scene, 2.0 * aero * 2.0 * math.pi * unstable.frequency_hz * M)
    sizes = [
        float(np.abs(_march(there, unstable.frequency_hz, f * unstable.max_abs, max_periods=12).slip).max())
        for f in (0.97, 1.03)
    ]
    assert sizes[0] < 0.95 * unstable.max_abs
    assert sizes[1] > 1.05 * unstable.max_abs


def test_with_one_harmonic_cycles_are_those_of_the_formula() -> None:
    for aero in (-0.05, -0.1, -0.12):
        _, found = _cycles(1, aero)
        assert len(found.cycles) == 2
        for cycle in found.cycles:
            stiffness, damping = slider(cycle.amplitude, KT, LIMIT)
            omega = math.sqrt(K + stiffness)
            assert (C * omega + damping) / (2.0 * omega**2) == pytest.approx(-aero, rel=1e-9)
            assert 2.0 * math.pi * cycle.frequency_hz == pytest.approx(omega, rel=1e-9)


def test_the_most_damping_is_that_of_the_formula() -> None:
    _, found = _cycles(1, -0.05)
    a = np.linspace(1.2, 6.0, 20001)
    every = []
    for each in a:
        stiffness, damping = slider(float(each), KT, LIMIT)
        omega = math.sqrt(K + stiffness)
        every.append((C * omega + damping) / (2.0 * omega**2))
    assert found.most_damping == pytest.approx(max(every), rel=1e-8)
    assert found.most_at == pytest.approx(float(a[int(np.argmax(every))]), rel=1e-3)


def test_more_than_the_most_has_no_cycle_and_none_feeds_none() -> None:
    assert _cycles(1, -0.2)[1].cycles == ()
    assert _cycles(1, 0.05)[1].cycles == ()


def test_a_disturbance_asks_for_a_load_in_proportion() -> None:
    scene, found = _cycles(5, -0.09)
    factor = found.load_for(20.0)
    heavier = scene.with_values({"damper.N0": factor * scene.value("damper.N0")})
    again = solver.limit_cycles(
        solver.nonlinear_mode(heavier, amplitudes=(0.3, 200.0), harmonics=5, errors=False), -0.09
    )
    assert again.cycles[1].amplitude == pytest.approx(20.0, rel=1e-8)


def test_loads_that_move_and_numbers_that_are_none_are_refused() -> None:
    found = solver.nonlinear_mode(solver.load_scene("two-dof"), amplitudes=(0.1, 2.0), harmonics=3)
    with pytest.raises(solver.SettingError, match="N1"):
        solver.limit_cycles(found, -0.01)
    with pytest.raises(solver.SettingError, match="aero_damping"):
        solver.limit_cycles(found, math.nan)


def test_a_disk_of_many_coordinates_says_that_multipliers_are_left_out() -> None:
    found = solver.nonlinear_mode(
        solver.load_scene("fe-disk"), amplitudes=(1e-6, 1e-4), harmonics=3, errors=False
    )
    cycles = solver.limit_cycles(found, -0.02).cycles
    assert cycles
    assert all(cycle.multipliers is None and "stability=True" in cycle.unknown for cycle in cycles)
    assert cycles[0].stable is None
    assert cycles[0].attracts
