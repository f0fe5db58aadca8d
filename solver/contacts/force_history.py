"""The force of a contact over a period as its law gives it for a motion, with all its corners."""

from __future__ import annotations

import math

import numpy as np

from solver.contacts.kernels.stick_slip_events import AFTER_SLIP, SLIP, UNLOADED
from solver.contacts.segments import segments_of
from solver.jit import fourier
from solver.jit.fourier import Real


def force_by_segments(slip: Real, load: Real, kt: float, mu: float, tau: Real) -> Real:
    """Return a friction force [N] at the angles `tau` in [0, 2π), segment by segment.

    Parameters
    ----------
    slip, load : full coefficients [m], [N].
    """
    force = np.zeros(tau.size)
    for row in segments_of(slip, load, kt, mu).rows:
        # A segment may reach beyond the period it began in.
        inside = (tau - row.begin) % (2.0 * math.pi) <= row.end - row.begin
        here, onset = tau[inside], np.array([row.onset])
        if row.motion == SLIP:
            force[inside] = row.direction * mu * _at(load, here)
        elif row.began == UNLOADED:
            force[inside] = kt * _at(slip, here)
        else:
            kept = row.direction * mu * _at(load, onset) if row.began == AFTER_SLIP else 0.0
            force[inside] = kt * (_at(slip, here) - _at(slip, onset)) + kept
    return force


def _at(coefficients: Real, tau: Real) -> Real:
    return np.asarray(fourier.basis(tau, (coefficients.size - 1) // 2) @ coefficients)
