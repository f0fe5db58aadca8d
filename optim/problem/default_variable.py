"""What is designed of a scene where nobody says it."""

from __future__ import annotations

from solver.scene.scene import Scene

BELOW, ABOVE = 10.0, 15.0
"""How far the range that is designed by itself goes below and above the value of a scene, as factors."""


def default_variable(scene: Scene) -> str | None:
    """Return the path that is designed by itself; None where the scene suggests none.

    Mass or normal load of the first damper that has one, else the normal load of the first contact with a
    tied load, else of the first contact.
    """
    for damper in scene.dampers:
        for key in ("mass", "N0"):
            if key in damper.parameters and scene.value(f"{damper.name}.{key}") > 0.0:
                return f"{damper.name}.{key}"
    rubbing = [(contact, contact.load) for contact in scene.contacts if contact.load is not None]
    tied = [(contact, load) for contact, load in rubbing if load.ratio is not None]
    first = next((contact for contact, _ in tied or rubbing), None)
    return None if first is None else f"{first.group or first.name}.N0"
