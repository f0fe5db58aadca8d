"""Rows of the amplitude: the local maxima of a response that compete with its highest."""

from __future__ import annotations

from collections.abc import Callable

from optim.criteria.criterion import Criterion, CriterionRow, Judged
from optim.criteria.response_gradients import Sensitivity
from optim.problem.variables import Real
from solver.continuation.peaks import Peak

# Peaks below this share of the highest are not handed to the optimiser: within one step they cannot lead.
COMPETES = 0.6


def maxima(
    judged: Judged, criterion: Criterion, what: str, *, bound: float | None, weight: float = 0.0
) -> list[CriterionRow]:
    """Return a row for every local maximum that competes, as `what` at its frequency.

    At a maximum over the frequency ∂a/∂ω = 0: its derivative by a parameter is the partial one there.
    """
    peaks, sensitivity = judged.branch.peaks, judged.sensitivity
    return [
        judged.row(
            criterion, f"{what} at {peak.at:.6g} Hz", peak.value,
            None if sensitivity is None else sensitivity.peak(peak),
            at_hz=peak.at, bound=bound, weight=weight, second=_second(sensitivity, peak),
        )
        for peak in peaks
        if peak.value >= COMPETES * peaks[0].value
    ]  # fmt: skip


def _second(sensitivity: Sensitivity | None, peak: Peak) -> Callable[[], Real] | None:
    if sensitivity is None or not sensitivity.has_second:
        return None
    return lambda: sensitivity.peak_second(peak)
