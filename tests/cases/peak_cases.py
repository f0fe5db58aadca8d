"""Scenes whose highest peak is followed, and that peak by a sweep."""

import math
from functools import cache

import solver
from solver.scene.scene import Scene

K1, K2 = 4.0 * math.pi**2, 2.0 * math.pi**2


@cache
def case_a() -> Scene:
    """Two masses, each to ground and to the other; the friction damper at the second."""
    springs = [
        {"name": "coupling", "between": ["m1", "m2"], "k": K2, "c": 0.5},
        {"name": "ground", "between": ["m1", "ground"], "k": K1, "c": 0.5},
        {"between": ["m2", "ground"], "k": K1, "c": 0.5},
    ]
    return Scene.model_validate(
        {
            "name": "case-a",
            "structure": {"kind": "lumped", "masses": {"m1": 1.0, "m2": 1.0}, "springs": springs},
            "contacts": [{"name": "damper", "between": ["m2", "ground"], "kt": 30.0, "mu": 0.3, "N0": 100.0}],
            "excitation": {"dof": "m1", "amplitude": 100.0},
            "observe": {"dof": "m2", "band": [0.2, 2.5]},
        }
    )


def scene_of(name: str) -> Scene:
    return case_a() if name == "case-a" else solver.load_scene(name)


def highest(scene: Scene, path: str, value: float) -> tuple[float, float]:
    """Height and frequency of the highest peak by a sweep."""
    branch = solver.sweep(scene.with_values({path: value}))
    assert branch.reached
    assert branch.peak is not None
    return branch.peak.value, branch.peak.at
