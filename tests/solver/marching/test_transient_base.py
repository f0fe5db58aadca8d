"""Runs through a range of frequencies on a base that moves: inertia forces, another integrator, the march."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import solver
from solver.scene.scene import Scene

K, ZETA, MASS = (2.0 * math.pi) ** 2, 0.02, 1.3  # 1 Hz
SLIDER = {"name": "c", "between": ["m", "ground"], "kt": 20.0, "mu": 0.3, "N0": 2.0}
BAND = [0.5, 1.5]


def oscillator(excitation: dict[str, Any], *, relative: bool = True, **further: Any) -> Scene:
    """A mass on a spring with a slider to the ground, 1 Hz."""
    c = 2.0 * MASS * ZETA * 2.0 * math.pi
    observed = {"dof": "m", "band": BAND, **({"relative": True} if relative else {})}
    return Scene.from_dict({
        "name": "on-a-base",
        "structure": {
            "kind": "lumped", "masses": {"m": MASS},
            "springs": [{"between": ["ground", "m"], "k": MASS * K, "c": c}],
        },
        "contacts": [SLIDER], "excitation": excitation, "observe": observed,
    } | further)  # fmt: skip


@pytest.mark.parametrize(("begin", "end"), [(0.6, 1.4), (1.4, 0.6)])
def test_an_acceleration_is_the_inertia_force(begin: float, end: float) -> None:
    moved = oscillator({"ground": {"m": 1.0}, "motion": "acceleration", "amplitude": 0.7})
    pushed = oscillator({"dof": "m", "amplitude": -0.7 * MASS}, relative=False)
    run = {"begin_hz": begin, "end_hz": end, "rate_hz_per_s": 0.04, "from_rest": True}
    one, other = solver.transient(moved, **run), solver.transient(pushed, **run)
    assert one.reached
    assert one.max_abs == pytest.approx(other.max_abs, rel=1e-12)
    np.testing.assert_allclose(one.high, other.high, rtol=1e-9, atol=1e-12)


def prescribed(t: np.ndarray, rate: float, k: int, phase: float) -> tuple[np.ndarray, ...]:
    """Angle, its rate and its change of a base from 0.7/k Hz on at t [s], all [rad]."""
    turned = 2.0 * math.pi * k * (0.7 / k * t + 0.5 * rate * t * t) + phase
    return turned, 2.0 * math.pi * k * (0.7 / k + rate * t), np.full_like(t, 2.0 * math.pi * k * rate)


@pytest.mark.parametrize("k", [1, 2])
@pytest.mark.parametrize("relative", [True, False])
@pytest.mark.parametrize("motion", ["displacement", "velocity", "acceleration"])
def test_each_motion_of_the_ground_is_that_of_another_integrator(motion: str, relative: bool, k: int) -> None:
    phase, seconds, a = 0.4, 12.0, 0.3
    rate = 0.6 / k / seconds

    def acceleration(t: float) -> float:
        theta, first, second = (float(each) for each in prescribed(np.array(t), rate, k, phase))
        of = {
            "displacement": -(first**2) * math.cos(theta) - second * math.sin(theta),
            "velocity": -first * math.sin(theta), "acceleration": math.cos(theta),
        }  # fmt: skip
        return a * of[motion]

    def slope(t: float, s: np.ndarray) -> list[float]:
        return [s[1], -K * s[0] - 2.0 * ZETA * 2.0 * math.pi * s[1] - acceleration(t), s[3], acceleration(t)]

    theta, first, _ = (float(each) for each in prescribed(np.array(0.0), rate, k, phase))
    order = {"displacement": 0, "velocity": 1, "acceleration": 2}[motion]
    y, v = (a * (np.exp(1j * theta) * (1j * first) ** power).real for power in (-order, 1 - order))
    found = solve_ivp(
        slope, (0.0, seconds), [0.0, 0.0, y, v], "DOP853", rtol=1e-10, atol=1e-11, dense_output=True
    )
    x = found.sol(np.linspace(0.0, seconds, 60_001))
    base = {"ground": {"m": 1.0}, "motion": motion, "amplitude": a, "phase": phase, "harmonic": k}
    run = solver.transient(
        oscillator(base, relative=relative, contacts=[]), begin_hz=0.7 / k, end_hz=1.3 / k,
        ramp_seconds=seconds, from_rest=True,
    )  # fmt: skip
    assert run.reached
    assert run.max_abs == pytest.approx(np.abs(x[0] if relative else x[0] + x[2]).max(), rel=1e-6)


def on_a_shaken_wall(motion: str) -> Scene:
    """The mass hangs on a wall that is driven, and rubs on the ground."""
    c = 2.0 * MASS * ZETA * 2.0 * math.pi
    springs = [{"between": ["wall", "m"], "k": MASS * K, "c": c}]
    return oscillator(
        {"driven": {"wall": 1.0}, "motion": motion, "amplitude": 0.05}, relative=False,
        structure={"kind": "lumped", "masses": {"m": MASS, "wall": 2.0}, "springs": springs},
    )  # fmt: skip


def test_a_wall_at_one_frequency_is_that_of_the_march() -> None:
    scene = on_a_shaken_wall("displacement")
    stood = solver.transient(scene, begin_hz=1.1, end_hz=1.1, ramp_seconds=20.0)
    assert stood.reached
    assert stood.max_abs == pytest.approx(solver.march(scene, frequency_hz=1.1).max_abs, rel=1e-6)


def test_a_shaken_wall_is_a_force_through_spring_and_dashpot() -> None:
    """Driven from rest by y = A cos θ: k y + c y' on the mass, by small steps of a slider in the state."""
    run = {"begin_hz": 0.7, "end_hz": 1.3, "ramp_seconds": 12.0, "from_rest": True}
    found = solver.transient(on_a_shaken_wall("displacement"), **run)
    n, seconds, a = 240_000, 12.0, 0.05
    h, c = seconds / n, 2.0 * MASS * ZETA * 2.0 * math.pi
    t = np.linspace(0.0, seconds, 2 * n + 1)
    theta, first, _ = prescribed(t, 0.05, 1, 0.0)
    push = (MASS * K * a * np.cos(theta) - c * a * first * np.sin(theta)).tolist()
    x = v = held = top = 0.0
    for i in range(n):  # velocity Verlet with the slider returned to its limit at each step
        force = max(-0.6, min(0.6, held))
        middle = v + 0.5 * h * (push[2 * i] - MASS * K * x - c * v - force) / MASS
        moved = h * middle
        held = max(-0.6, min(0.6, held + 20.0 * moved))
        x += moved
        v = middle + 0.5 * h * (push[2 * i + 2] - MASS * K * x - c * middle - held) / MASS
        top = max(top, abs(x))
    assert found.max_abs == pytest.approx(top, rel=2e-4)


@pytest.mark.parametrize("motion", ["displacement", "velocity", "acceleration"])
def test_a_base_comes_to_rest_when_it_rings_down(motion: str) -> None:
    found = solver.transient(
        on_a_shaken_wall(motion), begin_hz=0.9, end_hz=1.0, ramp_seconds=8.0, ring_down_seconds=40.0
    )
    assert found.reached
    assert max(abs(found.high[-1]), abs(found.low[-1])) < 0.03 * found.max_abs


def test_a_run_up_from_standing_still_has_a_finite_motion() -> None:
    for motion in ("displacement", "velocity", "acceleration"):
        base = {"ground": {"m": 1.0}, "motion": motion, "amplitude": 0.01}
        found = solver.transient(oscillator(base), begin_hz=0.0, end_hz=1.0, ramp_seconds=8.0, from_rest=True)
        assert found.reached
        assert 0.0 < found.max_abs < 1.0
