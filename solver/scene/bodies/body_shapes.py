"""Dampers by their shape: each yields contacts of its faces, or of a meshed face, and maybe a rigid body.

Directions are those of the damper: `out` (radially outward), `axial`, and across, out x axial, from the left
platform to the right one. A face that is inclined by an angle a has the normal cos(a) out ± sin(a) across, so
that the centrifugal load presses it on; without friction the faces of a symmetric damper carry
N = load / (2 cos a) each. Stiffness and preload of a face are shared out evenly over its points.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Self

from pydantic import Field, ValidationError, model_validator

from solver.contacts.fields import EndName, Friction, Name, NonNegative, Part, Positive, Signed, Vector
from solver.contacts.frames import Weights, cross, dot, frame, is_unit, unit
from solver.scene.bodies.body import Body, Row


class Spot(NamedTuple):
    """One point of a face: its name, what it joins, and its place; numbers may be symbols."""

    name: str
    between: tuple[str, str]
    at: tuple[Any, Any, Any]
    axes: tuple[tuple[Any, Any, Any], ...]
    spread: dict[str, float] | None = None


class Shape(Part):
    """What all shapes have."""

    SHAPE: ClassVar[str]
    GEOMETRY: ClassVar[tuple[str, ...]]
    """Its parameters that the places of its contacts depend on."""
    FACE: ClassVar[tuple[str, ...]] = ("kt", "kn", "mu", "N0")
    """Its parameters that are those of its contacts."""
    SHARED: ClassVar[tuple[str, ...]] = ("kt", "kn", "N0")
    """Those that are shared out over the points of a face."""

    name: Annotated[Name, "Name of the damper and of its body, in DOFs and parameter paths."]
    at: Annotated[Vector, "Position of the centre of mass; of a shroud, of the middle of its face [m]."] = (
        0.0,
        0.0,
        0.0,
    )
    out: Annotated[Vector, "Unit vector outward: along it the centrifugal load acts."] = (0.0, 1.0, 0.0)
    axial: Annotated[Vector, "Unit vector along the axis of rotation."] = (0.0, 0.0, 1.0)
    law: Annotated[Literal["coulomb-3d", "elastic-normal"], "Contact law of every point."]
    kt: Annotated[Positive, "Tangential and normal stiffness of a face [N/m], shared out over its points."]
    kn: Annotated[Positive, "Tangential and normal stiffness of a face [N/m], shared out over its points."]
    mu: Annotated[Friction, "Friction coefficient."]
    N0: Annotated[Signed, "Preload of a face at rest [N], shared out over its points."] = 0.0

    @model_validator(mode="after")
    def _directions(self) -> Shape:
        for key in ("out", "axial"):
            if not is_unit(getattr(self, key)):
                raise ValueError(f"`{key}` must be a unit vector, got {list(getattr(self, key))!r}")
        if abs(dot(self.out, self.axial)) > 1e-2:
            raise ValueError(f"`axial` must be perpendicular to `out`, got {list(self.axial)!r}")
        return self

    @abstractmethod
    def spots(self, values: Mapping[str, Any]) -> Iterator[Spot]:
        """The points of every face, with `values` for the parameters of `GEOMETRY`."""

    @property
    def geometry(self) -> dict[str, float]:
        """The values of `GEOMETRY` as they are."""
        return {key: float(getattr(self, key)) for key in self.GEOMETRY}

    @property
    def bodies(self) -> tuple[Body, ...]:
        """Its rigid bodies."""
        return ()

    @property
    def parameters(self) -> tuple[str, ...]:
        """Its numbers that are parameter paths."""
        return (*self.GEOMETRY, *self.FACE)

    @property
    @abstractmethod
    def shares(self) -> tuple[float, ...]:
        """The part of its face that each of its contacts has; those of a face sum to 1."""

    def contacts(self) -> list[dict[str, Any]]:
        """Its contacts, as tables of a scene."""
        return [
            {
                "name": spot.name, "group": f"{self.name}-faces", "law": self.law,
                "between": list(spot.between), "at": list(spot.at), "normal": list(spot.axes[2]),
                "tangents": [list(axis) for axis in spot.axes[:2]], "mu": self.mu,
                **{key: getattr(self, key) * share for key in self.SHARED}, **self._settings,
                **({} if spot.spread is None else {"spread": spot.spread}),
            }
            for spot, share in zip(self.spots(self.geometry), self.shares, strict=True)
        ]  # fmt: skip

    @property
    def _settings(self) -> dict[str, Any]:
        return {}


MOST_PAIRS = 1000


class PatchPoint(Part):
    """Two nodes of a patch that lie on each other, a node and the ground, or a node on a mesh of others."""

    between: Annotated[tuple[EndName, EndName], "Nodes of the first and the second face."]
    at: Annotated[Vector, "Where they are [m]."]
    spread: Annotated[
        Weights | None, "In place of the second node: nodes of the second face with weights that sum to 1."
    ] = None
    area: Annotated[
        Positive, "Part of the face that belongs to them; in any unit, as only the share of it counts."
    ] = 1.0


class Patch(Shape):
    """Two faces of finite-element meshes that lie on each other.

    Stiffness and preload of the face are shared out over its points by their areas: a pressure that is even
    over the face presses each point by its share. The parts were pressed together so when they were meshed:
    the preload does not deform them once more.
    """

    SHAPE: ClassVar[str] = "patch"
    GEOMETRY: ClassVar[tuple[str, ...]] = ()

    shape: Literal["patch"]
    normal: Annotated[Vector, "Unit vector across the face, from the first to the second."]
    pairs: Annotated[tuple[PatchPoint, ...], Field(min_length=1, max_length=MOST_PAIRS), "Its points."]

    @model_validator(mode="after")
    def _across(self) -> Self:
        if not is_unit(self.normal):
            raise ValueError(f"`normal` must be a unit vector, got {list(self.normal)!r}")
        return self

    @property
    def shares(self) -> tuple[float, ...]:
        """The part of the face that each of its contacts has."""
        whole = sum(pair.area for pair in self.pairs)
        return tuple(pair.area / whole for pair in self.pairs)

    @property
    def _settings(self) -> dict[str, Any]:
        return {"prestressed": True}

    def spots(self, _values: Mapping[str, Any]) -> Iterator[Spot]:
        """Its points; no number moves them."""
        axes = frame(self.normal)
        for number, pair in enumerate(self.pairs):
            spread = None if pair.spread is None else dict(pair.spread)
            yield Spot(f"{self.name}-{number}", pair.between, pair.at, axes, spread)


MOST_POINTS = 100
POINTS = "points"
Points = Annotated[int, Field(strict=True, ge=1, le=MOST_POINTS)]
Inclination = Annotated[float, Field(strict=True, gt=-1.5, lt=1.5, allow_inf_nan=False)]


def _cosine_and_sine(angle: Any) -> tuple[Any, Any]:
    if isinstance(angle, float):
        return math.cos(angle), math.sin(angle)
    import casadi  # for derivatives alone

    return casadi.cos(angle), casadi.sin(angle)


def _spread(points: int) -> list[float]:
    """Middles of equal parts of a length 1 about 0."""
    return [(i + 0.5) / points - 0.5 for i in range(points)]


class _Faced(Shape):
    """A shape with faces of its own, over which points are spread."""

    points: Annotated[Points, "Points of a face."] = 1

    @property
    def parameters(self) -> tuple[str, ...]:
        """Its numbers that are parameter paths."""
        return (*super().parameters, POINTS)

    @property
    def shares(self) -> tuple[float, ...]:
        """The part of its face that each of its contacts has."""
        return (1.0 / self.points,) * sum(1 for _ in self.spots(self.geometry))

    def _placed(self, across: Any, outward: Any, axial: Any) -> tuple[Any, Any, Any]:
        """A vector of the damper's directions in those of the scene."""
        o, a = unit(self.out), unit(self.axial)
        x = cross(o, a)
        return (
            across * x[0] + outward * o[0] + axial * a[0],
            across * x[1] + outward * o[1] + axial * a[1],
            across * x[2] + outward * o[2] + axial * a[2],
        )

    def _spot(
        self, name: str, between: tuple[str, str], at: tuple[Any, Any, Any], side: float, angle: Any
    ) -> Spot:
        """A point at a place from `at`, on a face of one side (-1 left, 1 right) inclined by an angle."""
        c, s = _cosine_and_sine(angle)
        offset = self._placed(*at)
        here = (self.at[0] + offset[0], self.at[1] + offset[1], self.at[2] + offset[2])
        axes = (
            self._placed(c, -side * s, 0.0),
            self._placed(0.0, 0.0, -1.0 * side),
            self._placed(side * s, c, 0.0),
        )
        return Spot(name, between, here, axes)


class _Underplatform(_Faced):
    """A body between two platforms, pressed on them by rotation."""

    between: Annotated[tuple[EndName, EndName], "Nodes of the left and the right platform."]
    mass: Annotated[Positive, "Mass [kg]."]
    inertia: Annotated[Positive | tuple[Positive, Positive, Positive] | tuple[Row, Row, Row], "As of a body."]
    plane: Annotated[Literal["xy"] | None, "As of a body."] = None
    radius_of_rotation: Annotated[
        NonNegative, "Distance of the centre of mass from the axis of rotation [m]."
    ]

    @model_validator(mode="after")
    def _whose_body_is_one(self) -> Self:
        try:
            _ = self.bodies
        except ValidationError as error:
            raise ValueError(str(error.errors()[0]["ctx"]["error"])) from error
        return self

    @property
    def bodies(self) -> tuple[Body, ...]:
        """Its rigid body."""
        return (
            Body(
                name=self.name, mass=self.mass, inertia=self.inertia, at=self.at, plane=self.plane,
                radius_of_rotation=self.radius_of_rotation, out=self.out,
            ),
        )  # fmt: skip

    @property
    def parameters(self) -> tuple[str, ...]:
        """Its numbers that are parameter paths."""
        return (*super().parameters, *self.bodies[0].parameters)

    def _flat(self, side: float, angle: Any, width: Any, length: Any) -> Iterator[Spot]:
        """Points down a flat face whose middle is half the width to one side."""
        name, c_s = ("left", "right")[side > 0], _cosine_and_sine(angle)
        for i, share in enumerate(_spread(self.points)):
            along = length * share
            place = (side * 0.5 * width + along * c_s[0], -side * along * c_s[1], 0.0)
            yield self._spot(f"{self.name}-{name}-{i}", self._ends(side), place, side, angle)

    def _line(self, side: float, angle: Any, radius: Any, length: Any) -> Iterator[Spot]:
        """Points along the line on which a cylinder touches a face."""
        name, (c, s) = ("left", "right")[side > 0], _cosine_and_sine(angle)
        for i, share in enumerate(_spread(self.points)):
            place = (side * radius * s, radius * c, length * share)
            yield self._spot(f"{self.name}-{name}-{i}", self._ends(side), place, side, angle)

    def _ends(self, side: float) -> tuple[str, str]:
        return (self.name, self.between[1] if side > 0 else self.between[0])


class Wedge(_Underplatform):
    """A wedge with two flat faces."""

    SHAPE: ClassVar[str] = "wedge"
    GEOMETRY: ClassVar[tuple[str, ...]] = ("angle", "width", "length")

    shape: Literal["wedge"]
    angle: Annotated[Inclination, "Inclination of both faces [rad]."]
    width: Annotated[Positive, "Distance between the middles of the faces [m]."]
    length: Annotated[NonNegative, "Length of a face, down which its points lie [m]."] = 0.0

    def spots(self, values: Mapping[str, Any]) -> Iterator[Spot]:
        """The points of both faces."""
        for side in (-1.0, 1.0):
            yield from self._flat(side, values["angle"], values["width"], values["length"])


class Cylinder(_Underplatform):
    """A cylinder that touches both platforms along lines."""

    SHAPE: ClassVar[str] = "cylinder"
    GEOMETRY: ClassVar[tuple[str, ...]] = ("angle", "radius", "length")

    shape: Literal["cylinder"]
    angle: Annotated[Inclination, "Inclination of both platforms [rad]."]
    radius: Annotated[Positive, "Radius [m]."]
    length: Annotated[NonNegative, "Length of the lines, along which the points lie [m]."] = 0.0

    def spots(self, values: Mapping[str, Any]) -> Iterator[Spot]:
        """The points of both lines."""
        for side in (-1.0, 1.0):
            yield from self._line(side, values["angle"], values["radius"], values["length"])


class Asymmetric(_Underplatform):
    """A damper with a flat face on the left and a curved one on the right."""

    SHAPE: ClassVar[str] = "asymmetric"
    GEOMETRY: ClassVar[tuple[str, ...]] = ("angle", "curved_angle", "width", "radius", "length")

    shape: Literal["asymmetric"]
    angle: Annotated[
        Inclination, "Inclination of the flat face and of the platform under the curved one [rad]."
    ]
    curved_angle: Annotated[
        Inclination, "Inclination of the flat face and of the platform under the curved one [rad]."
    ]
    width: Annotated[
        Positive, "Twice the distance of the middle of the flat face from the centre of mass [m]."
    ]
    radius: Annotated[Positive, "Radius of the curved face about the centre of mass [m]."]
    length: Annotated[NonNegative, "Length of both faces, along which their points lie [m]."] = 0.0

    def spots(self, values: Mapping[str, Any]) -> Iterator[Spot]:
        """The points of the flat face and of the curved one."""
        yield from self._flat(-1.0, values["angle"], values["width"], values["length"])
        yield from self._line(1.0, values["curved_angle"], values["radius"], values["length"])


class SplitRing(_Underplatform):
    """The part of a split ring that belongs to a sector, pressed on the rim from within by rotation.

    `between` are the nodes of the rim on the left and on the right half of the face: the same, or that of the
    next sector.
    """

    SHAPE: ClassVar[str] = "split-ring"
    GEOMETRY: ClassVar[tuple[str, ...]] = ("width",)

    shape: Literal["split-ring"]
    width: Annotated[Positive, "Length of the face around the rim [m]."]

    def spots(self, values: Mapping[str, Any]) -> Iterator[Spot]:
        """The points of both halves of the face."""
        for side in (-1.0, 1.0):
            yield from self._flat(side, 0.0, 0.5 * values["width"], 0.5 * values["width"])


class Shroud(_Faced):
    """The faces with which the shrouds of two blades touch, pressed on each other by their twist."""

    SHAPE: ClassVar[str] = "shroud"
    GEOMETRY: ClassVar[tuple[str, ...]] = ("angle", "length")

    shape: Literal["shroud"]
    between: Annotated[tuple[EndName, EndName], "Nodes of both shrouds."]
    angle: Annotated[
        Inclination,
        "Angle of the normal of the face against the circumferential direction, about `out` [rad].",
    ]
    length: Annotated[NonNegative, "Length of the face, along which its points lie [m]."] = 0.0

    def spots(self, values: Mapping[str, Any]) -> Iterator[Spot]:
        """The points of the face."""
        c, s = _cosine_and_sine(values["angle"])
        axes = (self._placed(-s, 0.0, c), self._placed(0.0, 1.0, 0.0), self._placed(c, 0.0, s))
        for i, share in enumerate(_spread(self.points)):
            along = values["length"] * share
            here = tuple(self.at[k] + along * axes[0][k] for k in range(3))
            yield Spot(f"{self.name}-{i}", self.between, (here[0], here[1], here[2]), axes)

    @property
    def _settings(self) -> dict[str, Any]:
        return {"prestressed": True}


AnyShape = Annotated[Wedge | Cylinder | Asymmetric | SplitRing | Shroud | Patch, Field(discriminator="shape")]
SHAPES: dict[str, type[Shape]] = {
    each.SHAPE: each for each in (Wedge, Cylinder, Asymmetric, SplitRing, Shroud, Patch)
}
WITH_BODY = tuple(word for word, each in SHAPES.items() if issubclass(each, _Underplatform))
"""The shapes that are bodies."""
