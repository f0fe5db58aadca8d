"""Random designs with limits of every kind, and what keeps them on a grid over the bounds."""

import itertools
import math
from typing import Any, NamedTuple

import numpy as np
from cases.random_designs import random_design
from cases.stress_scenes import stressed

from optim.criteria.evaluation import evaluate, natural_scales
from optim.problem.problem import Problem, pose

QUANTITIES = {
    "running": "running amplitude", "forbidden": "amplitude in a forbidden range", "peak": "peak",
    "band": "band", "work": "friction work", "wear": "wear rate", "separation": "separation",
    "damping": "damping ratio", "stress": "stress", "margin": "utilisation",
}  # fmt: skip
KEYS = {
    "running": "max_running_amplitude", "forbidden": "limit", "peak": "max_peak", "band": "max_band_hz",
    "work": "max_friction_work", "wear": "max_wear_rate", "damping": "min_damping", "stress": "max_stress",
    "margin": "min_margin",
}  # fmt: skip
GRID = 200
KEPT = 1e-6  # relative excess over a bound up to which it counts as kept


def limited_design(seed: int) -> dict[str, Any]:
    """The arguments of `optim.design`: one or two limits, kept by a share of the designs, perhaps by none."""
    rng = np.random.default_rng([seed, 21])
    every = list(QUANTITIES)
    kinds = [every[seed % len(every)], *([str(rng.choice(every[:4]))] if rng.random() < 0.4 else [])]
    n = 2 if seed % 5 == 4 else 1
    if kinds[0] in ("stress", "margin"):
        variables = {"slides.N0": (0.05, 10.0), "structure.neck": (10.0, 40.0)}
        asked: dict[str, Any] = {
            "scene": stressed(static=float(rng.uniform(-100.0, 800.0))), "harmonics": 3,
            "variables": dict(list(variables.items())[:n]),
        }  # fmt: skip
    else:
        cases = 2 if seed % 7 == 3 else 1
        asked = random_design(seed, n, cases=cases, harmonics=1 + 2 * int(seed % 2))
    for kind in dict.fromkeys(kinds):
        asked |= _limit(rng, asked, kind)
    if rng.random() < 0.3:
        asked["start"] = {path: low + 0.9 * (high - low) for path, (low, high) in asked["variables"].items()}
    return asked


def _limit(rng: np.random.Generator, asked: dict[str, Any], kind: str) -> dict[str, Any]:
    """A limit at a value that a share of a few designs keep, or a little off; none where there is none."""
    scene = asked["scene"]
    a, b = sorted(rng.uniform(*scene.observe.band, 2))
    beside: dict[str, Any] = {
        "running": {"running_rpm": [[60.0 * a, 60.0 * b]]}, "forbidden": {"forbidden_hz": [[a, b]]},
        "wear": {"wear_coefficient": 1e-12},
        "separation": {"contact_states": {scene.contacts[0].name: "never-separates"}},
    }.get(kind, {})  # fmt: skip
    if kind == "separation":
        return beside
    amplitude = 10.0 ** rng.uniform(-2.0, 0.0)

    def bounded(value: float) -> dict[str, Any]:
        bound: Any = {"ratio": value, "amplitude": amplitude} if kind == "damping" else value
        return {**beside, KEYS[kind]: bound}

    problem = pose(**asked | bounded(1.0))
    places = [evaluate(problem, values, gradients=False, errors=False) for values in grid(problem, 12)]
    highest = [
        max((row.value for row in one.rows if row.quantity.name == QUANTITIES[kind]), default=math.nan)
        for one in places
    ]
    known = np.array([value for value in highest if math.isfinite(value)])
    share, off = rng.choice([0.0, 0.05, 0.1, 0.3, 0.7]), 1.0 + rng.choice([-0.05, 1e-3, 0.02])
    bound = float(np.quantile(known, share)) * off if known.size else 0.0
    bound = {"damping": -bound, "margin": 1.0 / bound if bound else 0.0}.get(kind, bound)
    return bounded(bound) if bound > 0.0 else {}


def grid(problem: Problem, count: int) -> list[dict[str, float]]:
    """About so many designs over the bounds, in the scaling of the variables."""
    each = max(2, round(count ** (1.0 / len(problem.variables))))
    axes = [[variable.outside(z) for z in np.linspace(0.0, 1.0, each)] for variable in problem.variables]
    names = [variable.name for variable in problem.variables]
    return [dict(zip(names, place, strict=True)) for place in itertools.product(*axes)]


class BruteForce(NamedTuple):
    """Of a grid of designs, how many keep all limits, and the least that is minimised of these."""

    kept: int
    least: float


def brute_force(problem: Problem, count: int = GRID) -> BruteForce:
    """Evaluate every design of a grid."""
    found = [evaluate(problem, values, gradients=False, errors=False) for values in grid(problem, count)]
    scales = natural_scales(problem)
    kept = [one.objective for one in found if one.good and one.violation(scales) <= 0.0]
    return BruteForce(len(kept), min(kept, default=math.inf))
