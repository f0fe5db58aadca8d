"""Whether a structure without damping is excited at one of its resonances, where nothing bounds the response.

Friction takes out power in proportion to the amplitude, a resonance puts it in so too: above some force no
amplitude balances them.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from solver.linear.assembly import linear_model
from solver.linear.contact_table import port_stiffnesses
from solver.scene.scene import Scene

_NEAR = 0.02  # relative to a natural frequency


def undamped_resonance(scene: Scene, frequency_hz: float, harmonics: NDArray[np.int64]) -> bool:
    """Return whether nothing damps the structure, and a harmonic is near one of its natural frequencies.

    Those with all contacts open count, and those with all of them stuck.

    Parameters
    ----------
    harmonics : those kept.
    """
    # Loaded here: it brings SciPy's packages along, which an answer does without.
    from solver.matrices.normal_modes import hermitian, undamped_modes

    model = linear_model(scene)
    ks = harmonics[harmonics > 0]
    if model.prescribed:
        return False
    diameters, kt = model.diameters(ks), port_stiffnesses(scene, model)
    matrices = model.at(diameters, np.ones(ks.size, np.bool_))
    for k, K, C, M, L in zip(ks.tolist(), *matrices, model.ports_at(diameters), strict=True):
        if np.any(hermitian(C)) or np.any(K - hermitian(K)):
            return False
        for stiffness in (K, K + L.conj().T @ (kt[:, None] * L)):
            omega2 = undamped_modes(hermitian(stiffness), hermitian(M)).omega2
            natural = np.sqrt(np.maximum(omega2, 0.0)) / (2.0 * math.pi)
            if np.any(np.abs(k * frequency_hz - natural) <= _NEAR * natural):
                return True
    return False
