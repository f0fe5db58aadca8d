"""Scenes with a contact of each law."""

from typing import Any

from lumped_structure import lumped

from solver.scene.scene import Scene

RUB: dict[str, Any] = {
    "law": "elastic-normal", "normal_between": ["v", "ground"], "kt": 2.0, "mu": 0.4, "kn": 1.5, "N0": 0.2,
}  # fmt: skip
PLANE: dict[str, Any] = {
    "law": "coulomb-2d",
    "between_second": ["v", "ground"],
    "kt": 2.0,
    "mu": 0.5,
    "N0": 0.8,
}
GAP: dict[str, Any] = {"law": "gap", "k": 3.0, "gap": 0.25}
DAHL: dict[str, Any] = {"law": "dahl", "sigma": 2.0, "limit": 0.4}
CUBIC: dict[str, Any] = {"law": "polynomial", "a1": 0.2, "a2": 0.1, "a3": 1.0}


def scene(*contacts: dict[str, Any], amplitude: float = 1.0, second: float = 0.6) -> Scene:
    """Two masses u and v in two directions, coupled, both driven; contacts of u to the ground."""
    return Scene.from_dict(
        {
            "name": "two-directions",
            "structure": lumped(
                {"u": 1.0, "v": 1.3},
                ("u", "ground", 1.0, 0.06),
                ("v", "ground", 1.6, 0.08),
                ("u", "v", 0.4, 0.02),
            ),
            "contacts": [{"name": f"c{i}", "between": ["u", "ground"], **c} for i, c in enumerate(contacts)],
            "excitation": [
                {"dof": "u", "amplitude": amplitude},
                {"dof": "v", "amplitude": second * amplitude, "phase": 0.9},
            ],
            "observe": {"dof": "u", "band": [0.05, 0.5]},
        }
    )


def cyclic(contact: dict[str, Any]) -> Scene:
    return Scene.from_dict(
        {
            "name": "ring",
            "structure": {
                "kind": "cyclic",
                "sectors": 5,
                "masses": {"u": 1.0, "v": 1.4},
                "springs": [
                    {"between": ["u", "ground"], "k": 1.0, "c": 0.05},
                    {"between": ["v", "ground"], "k": 1.3, "c": 0.05},
                    {"between": ["u", "v"], "k": 0.3},
                    {"between": ["u", "u@next"], "k": 0.2},
                ],
            },
            "contacts": [{"name": "shroud", "between": ["u", "u@next"], **contact}],
            "excitation": {"dof": "u", "amplitude": 1.0, "engine_order": 2},
            "observe": {"dof": "u", "band": [0.05, 0.5]},
        }
    )
