"""The linear responses between which friction works: contacts removed, and contacts stuck."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from solver.scene.scene import ElasticNormalContact, FrictionContact, Scene

# A load, in units of all forces together, under which nothing slips: resonances magnify the forces less, and
# the forces of the contacts keep enough digits beside it.
_HOLDS = 1e8
_LEAST_FRICTION = 0.1


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
        if isinstance(contact, FrictionContact):
            _linear(table, contact, load, gone=contact.name in removed)
    return Scene.from_dict(raw)


def _linear(table: dict[str, Any], contact: FrictionContact, load: float, *, gone: bool) -> None:
    """Set the table of a contact to its linear limit."""
    table.pop("N1_ratio", None)
    table |= {"N1": 0.0, "N0": 0.0 if gone else load}
    if contact.mu < _LEAST_FRICTION:
        table["mu"] = _LEAST_FRICTION
    if isinstance(contact, ElasticNormalContact):
        # Its load acts on the parts: removed it never closes, stuck it counts from the pressed state.
        table |= {"N0": -load} if gone else {"prestressed": True}
