"""The answer of an interference diagram: frequencies at each nodal diameter, orders that meet them."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Annotated, ClassVar

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
    """Undamped natural frequencies at one nodal diameter: the i-th of both are the ends of family i."""

    diameter: Annotated[int, "Nodal diameter, from 0 to half the sectors."]
    wave: Annotated[Wave, "Of which direction; BOTH where both have the same frequencies."]
    open_hz: Annotated[tuple[float, ...], "With all contacts open [Hz], ascending."]
    stuck_hz: Annotated[tuple[float, ...], "With all closed and stuck [Hz], as many."]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class FoldedOrder(Piece):
    """What an engine order excites at the speed of the diagram."""

    order: Annotated[int, "Excitations a revolution."]
    diameter: Annotated[int, "Nodal diameter of its wave."]
    wave: Annotated[Wave, "Which way it runs."]
    frequency_hz: Annotated[float, "Its frequency [Hz]."]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Interference(Piece):
    """An engine order that meets a family of modes, or comes near it."""

    JSON: ClassVar = "order diameter wave family frequency_hz open_hz stuck_hz inside margin"

    order: Annotated[int, "Excitations a revolution."]
    diameter: Annotated[int, "Nodal diameter of its wave."]
    wave: Annotated[Wave, "Which way it runs."]
    family: Annotated[int, "Which natural frequency of that nodal diameter, 1 the lowest."]
    frequency_hz: Annotated[float, "Frequency of the order [Hz]."]
    open_hz: Annotated[float, "Of the family with all contacts open [Hz]."]
    stuck_hz: Annotated[float, "Of the family with all contacts stuck [Hz]."]
    margin: Annotated[float, "Distance from the range between these, relative to the order's; 0 inside."]

    @property
    def inside(self) -> bool:
        """Whether friction can bring the resonance to the order."""
        return self.margin == 0.0


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class InterferenceDiagram(Drawn):
    """Natural frequencies of a disk over its nodal diameters, and the engine orders that meet them."""

    VIEWS: ClassVar = Views(
        "solver.views", "of_interference", "interference_dataset", "disks:interference_figure"
    )
    JSON: ClassVar = (
        "scene sectors speed_rpm within diameters=points orders crossings missing seconds completed=reached"
        " status"
    )

    scene: Annotated[Scene, "The disk, as it was given."]
    sectors: Annotated[int, "Of the disk."]
    speed_rpm: Annotated[float | None, "Speed of rotation [1/min]."]
    within: Annotated[float, "Relative distance up to which an order counts as near a family."]
    points: Annotated[
        tuple[DiameterFrequencies, ...],
        "Frequencies at each nodal diameter, ascending; two where the directions differ.",
    ]
    orders: Annotated[tuple[FoldedOrder, ...], "What the orders excite at the speed; empty without one."]
    crossings: Annotated[
        tuple[Interference, ...], "Orders that meet a family or are near one, ascending in order and family."
    ]
    missing: Annotated[tuple[int, ...], "Nodal diameters that a reduced sector was not built for."]
    status: Annotated[InterferenceStatus, "How it ended, and what to try if it fell short."]
    seconds: Annotated[float, "Time taken [s]."]

    @property
    def reached(self) -> bool:
        """Whether no nodal diameter is missing that the structure is known at."""
        return self.status is InterferenceStatus.COMPLETED
