"""Parts of results that no study gives by itself, in a few words with units."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from solver.continuation.branch import BranchStatus
from solver.results.known import Measured
from solver.results.told import Summary
from solver.results.units import duration, hertz, length, number, span

if TYPE_CHECKING:
    from solver.modes.peaks.performance import PerformanceCurve
    from solver.response.stability.multipliers import Stability
    from solver.studies.blades import BladeAmplitudes, BladePeaks
    from solver.studies.peaks.track_results import LeastPeak


def of_performance(curve: PerformanceCurve) -> Iterator[Summary]:
    """The least peak over the loads, and the range of the curve."""
    pairs: list[tuple[str, str]] = []
    load, peak = curve.least
    if math.isfinite(peak):
        pairs.append(("least peak", f"{length(peak)} with {number(load)} times the loads"))
    if curve.excitation.size:
        low, high = float(curve.excitation.min()), float(curve.excitation.max())
        pairs.append(("excitation", f"from {span(low, high, '')} times the scene's"))
    title = f"{curve.mode.scene.name}, mode {curve.mode.mode}"
    yield Summary(title, [*pairs, ("status", curve.mode.status.value)])


def of_least(best: LeastPeak) -> Iterator[Summary]:
    """The least highest peak, what holds it, and what else was met."""
    pairs: list[tuple[str, str]] = []
    if math.isfinite(best.at):
        pairs.append(("least peak", f"{length(best.peak)} at {number(best.at)}"))
        pairs.append(("peaks there", ", ".join(hertz(one.frequency) for one in best.active)))
    if best.plateau is not None:
        low, high = best.plateau
        pairs.append(("the same from", f"{span(low, high, '')}, chosen by: {best.chosen_by}"))
    # Of what is not proven a peak was followed to there, and a higher one may stand beside it.
    for proven, name, bound in ((True, "other minima", ""), (False, "perhaps other minima", "at least ")):
        others = [one for one in best.basins[1:] if one.proven is proven]
        if others:
            told = [f"{bound}{length(one.peak)} at {number(one.at)}" for one in others]
            pairs.append((name, "; ".join(told)))
    pairs += [("responses", f"{best.sweeps}, the work of {number(best.work, 3)}")]
    pairs.append(("time", duration(best.seconds)))
    scene = "" if best.branch is None else f"of {best.branch.scene.name}"
    yield Summary(f"highest peak {scene}".rstrip(), pairs)


def of_blade_peaks(peaks: BladePeaks) -> Iterator[Summary]:
    """The highest blade, the least, and those whose branch did not reach the end."""
    known = peaks.value[np.isfinite(peaks.value)]
    pairs: list[tuple[str, str]] = []
    if known.size:
        at = int(np.nanargmax(peaks.value))
        pairs.append(("highest", f"{length(known.max())} at {hertz(peaks.at_hz[at])}, blade {at}"))
        pairs.append(("lowest", length(known.min())))
    pairs.append(("blades", str(peaks.value.size)))
    reached = BranchStatus.COMPLETED
    ended = next((one for one in peaks.status if one is not reached), reached)
    yield Summary(peaks.dof, [*pairs, ("status", ended.value)])


def of_amplitudes(blades: BladeAmplitudes) -> Iterator[Summary]:
    """The blade that moves most, and the one that moves least."""
    pairs = (
        ("largest", f"{length(blades.largest)}, blade {blades.worst}"),
        ("smallest", length(float(blades.max_abs.min()))),
        ("blades", str(blades.max_abs.size)),
    )
    yield Summary(Measured(dof=blades.dof).name, pairs)


def of_stability(found: Stability) -> Iterator[Summary]:
    """Whether it is stable, and the largest multiplier."""
    pairs: list[tuple[str, str]] = [
        ("stable", "yes" if found.stable else "no"),
        ("largest multiplier", f"{number(found.radius)} in modulus"),
        ("multipliers", f"{found.multipliers.size}, and {found.neutral} that are 1 by construction"),
        ("time", duration(found.seconds)),
    ]
    yield Summary(f"at {hertz(found.frequency_hz)}", [*pairs, ("status", found.growth.value)])
