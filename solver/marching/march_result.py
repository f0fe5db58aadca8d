"""What a time march and a run through a range of frequencies return, and how it is read from samples."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np

from solver.arrays import FloatOrNaN, Integer, Real
from solver.results.base import Data, Drawn, Views

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from solver.marching.kernels.march_state import Record
    from solver.scene.scene import Scene


from dataclasses import field

N_HARMONICS = 10


class MarchStatus(Enum):
    """How a march ended; the value is a sentence for the user."""

    CONVERGED = "The motion repeats from period to period within the tolerance."
    MAX_PERIODS = (
        "The motion did not repeat within max_periods: allow more periods, or look at the history, "
        "it may not have the period of the excitation."
    )
    STOPPED = "Stopped on request before the motion repeated."
    CHATTER = (
        "A contact changes its state without end at one instant: change the load, the stiffness or the "
        "frequency a little."
    )
    RATCHETS = (
        "There is no periodic motion: everything repeats from period to period, but a part that contacts "
        "alone hold drifts by the same distance each period."
    )
    RIGID_OPENS = (
        "A contact with kn = inf opens under its load: where it closes again is an impact, which takes a law "
        "of its own. Press it harder, or give it a finite kn."
    )
    NOT_FINITE = "The motion grows without bound: use more steps per period."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class MarchResult(Drawn):
    """The last period of a time march, from the run with the smaller step; n samples."""

    VIEWS: ClassVar = Views("solver.views", "responses:march", "of_march")
    DATA: ClassVar = Data(
        "march", {"time": "time displacement velocity", "contact": "contact=contacts",
        "contact time": "slip force=contact_force normal_load"},
        "frequency_hz max_abs periods steps_per_period error_estimate", scene="",
    )  # fmt: skip
    JSON: ClassVar = (
        "max_abs half_peak_to_peak mean harmonics periods steps_per_period error_estimate status seconds"
    )

    status: Annotated[MarchStatus, "How it ended."]
    max_abs: Annotated[FloatOrNaN, "Largest abs(x) of the observed DOF [m]."]
    half_peak_to_peak: Annotated[FloatOrNaN, "(max - min) / 2 [m]."]
    mean: Annotated[FloatOrNaN, "Mean [m]. In full stick it depends on the history, here a start from rest."]
    harmonics: Annotated[tuple[float, ...], "abs(mean) and the amplitudes of harmonics 1 to 10 [m]."]
    frequency_hz: Annotated[float, "Excitation frequency [Hz]."]
    time: Annotated[Real, "Instants of the samples of the last period [s], evenly spaced from 0, (n,)."]
    displacement: Annotated[Real, "Observed DOF [m], (n,)."]
    velocity: Annotated[Real, "Its velocity [m/s], (n,)."]
    contacts: Annotated[tuple[str, ...], "Names of the contacts; of the whole annulus in a cyclic scene."]
    slip: Annotated[Real, "Relative displacement [m], (n_contacts, n)."]
    contact_force: Annotated[Real, "Friction force [N], (n_contacts, n)."]
    normal_load: Annotated[Real, "Normal load (0 when separated) [N], (n_contacts, n)."]
    periods: Annotated[int, "Periods marched, of both step sizes."]
    steps_per_period: Annotated[int, "Steps of the finer run."]
    drift: Annotated[float, "How far the part that RATCHETS moves on in a period [m], else 0."]
    error_estimate: Annotated[
        FloatOrNaN,
        "Estimated error of `max_abs` relative to it: Richardson's from two step sizes, and what the "
        "transient has left to decay. It does not see the history a stuck contact remembers (its mean).",
    ]
    seconds: Annotated[float, "Time taken [s]."]

    @property
    def converged(self) -> bool:
        """The motion repeats within the tolerance."""
        return self.status is MarchStatus.CONVERGED

    def plot(self, ax: Axes | Sequence[Axes] | None = None, *, scene: Scene | None = None) -> Figure:
        """Draw the last period and its hysteresis loops.

        Parameters
        ----------
        ax : axes to draw into, else a new figure.
        scene : what was marched, for the title.
        """
        figure: Figure = self.VIEWS.call("figure", self, ax=ax, scene=scene)
        return figure

    def to_json(self) -> dict[str, Any]:
        """The result without its histories, for JSON; a number that does not exist is None."""
        drift = {"drift": self.drift} if self.status is MarchStatus.RATCHETS else {}
        return drift | self._json()


def describe(
    *,
    record: Record,
    coarse: Record,
    order: int,
    transient: float,
    periods: int,
    contacts: tuple[str, ...],
    frequency_hz: float,
    steps_per_period: int,
    status: MarchStatus,
    drift: float,
) -> MarchResult:
    """Read the result of a march from its records; the time it took is not in it.

    Parameters
    ----------
    record, coarse : Record
        Last period of the runs with the smaller and with twice the step; the same if there was one run.
    order : int
        Order of the steps.
    transient : float
        What the transient has left to decay, relative.
    contacts : tuple of str
        Names of the contacts.
    periods, frequency_hz, steps_per_period, status, drift
        As in `MarchResult`.
    """
    omega = 2.0 * math.pi * frequency_hz
    low, high = _extremes(record)
    max_abs = max(abs(low), abs(high))
    step_error = abs(max_abs - max(map(abs, _extremes(coarse)))) / (2.0**order - 1.0)
    spectrum = np.fft.rfft(record.x)[: N_HARMONICS + 1] / record.x.size
    harmonics = np.abs(spectrum) * np.array([1.0, *[2.0] * N_HARMONICS])
    return MarchResult(
        status=status,
        max_abs=max_abs,
        half_peak_to_peak=0.5 * (high - low),
        mean=float(spectrum[0].real),
        harmonics=tuple(harmonics.tolist()),
        frequency_hz=frequency_hz,
        time=np.arange(record.x.size) / (record.x.size * frequency_hz),
        displacement=record.x,
        velocity=record.v * omega,
        contacts=contacts,
        slip=record.slip,
        contact_force=record.force,
        normal_load=record.load,
        periods=periods,
        steps_per_period=steps_per_period,
        drift=drift,
        error_estimate=step_error / (max_abs or 1.0) + transient,
        seconds=math.nan,
    )


def of_harmonic(found: MarchResult, harmonic: int) -> MarchResult:
    """Return a result whose amplitudes are of one harmonic of the motion alone, which its samples tell."""
    size = 2.0 * abs(np.fft.rfft(found.displacement)[harmonic]) / found.displacement.size
    error = found.error_estimate * found.max_abs / size if size > 0.0 else math.nan
    return replace(found, max_abs=size, half_peak_to_peak=size, mean=0.0, error_estimate=error)


def _extremes(record: Record) -> tuple[float, float]:
    """Least and largest displacement of the period: of the cubics through samples and their slopes."""
    x, h = record.x, 2.0 * math.pi / record.x.size
    _, _, between = turning_points(np.append(x, x[:1]), h * np.append(record.v, record.v[:1]))
    values = np.concatenate([x, between])
    return float(values.min()), float(values.max())


def turning_points(x: Real, slopes: Real) -> tuple[Integer, Real, Real]:
    """Return where the cubics through samples turn between them.

    Parameters
    ----------
    x, slopes : samples and their slopes a step, (n + 1,).

    Returns
    -------
    Numbers of the steps, the places 0 to 1 within them, and the values there.
    """
    x0, x1, v0, v1 = x[:-1], x[1:], slopes[:-1], slopes[1:]
    turning = np.flatnonzero(v0 * v1 < 0.0)
    a = (2.0 * x0 + v0 - 2.0 * x1 + v1)[turning]
    b = (-3.0 * x0 - 2.0 * v0 + 3.0 * x1 - v1)[turning]
    v0, x0 = v0[turning], x0[turning]
    root = np.sqrt(np.maximum(b**2 - 3.0 * a * v0, 0.0))
    s = np.clip(-v0 / (b + np.where(v0 > 0.0, -root, root)), 0.0, 1.0)
    return turning, s, x0 + s * (v0 + s * (b + s * a))


class TransientStatus(Enum):
    """How a run ended; the value is a sentence for the user."""

    FINISHED = "The run is complete, within the tolerance."
    INACCURATE = (
        "The run is complete, but half the step changed the largest amplitude by more than the tolerance: "
        "give more steps per period, or a larger tolerance."
    )
    NOT_SETTLED = (
        "The motion at the first frequency does not repeat, and without damping none does: begin from rest, "
        "at another frequency, or give the structure some (damping_ratio = 0.001, say)."
    )
    STOPPED = "Stopped on request: what was run through until then."
    CHATTER = (
        "A contact changes its state without end at one instant: change the load, the stiffness or the rate "
        "a little."
    )
    NOT_FINITE = "The motion grows without bound: use more steps per period."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class TransientResult(Drawn):
    """The largest amplitude of a run and its envelope over time, n windows of at least one turn each."""

    VIEWS: ClassVar = Views("solver.views", "responses:transient", "motion:transient_figure")
    DATA: ClassVar = Data(
        "transient", {"time": "time frequency_hz high low", "rates": "rates rates_max_abs"},
        "max_abs at_hz at_seconds steps_per_period error_estimate", scene="scene",
    )  # fmt: skip
    JSON: ClassVar = (
        "scene dof max_abs at_hz at_seconds time frequency_hz high low begin_hz end_hz ramp_seconds "
        "ring_down_seconds steps_per_period error_estimate rates rates_max_abs status seconds"
    )

    scene: Annotated[str, "Name of the scene."]
    dof: Annotated[str, "The observed DOF."]
    status: Annotated[TransientStatus, "How it ended."]
    max_abs: Annotated[FloatOrNaN, "Largest abs(x) of the observed DOF in the run [m]."]
    at_hz: Annotated[FloatOrNaN, "Frequency of the excitation then [Hz]."]
    at_seconds: Annotated[FloatOrNaN, "Time of it since the run began [s]."]
    time: Annotated[Real, "Where each window of the envelope begins [s], (n,)."]
    frequency_hz: Annotated[Real, "Frequency of the excitation there [Hz], (n,)."]
    high: Annotated[Real, "Largest displacement in the window [m], (n,)."]
    low: Annotated[Real, "Least displacement in the window [m], (n,)."]
    begin_hz: Annotated[float, "Frequency where the run begins [Hz]."]
    end_hz: Annotated[float, "Frequency where it ends [Hz]."]
    ramp_seconds: Annotated[float, "Time from the one to the other [s]."]
    ring_down_seconds: Annotated[float, "Time after that without excitation [s]."]
    steps_per_period: Annotated[int, "Steps in a period of the highest frequency."]
    error_estimate: Annotated[
        FloatOrNaN, "Estimated error of `max_abs` relative to it, from a run with twice the step."
    ]
    seconds: Annotated[float, "Time taken [s]."]
    rates: Annotated[Real, "Rates of several runs [Hz/s], the fastest first, (m,); else none."] = field(
        default_factory=lambda: np.empty(0)
    )
    rates_max_abs: Annotated[Real, "Largest abs(x) of each [m], (m,)."] = field(
        default_factory=lambda: np.empty(0)
    )
