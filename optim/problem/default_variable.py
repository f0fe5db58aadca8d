"""What is designed of a scene where nobody says it."""

from __future__ import annotations

from solver.scene.scene import Scene

BELOW, ABOVE = 10.0, 15.0
"""How far the range that is designed by itself goes below and above the value of a scene, as factors."""


def default_variable(scene: Scene) -> str | None:
    """Return the path that is designed by itself; None where the scene suggests none.

    The mass of the first damper that has one, else the normal load of the first contact with a tied load,
    else of the first contact.
    """
    heavy = [f"{damper.name}.mass" for damper in scene.dampers if "mass" in damper.parameters]
    if heavy:
        return heavy[0]
    rubbing = [(contact, contact.load) for contact in scene.contacts if contact.load is not None]
    tied = [(contact, load) for contact, load in rubbing if load.ratio is not None]
    for contact, _ in (tied or rubbing)[:1]:
        return f"{contact.group or contact.name}.N0"
    return None
