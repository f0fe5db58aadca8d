"""How well the highest peak of a branch is known: the one place where results get it from."""

from __future__ import annotations

import math
from dataclasses import replace

from solver.balance.workspace import Workspace
from solver.continuation.branch import Branch
from solver.continuation.extrema.error_estimate import ErrorEstimator
from solver.continuation.peak_certificate import unsettled
from solver.response import band_end
from solver.response.solution import HISTORY_DEPENDENT, MEAN_UNDETERMINED, Solution
from solver.response.solve import peak_response
from solver.results.known import Known
from solver.results.measures import HALF_PEAK_TO_PEAK

_OPEN = (MEAN_UNDETERMINED, HISTORY_DEPENDENT)


def known_of(branch: Branch) -> Known:
    """Return how well the highest peak of a branch is known, `Branch.known`.

    Where the mean of the peak is free, it is judged by half peak to peak: max|x| depends on the history.
    So it is where the scene observes half peak to peak.
    """
    peak = branch.peak
    if peak is None:
        return Known(flags=branch.flags)
    there = peak_response(branch)
    known = Known(
        peak_max_abs=peak.value, error_estimate=branch.error_estimate,
        flags=tuple(dict.fromkeys((*branch.flags, *(flag for flag in there.flags if flag in _OPEN)))),
        notes=band_end.of_branch(branch), peaks_open=tuple(unsettled([branch.peak_certificate])),
    )  # fmt: skip
    if branch.balance.scene.observe.centred:
        return replace(
            known, measure=HALF_PEAK_TO_PEAK, peak_max_abs=there.max_abs, error_estimate=math.nan,
            peak_half_peak_to_peak=peak.value, half_peak_to_peak_error=branch.error_estimate,
        )  # fmt: skip
    if MEAN_UNDETERMINED not in there.flags:
        return known
    at = float(branch.balance.parameter.inside(peak.at))
    error = ErrorEstimator(Workspace.of(branch.balance)).at(peak.solution, at, across=peak.interior)
    return replace(
        known, measure=HALF_PEAK_TO_PEAK, peak_half_peak_to_peak=there.half_peak_to_peak,
        half_peak_to_peak_error=error.half_peak_to_peak,
    )  # fmt: skip


def known_of_solution(solution: Solution) -> Known:
    """Return how well the amplitude of one response is known."""
    flags = tuple(flag for flag in solution.flags if flag not in ("all_stuck", "separation"))
    if not solution.converged:
        return Known(flags=flags)
    if MEAN_UNDETERMINED in flags or solution.scene.observe.centred:
        return Known(
            measure=HALF_PEAK_TO_PEAK, peak_max_abs=solution.max_abs,
            peak_half_peak_to_peak=solution.half_peak_to_peak,
            half_peak_to_peak_error=solution.error_estimate, flags=flags,
        )  # fmt: skip
    return Known(peak_max_abs=solution.max_abs, error_estimate=solution.error_estimate, flags=flags)


def relative_sum(*parts: Known) -> float:
    """Return the relative error of a product or a ratio of peaks; NaN if one of them is not known."""
    total = sum(part.relative for part in parts)
    return total if math.isfinite(total) else math.nan
