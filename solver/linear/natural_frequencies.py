"""Undamped natural frequencies of a scene between the states friction moves it through: open and stuck.

They are where its linear resonances are, from which friction takes those that a response shows.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from solver.jit.fourier import Complex, Integer, Real
from solver.linear.assembly import linear_model
from solver.linear.model import Identity, LinearModel
from solver.matrices.normal_modes import hermitian, undamped_modes
from solver.scene.scene import Scene

RIGID = 1e6  # times the structure's stiffness: what a rigid contact counts as
LARGE = 300  # coordinates from which modes cost more than a small study
_AT_REST = 1e-6  # of the highest natural frequency: below it a part moves as a rigid body


class Resonances(NamedTuple):
    """Excitation frequencies [Hz], ascending, at which a harmonic of the excitation meets a linear mode."""

    open_hz: Real
    stuck_hz: Real


def resonances(scene: Scene) -> Resonances | None:
    """Return the linear resonances of a scene, all contacts open and all stuck; None of one too large.

    Harmonics are those of the forces, and that which is observed alone; motions as a rigid body are left out.
    """
    return _resonances(Identity(scene))


@lru_cache(maxsize=4)
def _resonances(of: Identity[Scene]) -> Resonances | None:
    scene = of.it
    if linear_model(scene).n_coordinates > LARGE:
        return None
    waves = {force.harmonic for force in scene.excitation} | {scene.observe.harmonic or 0}
    found = []
    for stuck in (False, True):
        each = [natural_frequencies(scene, stuck=stuck, harmonic=k) / k for k in sorted(waves - {0} or {1})]
        every = np.concatenate(each)
        found.append(np.sort(every[every > _AT_REST * every.max(initial=0.0)]))
    return Resonances(*found)


def natural_frequencies(scene: Scene, *, stuck: bool, harmonic: int = 1) -> Real:
    """Return the undamped natural frequencies [Hz], ascending, of the nodal diameter that is excited.

    Parameters
    ----------
    scene : its dashpots and forces do not count, gyroscopic terms at its speed do. Along an engine-order line
        they are where the order meets them.
    stuck : with all contacts closed and stuck, so that each is its springs; otherwise with all open. A rigid
        one is as stiff as rounding lets be told.
    harmonic : of the excitation; of a disk its nodal diameter depends on that.
    """
    model = linear_model(scene)
    k = np.full(1, harmonic, np.int64)
    n = model.diameters(k)
    (K,), _, (M,) = model.at(n, k > 0)
    (L,) = model.ports_at(n)
    if stuck:
        rigid = RIGID * float(np.abs(np.diag(K)).max(initial=0.0))
        K = K + L.conj().T @ (np.where(np.isinf(model.stiffnesses), rigid, model.stiffnesses)[:, None] * L)
    if model.line is not None:
        return _along_line(K, model, k)
    if model.extra is not None:
        C = model.extra.at(model.turns(n), np.ones(1, np.bool_), lambda: model.plain(n)[0])[1][0]
        free = model.free
        return _of_poles(K[free][:, free], C[free][:, free], M[free][:, free])
    modes = undamped_modes(K if np.any(K.imag) or np.any(M.imag) else K.real, M)
    return np.sort(np.sqrt(np.maximum(modes.omega2, 0.0))) / (2.0 * math.pi)


def _along_line(K: Complex, model: LinearModel, k: Integer) -> Real:
    """Return the frequencies [Hz], ascending, at which an order meets K + Ω² K₂ + iω Ω G − ω² M, Ω = ω / e.

    With the inertia M − K₂/e² − i G/e, Hermitian but perhaps not definite, ω² are those of its inverse
    problem that are positive: an order of a stiffening rotor may meet none.
    """
    inertia, free = model.inertia(model.diameters(k), k)[0], model.free
    even = 0.5 * (K + K.conj().T)[free][:, free]
    flexibility = np.linalg.eigvals(np.linalg.solve(even, inertia[free][:, free])).real
    return np.sort(1.0 / np.sqrt(flexibility[flexibility > 0.0])) / (2.0 * math.pi)


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


_NEAR = 0.02  # relative to a natural frequency


def undamped_resonance(
    scene: Scene, frequency_hz: float, harmonics: Integer, held: Real | None = None
) -> bool:
    """Return whether nothing damps the structure, and a harmonic is near one of its natural frequencies.

    Those with all contacts open count, those with all of them stuck, and those of a motion: a gap or a
    nonlinear spring holds more or less of it by the amplitude. Friction takes out power in proportion to the
    amplitude, a resonance puts it in so too: above some force no amplitude balances them.

    Parameters
    ----------
    harmonics : those kept.
    held : what contacts hold each harmonic above 0 of their motions with [N/m], (nk, n_ports).
    """
    model = linear_model(scene)
    ks = harmonics[harmonics > 0]
    if model.prescribed:
        return False
    diameters, kt = model.diameters(ks), model.port_stiffnesses
    matrices = model.at(diameters, np.ones(ks.size, np.bool_))
    springs = np.stack([0.0 * kt, kt] if held is None else [0.0 * kt, kt, held[0]])
    for i, (k, K, C, M, L) in enumerate(zip(ks.tolist(), *matrices, model.ports_at(diameters), strict=True)):
        if np.any(hermitian(C)) or np.any(K - hermitian(K)):
            return False
        if held is not None:
            springs[-1] = held[i]
        for each in springs:
            stiffness = K + L.conj().T @ (each[:, None] * L)
            omega2 = undamped_modes(hermitian(stiffness), hermitian(M)).omega2
            natural = np.sqrt(np.maximum(omega2, 0.0)) / (2.0 * math.pi)
            if np.any(np.abs(k * frequency_hz - natural) <= _NEAR * natural):
                return True
    return False
