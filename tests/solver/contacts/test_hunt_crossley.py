"""A stop with damping while it is closed: restitution in closed form, the gap spring, SciPy and the march."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from each import each
from lumped_structure import lumped
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import solver
from solver.contacts.laws.history.hunt_crossley import force, slopes

STOP: dict[str, Any] = {
    "name": "stop", "law": "hunt-crossley", "between": ["a", "ground"], "k": 4.0, "gap": 0.2, "chi": 0.6,
}  # fmt: skip
NOTHING = np.zeros(0)


def scene(**stop: Any) -> solver.Scene:
    given = {key: value for key, value in {**STOP, **stop}.items() if value is not None}
    return solver.Scene.from_dict(
        {
            "name": "stopped",
            "structure": lumped({"a": 1.0}, ("a", "ground", 1.0, 0.02)),
            "contacts": [given],
            "excitation": {"dof": "a", "amplitude": 0.3},
            "observe": {"dof": "a", "band": [0.05, 0.4]},
        }
    )


@pytest.mark.parametrize("chi", [0.0, 0.05, 0.6, 5.0])
@pytest.mark.parametrize("speed", [0.1, 2.0])
def test_a_mass_rebounds_as_published(speed: float, chi: float) -> None:
    p = np.array([40.0, 0.0, chi])
    flight = solve_ivp(
        lambda _, s: [s[1], -force(s[0], s[1], NOTHING, p)], (0.0, 5.0), [0.0, speed],
        rtol=1e-10, atol=1e-13, max_step=2e-3,
    )  # fmt: skip
    left = -float(flight.y[1, -1])
    assert flight.y[0, -1] < 0.0
    if chi == 0.0:
        expected = speed
    else:

        def mismatch(w: float) -> float:
            return math.log((1.0 + chi * speed) / (1.0 - chi * w)) - chi * (speed + w)

        expected = brentq(mismatch, 1e-9, min(speed, (1.0 - 1e-12) / chi))
    assert left == pytest.approx(expected, rel=1e-6)


@each("seed", range(10))
def test_slopes_are_differences(seed: int) -> None:
    rng = np.random.default_rng(seed)
    at = np.array([*rng.normal(size=2), *rng.uniform(0.1, 3.0, size=3)])
    at[3] = rng.normal()
    out = np.zeros((1, 5))
    slopes(at[0], at[1], NOTHING, at[2:], out)
    for i, unit in enumerate(np.eye(5)):
        high, low = (force(x[0], x[1], NOTHING, x[2:]) for x in (at + 1e-6 * unit, at - 1e-6 * unit))
        assert out[0, i] == pytest.approx((high - low) / 2e-6, abs=1e-6)


def test_without_damping_it_is_the_gap_spring() -> None:
    found = solver.solve(scene(chi=0.0, samples=1024), frequency_hz=0.2, harmonics=7)
    other = solver.solve(scene(law="gap", chi=None), frequency_hz=0.2, harmonics=7)
    assert found.max_abs == pytest.approx(other.max_abs, rel=1e-4)


@pytest.mark.few(2)
@pytest.mark.parametrize(("hz", "stop"), [(0.1, {}), (0.2, {}), (0.2, {"gap": -0.1, "chi": 2.0})])
def test_the_balance_is_what_marching_and_scipy_give(hz: float, stop: dict[str, float]) -> None:
    given = scene(**stop)
    found = solver.solve(given, frequency_hz=hz, harmonics=31)
    referee = solver.march(given, frequency_hz=hz)
    p = np.array([4.0, given.value("stop.gap"), given.value("stop.chi")])

    def rate(t: float, s: np.ndarray) -> list[float]:
        pull = 0.3 * math.cos(2.0 * math.pi * hz * t) - s[0] - 0.02 * s[1]
        return [s[1], pull - force(s[0], s[1], NOTHING, p)]

    run = solve_ivp(rate, (0.0, 120.0 / hz), [0.0, 0.0], rtol=1e-9, atol=1e-11, max_step=0.05)
    last = run.t > 119.0 / hz
    assert found.converged
    assert found.max_abs == pytest.approx(referee.max_abs, rel=3e-5)
    assert referee.max_abs == pytest.approx(np.abs(run.y[0, last]).max(), rel=1e-3)


def test_gradients_are_differences() -> None:
    given, paths, step = scene(samples=256), ["stop.k", "stop.gap", "stop.chi"], 1e-5
    found = solver.sweep(given, start=0.19, stop=0.191, harmonics=7)
    hz = float(found.values[0])
    slopes_of = solver.Sensitivities(found.balance, paths)
    gradient = slopes_of.gradient(found.solutions[0][:-1], hz).by_parameters
    for path, slope in zip(paths, gradient, strict=True):
        high, low = (
            solver.solve(given.with_values({path: given.value(path) + s}), frequency_hz=hz, harmonics=7)
            for s in (step, -step)
        )
        assert slope == pytest.approx((high.max_abs - low.max_abs) / (2.0 * step), rel=1e-2), path


def test_a_plan_says_that_it_opens() -> None:
    assert scene().contacts[0].separation == (True, "stop opens and closes as it moves")
    with pytest.raises(solver.SceneError, match="`chi`"):
        scene(chi=-1.0)
