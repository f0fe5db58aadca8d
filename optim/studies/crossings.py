"""The answer of a Campbell diagram: what every order excites, and where that meets the running speeds."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from solver.results.base import Drawn, MadeOfResponses
from solver.results.known import Known
from solver.results.notes import NOTHING_DAMPS
from solver.results.told import Piece
from solver.results.views import Views
from solver.scene.scene import Scene

if TYPE_CHECKING:
    from solver.continuation.branch import Branch

Ranges = tuple[tuple[float, float], ...]


class CampbellStatus(Enum):
    """How a diagram ended; the value is a sentence a user can act on."""

    COMPLETED = "Every response covers its whole range of frequencies."
    INCOMPLETE = (
        "A response ended before the end of its range, so peaks may be missing: its own status says why. Try "
        "more harmonics or a narrower band."
    )
    UNDAMPED = NOTHING_DAMPS
    STOPPED = "The diagram was stopped before all responses were computed."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Crossing(Piece):
    """A speed at which an order meets a peak of its response."""

    speed_rpm: Annotated[float, "Running speed [1/min]."]
    frequency_hz: Annotated[float, "Frequency of the peak [Hz]."]
    amplitude: Annotated[float, "Its height [m]."]
    inside: Annotated[bool, "Whether the speed is a running speed."]
    margin: Annotated[float, "Distance to the nearest running speed, relative to that; 0 inside."]
    error_estimate: Annotated[float, "Estimated error of the amplitude [m]; NaN if not known."] = math.nan


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class OrderResponse(Piece):
    """What one order excites; natural frequencies are of its nodal diameter if the structure is cyclic."""

    JSON: ClassVar = (
        "order range_hz running_hz limit peaks=branch.interior_peaks bands_hz exceeded_rpm"
        " exceeded_running_rpm crossings_rpm crossings highest_running stuck_hz open_hz"
        " peak_certificate=branch.peak_certificate band_known=branch.band_known measure peak_max_abs"
        " error_estimate peak_half_peak_to_peak half_peak_to_peak_error relative_error"
        " flags completed=branch.reached status=branch.status"
    )

    order: Annotated[int, "Excitations a revolution."]
    branch: Annotated[Branch, "The frequency response; without sectors it is the same for all orders."]
    running_hz: Annotated[Ranges, "Excitation frequencies of the running speeds [Hz]."]
    limit: Annotated[float, "Amplitude of the bands [m]: as asked for, else half power of the highest peak."]
    bands_hz: Annotated[Ranges, "Where the amplitude exceeds it [Hz]."]
    exceeded_rpm: Annotated[Ranges, "The same as speeds [1/min]."]
    exceeded_running_rpm: Annotated[Ranges, "The same as far as they are running speeds [1/min]."]
    crossings: Annotated[tuple[Crossing, ...], "Every peak inside the range looked at, ascending."]
    highest_running: Annotated[
        Crossing | None,
        "The largest amplitude at any running speed; None where the response does not reach one. Its error "
        "is what any amplitude at a running speed may be higher by.",
    ]
    stuck_hz: Annotated[tuple[float, ...], "Undamped natural frequencies there, all contacts stuck [Hz]."]
    open_hz: Annotated[tuple[float, ...], "The same with all contacts open [Hz]."]

    def to_json(self) -> dict[str, Any]:
        """Return the response of the order as one JSON object."""
        known = self.branch.known.to_json()
        del known["peaks_open"]
        return self._json(
            range_hz=(self.branch.start, self.branch.stop),
            crossings_rpm=[crossing.speed_rpm for crossing in self.crossings], **known,
        )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class CampbellDiagram(MadeOfResponses, Drawn):
    """Orders of a running speed against the resonances of a scene."""

    VIEWS: ClassVar = Views("optim.views", "studies:campbell", "of_campbell", "campbell_dataset")
    JSON: ClassVar = (
        "scene measured=scene.measured speeds_rpm limit clear orders n_harmonics seconds completed=reached"
        " status"
    )

    scene: Annotated[Scene, "With the values all responses share."]
    speeds_rpm: Annotated[Ranges, "The running speeds [1/min]."]
    limit: Annotated[float | None, "Amplitude [m] asked for."]
    orders: Annotated[tuple[OrderResponse, ...], "What each excites, ascending."]
    n_harmonics: Annotated[int, "Highest harmonic kept."]
    status: Annotated[CampbellStatus, "How it ended, and what to try if it fell short."]
    seconds: Annotated[float, "Time taken [s]."]

    @property
    def clear(self) -> bool | None:
        """Whether the amplitude stays within the limit at every running speed; None if that is not known.

        Without a limit: whether no peak lies at a running speed. It is not known either where a peak may hide
        between two points of a response, see `Branch.peak_certificate`, nor where the highest amplitude is
        nearer to the limit than its estimated error, or has none.
        """
        if self.limit is None:
            meets = any(crossing.inside for one in self.orders for crossing in one.crossings)
        else:
            meets = any(one.exceeded_running_rpm for one in self.orders)
        known = all(one.branch.peak_certificate.known and self._within(one) for one in self.orders)
        return False if meets else True if self.reached and known else None

    def _within(self, one: OrderResponse) -> bool:
        """Return whether the amplitude at running speeds stays within the limit whatever its error is."""
        highest = one.highest_running
        if self.limit is None or highest is None:
            return True
        return highest.error_estimate < self.limit - highest.amplitude

    def known_parts(self) -> Iterable[Known]:
        """The response of every order."""
        return [one.branch.known for one in self.orders]
