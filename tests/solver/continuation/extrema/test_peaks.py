"""Peaks and bands of a branch: against brute force, against values of other codes and of time marching."""

import math
from itertools import pairwise

import numpy as np
import pytest
from lumped_structure import lumped
from scene_cases import bladed_disk, oscillator, two_dof
from scipy.optimize import minimize_scalar

from solver import Scene, solve, sweep
from solver.balance.balance import Kind, build
from solver.balance.kernels.output import MAX_ABS, SLOPE
from solver.balance.workspace import Workspace
from solver.continuation.branch import Branch, Peak
from solver.continuation.extrema.extrema import HALF_POWER, band_limit
from solver.continuation.extrema.kernels.node_table import WORTH_POLISHING

HARMONICS = 7
SCENES = {
    "two-dof": two_dof(),
    "two-dof N1=0": two_dof(N1=0.0),
    "two-dof N1=200": two_dof(N1=200.0),
    "disk": bladed_disk(),
    "disk N0=100": bladed_disk(N0=100.0),
    "disk N0=40": bladed_disk(N0=40.0),
    "disk N1=400": bladed_disk(N1=400.0),
}
every_scene = pytest.mark.parametrize("name", SCENES)


class Amplitude:
    """max|x| at a frequency, each solved for itself from the one before."""

    def __init__(self, scene: Scene, harmonics: int = HARMONICS) -> None:
        self.workspace = Workspace.of(build(scene, harmonics=harmonics))
        self.u: np.ndarray | None = None

    def __call__(self, frequency_hz: float) -> float:
        found = self.workspace.solve(2.0 * math.pi * frequency_hz, self.u)
        assert found.converged
        self.u = found.u
        measures = self.workspace.measure(found.u, 2.0 * math.pi * frequency_hz)
        assert measures is not None
        return float(measures.values[MAX_ABS])


def brute_peaks(scene: Scene, count: int = 2000) -> list[tuple[float, float]]:
    """Return (value, frequency) of the local maxima on a fine grid, each refined by a line search."""
    amplitude, grid = Amplitude(scene), np.linspace(*scene.observe.band, count)
    values = np.array([amplitude(frequency) for frequency in grid])
    inner = np.flatnonzero((values[1:-1] >= values[:-2]) & (values[1:-1] > values[2:])) + 1
    found = []
    for i in inner:
        best = minimize_scalar(
            lambda x: -amplitude(x),
            bounds=(grid[i - 1], grid[i + 1]),
            method="bounded",
            options={"xatol": 1e-10},
        )
        found.append((-float(best.fun), float(best.x)))
    return sorted(found, reverse=True)


@every_scene
def test_peaks_against_brute_force(name: str):
    scene = SCENES[name]
    branch = sweep(scene, harmonics=HARMONICS)
    expected, low, high = brute_peaks(scene), *scene.observe.band
    interior = [peak for peak in branch.peaks if peak.interior]
    assert len(interior) == len(expected)
    top = branch.peaks[0].value
    for value, frequency in expected:
        peak = min(interior, key=lambda peak, f=frequency: abs(peak.at - f))
        # Far below the top a peak is left at the resolution of the branch.
        polished = value >= WORTH_POLISHING * top
        assert peak.value == pytest.approx(value, rel=1e-8 if polished else 0.01)
        assert peak.at == pytest.approx(frequency, abs=(1e-5 if polished else 0.01) * (high - low))


@every_scene
def test_peaks_are_sorted_solutions(name: str):
    branch = sweep(SCENES[name], harmonics=HARMONICS)
    assert branch.peak is branch.peaks[0]
    values = [peak.value for peak in branch.peaks]
    assert values == sorted(values, reverse=True)
    assert values[0] >= branch.amplitude.max()
    workspace = Workspace.of(branch.balance)
    for peak in branch.peaks:
        norm, _ = workspace.evaluate(peak.solution, 2.0 * math.pi * peak.at)
        assert norm <= 1e-9
        measures = workspace.measure(peak.solution, 2.0 * math.pi * peak.at)
        assert measures is not None
        assert measures.values[MAX_ABS] == pytest.approx(peak.value, rel=1e-10)


def test_no_higher_point_in_random_scenes():
    rng = np.random.default_rng(1)
    for i in range(14):
        values = {
            "N0": 10.0 ** rng.uniform(1.0, 3.0),
            "N1_ratio": float(rng.choice([0.0, 0.5, 0.9, 1.2, 2.0])),
            "N1_phase": rng.uniform(-3.0, 3.0),
        }
        scene = bladed_disk(**values) if i % 2 else two_dof(**values)
        branch = sweep(scene, harmonics=5)
        assert branch.peak is not None
        amplitude = Amplitude(scene, 5)
        best = max(amplitude(frequency) for frequency in np.linspace(*scene.observe.band, 400))
        assert 0.97 * branch.peak.value < best <= branch.peak.value * (1.0 + 1e-9)


CUSPS: list[tuple[dict[str, float], float, int]] = [
    ({"kt": 20.8052048774, "N0": 14.4829237142, "N1_ratio": 0.9, "N1_phase": -0.1923}, 0.01045436, 3),
    ({"kt": 18.6881762849, "N0": 54.7941779064, "N1_ratio": 1.2, "N1_phase": -2.3954}, 0.02200713, 11),
]


@pytest.mark.parametrize(("contact", "c", "harmonics"), CUSPS)
def test_peaks_at_kinks(contact: dict[str, float], c: float, harmonics: int):
    """A peak need not be stationary: a cusp at the edge of full stick is found as sharply."""
    scene = oscillator({"mu": 0.3, **contact}, k=1.0, c=c)
    stop = 0.5 * math.sqrt(1.0 + contact["kt"])
    branch = sweep(scene, start=0.03, stop=stop, harmonics=harmonics)
    assert branch.peak is not None
    amplitude = Amplitude(scene, harmonics)
    for step in (1e-9, 1e-7, 1e-5, 1e-3):
        for side in (-1.0, 1.0):
            assert amplitude(branch.peak.at * (1.0 + side * step)) <= branch.peak.value * (1.0 + 1e-9)


def between_walls(**values: float) -> Scene:
    """Two masses between two walls, the damper on the second: a case other codes have run.

    m = 1, K = [[k1 + k2, −k2], [−k2, k1 + k2]], k1 = 4π², k2 = 2π², C = [[1, −0.5], [−0.5, 1]], kt = 30.
    """
    k1, k2 = 4.0 * math.pi**2, 2.0 * math.pi**2
    return Scene.from_dict(
        {
            "name": "between-walls",
            "structure": lumped(
                {"m1": 1.0, "m2": 1.0},
                ("m1", "ground", k1, 0.5),
                ("m1", "m2", k2, 0.5),
                ("m2", "ground", k1, 0.5),
            ),
            "contacts": [{"name": "damper", "between": ["m2", "ground"], "kt": 30.0, "mu": 0.3, "N0": 100.0}],
            "excitation": {"dof": "m1", "amplitude": 100.0},
            "observe": {"dof": "m2", "band": [0.2, 2.5]},
        }
    ).with_values({f"damper.{key}": value for key, value in values.items()})


@pytest.mark.parametrize(
    ("values", "peak", "at"),
    [
        ({}, 10.2358, 1.01436),
        ({"N1": 80.0}, 10.6409, None),
        ({"N1": 150.0}, 10.3278, 1.0190),
        ({"N0": 300.0, "N1": 200.0}, 7.4389, None),
        ({"N0": 345.5}, 6.7597, 1.0869),
    ],
    ids=["constant", "N1=80", "separating", "N0=300", "best constant load"],
)
def test_marched_peaks(values: dict[str, float], peak: float, at: float | None):
    """Peaks found by marching in time, to the digits printed; a common code gives 8.491 for the third."""
    branch = sweep(between_walls(**values), harmonics=31)
    assert branch.peak is not None
    assert branch.peak.value == pytest.approx(peak, abs=1.5e-4)
    if at is not None:
        assert branch.peak.at == pytest.approx(at, abs=1e-4)


def test_best_constant_load():
    """The least peak over a constant load: 345 to 346 N by sweeps of other codes; it is flat there."""

    def peak(load: float) -> float:
        branch = sweep(between_walls(N0=load))
        assert branch.peak is not None
        return branch.peak.value

    best = minimize_scalar(peak, bounds=(300.0, 400.0), method="bounded", options={"xatol": 1e-3})
    assert best.x == pytest.approx(345.5, abs=0.7)
    assert best.fun == pytest.approx(6.7597, abs=2e-4)


def chain(n: int) -> Scene:
    """Equal masses on the ground, neighbours coupled, a slider and a force on each."""
    k1, k2 = 4.0 * math.pi**2, 2.0 * math.pi**2
    names = [f"m{i}" for i in range(n)]
    return Scene.from_dict(
        {
            "name": f"chain-{n}",
            "structure": {
                "kind": "lumped",
                "masses": dict.fromkeys(names, 1.0),
                "springs": [
                    *({"between": [name, "ground"], "k": k1, "c": 0.5} for name in names),
                    *({"between": list(pair), "k": k2, "c": 0.5} for pair in pairwise(names)),
                ],
            },
            "contacts": [
                {"name": f"slider-{name}", "between": [name, "ground"], "kt": 30.0, "mu": 0.3, "N0": 100.0}
                for name in names
            ],
            "excitation": [{"dof": name, "amplitude": 100.0} for name in names],
            "observe": {"dof": names[-1], "band": [0.2, 2.5]},
        }
    )


@pytest.mark.parametrize("n", [1, 2, 5])
def test_chains(n: int):
    """Three codes give 20.178 at 1.0045 Hz for 32 masses, which all move alike, as fewer do."""
    branch = sweep(chain(n), start=0.9, stop=1.1)
    assert branch.reached
    assert branch.peak is not None
    assert branch.peak.value == pytest.approx(20.178, abs=2e-3)
    assert branch.peak.at == pytest.approx(1.0045, abs=2e-4)


def test_a_published_oscillator():
    """A Jenkins element beside a spring (tmdsimpy's test): three harmonics, then converged ones."""
    scene = oscillator({"kt": 0.25, "mu": 0.2, "N0": 1.0}, k=0.75, c=0.01)
    frequency_hz = 0.3115958 / (2.0 * math.pi)
    solution = solve(scene, frequency_hz=frequency_hz, harmonics=3)
    published = [0.0, 1.28497628, 0.28420474, 0.0, 0.0, 0.50029792, 0.22540700]
    np.testing.assert_allclose(solution.observed, published, atol=2e-7)
    # With every harmonic there is, the first three move by a percent: the estimate knows.
    fine = solve(scene, frequency_hz=frequency_hz, harmonics=61)
    assert abs(solution.max_abs - fine.max_abs) < solution.error_estimate


def edge_amplitudes(branch: Branch) -> list[float]:
    """Amplitude over limit at the edges of the band that are inside the range."""
    assert branch.band is not None
    amplitude = Amplitude(branch.balance.scene)
    edges = [edge for interval in branch.band.intervals for edge in interval]
    inside = [edge for edge in edges if branch.values.min() + 1e-9 < edge < branch.values.max() - 1e-9]
    return [amplitude(edge) / branch.band.limit for edge in inside]


@every_scene
@pytest.mark.parametrize("share", [None, 0.3, 0.9])
def test_band_edges_are_at_the_limit(name: str, share: float | None):
    scene = SCENES[name]
    first = sweep(scene, harmonics=HARMONICS)
    assert first.peak is not None
    limit = None if share is None else share * first.peak.value
    branch = sweep(scene, harmonics=HARMONICS, limit=limit)
    assert branch.band is not None
    assert branch.band.limit == pytest.approx(first.peak.value * (share or HALF_POWER), rel=1e-12)
    ratios = edge_amplitudes(branch)
    assert len(ratios) >= 1
    assert ratios == pytest.approx([1.0] * len(ratios), abs=1e-8)
    assert branch.band.width == pytest.approx(sum(high - low for low, high in branch.band.intervals))
    lows, highs = zip(*branch.band.intervals, strict=True)
    assert all(low < high for low, high in branch.band.intervals)
    assert all(high < low for high, low in zip(highs, lows[1:], strict=False))


def test_band_against_a_grid():
    scene = SCENES["two-dof N1=200"]
    branch = sweep(scene, harmonics=HARMONICS)
    assert branch.band is not None
    assert len(branch.band.intervals) == 3
    amplitude = Amplitude(scene)
    grid = np.linspace(0.2, 2.6, 2401)
    above = np.mean([amplitude(frequency) > branch.band.limit for frequency in grid])
    assert branch.band.width == pytest.approx(2.4 * above, abs=5e-3)


def test_band_of_both_directions():
    up = sweep(two_dof(N1=200.0), harmonics=HARMONICS)
    down = sweep(two_dof(N1=200.0), start=2.6, stop=0.2, harmonics=HARMONICS)
    assert up.band is not None
    assert down.band is not None
    assert down.band.width == pytest.approx(up.band.width, rel=1e-9)
    np.testing.assert_allclose(down.band.intervals, up.band.intervals, rtol=1e-9)


def test_limits_above_and_below_everything():
    above = sweep(two_dof(), limit=10.0)
    assert above.band is not None
    assert above.band.width == 0.0
    assert above.band.intervals == ()
    below = sweep(two_dof(), limit=1e-3)
    assert below.band is not None
    np.testing.assert_allclose(below.band.intervals, [(0.2, 2.6)])
    assert below.band.width == pytest.approx(2.4)


def test_only_a_frequency_has_a_band():
    branch = sweep(two_dof(), "damper.N0", 50.0, 200.0, frequency_hz=1.05, limit=1.0)
    assert branch.band is None
    assert branch.peak is not None
    assert branch.to_json()["band_hz"] is None
    assert band_limit(1.0, (), Kind.FREQUENCY) is None


@pytest.mark.parametrize(
    ("start", "stop", "at"),
    [(1.2, 1.6, 1.2), (0.6, 0.9, 0.9), (0.9, 0.6, 0.9)],
    ids=["falls", "rises", "back"],
)
def test_the_end_of_a_range_can_be_highest(start: float, stop: float, at: float):
    branch = sweep(two_dof(), start=start, stop=stop)
    peak: Peak | None = branch.peak
    assert peak is not None
    assert not peak.interior
    assert peak.at == pytest.approx(at, rel=1e-12)
    assert peak.value == branch.amplitude.max()
    assert branch.to_json()["peaks"] == []


def test_peak_over_a_load():
    """Along another parameter too the maximum is stationary."""
    branch = sweep(two_dof(), "damper.N1_phase", -3.0, 3.0, frequency_hz=1.2)
    assert branch.peak is not None
    assert branch.peak.interior
    workspace = Workspace.of(branch.balance)
    measures = workspace.measure(branch.peak.solution, branch.peak.at)
    assert measures is not None
    assert abs(measures.values[SLOPE]) < 1e-6 * branch.peak.value
