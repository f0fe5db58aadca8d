"""Responses that lean to one side though nothing breaks their symmetry, and waves that are assumed."""

import math
from typing import Any

import numpy as np
import pytest
from law_scene_cases import CUBIC, GAP, cyclic
from scene_cases import bladed_disk, two_dof

from solver import Effects, Scene, march, plan, solve, sweep
from solver.balance.balance import build
from solver.continuation.branches.symmetry_breaking import NOT_UNIQUE, SYMMETRIC_UNSTABLE, WAVE_ASSUMED
from solver.scene.scene_harmonics import even_harmonics_reason


def duffing(force: float, c: float = 0.2, a3: float = 1.0, k: float = 1.0) -> Scene:
    return Scene.from_dict(
        {
            "name": "duffing",
            "structure": {
                "kind": "lumped",
                "masses": {"x": 1.0},
                "springs": [{"between": ["x", "ground"], "k": k, "c": c}],
            },
            "contacts": [{"name": "cubic", "law": "polynomial", "between": ["x", "ground"], "a3": a3}],
            "excitation": {"dof": "x", "amplitude": force},
            "observe": {"dof": "x", "band": [0.1, 0.4]},
        }
    )


@pytest.mark.parametrize(
    ("force", "omega", "leans"),
    [(15.0, 1.6, True), (20.0, 1.2, True), (40.0, 1.2, True), (15.0, 1.0, False), (15.0, 2.0, False)],
)
def test_duffing_is_what_a_march_finds(force: float, omega: float, leans: bool):
    """At F = 15, ω = 1.6 rad/s the symmetric response, 3.3130, is not stable; 3.9161 is."""
    frequency_hz = omega / (2.0 * math.pi)
    found = solve(duffing(force), frequency_hz=frequency_hz, harmonics=21)
    truth = march(duffing(force), frequency_hz=frequency_hz, max_periods=400)
    assert found.converged
    assert truth.converged
    assert (NOT_UNIQUE in found.flags) == leans
    assert found.max_abs == pytest.approx(truth.max_abs, rel=3e-5)
    assert (abs(found.mean) > 1e-3 * found.max_abs) == leans


def random_duffing(seed: int) -> tuple[Scene, float]:
    rng = np.random.default_rng(90_000 + seed)
    force = float(10.0 ** rng.uniform(-0.5, 1.7))
    scene = duffing(force, c=float(rng.uniform(0.1, 0.5)), a3=float(10.0 ** rng.uniform(-1.0, 0.5)))
    return scene, float(rng.uniform(0.6, 2.5)) / (2.0 * math.pi)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(40))
def test_a_response_without_a_flag_is_stable_or_one_of_several(seed: int):
    """Where solve leans it leans as the march does; where only one response exists they are the same."""
    scene, frequency_hz = random_duffing(seed)
    found = solve(scene, frequency_hz=frequency_hz, harmonics=31)
    truth = march(scene, frequency_hz=frequency_hz, max_periods=600)
    if not found.converged or not truth.converged or SYMMETRIC_UNSTABLE in found.flags:
        return
    close = abs(found.half_peak_to_peak - truth.half_peak_to_peak) < 1e-3 * truth.half_peak_to_peak
    # The march ends on one of the stable responses: on another than solve where there are several.
    assert close or abs(found.half_peak_to_peak / truth.half_peak_to_peak - 1.0) > 0.01


def test_a_branch_through_an_unstable_symmetric_response_says_so():
    unstable = sweep(duffing(15.0), start=0.2, stop=0.3, harmonics=9)
    assert unstable.reached
    assert unstable.flags == (SYMMETRIC_UNSTABLE,)
    assert unstable.to_json()["flags"] == [SYMMETRIC_UNSTABLE]
    assert sweep(duffing(0.1), start=0.2, stop=0.3, harmonics=5).flags == ()
    assert sweep(two_dof(N1=0.0), start=1.0, stop=1.2, harmonics=3).flags == ()


def test_even_harmonics_are_left_out_for_friction_and_linear_springs_only():
    assert even_harmonics_reason(two_dof(N1=0.0)) is None
    reason = even_harmonics_reason(duffing(1.0))
    assert reason is not None
    assert "cubic" in reason
    linear = duffing(1.0).to_dict()
    for coefficient, ks in ((0.5, [1, 3]), (-0.5, [0, 1, 2, 3])):
        linear["contacts"] = [
            {"name": "s", "law": "polynomial", "between": ["x", "ground"], "a1": coefficient}
        ]
        assert build(Scene.from_dict(linear), harmonics=3).system.ks.tolist() == ks


@pytest.mark.parametrize(
    ("contact", "assumed"),
    [(GAP, True), (CUBIC, True), ({"kt": 1.0, "mu": 0.2, "N0": 1.0, "N1": 0.5}, False)],
)
def test_one_sector_is_assumed_where_laws_allow_other_motions(contact: dict[str, Any], assumed: bool):
    ring = cyclic(contact)
    effect = next(e for e in plan(ring).effects if e.name == "one sector for the annulus")
    assert effect.used
    assert ("not proven" in effect.reason) == assumed
    one = solve(ring, frequency_hz=0.2, harmonics=3)
    assert (WAVE_ASSUMED in one.flags) == assumed
    whole = solve(ring, frequency_hz=0.2, harmonics=3, effects=Effects(every_sector=True))
    assert WAVE_ASSUMED not in whole.flags


def test_friction_alone_assumes_nothing():
    assert sweep(bladed_disk(), start=700.0, stop=710.0, harmonics=3).flags == ()
