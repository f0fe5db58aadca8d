"""The force of a contact over a period as its law gives it for a motion, with all its corners."""

from __future__ import annotations

import math

import numpy as np

from solver.contacts.kernels.coulomb.planar import periods_to_repeat, plane_step
from solver.contacts.kernels.stick_slip_events import (
    AFTER_SLIP,
    BEGAN,
    BEGIN,
    DIRECTION,
    END,
    MOTION,
    ONSET,
    SLIP,
    UNLOADED,
)
from solver.contacts.segments import segments_of
from solver.jit import fourier
from solver.jit.fourier import Real


def plane_force(motions: Real, load: Real, kt: float, mu: float, tau: Real, samples: int) -> Real:
    """Return the first component of a force with a circular limit [N], marched over samples fine enough.

    Parameters
    ----------
    motions : (2, 2H + 1) full coefficients [m]; load : full coefficients [N].
    tau : angles, evenly spaced from 0.
    """
    finer = -(-samples // tau.size)
    fine = np.linspace(0.0, 2.0 * math.pi, finer * tau.size, endpoint=False, dtype=np.float64)
    u = np.array([fourier.basis(fine, (motion.size - 1) // 2) @ motion for motion in motions])
    limit = mu * (fourier.basis(fine, (load.size - 1) // 2) @ load)
    T, no_seeds, nothing = np.zeros(2), np.empty((7, 0)), np.empty((2, 0))
    plane_step(kt, u[0, 0], u[1, 0], limit[0], limit[0], T, no_seeds, nothing)
    force = np.empty(fine.size)
    for _ in range(periods_to_repeat(u, limit, kt)):
        for j in range(fine.size):
            to = (j + 1) % fine.size
            du, dw = u[0, to] - u[0, j], u[1, to] - u[1, j]
            plane_step(kt, du, dw, limit[j], limit[to], T, no_seeds, nothing)
            force[to] = T[0]
    return force[::finer]


def force_by_segments(slip: Real, load: Real, kt: float, mu: float, tau: Real) -> Real:
    """Return a friction force [N] at the angles `tau` in [0, 2π), segment by segment.

    Parameters
    ----------
    slip, load : full coefficients [m], [N].
    """
    force = np.zeros(tau.size)
    for row in segments_of(slip, load, kt, mu).rows:
        # A segment may reach beyond the period it began in.
        inside = (tau - row[BEGIN]) % (2.0 * math.pi) <= row[END] - row[BEGIN]
        here, onset = tau[inside], np.array([row[ONSET]])
        if row[MOTION] == SLIP:
            force[inside] = row[DIRECTION] * mu * _at(load, here)
        elif row[BEGAN] == UNLOADED:
            force[inside] = kt * _at(slip, here)
        else:
            kept = row[DIRECTION] * mu * _at(load, onset) if row[BEGAN] == AFTER_SLIP else 0.0
            force[inside] = kt * (_at(slip, here) - _at(slip, onset)) + kept
    return force


def _at(coefficients: Real, tau: Real) -> Real:
    return np.asarray(fourier.basis(tau, (coefficients.size - 1) // 2) @ coefficients)
