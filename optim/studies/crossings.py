"""The answer of a Campbell diagram: what every order excites, and where that meets the running speeds."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from typing import ClassVar

from solver.continuation.branch import Branch
from solver.results.base import Drawn, MadeOfResponses
from solver.results.known import Known
from solver.results.told import json_number
from solver.results.views import Views
from solver.scene.scene import Scene

Ranges = tuple[tuple[float, float], ...]


class CampbellStatus(Enum):
    """How a diagram ended; the value is a sentence a user can act on."""

    COMPLETED = "Every response covers its whole range of frequencies."
    INCOMPLETE = (
        "A response ended before the end of its range, so peaks may be missing: its own status says why. Try "
        "more harmonics or a narrower band."
    )
    STOPPED = "The diagram was stopped before all responses were computed."


@dataclass(frozen=True, slots=True, kw_only=True)
class Crossing:
    """A speed at which an order meets a peak of its response.

    Attributes
    ----------
    speed_rpm : float
        Running speed [1/min].
    frequency_hz : float
        Frequency of the peak [Hz].
    amplitude : float
        Its height [m].
    inside : bool
        Whether the speed is a running speed.
    margin : float
        Distance to the nearest running speed, relative to that; 0 inside.
    error_estimate : float
        Estimated error of the amplitude [m]; NaN if not known.
    """

    speed_rpm: float
    frequency_hz: float
    amplitude: float
    inside: bool
    margin: float
    error_estimate: float = math.nan


@dataclass(frozen=True, slots=True, kw_only=True)
class OrderResponse:
    """What one order excites.

    Attributes
    ----------
    order : int
        Excitations a revolution.
    branch : Branch
        The frequency response; of a scene without sectors it is the same for all orders.
    running_hz : tuple of (low, high)
        Excitation frequencies of the running speeds [Hz].
    limit : float
        Amplitude [m] that the bands are above: the one asked for, else half power of the highest peak.
    bands_hz : tuple of (low, high)
        Where the amplitude exceeds it [Hz].
    exceeded_rpm, exceeded_running_rpm : tuple of (low, high)
        The same as speeds [1/min], and as far as they are running speeds.
    crossings : tuple of Crossing
        Every peak inside the range looked at, ascending.
    highest_running : Crossing or None
        The largest amplitude at any running speed; None where the response does not reach one. Its error is
        what any amplitude at a running speed may be higher by.
    stuck_hz, open_hz : tuple of float
        Undamped natural frequencies up to the end of the range with all contacts closed and stuck, and with
        all open [Hz]; of the order's nodal diameter if the structure is cyclic.
    """

    order: int
    branch: Branch
    running_hz: Ranges
    limit: float
    bands_hz: Ranges
    exceeded_rpm: Ranges
    exceeded_running_rpm: Ranges
    crossings: tuple[Crossing, ...]
    highest_running: Crossing | None
    stuck_hz: tuple[float, ...]
    open_hz: tuple[float, ...]

    def to_json(self) -> dict[str, object]:
        """Return the response of the order as one JSON object."""
        branch, highest, known = self.branch, self.highest_running, self.branch.known.to_json()
        return {
            "order": self.order,
            "range_hz": [branch.start, branch.stop],
            "running_hz": [list(one) for one in self.running_hz],
            "limit": json_number(self.limit),
            "peaks": [{"value": peak.value, "at": peak.at} for peak in branch.peaks if peak.interior],
            "bands_hz": [list(one) for one in self.bands_hz],
            "exceeded_rpm": [list(one) for one in self.exceeded_rpm],
            "exceeded_running_rpm": [list(one) for one in self.exceeded_running_rpm],
            "crossings_rpm": [crossing.speed_rpm for crossing in self.crossings],
            "crossings": [_crossing_json(crossing) for crossing in self.crossings],
            "highest_running": None if highest is None else _crossing_json(highest),
            "stuck_hz": list(self.stuck_hz),
            "open_hz": list(self.open_hz),
            "peak_certificate": branch.peak_certificate.to_json(),
            "band_known": None
            if branch.band is None
            else branch.band.known and branch.peak_certificate.known,
            **{key: value for key, value in known.items() if key != "peaks_open"},
            "completed": branch.completed,
            "status": branch.status.value,
        }


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class CampbellDiagram(MadeOfResponses, Drawn):
    """Orders of a running speed against the resonances of a scene.

    Attributes
    ----------
    scene : Scene
        With the values all responses share.
    speeds_rpm : tuple of (low, high)
        The running speeds [1/min].
    limit : float or None
        Amplitude [m] asked for.
    orders : tuple of OrderResponse
        Ascending.
    n_harmonics : int
        Highest harmonic kept.
    status : CampbellStatus
        How it ended.
    seconds : float
        Time taken [s].
    """

    scene: Scene
    speeds_rpm: Ranges
    limit: float | None
    orders: tuple[OrderResponse, ...]
    n_harmonics: int
    status: CampbellStatus
    seconds: float

    @property
    def completed(self) -> bool:
        """Whether every response covers its whole range."""
        return self.status is CampbellStatus.COMPLETED

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
        return False if meets else True if self.completed and known else None

    def _within(self, one: OrderResponse) -> bool:
        """Return whether the amplitude at running speeds stays within the limit whatever its error is."""
        highest = one.highest_running
        if self.limit is None or highest is None:
            return True
        return highest.error_estimate < self.limit - highest.amplitude

    VIEWS: ClassVar = Views("optim.views", "of_campbell", "campbell_dataset", "of_campbell")

    def known_parts(self) -> Iterable[Known]:
        """The response of every order."""
        return [one.branch.known for one in self.orders]

    def own_json(self) -> dict[str, object]:
        """Return the diagram as one JSON object."""
        return {
            "scene": self.scene.name,
            "speeds_rpm": [list(one) for one in self.speeds_rpm],
            "limit": self.limit,
            "clear": self.clear,
            "orders": [one.to_json() for one in self.orders],
            "n_harmonics": self.n_harmonics,
            "seconds": self.seconds,
            "completed": self.completed,
            "status": self.status.value,
        }


def _crossing_json(crossing: Crossing) -> dict[str, object]:
    return {
        "speed_rpm": crossing.speed_rpm,
        "frequency_hz": crossing.frequency_hz,
        "amplitude": crossing.amplitude,
        "inside": crossing.inside,
        "margin": crossing.margin,
        "error_estimate": json_number(crossing.error_estimate),
    }
