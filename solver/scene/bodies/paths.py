"""Parameter paths of bodies, loads and the speed: ``damper.mass``, ``pull.force``, ``speed``."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from solver.contacts.fields import LARGEST
from solver.errors import SettingError
from solver.scene.bodies.body import Body, Load
from solver.scene.bodies.kinematics import HasBodies, force_derivatives

SPEED = "speed"
FORCE = "force"
UNITS: Mapping[str, str] = {
    "mass": "kg", "Ixx": "kg m^2", "Iyy": "kg m^2", "Izz": "kg m^2", "radius_of_rotation": "m",
    FORCE: "N", SPEED: "1/min",
}  # fmt: skip


def body_paths(scene: HasBodies) -> tuple[str, ...]:
    """Every path of bodies and their groups, of named loads, and the speed."""
    grouped = dict.fromkeys(f"{b.group}.{key}" for b in scene.bodies if b.group for key in b.parameters)
    own = dict.fromkeys(f"{body.name}.{key}" for body in scene.bodies for key in body.parameters)
    forces = dict.fromkeys(f"{load.name}.{FORCE}" for load in scene.loads if load.name is not None)
    return (*(grouped | own | forces), *((SPEED,) if scene.speed is not None else ()))


def is_body_path(scene: HasBodies, path: str) -> bool:
    """Whether a path is one of these."""
    owner, _, key = path.rpartition(".")
    if not owner:
        return key == SPEED and scene.speed is not None
    return bool(_bodies(scene, owner, key) or (key == FORCE and _loads(scene, owner)))


def changes_loads(scene: HasBodies, path: str) -> bool:
    """Whether constant forces depend on a path."""
    return is_body_path(scene, path) and any(force_derivatives(scene, path))


def least_value(path: str) -> float:
    """Smallest value that means something."""
    return -math.inf if path.endswith("." + FORCE) else 0.0


def unit_of(path: str) -> str:
    """Unit of the values of a path."""
    return UNITS[path.rpartition(".")[2]]


def body_value(scene: HasBodies, path: str) -> float:
    """Value of a path; of a group, its first member's."""
    owner, _, key = path.rpartition(".")
    if not owner:
        return scene.speed or 0.0
    bodies = _bodies(scene, owner, key)
    return bodies[0].value_of(key) if bodies else _loads(scene, owner)[0].force


def changed_bodies(scene: HasBodies, path: str, new: float) -> dict[str, Any]:
    """The fields of a scene that change where a path is set.

    Raises
    ------
    SettingError
        The value is out of its range.
    """
    owner, _, key = path.rpartition(".")
    least = least_value(path)
    if not max(least, -LARGEST) <= new <= LARGEST or (key == "mass" and new == 0.0):
        bound = "from -1e15" if least < 0.0 else "> 0 and" if key == "mass" else ">= 0 and"
        raise SettingError(path, new, f"must be a number {bound} <= 1e15 [{unit_of(path)}]")
    if not owner:
        return {SPEED: new}
    bodies, loads = _bodies(scene, owner, key), _loads(scene, owner)
    if bodies:
        return {"bodies": tuple(_changed(b, path, key, new) if b in bodies else b for b in scene.bodies)}
    return {"loads": tuple(x.model_copy(update={FORCE: new}) if x in loads else x for x in scene.loads)}


def _changed(body: Body, path: str, key: str, new: float) -> Body:
    try:
        return Body.model_validate({**body.__dict__, **body.changed_by(key, new)})
    except ValidationError as error:
        wanted = f"must leave the inertia of `{body.name}` positive definite [{unit_of(path)}]"
        raise SettingError(path, new, wanted) from error


def _bodies(scene: HasBodies, owner: str, key: str) -> tuple[Body, ...]:
    return tuple(b for b in scene.bodies if owner in (b.name, b.group) and key in b.parameters)


def _loads(scene: HasBodies, owner: str) -> tuple[Load, ...]:
    return tuple(load for load in scene.loads if load.name == owner)
