"""Scenes with dampers by their shape: what they yield, their parameter paths, derivatives of motions."""

from __future__ import annotations

import math
from functools import cache, lru_cache
from typing import Any, Protocol

from pydantic import TypeAdapter, ValidationError

from solver.contacts.laws.base import AnyContact
from solver.errors import SettingError
from solver.scene.bodies.body import Body
from solver.scene.bodies.kinematics import Form, HasBodies, Term, placed_forms
from solver.scene.bodies.paths import UNITS as BODY_UNITS
from solver.scene.bodies.shapes import POINTS, AnyShape
from solver.scene.parts import ContactOfAnyLaw

_UNITS = {
    **dict.fromkeys(("angle", "curved_angle"), "rad"), **dict.fromkeys(("width", "length", "radius"), "m"),
    "kt": "N/m", "kn": "N/m", "mu": "", "N0": "N", POINTS: "", **BODY_UNITS,
}  # fmt: skip


class HasShapes(HasBodies, Protocol):
    """What a scene holds, as far as shapes go."""

    @property
    def dampers(self) -> tuple[AnyShape, ...]:
        """Every damper given by its shape."""


@cache
def _reader() -> TypeAdapter[Any]:
    """Reads a contact; made when first used, because laws from outside import this package."""
    return TypeAdapter(ContactOfAnyLaw)


@lru_cache(maxsize=256)
def contacts_of(shape: AnyShape) -> tuple[AnyContact, ...]:
    """The contacts a shape yields."""
    return tuple(_reader().validate_python(table) for table in shape.contacts())


def with_shapes(scene: HasShapes) -> dict[str, Any]:
    """The bodies and contacts of a scene that has no parts of its shapes yet, and those of the shapes."""
    bodies = tuple(body for shape in scene.dampers for body in shape.bodies)
    contacts = tuple(contact for shape in scene.dampers for contact in contacts_of(shape))
    return {"bodies": (*scene.bodies, *bodies), "contacts": (*scene.contacts, *contacts)}


def own_parts(scene: HasShapes) -> dict[str, Any]:
    """The bodies and contacts of a scene that are not parts of its shapes."""
    made = {contact.name for shape in scene.dampers for contact in contacts_of(shape)}
    shapes = {shape.name for shape in scene.dampers}
    return {
        "bodies": tuple(body for body in scene.bodies if body.name not in shapes),
        "contacts": tuple(contact for contact in scene.contacts if contact.name not in made),
    }


def shape_paths(scene: HasShapes) -> tuple[str, ...]:
    """Every path of the shapes."""
    return tuple(f"{shape.name}.{key}" for shape in scene.dampers for key in shape.parameters)


def shape_of(scene: HasShapes, path: str) -> tuple[AnyShape, str] | None:
    """The shape and key of a path, or None."""
    owner, _, key = path.rpartition(".")
    shape = next((each for each in scene.dampers if each.name == owner), None)
    return (shape, key) if shape is not None and key in shape.parameters else None


def shape_value(shape: AnyShape, key: str) -> float:
    """Value of a parameter of a shape."""
    return float(getattr(shape, key)) if hasattr(shape, key) else _body(shape).value_of(key)


def shape_unit(key: str) -> str:
    """Unit of a parameter of a shape."""
    return _UNITS[key]


def least_shape_value(key: str) -> float:
    """Smallest value that means something."""
    return -math.inf if key in ("angle", "curved_angle", "N0") else 0.0


def with_shape_value(scene: HasShapes, path: str, new: float) -> dict[str, Any]:
    """The fields of a scene that change where a path of a shape is set.

    Raises
    ------
    SettingError
        The value is out of its range.
    """
    found = shape_of(scene, path)
    if found is None:
        raise SettingError("path", path, "must be that of a shape")
    shape, key = found
    try:
        update = _update(shape, key, new)
        changed = type(shape).model_validate({**shape.__dict__, **update})
    except ValidationError as error:
        wanted = str(error.errors()[0]["msg"]).lower()
        raise SettingError(path, new, f"{wanted} [{shape_unit(key)}]") from error
    dampers = tuple(changed if each is shape else each for each in scene.dampers)
    own = own_parts(scene)
    bodies = tuple(body for each in dampers for body in each.bodies)
    contacts = tuple(contact for each in dampers for contact in contacts_of(each))
    return {
        "dampers": dampers,
        "bodies": (*own["bodies"], *bodies),
        "contacts": (*own["contacts"], *contacts),
    }


def _update(shape: AnyShape, key: str, new: float) -> dict[str, object]:
    if key == POINTS:
        return {key: int(new) if new == int(new) else new}
    if hasattr(shape, key):
        return {key: new}
    return _body(shape).changed_by(key, new)


def _body(shape: AnyShape) -> Body:
    return shape.bodies[0]


def contact_shares(scene: HasShapes, path: str) -> dict[str, float] | None:
    """Derivative of the number of each contact, by its name, by a path of a face; None of other paths."""
    found = shape_of(scene, path)
    if found is None or found[1] not in found[0].FACE:
        return None
    shape, key = found
    parts = shape.shares if key in shape.SHARED else (1.0,) * len(shape.shares)
    return {contact.name: part for contact, part in zip(contacts_of(shape), parts, strict=True)}


def moves_contacts(scene: HasShapes, path: str) -> bool:
    """Whether a path is of the geometry that places contacts; they are not continued in it."""
    found = shape_of(scene, path)
    return found is not None and found[1] in found[0].GEOMETRY


def motion_derivatives(scene: HasShapes, path: str) -> dict[str, tuple[Form, ...]] | None:
    """Derivatives of the motions of each contact, by its name, by a path of the geometry; None of others.

    They are those of the very lines that give the motions, with a symbol for the parameter.
    """
    found = shape_of(scene, path)
    if found is None or not moves_contacts(scene, path):
        return None
    import casadi

    shape, key = found
    symbol = casadi.SX.sym(key)
    values = {**shape.geometry, key: symbol}

    def slope(factor: Any) -> float:
        derivative = casadi.jacobian(casadi.SX(factor), symbol)
        return float(casadi.Function("slope", [symbol], [derivative])(shape_value(shape, key)))

    slopes: dict[str, tuple[Form, ...]] = {}
    for contact, spot in zip(contacts_of(shape), shape.spots(values), strict=True):
        directions = tuple(spot.axes[which] for which in contact.directions)
        forms = placed_forms(scene, contact.between, spot.at, directions)
        slopes[contact.name] = tuple(
            tuple(Term(t.dof, t.next, slope(t.factor)) for t in form) for form in forms
        )
    return slopes
