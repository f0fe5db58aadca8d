"""The highest amplitude of the observed DOF over the band, and the width of the resonance band.

The band is where the amplitude is above a limit, or above half power of the peak.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from optim.criteria.criterion import Criterion, CriterionRow, Form, Judged, Key
from optim.criteria.key import FrequencyHz, PositiveNumber
from solver.results import units

if TYPE_CHECKING:
    from optim.criteria.response_gradients import Sensitivity
    from optim.problem.variables import Real
    from solver.continuation.branch import Peak


# Peaks below this share of the highest are not handed to the optimiser: within one step they cannot lead.
COMPETES = 0.6


def maxima(
    judged: Judged, criterion: Criterion, what: str, *, bound: float | None, weight: float = 0.0,
    factor: float = 1.0,
) -> list[CriterionRow]:  # fmt: skip
    """Return a row for every local maximum that competes, as `what` at its frequency, times `factor`.

    At a maximum over the frequency ∂a/∂ω = 0: its derivative by a parameter is the partial one there.
    """
    peaks, sensitivity = judged.branch.peaks, judged.sensitivity
    return [
        judged.row(
            criterion, f"{what} at {units.hertz(peak.at)}", factor * peak.value,
            None if sensitivity is None else factor * sensitivity.peak(peak),
            at_hz=peak.at, bound=bound, weight=weight, second=_peak_second(sensitivity, peak, factor),
        )
        for peak in peaks
        if peak.value >= COMPETES * peaks[0].value
    ]  # fmt: skip


def _peak_second(sensitivity: Sensitivity | None, peak: Peak, factor: float) -> Callable[[], Real] | None:
    if sensitivity is None or not sensitivity.has_second:
        return None
    return partial(_times, factor, sensitivity, peak)


def _times(factor: float, sensitivity: Sensitivity, peak: Peak) -> Real:
    return factor * sensitivity.peak_second(peak)


def _peak_rows(judged: Judged) -> list[CriterionRow]:
    """A row for every peak that competes."""
    weight = judged.weight(PEAK) * judged.case.weight
    return maxima(judged, PEAK, "peak", bound=judged.limit(PEAK), weight=weight)


PEAK = Criterion(
    name="peak",
    unit="m",
    help="The highest amplitude of the observed DOF over the band of any case; minimised times its `weight`.",
    rows=_peak_rows,
    weight="peak",
    keys=(
        Key(
            name="max_peak", annotation=PositiveNumber, form=Form.NUMBER, flag="--max-peak", metavar="A",
            help="Largest amplitude allowed [m].",
        ),
    ),
    always=True,
    each_blade=True,
    limit_name="peak limit",
    with_place=False,
)  # fmt: skip


def _band_rows(judged: Judged) -> list[CriterionRow]:
    """The row of the band of a response that has one."""
    import numpy as np

    from solver.continuation.extrema.extrema import HALF_POWER

    branch, sensitivity = judged.branch, judged.sensitivity
    if branch.band is None:
        return []
    slope = None
    if sensitivity is not None:
        dlimit = np.zeros(len(judged.problem.paths))
        if judged.problem.limit is None:
            dlimit = HALF_POWER * sensitivity.peak(branch.peaks[0])
        slope = sensitivity.band(branch.band.edges, dlimit)
    what = f"band above {units.quantity(branch.band.limit, 'm')}"
    return [
        judged.row(
            BAND, what, branch.band.width, slope, bound=judged.limit(BAND), second=_band_second(judged)
        )
    ]


def _band_second(judged: Judged) -> Callable[[], Real] | None:
    branch, sensitivity = judged.branch, judged.sensitivity
    if sensitivity is None or branch.band is None or not sensitivity.has_second:
        return None
    edges, highest = branch.band.edges, None if judged.problem.limit is not None else branch.peaks[0]
    return partial(sensitivity.band_second, edges, highest)


BAND = Criterion(
    name="band",
    unit="Hz",
    help="The width of the resonance band of any case: the frequencies at which the amplitude is above "
    "`limit`, or above half power of the peak if that is left out.",
    rows=_band_rows,
    weight="band",
    keys=(
        Key(
            name="max_band_hz", annotation=FrequencyHz, form=Form.NUMBER, flag="--max-band", metavar="HZ",
            help="Largest width of the resonance band allowed [Hz].",
            option_help="Widest resonance band allowed [Hz].",
        ),
    ),
    always=True,
    each_blade=True,
    limit_name="band limit",
    with_place=False,
    on_a_front=False,
)  # fmt: skip

CRITERION = (PEAK, BAND)
