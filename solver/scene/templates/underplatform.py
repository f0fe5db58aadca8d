"""Bodies under the platforms or the rim of a disk, pressed outward by rotation."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from solver.scene.templates.template import DiskTemplate, Size, Word, rounded

_LOSS = 0.02
"""Damping ratio of the body on its stuck faces: what it loses beside friction. A round number."""
_PIN = 2e-3
"""Share of its tangential stiffness that keeps a body from creeping round the disk, and a cylinder from
rolling, while it slips on both faces: nothing else tells where it is in the mean."""
_ON_A_LINE, _ON_A_FACE = 1, 2
"""Points of a face: two hold a wedge against tilting."""


class _Body(DiskTemplate):
    """A damper with a body, in the plane of the disk.

    Attributes
    ----------
    damper_mass : float
        Mass of the damper that belongs to one blade [kg].
    width : float
        Width of the damper around the disk; of a cylinder its diameter [m].
    speed : float
        Speed of rotation, which presses the damper outward with its mass times radius times Ω² [1/min].
    """

    damper_mass: Size = 0.004
    width: Size = 0.012
    speed: Size = 4000.0

    @property
    def inclination(self) -> float:
        """Of the faces [rad]."""
        return 0.0

    @property
    def stiffening(self) -> float:
        """An upper bound, after Rayleigh: the body follows the mean of both blades around the disk alone.

        What is left are the halves of the difference around the disk, a motion of each blade along its face
        turned by half the pitch, and what the blades move outward against each other.
        """
        directions = (self.inclination - self.half_pitch, self.inclination + self.half_pitch)
        around = max(self._face(direction) for direction in directions)
        outward = self._face(self.inclination + 0.5 * math.pi) * math.sin(self.half_pitch) ** 2
        phase = self.half_phase
        return 2.0 * (around * math.sin(phase) ** 2 + outward * math.cos(phase) ** 2)

    def _face(self, angle: float) -> float:
        """Stiffness of a face in a direction at an angle with it [N/m]."""
        return self.kt * math.cos(angle) ** 2 + self.kn * math.sin(angle) ** 2

    def damped(self, place: str, shape: dict[str, Any], arm: float) -> dict[str, Any]:
        """The scene with a body of a shape.

        Parameters
        ----------
        arm : distance of the faces from the centre of mass, for the damping of its rotation [m].
        """
        body = {
            "law": "elastic-normal", "kt": self.kt, "kn": self.kn, "mu": self.mu, "mass": self.damper_mass,
            "plane": "xy", "radius_of_rotation": self.radius,
        }  # fmt: skip
        loss = 2.0 * _LOSS * math.sqrt(self.damper_mass * (self.kt + self.kn))
        losses = {"x": loss, "y": loss, "rz": loss * arm**2}
        pins = {
            "x": _PIN * self.kt,
            **({"rz": _PIN * self.kt * arm**2} if shape["points"] == _ON_A_LINE else {}),
        }
        held = {
            "springs": [{"between": [f"damper.{dof}", "ground"], "k": rounded(k)} for dof, k in pins.items()],
            "dampers": [
                {"between": [f"damper.{dof}", "ground"], "c": rounded(c)} for dof, c in losses.items()
            ],
        }
        return {
            "name": self.name,
            "speed": self.speed,
            **self.sector(place, {**shape, **body}, **held),
        }


class PlatformDamper(_Body):
    """A damper between the platforms of neighbouring blades, pressed outward by rotation.

    Attributes
    ----------
    shape : str
        Shape of the damper.
    angle : float
        Inclination of the faces; 0 is flat [rad].
    """

    NAME: ClassVar[str] = "platform-damper"
    TITLE: ClassVar[str] = "Damper under the platforms"

    name: Word = "my-platform-damper"
    shape: Literal["wedge", "cylinder"] = "wedge"
    angle: Annotated[float, Field(strict=True, ge=0.0, le=1.2)] = 0.5

    @property
    def inclination(self) -> float:
        """The angle of the faces."""
        return self.angle

    def tables(self) -> dict[str, Any]:
        """One sector with a wedge or a cylinder."""
        radius = 0.5 * self.width
        if self.shape == "cylinder":
            body = {
                "shape": "cylinder", "angle": self.angle, "radius": radius, "points": _ON_A_LINE,
                "inertia": rounded(0.5 * self.damper_mass * radius**2),
            }  # fmt: skip
            return self.damped("platform", body, radius)
        body = {
            "shape": "wedge", "angle": self.angle, "width": self.width, "length": rounded(self.width / 3.0),
            "points": _ON_A_FACE, "inertia": rounded(self.damper_mass * self.width**2 / 6.0),
        }  # fmt: skip
        return self.damped("platform", body, radius)


class RingDamper(_Body):
    """A split ring under the rim: the part of a sector, pressed on its rim and on that of the next one."""

    NAME: ClassVar[str] = "split-ring"
    TITLE: ClassVar[str] = "Split ring under the rim"

    name: Word = "my-ring"
    width: Size = 0.03

    def tables(self) -> dict[str, Any]:
        """One sector with its part of the ring."""
        inertia = rounded(self.damper_mass * self.width**2 / 12.0)
        ring = {"shape": "split-ring", "width": self.width, "points": _ON_A_FACE, "inertia": inertia}
        return self.damped("rim", ring, 0.25 * self.width)
