"""A scene in other units."""

from typing import Any

from solver import (
    Scene,
)


def in_other_units(scene: Scene, *, length: float, time: float) -> Scene:
    """The scene in units of `length` metres and `time` seconds; the unit of force stays the newton."""
    raw: dict[str, Any] = scene.to_dict()
    structure = raw["structure"]
    structure["stiffness_proportional_damping"] = scene.structure.stiffness_proportional_damping / time
    structure["masses"] = {mass.dof: mass.m * length / time**2 for mass in scene.structure.masses}
    for spring in structure["springs"]:
        spring["k"] *= length
        spring["c"] = spring.get("c", 0.0) * length / time
    for damper in structure.get("dampers", []):
        damper["c"] *= length / time
    for contact in raw["contacts"]:
        contact["kt"] *= length
    raw["observe"]["band"] = [edge * time for edge in scene.observe.band]
    return Scene.from_dict(raw)
