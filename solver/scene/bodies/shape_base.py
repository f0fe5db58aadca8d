"""What the shapes of dampers and faces have in common: each yields contacts, and maybe rigid bodies."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar, Literal, NamedTuple

from pydantic import model_validator

from solver.contacts.fields import Friction, Name, Part, Positive, Signed, Vector
from solver.contacts.frames import dot, is_unit
from solver.scene.bodies.body import Body


class Spot(NamedTuple):
    """One point of a face: its name, what it joins, and its place; numbers may be symbols."""

    name: str
    between: tuple[str, str]
    at: tuple[Any, Any, Any]
    axes: tuple[tuple[Any, Any, Any], ...]


class Shape(Part):
    """What all shapes have.

    Attributes
    ----------
    name : str
        Name of the damper and of its body, in DOFs and parameter paths.
    at : (3,) tuple
        Position of the centre of mass; of a shroud, of the middle of its face [m].
    out : (3,) tuple
        Unit vector outward: along it the centrifugal load acts.
    axial : (3,) tuple
        Unit vector along the axis of rotation.
    law : str
        Contact law of every point.
    kt, kn : float
        Tangential and normal stiffness of a face [N/m], shared out over its points.
    mu : float
        Friction coefficient.
    N0 : float
        Preload of a face at rest [N], shared out over its points.
    """

    SHAPE: ClassVar[str]
    GEOMETRY: ClassVar[tuple[str, ...]]
    """Its parameters that the places of its contacts depend on."""
    FACE: ClassVar[tuple[str, ...]] = ("kt", "kn", "mu", "N0")
    """Its parameters that are those of its contacts."""
    SHARED: ClassVar[tuple[str, ...]] = ("kt", "kn", "N0")
    """Those that are shared out over the points of a face."""

    name: Name
    at: Vector = (0.0, 0.0, 0.0)
    out: Vector = (0.0, 1.0, 0.0)
    axial: Vector = (0.0, 0.0, 1.0)
    law: Literal["coulomb-3d", "elastic-normal"]
    kt: Positive
    kn: Positive
    mu: Friction
    N0: Signed = 0.0

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
            }
            for spot, share in zip(self.spots(self.geometry), self.shares, strict=True)
        ]  # fmt: skip

    @property
    def _settings(self) -> dict[str, Any]:
        return {}
