"""The matrices of masses, springs and dashpots with their derivatives; damping ratios, inertia of bodies."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.contacts.fields import End
from solver.errors import SettingError
from solver.matrices.normal_modes import undamped_modes
from solver.matrices.values import frozen
from solver.scene.bodies.body import Body
from solver.scene.bodies.kinematics import dof_names
from solver.scene.matrices_structure import Ratios
from solver.scene.scene_records import CyclicStructure, LumpedStructure

FloatArray = NDArray[np.float64]
_SAME = 1e-9  # relative distance of two squared frequencies below which their quotient is a derivative
_Ends = tuple[End, End]


class Elements(NamedTuple):
    """The masses, springs and dashpots of a structure: everything its matrices follow from but bodies."""

    dofs: tuple[str, ...]
    masses: tuple[float, ...]  # of the first DOFs; the mass of a body is no point mass and stands apart
    springs: tuple[tuple[_Ends, float, float], ...]  # with stiffness and dashpot
    dampers: tuple[tuple[_Ends, float], ...]
    beta: float
    ratios: Ratios | None


class Matrices(NamedTuple):
    """Mass, damping and stiffness of a sector; p: to the next one."""

    M: FloatArray
    C0: FloatArray
    Cp: FloatArray
    K0: FloatArray
    Kp: FloatArray


def elements_of(
    structure: LumpedStructure | CyclicStructure, bodies: tuple[Body, ...], points: tuple[str, ...] = ()
) -> Elements:
    """Return what a structure with bodies, and points without inertia behind them, consists of."""
    return Elements(
        dofs=(*dof_names(structure, bodies), *points), masses=tuple(mass.m for mass in structure.masses),
        springs=tuple((spring.ends, spring.k, spring.c) for spring in structure.springs),
        dampers=tuple((damper.ends, damper.c) for damper in structure.dampers),
        beta=structure.stiffness_proportional_damping,
        ratios=structure.damping_ratio if isinstance(structure, LumpedStructure) else None,
    )  # fmt: skip


def _assembled(elements: Elements) -> Matrices:
    """Return the matrices without modal damping."""
    n = len(elements.dofs)
    M, C0, Cp, K0, Kp = (np.zeros((n, n)) for _ in range(5))
    index = {dof: i for i, dof in enumerate(elements.dofs)}
    for i, mass in enumerate(elements.masses):
        M[i, i] = mass
    for ends, k, c in elements.springs:
        _join(K0, Kp, ends, k, index)
        _join(C0, Cp, ends, c + elements.beta * k, index)
    for ends, c in elements.dampers:
        _join(C0, Cp, ends, c, index)
    return Matrices(M, C0, Cp, K0, Kp)


def _join(X0: FloatArray, Xp: FloatArray, ends: _Ends, value: float, index: dict[str, int]) -> None:
    """Add one spring or dashpot between two ends to X0 + Xp e^{j theta} + Xp^T e^{-j theta}."""
    here = [index[end.dof] for end in ends if end.dof is not None]
    for i in here:
        X0[i, i] += value
    if len(here) < 2:
        return
    a, b = here
    if ends[1].next:
        Xp[a, b] -= value
    elif ends[0].next:
        Xp[b, a] -= value
    else:
        X0[a, b] -= value
        X0[b, a] -= value


@lru_cache(maxsize=256)
def matrices_of_elements(elements: Elements, bodies: tuple[Body, ...]) -> Matrices:
    """Return the matrices with modal damping and bodies; read-only."""
    found, own = _assembled(elements), len(elements.masses)
    if elements.ratios is not None:
        inner = np.s_[:own, :own]
        found.C0[inner] += modal_damping(found.M[inner], found.K0[inner], elements.ratios)
    if bodies:
        last = own + sum(len(body.dofs) for body in bodies)
        found.M[:last, :last] += bodies_mass(own, bodies)
    return Matrices(*map(frozen, found))


@lru_cache(maxsize=256)
def slopes_of_elements(elements: Elements, gains: tuple[tuple[int, float], ...]) -> tuple[Matrices, bool]:
    """Return their slopes where masses, springs and dashpots, counted in this order, gain so much.

    All but modal damping is linear in these numbers, so the slopes are constant: that is told too.
    """
    by, first = dict(gains), len(elements.masses)
    last = first + len(elements.springs)
    found = _assembled(elements._replace(
        masses=tuple(by.get(i, 0.0) for i in range(first)),
        springs=tuple((ends, by.get(i, 0.0), 0.0) for i, (ends, *_) in enumerate(elements.springs, first)),
        dampers=tuple((ends, by.get(i, 0.0)) for i, (ends, _) in enumerate(elements.dampers, last)),
    ))  # fmt: skip
    moved = bool(np.any(found.M) or np.any(found.K0))
    if elements.ratios is not None:
        at, inner = _assembled(elements), np.s_[:first, :first]
        found.C0[inner] += modal_damping_derivative(
            at.M[inner], at.K0[inner], elements.ratios, found.M[inner], found.K0[inner]
        )
    return Matrices(*map(frozen, found)), elements.ratios is None or not moved


def ratio_of_modes(ratios: Ratios, count: int) -> FloatArray:
    """Return the damping ratio of each of `count` modes: the last one given also of those above it."""
    given = np.atleast_1d(np.asarray(ratios, dtype=np.float64))
    return np.asarray(given[np.minimum(np.arange(count), given.size - 1)])


def modal_damping(M: NDArray[Any], K: NDArray[Any], ratios: Ratios) -> NDArray[Any]:
    """Return C with damping ratios in the modes, Σ 2 ζ ω (Mφ)(Mφ)ᴴ, of Hermitian M and K.

    A rigid body has none.
    """
    found = undamped_modes(K, M)
    momenta = M @ found.phi
    omega = np.sqrt(np.maximum(found.omega2, 0.0))
    zeta = ratio_of_modes(ratios, omega.size)
    return np.asarray((momenta * (2.0 * zeta * omega)) @ momenta.conj().T)


def modal_damping_derivative(
    M: FloatArray, K: FloatArray, ratios: Ratios, dM: FloatArray, dK: FloatArray
) -> FloatArray:
    """Return the derivative of `modal_damping` where M and K change by dM and dK.

    With φᵀMφ = 1, C = Mφ F φᵀM, F = 2ζω: modes turn into each other, φ' = φB with B_ij =
    φ_iᵀ(dK − λ_j dM)φ_j / (λ_j − λ_i), B_ii = −½ φ_iᵀ dM φ_i (Fox, Kapoor, AIAA J. 6 (1968) 2426), so that
    (BF + FBᵀ + F')_ij is a quotient of differences, which for equal frequencies is a derivative.

    Raises
    ------
    SettingError
        A mode with a frequency of zero, or two of one frequency with different ratios: C has a kink there.
    """
    found = undamped_modes(K, M)
    values, phi = found.omega2, found.phi
    zeta = ratio_of_modes(ratios, values.size)
    if np.any(values <= 0.0):
        raise SettingError("damping_ratio", list(zeta[:3]), "has no derivative where a mode is a rigid body")
    f = 2.0 * zeta * np.sqrt(values)
    kappa, mass = phi.T @ dK @ phi, phi.T @ dM @ phi
    apart = values[None, :] - values[:, None]
    same = np.abs(apart) <= _SAME * np.maximum(values[None, :], values[:, None])
    if np.any(same & (zeta[:, None] != zeta[None, :])):
        raise SettingError("damping_ratio", list(zeta[:3]), "must be equal for modes of one frequency here")
    gap = np.where(same, 1.0, apart)
    # f(λ) = 2ζ√λ and λ f(λ) as quotients of differences; of one frequency ζ/√λ and 3ζ√λ.
    rise = np.where(same, zeta / np.sqrt(values), (f[None, :] - f[:, None]) / gap)
    product = values * f
    bend = np.where(same, 3.0 * zeta * np.sqrt(values), (product[None, :] - product[:, None]) / gap)
    turned = kappa * rise - mass * bend
    momenta = M @ phi
    change = dM @ phi @ np.diag(f) @ momenta.T
    return np.asarray(momenta @ turned @ momenta.T + change + change.T)


@lru_cache(maxsize=64)
def bodies_mass(n: int, bodies: tuple[Body, ...]) -> FloatArray:
    """Mass matrix of the bodies behind `n` DOFs of the structure, which have none of it; read-only."""
    return frozen(block_diag(np.zeros((n, n)), *(body.mass_matrix() for body in bodies)))


def mass_of_bodies(
    n: int, bodies: tuple[Body, ...], masses: Mapping[str, FloatArray], behind: int = 0
) -> FloatArray:
    """Mass matrices of bodies by their names as one of `n` coordinates, `behind` after theirs; read-only."""
    blocks = [masses.get(body.name, np.zeros((len(body.dofs),) * 2)) for body in bodies]
    own = n - behind - sum(map(len, blocks))
    return frozen(block_diag(np.zeros((own, own)), *blocks, np.zeros((behind, behind))))


def block_diag(*blocks: NDArray[Any]) -> NDArray[Any]:
    """Return the matrix with these blocks on its diagonal: `scipy.linalg` takes longer to load than this."""
    rows, columns = (sum(block.shape[axis] for block in blocks) for axis in (0, 1))
    out, row, column = np.zeros((rows, columns), np.result_type(*blocks, np.float64)), 0, 0
    for block in blocks:
        out[row : row + block.shape[0], column : column + block.shape[1]] = block
        row, column = row + block.shape[0], column + block.shape[1]
    return out
