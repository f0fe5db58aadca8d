"""Whether a structure without damping is excited at one of its resonances, where nothing bounds the response.

Friction takes out power in proportion to the amplitude, a resonance puts it in so too: above some force no
amplitude balances them.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solver.linear.assembly import linear_model
from solver.matrices.normal_modes import hermitian, undamped_modes
from solver.scene.scene import Scene

_NEAR = 0.02  # relative to a natural frequency


def undamped_resonance(scene: Scene, frequency_hz: float, harmonics: NDArray[np.int64]) -> bool:
    """Return whether nothing damps the structure, and a harmonic is near one of its natural frequencies.

    Parameters
    ----------
    harmonics : those kept.
    """
    model = linear_model(scene)
    ks = harmonics[harmonics > 0]
    if model.prescribed:
        return False
    matrices = model.at(model.diameters(ks), np.ones(ks.size, np.bool_))
    for k, K, C, M in zip(ks.tolist(), *matrices, strict=True):
        if np.any(hermitian(C)) or np.any(K - hermitian(K)):
            return False
        omega2 = undamped_modes(hermitian(K), hermitian(M)).omega2
        natural = np.sqrt(np.maximum(omega2, 0.0)) / (2.0 * math.pi)
        if np.any(np.abs(k * frequency_hz - natural) <= _NEAR * natural):
            return True
    return False
