"""Where a contact in space is, and along which directions its law acts."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import AfterValidator, BeforeValidator, Field, PlainSerializer, WithJsonSchema, model_validator

from solver.contacts.fields import EndName, Part, Signed, Vector

TANGENT_1, TANGENT_2, NORMAL = 0, 1, 2
Axes = tuple[Vector, Vector, Vector]
_PERPENDICULAR = 0.01  # largest cosine between directions that are typed as perpendicular
_UNIT = 0.01  # a typed unit vector may be as far from length 1
_UNIT_SUM = 1e-6  # so may be the sum of typed weights
_ALONG_Z = 0.999  # a normal this near z has no horizontal tangent to speak of


def length(vector: tuple[float, ...]) -> float:
    """Length of a vector."""
    return math.sqrt(sum(value * value for value in vector))


def is_unit(vector: tuple[float, ...]) -> bool:
    """Whether a vector has length 1, but for the digits left out."""
    return abs(length(vector) - 1.0) <= _UNIT


def unit(vector: Vector) -> Vector:
    """The vector with length 1 exactly."""
    size = length(vector)
    x, y, z = (value / size for value in vector)
    return (x, y, z)


def dot(a: Vector, b: Vector) -> float:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def frame(normal: Vector, tangents: tuple[Vector, Vector] | None = None) -> Axes:
    """Both tangents and the normal of a contact, orthonormal to rounding.

    The tangents left to choose are z x n, which lies in the plane xy, and n times it (z where n lies in that
    plane itself); of a normal along z, the direction of x and that of y.

    Parameters
    ----------
    normal : unit vector from the first end to the second.
    tangents : two directions perpendicular to it and to each other.
    """
    n = unit(normal)
    if tangents is None:
        wanted = (1.0, 0.0, 0.0) if abs(n[2]) > _ALONG_Z else cross((0.0, 0.0, 1.0), n)
        second = cross(n, unit(wanted))
    else:
        wanted, second = tangents
    along = dot(n, wanted)
    first = unit((wanted[0] - along * n[0], wanted[1] - along * n[1], wanted[2] - along * n[2]))
    other = cross(n, first)
    return first, (other if dot(other, second) > 0.0 else (-other[0], -other[1], -other[2])), n


def _items(data: object) -> object:
    if isinstance(data, list | tuple):
        return tuple(tuple(one.items()) if isinstance(one, dict) else one for one in data)
    return data


def _tables(motions: tuple[tuple[tuple[str, float], ...], ...] | None) -> list[dict[str, float]] | None:
    return None if motions is None else [dict(motion) for motion in motions]


_Form = tuple[tuple[EndName, Signed], ...]
Motions = Annotated[
    tuple[_Form, ...],
    BeforeValidator(_items),
    PlainSerializer(_tables),
    WithJsonSchema(
        {
            "type": "array",
            "minItems": 1,
            "items": {"type": "object", "minProperties": 1, "additionalProperties": {"type": "number"}},
        }
    ),
]


def _pairs(data: object) -> object:
    return tuple(data.items()) if isinstance(data, dict) else data


def _summing_to_one(weights: _Form) -> _Form:
    total = sum(weight for _, weight in weights)
    if abs(total - 1.0) > _UNIT_SUM or any(end == "ground" for end, _ in weights):
        raise ValueError(f"`spread` must name nodes or bodies with weights that sum to 1, got {total:.9g}")
    return weights


Weights = Annotated[
    _Form,
    BeforeValidator(_pairs),
    AfterValidator(_summing_to_one),
    PlainSerializer(dict),
    WithJsonSchema({"type": "object", "minProperties": 1, "additionalProperties": {"type": "number"}}),
]


class InSpace(Part):
    """A contact between bodies and nodes at a place, with directions; or one with motions written out."""

    at: Annotated[Vector | None, "Position of the contact [m]."] = None
    normal: Annotated[
        Vector | None,
        "Unit vector from the first end to the second. With it, `between` names bodies or nodes, and the "
        "law acts along as many of the directions as it has: a friction law along the tangents, one that "
        "presses along the normal too.",
    ] = None
    tangents: Annotated[
        Literal["auto"] | tuple[Vector, Vector] | None,
        "Both tangents; chosen if left out: the first in the plane xy.",
    ] = None
    spread: Annotated[
        Weights | None,
        "In place of the second end: nodes or bodies with their weights, which sum to 1, as where meshes do "
        "not match. `between` then says what the contact joins, and no more.",
    ] = None
    motions: Annotated[
        Motions | None,
        "In place of these, each relative motion of the law as a sum of DOFs: factor [1, or m of a "
        "rotation] by the name of the DOF. `between` then says what the contact joins, and no more.",
    ] = Field(default=None)

    @model_validator(mode="after")
    def _complete(self) -> InSpace:
        given = [key for key in ("at", "normal", "tangents", "spread") if getattr(self, key) is not None]
        if self.motions is not None and given:
            raise ValueError(f"`motions` and `{given[0]}` of a contact exclude each other: give one")
        for key, needed in (("normal", "at"), ("at", "normal"), ("tangents", "normal"), ("spread", "normal")):
            if key in given and needed not in given:
                raise ValueError(f"`{key}` of a contact needs `{needed}` beside it")
        if self.normal is not None and not is_unit(self.normal):
            size = length(self.normal)
            hint = f"; divide it by {size:.6g}" if size > 0.0 else ""
            raise ValueError(
                f"`normal` must be a unit vector, got {list(self.normal)!r} of length {size:.4g}{hint}"
            )
        if self.normal is not None and isinstance(self.tangents, tuple):
            _check_tangents(self.normal, self.tangents)
        return self

    @property
    def axes(self) -> Axes | None:
        """Tangents and normal; None of a contact without a place."""
        if self.normal is None:
            return None
        return frame(self.normal, self.tangents if isinstance(self.tangents, tuple) else None)


def _check_tangents(normal: Vector, tangents: tuple[Vector, Vector]) -> None:
    for vector in tangents:
        if not is_unit(vector):
            raise ValueError(
                f"`tangents` must be unit vectors, got {list(vector)!r} of length {length(vector):.4g}"
            )
    first, second = tangents
    for a, b, what in ((normal, first, "normal"), (normal, second, "normal"), (first, second, "first one")):
        if abs(dot(a, b)) > _PERPENDICULAR:
            degrees = math.degrees(math.acos(max(-1.0, min(1.0, dot(a, b)))))
            raise ValueError(
                f"`tangents` must be perpendicular to each other and to `normal`, got {list(b)!r} at "
                f"{degrees:.1f} degrees from the {what}"
            )
