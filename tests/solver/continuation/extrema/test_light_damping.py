"""Lightly damped scenes: sweeps, maps, tracks and Campbell diagrams judged by brute force over points."""

import math
import sys
from collections import Counter
from pathlib import Path

import light_truth
import numpy as np
import pytest
from light_judge import COUNTS, HEIGHT, HISTORY, PLACE, SHARES, STANDS_OUT, Outcome, judge
from light_points import PointSolver
from light_scenes import KINDS, light_scene
from light_truth import Truth, true_response
from scipy import linalg

from optim import campbell_diagram
from solver import Scene, least_peak, load_scene, response_map, solve
from solver.balance.balance import build
from solver.linear.assembly import linear_model
from solver.linear.condensation import force_amplitudes
from solver.response.time_history import matrices

DEFECTS = Path(__file__).parents[3] / "data" / "defects"
NARROW = ["twolumped", "C_missed_peak_142", "D_second_peak", "D_band_0"]
SUITE, STUDY = 100, 1000
HARD = (395, 617, 736, 801)  # stiff contacts; small maxima beside a change of what a contact does
SOME = 5  # every so many scenes are swept downwards


def defect(name: str) -> Scene:
    return load_scene(DEFECTS / f"{name}.toml")


@pytest.mark.parametrize("name", NARROW)
def test_a_scene_with_a_narrow_resonance(name):
    verdict = judge(defect(name), 11)
    assert verdict.judged
    assert (verdict.statuses, verdict.faults) == ([], [])


# Every third has scenes of each of the kinds.
@pytest.mark.few(14, keep=HARD)
@pytest.mark.parametrize("seed", [*range(SUITE), *HARD])
def test_random_scene(seed):
    scene, _, harmonics = light_scene(seed)
    verdict = judge(scene, harmonics, downwards=seed % SOME == 0, shares=(SHARES[seed % 3],))
    assert verdict.outcome is not Outcome.WRONG, verdict.faults


@pytest.mark.long
def test_many_random_scenes(capsys):
    counts: Counter[tuple[str, str]] = Counter()
    wrong = {}
    for seed in range(STUDY):
        scene, kind, harmonics = light_scene(seed)
        verdict = judge(scene, harmonics, downwards=seed % SOME == 0)
        counts[kind, verdict.outcome.value] += 1
        if verdict.outcome is Outcome.WRONG:
            wrong[seed] = verdict.faults
    lines = [
        " ".join([f"{kind:14s}", *(f"{outcome.value} {counts[kind, outcome.value]}" for outcome in Outcome)])
        for kind in KINDS
    ]
    lines += [f"{seed}: {fault}" for seed, faults in wrong.items() for fault in faults]
    with capsys.disabled():
        sys.stdout.write("\n".join(["", *lines, ""]))
    assert not wrong


@pytest.mark.few(3)
@pytest.mark.parametrize("seed", [0, 4, 8, 12, 17])
def test_many_more_points_show_no_other_peaks(monkeypatch, seed):
    scene, _, harmonics = light_scene(seed)
    truth = true_response(scene, harmonics)
    monkeypatch.setattr(light_truth, "BASE", 1500)
    monkeypatch.setattr(light_truth, "PER_DECADE", 14.0)
    dense = true_response(scene, harmonics)
    assert truth.highest == pytest.approx(dense.highest, rel=1e-7)
    assert heights(truth) == pytest.approx(heights(dense), rel=1e-6)


def heights(truth: Truth) -> list[float]:
    return [one.value for one in truth.peaks if one.prominence > STANDS_OUT]


@pytest.mark.parametrize("seed", [3, 6, 10, 24, 27])
def test_points_are_solutions(seed):
    scene, _, harmonics = light_scene(seed)
    solver = PointSolver(scene, harmonics)
    low, high = scene.observe.band
    hz = np.geomspace(low, high, 7)
    solved = [solve(scene, frequency_hz=float(f), harmonics=harmonics).max_abs for f in hz]
    assert solver.amplitudes(hz) == pytest.approx(solved, rel=1e-7)


def test_a_mistuned_disk_by_its_poles():
    """Blades without contacts, in closed form by the eigenvectors of the equations of first order."""
    for seed in (8, 18, 28, 38):
        scene, _, harmonics = light_scene(seed)
        truth = true_response(scene, harmonics)
        exact = by_poles(scene, truth.hz[::3])
        assert truth.amplitude[::3] == pytest.approx(exact, rel=1e-7, abs=1e-10 * exact.max())


def by_poles(scene: Scene, hz: np.ndarray) -> np.ndarray:
    model = linear_model(build(scene, harmonics=1).scene)
    K, C, _ = matrices(model, 1)
    n = K.shape[0]
    mass = np.linalg.inv(model.M)
    first = np.block([[np.zeros((n, n)), np.eye(n)], [-mass @ K, -mass @ C]])
    poles, modes = linalg.eig(first)
    force = force_amplitudes(model, np.array([1]))[0]
    shares = np.linalg.solve(modes, np.concatenate([np.zeros(n), mass @ force]))
    residues = (model.observe @ modes[:n]) * shares
    return np.abs((residues / (2j * math.pi * hz[:, None] - poles)).sum(axis=1))


OVER_A_LOAD = [("twolumped", 1e-3), ("C_missed_peak_142", 0.1), ("D_second_peak", 1e-2)]


@pytest.mark.parametrize(("name", "share"), OVER_A_LOAD)
def test_least_peak_over_a_load(name, share):
    scene = defect(name)
    path = f"{scene.contacts[0].name}.N0"
    load = scene.value(path)
    check_least_peak(scene, path, share * load, 3.0 * load, 3)


@pytest.mark.few(3)
@pytest.mark.parametrize("seed", [2, 3, 7, 13, 21, 22])
def test_least_peak_of_a_random_scene(seed):
    scene, _, harmonics = light_scene(seed)
    path = f"{scene.contacts[0].name}.N0"
    load = scene.value(path)
    check_least_peak(scene, path, 0.03 * load, 30.0 * load, min(harmonics, 3))


def check_least_peak(scene: Scene, path: str, low: float, high: float, harmonics: int) -> None:
    """What is proven is the highest peak at its place, and nowhere in the range is it lower."""
    found = least_peak(scene, path, low, high, harmonics=harmonics)
    if not found.status.proven:
        return
    at = true_response(scene.with_values({path: found.at}), harmonics)
    assert found.peak == pytest.approx(at.highest, rel=HEIGHT)
    for load in np.geomspace(low, high, 5):
        highest = true_response(scene.with_values({path: float(load)}), harmonics).highest
        assert highest > found.peak * (1.0 - HEIGHT)


def test_a_map_of_narrow_resonances():
    """The grid is of points, so it is right wherever it is; the ridge is the highest peak between them."""
    scene = defect("C_missed_peak_142")
    found = response_map(scene, "d.N0", 1.0, 8.0, steps=3, frequencies=50, harmonics=3)
    for i, load in enumerate(found.parameter):
        here = scene.with_values({"d.N0": float(load)})
        assert found.amplitude[i] == pytest.approx(PointSolver(here, 3).amplitudes(found.frequency), rel=1e-7)
    assert found.ridge is not None
    if found.ridge.reached:
        for load, peak in zip(found.ridge.parameter[[0, -1]], found.ridge.peak[[0, -1]], strict=True):
            here = scene.with_values({"d.N0": float(load)})
            assert peak == pytest.approx(true_response(here, 3).highest, rel=HEIGHT)


@pytest.mark.parametrize("seed", [None, 2, 8, 18])
def test_crossings_of_a_campbell_diagram(seed):
    """Every peak is a crossing of the order it belongs to."""
    scene = defect("D_second_peak") if seed is None else light_scene(seed).scene
    harmonics = 3
    truth = true_response(scene, harmonics)
    low, high = scene.observe.band
    diagram = campbell_diagram(
        scene, speeds_rpm=(30.0 * low, 60.0 * low), band_hz=(low, high), harmonics=harmonics
    )
    crossings = diagram.orders[0].crossings
    for peak in truth.peaks:
        if peak.value > COUNTS * truth.highest and peak.prominence > STANDS_OUT and peak.history < HISTORY:
            near = [one.amplitude for one in crossings if abs(one.frequency_hz / peak.at - 1.0) < PLACE]
            assert any(value == pytest.approx(peak.value, rel=HEIGHT) for value in near)
