"""Mistuned disks without friction against a direct solve of all sectors, and Whitehead's bound."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from solver import Scene
from solver.studies.blades import blade_peaks, mistuned
from solver.studies.mistuning import without_mistuning

M, K, C, COUPLING = 1.0, 100.0, 0.02, 2.0


def linear_disk(sectors: int, order: int) -> Scene:
    return Scene.from_dict(
        {
            "name": "linear",
            "structure": {
                "kind": "cyclic",
                "sectors": sectors,
                "masses": {"blade": M},
                "springs": [
                    {"name": "root", "between": ["blade", "ground"], "k": K},
                    {"name": "ring", "between": ["blade", "blade@next"], "k": COUPLING},
                ],
                "dampers": [{"name": "loss", "between": ["blade", "ground"], "c": C}],
            },
            "contacts": [],
            "excitation": {"dof": "blade", "amplitude": 1.0, "engine_order": order},
            "observe": {"dof": "blade", "band": [1.3, 2.0]},
        }
    )


def response(factors: np.ndarray, order: int, hz: float) -> np.ndarray:
    """Amplitudes of all blades [m] by one solve of the matrices written out here."""
    n, omega = factors.size, 2.0 * math.pi * hz
    stiffness = np.diag(K * factors + 2.0 * COUPLING)
    for j in range(n):
        stiffness[j, (j + 1) % n] -= COUPLING
        stiffness[(j + 1) % n, j] -= COUPLING
    dynamic = stiffness - omega**2 * M * np.eye(n) + 1j * omega * C * np.eye(n)
    return np.abs(np.linalg.solve(dynamic, np.exp(2j * math.pi * order * np.arange(n) / n)))


def direct_peak(factors: np.ndarray, order: int, blade: int) -> float:
    """Highest amplitude of a blade in the band: a fine grid, then a bounded search."""
    grid = np.linspace(1.3, 2.0, 4001)
    values = [response(factors, order, float(hz))[blade] for hz in grid]
    tops = [i for i in range(1, grid.size - 1) if values[i - 1] <= values[i] >= values[i + 1]]
    tops = [i for i in tops if values[i] > 0.9 * max(values)]
    best = [
        minimize_scalar(
            lambda hz: -response(factors, order, hz)[blade], bounds=(grid[i - 1], grid[i + 1]),
            method="bounded", options={"xatol": 1e-13},
        ).fun
        for i in tops
    ]  # fmt: skip
    return -min(best)


def checked(sectors: int, order: int, seed: int, spread: float) -> dict[str, Any]:
    scene = linear_disk(sectors, order)
    tuned = blade_peaks(without_mistuning(scene), harmonics=1)
    disk = mistuned(scene, of="root", spread=spread, seed=seed)
    found = blade_peaks(disk, harmonics=1, every_branch=False)
    factors = 1.0 + spread * np.random.Generator(np.random.PCG64(seed)).standard_normal(sectors)
    worst = found.worst
    assert found.value[worst] == pytest.approx(direct_peak(factors, order, worst), rel=1e-8)
    other = (worst + sectors // 2) % sectors
    assert found.value[other] == pytest.approx(direct_peak(factors, order, other), rel=1e-8)
    return {"magnification": found.magnification(tuned)}


@pytest.mark.few(3)
@pytest.mark.parametrize(("sectors", "order", "spread"), [(6, 1, 0.02), (12, 3, 0.01), (24, 5, 0.03)])
def test_peaks_of_linear_disks_are_those_of_a_direct_solve_and_below_whiteheads_bound(
    sectors: int, order: int, spread: float
) -> None:
    """Whitehead (1966): no blade of a linear disk exceeds (1 + √N)/2 times the tuned amplitude."""
    for seed in (1, 2):
        magnification = checked(sectors, order, seed, spread)["magnification"]
        assert magnification < 0.5 * (1.0 + math.sqrt(sectors))


@pytest.mark.long
def test_many_linear_disks_are_those_of_a_direct_solve_and_below_whiteheads_bound() -> None:
    for sectors, order in ((5, 2), (8, 1), (16, 7), (24, 5), (36, 10)):
        for seed in range(10, 20):
            spread = (0.005, 0.01, 0.02, 0.04)[seed % 4]
            magnification = checked(sectors, order, seed, spread)["magnification"]
            assert magnification < 0.5 * (1.0 + math.sqrt(sectors))
