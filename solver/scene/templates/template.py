"""What all templates share: a blade with one mode, its excitation, and how a scene is put together."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

from pydantic import BaseModel, ConfigDict, Field

Word = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+\z", max_length=100)]
# The least is small enough for every unit, and large enough for squares and quotients to be told.
Size = Annotated[float, Field(strict=True, ge=1e-9, le=1e15, allow_inf_nan=False)]
BLADE = "blade"
"""The DOF of the mode that vibrates."""
_BELOW, _ABOVE = 0.8, 1.2
"""The band reaches so far beyond the frequencies of the blade with its contact loose and stuck."""


def rounded(value: float) -> float:
    """A number with the digits that a person may want to read."""
    return float(f"{value:.9g}")


class Template(BaseModel):
    """A case: its fields are the questions, `tables` is the scene.

    Attributes
    ----------
    name : str
        Name of the scene.
    frequency_hz : float
        Natural frequency of the blade's mode without the contact [Hz].
    modal_mass : float
        Modal mass of this mode, its shape scaled to 1 where the contact is [kg].
    damping_ratio : float
        Damping ratio of this mode without the contact.
    force : float
        Amplitude of the exciting force on this mode [N].
    kt : float
        Tangential stiffness of the contact, of a face if it has several [N/m].
    mu : float
        Friction coefficient.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    NAME: ClassVar[str]
    TITLE: ClassVar[str]

    name: Word
    frequency_hz: Size = 300.0
    modal_mass: Size = 0.15
    damping_ratio: Annotated[float, Field(strict=True, ge=0.0, lt=1.0)] = 0.001
    force: Size = 20.0
    kt: Size = 1.0e6
    mu: Annotated[float, Field(strict=True, gt=0.0, le=2.0)] = 0.3

    @property
    def stiffness(self) -> float:
        """Stiffness that gives the mode its frequency: m (2 pi f)² [N/m]."""
        return self.modal_mass * (2.0 * math.pi * self.frequency_hz) ** 2

    @property
    def dashpot(self) -> float:
        """Dashpot that gives the mode its damping ratio: 2 D m 2 pi f [N s/m]."""
        return 2.0 * self.damping_ratio * self.modal_mass * 2.0 * math.pi * self.frequency_hz

    @property
    def usual_load(self) -> float:
        """A load whose friction is of the size of the force, in round numbers [N]."""
        return float(f"{self.force / self.mu:.3g}")

    @property
    @abstractmethod
    def stiffening(self) -> float:
        """What the contact adds to the stiffness of the mode while it sticks, at most [N/m]."""

    @abstractmethod
    def tables(self) -> dict[str, Any]:
        """The scene, as a file has it."""

    def blade_spring(self) -> dict[str, Any]:
        """The spring and dashpot between the blade and the ground."""
        spring = {"name": BLADE, "between": [BLADE, "ground"], "k": rounded(self.stiffness)}
        return {**spring, "c": rounded(self.dashpot)} if self.dashpot else spring

    def excited(self, **more: Any) -> dict[str, Any]:
        """The tables of the force and of what is observed: the blade, from below its mode to above it."""
        stuck = self.frequency_hz * math.sqrt(1.0 + self.stiffening / self.stiffness)
        band = [float(f"{_BELOW * self.frequency_hz:.3g}"), float(f"{_ABOVE * stuck:.3g}")]
        return {
            "excitation": {"dof": BLADE, "amplitude": self.force, **more},
            "observe": {"dof": BLADE, "band": band},
        }


class DiskTemplate(Template):
    """A case of a disk of equal blades: one sector, excited by an engine order.

    Attributes
    ----------
    blades : int
        Number of blades of the disk.
    engine_order : int
        Engine order of the excitation: so many periods of the force around the disk.
    radius : float
        Distance of the contact from the axis of rotation [m].
    kn : float
        Normal stiffness of a face [N/m].
    """

    blades: Annotated[int, Field(strict=True, ge=3, le=500)] = 24
    engine_order: Annotated[int, Field(strict=True, ge=1, le=1000)] = 4
    radius: Size = 0.35
    kn: Size = 1.5e6

    @property
    def half_phase(self) -> float:
        """Half the phase between neighbouring blades [rad]."""
        return math.pi * self.engine_order / self.blades

    @property
    def half_pitch(self) -> float:
        """Half the angle between neighbouring blades [rad]."""
        return math.pi / self.blades

    def between_blades(self) -> dict[str, Any]:
        """The keys that put a damper half way from the blade to the next one, pressed outward."""
        cosine, sine = rounded(math.cos(self.half_pitch)), rounded(math.sin(self.half_pitch))
        return {
            "at": [rounded(self.radius * cosine), rounded(self.radius * sine), 0.0],
            "out": [cosine, sine, 0.0],
            "axial": [0.0, 0.0, -1.0],
        }

    def sector(self, place: str, damper: Mapping[str, Any], **held: list[dict[str, Any]]) -> dict[str, Any]:
        """One sector with a damper between the `place` of a blade and that of the next one.

        Parameters
        ----------
        held : springs and dampers of the structure beside the blade's own.
        """
        structure = {
            "kind": "cyclic", "sectors": self.blades, "axis": [0.0, 0.0, 1.0],
            "masses": {BLADE: self.modal_mass},
            "springs": [self.blade_spring(), *held.get("springs", [])],
        }  # fmt: skip
        if "dampers" in held:
            structure["dampers"] = held["dampers"]
        node = {"name": place, "at": [self.radius, 0.0, 0.0], "dofs": {"y": BLADE}}
        ends = {"between": [place, f"{place}@next"]}
        return {
            "structure": structure,
            "nodes": [node],
            "dampers": [{"name": "damper", **damper, **ends, **self.between_blades()}],
            **self.excited(engine_order=self.engine_order),
        }
