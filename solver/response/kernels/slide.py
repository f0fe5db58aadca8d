"""Friction of springs with a limit, followed from sample to sample until it repeats."""

from __future__ import annotations

import math

from solver.jit.fourier import Real
from solver.jit.separate import apart

REPEATS = 1e-12  # of the largest limit: change over a period
PERIODS = 20_000  # after which friction that does not repeat is given up


@apart
def slide(pulls: Real, limits: Real, one_limit: bool, out: Real) -> None:
    """Fill `out` (many, directions, samples) with friction forces [N] of the last period.

    Parameters
    ----------
    pulls : (many, directions, samples) by how much the springs' forces grow to each sample [N].
    limits : (many, samples) [N].
    one_limit : for the whole force, a circle, in place of one for each direction.
    """
    many, directions, samples = pulls.shape
    for i in range(many):
        largest = 0.0
        for j in range(samples):
            largest = max(largest, limits[i, j])
        for _ in range(PERIODS):
            change, last = 0.0, out[i, :, samples - 1].copy()
            for j in range(samples):
                carried = 0.0
                for d in range(directions):
                    before = out[i, d, j - 1] if j > 0 else last[d]
                    out[i, d, j] = before + pulls[i, d, j]
                    carried = math.hypot(carried, out[i, d, j])
                    if not one_limit:
                        out[i, d, j] = min(max(out[i, d, j], -limits[i, j]), limits[i, j])
                if one_limit and carried > limits[i, j]:
                    for d in range(directions):
                        out[i, d, j] *= limits[i, j] / carried
            for d in range(directions):
                change = max(change, abs(out[i, d, samples - 1] - last[d]))
            if change <= REPEATS * largest:
                break
