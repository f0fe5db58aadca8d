"""Scenes with dampers by their shape: what they yield, and their parameters."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache, lru_cache
from typing import TYPE_CHECKING, Any

from pydantic import TypeAdapter, ValidationError

from solver.contacts.laws.contact_law import AnyContact
from solver.contacts.laws.coulomb_3d import SpaceContact
from solver.errors import SettingError
from solver.scene.bodies.body_shapes import POINTS, AnyShape, Shape
from solver.scene.bodies.kinematics import placed_forms
from solver.scene.bodies.paths import BODY_UNITS, body_parameter
from solver.scene.scene_parameter import ActsOn, Form, SceneParameter, Slope, Term
from solver.scene.scene_records import ContactOfAnyLaw

if TYPE_CHECKING:
    from solver.scene.scene import Scene

_UNITS = {
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
        unit=_UNITS[key], least=-math.inf if key in ("angle", "curved_angle", "N0") else 0.0,
        in_steps=key == POINTS,
    )  # fmt: skip
    if key in shape.FACE:
        return _of_face(scene, shape, key, whole)
    if key in shape.GEOMETRY:
        return replace(whole, moves_contacts=True, slope=lambda: Slope(motions=_moved(scene, shape, key)))
    body = body_parameter(scene, path)
    return whole if body is None else replace(whole, slope=body.slope, by_hand=body.by_hand)


def _with_shape(scene: Scene, shape: AnyShape, key: str, path: str, new: float) -> dict[str, Any]:
    """The fields of a scene that change where a number of a shape is set."""
    try:
        made = type(shape).model_validate({**shape.__dict__, **_update(shape, key, new)})
    except ValidationError as error:
        wanted = str(error.errors()[0]["msg"]).lower()
        raise SettingError(path, new, f"{wanted} [{_UNITS[key]}]") from error
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


def _of_face(scene: Scene, shape: AnyShape, key: str, whole: SceneParameter) -> SceneParameter:
    """A number of a face, of which each of its contacts has its share."""
    parts = shape.shares if key in shape.SHARED else (1.0,) * len(shape.shares)
    shares = {contact.name: part for contact, part in zip(contacts_of(shape), parts, strict=True)}
    mine = {i: shares[contact.name] for i, contact in enumerate(scene.contacts) if contact.name in shares}
    quantities = tuple(scene.contacts[i].PARAMETERS[key] for i in mine)
    first = quantities[0]
    return replace(
        whole, acts_on=ActsOn.CONTACTS, contacts=mine, quantities=quantities, unit=first.unit,
        least=first.least,
    )  # fmt: skip


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
