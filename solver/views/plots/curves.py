"""What is drawn: amplitude curves and what is marked on them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Self

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Real
from solver.results.known import OF_X, Measured

if TYPE_CHECKING:
    from solver.continuation.branch import AnyBranch

Intervals = tuple[tuple[float, float], ...]
Marks = tuple[tuple[str, float, float], ...]  # kind, parameter value, amplitude [m]


@dataclass(frozen=True, slots=True, kw_only=True)
class Response:
    """An amplitude curve and what is marked on it."""

    scene: Annotated[str, "Its name."]
    parameter: Annotated[str, "Path of the parameter."]
    values: Annotated[Real, "Parameter values in user units, (P,)."]
    amplitude: Annotated[Real, "Of what is measured [m], (P,)."]
    measured: Annotated[Measured, "What it is of."] = OF_X
    peak: Annotated[
        tuple[float, float] | None,
        "Parameter value and amplitude [m] of the highest peak; it is a point of the curve.",
    ] = None
    limit: Annotated[float | None, "Amplitude [m] at which the band is measured."] = None
    intervals: Annotated[Intervals, "Where the amplitude is above it."] = ()
    unstable: Annotated[NDArray[np.bool_] | None, "Points at which a perturbation grows, (P,) of bool."] = (
        None
    )
    marks: Annotated[Marks, "Folds, branch points and an early end."] = ()

    @classmethod
    def of_branch(cls, branch: AnyBranch) -> Self:
        """The curve of a branch with at least one point."""
        peak = None if branch.peak is None else (branch.peak.at, branch.peak.value)
        found = branch.bifurcations
        values, amplitude, unstable = with_peak(branch.values, branch.amplitude, peak, found.unstable)
        band = branch.band
        return cls(
            scene=branch.scene.name,
            parameter=branch.parameter,
            values=values,
            amplitude=amplitude,
            measured=branch.scene.measured,
            peak=peak,
            limit=None if band is None else band.limit,
            intervals=() if band is None else band.intervals,
            unstable=unstable,
            marks=tuple((mark.kind.name.lower(), mark.at, mark.amplitude) for mark in found.marks),
        )


def with_peak(
    values: Real, amplitude: Real, peak: tuple[float, float] | None,
    unstable: NDArray[np.bool_] | None = None,
) -> tuple[Real, Real, NDArray[np.bool_]]:  # fmt: skip
    """The points of a curve with its polished peak among them, where the neighbours enclose it."""
    unstable = np.zeros(values.size, bool) if unstable is None else unstable
    if peak is None or peak[1] <= amplitude.max():
        return values, amplitude, unstable
    at, height = peak
    enclosing = np.flatnonzero((values[:-1] - at) * (values[1:] - at) <= 0.0)
    if enclosing.size == 0:
        return values, amplitude, unstable
    index = 1 + enclosing[np.argmax(np.maximum(amplitude[enclosing], amplitude[enclosing + 1]))]
    between = unstable[index - 1] and unstable[index]
    return (
        np.insert(values, index, at),
        np.insert(amplitude, index, height),
        np.insert(unstable, index, between),
    )


def above(values: Real, amplitude: Real, limit: float) -> Intervals:
    """Intervals of the parameter in which the polyline through the points is above a limit, ascending."""
    pieces = []
    for i in range(values.size - 1):
        low, high = values[i], values[i + 1]
        first, second = amplitude[i] - limit, amplitude[i + 1] - limit
        if first <= 0.0 and second <= 0.0:
            continue
        if first * second < 0.0:
            crossing = low + (high - low) * first / (first - second)
            low, high = (low, crossing) if first > 0.0 else (crossing, high)
        pieces.append((float(min(low, high)), float(max(low, high))))
    merged: list[tuple[float, float]] = []
    for low, high in sorted(pieces):
        if merged and low <= merged[-1][1]:
            merged[-1] = (merged[-1][0], max(merged[-1][1], high))
        else:
            merged.append((low, high))
    return tuple(merged)
