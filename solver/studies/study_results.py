"""What studies find: a map, a plan, an interference diagram, mistuned disks, an allowed excitation."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np

from solver.arrays import FloatOrNaN, Real
from solver.results.base import Data, Drawn, MadeOfResponses, Shown, Views
from solver.results.known import NOTHING_DAMPS, NOTHING_KNOWN, OF_X, Known, Measured, Note
from solver.results.order_statistics import quantile_json
from solver.results.told import Piece
from solver.scene.scene import Scene
from solver.studies.peaks.track_results import PeakTrack

if TYPE_CHECKING:
    pass
    from solver.continuation.branch import Branch
    from solver.studies.blades import BladePeaks


class MapStatus(Enum):
    """How a map ended; the value is a sentence a user can act on."""

    COMPLETED = "Every point is a solution."
    HOLES = "Some points were not solved and are empty: use more harmonics or another range."
    STOPPED = "The map was stopped by the caller: what is empty was not reached."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class ResponseMap(MadeOfResponses, Drawn):
    """max|x| of the observed DOF over a parameter and the frequency."""

    VIEWS: ClassVar = Views("solver.views", "tracks:response_map", "tracks:map_figure")
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


class MarginStatus(Enum):
    """How a diagram ended; the value is a sentence a user can act on."""

    COMPLETED = "Every response was computed."
    HOLES = "Some responses do not cover the band and are empty: use more harmonics or a narrower band."
    UNDAMPED = NOTHING_DAMPS
    STOPPED = "Stopped by the caller: what is empty was not reached."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class AllowedExcitation(Piece):
    """What one damper allows."""

    name: Annotated[str, "Of the damper, or ``as it is``."]
    allowed: Annotated[
        FloatOrNaN, "Excitation at which what is allowed is reached first, in its unit; NaN if it is not."
    ]
    end: Annotated[
        str,
        "``within``, ``below``: it is reached before the range begins, ``above``: not up to its end, or "
        "``unknown``: a level below has no response.",
    ]
    row: Annotated[str, "What reaches it, a recovered stress or the observed DOF."]
    at_hz: Annotated[FloatOrNaN, "Frequency of that peak [Hz]."]
    value: Annotated[FloatOrNaN, "Its alternating stress [Pa], or amplitude, there."]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class MarginDiagram(MadeOfResponses, Drawn):
    """The greatest stress over the excitation of D dampers at n levels."""

    VIEWS: ClassVar = Views("solver.views", "tracks:margin", "tracks:margin_figure")
    DATA: ClassVar = Data(
        "margin", {
            "damper=allowed": "damper=name allowed end row at_hz value", "level": "level",
            "damper level": "stress used",
        },
        "judged_by unit level_unit harmonics=n_harmonics", scene="scene", rows=("damper", "level"),
    )  # fmt: skip
    JSON: ClassVar = (
        "scene judged_by unit level level_unit stress used allowed n_harmonics seconds reached status"
    )

    scene: Annotated[str, "Name of the scene."]
    judged_by: Annotated[str, "``utilisation`` of strengths, or ``amplitude`` of the observed DOF."]
    unit: Annotated[str, "Of `stress`: Pa, or that of the amplitude."]
    level: Annotated[Real, "Excitation amplitudes, (n,)."]
    level_unit: Annotated[str, "Their unit."]
    stress: Annotated[Real, "Alternating stress, or amplitude, of what is used most, (D, n)."]
    used: Annotated[
        Real,
        "Its share of what is allowed; NaN where nothing says what is, inf, which is null in JSON beside a "
        "stress, where the mean stress alone reaches the strength, (D, n).",
    ]
    allowed: Annotated[tuple[AllowedExcitation, ...], "What each damper allows, (D,)."]
    n_harmonics: Annotated[int, "Highest harmonic kept."]
    highest: Annotated[tuple[Known, ...], "How well the responses at the levels are known."]
    status: Annotated[MarginStatus, "How it ended."]
    seconds: Annotated[float, "Time taken [s]."]

    @property
    def reached(self) -> bool:
        """Whether every response was computed."""
        return self.status is MarginStatus.COMPLETED

    def known_parts(self) -> Iterable[Known]:
        """The responses at the levels."""
        return self.highest


QUANTILES = (0.05, 0.5, 0.95, 0.99)


class MistuningStatus(Enum):
    """How a study ended; the value is a sentence a user can act on."""

    COMPLETED = "The peaks of all blades of every disk are known."
    INCOMPLETE = (
        "Some responses did not reach the end of the band, so their disks are left out of the figures: use "
        "more harmonics or another band."
    )
    NO_RESPONSE = (
        "The tuned disk has no peak to compare with, or its response did not reach the end of the band: use "
        "another band or an excitation above 0."
    )
    UNDAMPED = NOTHING_DAMPS
    STOPPED = "The study was stopped by the caller: the figures are those of the disks so far."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class MistunedDisk(Piece):
    """One disk of a study."""

    JSON: ClassVar = (
        "seed factors peaks=peaks.value at_hz=peaks.at_hz largest=peaks.largest worst_blade=peaks.worst"
        " magnification error_estimate=peaks.highest.error_estimate magnification_error"
        " measure=peaks.highest.measure flags=peaks.highest.flags"
    )

    seed: Annotated[int, "Of its factors."]
    factors: Annotated[tuple[float, ...], "One for each sector."]
    peaks: Annotated[BladePeaks, "Of every blade; without the branches."]
    magnification: Annotated[
        float, "Its highest peak relative to that of the tuned disk; NaN if a blade's is not known."
    ]
    magnification_error: Annotated[
        float, "Estimated error of that, by those of both peaks; NaN if it is not known."
    ] = math.nan

    @property
    def known(self) -> bool:
        """Whether the peaks of all blades are."""
        return math.isfinite(self.magnification)

    def to_json(self) -> dict[str, Any]:
        """Return the disk as one JSON object."""
        return self._json() if self.known else self._json(largest=None, worst_blade=None)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class MistuningStudy(MadeOfResponses, Drawn):
    """What becomes of the highest peak when blades are not quite equal."""

    VIEWS: ClassVar = Views("solver.views", "disks:mistuning", "disks:mistuning_figure")
    DATA: ClassVar = Data(
        "mistuning", {"disk=disks": "seed magnification", "disk sector=disks": "factor=factors"
         " peak=peaks.value frequency=peaks.at_hz"},
        "spread of harmonics=n_harmonics tuned_peak=tuned.largest", index="sector",
    )  # fmt: skip
    JSON: ClassVar = (
        "scene dof=tuned.dof measured=tuned.measured of spread tuned=tuned_peak samples=disks mean mean_error"
        " standard_error deviation quantiles worst n_harmonics seconds completed=reached status"
    )

    scene: Annotated[str, "Its name."]
    of: Annotated[tuple[str, ...], "The parts that have factors."]
    spread: Annotated[float, "Standard deviation of the factors."]
    tuned: Annotated[BladePeaks, "Of the disk without mistuning."]
    disks: Annotated[tuple[MistunedDisk, ...], "In the order of their seeds."]
    branches: Annotated[
        tuple[Branch, ...], "The responses of the worst blade of the tuned disk and of the worst one."
    ]
    n_harmonics: int
    status: MistuningStatus
    seconds: float

    @property
    def magnifications(self) -> Real:
        """The amplitude magnification factors of the disks whose peaks are known, in their order."""
        return np.array([disk.magnification for disk in self.disks if disk.known])

    @property
    def mean(self) -> FloatOrNaN:
        """Mean of the magnifications; NaN if none is known."""
        return float(self.magnifications.mean()) if self.magnifications.size else math.nan

    @property
    def deviation(self) -> FloatOrNaN:
        """Standard deviation of the magnifications; NaN of less than two."""
        return float(self.magnifications.std(ddof=1)) if self.magnifications.size > 1 else math.nan

    @property
    def standard_error(self) -> FloatOrNaN:
        """Of the mean, as that of so many disks; NaN of less than two."""
        return self.deviation / math.sqrt(max(self.magnifications.size, 1))

    @property
    def quantiles(self) -> tuple[Mapping[str, Any], ...]:
        """Quantiles of the magnification, and between what each lies."""
        known = self.magnifications
        return tuple(
            quantile_json("magnification", float(np.quantile(known, share)), known.tolist(), share)
            for share in (QUANTILES if known.size else ())
        )

    @property
    def tuned_peak(self) -> Mapping[str, Any]:
        """The highest peak [m] of the tuned disk and where it is [Hz]; null if it is not known."""
        known = math.isfinite(self.tuned.largest)
        at_hz = self.tuned.at_hz[self.tuned.worst] if known else None
        return {"peak": self.tuned.largest if known else None, "at_hz": at_hz}

    @property
    def mean_error(self) -> FloatOrNaN:
        """Estimated error of the mean magnification, by those of the peaks; NaN if one is not known."""
        errors = [disk.magnification_error for disk in self.disks if disk.known]
        return float(np.mean(errors)) if errors else math.nan

    @property
    def worst(self) -> MistunedDisk | None:
        """The disk with the highest peak."""
        return max((d for d in self.disks if d.known), key=lambda disk: disk.magnification, default=None)

    def known_parts(self) -> Iterable[Known]:
        """The highest blades of the tuned disk and of every other."""
        return (self.tuned.highest, *(disk.peaks.highest for disk in self.disks if disk.known))
