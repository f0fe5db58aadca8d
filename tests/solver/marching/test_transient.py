"""Runs through a range of frequencies against closed forms, other integrators and the march."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from each import each
from scipy.integrate import solve_ivp
from scipy.special import wofz

import solver
from solver.errors import SettingError
from solver.marching.march_equations import equations_of_motion, in_modes
from solver.marching.march_result import TransientStatus
from solver.scene.scene import Scene

K = (2.0 * math.pi) ** 2  # of a mass of 1 kg: 1 Hz


def oscillator(zeta: float, **further: Any) -> Scene:
    """A mass on a spring, 1 Hz, force 1 N; contacts as given."""
    return Scene.from_dict({
        "name": "oscillator",
        "structure": {
            "kind": "lumped", "masses": {"m": 1.0},
            "springs": [{"name": "k", "between": ["ground", "m"], "k": K, "c": 2.0 * zeta * 2.0 * math.pi}],
        },
        "excitation": {"dof": "m", "amplitude": 1.0}, "observe": {"dof": "m", "band": [0.5, 1.5]},
    } | further)  # fmt: skip


def lewis(zeta: float, begin_hz: float, rate: float, t: np.ndarray) -> np.ndarray:
    """Displacement [m] from rest under cos 2π (f₀ t + a t²/2): F. M. Lewis, Trans. ASME 54 (1932) 253.

    Duhamel's integral is one of a Gaussian: the Faddeeva function for each of the two eigenvalues.
    """
    omega, total = 2.0 * math.pi, np.zeros(t.size, complex)
    bend, first, root = math.pi * rate, 2.0 * math.pi * begin_hz, np.sqrt(-1j * math.pi * rate)
    for sign in (1.0, -1.0):
        eigenvalue = complex(-zeta * omega, sign * omega * math.sqrt(1.0 - zeta**2))

        def antiderivative(s: np.ndarray, eigenvalue: complex = eigenvalue) -> tuple[np.ndarray, np.ndarray]:
            # erf z = ±1 ∓ exp(−z²) w(±iz): the sign and the rest apart, neither of which overflows.
            z = root * s - (1j * first - eigenvalue) / (2.0 * root)
            side = np.where(z.real < 0.0, -1.0, 1.0)
            phase = np.exp(eigenvalue * (t - s) + 1j * (first * s + bend * s * s))
            return side, side * phase * wofz(1j * side * z)

        (side, rest), (side_0, rest_0) = antiderivative(t), antiderivative(np.zeros_like(t))
        whole = np.exp(eigenvalue * t + (1j * first - eigenvalue) ** 2 / (4.0 * root**2)) * (side - side_0)
        integral = math.sqrt(math.pi) / (2.0 * root) * (whole - rest + rest_0)
        total += sign * integral / (2j * omega * math.sqrt(1.0 - zeta**2))
    return total.real


@pytest.mark.parametrize(
    ("zeta", "begin_hz", "rate", "seconds"),
    [(0.02, 0.5, 0.01, 100.0), (0.002, 1.3, -0.02, 40.0), (0.1, 0.0, 0.1, 15.0), (0.01, 0.3, 1.0, 4.0)],
)
def test_a_linear_oscillator_is_that_of_lewis(
    zeta: float, begin_hz: float, rate: float, seconds: float
) -> None:
    found = solver.transient(
        oscillator(zeta), begin_hz=begin_hz, end_hz=begin_hz + rate * seconds, ramp_seconds=seconds,
        from_rest=True,
    )  # fmt: skip
    assert found.reached
    for _ in range(2):  # the second time around what was found
        t = np.linspace(0.0, seconds, 40_001)
        x = np.abs(lewis(zeta, begin_hz, rate, t))
        near = t[np.argmax(x)] + np.linspace(-1.0, 1.0, 4001) * (t[1] - t[0])
        top = float(np.abs(lewis(zeta, begin_hz, rate, near)).max())
    assert found.max_abs == pytest.approx(top, rel=1e-7)
    assert found.at_seconds == pytest.approx(float(t[np.argmax(x)]), abs=2e-3)
    assert found.at_hz == pytest.approx(begin_hz + rate * found.at_seconds)
    inside = np.searchsorted(found.time, t, side="right") - 1
    exact = lewis(zeta, begin_hz, rate, t)
    assert np.all(exact <= found.high[inside] + 1e-6 * top)
    assert np.all(exact >= found.low[inside] - 1e-6 * top)


def brute(
    scene: Scene, load: Callable[[float], float], angle: Callable[[float], float], seconds: float, steps: int
) -> float:
    """The largest displacement of a mass with one elastic friction contact, from rest, by Heun's steps."""
    contact, c = scene.contacts[0], scene.structure.springs[0].c
    kt, mu = contact.kt, contact.mu
    h, x, v, slider, top = seconds / steps, 0.0, 0.0, 0.0, 0.0

    def pull(x: float, slider: float, t: float) -> tuple[float, float]:
        limit = mu * max(load(t), 0.0)
        force = min(max(kt * (x - slider), -limit), limit)
        return force, x - force / kt

    for step in range(steps):
        t = step * h
        a = math.cos(angle(t)) - K * x - c * v - pull(x, slider, t)[0]
        x1, v1 = x + h * v, v + h * a
        force, _ = pull(x1, slider, t + h)
        a1 = math.cos(angle(t + h)) - K * x1 - c * v1 - force
        x, v = x + 0.5 * h * (v + v1), v + 0.5 * h * (a + a1)
        slider = pull(x, slider, t + h)[1]
        top = max(top, abs(x))
    return top


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.long) for seed in range(1, 12))])
def test_a_run_with_friction_is_that_of_small_steps(seed: int) -> None:
    """Load that varies with the excitation, and on every other one with the speed."""
    rng = np.random.default_rng(seed)
    mu, n0, share, phase = (
        rng.uniform(0.1, 0.6),
        rng.uniform(0.1, 4.0),
        rng.uniform(0.0, 1.4),
        rng.uniform(0, 6),
    )
    kt, zeta, rate = K * 10.0 ** rng.uniform(-1.5, 0.3), 10.0 ** rng.uniform(-3, -1), rng.uniform(0.02, 0.1)
    begin, end = (0.6, 1.5) if rng.random() < 0.5 else (1.5, 0.6)
    follows = seed % 2 == 0
    contact = {
        "name": "c", "between": ["m", "ground"], "kt": kt, "mu": mu, "N0": n0, "N1_ratio": share,
        "N1_phase": phase,
    }  # fmt: skip
    # Loads are of the speed [1/min], which is 60 f on the line of order 1.
    line: dict[str, Any] = {
        "speed_order": 1.0,
        "with_speed": [{"path": "c.N0", "polynomial": [n0, 0.0, n0 / 3600.0]}],
    }
    scene = oscillator(zeta, contacts=[contact], **(line if follows else {}))
    seconds = abs(end - begin) / rate
    found = solver.transient(scene, begin_hz=begin, end_hz=end, rate_hz_per_s=rate, from_rest=True)
    sign = math.copysign(rate, end - begin)

    def angle(t: float) -> float:
        return 2.0 * math.pi * (begin + 0.5 * sign * t) * t

    def load(t: float) -> float:
        mean = n0 * (1.0 + (begin + sign * t) ** 2 if follows else 1.0)
        return mean * (1.0 + share * math.cos(angle(t) + phase))

    coarse, fine = (brute(scene, load, angle, seconds, int(seconds * n)) for n in (4000, 8000))
    assert found.reached
    assert found.max_abs == pytest.approx(fine, rel=max(3.0 * abs(fine / coarse - 1.0), 2e-6))
    assert abs(fine / coarse - 1.0) < 1e-3


def test_matrices_that_follow_the_speed_are_those_of_another_integrator() -> None:
    """A gyroscopic rotor on an engine-order line, its stiffness growing with the squared speed."""
    inertia, stiffness, gyro, stiffening, order = 0.02, 4000.0, 0.03, 5e-3, 3.0
    springs = [{"between": [dof, "ground"], "k": stiffness, "c": 0.3, "name": f"k{dof}"} for dof in "ab"]
    scene = Scene.from_dict({
        "name": "rotor",
        "structure": {"kind": "lumped", "masses": {"a": inertia, "b": inertia}, "springs": springs},
        "couplings": [
            {"on": "a", "of": "b", "antisymmetric": True, "gyroscopic": gyro},
            {"on": "b", "of": "b", "k_omega2": stiffening},
        ],
        "speed_order": order, "excitation": {"dof": "a", "amplitude": 7.0},
        "observe": {"dof": "a", "band": [40.0, 110.0]},
    })  # fmt: skip
    begin, end, seconds = 40.0, 110.0, 2.0
    rate = (end - begin) / seconds

    def motion(t: float, y: np.ndarray) -> list[float]:
        a, b, va, vb = y
        spin = 2.0 * math.pi * (begin + rate * t) / order
        force = 7.0 * math.cos(2.0 * math.pi * (begin + 0.5 * rate * t) * t)
        pull_a = force - stiffness * a - 0.3 * va - gyro * spin * vb
        pull_b = -(stiffness + stiffening * spin**2) * b - 0.3 * vb + gyro * spin * va
        return [va, vb, pull_a / inertia, pull_b / inertia]

    times = np.linspace(0.0, seconds, 200_001)
    other = solve_ivp(motion, (0.0, seconds), np.zeros(4), "DOP853", times, rtol=1e-10, atol=1e-14)
    found = solver.transient(scene, begin_hz=begin, end_hz=end, ramp_seconds=seconds, from_rest=True)
    assert found.reached
    assert found.max_abs == pytest.approx(float(np.abs(other.y[0]).max()), rel=2e-6)
    assert found.error_estimate < 1e-6


def test_what_settled_stays_as_the_march_has_it_and_rings_down() -> None:
    scene = solver.load_scene("two-dof")
    marched = solver.march(scene, frequency_hz=1.1)
    found = solver.transient(scene, begin_hz=1.1, end_hz=1.1, ramp_seconds=20.0)
    assert found.max_abs == pytest.approx(marched.max_abs, rel=1e-7)
    assert np.ptp(found.high) < 1e-7 * marched.max_abs
    zeta = 0.03
    free = solver.transient(
        oscillator(zeta), begin_hz=1.0, end_hz=1.0, ramp_seconds=5.0, ring_down_seconds=20.0
    )
    late = free.time > 6.0
    decay = np.polyfit(free.time[late], np.log(free.high[late]), 1)[0]
    assert decay == pytest.approx(-zeta * 2.0 * math.pi, rel=1e-3)
    assert free.max_abs == pytest.approx(1.0 / (2.0 * zeta * K), rel=1e-6)


def test_a_slow_run_comes_to_the_peak_of_the_response() -> None:
    scene = solver.load_scene("two-dof")
    peak = solver.sweep(scene, harmonics=11).peak
    assert peak is not None
    heights = [
        solver.transient(scene, begin_hz=0.9, end_hz=1.2, rate_hz_per_s=rate).max_abs for rate in (4e-3, 1e-3)
    ]
    assert heights[0] < heights[1] < peak.value * (1.0 + 1e-9)
    assert heights[1] == pytest.approx(peak.value, rel=1e-3)


def test_a_disk_is_run_through_as_its_annulus() -> None:
    scene = solver.load_scene("bladed-disk")
    at = sum(scene.observe.band) / 2.0
    found = solver.transient(scene, begin_hz=at, end_hz=at, ramp_seconds=0.05)
    assert found.max_abs == pytest.approx(solver.march(scene, frequency_hz=at).max_abs, rel=1e-7)


@each(
    ("given", "key"),
    [
        ({}, "rate_hz_per_s"),
        ({"rate_hz_per_s": 0.0}, "rate_hz_per_s"),
        ({"rate_hz_per_s": 1.0, "ramp_seconds": 1.0}, "rate_hz_per_s"),
        ({"ramp_seconds": math.nan}, "ramp_seconds"),
        ({"ramp_seconds": 1e8}, "ramp_seconds"),
        ({"begin_hz": -1.0, "ramp_seconds": 1.0}, "begin_hz"),
        ({"begin_hz": 0.0, "ramp_seconds": 1.0}, "begin_hz"),
        ({"begin_hz": 1.0, "end_hz": 1.0}, "ramp_seconds"),
        ({"ramp_seconds": 1.0, "ring_down_seconds": -1.0}, "ring_down_seconds"),
        ({"ramp_seconds": 1.0, "tolerance": 0.5}, "tolerance"),
        ({"ramp_seconds": 1.0, "steps_per_period": 17}, "steps_per_period"),
        ({"ramp_seconds": 1.0, "from_rest": True, "start": solver.MarchStart()}, "from_rest"),
    ],
)
def test_what_cannot_be_run_is_refused_by_its_name(given: dict[str, Any], key: str) -> None:
    with pytest.raises(SettingError) as refused:
        solver.transient(oscillator(0.01), **given)
    assert refused.value.name == key


def test_a_rigid_contact_is_refused() -> None:
    rigid = {"name": "c", "between": ["m", "ground"], "kt": math.inf, "mu": 0.3, "N0": 1.0}
    with pytest.raises(SettingError, match="finite stiffness"):
        solver.transient(oscillator(0.01, contacts=[rigid]), ramp_seconds=1.0)


def test_it_stops_when_asked_with_what_was_run_through() -> None:
    asked = iter([False, True])
    found = solver.transient(
        oscillator(0.01), ramp_seconds=1000.0, from_rest=True, should_stop=lambda: next(asked)
    )
    assert found.status is TransientStatus.STOPPED
    assert 0 < found.time.size < 1000


def coupled(damping: dict[str, Any]) -> Scene:
    """Eight masses on springs to all others and to the ground, as full matrices; a slider, two forces."""
    rng, n = np.random.default_rng(5), 8
    k, names = np.triu(10.0 ** rng.uniform(0.5, 2.0, (n, n)), 1), [f"d{i}" for i in range(n)]
    K = np.diag((k + k.T).sum(axis=1) + rng.uniform(5.0, 50.0, n)) - k - k.T
    contact = {"name": "c", "between": ["d3", "d5"], "kt": 80.0, "mu": 0.4, "N0": 0.02, "N1_ratio": 0.5}
    structure = {"kind": "matrices", "M": np.diag(rng.uniform(0.5, 2.0, n)).tolist(), "K": K.tolist()}
    return Scene.from_dict({
        "name": "coupled", "structure": {**structure, "dofs": names, **damping}, "contacts": [contact],
        "excitation": [{"dof": "d1", "amplitude": 1.0}, {"dof": "d7", "amplitude": 0.3, "harmonic": 3}],
        "observe": {"dof": "d4", "band": [0.2, 2.0]},
    })  # fmt: skip


@pytest.mark.parametrize("damping", [{"damping_ratio": 0.03}, {"stiffness_proportional_damping": 2e-3}])
def test_full_matrices_are_followed_in_their_modes(damping: dict[str, Any]) -> None:
    """From a given start they stay in their DOFs, and a march always does."""
    scene = coupled(damping)
    assert in_modes(equations_of_motion(scene, 1.0)).modes is not None
    asked: dict[str, Any] = {"begin_hz": 0.4, "end_hz": 1.0, "ramp_seconds": 15.0}
    in_dofs = solver.transient(scene, **asked, start=solver.MarchStart())
    found = solver.transient(scene, **asked, from_rest=True)
    assert found.reached
    assert found.max_abs == pytest.approx(in_dofs.max_abs, rel=1e-6)
    np.testing.assert_allclose(found.high, in_dofs.high, atol=1e-5 * found.max_abs)
    settled = solver.transient(scene, begin_hz=0.8, end_hz=0.8, ramp_seconds=5.0)
    assert settled.max_abs == pytest.approx(solver.march(scene, frequency_hz=0.8).max_abs, rel=1e-6)


def test_several_rates_are_runs_at_each_and_come_to_the_peak() -> None:
    zeta, rates = 0.1, [0.2, 0.02, 0.002]
    asked: dict[str, Any] = {"begin_hz": 0.7, "end_hz": 1.3}
    found = solver.transient(oscillator(zeta), **asked, rates=[0.02, 0.002, 0.2])
    assert found.reached
    assert found.rates.tolist() == rates
    alone = [solver.transient(oscillator(zeta), **asked, rate_hz_per_s=rate).max_abs for rate in rates]
    assert found.rates_max_abs.tolist() == alone
    peak = 1.0 / (2.0 * zeta * math.sqrt(1.0 - zeta**2) * K)
    assert alone[0] < alone[1] < alone[2] == pytest.approx(peak, rel=1e-2)
    assert alone[2] < peak
    for wrong in ({"rate_hz_per_s": 0.1}, {"ramp_seconds": 1.0}):
        with pytest.raises(SettingError, match="must not be given beside"):
            solver.transient(oscillator(zeta), **asked, rates=rates, **wrong)
