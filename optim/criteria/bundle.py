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

from optim.criteria.criterion import Row
from optim.criteria.linearised import Model
from optim.problem.variables import Real

ROUNDING = 1e-9  # relative, of a row between two evaluations
SAME = 0.2  # share of the change of slope by which the trapezoidal rule may miss a row that is the same


def with_cuts(model: Model, others: Iterable[Model], reach: float) -> Model:
    """Return a model with the rows of other designs that it does not have itself.

    Parameters
    ----------
    model : of the present design.
    others : models of designs evaluated before.
    reach : scaled distance up to which they are used.
    """
    mine = _Lines(model.rows, model.heights, model.slopes)
    limits = _Lines(model.limited, model.excess, model.excess_slopes)
    groups, units = list(model.groups), list(model.units)
    for other in others:
        back = model.z - other.z
        if not 0.0 < np.abs(back).max() <= reach:
            continue
        for i, row in enumerate(other.rows):
            top = model.heights[model.groups == other.groups[i]].max()
            if mine.take(row, other.heights[i], other.slopes[i], back, top):
                groups.append(other.groups[i])
        for j, row in enumerate(other.limited):
            if limits.take(row, other.excess[j], other.excess_slopes[j], back, model.excess.max()):
                units.append(other.units[j])
    return replace(
        model, rows=tuple(mine.rows), heights=np.array(mine.values), slopes=mine.table(model.z.size),
        groups=np.array(groups), limited=tuple(limits.rows), excess=np.array(limits.values),
        excess_slopes=limits.table(model.z.size), units=np.array(units),
    )  # fmt: skip


class _Lines:
    """Rows with their values and slopes at the present design."""

    def __init__(self, rows: tuple[Row, ...], values: Real, slopes: Real) -> None:
        self.rows, self.values, self.slopes = list(rows), list(values), list(slopes)
        self._own = len(rows)

    def table(self, n: int) -> Real:
        """Return the slopes, (rows, n)."""
        return np.array(self.slopes).reshape(-1, n)

    def take(self, row: Row, value: float, slope: Real, back: Real, top: float) -> bool:
        """Add a row seen `back` from here as a cut, unless one of the present design is the same."""
        if self._known(row, value, slope, back):
            return False
        self.rows.append(row)
        self.slopes.append(slope)
        # Never above what the present design shows.
        self.values.append(float(top - abs(top - (value + slope @ back))))
        return True

    def _known(self, row: Row, value: float, slope: Real, back: Real) -> bool:
        """Return whether the trapezoidal rule leads from the row there to one here: they are one."""
        for mine, its, here in zip(
            self.rows[: self._own], self.slopes[: self._own], self.values[: self._own], strict=True
        ):
            if (mine.quantity, mine.case) != (row.quantity, row.case):
                continue
            missed = abs(here - value - 0.5 * float((its + slope) @ back))
            if missed <= SAME * abs(0.5 * float((its - slope) @ back)) + ROUNDING * abs(value):
                return True
        return False
