"""The linear responses between which friction works: contacts removed, and contacts stuck."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from solver.scene.scene import Scene

# A load, in units of all forces together, under which nothing slips: resonances magnify the forces less, and
# the forces of the contacts keep enough digits beside it.
_HOLDS = 1e8


def linear_limit(scene: Scene, removed: Collection[str]) -> Scene:
    """The scene without the friction of some contacts, and with every other friction contact stuck.

    Contacts of other laws stay as they are.

    Parameters
    ----------
    scene : what vibrates.
    removed : names of the contacts that are removed.
    """
    load = _HOLDS * (sum(abs(force.amplitude) for force in scene.excitation) or 1.0)
    raw: dict[str, Any] = scene.to_dict()
    for table, contact in zip(raw["contacts"], scene.contacts, strict=True):
        changed = contact.linear_limit(load, gone=contact.name in removed) or {}
        table |= changed
        for key in (key for key, value in changed.items() if value is None):
            del table[key]
    return Scene.from_dict(raw)
