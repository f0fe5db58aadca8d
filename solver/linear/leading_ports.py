"""Ports whose motions all others follow from: where few modes, coordinates or bodies move many contacts.

The motions of a rigid body's contacts follow from those of six of them, those of a structure with 40 modes
from 40. With the rows of `leading` ports, L = P L_leading, the receptance of all is A = P Â Pᵀ: an identity,
no approximation (an interpolative decomposition: Cheng, Gimbutas, Martinsson, Rokhlin, SIAM J. Sci. Comput.
26 (2005) 1389, doi:10.1137/030602678).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.jit.fourier import Complex, Integer, Real

FEWEST_PORTS = 8  # below, nothing is gained (measured)
WORTHWHILE = 0.75  # of the ports: with more leading ones the larger matrices are not much dearer
_ROUNDING = 1e-13  # of a column as long as 1: what is left of one that follows from others


class LeadingPorts(NamedTuple):
    """Which ports lead, and how the others follow.

    Attributes
    ----------
    leading : (r,) numbers of ports.
    span : (nc, r) the motion of every port as a sum of theirs; (nc, 0) if none follows from others.
    """

    leading: Integer
    span: Real


def every_port(count: int) -> LeadingPorts:
    """Return the answer that no port follows from others."""
    return LeadingPorts(np.arange(count, dtype=np.int64), np.zeros((count, 0)))


def leading_ports(motions: Complex, duals: Complex) -> LeadingPorts:
    """Return as few ports as all others follow from, or all if that saves little.

    Parameters
    ----------
    motions, duals : (ns, nc, N) rows of the ports in the modes or coordinates of each structure, to and from.
    """
    nc = motions.shape[1]
    if nc < FEWEST_PORTS:
        return every_port(nc)
    rows = _rows(motions, duals)
    if rows.shape[1] == 0:
        return every_port(nc)
    import scipy.linalg as sla  # for many contacts alone: a small response does not load SciPy's packages

    # Modes have sizes of their own: each counts as much as the others.
    sizes = np.linalg.norm(rows, axis=0)
    # One factor without exchanges first: of many modes the other would take ten times as long.
    square = np.linalg.qr((rows[:, sizes > 0.0] / sizes[sizes > 0.0]).T, mode="r")
    triangle, order = sla.qr(square, mode="r", pivoting=True)
    left = np.sqrt(np.cumsum(triangle[::-1] ** 2, axis=0)[::-1].max(axis=1))
    rank = int(np.count_nonzero(left > _ROUNDING * max(1.0, left[0])))
    if rank > WORTHWHILE * nc:
        return every_port(nc)
    span = np.zeros((nc, rank))
    span[order[:rank]] = np.eye(rank)
    span[order[rank:]] = sla.solve_triangular(triangle[:rank, :rank], triangle[:rank, rank:]).T
    return LeadingPorts(order[:rank].astype(np.int64), np.ascontiguousarray(span))


def _rows(motions: Complex, duals: Complex) -> NDArray[np.float64]:
    """Return the real rows of all ports, without those that repeat others' columns."""
    parts = [motions] if np.array_equal(duals, motions.conj()) else [motions, duals]
    wide = np.concatenate([each for part in parts for each in part], axis=1)
    if not np.any(wide.imag):
        return np.ascontiguousarray(wide.real)
    return np.concatenate([wide.real, wide.imag], axis=1)
