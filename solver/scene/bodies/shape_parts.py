"""Parameters of bodies, and dampers by their shape: what these yield, and their parameters."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache, lru_cache
from typing import TYPE_CHECKING, Any

from pydantic import TypeAdapter, ValidationError

from solver.contacts.fields import LARGEST
from solver.contacts.laws.contact_law import AnyContact
from solver.contacts.laws.coulomb_3d import SpaceContact
from solver.errors import SettingError
from solver.results.units import bound_said, doubt_said
from solver.scene.bodies.body import MOMENTS, REVOLUTIONS, Body
from solver.scene.bodies.body_shapes import POINTS, AnyShape, Shape
from solver.scene.bodies.kinematics import outward, placed_forms, spin_of, towards
from solver.scene.scene_parameter import ActsOn, Form, SceneParameter, Slope, Term, changed
from solver.scene.scene_records import ContactOfAnyLaw

if TYPE_CHECKING:
    from solver.scene.scene import Scene


SPEED = "speed"
FORCE = "force"
BODY_UNITS = {"mass": "kg", **dict.fromkeys(MOMENTS, "kg m^2"), "radius_of_rotation": "m"}


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


UNITS = {
    **dict.fromkeys(("angle", "curved_angle"), "rad"), **dict.fromkeys(("width", "length", "radius"), "m"),
    **{key: SpaceContact.PARAMETERS[key].unit for key in Shape.FACE}, POINTS: "", **BODY_UNITS,
}  # fmt: skip


@cache
def _reader() -> TypeAdapter[Any]:
    """Reads a contact; made when first used, because laws from outside import this package."""
    return TypeAdapter(ContactOfAnyLaw)


@lru_cache(maxsize=256)
def contacts_of(shape: AnyShape) -> tuple[AnyContact, ...]:
    """The contacts a shape yields."""
    return tuple(_reader().validate_python(table) for table in shape.contacts())


def with_shapes(scene: Scene) -> dict[str, Any]:
    """The bodies and contacts of a scene that has no parts of its shapes yet, and those of the shapes."""
    bodies = tuple(body for shape in scene.dampers for body in shape.bodies)
    contacts = tuple(contact for shape in scene.dampers for contact in contacts_of(shape))
    return {"bodies": (*scene.bodies, *bodies), "contacts": (*scene.contacts, *contacts)}


def own_parts(scene: Scene) -> dict[str, Any]:
    """The bodies and contacts of a scene that are not parts of its shapes."""
    made = {contact.name for shape in scene.dampers for contact in contacts_of(shape)}
    shapes = {shape.name for shape in scene.dampers}
    return {
        "bodies": tuple(body for body in scene.bodies if body.name not in shapes),
        "contacts": tuple(contact for contact in scene.contacts if contact.name not in made),
    }


def shape_paths(scene: Scene) -> tuple[str, ...]:
    """Every path of the shapes."""
    return tuple(f"{shape.name}.{key}" for shape in scene.dampers for key in shape.parameters)


def shape_parameter(scene: Scene, path: str) -> SceneParameter | None:
    """Return what a path of a shape is, if it is one: of its contacts, its body, or their places."""
    owner, _, key = path.rpartition(".")
    shape = next((each for each in scene.dampers if each.name == owner and key in each.parameters), None)
    if shape is None:
        return None
    own = hasattr(shape, key)

    def get() -> float:
        return float(getattr(shape, key)) if own else shape.bodies[0].value_of(key)

    whole = SceneParameter(
        get=get, with_value=lambda new: _with_shape(scene, shape, key, path, new),
        unit=UNITS[key], least=-math.inf if key in ("angle", "curved_angle", "N0") else 0.0,
        in_steps=key == POINTS,
    )  # fmt: skip
    if key in shape.FACE:
        # Each contact of a face has its share of its number.
        parts = shape.shares if key in shape.SHARED else (1.0,) * len(shape.shares)
        shares = {contact.name: part for contact, part in zip(contacts_of(shape), parts, strict=True)}
        mine = {i: shares[contact.name] for i, contact in enumerate(scene.contacts) if contact.name in shares}
        quantities = tuple(scene.contacts[i].PARAMETERS[key] for i in mine)
        first = quantities[0]
        return replace(
            whole, acts_on=ActsOn.CONTACTS, contacts=mine, quantities=quantities, unit=first.unit,
            least=first.least,
        )  # fmt: skip
    if key in shape.GEOMETRY:
        return replace(whole, moves_contacts=True, slope=lambda: Slope(motions=_moved(scene, shape, key)))
    body = body_parameter(scene, path)
    return whole if body is None else replace(whole, slope=body.slope, by_hand=body.by_hand)


def _with_shape(scene: Scene, shape: AnyShape, key: str, path: str, new: float) -> dict[str, Any]:
    """The fields of a scene that change where a number of a shape is set."""
    try:
        made = type(shape).model_validate({**shape.__dict__, **_update(shape, key, new)})
    except ValidationError as error:
        wanted = bound_said(error.errors()[0], UNITS[key])
        raise SettingError(path, new, wanted, doubt_said(new, UNITS[key])) from error
    dampers = tuple(made if each is shape else each for each in scene.dampers)
    own = own_parts(scene)
    bodies = (body for each in dampers for body in each.bodies)
    contacts = (contact for each in dampers for contact in contacts_of(each))
    return {
        "dampers": dampers, "bodies": (*own["bodies"], *bodies), "contacts": (*own["contacts"], *contacts),
    }  # fmt: skip


def _update(shape: AnyShape, key: str, new: float) -> dict[str, object]:
    if key == POINTS:
        return {key: int(new) if new == int(new) else new}
    return {key: new} if hasattr(shape, key) else shape.bodies[0].changed_by(key, new)


def _moved(scene: Scene, shape: AnyShape, key: str) -> dict[str, tuple[Form, ...]]:
    """Derivatives of the motions of each contact, by its name, by a number of the geometry.

    They are those of the very lines that give the motions, with a symbol for the parameter.
    """
    import casadi

    symbol = casadi.SX.sym(key)
    values = {**shape.geometry, key: symbol}

    def slope(factor: Any) -> float:
        derivative = casadi.jacobian(casadi.SX(factor), symbol)
        return float(casadi.Function("slope", [symbol], [derivative])(shape.geometry[key]))

    slopes: dict[str, tuple[Form, ...]] = {}
    for contact, spot in zip(contacts_of(shape), shape.spots(values), strict=True):
        directions = tuple(spot.axes[which] for which in contact.directions)
        forms = placed_forms(scene, contact.between, spot.at, directions)
        slopes[contact.name] = tuple(
            tuple(Term(t.dof, t.next, slope(t.factor)) for t in form) for form in forms
        )
    return slopes
