"""What Floquet multipliers cost, in seconds of one core of a server: by it ways are chosen, and forecast.

Constants are fitted to steps and exponentials of 3 to 600 coordinates.
"""

from __future__ import annotations

import math

import numpy as np

from solver.jit.fourier import Complex
from solver.linear.assembly import linear_model
from solver.linear.model import LinearModel, with_inertia
from solver.scene.scene import Scene

STAGES = 8  # of a step of collocation
FASTEST_IN_A_STEP = 4.0  # rad that the fastest mode turns: its error is 4e-9, that of half as fast ones 3e-14
_A_STEP, _A_CONTACT, _A_FLOP, _AN_EXPONENTIAL, _A_CUBE = 3e-4, 1.5e-4, 5e-11, 1e-4, 4e-10
_INVERSES = 60.0  # operations by n³ of a step where modes are joined
_MULTIPLIERS, _FIXED, _ELEMENT = 1.2e-9, 1e-3, 1e-3  # of eigenvalues by size³; looked up once; of a contact
# Intervals a period of one contact: changes of its state; those and parts of slips in space.
_CHANGES, _TURNS = 6, 12
_CLOSED = 0.5  # share of the period that contacts whose load moves are taken to be closed
_DECOUPLED = 1e-8  # relative size of the commutator of stiffness and damping
_MOST_COORDINATES = 200  # of a whole structure whose multipliers are computed unasked
_POWERS = 40  # iterations for the largest eigenvalue


def of_a_step(n: int, ports: float, contacts: float, columns: int, *, decoupled: bool) -> float:
    """Return that of a step of n coordinates in modes, or joined, with motions of contacts."""
    inner = STAGES * ports
    flops = columns * (8.0 * n * inner + 2.0 * inner**2) + inner**3
    joined = 0.0 if decoupled else _INVERSES * n**3 + 8.0 * n**2 * columns
    return _A_STEP + _A_CONTACT * contacts + _A_FLOP * (flops + joined)


def of_an_exponential(size: int, turn: float) -> float:
    """Return that of a matrix exponential over `turn` rad of what is fastest: squarings go by its square."""
    return _AN_EXPONENTIAL + _A_CUBE * size**3 * (1.0 + 0.3 * math.log2(1.0 + turn))


def forecast(scene: Scene, frequency_hz: float | None = None) -> float:
    """Return about how long the Floquet multipliers of a response of a scene take [s].

    Parameters
    ----------
    frequency_hz : that of the response; the middle of the band where it is left out.

    Returns
    -------
    The time, infinite where a mode is faster than numbers can say.
    """
    model = linear_model(scene)
    sectors = scene.structure.sector_count if scene.structure.has_sectors else 1
    parts = sectors // math.gcd(scene.engine_order, sectors) if sectors > 1 else 1
    omega = 2.0 * math.pi * (frequency_hz or math.prod(map(math.sqrt, scene.observe.band)))
    turning = [contact.tangent_varies for contact in scene.contacts]
    intervals = 1.0 + sum(_TURNS if turns else _CHANGES for turns in turning) * sectors / parts
    closed = [1.0 if contact.normal_port is None else _CLOSED for contact in scene.contacts]
    ports = sectors * sum(share * len(c.end_keys) for share, c in zip(closed, scene.contacts, strict=True))
    n = int(model.free.sum()) * sectors
    size = 2 * n + sectors * len(scene.contacts)
    fastest, decoupled = _structure(scene, model, omega)
    turn = 2.0 * math.pi / parts * fastest
    step = of_a_step(n, ports, sectors * sum(closed), size, decoupled=decoupled)
    whole = (intervals + turn / FASTEST_IN_A_STEP) * step
    if not any(turning):
        whole = min(whole, intervals * of_an_exponential(size, turn / intervals))
    return _FIXED + _ELEMENT * sectors * len(closed) + whole + _MULTIPLIERS * size**3


def _structure(scene: Scene, model: LinearModel, omega: float) -> tuple[float, bool]:
    """Return what is fastest in units of ω, and whether damping leaves modes apart."""
    free, fastest, decoupled = model.free, 0.0, True
    every = np.arange(model.sectors) if model.every_diameter else np.array([model.engine_order])
    stiff = np.array([k if math.isfinite(k) else 0.0 for c in scene.contacts for k in c.stiffnesses])
    for diameter in every[every <= model.sectors // 2] if model.every_diameter else every:
        K, C, M = (each[0][free][:, free] for each in model.at(np.array([diameter]), np.ones(1, np.bool_)))
        K, C, M, _ = with_inertia(K, C, M)
        L = (model.contact_here + model.contact_next * model.turns(np.array([diameter]))[0])[:, free]
        found = [np.linalg.solve(M, right) for right in (K, C, L.conj().T)]
        if not all(np.isfinite(each).all() for each in found):
            return math.inf, False
        (by_K, size), (by_C, _), (by_L, pulled) = map(_scaled, found)
        springs, stiffest = _scaled(stiff)
        added = float(np.linalg.norm(springs[:, None] * (L @ by_L), 2)) if stiff.size else 0.0
        fastest = max(fastest, size * _largest(by_K) + stiffest * pulled * added)
        joint = float(np.linalg.norm(by_K @ by_C - by_C @ by_K))
        apart = joint <= _DECOUPLED * float(np.linalg.norm(by_K) * np.linalg.norm(by_C))
        decoupled = decoupled and apart
    return math.sqrt(fastest) / omega, decoupled


def _scaled(array: Complex) -> tuple[Complex, float]:
    """Return an array over its largest entry, and that: its products then stay in the range of numbers."""
    size = float(np.abs(array).max(initial=0.0))
    return array / (size or 1.0), size


def _largest(matrix: Complex) -> float:
    """Return about the largest modulus of the eigenvalues."""
    vector, size = np.random.default_rng(0).normal(size=len(matrix)) + 0j, 0.0
    for _ in range(_POWERS):
        vector = matrix @ vector
        size = float(np.linalg.norm(vector))
        if size == 0.0:
            break
        vector /= size
    return size


def left_out(scene: Scene, stability: bool | None) -> str:
    """Return why no multipliers are computed; empty if they are."""
    if stability is False:
        return "not asked for"
    sectors = scene.structure.sector_count if scene.structure.has_sectors else 1
    size = sectors * len(scene.dofs)
    if stability is None and size > _MOST_COORDINATES:
        return f"left out: {size} coordinates take minutes; `stability=True` computes them"
    return ""
