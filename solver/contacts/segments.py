"""The segments of a contact over a period, how much of it each motion takes, and the force along them."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from solver.contacts.kernels.state_durations import find_segments
from solver.contacts.kernels.stick_slip_events import AFTER_SLIP, SLIP, UNLOADED, new_segments
from solver.contacts.laws.contact_parts import ContactMotion
from solver.jit import fourier
from solver.jit.fourier import Real
from solver.jit.trig_polynomial import grid_size, grid_tables

_TURN = 2.0 * math.pi


class Segments(NamedTuple):
    """What a contact does over a period, see `solver.contacts.kernels.stick_slip_events`."""

    state: int
    rows: np.recarray[Any, Any]  # (count,) `solver.contacts.kernels.stick_slip_events.SEGMENT`


class Shares(NamedTuple):
    """Shares of the period a contact spends in each motion; they add up to 1."""

    stick: float
    slip: float
    separation: float


def segments_of(slip: Real, load: Real, kt: float, mu: float) -> Segments:
    """Return the segments for full coefficients of slip motion [m] and normal load [N]."""
    ks, load_ks = (fourier.all_harmonics((q.size - 1) // 2) for q in (slip, load))
    top = max(int(ks[-1]), int(load_ks[-1]), 1)
    rows = new_segments(top)
    tables = grid_tables(grid_size(top), top)
    state, count = find_segments(slip, ks, load, load_ks, float(kt), float(mu), *tables, rows)
    return Segments(state=int(state), rows=rows[:count].copy().view(np.recarray))


def shares_of(*found: Segments) -> Shares:
    """Return the shares of one slider, or of several under one load: they slip where any of them does."""
    edges = {0.0, 1.0}
    for each in found:
        edges |= {float(share) for share in np.concatenate([each.rows.begin, each.rows.end]) / _TURN % 1.0}
    ends = np.array(sorted(edges))
    middles, lengths = 0.5 * (ends[1:] + ends[:-1]), np.diff(ends)
    touching, slipping = np.zeros(middles.size, bool), np.zeros(middles.size, bool)
    for each in found:
        for row in each.rows:
            inside = (middles - row.begin / _TURN) % 1.0 < (row.end - row.begin) / _TURN
            touching |= inside
            slipping |= inside & (row.motion == SLIP)
    slip, contact = float(lengths[slipping].sum()), float(lengths[touching].sum())
    return Shares(stick=contact - slip, slip=slip, separation=1.0 - contact)


def motion_at(found: Segments, tau: Real) -> list[ContactMotion]:
    """Return what a slider does at every angle."""
    motion = np.full(tau.size, ContactMotion.SEPARATION)
    for row in found.rows:
        inside = (tau - row.begin) % _TURN <= row.end - row.begin
        motion[inside] = ContactMotion.SLIP if row.motion == SLIP else ContactMotion.STICK
    return motion.tolist()


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
