"""What a run through a range of frequencies returns."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Annotated, ClassVar

import numpy as np

from solver.arrays import FloatOrNaN, Real
from solver.results.base import Drawn
from solver.results.views import Data, Views


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
