"""Blades whose shrouds touch."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar

from pydantic import Field

from solver.scene.templates.template import DiskTemplate, Size, Word


class ShroudContact(DiskTemplate):
    """Blades whose shrouds touch their neighbours', pressed together by their twist.

    Attributes
    ----------
    angle : float
        Angle of the normal of the faces against the direction around the disk; 0: they press and do not rub
        [rad].
    normal_load : float or None
        Normal load of a face at rest [N]. Left out: friction of the size of the force.
    """

    NAME: ClassVar[str] = "shroud"
    TITLE: ClassVar[str] = "Shrouds that touch"

    name: Word = "my-shroud"
    angle: Annotated[float, Field(strict=True, ge=0.0, le=1.4)] = 1.1
    radius: Size = 0.5
    normal_load: Size | None = None

    @property
    def stiffening(self) -> float:
        """Exact: what neighbours move against each other around the disk, and outward as they are turned."""
        around = self.kn * math.cos(self.angle) ** 2 + self.kt * math.sin(self.angle) ** 2
        against = 2.0 * math.sin(self.half_phase) * math.cos(self.half_pitch)
        outward = 2.0 * math.cos(self.half_phase) * math.sin(self.half_pitch)
        return around * against**2 + self.kt * outward**2

    def tables(self) -> dict[str, Any]:
        """One sector with its shroud contact."""
        load = self.normal_load or self.usual_load
        face = {
            "shape": "shroud", "law": "coulomb-3d", "angle": self.angle, "kt": self.kt, "kn": self.kn,
            "mu": self.mu, "N0": load,
        }  # fmt: skip
        return {"name": self.name, **self.sector("shroud", face)}
