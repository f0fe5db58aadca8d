"""Cosines and sines of several angles at once: a loop the compiler turns into vector instructions.

A call of the C library takes one angle, and cannot be made part of such a loop.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.jit.decorators import compiled

_QUARTERS, _QUARTER = 2.0 / math.pi, 0.5 * math.pi


@compiled
def cosines_and_sines(angles: NDArray[Any], cosines: NDArray[Any], sines: NDArray[Any]) -> None:
    """Fill in cos and sin of angles [rad], real or complex with a small imaginary part.

    Right to 1e-15 for the few turns of one period: Taylor's polynomials about the nearest quarter of a turn.
    """
    for i in range(angles.size):
        turns = np.rint(angles[i].real * _QUARTERS)
        z = angles[i] - turns * _QUARTER
        q = z * z
        sine = 1.6059043836821613e-10 - q * 7.647163731819816e-13
        sine = 2.7557319223985893e-6 + q * (-2.505210838544172e-8 + q * sine)
        sine = 8.333333333333333e-3 + q * (-1.984126984126984e-4 + q * sine)
        sine = z * (1.0 + q * (-1.6666666666666666e-1 + q * sine))
        cosine = 2.08767569878681e-9 + q * (-1.1470745597729725e-11 + q * 4.779477332387385e-14)
        cosine = 2.48015873015873e-5 + q * (-2.7557319223985888e-7 + q * cosine)
        cosine = 4.1666666666666664e-2 + q * (-1.388888888888889e-3 + q * cosine)
        cosine = 1.0 + q * (-0.5 + q * cosine)
        quarter = int(turns)
        odd = quarter & 1 == 1
        along, across = (sine, cosine) if odd else (cosine, sine)
        cosines[i] = -along if (quarter + 1) & 2 != 0 else along
        sines[i] = -across if quarter & 2 != 0 else across
