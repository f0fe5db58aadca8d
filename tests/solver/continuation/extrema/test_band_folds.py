"""Resonance bands that end in a fold: where they end, and how the end moves."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from optim import sensitivities
from optim.criteria.response_gradients import Sensitivity
from solver import Branch, ContinuationSettings, Scene, load_scene, sweep

DATA = Path(__file__).parents[3] / "data"


def duffing(values: dict[str, float]) -> Scene:
    """A mass on a hardening spring: m, c, k, a3, f."""
    return Scene.from_dict(
        {
            "name": "duffing",
            "structure": {
                "kind": "lumped",
                "masses": {"x": values["m"]},
                "springs": [{"name": "k", "between": ["x", "ground"], "k": values["k"], "c": values["c"]}],
            },
            "contacts": [{"name": "n", "law": "polynomial", "between": ["x", "ground"], "a3": values["a3"]}],
            "excitation": {"dof": "x", "amplitude": values["f"]},
            "observe": {"dof": "x", "band": [0.05, 1.0]},
        }
    )


def squared_omega(values: dict[str, float], A: float, sign: float) -> float:
    """ω² of amplitude A by one harmonic: ((k + ¾ a3 A² − m ω²)² + c² ω²) A² = f²."""
    m, c, k = values["m"], values["c"], values["k"] + 0.75 * values["a3"] * A * A
    b, q = 2.0 * k * m - c * c, k * k - (values["f"] / A) ** 2
    return (b + sign * math.sqrt(max(b * b - 4.0 * m * m * q, 0.0))) / (2.0 * m * m)


def fold_hz(values: dict[str, float], guess: float) -> float:
    """The upper fold: the largest frequency with this amplitude or more, dω/dA = 0, by nested bisection."""

    def apart(A: float) -> float:
        return squared_omega(values, A, 1.0) - squared_omega(values, A, -1.0) - 1e-13

    top = brentq(apart, 0.9 * guess, 3.0 * guess)
    amplitudes = top * np.linspace(0.8, 1.0, 4001)
    found = np.array([squared_omega(values, float(A), 1.0) for A in amplitudes])
    at = int(found.argmax())
    low, high = amplitudes[max(at - 1, 0)], amplitudes[min(at + 1, 4000)]
    for _ in range(200):
        a, b = low + 0.381966 * (high - low), low + 0.618034 * (high - low)
        if squared_omega(values, float(a), 1.0) > squared_omega(values, float(b), 1.0):
            high = b
        else:
            low = a
    return math.sqrt(squared_omega(values, float(0.5 * (low + high)), 1.0)) / (2.0 * math.pi)


DUFFING = {"m": 1.0, "c": 0.05, "k": 1.0, "a3": 0.4, "f": 0.2}


def test_a_band_ends_at_the_fold_of_the_closed_form() -> None:
    """One harmonic: the upper end of the half-power band is the fold, known from the amplitude equation."""
    branch = sweep(duffing(DUFFING), harmonics=1)
    assert branch.band is not None
    (end,) = [edge for edge in branch.band.edges if edge.fold]
    assert not end.corner
    assert not end.opens
    assert end.at == pytest.approx(fold_hz(DUFFING, branch.peaks[0].value), rel=1e-8)
    assert branch.band.intervals[-1][1] == end.at


@pytest.mark.parametrize("path", ["k.k", "n.a3", "excitation.amplitude"])
def test_the_fold_moves_as_the_closed_form_says(path: str) -> None:
    name = {"k.k": "k", "n.a3": "a3", "excitation.amplitude": "f"}[path]
    scene = duffing(DUFFING)
    paths = [path if path != "k.k" else "structure.k"]
    branch = sweep(scene, harmonics=1)
    assert branch.band is not None
    (end,) = [edge for edge in branch.band.edges if edge.fold]
    moves = Sensitivity(branch.balance, paths).band([end], np.zeros(1))
    step = 1e-3 * DUFFING[name]
    guess = branch.peaks[0].value
    ends = [fold_hz({**DUFFING, name: DUFFING[name] + sign * step}, guess) for sign in (1.0, -1.0)]
    assert moves[0] == pytest.approx((ends[0] - ends[1]) / (2.0 * step), rel=2e-5)


def folded_scene(seed: int) -> Scene:
    """Two to four masses, a friction contact, and polynomial springs that bend the resonances over."""
    rng = np.random.default_rng(seed)
    dofs = [f"m{i}" for i in range(rng.integers(2, 5))]
    springs: list[dict[str, Any]] = [
        {"name": "k0", "between": ["m0", "ground"], "k": rng.uniform(20.0, 200.0)}
    ]
    for i in range(1, len(dofs)):
        other = dofs[rng.integers(i)]
        springs.append({"name": f"k{i}", "between": [dofs[i], other], "k": rng.uniform(20.0, 200.0)})
    force = float(10.0 ** rng.uniform(0.5, 1.5))
    contacts: list[dict[str, Any]] = [
        {"name": "c0", "between": [str(rng.choice(dofs)), "ground"], "kt": rng.uniform(5.0, 100.0),
         "mu": 0.3, "N0": force * rng.uniform(0.1, 3.0)},
    ]  # fmt: skip
    for i in range(rng.integers(1, 3)):
        pair = [str(rng.choice(dofs)), "ground"]
        contacts.append(
            {"name": f"n{i}", "law": "polynomial", "between": pair, "a3": 10.0 ** rng.uniform(0.0, 1.3)}
        )
    return Scene.from_dict(
        {
            "name": f"folded-{seed}",
            "structure": {
                "kind": "lumped",
                "masses": {dof: rng.uniform(0.5, 2.0) for dof in dofs},
                "springs": springs,
                "stiffness_proportional_damping": 10.0 ** rng.uniform(-2.9, -2.2),
            },
            "contacts": contacts,
            "excitation": {"dof": str(rng.choice(dofs)), "amplitude": force},
            "observe": {"dof": str(rng.choice(dofs)), "band": [0.2, 4.0]},
        }
    )


def check_slopes(scene: Scene, harmonics: int, most: int) -> int:
    """Compare the derivatives of a band with differences of whole sweeps; return how many were compared."""
    branch = sweep(scene, harmonics=harmonics)
    if not branch.reached or branch.band is None or not any(edge.fold for edge in branch.band.edges):
        return 0
    limit = branch.band.limit
    found = sensitivities(scene, limit=limit, harmonics=harmonics)
    compared = 0
    for row in found.rows:
        if not row.relative or math.isnan(row.band) or compared == most:
            continue
        slopes = []
        for share in (1e-4, 3e-5):
            step = share * row.value
            sides = [
                sweep(
                    scene.with_values({row.path: row.value + sign * step}), limit=limit, harmonics=harmonics
                )
                for sign in (1.0, -1.0)
            ]
            slopes.append((width(sides[0]) - width(sides[1])) / (2.0 * step))
        size = branch.band.width / row.value
        assert row.band == pytest.approx(slopes[1], rel=1e-3, abs=1e-4 * size + abs(slopes[1] - slopes[0])), (
            f"{scene.name} {row.path}: {row.band} against {slopes}"
        )
        compared += 1
    return compared


def width(branch: Branch) -> float:
    assert branch.reached
    assert branch.band is not None
    return branch.band.width


def test_slopes_of_a_band_that_ends_in_a_fold() -> None:
    """The interval ends where the branch turns back: that end moves with the fold."""
    assert check_slopes(load_scene(DATA / "band_at_a_fold.toml"), 11, 2) == 2


@pytest.mark.few(4)
@pytest.mark.parametrize("first", [0, 3, 20, 23])
def test_slopes_of_random_folds(first: int) -> None:
    assert sum(check_slopes(folded_scene(seed), 5, 2) for seed in range(first, first + 3)) > 0


@pytest.mark.long
@pytest.mark.parametrize("first", range(0, 200, 20))
def test_slopes_of_many_random_folds(first: int) -> None:
    assert sum(check_slopes(folded_scene(seed), 5, 3) for seed in range(first, first + 20)) > 10


TURNS = (4, 15, 18, 40, 55, 93, 106, 119, 126, 128)  # seeds of branches that went back the way they came


@pytest.mark.few(keep=TURNS[::2])
@pytest.mark.parametrize("seed", range(150))
def test_no_branch_goes_back_the_way_it_came(seed: int) -> None:
    """Branch points and kinks in one step: the sign of the determinant alone does not tell where to go on."""
    branch = sweep(folded_scene(seed), harmonics=5)
    assert branch.reached
    finer = sweep(folded_scene(seed), harmonics=5, settings=ContinuationSettings(largest_step=0.03))
    assert branch.peak is not None
    assert finer.peak is not None
    assert branch.peak.value == pytest.approx(finer.peak.value, rel=1e-7)
