"""A structure without damping at its resonances: the word is damping, not harmonics."""

import itertools
import math
from typing import Any

import numpy as np
import pytest

import solver
from solver import Scene
from solver.balance.balance import build
from solver.balance.kernels.output import MAX_ABS
from solver.balance.workspace import Workspace
from solver.continuation.branch import BranchStatus
from solver.linear.natural_frequencies import undamped_resonance
from solver.studies.peaks.peak_lines import fitted
from stickslip.lab.quasi_periodic.quasi_periodic_result import QuasiPeriodicStatus


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


def sprung(seed: int) -> tuple[dict[str, Any], float]:
    """A mass with a spring on one or both sides, without damping, and where large amplitudes resonate [Hz].

    There gaps do not count: half a period each way has the frequency of the springs that push on that side.
    """
    rng = np.random.default_rng([seed, 77])
    k, gap, both = 40.0 * 10.0 ** rng.uniform(-0.5, 0.5), 10.0 ** rng.uniform(-3.0, -1.0), seed % 2
    sides = [k * 10.0 ** rng.uniform(-1.0, 0.5) for _ in range(1 + both)]
    ends = (["a", "ground"], ["ground", "a"])
    raw: dict[str, Any] = {
        "name": "sprung",
        "structure": {
            "kind": "lumped", "masses": {"a": 1.0}, "springs": [{"between": ["a", "ground"], "k": k}],
        },
        "contacts": [
            {"name": f"c{i}", "law": "gap", "between": ends[i], "k": side, "gap": gap}
            for i, side in enumerate(sides)
        ],
        "excitation": {"dof": "a", "amplitude": 1.0},
    }  # fmt: skip
    up, down = np.sqrt([k + sides[0], k + (sides[1] if both else 0.0)]) / (2.0 * np.pi)
    low = np.sqrt(k) / (2.0 * np.pi)
    at = 2.0 * up * down / (up + down)
    raw["observe"] = {"dof": "a", "band": [float(0.9 * low), float(1.2 * at)]}
    return raw, float(at)


@pytest.mark.few(13)
@pytest.mark.parametrize("seed", range(40))
def test_a_spring_that_pushes_on_one_side_bounds_no_resonance_but_moves_it(seed: int) -> None:
    raw, at = sprung(seed)
    branch = solver.sweep(Scene.from_dict(raw), harmonics=5)
    assert branch.status is BranchStatus.UNDAMPED
    assert branch.peaks == ()
    assert branch.band is None
    low = raw["observe"]["band"][0]
    raw["observe"]["band"][1] = low + 0.7 * (at - low)
    below = solver.sweep(Scene.from_dict(raw), harmonics=5)
    assert below.reached
    assert below.peak is not None
    workspace = Workspace.of(build(Scene.from_dict(raw), harmonics=41))
    there = workspace.solve_from(
        2.0 * math.pi * below.peak.at, fitted(below.peak.solution, below.balance.system.ks, workspace.balance)
    )
    measures = workspace.measure(there.u, 2.0 * math.pi * below.peak.at)
    assert measures is not None
    assert abs(measures.values[MAX_ABS] - below.peak.value) <= below.error_estimate


def test_two_frequencies_at_a_resonance_without_damping_ask_for_some() -> None:
    raw = scene().to_dict() | {"contacts": []}
    other = 0.8 * float(NATURAL.min())
    for first, second in itertools.product((other, *NATURAL), repeat=2):
        if first == second:
            continue
        found = solver.quasi_periodic(
            Scene.from_dict(raw), frequency_hz=float(first), second_hz=float(second), amplitude=3.0,
            harmonics=3, turns=24,
        )  # fmt: skip
        assert found.status is QuasiPeriodicStatus.UNDAMPED
        assert math.isnan(found.max_abs)


@pytest.mark.few(7)
@pytest.mark.parametrize("seed", range(42))
def test_two_frequencies_without_damping_have_no_number_or_one_that_is_known(seed: int) -> None:
    """Ratios of whole numbers to either side of a resonance tell nothing of what lies between them."""
    rng = np.random.default_rng([seed, 5])
    first = float(rng.uniform(0.4, 0.95) * NATURAL.min())
    second = float(rng.choice(NATURAL) * (1.0 + rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-5.0, -0.7)))
    raw = scene().to_dict() | {"contacts": []}
    found = solver.quasi_periodic(
        Scene.from_dict(raw), frequency_hz=first, second_hz=second, amplitude=3.0, harmonics=3, turns=48
    )
    exact = [
        abs(np.linalg.solve(K - (2.0 * np.pi * hertz) ** 2 * np.diag([1.0, 2.0]), [force, 0.0])[0])
        for hertz, force in ((first, 1.0), (second, 3.0))
    ]
    assert found.first_amplitude == pytest.approx(exact[0], rel=1e-6) or math.isnan(found.first_amplitude)
    if found.reached:
        assert abs(found.max_abs - sum(exact)) <= found.error_estimate
    assert not found.error_estimate < abs(found.max_abs - sum(exact))
