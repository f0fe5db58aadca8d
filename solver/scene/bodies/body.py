"""Rigid bodies, positions of nodes and constant loads: what a scene in space has beside its structure."""

from __future__ import annotations

import math
from typing import Annotated, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, PlainSerializer, WithJsonSchema, field_validator, model_validator

from solver.contacts.fields import DofName, MemberName, Name, NonNegative, Part, Positive, Signed, Vector
from solver.contacts.frames import is_unit, length

COMPONENTS = ("x", "y", "z", "rx", "ry", "rz")
PLANE = ("x", "y", "rz")
REVOLUTIONS = math.pi / 30.0  # rad/s of one revolution a minute
MOMENTS = ("Ixx", "Iyy", "Izz")

Row = tuple[Signed, Signed, Signed]
Component = Literal["x", "y", "z", "rx", "ry", "rz"]


class Place(NamedTuple):
    """Something with a position: a body or a node.

    Attributes
    ----------
    at : position of its point [m].
    dofs : the DOF of each component of the motion of that point, and of the rotation about it.
    """

    at: Vector
    dofs: tuple[tuple[str, str], ...]


def body_dofs(name: str, plane: object) -> tuple[str, ...]:
    """Names of the degrees of freedom of a body; of ``damper@3``, in an annulus, ``damper.x@3`` …"""
    base, at, sector = name.partition("@")
    return tuple(f"{base}.{component}{at}{sector}" for component in (COMPONENTS if plane is None else PLANE))


class Body(Part):
    """A rigid body, whose DOFs ``<name>.x`` … ``<name>.rz`` are its motions at the centre of mass."""

    name: Annotated[MemberName, "Name in `between` of contacts, in DOFs and in parameter paths."]
    mass: Annotated[Positive, "Mass [kg]."]
    inertia: Annotated[
        Positive | tuple[Positive, Positive, Positive] | tuple[Row, Row, Row],
        "Moments of inertia at the centre of mass [kg m²]: the principal ones along x, y, z, or the "
        "tensor; one number, about z, for a body in the plane.",
    ]
    at: Annotated[Vector, "Position of the centre of mass [m]."] = (0.0, 0.0, 0.0)
    plane: Annotated[
        Literal["xy"] | None, "A body in this plane moves along x and y and turns about z: three DOFs."
    ] = None
    radius_of_rotation: Annotated[
        NonNegative | None,
        "Distance of the centre of mass from the axis of rotation [m]: at a `speed` the body is loaded by "
        "mass * radius * speed² along `out`.",
    ] = None
    out: Annotated[Vector | None, "Unit vector of that load."] = None
    group: Annotated[Name | None, "A name that sets several bodies at once in parameter paths."] = None

    @field_validator("out")
    @classmethod
    def _out_is_a_unit_vector(cls, out: Vector | None) -> Vector | None:
        if out is not None and not is_unit(out):
            raise ValueError(f"`out` must be a unit vector, got {list(out)!r} of length {length(out):.4g}")
        return out

    @model_validator(mode="after")
    def _consistent(self) -> Body:
        if (self.radius_of_rotation is None) != (self.out is None):
            given, missing = ("out", "radius_of_rotation") if self.out else ("radius_of_rotation", "out")
            raise ValueError(f"`{given}` of body `{self.name}` needs `{missing}` beside it")
        if self.plane is None and isinstance(self.inertia, float):
            raise ValueError(
                f"`inertia` of body `{self.name}` must be three moments or a 3 x 3 tensor, "
                f"got {self.inertia!r}: one number is for a body in a `plane`"
            )
        tensor = self.tensor
        if not np.array_equal(tensor, tensor.T) or np.linalg.eigvalsh(tensor).min() <= 0.0:
            raise ValueError(
                f"`inertia` of body `{self.name}` must be symmetric and positive definite, "
                f"got {self.inertia!r}"
            )
        return self

    @property
    def tensor(self) -> NDArray[np.float64]:
        """Inertia at the centre of mass, (3, 3) [kg m²]."""
        if isinstance(self.inertia, float):
            return np.eye(3) * self.inertia
        return np.diag(self.inertia) if isinstance(self.inertia[0], float) else np.array(self.inertia)

    @property
    def components(self) -> tuple[str, ...]:
        """Its motions: all six, or three in a plane."""
        return COMPONENTS if self.plane is None else PLANE

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of its degrees of freedom."""
        return body_dofs(self.name, self.plane)

    @property
    def place(self) -> Place:
        """Position and DOFs."""
        return Place(self.at, tuple(zip(self.components, self.dofs, strict=True)))

    @property
    def parameters(self) -> tuple[str, ...]:
        """Its numbers that are parameter paths."""
        moments = MOMENTS if self.plane is None else MOMENTS[2:]
        radius = () if self.radius_of_rotation is None else ("radius_of_rotation",)
        return ("mass", *moments, *radius)

    def mass_matrix(self) -> NDArray[np.float64]:
        """Mass matrix of its DOFs [kg], [kg m²]."""
        matrix = np.zeros((6, 6))
        matrix[:3, :3], matrix[3:, 3:] = np.eye(3) * self.mass, self.tensor
        kept = [COMPONENTS.index(component) for component in self.components]
        return matrix[np.ix_(kept, kept)]

    def mass_derivative(self, key: str) -> NDArray[np.float64]:
        """Derivative of the mass matrix by one of `parameters`."""
        which = COMPONENTS[:3] if key == "mass" else [f"r{axis}" for axis in "xyz" if key == f"I{axis}{axis}"]
        return np.diag([1.0 if component in which else 0.0 for component in self.components])

    def value_of(self, key: str) -> float:
        """Value of one of `parameters`."""
        if key in MOMENTS:
            return float(self.tensor[MOMENTS.index(key), MOMENTS.index(key)])
        value: float = getattr(self, key)
        return value

    def changed_by(self, key: str, new: float) -> dict[str, object]:
        """The fields that change where one of `parameters` is set."""
        if key not in MOMENTS:
            return {key: new}
        if isinstance(self.inertia, float):
            return {"inertia": new}
        i, rows = MOMENTS.index(key), list(self.inertia)
        if isinstance(rows[i], float):
            rows[i] = new
        else:
            row = list(self.tensor[i])
            row[i] = new
            rows[i] = tuple(row)
        return {"inertia": tuple(rows)}


def _pairs(data: object) -> object:
    return tuple(data.items()) if isinstance(data, dict) else data


NodeDofs = Annotated[
    tuple[tuple[Component, MemberName], ...],
    Field(min_length=1),
    BeforeValidator(_pairs),
    PlainSerializer(dict),
    WithJsonSchema(
        {
            "type": "object",
            "minProperties": 1,
            "additionalProperties": False,
            "properties": {component: {"type": "string"} for component in COMPONENTS},
        }
    ),
]


class Node(Part):
    """A position in the structure, and the DOFs that move it: a lumped mass, or a node of a matrix model."""

    name: Annotated[MemberName, "Name in `between` of contacts."]
    at: Annotated[Vector, "Position [m]."]
    dofs: Annotated[
        NodeDofs,
        "DOF of each component of its motion: x, y, z, and rx, ry, rz if it turns. It does not move along "
        "components that are left out.",
    ]

    @property
    def place(self) -> Place:
        """Position and DOFs."""
        return Place(self.at, self.dofs)


class Load(Part):
    """A constant force, on a DOF or on a body or node."""

    name: Annotated[MemberName | None, "Makes it a parameter ``<name>.force``."] = None
    dof: Annotated[DofName | None, "The DOF it acts on; or"] = None
    on: Annotated[MemberName | None, "the body or node it acts on, at its centre of mass or position."] = None
    direction: Annotated[Vector | None, "Unit vector of the force on a body or node."] = None
    force: Annotated[Signed, "Force [N]."]

    @model_validator(mode="after")
    def _one_place(self) -> Load:
        if (self.dof is None) == (self.on is None):
            raise ValueError(f"a load needs `dof` or `on`, one of them, got {self.dof!r} and {self.on!r}")
        if (self.on is None) != (self.direction is None):
            raise ValueError("`direction` of a load goes with `on`: the force on a DOF is along the DOF")
        if self.direction is not None and not is_unit(self.direction):
            size = length(self.direction)
            raise ValueError(
                f"`direction` must be a unit vector, got {list(self.direction)!r} of length {size:.4g}"
            )
        return self
