"""Bodies that contacts alone hold."""

import json
from pathlib import Path
from typing import Any

from lumped_structure import lumped

from solver import (
    Scene,
)

DAMPER = json.loads((Path(__file__).parent.parent / "data" / "floating.json").read_text())


def underplatform(load: float) -> Scene:
    """A damper of 5 g between each two of 24 blades."""
    raw = json.loads(json.dumps(DAMPER["scene"]))
    for contact in raw["contacts"]:
        contact["N0"] = load
    return Scene.from_dict({**raw, "name": "underplatform"})


def two_blades(**extra: Any) -> Scene:
    """Two blades with a damper between them."""
    return Scene.from_dict(
        {
            "name": "two-blades",
            "structure": lumped(
                {"b1": 0.1, "b2": 0.1, "d": 0.005}, ("b1", "ground", 4e5, 0.5), ("b2", "ground", 4.1e5, 0.5)
            ),
            "contacts": [
                {"name": name, "between": ["d", blade], "kt": 1e6, "mu": 0.3, "N0": 50.0, **extra}
                for name, blade in (("left", "b1"), ("right", "b2"))
            ],
            "excitation": [{"dof": "b1", "amplitude": 20.0}],
            "observe": {"dof": "b1", "band": [250.0, 450.0]},
        }
    )


def pulled(scene: Scene, dof: str, newtons: float) -> Scene:
    """The same with a static force besides."""
    pull = {"dof": dof, "amplitude": newtons, "harmonic": 0}
    raw = scene.to_dict()
    return Scene.from_dict({**raw, "excitation": [raw["excitation"], pull]})
