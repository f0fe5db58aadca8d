"""A structure without damping at its resonances: the word is damping, not harmonics."""

from typing import Any

import numpy as np
import pytest

import solver
from solver import Scene
from solver.continuation.branch import BranchStatus
from solver.linear.modal import undamped_resonance


def scene(**structure: Any) -> Scene:
    return Scene.from_dict(
        {
            "name": "undamped",
            "structure": {
                "kind": "lumped", "masses": {"a": 1.0, "b": 2.0},
                "springs": [
                    {"between": ["a", "ground"], "k": 39.478417604}, {"between": ["a", "b"], "k": 30.0},
                ], **structure,
            },
            "contacts": [{"name": "damper", "between": ["b", "ground"], "kt": 20.0, "mu": 0.3, "N0": 1.0}],
            "excitation": {"dof": "a", "amplitude": 1.0},
            "observe": {"dof": "a", "band": [0.3, 1.8]},
        }
    )  # fmt: skip


def test_a_sweep_that_ends_at_an_undamped_resonance_asks_for_damping() -> None:
    branch = solver.sweep(scene(), harmonics=5)
    assert branch.status is BranchStatus.UNDAMPED
    assert "no damping" in branch.status.value
    assert "harmonics" not in branch.status.value


K = np.array([[69.478417604, -30.0], [-30.0, 30.0]])
NATURAL = np.sqrt(np.linalg.eigvals(np.linalg.solve(np.diag([1.0, 2.0]), K))) / (2 * np.pi)


@pytest.mark.parametrize(
    ("structure", "factor", "k", "word"),
    [
        ({}, 1.0, 1, True),
        ({}, 1.01, 1, True),
        ({}, 1.1, 1, False),
        ({}, 1.0, 3, True),
        ({"damping_ratio": 1e-4}, 1.0, 1, False),
        ({"loss_factor": 1e-4}, 1.0, 1, False),
    ],
)
def test_it_is_said_near_a_resonance_without_damping_alone(
    structure: dict[str, float], factor: float, k: int, word: bool
) -> None:
    for natural in NATURAL:
        ks = np.array([1, k]) if k > 1 else np.array([1])
        assert undamped_resonance(scene(**structure), factor * natural / k, ks) is word
