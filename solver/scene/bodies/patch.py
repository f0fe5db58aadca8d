"""A face that a finite-element mesh gives: pairs of nodes that lie on each other, each a contact."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from solver.contacts.fields import EndName, Part, Positive, Vector
from solver.contacts.frames import frame, is_unit
from solver.scene.bodies.shape_base import Shape, Spot

MOST_PAIRS = 1000


class PatchPoint(Part):
    """Two nodes of a patch that lie on each other, or a node and the ground.

    Attributes
    ----------
    between : (str, str)
        Nodes of the first and the second face.
    at : (3,) tuple
        Where they are [m].
    area : float
        Part of the face that belongs to them; in any unit, as only the share of it counts.
    """

    between: tuple[EndName, EndName]
    at: Vector
    area: Positive = 1.0


class Patch(Shape):
    """Two faces of finite-element meshes that lie on each other.

    Stiffness and preload of the face are shared out over its points by their areas: a pressure that is even
    over the face presses each point by its share. The parts were pressed together so when they were meshed:
    the preload does not deform them once more.

    Attributes
    ----------
    normal : (3,) tuple
        Unit vector across the face, from the first to the second.
    pairs : tuple of PatchPoint
        Its points.
    """

    SHAPE: ClassVar[str] = "patch"
    GEOMETRY: ClassVar[tuple[str, ...]] = ()

    shape: Literal["patch"]
    normal: Vector
    pairs: Annotated[tuple[PatchPoint, ...], Field(min_length=1, max_length=MOST_PAIRS)]

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
            yield Spot(f"{self.name}-{number}", pair.between, pair.at, axes)
