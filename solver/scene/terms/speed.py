"""What depends on the speed of rotation: normal loads and forces, and the speed along an engine-order line.

Along a line the speed follows the frequency, speed [1/min] = 60 f / order, so that a sweep over the frequency
is one over the speed. `Scene.at_frequency` is the scene at one point of it.
"""

from __future__ import annotations

from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, model_validator

from solver.contacts.fields import NonNegative, Part, Signed

Coefficients = Annotated[tuple[Signed, ...], Field(min_length=1, max_length=3)]
Table = Annotated[tuple[tuple[NonNegative, Signed], ...], Field(min_length=2, max_length=3)]


class SpeedDependence(Part):
    """A parameter that follows the speed of rotation.

    Attributes
    ----------
    path : str
        ``<contact>.N0`` (or of a group), or ``excitation.amplitude``.
    polynomial : tuple of float or None
        c0, c1, c2 of c0 + c1 speed + c2 speed², the speed in 1/min; or
    table : tuple of (float, float) or None
        two or three rows [speed in 1/min, value], through which the polynomial of least degree goes.
    """

    path: str
    polynomial: Coefficients | None = None
    table: Table | None = None

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if (self.polynomial is None) == (self.table is None):
            given = "neither" if self.table is None else "both"
            raise ValueError(f"`with_speed` needs `polynomial` or `table`, one of them, got {given}")
        if self.table is not None and len({speed for speed, _ in self.table}) < len(self.table):
            raise ValueError(f"`table` must have different speeds, got {[row[0] for row in self.table]}")
        return self

    @property
    def coefficients(self) -> tuple[float, float, float]:
        """c0, c1, c2 by powers of the speed in 1/min."""
        if self.polynomial is not None:
            c0, c1, c2 = (*self.polynomial, 0.0, 0.0)[:3]
            return c0, c1, c2
        speeds, values = np.array(self.table).T
        scale = float(speeds.max())
        found = np.linalg.solve(np.vander(speeds / scale, increasing=True), values)
        c0, c1, c2 = (*(found / scale ** np.arange(found.size)).tolist(), 0.0)[:3]
        return c0, c1, c2

    def at(self, speed: float) -> float:
        """Value at a speed [1/min]."""
        c0, c1, c2 = self.coefficients
        return c0 + speed * (c1 + speed * c2)


def at_speed(scene: Any, speed: float) -> Any:
    """Return a scene (with `speed`, `with_speed` and `with_values`) at a speed [1/min], all that follows set.

    Raises
    ------
    SettingError
        A value that a parameter must not have.
    """
    there = scene.model_copy(update={"speed": float(speed), "speed_order": None, "with_speed": ()})
    values = there.with_values({each.path: each.at(speed) for each in scene.with_speed})
    return values.model_copy(update={"with_speed": scene.with_speed})
