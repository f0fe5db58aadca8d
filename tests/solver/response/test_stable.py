"""Whether answers are stable, as they say it by themselves: judged by marches that begin beside them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from each import each
from moving_scenes import moving_scene
from scene_cases import bladed_disk, duffing, two_dof

import optim
from solver import Scene, march, plan, solve, solve_all, sweep
from solver.response.stability import verdict
from solver.response.stability.cost import forecast
from solver.results.known import Stable
from solver.studies.instant import start_of

BOX: dict[str, Any] = json.loads((Path(__file__).parents[2] / "data" / "unstable_box.json").read_text())


def test_an_unstable_answer_says_so_and_names_the_stable_one():
    """A box limit under a load that moves: a march leaves the answer of `solve` and ends in the one named."""
    scene = Scene.from_dict(BOX["scene"])
    solution = solve(scene, frequency_hz=BOX["hz"])
    assert solution.stable is Stable.NO
    marched = march(scene, frequency_hz=BOX["hz"])
    assert abs(marched.half_peak_to_peak / solution.half_peak_to_peak - 1.0) > 0.5
    named = f"{marched.half_peak_to_peak:.3g} m"
    assert named in solution.stability.ground
    assert named in str(solution.summary())
    told = solution.to_json()
    assert told["stable"] == "no"
    assert named in str(told["stable_ground"])
    assert solution.stability is solution.stability


def test_given_loads_need_no_multipliers():
    solution = solve(two_dof(), frequency_hz=1.1)
    assert solution.stable is Stable.YES
    assert solution.to_json()["stable"] == "yes"
    assert "loads are given" in solution.stability.ground


@each("seed", range(12))
def test_random_answers_stay_or_leave_as_they_say(seed: int):
    """A march begins a little beside the answer: it stays near if the answer is stable, and leaves if not."""
    scene, frequency_hz = moving_scene(seed)
    solution = solve(scene, frequency_hz=frequency_hz, harmonics=15)
    if not solution.converged or solution.flags or solution.stable is Stable.NOT_KNOWN:
        return
    marched = march(scene, frequency_hz=frequency_hz, start=start_of(solution), max_periods=2000)
    near = abs(marched.half_peak_to_peak / solution.half_peak_to_peak - 1.0) < 0.02
    assert near is (solution.stable is Stable.YES)


def test_peaks_of_a_sweep_and_a_search_agree():
    """The spring that bends: its peaks by the march's own map."""
    branch = sweep(duffing(), "frequency", 0.2, 0.35, harmonics=7)
    told = branch.to_json()
    assert len(branch.peak_stability) == len(branch.peaks)
    assert told["stable"] == branch.peak_stability[0].stable.value
    assert "stable at the peak" in str(branch.summary())
    found = solve_all(duffing(), frequency_hz=0.2664, harmonics=7, starts=4)
    for one in found.solutions:
        assert one.solution.stable is (Stable.YES if one.sign > 0 else Stable.NO)
        assert one.to_json()["stable"] == one.solution.stable.value


def test_a_large_scene_says_what_its_multipliers_would_cost():
    planned = plan(bladed_disk())
    assert planned.to_json()["estimated_seconds_of_stability"] == forecast(bladed_disk()) > 0.0


def test_a_design_is_stable_or_not():
    found = optim.design(two_dof(), variables={"damper.N0": (20.0, 120.0)}, harmonics=3)
    assert found.stable is Stable.YES
    assert found.to_json()["stable"] == "yes"
    assert "stable" in dict(found.summary().pairs)


def test_what_is_judged_and_found_does_not_depend_on_the_clock(monkeypatch: pytest.MonkeyPatch):
    """The same words twice; of peaks the highest alone where there is work for one."""
    solution = solve(Scene.from_dict(BOX["scene"]), frequency_hz=BOX["hz"])
    assert verdict.of_solution(solution) == verdict.of_solution(solution)
    branch = sweep(duffing(), "frequency", 0.05, 0.35, harmonics=7)
    assert len(branch.peaks) > 1
    every = verdict.of_peaks(branch)
    monkeypatch.setattr(verdict, "CHEAP", 1.5 * forecast(branch.balance.scene, branch.peaks[0].at))
    first = verdict.of_peaks(branch)
    assert first[0] == every[0]
    assert {each.stable for each in first[1:]} == {Stable.NOT_KNOWN}
