"""Rows of nearby designs as cuts: what a design does not show of the rows it is about to meet.

A peak that is about to appear, the trough of the motion that is about to become larger than its crest: at a
design nothing tells of them, and a step that meets them fails however short it is. Their linearisations at
the nearby designs where they were seen are kept as rows, lowered by how far they miss the present design, as
in bundle methods for nonconvex functions: Kiwiel, Methods of Descent for Nondifferentiable Optimization
(Springer 1985), section 3.2.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from optim.model import Model
from optim.rows import Row
from optim.variables import Real

ALIKE = 0.3  # relative distance of two slopes below which a cut tells nothing new


def with_cuts(model: Model, others: Iterable[Model], reach: float) -> Model:
    """Return a model with the rows of other designs that it does not have itself.

    Parameters
    ----------
    model : of the present design.
    others : models of designs evaluated before.
    reach : scaled distance up to which they are used.
    """
    rows, heights, slopes = list(model.rows), list(model.heights), list(model.slopes)
    groups, limited = list(model.groups), list(model.limited)
    excess, excess_slopes, units = list(model.excess), list(model.excess_slopes), list(model.units)
    for other in others:
        back = model.z - other.z
        if not 0.0 < np.abs(back).max() <= reach:
            continue
        for i, row in enumerate(other.rows):
            top = model.heights[model.groups == other.groups[i]].max()
            if _new(row, other.slopes[i], rows, slopes):
                rows.append(row)
                slopes.append(other.slopes[i])
                heights.append(_lowered(other.heights[i] + other.slopes[i] @ back, top))
                groups.append(other.groups[i])
        for j, row in enumerate(other.limited):
            if _new(row, other.excess_slopes[j], limited, excess_slopes):
                limited.append(row)
                excess_slopes.append(other.excess_slopes[j])
                value = float(other.excess[j] + other.excess_slopes[j] @ back)
                excess.append(_lowered(value, model.excess.max()))
                units.append(other.units[j])
    return replace(
        model, rows=tuple(rows), heights=np.array(heights), slopes=np.array(slopes).reshape(-1, model.z.size),
        groups=np.array(groups), limited=tuple(limited), excess=np.array(excess),
        excess_slopes=np.array(excess_slopes).reshape(-1, model.z.size), units=np.array(units),
    )  # fmt: skip


def _new(row: Row, slope: Real, rows: list[Row], slopes: list[Real]) -> bool:
    """Return whether no row of the same quantity and case has much the same slope."""
    size = float(np.linalg.norm(slope))
    return all(
        (mine.quantity, mine.case) != (row.quantity, row.case)
        or float(np.linalg.norm(slope - its)) > ALIKE * max(size, float(np.linalg.norm(its)))
        for mine, its in zip(rows, slopes, strict=True)
    )


def _lowered(value: float, top: float) -> float:
    """Return the height of a cut: never above what the present design shows."""
    return float(top - abs(top - value))
