"""Disks that are not quite equal."""

import copy
from typing import Any

from solver import (
    Scene,
)

VALUES = (1.03, 0.98, 1.01, 0.95, 1.0, 1.06)


def disk(order: int = 1, pattern: str | None = None, sectors: int = 6, **contact: float) -> Scene:
    """Blades on a disk, with a shroud contact between neighbours and one under the platform."""
    force: dict[str, Any] = {"dof": "blade", "amplitude": 40.0, "phase": 0.4, "engine_order": order}
    if pattern is not None:
        force["pattern"] = pattern
    return Scene.from_dict(
        {
            "name": "disk",
            "structure": {
                "kind": "cyclic",
                "sectors": sectors,
                "masses": {"blade": {"m": 1.0, "name": "blade_mass"}, "hub": 3.0},
                "springs": [
                    {"name": "root", "between": ["blade", "hub"], "k": 400.0, "c": 1.5},
                    {"name": "ring", "between": ["hub", "hub@next"], "k": 300.0, "c": 1.0},
                    {"name": "shaft", "between": ["hub", "ground"], "k": 500.0, "c": 2.0},
                ],
                "dampers": [{"name": "drag", "between": ["blade", "ground"], "c": 0.2}],
            },
            "contacts": [
                {
                    "name": "shroud",
                    "between": ["blade", "blade@next"],
                    "kt": 150.0,
                    "mu": 0.3,
                    "N0": 30.0,
                    "N1": 8.0,
                    "N1_phase": 0.6,
                    **contact,
                },
                {"name": "platform", "between": ["blade", "hub"], "kt": 100.0, "mu": 0.4, "N0": 20.0},
            ],
            "excitation": force,
            "observe": {"dof": "blade", "band": [1.0, 6.0]},
        }
    )


def with_mistuning(scene: Scene, **table: Any) -> Scene:
    raw = copy.deepcopy(scene.to_dict())
    raw["structure"]["mistuning"] = table  # type: ignore[index]
    return Scene.from_dict(raw)
