"""The utilisation of a stress: its alternating part over what a Haigh diagram allows at its mean.

With max s and min s over the period, a = (max s − min s)/2 and m = static + (max s + min s)/2, it is
a / (S c(m)), c the share of the fatigue strength S that is left, see `solver.scene.materials`. The margin is
its inverse: by how much the alternating stress may grow at this mean stress.
"""

from __future__ import annotations

from solver.jit.decorators import compiled
from solver.jit.fourier import Real
from solver.scene.materials import BENT

LINE, FATIGUE, STRENGTH, STATIC = range(4)
LEAST = 1e-3  # share counted as left where the mean stress leaves none: the utilisation stays finite


@compiled
def utilisation(haigh: Real, high: float, low: float) -> tuple[float, float, float, float, float]:
    """Return the utilisation and its derivatives, for a motion between `low` and `high`.

    Parameters
    ----------
    haigh : (4,) line, fatigue strength, strength, static mean stress, in one unit.

    Returns
    -------
    U, ∂U/∂a, ∂U/∂m, ∂²U/∂a∂m, ∂²U/∂m²; ∂²U/∂a² is 0.
    """
    a, m = 0.5 * (high - low), haigh[STATIC] + 0.5 * (high + low)
    left, slope, bend = 1.0, 0.0, 0.0
    if m > 0.0 and haigh[LINE] == BENT:
        share = m / haigh[STRENGTH]
        left, slope, bend = 1.0 - share**2, -2.0 * share / haigh[STRENGTH], -2.0 / haigh[STRENGTH] ** 2
    elif m > 0.0:
        left, slope = 1.0 - m / haigh[STRENGTH], -1.0 / haigh[STRENGTH]
    if left < LEAST:
        left, slope, bend = LEAST, 0.0, 0.0
    by_a = 1.0 / (haigh[FATIGUE] * left)
    by_m = -a * by_a * slope / left
    return (
        a * by_a, by_a, by_m, -by_a * slope / left,
        a * by_a / left * (2.0 * slope**2 / left - bend),
    )  # fmt: skip
