"""Wear over life against closed forms, small steps with the time march, and differences."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, minimize_scalar
from tests.cases.moving_scenes import moving_scene
from tests.cases.random_scenes import random_scene

from solver import Scene, load_scene, march
from solver.errors import SettingError
from solver.studies.wear_life.life import wear_life
from solver.studies.wear_life.result import WearLife, WearLifeStatus

M, K, C, KT, MU, F = 1.0, 40.0, 0.3, 25.0, 0.4, 12.0
COEFFICIENT, AREA, LOSS = 1e-12, 2e-4, 4e6
FADE = 3600.0 * COEFFICIENT / AREA * LOSS  # N an hour for a watt


def _oscillator(N0: float) -> Scene:
    """One mass on a spring, with a damper to the ground."""
    return Scene.from_dict(
        {
            "name": "one",
            "structure": {
                "kind": "lumped", "masses": {"x": M},
                "springs": [{"between": ["x", "ground"], "k": K, "c": C}],
            },
            "contacts": [{"name": "damper", "between": ["x", "ground"], "kt": KT, "mu": MU, "N0": N0}],
            "excitation": {"dof": "x", "amplitude": F}, "observe": {"dof": "x", "band": [0.4, 2.0]},
        }
    )  # fmt: skip


def _amplitude(omega: float, N: float) -> float:
    """First-harmonic amplitude by the describing function of a Jenkins element (Caughey, 1960)."""

    def off(X: float) -> float:
        cosine = 1.0 - 2.0 * MU * N / (KT * X)
        theta = math.acos(max(cosine, -1.0)) if cosine > -1.0 else math.pi
        k = KT / math.pi * (theta - 0.5 * math.sin(2.0 * theta))
        c = KT / math.pi * math.sin(theta) ** 2
        return X * math.hypot(K + k - M * omega**2, C * omega + c) - F

    return float(brentq(off, 1e-9, 1e3, xtol=1e-15, rtol=1e-14))


def _power(omega: float, N: float) -> float:
    """4 μN (X − μN/kt) in every period."""
    return 4.0 * MU * N * (_amplitude(omega, N) - MU * N / KT) * omega / (2.0 * math.pi)


def _peak(N: float) -> tuple[float, float]:
    found = minimize_scalar(
        lambda omega: -_amplitude(omega, N), bounds=(5.0, 10.0), method="bounded", options={"xatol": 1e-9}
    )
    return float(found.x), -float(found.fun)


def _run(scene: Scene, hours: float, **more: Any) -> WearLife:
    given: dict[str, Any] = {"load_loss_per_depth": LOSS, "harmonics": 1, **more}
    return wear_life(scene, hours, given.pop("coefficient", COEFFICIENT), AREA, **given)


@pytest.mark.parametrize("hertz", [0.9, 1.05, 1.3])
def test_loads_follow_the_closed_form_at_a_fixed_frequency(hertz: float) -> None:
    omega = 2.0 * math.pi * hertz
    found = _run(_oscillator(12.0), 0.6 / FADE, frequency_hz=hertz, tolerance=1e-9)
    exact = solve_ivp(
        lambda _, N: [-FADE * _power(omega, N[0])], (0.0, found.hours[-1]), [12.0], rtol=1e-12, atol=1e-13,
        t_eval=found.hours, method="DOP853",
    )  # fmt: skip
    assert found.reached
    np.testing.assert_allclose(found.loads[0], exact.y[0], rtol=1e-8)
    np.testing.assert_allclose(
        found.amplitude, [_amplitude(omega, N) for N in exact.y[0]], rtol=1e-8
    )


def test_loads_follow_the_closed_form_at_the_peak() -> None:
    found = _run(_oscillator(12.0), 0.15 / FADE, tolerance=1e-9)
    exact = solve_ivp(
        lambda _, N: [-FADE * _power(_peak(N[0])[0], N[0])], (0.0, found.hours[-1]), [12.0], rtol=1e-10,
        atol=1e-11, t_eval=found.hours,
    )  # fmt: skip
    assert found.reached and found.loads[0, -1] < 9.0
    np.testing.assert_allclose(found.loads[0], exact.y[0], rtol=1e-6)
    np.testing.assert_allclose(found.amplitude, [_peak(N)[1] for N in exact.y[0]], rtol=1e-6)


def test_small_steps_with_the_time_march_come_to_the_same() -> None:
    hertz, N = 1.1, 20.0
    found = wear_life(
        _oscillator(N), 0.15 / FADE, COEFFICIENT, AREA, load_loss_per_depth=LOSS, frequency_hz=hertz,
        harmonics=51, points=2,
    )  # fmt: skip

    def power(load: float) -> float:
        period = march(_oscillator(load), frequency_hz=hertz, tolerance=1e-9)
        return _area(period.slip[0], period.contact_force[0]) * hertz

    steps = 24
    for _ in range(steps):  # midpoint steps
        step = found.hours[-1] / steps
        N -= step * FADE * power(N - 0.5 * step * FADE * power(N))
    assert found.loads[0, -1] == pytest.approx(N, rel=2e-5)
    assert N < 19.0


def _area(u: np.ndarray, f: np.ndarray) -> float:
    """Area of a loop."""
    return abs(0.5 * float(np.sum(u * np.roll(f, -1) - f * np.roll(u, -1))))


def test_a_larger_coefficient_is_a_faster_clock() -> None:
    scene = load_scene("two-dof")
    slow = _run(scene, 0.04, harmonics=5, coefficient=1e-11, points=2)
    fast = _run(scene, 0.01, harmonics=5, coefficient=4e-11, points=2)
    np.testing.assert_allclose(fast.depths, slow.depths, rtol=1e-7)
    assert fast.amplitude[-1] == pytest.approx(slow.amplitude[-1], rel=1e-8)


def _differences(value: Any, at: float, step: float) -> np.ndarray:
    """Central differences of order 4."""
    two, one, less, least = (np.asarray(value(at + k * step)) for k in (2.0, 1.0, -1.0, -2.0))
    return np.asarray((8.0 * (one - less) - (two - least)) / (12.0 * step))


def _seen(found: WearLife) -> np.ndarray:
    assert found.status in (WearLifeStatus.COMPLETED, WearLifeStatus.WORN_OUT), found.status
    return np.array([found.amplitude[-1], found.highest, *found.depths[:, -1]])


def _slopes(found: WearLife) -> np.ndarray:
    return np.concatenate([found.end_slopes[None], found.highest_slopes[None], found.depth_slopes])


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("at_peak", [True, False])
def test_derivatives_are_those_of_the_whole_life(seed: int, at_peak: bool) -> None:
    scene, hertz, _ = random_scene(seed)
    names = [contact.name for contact in scene.contacts]
    load = max(contact.N0 for contact in scene.contacts)
    given: dict[str, Any] = {
        "load_loss_per_depth": {name: 1e6 * load * (1.0 + 0.3 * i) for i, name in enumerate(names)},
        "stiffness_loss_per_depth": {names[0]: 2e5 * scene.contacts[0].kt}, "harmonics": 3,
        "frequency_hz": None if at_peak else hertz, "points": 2, "tolerance": 1e-9,
    }  # fmt: skip
    paths = (f"{names[0]}.N0", f"{names[-1]}.kt", f"{names[0]}.mu", "coefficient")

    def life(coefficient: float, changes: dict[str, float], hours: float, of: tuple[str, ...]) -> WearLife:
        return wear_life(scene.with_values(changes), hours, coefficient, 1e-4, paths=of, **given)

    first = life(1e-15, {}, 1e-3, ())
    wears = np.abs(first.power).max()
    if wears == 0.0:
        pytest.skip("all stick")
    # A fifth of the load of what wears the fastest goes in all hours.
    sizes = np.array([given["load_loss_per_depth"][name] for name in names]) / [c.N0 for c in scene.contacts]
    coefficient, hours = 0.2 * 1e-4 / 3600.0 / (first.power[:, 0] * sizes).max(), 1.0
    found = life(coefficient, {}, hours, paths)
    slopes = _slopes(found)
    for i, path in enumerate(paths):
        def seen(value: float, path: str = path) -> np.ndarray:
            if path == "coefficient":
                return _seen(life(value, {}, hours, ()))
            return _seen(life(coefficient, {path: value}, hours, ()))

        at = coefficient if path == "coefficient" else scene.value(path)
        expected = _differences(seen, at, 1e-3 * at)
        size = np.abs(_seen(found)) / at
        np.testing.assert_allclose(slopes[:, i], expected, atol=2e-5 * size.max() + 1e-300, rtol=2e-4)
