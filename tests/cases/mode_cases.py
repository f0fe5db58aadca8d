"""Scenes of nonlinear modes, and a slider's first harmonic in closed form."""

import math

from solver import Scene


def one_mass(m: float, k: float, c: float, kt: float, limit: float) -> Scene:
    """A mass on a spring with a dashpot and a slider to the ground; `limit` is μ N."""
    return Scene.from_dict(
        {
            "name": "one-mass",
            "structure": {
                "kind": "lumped",
                "masses": {"x": m},
                "springs": [{"name": "spring", "between": ["x", "ground"], "k": k, "c": c}],
            },
            "contacts": [
                {"name": "damper", "between": ["x", "ground"], "kt": kt, "mu": 0.5, "N0": 2.0 * limit}
            ],
            "excitation": {"dof": "x", "amplitude": 1.0},
            "observe": {"dof": "x", "band": [0.01, 100.0]},
        }
    )


def slider(a: float, kt: float, limit: float) -> tuple[float, float]:
    """k_eq and ω c_eq of a slider that moves by a cos ωt; both [N/m]."""
    slips_from = limit / kt
    if a <= slips_from:
        return kt, 0.0
    theta = math.acos(1.0 - 2.0 * slips_from / a)
    stiffness = kt * (theta - 0.5 * math.sin(2.0 * theta)) / math.pi
    return stiffness, 4.0 * limit * (1.0 - slips_from / a) / (math.pi * a)
