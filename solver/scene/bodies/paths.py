"""Parameters of bodies, loads and the speed: ``damper.mass``, ``pull.force``, ``speed``."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from solver.contacts.fields import LARGEST
from solver.errors import SettingError
from solver.scene.bodies.body import MOMENTS, REVOLUTIONS, Body
from solver.scene.bodies.kinematics import outward, spin_of, towards
from solver.scene.scene_parameter import SceneParameter, Slope, changed

if TYPE_CHECKING:
    from solver.scene.scene import Scene

SPEED = "speed"
FORCE = "force"
BODY_UNITS = {
    "mass": "kg", **dict.fromkeys(MOMENTS, "kg m^2"), "radius_of_rotation": "m",
}  # fmt: skip


def body_paths(scene: Scene) -> tuple[str, ...]:
    """Return every path of bodies and their groups."""
    grouped = dict.fromkeys(f"{b.group}.{key}" for b in scene.bodies if b.group for key in b.parameters)
    return (*grouped, *(f"{body.name}.{key}" for body in scene.bodies for key in body.parameters))


def body_parameter(scene: Scene, path: str) -> SceneParameter | None:
    """Return what a path of a body or of a group of them is, if it is one."""
    owner, _, key = path.rpartition(".")
    members = [b for b in scene.bodies if owner in (b.name, b.group) and key in b.parameters]
    if not members:
        return None
    unit = BODY_UNITS[key]

    def with_value(new: float) -> dict[str, Any]:
        _check(path, new, unit, positive=key == "mass")
        bodies = tuple(set_in(b, path, key, new, unit) if b in members else b for b in scene.bodies)
        return {"bodies": bodies}

    return SceneParameter(
        get=lambda: members[0].value_of(key), with_value=with_value, unit=unit,
        slope=lambda: _slope(scene, members, key), by_hand=key not in MOMENTS,
    )  # fmt: skip


def set_in(body: Body, path: str, key: str, new: float, unit: str) -> Body:
    """Return a body with another value of one of its parameters."""
    wanted = f"must leave the inertia of `{body.name}` positive definite [{unit}]"
    return changed(body, body.changed_by(key, new), path, new, wanted)


def _slope(scene: Scene, members: list[Body], key: str) -> Slope:
    """Return what it adds: inertia, and the load of rotation m r Ω²."""
    if key in MOMENTS:
        return Slope(masses={body.name: body.mass_derivative(key) for body in members})
    square, forces = spin_of(scene) ** 2, []
    for body in members:
        forces += outward(body, square * (body.mass if key != "mass" else body.radius_of_rotation or 0.0))
    masses = {body.name: body.mass_derivative(key) for body in members} if key == "mass" else {}
    return Slope(masses=masses, forces=tuple(forces))


def load_paths(scene: Scene) -> tuple[str, ...]:
    """Return the paths of named loads."""
    return tuple(f"{load.name}.{FORCE}" for load in scene.loads if load.name is not None)


def load_parameter(scene: Scene, path: str) -> SceneParameter | None:
    """Return what a path of a load is, if it is one."""
    owner, _, key = path.rpartition(".")
    load = next((each for each in scene.loads if owner and each.name == owner and key == FORCE), None)
    if load is None:
        return None

    def with_value(new: float) -> dict[str, Any]:
        if not -LARGEST <= new <= LARGEST:
            raise SettingError(path, new, "must be a number from -1e15 to 1e15 [N]")
        return {"loads": tuple(x.model_copy(update={FORCE: new}) if x is load else x for x in scene.loads)}

    return SceneParameter(
        get=lambda: load.force, with_value=with_value, unit="N", least=-math.inf,
        slope=lambda: Slope(forces=tuple(towards(scene, load, 1.0))),
    )  # fmt: skip


def speed_paths(scene: Scene) -> tuple[str, ...]:
    """Return the speed of a scene that has one."""
    return () if scene.speed is None else (SPEED,)


def speed_parameter(scene: Scene, path: str) -> SceneParameter | None:
    """Return what the speed is, if the path is that of a scene that has one."""
    if path != SPEED or scene.speed is None:
        return None
    speed = scene.speed

    def with_value(new: float) -> dict[str, Any]:
        _check(path, new, "1/min")
        return {SPEED: new}

    def slope() -> Slope:
        first, second = list[tuple[str, float]](), list[tuple[str, float]]()
        for body in scene.bodies:
            twice = 2.0 * body.mass * (body.radius_of_rotation or 0.0) * REVOLUTIONS
            first += outward(body, twice * spin_of(scene))
            second += outward(body, twice * REVOLUTIONS)
        return Slope(forces=tuple(first), second_forces=tuple(second), speed=True)

    return SceneParameter(get=lambda: speed, with_value=with_value, unit="1/min", slope=slope)


def _check(path: str, new: float, unit: str, *, positive: bool = False) -> None:
    if not 0.0 <= new <= LARGEST or (positive and new == 0.0):
        raise SettingError(path, new, f"must be a number {'>' if positive else '>='} 0 and <= 1e15 [{unit}]")
