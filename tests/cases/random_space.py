"""Random scenes in space: lumped points with x, y and z, and contacts whose load is given or moves."""

import math
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
from scipy.linalg import eigvalsh

from solver import Scene, march, solve
from solver.linear.assembly import linear_model
from solver.studies.instant import start_of

ROUNDING = 1e-12  # of two ways to add up a motion
K0 = (2.0 * math.pi) ** 2  # N/m: about 1 Hz with 1 kg


def random_space(seed: int) -> tuple[Scene, float, int]:
    """One to three points and contacts; with a frequency [Hz] and a number of harmonics, 3 to 21."""
    rng = np.random.default_rng([seed, 7])
    points = [f"p{i}" for i in range(rng.integers(1, 4))]
    dofs = [f"{point}{axis}" for point in points for axis in "xyz"]
    springs: list[dict[str, Any]] = [
        {"between": [dof, "ground"], "k": float(K0 * rng.uniform(0.3, 3.0))} for dof in dofs
    ]
    for here, there in zip(dofs, dofs[3:], strict=False):
        springs.append({"between": [here, there], "k": float(K0 * rng.uniform(0.1, 2.0))})
    for point in points:
        across = sorted(rng.choice(3, 2, replace=False).tolist())
        ends = [f"{point}{'xyz'[axis]}" for axis in across]
        springs.append({"between": ends, "k": float(K0 * rng.uniform(0.0, 0.5))})
    force = float(10.0 ** rng.uniform(-0.5, 1.5))
    loads = [
        {
            "dof": dof,
            "amplitude": float(force * rng.uniform(0.3, 1.0)),
            "phase": float(rng.uniform(-3.0, 3.0)),
        }
        for dof in rng.choice(dofs, rng.integers(1, 4), replace=False).tolist()
    ]
    scene = Scene.from_dict(
        {
            "name": f"space-{seed}",
            "structure": {
                "kind": "lumped",
                "masses": {dof: float(rng.uniform(0.5, 2.0)) for dof in dofs},
                "springs": springs,
                "stiffness_proportional_damping": float(10.0 ** rng.uniform(-2.5, -1.3) / math.pi),
            },
            "nodes": [
                {
                    "name": point,
                    "at": [float(i), 0.0, 0.0],
                    "dofs": {axis: f"{point}{axis}" for axis in "xyz"},
                }
                for i, point in enumerate(points)
            ],
            "contacts": [_contact(rng, f"c{i}", points, force) for i in range(rng.integers(1, 4))],
            "excitation": loads,
            "observe": {"dof": str(rng.choice(dofs)), "band": [0.05, 5.0]},
        }
    )
    return scene, _frequency(rng, scene), int(rng.integers(3, 22))


def _contact(rng: np.random.Generator, name: str, points: list[str], force: float) -> dict[str, Any]:
    """From loads that hardly matter to loads that stick; half of them move, a fifth of these with a gap."""
    first = str(rng.choice(points))
    normal = rng.normal(size=3)
    mu = float(rng.uniform(0.1, 0.8))
    N0 = float(force / mu * 10.0 ** rng.uniform(-1.0, 0.7))
    contact: dict[str, Any] = {
        "name": name,
        "law": "coulomb-3d",
        "between": [first, str(rng.choice([point for point in [*points, "ground"] if point != first]))],
        "at": [0.0, 0.0, 0.0],
        "normal": (normal / np.linalg.norm(normal)).tolist(),
        "limit": "circle" if rng.random() < 0.7 else "box",
        "kt": float(K0 * 10.0 ** rng.uniform(-0.5, 1.7)),
        "mu": mu,
        "N0": N0,
        "N1": 0.0 if rng.random() < 0.4 else float(N0 * rng.uniform(0.0, 1.5)),
        "N1_phase": float(rng.uniform(-math.pi, math.pi)),
    }
    if rng.random() < 0.3:
        contact["kt_second"] = float(K0 * 10.0 ** rng.uniform(-0.5, 1.7))
    if rng.random() < 0.5:
        contact["kn"] = float(K0 * 10.0 ** rng.uniform(-0.5, 1.5))
        if rng.random() < 0.2:
            contact["N0"] = -0.3 * N0
        else:
            contact["prestressed"] = bool(rng.random() < 0.5)
    return contact


def _frequency(rng: np.random.Generator, scene: Scene) -> float:
    """Near a resonance with the contacts free or stuck, near a fraction of one, or anywhere below."""
    model = linear_model(scene)
    L = np.real(model.contact_here)
    kt = model.port_stiffnesses * (rng.random() < 0.5)
    natural = np.sqrt(eigvalsh(model.K0 + L.T @ (kt[:, None] * L), model.M)) / (2.0 * math.pi)
    near = float(rng.choice(natural))
    frequencies = [rng.uniform(0.15, 1.5) * natural[0], near / rng.integers(2, 8), near, near]
    return float(frequencies[rng.integers(4)] * rng.uniform(0.9, 1.1))


class Outcome(Enum):
    """How a response compares with the march."""

    AGREES = "the march from rest ends in it"
    ELSEWHERE = "the march from rest ends elsewhere or not at all, the march from the response in it"
    UNSTABLE = "a march leaves it, but not in the first period: it, or it with 61 harmonics, repeats"
    WRONG = "neither"
    UNSOLVED = "the balance did not converge"


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """What a response in space is, beside the march.

    Attributes
    ----------
    seed : of the scene.
    outcome : how it compares; errors within ten estimates and 1 % count as agreement.
    marched : whether the march from rest settled.
    error, estimate : of half peak to peak, relative to it; the march's own error is in the estimate.
    flags : those of the response.
    """

    seed: int
    outcome: Outcome
    marched: bool
    error: float
    estimate: float
    flags: tuple[str, ...]


def judge(seed: int, max_periods: int = 3000) -> Verdict:
    """Solve a scene and march it: from rest and, where that ends elsewhere, from the response."""
    scene, frequency_hz, harmonics = random_space(seed)
    solution = solve(scene, frequency_hz=frequency_hz, harmonics=harmonics)
    rest = march(scene, frequency_hz=frequency_hz, max_periods=max_periods)
    size = solution.half_peak_to_peak
    marched = rest.error_estimate if rest.converged else 0.0
    estimate = solution.error_estimate / size + marched + ROUNDING

    def verdict(outcome: Outcome, error: float) -> Verdict:
        return Verdict(
            seed=seed, outcome=outcome, marched=rest.converged, error=error, estimate=estimate,
            flags=solution.flags,
        )  # fmt: skip

    def away(found: float) -> float:
        return abs(solution.half_peak_to_peak - found) / size

    near = max(10.0 * estimate, 0.01)
    if not solution.converged:
        return verdict(Outcome.UNSOLVED, math.nan)
    error = away(rest.half_peak_to_peak)
    if rest.converged and error <= estimate:
        return verdict(Outcome.AGREES, error)
    again = march(scene, frequency_hz=frequency_hz, max_periods=max_periods, start=start_of(solution))
    if again.converged and away(again.half_peak_to_peak) <= near:
        both = rest.converged and error <= near
        return verdict(Outcome.AGREES if both else Outcome.ELSEWHERE, away(again.half_peak_to_peak))
    finer = solve(scene, frequency_hz=frequency_hz, harmonics=61)
    candidates = [solution, *([finer] if finer.converged and away(finer.half_peak_to_peak) <= near else [])]
    ends = [march(scene, frequency_hz=frequency_hz, max_periods=1, start=start_of(one)) for one in candidates]
    left = [
        abs(end.half_peak_to_peak - one.half_peak_to_peak) / size
        for end, one in zip(ends, candidates, strict=True)
    ]
    unstable = min(left) <= 0.01
    return verdict(Outcome.UNSTABLE if unstable else Outcome.WRONG, away(candidates[-1].half_peak_to_peak))
