"""Known truth comes back within its own confidence: under noise, outliers and folds, from a time march."""

import sys
from typing import Any

import numpy as np
import pytest
from measured_cases import TWO_DOF, incremental_loop, two_dof_runs

import optim
import solver

SCENE = solver.load_scene("two-dof")
BOUNDS = {"damper.kt": (15.0, 80.0), "damper.mu": (0.1, 0.6)}
SIGMAS = 4.0  # standard errors that an estimate of one draw may be off


def identified(data: list[dict[str, Any]], **settings: Any) -> optim.Identification:
    return optim.identify(SCENE, data, BOUNDS, **{"harmonics": 9, "starts": 2, "candidates": {}, **settings})


def off(found: optim.Identification, truth: dict[str, float]) -> float:
    """The largest distance from the truth, in standard errors."""
    return max(abs(one.value - truth[one.name]) / one.standard_error for one in found.estimates)


def test_two_unknowns_come_back_from_the_other_end_of_their_bounds() -> None:
    found = identified(two_dof_runs(np.random.default_rng(1), 0.02), starts=4)
    assert found.reached
    assert off(found, TWO_DOF) < SIGMAS
    assert found.noise == pytest.approx(0.02, rel=0.2)
    assert all(one.standard_error < 0.02 * one.value for one in found.estimates)


def test_amplitudes_without_phases_do() -> None:
    found = identified(two_dof_runs(np.random.default_rng(2), 0.05, phase=False))
    assert found.reached
    assert off(found, TWO_DOF) < SIGMAS


def covered(draws: int, noise: float = 0.03) -> float:
    """The share of the intervals that hold the truth."""
    inside = []
    for draw in range(draws):
        found = identified(two_dof_runs(np.random.default_rng(100 + draw), noise), starts=1)
        inside += [one.interval[0] <= TWO_DOF[one.name] <= one.interval[1] for one in found.estimates]
    return float(np.mean(inside))


def test_intervals_of_a_few_draws_hold_the_truth() -> None:
    assert covered(4) >= 0.75


@pytest.mark.long
@pytest.mark.parametrize("noise", [0.01, 0.03, 0.05])
def test_95_per_cent_intervals_hold_the_truth_as_often(noise: float) -> None:
    share = covered(100, noise)
    sys.stdout.write(
        f"{100.0 * noise:g} % of noise: 95 % intervals hold the truth in {100.0 * share:.1f} %\n"
    )
    assert 0.90 <= share <= 0.99


def marched(hertz: list[float], conditions: dict[str, float]) -> dict[str, Any]:
    """A run of max|x| by time marching, which shares nothing with the balance."""
    scene = SCENE.with_values({**TWO_DOF, **conditions})
    found = [solver.march(scene, frequency_hz=f) for f in hertz]
    assert all(one.converged for one in found)
    return {"frequency": hertz, "max_abs": [one.max_abs for one in found], "conditions": conditions}


def test_data_of_the_time_march_give_the_same_parameters() -> None:
    runs = [
        marched([1.0, 1.1, 1.25, 1.4], {"excitation.amplitude": 100.0, "damper.N0": 100.0}),
        marched([1.0, 1.15, 1.3], {"excitation.amplitude": 100.0, "damper.N0": 50.0}),
    ]
    found = identified(runs, harmonics=21, starts=1)
    assert found.reached
    for one in found.estimates:
        assert one.value == pytest.approx(TWO_DOF[one.name], rel=3e-3)


def test_outliers_do_not_move_a_robust_fit() -> None:
    rng = np.random.default_rng(5)
    data = two_dof_runs(rng, 0.02)
    for run in data:
        for i in rng.choice(len(run["real"]), 2, replace=False):  # 2 of 16 points
            factor = rng.choice([0.4, 2.5])
            run["real"][i] *= factor
            run["imag"][i] *= factor
    robust, plain = identified(data, robust=True), identified(data)
    assert off(robust, TWO_DOF) < SIGMAS
    assert robust.noise < 0.04
    assert plain.noise > 0.1
    for one in robust.estimates:
        assert one.interval[0] <= TWO_DOF[one.name] <= one.interval[1]


def test_priors_count_as_measurements() -> None:
    """With noise that hides the data the prior is left; its standard error is the prior's."""
    data = two_dof_runs(np.random.default_rng(6), 0.02)[:1]
    found = optim.identify(
        SCENE, data, BOUNDS, priors={"damper.mu": (0.3, 1e-4)}, harmonics=9, starts=1, candidates={}
    )
    mu = found.estimates[1]
    assert mu.value == pytest.approx(0.3, abs=2e-4)
    assert mu.standard_error == pytest.approx(1e-4, rel=0.05)


def test_loops_give_stiffness_and_friction() -> None:
    """The loop is of an incremental slider on a fine path, not of the law."""
    rng = np.random.default_rng(7)
    data = []
    for load, amplitude in ((100.0, 2.5), (150.0, 4.0)):
        motion, force = incremental_loop(33.0, 0.27 * load, amplitude, 400)
        noisy = force + 0.02 * np.abs(force).max() * rng.normal(size=force.size)
        conditions = {"damper.N0": load, "damper.N1_ratio": 0.0}
        data.append({"motion": motion.tolist(), "force": noisy.tolist(), "conditions": conditions})
    found = identified(data)
    assert found.reached
    assert off(found, TWO_DOF) < SIGMAS
    assert found.noise == pytest.approx(0.02, rel=0.2)


def duffing(k3: float) -> solver.Scene:
    """A mass on a hardening spring, with folds."""
    return solver.Scene.from_dict(
        {
            "name": "duffing",
            "structure": {
                "kind": "lumped",
                "masses": {"m": 1.0},
                "springs": [{"between": ["m", "ground"], "k": 40.0, "c": 0.15}],
            },
            "contacts": [
                {
                    "name": "stop",
                    "law": "polynomial",
                    "between": ["m", "ground"],
                    "a3": k3,
                }
            ],
            "excitation": {"dof": "m", "amplitude": 1.0},
            "observe": {"dof": "m", "band": [0.8, 1.6]},
        }
    )


def amplitudes_at(branch: solver.Branch, hertz: float) -> list[float]:
    """The amplitudes of all responses at a frequency, interpolated."""
    ahead = branch.values - hertz
    at = np.flatnonzero(ahead[:-1] * ahead[1:] <= 0.0)
    share = ahead[at] / (ahead[at] - ahead[at + 1])
    return list((1.0 - share) * branch.amplitude[at] + share * branch.amplitude[at + 1])


def test_the_branch_the_data_are_on_is_followed() -> None:
    """Above the fold there are three responses: data of the upper one are no data of the lower one."""
    truth, rng = 5.0, np.random.default_rng(8)
    branch = solver.sweep(duffing(truth), start=0.9, stop=1.4, harmonics=9)
    fold = float(branch.values[np.argmax(branch.amplitude)])
    hertz = np.linspace(0.95, 0.99 * fold, 10)
    upper = [max(amplitudes_at(branch, f)) for f in hertz.tolist()]
    seen = np.array(upper) * (1.0 + 0.01 * rng.normal(size=hertz.size))
    data = [{"frequency": hertz.tolist(), "max_abs": seen.tolist()}]
    found = optim.identify(duffing(4.0), data, {"stop.a3": (2.0, 12.0)}, harmonics=5, starts=3, candidates={})
    assert found.fitted
    (k3,) = found.estimates
    assert k3.value == pytest.approx(truth, rel=0.03)
    assert found.noise < 0.03
