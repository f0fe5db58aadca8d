"""Error estimates against true errors, of random scenes in every regime and of peaks."""

import math

import numpy as np
import pytest
from random_scenes import random_scene
from scene_cases import bladed_disk, loose_mass, mixed_disk, oscillator, two_dof

from solver import Scene, branch_errors, march, solve, sweep
from solver.balance.balance import build, more_harmonics, pad
from solver.balance.kernels.locate import slope_by_parameter
from solver.balance.kernels.output import HALF_RANGE, MAX_ABS, MEASURES
from solver.balance.workspace import Workspace
from solver.continuation.extrema.error_estimate import ErrorEstimator, truncation_error

TRUTH = 121  # harmonics
ROUNDING = 1e-9  # of the amplitude: what Newton's tolerance allows


def converged(workspace: Workspace, u: np.ndarray, p: float, top: int = TRUTH) -> np.ndarray | None:
    """Measures of the same response with `top` harmonics, reached by and by: it stays on its branch.

    None where that ends: a response of few harmonics need not have one of many.
    """
    highest = workspace.balance.n_harmonics
    while highest < top:
        highest = min(top, 8 * highest // 5 + 2)
        wider = Workspace.of(more_harmonics(workspace.balance, highest))
        found = wider.solve(p, pad(u, workspace.balance, wider.balance))
        if not found.converged:
            return None
        workspace, u = wider, found.u
    measures = workspace.measure(u, p)
    assert measures is not None
    return measures.values


def shares(seeds: range, harmonics: int | None = None) -> tuple[float, float, np.ndarray]:
    """How many estimates are above the true error, how many of these within ten times, and the ratios."""
    above, ratios, lost = [], [], 0
    for seed in seeds:
        scene, frequency_hz, drawn = random_scene(seed)
        p = 2.0 * math.pi * frequency_hz
        workspace = Workspace.of(build(scene, harmonics=drawn if harmonics is None else harmonics))
        found = workspace.solve(p)
        assert found.converged, seed
        estimate = truncation_error(workspace, found.u, p)
        measures, truth = workspace.measure(found.u, p), converged(workspace, found.u, p)
        assert measures is not None
        if truth is None:
            lost += 1
            continue
        for column, guess in ((MAX_ABS, estimate.max_abs), (HALF_RANGE, estimate.half_peak_to_peak)):
            error = abs(measures.values[column] - truth[column])
            above.append(error <= guess + ROUNDING * truth[column])
            if max(error, guess) > 10.0 * ROUNDING * truth[column]:
                ratios.append(guess / error if error > 0.0 else math.inf)
    assert lost <= 0.01 * len(seeds)
    known = np.array(ratios)
    return float(np.mean(above)), float(np.mean((known >= 1.0) & (known <= 10.0))), known


def test_sixty_random_scenes():
    """The estimate is above the true error in 95 of 100 cases, and within ten times in most."""
    above, close, ratios = shares(range(1000, 1060))
    assert above >= 0.95
    assert close >= 0.65
    assert ratios.min() > 0.2


@pytest.mark.long
@pytest.mark.parametrize("harmonics", [None, 0, 1, 2, 3, 5, 11])
def test_two_hundred_random_scenes(harmonics: int | None):
    above, close, _ = shares(range(200), harmonics)
    assert above >= 0.95
    assert close >= 0.6


@pytest.mark.parametrize("harmonics", [1, 3, 7])
def test_a_resonance_beyond_the_harmonics_is_seen(harmonics: int):
    """Harmonics of an opening shroud meet modes of the disk: the amplitude may be off forty times."""
    scene = bladed_disk(N1=400.0)
    for frequency_hz in (95.0, 110.0, 600.0):
        coarse = solve(scene, frequency_hz=frequency_hz, harmonics=harmonics)
        fine = solve(scene, frequency_hz=frequency_hz, harmonics=61)
        error = abs(coarse.max_abs - fine.max_abs)
        # An estimate above the amplitude is a warning, no longer a number.
        allowed = 1.5 if coarse.error_estimate > coarse.max_abs else 1.0
        assert error <= allowed * coarse.error_estimate, frequency_hz


def test_against_time_marching():
    """The truth by another method altogether."""
    for scene, frequency_hz in ((two_dof(N1=150.0), 1.1), (two_dof(), 0.4)):
        truth = march(scene, frequency_hz=frequency_hz)
        for harmonics in (3, 5, 9):
            solution = solve(scene, frequency_hz=frequency_hz, harmonics=harmonics)
            error = abs(solution.max_abs - truth.max_abs)
            assert error <= solution.error_estimate + 2.0 * truth.error_estimate


def test_a_residual_counts():
    """A solution that is off by a known step has about that error, however many harmonics there are."""
    scene, p = two_dof(), 2.0 * math.pi * 1.2
    workspace = Workspace.of(build(scene, harmonics=41))
    found = workspace.solve(p)
    estimator = ErrorEstimator(workspace)
    exact = estimator.at(found.u, p).max_abs
    measures = workspace.measure(found.u, p)
    assert measures is not None
    for off in (1e-3, 1e-2):
        shifted = found.u * (1.0 + off)
        norm, _ = workspace.evaluate(shifted, p)
        assert norm > 1e-5
        assert workspace.measure(shifted, p) is None, "it does not obey mechanics"
        workspace.evaluate(shifted, p)
        observed, moved = np.zeros(workspace.balance.n_coefficients), np.zeros(MEASURES)
        slope_by_parameter(workspace.system, workspace.linear, shifted, workspace.point, observed, moved)
        error = abs(moved[MAX_ABS] - measures.values[MAX_ABS])
        assert error > 3.0 * exact
        assert error <= estimator.at(shifted, p).max_abs <= 10.0 * error


def test_an_undetermined_mean_leaves_the_estimate_of_the_range():
    solution = solve(loose_mass(floor=30.0, N1=0.0), frequency_hz=1.7)
    assert "mean_undetermined" in solution.flags
    fine = solve(loose_mass(floor=30.0, N1=0.0), frequency_hz=1.7, harmonics=61)
    error = abs(solution.half_peak_to_peak - fine.half_peak_to_peak)
    assert error <= solution.error_estimate < 0.1 * solution.half_peak_to_peak


PEAKS = {
    "slipping": two_dof(),
    "separating": two_dof(N1=200.0),
    "disk": bladed_disk(),
    "disk, separating": bladed_disk(N1=400.0),
    "mixed disk": mixed_disk(),
}


@pytest.mark.parametrize("name", PEAKS)
@pytest.mark.parametrize("harmonics", [3, 7])
def test_the_peak_of_a_branch(name: str, harmonics: int):
    coarse, fine = sweep(PEAKS[name], harmonics=harmonics), sweep(PEAKS[name], harmonics=41)
    assert coarse.peak is not None
    assert fine.peak is not None
    error = abs(coarse.peak.value - fine.peak.value)
    assert error <= coarse.error_estimate + fine.error_estimate
    assert coarse.error_estimate <= 30.0 * error or harmonics == 3
    assert coarse.to_json()["error_estimate"] == coarse.error_estimate


def test_points_of_a_branch():
    """The estimate across the branch is at most about that at the same frequency, and no less than the error.

    At the same frequency a flank that moved sideways is far off; across the branch it is not.
    """
    coarse = sweep(two_dof(), harmonics=5)
    indices = range(0, len(coarse.values), 9)
    errors = branch_errors(coarse, indices)
    estimator = ErrorEstimator(Workspace.of(coarse.balance))
    rows = coarse.solutions[list(indices)]
    fixed = np.array([estimator.at(row[:-1], float(row[-1])).max_abs for row in rows])
    above = []
    for index, error in zip(indices, fixed, strict=True):
        fine = solve(two_dof(), frequency_hz=float(coarse.values[index]), harmonics=41)
        above.append(abs(fine.max_abs - coarse.amplitude[index]) <= error + 1e-9 * fine.max_abs)
    assert np.mean(above) >= 0.9
    assert np.all(errors <= 2.0 * fixed + 1e-9 * coarse.amplitude[list(indices)])
    assert np.median(errors - fixed) <= 1e-12 * coarse.amplitude.max()
    assert branch_errors(coarse).shape == coarse.values.shape


@pytest.mark.parametrize(
    ("scene", "parameter", "frequency_hz"),
    [
        (two_dof(), "damper.N0", 1.2),
        (two_dof(), "excitation.amplitude", 1.2),
        (bladed_disk(), "shroud.mu", 755.0),
    ],
)
def test_branches_in_other_parameters(scene: Scene, parameter: str, frequency_hz: float):
    value = scene.value(parameter)
    coarse, fine = (
        sweep(scene, parameter, 0.5 * value, 1.5 * value, frequency_hz=frequency_hz, harmonics=h)
        for h in (5, 31)
    )
    assert coarse.peak is not None
    assert fine.peak is not None
    assert abs(coarse.peak.value - fine.peak.value) <= coarse.error_estimate


def test_no_contact_no_error():
    solution = solve(oscillator(k=2.0, c=0.1), frequency_hz=0.2)
    assert solution.error_estimate <= 1e-13 * solution.max_abs
    branch = sweep(oscillator(k=2.0, c=0.1), "frequency", 0.1, 0.4)
    assert branch.error_estimate <= 1e-14 * branch.amplitude.max()


def test_a_force_beyond_the_harmonics_is_kept():
    """A force at the fifth harmonic, three asked for: what it does is not missing."""
    raw = two_dof().to_dict()
    raw["excitation"] = [raw["excitation"], {"dof": "m1", "amplitude": 30.0, "harmonic": 5}]
    scene = Scene.from_dict(raw)
    coarse, fine = (solve(scene, frequency_hz=0.5, harmonics=h) for h in (3, 61))
    error = abs(coarse.max_abs - fine.max_abs)
    assert error <= max(coarse.error_estimate, 1e-12 * fine.max_abs)
    assert coarse.harmonics[5] == pytest.approx(fine.harmonics[5], rel=1e-6)


def test_more_harmonics_is_the_balance_of_more_harmonics():
    """Padded or built anew: the same system, also where a cyclic structure needs further diameters."""
    for scene, few, many in (
        (two_dof(), 3, 17),
        (bladed_disk(), 2, 12),
        (bladed_disk(), 9, 30),
        (mixed_disk(), 1, 7),
    ):
        wider, built = more_harmonics(build(scene, harmonics=few), many), build(scene, harmonics=many)
        p = 2.0 * math.pi * scene.observe.band[1]
        for left, right in zip(
            Workspace.of(wider).receptance(p), Workspace.of(built).receptance(p), strict=True
        ):
            np.testing.assert_allclose(left, right, rtol=1e-9, atol=1e-12 * np.abs(right).max())
        np.testing.assert_array_equal(wider.system.cos_table, built.system.cos_table)
