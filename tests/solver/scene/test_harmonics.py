"""Harmonics of forces and loads are kept whatever number is asked for, and everything built on them fits."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from each import each
from referee import lost_power, motion_error
from scene_cases import two_dof

import optim
import solver
from solver import Scene, march, solve, sweep
from solver.balance.balance import build, fewer_harmonics, less_harmonics, more_harmonics, pad
from solver.scene.scene_harmonics import FAST, MOST_HARMONICS, forced_harmonics, kept_harmonics, spread

DEFECTS = Path(__file__).parent.parent.parent / "data" / "defects"
ASKED = (0, 1, 2, 3, 5, 11, 12, 24, 61)


def fast_force() -> Scene:
    return solver.load_scene(str(DEFECTS / "A_harmonic_dropped.toml"))


def random_forces(seed: int) -> Scene:
    """Two masses and a contact under one to three forces of harmonics up to 40, loads that vary or not."""
    rng = np.random.default_rng(12_000 + seed)
    forces: list[dict[str, Any]] = [
        {
            "dof": str(rng.choice(["a", "b"])),
            "amplitude": float(10.0 ** rng.uniform(-1.0, 1.0)),
            "harmonic": int(rng.integers(0, 41)),
        }
        for _ in range(rng.integers(1, 4))
    ]
    return Scene.from_dict(
        {
            "name": f"forces-{seed}",
            "structure": {
                "kind": "lumped",
                "masses": {"a": 1.0, "b": float(rng.uniform(0.3, 2.0))},
                "springs": [
                    {"between": ["a", "ground"], "k": 40.0, "c": float(10.0 ** rng.uniform(-2.0, 0.0))},
                    {"between": ["a", "b"], "k": 30.0, "c": 0.05},
                ],
            },
            "contacts": [
                {
                    "name": "d",
                    "between": ["b", "ground"],
                    "kt": 30.0,
                    "mu": 0.3,
                    "N0": float(10.0 ** rng.uniform(0.0, 1.5)),
                    "N1_ratio": 0.0 if rng.random() < 0.5 else float(rng.uniform(0.0, 1.5)),
                }
            ],
            "excitation": forces,
            "observe": {"dof": "b", "band": [0.05, 1.5]},
        }
    )


@each("seed", range(20))
def test_forces_and_loads_are_always_kept(seed: int):
    scene = random_forces(seed)
    forced = set(forced_harmonics(scene))
    before: set[int] = set()
    for highest in ASKED:
        kept = kept_harmonics(scene, (), highest, odd=False)
        assert np.all(np.diff(kept) > 0)
        assert kept[-1] <= MOST_HARMONICS
        assert forced | set(range(highest + 1)) | before <= set(kept.tolist())
        before = set(kept.tolist())
        balance = build(scene, harmonics=highest)
        odd = set(balance.system.ks.tolist())
        assert {h for h in forced if h > 0} <= odd
        assert balance.n_harmonics == highest
        assert balance.highest_harmonic == max(highest, max(odd))


def test_slow_forces_keep_what_they_kept():
    for highest in ASKED[1:]:
        assert build(two_dof(), harmonics=highest).system.ks.tolist() == list(range(highest + 1))
    assert build(two_dof(), harmonics=0).system.ks.tolist() == [0, 1]
    assert FAST > 1


@pytest.mark.parametrize("seed", range(6))
def test_coefficients_go_where_their_harmonics_are(seed: int):
    rng = np.random.default_rng(seed)
    scene = random_forces(seed)
    few = build(scene, harmonics=3)
    wide = more_harmonics(few, 13)
    assert set(few.system.ks) <= set(wide.system.ks)
    q = rng.normal(size=few.n_unknowns)
    np.testing.assert_array_equal(pad(pad(q, few, wide), wide, few), q)
    least = fewer_harmonics(few, 1)
    assert {h for h in forced_harmonics(scene) if h > 0} <= set(least.system.ks.tolist())
    np.testing.assert_array_equal(less_harmonics(wide, 3).system.ks, few.system.ks)
    same = spread(q, few.system.ks, few.system.ks)
    np.testing.assert_array_equal(same, q)


@pytest.mark.parametrize(
    "seed", [0, 1, 3, 4, *(pytest.param(s, marks=pytest.mark.long) for s in range(5, 30))]
)
def test_a_solution_balances_and_is_what_a_march_finds(seed: int):
    scene = random_forces(seed)
    solution = solve(scene, frequency_hz=0.31, harmonics=11)
    assert solution.converged
    assert motion_error(solution) < 1e-8
    assert lost_power(solution) < 1e-8
    assert solution.observed.size == 2 * solution.highest_harmonic + 1 == 2 * solution.harmonics.size - 1
    truth = march(scene, frequency_hz=0.31)
    if truth.converged and "mean_undetermined" not in solution.flags:
        allowed = solution.error_estimate + (1e-6 + 10.0 * truth.error_estimate) * truth.half_peak_to_peak
        assert abs(solution.half_peak_to_peak - truth.half_peak_to_peak) <= allowed


@pytest.mark.parametrize("highest", [0, 1, 3, 11])
def test_the_peak_of_a_fast_force(highest: int):
    """0.2324 m at 0.1304 Hz, where 12 ω meets a resonance; without the force of harmonic 12, 0.0065 m."""
    scene = fast_force()
    branch = sweep(scene, start=0.12, stop=0.14, harmonics=highest)
    assert branch.reached
    assert branch.peak is not None
    fine = solve(scene, frequency_hz=branch.peak.at, harmonics=61)
    assert branch.peak.at == pytest.approx(0.13036, rel=1e-4)
    assert branch.peak.value == pytest.approx(fine.max_abs, rel=3e-3)
    assert abs(branch.peak.value - 0.232434) <= branch.error_estimate
    assert branch.observed.shape[1] == 2 * branch.balance.highest_harmonic + 1
    assert branch.to_dataset().kind == "branch"


@pytest.mark.long
def test_the_design_under_a_fast_force():
    scene = fast_force()
    found = optim.design(scene, variables={"d.N0": (0.5, 50.0)})
    heights = []
    for load in np.linspace(0.9, 1.1, 9) * found.optimum["d.N0"]:
        here = scene.with_values({"d.N0": float(load)})
        peaks = [solve(here, frequency_hz=float(f), harmonics=29).max_abs for f in _near(here)]
        heights.append(max(peaks))
    assert found.peak is not None
    assert found.peak.value <= min(heights) * (1.0 + 2e-3)


def _near(scene: Scene) -> np.ndarray:
    peaks = [peak.at for peak in sweep(scene, harmonics=23).peaks[:3]]
    return np.concatenate([np.linspace(0.99, 1.01, 21) * at for at in peaks])


def test_the_period_of_a_fast_force_is_drawn_whole():
    solution = solve(fast_force(), frequency_hz=0.1304, harmonics=3)
    time, x = solver.time_history(solution, "b", samples=2048)
    assert time.size == 2048
    assert float(np.abs(x).max()) == pytest.approx(solution.max_abs, rel=1e-3)
    assert math.isclose(solution.harmonics[12], np.hypot(*solution.observed[23:25]), rel_tol=1e-12)
