"""Rigid-body motions of what contacts alone hold, found by rank before anything is divided.

The scales are those of the problem: of the contacts that hold the part, and of the part's own stiffness, of
which rounding leaves a share where entries of K cancel. No absolute number decides.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.jit import eigen
from solver.matrices.normal_modes import hermitian, least_stiffness

Real = NDArray[np.float64]
HELD = 1e-7  # smallest squared pivot of the scaled K from which every part is held, without a closer look
BY_CONTACTS = 1e-6  # largest stiffness of a loose part, relative to the contacts' stiffness against it
CANCELLED = 1e-9  # and relative to the sum of what cancels in it: a file of ten digits leaves less
ROUNDING = 1e-12  # of the contacts' stiffness: what the modes themselves leave
_UNTOUCHED = 1e-14  # put on the scaled stiffness: what neither springs nor contacts hold is no contact's part


def loose_motions(K: NDArray[Any], L: NDArray[Any], kt: Real) -> Real:
    """Return the motions of the ports in the rigid-body motions that contacts alone hold.

    Parameters
    ----------
    K : (n, n) static stiffness without contacts [N/m].
    L : (nc, n) relative motion of each port.
    kt : (nc,) stiffness of each port [N/m].

    Returns
    -------
    (nr, nc) rows l_i with Σ_c l_i kt l_j = δ_ij; none where the structure holds every part.
    """
    nothing = np.zeros((0, kt.size))
    if K.shape[0] == 0 or kt.size == 0 or least_stiffness(K) > HELD:
        return nothing
    K, L = hermitian(K.real), L.real
    contact = L.T @ (kt[:, None] * L)
    diagonal = np.diag(K) + np.diag(contact)
    scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    across = np.outer(scale, scale)
    held = across * (K + contact) + _UNTOUCHED * np.eye(scale.size)
    _, modes = eigen.pencil(across * K, held)
    modes = modes * scale[:, None]
    stiffness, against = ((modes * (matrix @ modes)).sum(axis=0) for matrix in (K, contact))
    cancelling = (np.abs(modes) * (np.abs(K) @ np.abs(modes))).sum(axis=0)
    size = np.sqrt(np.maximum(against, 0.0))
    rounding = np.maximum(CANCELLED * cancelling, ROUNDING * against)
    loose = np.abs(stiffness) <= np.minimum(BY_CONTACTS * against, rounding)
    loose &= against > 0.5 * (modes * ((contact + K) @ modes)).sum(axis=0)
    return np.ascontiguousarray((L @ modes[:, loose] / size[loose]).T)
