"""Scenes in which few modes or one body move many contacts."""

import math
from typing import Any

import numpy as np
from body_scenes import shaped_wedge

from solver import Scene

K0 = (2.0 * math.pi) ** 2  # N/m


def nodes_on_modes(seed: int = 0, nodes: int = 5, modes: int = 6, law: str = "elastic-normal") -> Scene:
    """Nodes with x, y and z of a structure given by its modes, each rubbing on the ground."""
    rng = np.random.default_rng([seed, 11])
    ends = {"between": "x", "normal_between": "z"} | ({"between_second": "y"} if law == "coulomb-3d" else {})
    frequencies = np.sort(rng.uniform(0.8, 4.0, modes))
    return Scene.from_dict(
        {
            "name": f"nodes-{seed}",
            "structure": {
                "kind": "matrices",
                "modes": {
                    "frequencies_hz": frequencies.tolist(),
                    "modes": (rng.normal(size=(3 * nodes, modes)) / math.sqrt(nodes)).tolist(),
                    "damping_ratio": 0.02,
                },
                "dofs": [f"n{i}{axis}" for i in range(nodes) for axis in "xyz"],
            },
            "contacts": [
                {
                    "name": f"c{i}", "law": law, "kt": float(K0 * rng.uniform(0.2, 1.0)),
                    "kn": float(K0 * rng.uniform(0.2, 1.0)), "mu": float(rng.uniform(0.2, 0.5)),
                    "N0": float(rng.uniform(1.0, 4.0)),
                    **{key: [f"n{i}{axis}", "ground"] for key, axis in ends.items()},
                }
                for i in range(nodes)
            ],
            "excitation": [
                {
                    "dof": f"n{i}{axis}", "amplitude": float(rng.uniform(1.0, 4.0)),
                    "phase": float(rng.uniform(-3.0, 3.0)),
                }
                for i in range(nodes)
                for axis in "xz"
            ],
            "observe": {"dof": "n0x", "band": [0.6, 3.0]},
        }
    )  # fmt: skip


def wedge_of_points(points: int = 4, **extra: Any) -> Scene:
    """A floating wedge in a plane, pressed by rotation, with `points` contacts a face under a moving load."""
    raw = shaped_wedge()
    raw["dampers"][0]["points"] = points
    return Scene.from_dict({**raw, **extra})


def parallel_sliders(count: int = 10) -> Scene:
    """One mass on many sliders of unlike strength, and a second one on a spring."""
    return Scene.from_dict(
        {
            "name": "sliders",
            "structure": {
                "kind": "lumped",
                "masses": {"a": 1.0, "b": 0.5},
                "springs": [
                    {"between": ["a", "ground"], "k": K0, "c": 0.3},
                    {"between": ["a", "b"], "k": K0, "c": 0.3},
                ],
            },
            "contacts": [
                {
                    "name": f"slider-{i}", "between": ["a", "ground"], "kt": 0.1 * K0 * (1.0 + 0.1 * i),
                    "mu": 0.3, "N0": 0.5 + 0.8 * i, "N1_ratio": 0.3,
                }
                for i in range(count)
            ],
            "excitation": {"dof": "b", "amplitude": 8.0},
            "observe": {"dof": "a", "band": [0.5, 2.0]},
        }
    )  # fmt: skip
