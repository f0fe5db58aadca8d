"""What the response to two base frequencies is returned as."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Annotated, ClassVar

from solver.arrays import FloatOrNaN, Integer, Real
from solver.results.base import Drawn
from solver.results.base import Data, Views

LINES = 40  # of the spectrum that are told


class QuasiPeriodicStatus(Enum):
    """How it ended; the value is a sentence a user can act on."""

    CONVERGED = "The response was found, within the tolerance."
    ACCURACY_NOT_REACHED = (
        "A response was found, but longer periods still change it by more than the tolerance: allow more "
        "`turns`, or a larger tolerance."
    )
    NOT_CONVERGED = (
        "No response was found: allow more `turns`, more harmonics, or change a frequency a little."
    )
    UNDAMPED = (
        "At one of the two frequencies there is a resonance and no damping, so that nothing bounds the "
        "response: give the structure some (damping_ratio = 0.001, say)."
    )
    STOPPED = "Stopped on request: what was known until then."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class QuasiPeriodic(Drawn):
    """The response to two frequencies f₁ and f₂ that are no multiples: its size, spectrum and section."""

    VIEWS: ClassVar = Views("stickslip.lab.quasi_periodic", "tables:quasi_periodic", "pictures:torus_figure")
    DATA: ClassVar = Data(
        "quasi-periodic", {"line": "line_first line_second line_hz line_amplitude",
        "section": "section section_velocity"},
        "frequency_hz second_hz max_abs half_peak_to_peak rms mean first_amplitude second_amplitude "
        "error_estimate", scene="scene",
        rows=("line",),
    )  # fmt: skip
    JSON: ClassVar = (
        "scene dof frequency_hz second_hz max_abs half_peak_to_peak rms mean first_amplitude second_amplitude"
        " repeats line_first line_second line_hz line_amplitude section section_velocity turns contacts flags"
        " n_harmonics error_estimate status seconds"
    )

    scene: Annotated[str, "Name of the scene."]
    dof: Annotated[str, "The observed DOF."]
    status: Annotated[QuasiPeriodicStatus, "How it ended."]
    frequency_hz: Annotated[float, "f₁, of the scene's own excitation [Hz]."]
    second_hz: Annotated[float, "f₂ [Hz]."]
    max_abs: Annotated[
        FloatOrNaN,
        "Largest abs(x) of the observed DOF [m]. Not unique when `flags` has ``mean_undetermined``, see "
        "`Solution`; `half_peak_to_peak` is then what `error_estimate` is of.",
    ]
    half_peak_to_peak: Annotated[FloatOrNaN, "(max x - min x) / 2 of it [m]."]
    rms: Annotated[FloatOrNaN, "Root mean square of it about its mean [m]."]
    mean: Annotated[FloatOrNaN, "Its mean [m]."]
    first_amplitude: Annotated[FloatOrNaN, "Amplitude at f₁ [m]."]
    second_amplitude: Annotated[FloatOrNaN, "Amplitude at f₂ [m]."]
    repeats: Annotated[
        bool, "Whether the ratio is one of whole numbers within `turns`: all is then of these very phases."
    ]
    line_first: Annotated[Integer, "k of the spectrum's lines, (n,), the largest first."]
    line_second: Annotated[Integer, "l of them, (n,)."]
    line_hz: Annotated[Real, "Their frequency k f₁ + l f₂ [Hz], (n,)."]
    line_amplitude: Annotated[Real, "Their amplitude [m], (n,)."]
    section: Annotated[Real, "x where the first force begins a turn, over the angle of the second [m], (m,)."]
    section_velocity: Annotated[Real, "Velocity there [m/s], (m,)."]
    turns: Annotated[
        tuple[tuple[int, int], ...],
        "Turns of the two frequencies in the long periods that the answer is between.",
    ]
    contacts: Annotated[dict[str, str], "What each contact does."]
    flags: Annotated[tuple[str, ...], "Those of the response of the long period, see `Solution`."]
    n_harmonics: Annotated[int, "Multiples of the faster frequency up to which all sums are kept."]
    error_estimate: Annotated[
        FloatOrNaN,
        "Estimated error of `max_abs` [m]: the change by the longer periods, and harmonics left out.",
    ]
    seconds: Annotated[float, "Time taken [s]."]
