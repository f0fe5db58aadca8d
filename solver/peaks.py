"""Peaks of a branch and the band above a limit, polished on the branch itself.

Between two points of a branch a maximum of the amplitude shows as a change of sign of its slope along the
arc, a band edge as a change of sign of amplitude − limit; both are refined by solving on the arc between the
points, so that folds need no special care.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solver.branch import Band, Edge, Peak
from solver.fourier import Real
from solver.kernels.observe import MAX_ABS, MEASURES, SLOPE
from solver.kernels.refine import EDGE, PEAK, refine
from solver.parameter import Kind
from solver.workspace import Workspace

HALF_POWER = 1.0 / math.sqrt(2.0)
# A maximum below this share of the highest point found is left at the resolution of the branch: polishing it
# would cost without a use, since it competes with nothing.
WORTH_POLISHING = 0.5
_MOST_ITERATIONS = 12


@dataclass(frozen=True, slots=True, kw_only=True)
class Points:
    """The arrays of a branch that peaks are looked for in; see `solver.branch.Branch`."""

    solutions: Real
    tangents: Real
    measures: Real


def find_peaks(workspace: Workspace, points: Points) -> tuple[tuple[Peak, ...], int]:
    """Return every local maximum of max|x|, highest first, ends included, and the Newton iterations spent."""
    amplitude, slope = points.measures[:, MAX_ABS], points.measures[:, SLOPE]
    if amplitude.size == 0:
        return (), 0
    outside = workspace.balance.parameter.outside
    found, spent = [], 0
    top = amplitude.max()
    for i in range(amplitude.size - 1):
        if not (slope[i] > 0.0 >= slope[i + 1]):
            continue
        highest = i if amplitude[i] > amplitude[i + 1] else i + 1
        point, value = points.solutions[highest], float(amplitude[highest])
        if value >= WORTH_POLISHING * top:
            length = _length(points, i)
            polished = _refine(workspace, points, i, PEAK, 0.0, slope[i] * length, slope[i + 1] * length)
            spent += polished[2]
            # Where polishing fails, or a kink is the maximum, the best converged point stands.
            if polished[0] is not None and polished[1] >= value:
                point, value = polished[0], polished[1]
        found.append(
            Peak(value=value, at=float(outside(point[-1])), solution=point[:-1].copy(), interior=True)
        )
    for end, falls in ((0, slope[0] <= 0.0), (amplitude.size - 1, slope[-1] >= 0.0)):
        if falls or amplitude.size == 1:
            point = points.solutions[end]
            found.append(
                Peak(
                    value=float(amplitude[end]), at=float(outside(point[-1])), solution=point[:-1].copy(),
                    interior=False,
                )
            )  # fmt: skip
    return tuple(sorted(found, key=lambda peak: -peak.value)), spent


def find_band(workspace: Workspace, points: Points, limit: float) -> tuple[Band, int]:
    """Return where the amplitude exceeds `limit` [m] (anywhere on the branch), and the iterations spent."""
    amplitude, place = points.measures[:, MAX_ABS], points.solutions[:, -1]
    above = amplitude > limit
    crossings, spent = [], 0
    for i in np.flatnonzero(above[:-1] != above[1:]):
        gap = amplitude[i : i + 2] - limit
        point, _, iterations = _refine(workspace, points, int(i), EDGE, limit, gap[0], gap[1])
        spent += iterations
        if point is None:
            # Between two converged points the straight line stands in; its error is that of the branch.
            share = gap[0] / (gap[0] - gap[1])
            point = points.solutions[i] + share * (points.solutions[i + 1] - points.solutions[i])
        crossings.append((int(i), point))
    pieces = _pieces(place, above, crossings)
    outside = workspace.balance.parameter.outside
    merged = tuple((float(outside(low)), float(outside(high))) for low, high in _merge(pieces))
    edges = []
    for _, point in crossings:
        at = float(outside(point[-1]))
        for low, high in merged:
            if at in (low, high):
                edges.append(Edge(at=at, solution=point[:-1].copy(), opens=at == low))
    width = float(sum(high - low for low, high in merged))
    return Band(limit=limit, width=width, intervals=merged, edges=tuple(edges)), spent


def _pieces(
    place: Real, above: NDArray[np.bool_], crossings: list[tuple[int, Real]]
) -> list[tuple[float, float]]:
    """Return the stretches of λ passed above the limit, segment by segment of the branch."""
    at = {i: float(point[-1]) for i, point in crossings}
    pieces = []
    for i in range(place.size - 1):
        if not (above[i] or above[i + 1]):
            continue
        ends = (
            at.get(i, float(place[i])) if not above[i] else float(place[i]),
            at.get(i, float(place[i + 1])) if not above[i + 1] else float(place[i + 1]),
        )
        pieces.append((min(ends), max(ends)))
    return pieces


def band_limit(limit: float | None, peaks: tuple[Peak, ...], kind: Kind) -> float | None:
    """Return the limit of the band: the one asked for, else half power; None where a band has no meaning."""
    if not peaks or kind is not Kind.FREQUENCY:
        return None
    return limit if limit is not None else peaks[0].value * HALF_POWER


def _merge(intervals: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return the union of intervals (a folded branch passes a frequency more than once)."""
    merged: list[tuple[float, float]] = []
    for low, high in sorted(intervals):
        if merged and low <= merged[-1][1] * (1.0 + 1e-12):
            merged[-1] = (merged[-1][0], max(merged[-1][1], high))
        else:
            merged.append((low, high))
    return merged


def _length(points: Points, i: int) -> float:
    """Return the chord from point i to the next, measured along the unit tangents at its ends."""
    chord = points.solutions[i + 1] - points.solutions[i]
    size = np.abs(chord) @ np.abs(points.tangents[i]) / (points.tangents[i] @ points.tangents[i])
    return float(size)


def _refine(
    workspace: Workspace, points: Points, i: int, what: int, level: float, g_left: float, g_right: float
) -> tuple[Real | None, float, int]:
    """Polish between points i and i + 1; return (point or None, its max|x|, iterations)."""
    left, right = points.solutions[i], points.solutions[i + 1]
    chord = right - left
    observed, values = np.zeros(workspace.balance.n_coefficients), np.zeros(MEASURES)
    slopes = []
    for tangent in (points.tangents[i], points.tangents[i + 1]):
        # The tangent as the derivative by the share of the chord, in the scaling of the chord itself.
        weights = np.full(chord.size, 1.0 / max(np.abs(left[:-1]).max(initial=0.0) ** 2, 1e-300))
        weights[-1] = 1.0 / max(chord[-1] ** 2, 1e-300)
        along = (weights * chord) @ tangent
        slopes.append(tangent * ((weights * chord) @ chord / along) if along != 0.0 else chord)
    good, point, iterations = refine(
        workspace.system, workspace.linear, workspace.point, left.copy(), slopes[0], right.copy(), slopes[1],
        what, level, g_left, g_right, _MOST_ITERATIONS, observed, values,
    )  # fmt: skip
    if not good or not np.isfinite(values[MAX_ABS]):
        return None, math.nan, int(iterations)
    return point, float(values[MAX_ABS]), int(iterations)
