"""Undamped natural frequencies of a scene between the states friction moves it through: open and stuck."""

from __future__ import annotations

import math

import numpy as np

from solver.jit.fourier import Complex, Real
from solver.linear.assembly import linear_model
from solver.linear.model import LinearModel
from solver.matrices.normal_modes import undamped_modes
from solver.scene.cyclic.annulus import written_out
from solver.scene.scene import Scene


def natural_frequencies(scene: Scene, *, stuck: bool) -> Real:
    """Return the undamped natural frequencies [Hz], ascending, of the nodal diameter that is excited.

    Parameters
    ----------
    scene : its dashpots and forces do not count, gyroscopic terms at its speed do. Along an engine-order line
        they are where the order meets them.
    stuck : with all contacts closed and stuck, so that each is its springs; otherwise with all open.
    """
    scene = written_out(scene)
    model = linear_model(scene)
    one = np.ones(1, np.int64)
    n = model.diameters(one)
    (K,), _, (M,) = model.at(n, one > 0)
    (L,) = model.ports_at(n)
    if stuck:
        stiffness = np.array([k for contact in scene.contacts for k in contact.stiffnesses])
        K = K + L.conj().T @ (stiffness[:, None] * L)
    if model.line is not None:
        return _along_line(K, model)
    if model.extra is not None:
        C = model.extra.at(model.turns(n), np.ones(1, np.bool_), lambda: model.plain(n)[0])[1][0]
        free = model.free
        return _of_poles(K[free][:, free], C[free][:, free], M[free][:, free])
    modes = undamped_modes(K if np.any(K.imag) or np.any(M.imag) else K.real, M)
    return np.sort(np.sqrt(np.maximum(modes.omega2, 0.0))) / (2.0 * math.pi)


def _along_line(K: Complex, model: LinearModel) -> Real:
    """Return the frequencies [Hz], ascending, at which an order meets K + Ω² K₂ + iω Ω G − ω² M, Ω = ω / e.

    With the inertia M − K₂/e² − i G/e, Hermitian but perhaps not definite, ω² are those of its inverse
    problem that are positive: an order of a stiffening rotor may meet none.
    """
    one = np.ones(1, np.int64)
    inertia, free = model.inertia(model.diameters(one), one)[0], model.free
    even = 0.5 * (K + K.conj().T)[free][:, free]
    mu = np.linalg.eigvals(np.linalg.solve(even, inertia[free][:, free])).real
    return np.sort(1.0 / np.sqrt(mu[mu > 0.0])) / (2.0 * math.pi)


def _of_poles(K: Complex, C: Complex, M: Complex) -> Real:
    """Return the frequencies [Hz] of M x'' + G x' + K x = 0, ascending: G and K without what damps or feeds.

    Forward and backward whirl are two of them. Of conjugate poles one counts.
    """
    G, K = 0.5 * (C - C.conj().T), 0.5 * (K + K.conj().T)
    heavy = np.any(M, axis=1)
    if not heavy.all():  # points without inertia follow: no dashpot counts
        kept, light = np.ix_(heavy, heavy), np.ix_(heavy, ~heavy)
        K = K[kept] - K[light] @ np.linalg.solve(K[np.ix_(~heavy, ~heavy)], K[light].conj().T)
        G, M = G[kept], M[kept]
    n, inverse = len(M), np.linalg.inv(M)
    state = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ K, -inverse @ G]])
    turning = np.sort(np.linalg.eigvals(state).imag)
    return np.asarray(np.maximum(turning[n:], 0.0) / (2.0 * math.pi))
