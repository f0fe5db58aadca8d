"""The highest amplitude of the observed DOF over the band: the local maxima that compete with it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from optim.criteria.criterion import Criterion, CriterionRow, Form, Judged, Key
from optim.criteria.key import PositiveNumber

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
            criterion, f"{what} at {peak.at:.6g} Hz", factor * peak.value,
            None if sensitivity is None else factor * sensitivity.peak(peak),
            at_hz=peak.at, bound=bound, weight=weight, second=_second(sensitivity, peak, factor),
        )
        for peak in peaks
        if peak.value >= COMPETES * peaks[0].value
    ]  # fmt: skip


def _second(sensitivity: Sensitivity | None, peak: Peak, factor: float) -> Callable[[], Real] | None:
    if sensitivity is None or not sensitivity.has_second:
        return None
    return partial(_times, factor, sensitivity, peak)


def _times(factor: float, sensitivity: Sensitivity, peak: Peak) -> Real:
    return factor * sensitivity.peak_second(peak)


def _rows(judged: Judged) -> list[CriterionRow]:
    """A row for every peak that competes."""
    weight = judged.weight(PEAK) * judged.case.weight
    return maxima(judged, PEAK, "peak", bound=judged.limit(PEAK), weight=weight)


PEAK = CRITERION = Criterion(
    name="peak",
    unit="m",
    help="The highest amplitude of the observed DOF over the band of any case; minimised times its `weight`.",
    rows=_rows,
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
