"""The response to two base frequencies over the first: each point begins with what its neighbour does."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from typing import Annotated, ClassVar

import numpy as np

from solver.arrays import Real
from solver.errors import SettingError, check_count
from solver.jit.timer import clock
from stickslip.lab.quasi_periodic.quasi_periodic import Question, TorusWatch, check, respond, second_force
from stickslip.lab.quasi_periodic.quasi_periodic_result import QuasiPeriodic, QuasiPeriodicStatus
from solver.results.base import Drawn
from solver.results.base import Data, Views
from solver.results.watch import OnProgress, ShouldStop, part_of, shows_progress
from solver.scene.parameter_paths import check_frequency
from solver.scene.scene import Scene

MOST_POINTS = 2000


class TorusCurveStatus(Enum):
    """How a curve ended; the value is a sentence a user can act on."""

    COMPLETED = "Every response was found, within the tolerance."
    HOLES = (
        "Some responses are not known within the tolerance: those not found are empty, the others have a "
        "larger estimated error; allow more `turns`."
    )
    STOPPED = "Stopped on request: what is empty was not reached."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class QuasiPeriodicCurve(Drawn):
    """Responses to two frequencies at n values of the first one."""

    VIEWS: ClassVar = Views(
        "stickslip.lab.quasi_periodic", "tables:quasi_periodic", "pictures:torus_curve_figure"
    )
    DATA: ClassVar = Data(
        "quasi-periodic-curve", {
            "frequency_hz": "frequency_hz max_abs half_peak_to_peak rms first_amplitude second_amplitude "
            "error_estimate known repeats",
        }, "second_hz harmonics=n_harmonics", scene="scene",
    )  # fmt: skip
    JSON: ClassVar = (
        "scene dof frequency_hz second_hz max_abs half_peak_to_peak rms first_amplitude second_amplitude"
        " error_estimate known repeats n_harmonics reached status seconds"
    )

    scene: Annotated[str, "Name of the scene."]
    dof: Annotated[str, "The observed DOF."]
    status: Annotated[TorusCurveStatus, "How it ended."]
    frequency_hz: Annotated[Real, "f₁, of the scene's own excitation [Hz], (n,)."]
    second_hz: Annotated[float, "f₂ [Hz]."]
    max_abs: Annotated[Real, "Largest abs(x) of the observed DOF [m], NaN where no response was found, (n,)."]
    half_peak_to_peak: Annotated[Real, "(max x - min x) / 2 of it [m], (n,)."]
    rms: Annotated[Real, "Root mean square of it about its mean [m], (n,)."]
    first_amplitude: Annotated[Real, "Amplitude at f₁ [m], (n,)."]
    second_amplitude: Annotated[Real, "Amplitude at f₂ [m], (n,)."]
    error_estimate: Annotated[Real, "Estimated error of `max_abs` [m], (n,)."]
    known: Annotated[tuple[bool, ...], "Whether each is known within the tolerance, (n,)."]
    repeats: Annotated[
        tuple[bool, ...], "Whether the ratio is one of whole numbers within `turns`: of these phases, (n,)."
    ]
    n_harmonics: Annotated[int, "Multiples of the faster frequency up to which all sums are kept."]
    seconds: Annotated[float, "Time taken [s]."]


@shows_progress("quasi-periodic")
def quasi_periodic_curve(
    scene: Scene,
    *,
    frequency_hz: float,
    to_hz: float,
    second_hz: float,
    amplitude: float,
    points: int = 41,
    dof: str | None = None,
    phase: float = 0.0,
    engine_order: int | None = None,
    harmonics: int = 7,
    turns: int = 90,
    tolerance: float = 2e-3,
    on_progress: OnProgress = None,
    should_stop: ShouldStop = None,
) -> QuasiPeriodicCurve:
    """Find the responses to two frequencies over the first of them.

    Parameters
    ----------
    scene, second_hz, amplitude, dof, phase, engine_order, harmonics, turns, tolerance : as of
        `quasi_periodic`.
    frequency_hz, to_hz : first and last value of the scene's own frequency [Hz].
    points : values of it, evenly, ends included.
    on_progress : called with the fraction done and the points found.
    should_stop : asked now and then; True ends it with the status STOPPED.

    Raises
    ------
    SettingError
        As `quasi_periodic`; ends that are equal, or points that are no whole number from 2 on.
    """
    began = clock()
    hertz = curve_points(frequency_hz, to_hz, points)
    for each in hertz:
        if each != second_hz:
            check(scene, float(each), second_hz, harmonics, turns, tolerance)
    second = second_force(scene, amplitude=amplitude, dof=dof, phase=phase, engine_order=engine_order)
    found: list[QuasiPeriodic | None] = []
    start = None
    for i, f in enumerate(hertz.tolist()):
        if should_stop is not None and should_stop():
            break
        if f == second_hz:  # both forces are one there, whose phases decide: no torus
            found.append(None)
            continue
        watch = TorusWatch(part_of(on_progress, i / points, (i + 1) / points, i), should_stop)
        question = Question(scene.at_frequency(f), second, f, second_hz, harmonics)
        one, near = respond(question, turns, tolerance, start, watch, clock())
        start = near or start
        found.append(one)
    return _curve(scene, hertz, second_hz, found, harmonics, began)


def curve_points(frequency_hz: float, to_hz: float, points: int) -> Real:
    """Return the frequencies of a curve [Hz], (points,).

    Raises
    ------
    SettingError
        Ends that are no frequencies or equal, points that are no whole number from 2 on.
    """
    ends = check_frequency("frequency_hz", frequency_hz), check_frequency("to_hz", to_hz)
    if ends[0] == ends[1]:
        raise SettingError("to_hz", to_hz, "must differ from `frequency_hz`")
    return np.linspace(*ends, check_count("points", points, 2, MOST_POINTS))


def _curve(
    scene: Scene, hertz: Real, second_hz: float, found: list[QuasiPeriodic | None], harmonics: int,
    began: float,
) -> QuasiPeriodicCurve:  # fmt: skip
    """Return the curve of what was found, as far as it goes."""
    stopped = len(found) < hertz.size or any(
        one is not None and one.status is QuasiPeriodicStatus.STOPPED for one in found
    )
    every = [*found, *[None] * (hertz.size - len(found))]

    def column(name: str) -> Real:
        return np.array([math.nan if one is None else getattr(one, name) for one in every], np.float64)

    known = tuple(one is not None and one.reached for one in every)
    status = TorusCurveStatus.COMPLETED if all(known) else TorusCurveStatus.HOLES
    return QuasiPeriodicCurve(
        scene=scene.name, dof=scene.observe.dof, frequency_hz=hertz, second_hz=second_hz,
        status=TorusCurveStatus.STOPPED if stopped else status, max_abs=column("max_abs"),
        half_peak_to_peak=column("half_peak_to_peak"), rms=column("rms"),
        first_amplitude=column("first_amplitude"), second_amplitude=column("second_amplitude"),
        error_estimate=column("error_estimate"), known=known,
        repeats=tuple(one is not None and one.repeats for one in every), n_harmonics=harmonics,
        seconds=clock() - began,
    )  # fmt: skip
