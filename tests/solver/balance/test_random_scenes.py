"""Random scenes that Hypothesis looks for: everything is solved, and what is solved is right."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeVar

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from referee import law_error, lost_power, motion_error

from benchmarks.random_scenes import Seeded, random_scene
from solver import BranchStatus, Scene, Solution, march, solve, sweep

LAW, BALANCED = 1e-3, 1e-7
NO_TURN = 1e-6  # of the band
ESTIMATES = 6.0  # half peak-to-peak from time marching lies within so many error estimates
PERIODS = {"tolerance": 1e-7, "max_periods": 150}

_T = TypeVar("_T")
_ALWAYS_THE_SAME = {
    "derandomize": True,
    "database": None,
    "deadline": None,
    "suppress_health_check": [HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large],
}


class Drawn:
    """Choices that Hypothesis makes, and makes simpler when something fails."""

    def __init__(self, draw: st.DrawFn) -> None:
        self._draw = draw

    def uniform(self, low: float, high: float) -> float:
        return self._draw(st.floats(low, high))

    def integer(self, low: int, high: int) -> int:
        return self._draw(st.integers(low, high))

    def choice(self, options: Sequence[_T]) -> _T:
        return self._draw(st.sampled_from(options))


@st.composite
def problems(draw: st.DrawFn) -> tuple[Scene, int, float]:
    """A scene, a highest harmonic, and a frequency of its band."""
    source = Drawn(draw)
    scene, harmonics = random_scene(source)
    low, high = scene.observe.band
    return scene, harmonics, math.exp(source.uniform(math.log(low), math.log(high)))


def solved(scene: Scene, harmonics: int, frequency_hz: float) -> Solution:
    """A solution that the sampled law, the whole structure and the powers confirm."""
    solution = solve(scene, frequency_hz=frequency_hz, harmonics=harmonics)
    assert solution.converged
    assert solution.residual <= 1e-9
    assert law_error(solution) <= LAW
    assert motion_error(solution) <= BALANCED
    assert lost_power(solution) <= BALANCED
    return solution


def swept(scene: Scene, harmonics: int) -> None:
    """A whole response, every point converged, and no way back but over a kink."""
    branch = sweep(scene, harmonics=harmonics)
    assert branch.status is BranchStatus.COMPLETED
    assert branch.residuals.max() <= 1e-9
    low, high = scene.observe.band
    assert np.diff(branch.values).min() >= -NO_TURN * (high - low)


def marched(scene: Scene, harmonics: int, frequency_hz: float) -> None:
    """Time marching gives the same motion, as far as the harmonics kept can."""
    solution = solve(scene, frequency_hz=frequency_hz, harmonics=harmonics)
    assert solution.converged
    referee = march(scene, frequency_hz=frequency_hz, **PERIODS)
    assume(referee.converged)
    size = max(solution.half_peak_to_peak, referee.half_peak_to_peak)
    allowed = ESTIMATES * solution.error_estimate + 1e-5 * size
    assert abs(solution.half_peak_to_peak - referee.half_peak_to_peak) <= allowed


@given(problem=problems())
@settings(max_examples=150, **_ALWAYS_THE_SAME)
def test_random_solves(problem: tuple[Scene, int, float]):
    solved(*problem)


@given(problem=problems())
@settings(max_examples=25, **_ALWAYS_THE_SAME)
def test_random_responses(problem: tuple[Scene, int, float]):
    swept(*problem[:2])


@given(problem=problems())
@settings(max_examples=30, **_ALWAYS_THE_SAME)
def test_random_motions_against_time_marching(problem: tuple[Scene, int, float]):
    marched(*problem)


@pytest.mark.long
def test_many_random_scenes():
    """Two thousand scenes of a seeded generator; all that fail are named."""
    failed: list[str] = []
    for seed in range(2000):
        source = Seeded(seed)
        scene, harmonics = random_scene(source)
        low, high = scene.observe.band
        try:
            solved(scene, harmonics, math.exp(source.uniform(math.log(low), math.log(high))))
            swept(scene, harmonics)
        except AssertionError as error:
            failed.append(f"{seed}: {error}")
    assert failed == []


@pytest.mark.long
@given(problem=problems())
@settings(max_examples=1500, **_ALWAYS_THE_SAME)
def test_many_random_motions_against_time_marching(problem: tuple[Scene, int, float]):
    marched(*problem)
