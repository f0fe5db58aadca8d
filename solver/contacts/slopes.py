"""What a small change of one harmonic of the contacts' motion changes in the same harmonic of their force."""

from __future__ import annotations

import numpy as np

from solver.contacts.kernels.system import Evaluation, System
from solver.jit.fourier import Complex, Real


def harmonic_stiffness(system: System, point: Evaluation) -> Complex:
    """Return ĝ_k, (nk, nc, nc) [N/m], of the contacts where `point` was evaluated: F̂_k changes by ĝ_k û_k.

    The part that answers with the mirror image of the change is left out.
    """
    nk, nc, n = system.ks.size, system.owner.size, point.F.shape[1]
    stiffness = np.zeros((nk, nc, nc), np.complex128)
    first = int(system.ks[0] == 0)
    for e in range(system.laws.size):
        begin, end = int(system.first_port[e]), int(system.first_port[e + 1])
        m = end - begin
        block = point.dF_dU[system.first_block[e] : system.first_block[e + 1]].reshape(m, m, n, n)
        if first:
            stiffness[0, begin:end, begin:end] = block[:, :, 0, 0]
        c = np.arange(first, n, 2)
        own = (
            block[:, :, c, c]
            + block[:, :, c + 1, c + 1]
            + 1j * (block[:, :, c, c + 1] - block[:, :, c + 1, c])
        )
        stiffness[first:, begin:end, begin:end] = 0.5 * np.moveaxis(own, -1, 0)
    return stiffness


def amplitudes(parts: Real, system: System) -> Complex:
    """Return complex amplitudes (nk, ...) of real coefficients (..., n)."""
    first = int(system.ks[0] == 0)
    rest = np.moveaxis(parts[..., first::2] - 1j * parts[..., first + 1 :: 2], -1, 0)
    return np.concatenate([parts[None, ..., 0], rest]) if first else rest
