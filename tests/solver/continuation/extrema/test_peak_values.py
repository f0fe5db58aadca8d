"""Peaks: the same on every way along a branch, and those published for another chain."""

import numpy as np
import pytest

import solver
from solver.continuation.walk import ContinuationSettings, Predictor

RESPONSES = [
    *(("two-dof", {"damper.N1": N1}, 0.2, 2.6) for N1 in (0.0, 30.0, 200.0)),
    *(
        ("bladed-disk", {"shroud.N0": N0}, 500.0, 900.0)
        for N0 in (40.0, 80.0, 100.0, 200.0, 500.0, 1000.0, 3000.0)
    ),
    *(("bladed-disk", {"shroud.N1": N1}, 500.0, 900.0) for N1 in (0.0, 100.0, 200.0, 300.0, 400.0, 500.0)),
]


@pytest.mark.few(6)
@pytest.mark.parametrize(("name", "values", "low", "high"), RESPONSES)
def test_the_peak_does_not_depend_on_the_way_along_the_branch(
    name: str, values: dict[str, float], low: float, high: float
) -> None:
    scene = solver.load_scene(name).with_values(values)
    coarse = solver.sweep(scene, start=low, stop=high)
    fine = solver.sweep(
        scene, start=high, stop=low,
        settings=ContinuationSettings(predictor=Predictor.TANGENT, largest_step=0.02, range_length=20.0),
    )  # fmt: skip
    assert coarse.peak is not None
    assert fine.peak is not None
    assert fine.reached
    assert coarse.peak.value == pytest.approx(fine.peak.value, rel=1e-8)


# m = 1, both masses to ground by k1, coupled by k2, 100 N on the first, friction on the second: peak max|x2|
# and its frequency, found with other codes by time marching.
CHAIN = [
    (100.0, 0.0, 10.2358, 1.01436),
    (100.0, 80.0, 10.6409, None),
    (100.0, 150.0, 10.3278, 1.0190),
    (300.0, 200.0, 7.4389, None),
]


@pytest.mark.parametrize(("N0", "N1", "peak", "at"), CHAIN)
def test_peaks_published_for_another_chain(N0: float, N1: float, peak: float, at: float | None) -> None:
    scene = solver.Scene.from_dict(
        {
            "name": "case-a",
            "structure": {
                "kind": "lumped",
                "masses": {"m1": 1.0, "m2": 1.0},
                "springs": [
                    {"between": ["ground", "m1"], "k": 4.0 * np.pi**2, "c": 0.5},
                    {"between": ["m1", "m2"], "k": 2.0 * np.pi**2, "c": 0.5},
                    {"between": ["m2", "ground"], "k": 4.0 * np.pi**2, "c": 0.5},
                ],
            },
            "contacts": [
                {"name": "damper", "between": ["m2", "ground"], "kt": 30.0, "mu": 0.3, "N0": N0, "N1": N1}
            ],
            "excitation": {"dof": "m1", "amplitude": 100.0},
            "observe": {"dof": "m2", "band": [0.2, 2.5]},
        }
    )
    branch = solver.sweep(scene, harmonics=31)
    assert branch.peak is not None
    assert branch.peak.value == pytest.approx(peak, abs=6e-5 * peak)
    if at is not None:
        assert branch.peak.at == pytest.approx(at, rel=1e-3)
