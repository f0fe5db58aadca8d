"""The utilisation of a stress: its alternating part over what a Haigh diagram allows at its mean.

With max s and min s over the period, a = (max s − min s)/2 and m = static + (max s + min s)/2, it is
a / (S c(m)), c the share of the fatigue strength S that is left, see `solver.scene.materials`. The margin is
its inverse: by how much the alternating stress may grow at this mean stress.

Where the mean leaves nothing the utilisation is infinite. So that a search finds its way out it is counted on
instead, finite and still growing with the mean and with the amplitude: above `STEEP` in proportion to the
margin that is left, 2 `STEEP` where none is, and more beyond. `solver.scene.materials.utilisation_of` says
what such a number is.
"""

from __future__ import annotations

from solver.jit.decorators import compiled
from solver.jit.fourier import Real
from solver.scene.materials import BENT, STEEP

LINE, FATIGUE, STRENGTH, STATIC = range(4)


@compiled
def utilisation(haigh: Real, high: float, low: float) -> tuple[float, float, float, float, float, float]:
    """Return the utilisation, counted on, and its derivatives, for a motion between `low` and `high`.

    Parameters
    ----------
    haigh : (4,) line, fatigue strength, strength, static mean stress, in one unit.

    Returns
    -------
    U, ∂U/∂a, ∂U/∂m, ∂²U/∂a², ∂²U/∂a∂m, ∂²U/∂m².
    """
    share, m = 0.5 * (high - low) / haigh[FATIGUE], haigh[STATIC] + 0.5 * (high + low)
    left, slope, bend = 1.0, 0.0, 0.0
    if m > 0.0 and haigh[LINE] == BENT:
        left, slope = 1.0 - (m / haigh[STRENGTH]) ** 2, -2.0 * m / haigh[STRENGTH] ** 2
        bend = -2.0 / haigh[STRENGTH] ** 2
    elif m > 0.0:
        left, slope = 1.0 - m / haigh[STRENGTH], -1.0 / haigh[STRENGTH]
    if left <= 0.0:
        used, by_share, by_left = STEEP * (2.0 - left * (1.0 + share)), -STEEP * left, -STEEP * (1.0 + share)
        twice_share, mixed, twice_left = 0.0, -STEEP, 0.0
    elif share <= STEEP * left:
        used, by_share, by_left = share / left, 1.0 / left, -share / left**2
        twice_share, mixed, twice_left = 0.0, -1.0 / left**2, 2.0 * share / left**3
    else:
        margin, per_share = left / share, STEEP**2 / share
        used, by_share, by_left = STEEP * (2.0 - STEEP * margin), per_share * margin, -per_share
        twice_share, mixed, twice_left = -2.0 * per_share * margin / share, per_share / share, 0.0
    return (
        used, by_share / haigh[FATIGUE], by_left * slope, twice_share / haigh[FATIGUE] ** 2,
        mixed * slope / haigh[FATIGUE], twice_left * slope**2 + by_left * bend,
    )  # fmt: skip
