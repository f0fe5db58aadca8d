"""The force of a contact over a period as its law gives it for a motion, with all its corners."""

from __future__ import annotations

import math

import numpy as np

from solver.contacts.kernels.planar import periods_to_repeat, plane_step
from solver.contacts.kernels.state_durations import find_segments
from solver.contacts.kernels.stick_slip_events import (
    AFTER_SLIP,
    BEGAN,
    BEGIN,
    DIRECTION,
    END,
    MOTION,
    ONSET,
    SEGMENT_COLUMNS,
    SLIP,
    UNLOADED,
    segment_capacity,
)
from solver.jit import fourier
from solver.jit.fourier import Integer, Real
from solver.jit.trig_polynomial import grid_size, grid_tables
from solver.linear.contact_table import DEFAULT_SAMPLES
from solver.response.contact_response import ContactResponse
from solver.scene.scene import AnyContact, FrictionContact, GapSpring, PlanarContact, PolynomialSpring


def force_at(contact: AnyContact, found: ContactResponse, tau: Real) -> Real:
    """Return the force along the first motion of a contact [N] at the angles `tau`, evenly spaced from 0."""
    u = fourier.basis(tau, (found.slip.size - 1) // 2) @ found.slip
    if isinstance(contact, GapSpring):
        return np.asarray(contact.k * np.maximum(u - contact.gap, 0.0))
    if isinstance(contact, PolynomialSpring):
        return np.asarray(np.polyval([*contact.coefficients[::-1], 0.0], u))
    if isinstance(contact, PlanarContact) and contact.limit != "box":
        return _marched(contact, found, tau)
    if isinstance(contact, FrictionContact):
        return _by_segments(found, contact.kt, contact.mu, tau)
    raise TypeError(f"no force of a contact of the class {type(contact).__name__}")


def _marched(contact: PlanarContact, found: ContactResponse, tau: Real) -> Real:
    """Return the first component of a force with a circular limit, marched over samples fine enough."""
    finer = -(-(contact.samples or DEFAULT_SAMPLES) // tau.size)
    fine = np.linspace(0.0, 2.0 * math.pi, finer * tau.size, endpoint=False, dtype=np.float64)
    u = np.array([fourier.basis(fine, (motion.size - 1) // 2) @ motion for motion in found.motions])
    limit = contact.mu * (fourier.basis(fine, 1) @ found.load)
    T, no_seeds, nothing = np.zeros(2), np.empty((7, 0)), np.empty((2, 0))
    plane_step(contact.kt, u[0, 0], u[1, 0], limit[0], limit[0], T, no_seeds, nothing)
    force = np.empty(fine.size)
    for _ in range(periods_to_repeat(u, limit, contact.kt)):
        for j in range(fine.size):
            to = (j + 1) % fine.size
            du, dw = u[0, to] - u[0, j], u[1, to] - u[1, j]
            plane_step(contact.kt, du, dw, limit[j], limit[to], T, no_seeds, nothing)
            force[to] = T[0]
    return force[::finer]


def _by_segments(contact: ContactResponse, kt: float, mu: float, tau: Real) -> Real:
    """Return the friction force [N] at the angles `tau` in [0, 2π), segment by segment."""
    ks: Integer = fourier.all_harmonics((contact.slip.size - 1) // 2)
    top = max(int(ks[-1]), 1)
    segments = np.zeros((segment_capacity(top), SEGMENT_COLUMNS))
    load_ks = fourier.all_harmonics((contact.load.size - 1) // 2)
    tables = grid_tables(grid_size(top), top)
    _, count = find_segments(contact.slip, ks, contact.load, load_ks, kt, mu, *tables, segments)

    def slip(angle: Real) -> Real:
        return np.asarray(fourier.basis(angle, ks.size - 1) @ contact.slip)

    def load(angle: Real) -> Real:
        return np.asarray(fourier.basis(angle, (contact.load.size - 1) // 2) @ contact.load)

    force = np.zeros(tau.size)
    for row in segments[:count]:
        # A segment may reach beyond the period it began in.
        inside = (tau - row[BEGIN]) % (2.0 * math.pi) <= row[END] - row[BEGIN]
        here, onset = tau[inside], np.array([row[ONSET]])
        if row[MOTION] == SLIP:
            force[inside] = row[DIRECTION] * mu * load(here)
        elif row[BEGAN] == UNLOADED:
            force[inside] = kt * slip(here)
        else:
            kept = row[DIRECTION] * mu * load(onset) if row[BEGAN] == AFTER_SLIP else 0.0
            force[inside] = kt * (slip(here) - slip(onset)) + kept
    return force
