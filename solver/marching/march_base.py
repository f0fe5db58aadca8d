"""A base that moves as prescribed, as more coordinates of the time march.

Each excitation and each phase of its shares has a motion y of its own, that of a mass on a spring and a
dashpot, driven so that its steady motion is the one prescribed, y'' + 2ω y' + ω² y = f(t): what else it does
dies out within a few periods. Its acceleration drives the rest. The last coordinate adds up the observed
motion: it has the acceleration of what is observed, and begins at rest with it.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from solver.errors import SettingError
from solver.marching.kernels import march_state as kernel
from solver.scene.excitation import Excitation
from solver.scene.scene import Scene

FloatArray = NDArray[np.float64]
Push = tuple[int, float, float, int]  # coordinate, amplitude, phase [rad] and harmonic of a force
Terms = tuple[tuple[int, float], ...]  # coordinates with their factors in what is observed
_ORDERS = {"displacement": 0, "velocity": 1, "acceleration": 2}


def with_base(
    scene: Scene, A: csr_array, B: csr_array, W: csr_array, index: dict[str, int], omega: float, *,
    swept: bool = False,
) -> tuple[csr_array, csr_array, csr_array, Terms, list[Push]]:  # fmt: skip
    """Return x'' = W f - A x - B x' with the base and what is observed behind x, of which terms, and f.

    Driven DOFs are pushed by what holds their accelerations a to those prescribed: with the rows S of x they
    are, x'' = P (W f - A x - B x') + Q a, Q = W Sᵀ (S W Sᵀ)⁻¹ and P = 1 - Q S. While the frequency is `swept`
    a base of which velocity or acceleration is prescribed has it by itself, without spring and dashpot.
    """
    n = A.shape[0]
    phases = _bases(scene)
    m = n + len(phases)
    A, B, W = (_grown(each, m) for each in (A, B, W))
    shares = np.zeros((n, len(phases)))
    pushes = []
    for i, (e, turn) in enumerate(phases):
        at = n + i
        held = not swept or (e.base is not None and e.base.motion == "displacement")
        A[at, at], B[at, at], W[at, at] = omega**2 * held, 2.0 * omega * held, 1.0
        pushes.append((at, *_base_force(e, turn, omega), e.harmonic))
        for dof, share, phase in e.base.shares if e.base else ():
            shares[index[dof], i] += share * (phase == turn)
    ground = any(e.ground for e, _ in phases)
    moved = {index[dof] for e, _ in phases if e.base and not ground for dof, *_ in e.base.shares}
    driven = np.array(sorted(moved), np.int64)
    pulled, points = shares.copy(), np.array([index[point] for point in scene.points], np.int64)
    if points.size:  # no inertia pulls a point, but what its dashpot joins it to is accelerated
        heavy = np.setdiff1d(np.arange(n), points)
        pulled[points] = W[np.ix_(points, heavy)] @ np.linalg.solve(W[np.ix_(heavy, heavy)], shares[heavy])
    pushed = W[:n, driven] @ np.linalg.inv(W[np.ix_(driven, driven)])
    for matrix in (A, B, W):
        if ground:  # counted from the ground
            matrix[:n] -= pulled @ matrix[n:]
        else:
            matrix[:n] += pushed @ (shares[driven] @ matrix[n:] - matrix[driven])
    seen = [(index[dof], factor) for dof, factor in scene.seen(scene.observe.dof) or ()]
    if scene.observe.relative:
        total = 0.0 if ground else sum(factor for _, factor in seen)
        of_base = np.array([-total * (turn == 0.0) for _, turn in phases])
    else:
        of_base = ground * sum((factor * shares[at] for at, factor in seen), np.zeros(len(phases)))
    terms = [*seen, *zip(range(n, m), of_base.tolist(), strict=True)]
    *grown, _ = with_sum(terms, csr_array(A), csr_array(B), csr_array(W))
    return *grown, tuple(terms), pushes


def base_over(scene: Scene, system: kernel.System, begin: float, change: float) -> kernel.System:
    """Return the equations of `with_base`, swept, with what moves the base as prescribed while φ' changes.

    With θ = k φ + phase the base moves by y = a cos θ, or y' or y'' is that: with y'' + 2 y' + y = f, in the
    unit of time, f = a (1 − θ'²) cos θ − a (2 θ' + θ'') sin θ, polynomials of time; else y'' = −a θ' sin θ,
    or a cos θ.

    Parameters
    ----------
    begin, change : φ' at its beginning and φ'', in the unit of time.
    """
    bases = _bases(scene)
    kept, omega = system.force_dof.size - len(bases), system.omega
    places, amplitudes, phases, harmonics = [], [], [], []
    for place, (e, turn) in zip(_places(scene, system), bases, strict=True):
        motion = e.base.motion if e.base else ""
        a, first, second = e.amplitude / omega ** _ORDERS[motion], e.harmonic * begin, e.harmonic * change
        by_motion = {
            "displacement": [
                (0.0, (1.0 - first**2, -2.0 * first * second, -(second**2))),
                (0.5 * math.pi, (2.0 * first + second, 2.0 * second, 0.0)),
            ],
            "velocity": [(0.5 * math.pi, (first, second, 0.0))],
            "acceleration": [(0.0, (1.0, 0.0, 0.0))],
        }
        for ahead, polynomial in by_motion[motion]:
            places.append(place)
            amplitudes.append(omega**2 * a * np.array(polynomial))
            phases.append(e.phase + turn + ahead)
            harmonics.append(e.harmonic)
    level, course = np.array(amplitudes)[:, 0], np.array(amplitudes)[:, 1:].T
    before = system.force_course[:, :kept] if system.force_course.size else np.zeros((2, kept))
    return system._replace(
        force_dof=np.append(system.force_dof[:kept], np.array(places, np.int64)),
        force_amplitude=np.append(system.force_amplitude[:kept], level),
        force_phase=np.append(system.force_phase[:kept], phases),
        force_harmonic=np.append(system.force_harmonic[:kept], np.array(harmonics, np.int64)),
        force_course=np.ascontiguousarray(np.hstack([before, course])),
    )


def base_begins(
    scene: Scene, index: Mapping[str, int], system: kernel.System, begin: float
) -> tuple[FloatArray, FloatArray]:
    """Return place and velocity of the base and of what it drives where a run begins, NaN of all else.

    Of a velocity or an acceleration the motion is the one that is steady at the first frequency, and at 0 Hz
    begins at the place 0. `begin` is φ' there in the unit of time.
    """
    places = _places(scene, system)
    x, v = np.full((2, system.A.start.size - 1), np.nan)
    driven = {dof for e, _ in _bases(scene) if e.base and not e.ground for dof, *_ in e.base.shares}
    for vector in (x, v):
        vector[[*places, *(index[dof] for dof in driven)]] = 0.0
    for at, (e, turn) in zip(places, _bases(scene), strict=True):
        order = _ORDERS[e.base.motion if e.base else ""]
        a = e.amplitude / system.omega**order * cmath.exp(1j * (e.phase + turn))
        for power, vector in ((-order, x), (1 - order, v)):
            known = power >= 0 or begin > 0.0
            vector[at] = (a * (1j * e.harmonic * begin) ** power).real if known else 0.0
            for dof, share, phase in e.base.shares if e.base and not e.ground else ():
                vector[index[dof]] += share * (phase == turn) * vector[at]
    return x, v


def _places(scene: Scene, system: kernel.System) -> range:
    """Return the coordinates of the bases: what is observed stands behind them."""
    end = system.A.start.size - 2
    return range(end - len(_bases(scene)), end)


def with_sum(
    terms: Sequence[tuple[int, float]], A: csr_array, B: csr_array, W: csr_array
) -> tuple[csr_array, csr_array, csr_array, int]:
    """Return the equations with a sum of coordinates as one more behind them, and where it is."""
    n = A.shape[0]
    grown = [_grown(each, n + 1) for each in (A, B, W)]
    for matrix in grown:
        matrix[n] = sum(factor * matrix[at] for at, factor in terms)
    A, B, W = map(csr_array, grown)
    return A, B, W, n


def _bases(scene: Scene) -> list[tuple[Excitation, float]]:
    """Return each base that moves with each phase of its shares, in the order of their coordinates."""
    moved = ((e, e.base.shares) for e in scene.excitation if e.base)
    # First the phase 0, that of what a relative motion is counted from.
    return [(e, phase) for e, own in moved for phase in dict.fromkeys((0.0, *(phase for *_, phase in own)))]


def _base_force(force: Excitation, turn: float, omega: float) -> tuple[float, float]:
    """Return amplitude and phase of what drives the base to the motion prescribed, at ω [rad/s]."""
    if force.base is None:
        raise SettingError("excitation", force.place, "must be a base that moves")
    turning = 1j * force.harmonic * omega
    moved = force.amplitude * cmath.exp(1j * (force.phase + turn)) / turning ** _ORDERS[force.base.motion]
    push = moved * (turning + omega) ** 2
    return abs(push), cmath.phase(push)


def _grown(matrix: csr_array, n: int) -> FloatArray:
    dense = np.zeros((n, n))
    dense[: matrix.shape[0], : matrix.shape[1]] = matrix.toarray()
    return dense
