"""What studies find: error against time, a map, a plan, an interference diagram."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Annotated, ClassVar

from solver.arrays import FloatOrNaN, Real
from solver.results.base import Drawn, MadeOfResponses, Shown
from solver.results.known import NOTHING_KNOWN, Known
from solver.results.measures import OF_X, Measured
from solver.results.notes import Note
from solver.results.told import Piece
from solver.results.views import Data, Views
from solver.scene.scene import Scene
from solver.studies.peaks.track_results import PeakTrack

if TYPE_CHECKING:
    pass


class MapStatus(Enum):
    """How a map ended; the value is a sentence a user can act on."""

    COMPLETED = "Every point is a solution."
    HOLES = "Some points were not solved and are empty: use more harmonics or another range."
    STOPPED = "The map was stopped by the caller: what is empty was not reached."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class ResponseMap(MadeOfResponses, Drawn):
    """max|x| of the observed DOF over a parameter and the frequency."""

    VIEWS: ClassVar = Views("solver.views", "tracks:response_map", "of_map")
    DATA: ClassVar = Data(
        "map", {"parameter": "parameter", "frequency": "frequency",
        "parameter frequency": "amplitude half_peak_to_peak", "ridge": "ridge_parameter=ridge.parameter"
         " ridge_peak=ridge.peak ridge_frequency=ridge.frequency"},
        "parameter=parameter_path harmonics=n_harmonics", scene="given", rows=("parameter", "frequency"),
    )  # fmt: skip
    JSON: ClassVar = (
        "scene measured parameter parameter_path unit frequency amplitude half_peak_to_peak ridge n_harmonics"
        " newton_iterations largest_residual seconds completed=reached status"
    )

    scene: Annotated[str, "Name of the scene."]
    parameter_path: Annotated[str, "Path of the parameter."]
    unit: Annotated[str, "Unit of the parameter."]
    parameter: Annotated[Real, "Its values, (S,): even, or in equal ratios where the ends differ by much."]
    frequency: Annotated[Real, "Frequencies [Hz], evenly spaced over the scene's band, (F,)."]
    amplitude: Annotated[Real, "max|x| [m], (S, F); not known where no solution was found."]
    half_peak_to_peak: Annotated[Real, "(max x - min x) / 2 [m], (S, F)."]
    ridge: Annotated[PeakTrack | None, "The tracked peaks over the same range, if asked for."]
    n_harmonics: Annotated[int, "Highest harmonic kept."]
    largest_residual: Annotated[float, "Of all points that are solved."]
    newton_iterations: Annotated[int, "Of all points."]
    status: Annotated[MapStatus, "How it ended, and what to try if it fell short."]
    seconds: Annotated[float, "Time taken [s]."]
    given: Annotated[
        Scene | None, "What it is of, with the values that stayed fixed; None if read from a file."
    ] = None
    highest: Annotated[Known, "How well the highest point of the grid is known."] = NOTHING_KNOWN

    @property
    def measured(self) -> Measured:
        """What the amplitudes are of."""
        return OF_X if self.given is None else self.given.measured

    def known_parts(self) -> Iterable[Known]:
        """The highest point of the grid, and the sweeps of the ridge."""
        return (self.highest, *(() if self.ridge is None else self.ridge.known_parts()))


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Effect(Piece):
    """An effect that a scene calls for or does not, and why."""

    name: Annotated[str, "For example ``separation``."]
    used: Annotated[bool, "Whether it is computed."]
    reason: Annotated[str, "In words and numbers."]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Plan(Shown):
    """What solving a scene will take."""

    VIEWS: ClassVar = Views("solver.views", "responses:plan")
    DATA: ClassVar = Data("plan", {"effect=effects": "effect=name used reason"}, status="planned", scene="")
    JSON: ClassVar = (
        "scene effects unknowns linear_dofs contacts n_harmonics=harmonics"
        " estimated_seconds_a_point=seconds_a_point estimated_seconds_of_stability=seconds_of_stability"
        " estimated_dense_bytes=dense_bytes performance_curve notes"
    )

    scene: Annotated[str, "Name of the scene."]
    effects: Annotated[tuple[Effect, ...], "Those in use and those left out."]
    unknowns: Annotated[int, "Real unknowns of the condensed balance."]
    linear_dofs: Annotated[int, "Linear DOFs behind it."]
    contacts: Annotated[int, "Contacts."]
    harmonics: Annotated[int, "Highest harmonic kept."]
    seconds_a_point: Annotated[float, "Estimated cost of a point of a branch [s]."]
    dense_bytes: Annotated[int, "Estimated memory of the dense matrices of a response [bytes]."]
    performance_curve: Annotated[
        str,
        "Whether the performance curve of one mode may stand in for responses in a design, and when it does.",
    ] = ""
    seconds_of_stability: Annotated[
        FloatOrNaN,
        "Estimated cost of the Floquet multipliers of a response [s], infinite (null in JSON) where it is "
        "not known; answers have them by themselves below a second.",
    ] = 0.0
    notes: Annotated[tuple[Note, ...], "What of the scene is hardly meant."] = ()


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
        "solver.views", "disks:interference", "disks:interference_figure", "interference_dataset"
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
