"""Scenes of three motions with a contact in space."""

from typing import Any

from lumped_structure import lumped

from solver.scene.scene import Scene

SPACE: dict[str, Any] = {
    "law": "coulomb-3d", "between": ["u", "ground"], "between_second": ["w", "ground"], "kt": 2.0, "mu": 0.4,
    "N0": 0.6,
}  # fmt: skip
MOVING: dict[str, Any] = {**SPACE, "normal_between": ["v", "ground"], "kn": 1.5, "prestressed": True}


def in_space(contact: dict[str, Any], amplitude: float = 1.0) -> Scene:
    """One mass with a motion in each direction, coupled, all driven; the contact holds it to the ground."""
    return Scene.from_dict(
        {
            "name": "in-space",
            "structure": lumped(
                {"u": 1.0, "v": 1.3, "w": 1.1},
                ("u", "ground", 1.0, 0.06),
                ("v", "ground", 1.6, 0.08),
                ("w", "ground", 1.3, 0.07),
                ("u", "v", 0.4, 0.02),
                ("u", "w", 0.2, 0.02),
            ),
            "contacts": [{"name": "c0", **contact}],
            "excitation": [
                {"dof": "u", "amplitude": amplitude},
                {"dof": "v", "amplitude": 0.6 * amplitude, "phase": 0.9},
                {"dof": "w", "amplitude": 0.5 * amplitude, "phase": -0.7},
            ],
            "observe": {"dof": "u", "band": [0.05, 0.5]},
        }
    )
