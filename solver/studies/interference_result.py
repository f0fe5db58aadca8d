"""The answer of an interference diagram: frequencies at each nodal diameter, orders that meet them."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import ClassVar

from solver.results.base import Drawn
from solver.results.told import Piece
from solver.results.views import Views
from solver.scene.scene import Scene


class InterferenceStatus(Enum):
    """How a diagram ended; the value is a sentence a user can act on."""

    COMPLETED = "The natural frequencies at every nodal diameter that the structure is known at are there."
    STOPPED = "The diagram was stopped before all nodal diameters were computed."


class Wave(Enum):
    """Which way a wave runs as the disk sees it; BOTH where the direction makes no difference."""

    STANDING = "standing"
    FORWARD = "forward"
    BACKWARD = "backward"
    BOTH = "both"


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class DiameterFrequencies(Piece):
    """Natural frequencies at one nodal diameter.

    Attributes
    ----------
    diameter : int
        Nodal diameter, from 0 to half the sectors.
    wave : Wave
        Of which direction; BOTH where both have the same frequencies.
    open_hz, stuck_hz : tuple of float
        Undamped, with all contacts open, and with all closed and stuck [Hz], ascending and as many: the
        i-th of both are the ends of family i.
    """

    diameter: int
    wave: Wave
    open_hz: tuple[float, ...]
    stuck_hz: tuple[float, ...]

    def to_json(self) -> dict[str, object]:
        """Return the frequencies as one JSON object."""
        return {
            "diameter": self.diameter,
            "wave": self.wave.value,
            "open_hz": list(self.open_hz),
            "stuck_hz": list(self.stuck_hz),
        }


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class FoldedOrder(Piece):
    """What an engine order excites at the speed of the diagram.

    Attributes
    ----------
    order : int
        Excitations a revolution.
    diameter : int
        Nodal diameter of its wave.
    wave : Wave
        Which way it runs.
    frequency_hz : float
        Its frequency [Hz].
    """

    order: int
    diameter: int
    wave: Wave
    frequency_hz: float

    def to_json(self) -> dict[str, object]:
        """Return the order as one JSON object."""
        return {
            "order": self.order,
            "diameter": self.diameter,
            "wave": self.wave.value,
            "frequency_hz": self.frequency_hz,
        }


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Interference(Piece):
    """An engine order that meets a family of modes, or comes near it.

    Attributes
    ----------
    order : int
        Excitations a revolution.
    diameter : int
        Nodal diameter of its wave.
    wave : Wave
        Which way it runs.
    family : int
        Which natural frequency of that nodal diameter, 1 the lowest.
    frequency_hz : float
        Frequency of the order [Hz].
    open_hz, stuck_hz : float
        Of the family with all contacts open, and all stuck [Hz].
    margin : float
        Distance of the order from the range between these, relative to the order's frequency; 0 inside.
    """

    order: int
    diameter: int
    wave: Wave
    family: int
    frequency_hz: float
    open_hz: float
    stuck_hz: float
    margin: float

    @property
    def inside(self) -> bool:
        """Whether friction can bring the resonance to the order."""
        return self.margin == 0.0

    def to_json(self) -> dict[str, object]:
        """Return it as one JSON object."""
        return {
            "order": self.order,
            "diameter": self.diameter,
            "wave": self.wave.value,
            "family": self.family,
            "frequency_hz": self.frequency_hz,
            "open_hz": self.open_hz,
            "stuck_hz": self.stuck_hz,
            "inside": self.inside,
            "margin": self.margin,
        }


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class InterferenceDiagram(Drawn):
    """Natural frequencies of a disk over its nodal diameters, and the engine orders that meet them.

    Attributes
    ----------
    scene : Scene
        The disk, as it was given.
    sectors : int
        Of the disk.
    speed_rpm : float or None
        Speed of rotation [1/min].
    within : float
        Relative distance up to which an order counts as near a family.
    points : tuple of DiameterFrequencies
        Ascending; two at a nodal diameter where the directions differ.
    orders : tuple of FoldedOrder
        What the orders excite at the speed, ascending; empty without one.
    crossings : tuple of Interference
        Orders that meet a family or are near it, ascending in order and family.
    missing : tuple of int
        Nodal diameters that a reduced sector was not built for.
    status : InterferenceStatus
        How it ended.
    seconds : float
        Time taken [s].
    """

    scene: Scene
    sectors: int
    speed_rpm: float | None
    within: float
    points: tuple[DiameterFrequencies, ...]
    orders: tuple[FoldedOrder, ...]
    crossings: tuple[Interference, ...]
    missing: tuple[int, ...]
    status: InterferenceStatus
    seconds: float

    @property
    def completed(self) -> bool:
        """Whether no nodal diameter is missing that the structure is known at."""
        return self.status is InterferenceStatus.COMPLETED

    VIEWS: ClassVar = Views(
        "solver.views", "of_interference", "interference_dataset", "disks:interference_figure"
    )

    def to_json(self) -> dict[str, object]:
        """Return the diagram as one JSON object."""
        return {
            "scene": self.scene.name,
            "sectors": self.sectors,
            "speed_rpm": self.speed_rpm,
            "within": self.within,
            "diameters": [point.to_json() for point in self.points],
            "orders": [order.to_json() for order in self.orders],
            "crossings": [crossing.to_json() for crossing in self.crossings],
            "missing": list(self.missing),
            "seconds": self.seconds,
            "completed": self.completed,
            "status": self.status.value,
        }
