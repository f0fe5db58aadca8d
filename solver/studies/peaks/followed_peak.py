"""A peak of the response as a curve over the parameter that it is followed in.

Steps are of z; one is taken where the derivatives at both its ends fit together.
"""

from __future__ import annotations

import math

import numpy as np

from solver.contacts.kernels.system import System
from solver.continuation.extrema.kernels.peak_continuation import COLUMNS, Ridge, Z, begin_track, step_track
from solver.continuation.extrema.kernels.peak_state import Summit
from solver.studies.peaks.seeds import LineEnd, Seed

MOST_ROWS = 600
_EASY, _SHORTER = 4, 0.8  # Newton steps beyond which the next step is shorter, and by how much


class FollowedPeak:
    """A peak as it stands at its last row.

    Attributes
    ----------
    found : rows, solutions and tangents of `step_track`, and `count` of them.
    end : why it goes no further.
    """

    def __init__(self, system: System, summit: Summit, ridge: Ridge, seed: Seed) -> None:
        self._system, self._summit, self._ridge, nt = system, summit, ridge, seed.u.size
        self._forward, self._smooth = math.copysign(1.0, ridge.stop - ridge.start), False
        self.found = np.zeros((MOST_ROWS, COLUMNS)), np.zeros((MOST_ROWS, nt)), np.zeros((MOST_ROWS, nt))
        begun = begin_track(system, ridge, seed.u, seed.omega, seed.place, seed.sign, summit, *self.found)
        self.count = 1 if begun else 0
        self.end = LineEnd.TOO_LONG if begun else LineEnd.NOT_FOUND
        if begun and ridge.start == ridge.stop:
            self.end = LineEnd.ARRIVED

    @property
    def ended(self) -> bool:
        """Whether it has arrived, or was not found at all."""
        return self.end is not LineEnd.TOO_LONG

    def tried(self, size: float) -> tuple[int | None, float]:
        """Try a step of z; the point is the number of rows with it."""
        ridge, at = self._ridge, float(self.found[0][self.count - 1, Z])
        z = at + self._forward * size
        last = (z - ridge.stop) * self._forward >= 0.0 or abs(z - ridge.stop) < 0.1 * ridge.smallest_step
        z = ridge.stop if last else z
        error, iterations, self._outside = step_track(
            self._system, ridge, z, self.count, self._smooth, self._summit, *self.found
        )
        self._smooth = error <= 1.0
        if not self._smooth:
            return None, 0.5 * abs(z - at)
        growth = min(2.0, max(0.5, 0.8 * (error + 1e-3) ** (-1.0 / 3.0)))
        if iterations > _EASY:
            growth = min(growth, _SHORTER)
        self.count += 1
        if last:
            self.end = LineEnd.ARRIVED
        return self.count, min(abs(z - at) * growth, ridge.largest_step)

    def leapt(self) -> tuple[None, float]:
        """Say why it ends: where no short step leads on nothing does."""
        self.end = LineEnd.LEFT_BAND if self._outside else LineEnd.VANISHED
        return None, 0.0
