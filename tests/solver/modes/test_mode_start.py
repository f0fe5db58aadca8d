"""A mode begins as the one asked for, also where dashpots at rest hold what the undamped mode moves."""

import math

import numpy as np
import pytest

import solver


def _regularised(v0: float) -> solver.Scene:
    """NLvib 1.3, example 05 (Krack, Gross 2019): 0.02 kg that rubs on the ground, carried by 1 kg."""
    return solver.Scene.from_dict(
        {
            "name": "two-masses",
            "structure": {
                "kind": "lumped",
                "masses": {"a": 0.02, "b": 1.0},
                "springs": [{"between": ["a", "b"], "k": 40.0}, {"between": ["b", "ground"], "k": 600.0}],
            },
            "contacts": [
                {"name": "f", "law": "coulomb-tanh", "between": ["a", "ground"], "mu": 1.0, "N0": 5.0,
                 "v0": v0, "samples": 1024},
            ],
            "excitation": {"dof": "b", "amplitude": 1.0},
            "observe": {"dof": "b", "band": [2.0, 6.0]},
        }
    )  # fmt: skip


def test_the_first_mode_of_regularised_friction_is_that_of_nlvib() -> None:
    # As its script prints in Octave: 25.298 rad/s stuck, 24.156 sliding, ζ up to 0.03792.
    found = solver.nonlinear_mode(
        _regularised(0.05), 1, amplitudes=(10**-1.5, 10.0), harmonics=21, errors=False
    )
    assert found.reached
    omega = 2.0 * math.pi * found.frequency_hz
    assert omega[[0, -1]] == pytest.approx([math.sqrt(640.0), 24.156], rel=2e-4)
    assert found.damping_ratio.max() == pytest.approx(
        0.03792, rel=5e-3
    )  # the points miss a little of the top


@pytest.mark.parametrize("v0", [0.5, 0.05, 0.005])
def test_modes_are_told_apart_by_what_moves(v0: float) -> None:
    shapes = []
    for mode in (1, 2):
        found = solver.nonlinear_mode(
            _regularised(v0), mode, amplitudes=(0.03, 0.3), harmonics=7, errors=False
        )
        assert found.points
        moved = np.abs(found.shape(0)) * np.sqrt([0.02, 1.0])
        shapes.append(moved / np.linalg.norm(moved))
    assert shapes[0][1] > 0.95
    assert shapes[1][0] > 0.9


def test_a_dashpot_alone_leads_to_the_linear_modes_it_makes() -> None:
    # Far below v0 the law is the dashpot μN/v0: ω² (1 + 2iζ) is an eigenvalue of M⁻¹ (K + iωC).
    scene = _regularised(0.05)
    K, M, C = np.array([[40.0, -40.0], [-40.0, 640.0]]), np.diag([0.02, 1.0]), np.diag([100.0, 0.0])
    root = np.diag(1.0 / np.sqrt(np.diag(M)))
    for mode in (1, 2):
        found = solver.nonlinear_mode(scene, mode, amplitudes=(1e-8, 2e-8), harmonics=3, errors=False)
        omega = 2.0 * math.pi * float(found.frequency_hz[0])
        values = np.linalg.eigvals(root @ (K + 1j * omega * C) @ root)
        expected = omega**2 * (1.0 + 2.0j * float(found.damping_ratio[0]))
        assert min(abs(values - expected)) < 1e-6 * abs(expected)
        assert omega == pytest.approx([math.sqrt(640.0), math.sqrt(2000.0)][mode - 1], rel=1e-2)
