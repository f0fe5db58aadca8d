"""The answer of a map: what `solver.studies.response_map` returns."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from typing import Annotated, ClassVar

from solver.arrays import Real
from solver.results.base import Drawn, MadeOfResponses
from solver.results.known import NOTHING_KNOWN, Known
from solver.results.views import Views
from solver.scene.scene import Scene
from solver.studies.peaks.results import PeakTrack


class MapStatus(Enum):
    """How a map ended; the value is a sentence a user can act on."""

    COMPLETED = "Every point is a solution."
    HOLES = "Some points were not solved and are empty: use more harmonics or another range."
    STOPPED = "The map was stopped by the caller: what is empty was not reached."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class ResponseMap(MadeOfResponses, Drawn):
    """max|x| of the observed DOF over a parameter and the frequency."""

    VIEWS: ClassVar = Views("solver.views", "of_map", "map_dataset", "of_map")
    JSON: ClassVar = (
        "scene parameter parameter_path unit frequency amplitude half_peak_to_peak ridge n_harmonics"
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
    def reached(self) -> bool:
        """Whether every point is a solution."""
        return self.status is MapStatus.COMPLETED

    def known_parts(self) -> Iterable[Known]:
        """The highest point of the grid, and the sweeps of the ridge."""
        return (self.highest, *(() if self.ridge is None else self.ridge.known_parts()))
