"""Scenes whose derivatives are compared with differences."""

from typing import Any

import solver
from solver.scene.scene import Scene

TWO_DOF = ("damper.N0", "damper.N1_ratio", "damper.N1_phase", "damper.kt", "damper.mu", "structure.k1",
           "structure.k2", "excitation.amplitude", "excitation.phase")  # fmt: skip
BEAM = ("c.N0", "c.kt", "structure.stiffness_proportional_damping", "structure.mass_proportional_damping")


def two_dof(**values: float) -> Scene:
    changed = {f"damper.{key}": value for key, value in values.items()}
    return solver.load_scene("two-dof").with_values({"damper.N1_phase": 0.4, **changed})


def disk(**values: float) -> Scene:
    return solver.load_scene("bladed-disk").with_values({"root.N0": 300.0} | values)


def loose() -> Scene:
    """The second mass is held by contacts alone, two of them in a group, and springs share a value."""
    raw: dict[str, Any] = {
        "name": "loose",
        "structure": {
            "kind": "lumped", "masses": {"a": 1.0, "b": 0.7},
            "springs": [
                {"name": "left", "between": ["a", "ground"], "k": 40.0, "c": 0.5, "group": "both"},
                {"name": "right", "between": ["a", "ground"], "k": 20.0, "c": 0.2, "group": "both",
                 "factor": 0.5},
            ],
        },
        "contacts": [
            {"name": "one", "between": ["a", "b"], "kt": 30.0, "mu": 0.3, "N0": 15.0, "N1": 5.0,
             "group": "pair"},
            {"name": "two", "between": ["b", "ground"], "kt": 30.0, "mu": 0.3, "N0": 300.0, "N1": 8.0,
             "group": "pair"},
        ],
        "excitation": {"dof": "a", "amplitude": 25.0}, "observe": {"dof": "b", "band": [0.2, 2.0]},
    }  # fmt: skip
    return Scene.from_dict(raw)
