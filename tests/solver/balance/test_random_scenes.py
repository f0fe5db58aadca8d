"""Random scenes of a seeded generator: everything is solved, and what is solved is right."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from referee import law_error, lost_power, motion_error

from benchmarks.random_scenes import Seeded, random_scene
from solver import BranchStatus, Scene, Solution, load_scene, march, solve, sweep

DATA = Path(__file__).parents[2] / "data"
LAW, BALANCED = 1e-3, 1e-7
NO_TURN = 1e-6  # of the band
ESTIMATES = 6.0  # half peak-to-peak from time marching lies within so many error estimates
PERIODS = {"tolerance": 1e-7, "max_periods": 150}
BEYOND = 10_000  # seeds from here on are those of single tests
ONE_LEAP = 0.2  # of the band


def drawn(seed: int) -> tuple[Scene, int, float]:
    """A scene, a highest harmonic, and a frequency of its band."""
    source = Seeded(seed)
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


def marched(scene: Scene, harmonics: int, frequency_hz: float) -> bool:
    """Time marching gives the same motion, as far as the harmonics kept can; whether it settled."""
    solution = solve(scene, frequency_hz=frequency_hz, harmonics=harmonics)
    assert solution.converged
    referee = march(scene, frequency_hz=frequency_hz, **PERIODS)
    if referee.converged:
        size = max(solution.half_peak_to_peak, referee.half_peak_to_peak)
        allowed = ESTIMATES * solution.error_estimate + 1e-5 * size
        assert abs(solution.half_peak_to_peak - referee.half_peak_to_peak) <= allowed
    return referee.converged


def failures(count: int, judge: Callable[[int], object]) -> list[str]:
    """The seeds for which `judge` finds something wrong, with what it is."""
    failed = []
    for seed in range(count):
        try:
            judge(seed)
        except AssertionError as error:
            failed.append(f"{seed}: {error}")
    return failed


@pytest.mark.few(3)
@pytest.mark.parametrize("seed", range(BEYOND, BEYOND + 150))
def test_random_solves(seed: int):
    solved(*drawn(seed))


@pytest.mark.few(5)
@pytest.mark.parametrize("seed", range(BEYOND, BEYOND + 25))
def test_random_responses(seed: int):
    swept(*drawn(seed)[:2])


@pytest.mark.parametrize("count", [16, pytest.param(40, marks=pytest.mark.long)])
def test_random_motions_against_time_marching(count: int):
    settled = [marched(*drawn(seed)) for seed in range(BEYOND, BEYOND + count)]
    assert sum(settled) >= 0.375 * count


def test_a_sharp_resonance_is_not_leapt_over():
    branch = sweep(load_scene(DATA / "leap_to_the_end.toml"), harmonics=3)
    assert branch.reached
    low, high = branch.start, branch.stop
    assert np.abs(np.diff(branch.values)).max() <= ONE_LEAP * (high - low)
    assert np.diff(branch.values).min() >= -NO_TURN * (high - low)
    assert branch.peak_certificate.known


@pytest.mark.long
def test_many_random_scenes():
    """Two thousand scenes of a seeded generator; all that fail are named."""

    def judge(seed: int) -> None:
        scene, harmonics, frequency_hz = drawn(seed)
        solved(scene, harmonics, frequency_hz)
        swept(scene, harmonics)

    assert failures(2000, judge) == []


@pytest.mark.long
def test_many_random_motions_against_time_marching():
    assert failures(1500, lambda seed: marched(*drawn(seed))) == []
