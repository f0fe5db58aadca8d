"""The matrices of a structure with its bodies, made when they are first used; their derivatives.

Of masses, springs and dashpots they are one sum. Of a structure given by its matrices or modes they are told
for each nodal diameter: a full sector has its high boundary eliminated
(`solver.matrices.sectors.elimination`), a reduced one brings the matrices of each. That of n is the complex
conjugate of that of sectors − n; a structure without sectors has the nodal diameter 0 alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Real
from solver.contacts.fields import Between, parse_end
from solver.errors import SettingError
from solver.matrices.normal_modes import hermitian, undamped_modes
from solver.matrices.values import frozen
from solver.scene.bodies.body import Body
from solver.scene.cyclic.sector_blocks import at_diameter, full_elimination
from solver.scene.matrices_structure import MatricesStructure, Ratios

_SAME = 1e-9  # relative distance of two squared frequencies below which their quotient is a derivative


class Elements(NamedTuple):
    """The masses, springs and dashpots of a structure: everything its matrices follow from but bodies."""

    dofs: tuple[str, ...]
    masses: tuple[float, ...]  # of the first DOFs; the mass of a body is no point mass and stands apart
    springs: tuple[tuple[Between, float, float], ...]  # with stiffness and dashpot
    dampers: tuple[tuple[Between, float], ...]
    beta: float
    ratios: Ratios | None


class Matrices(NamedTuple):
    """Mass, damping and stiffness of a sector; p: to the next one."""

    M: Real
    C0: Real
    Cp: Real
    K0: Real
    Kp: Real


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


def _join(X0: Real, Xp: Real, ends: Between, value: float, index: dict[str, int]) -> None:
    """Add one spring or dashpot between two ends to X0 + Xp e^{j theta} + Xp^T e^{-j theta}."""
    first, second = map(parse_end, ends)
    here = [index[end.dof] for end in (first, second) if end.dof is not None]
    for i in here:
        X0[i, i] += value
    if len(here) < 2:
        return
    a, b = here
    if second.next:
        Xp[a, b] -= value
    elif first.next:
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


def ratio_of_modes(ratios: Ratios, count: int) -> Real:
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


def modal_damping_derivative(M: Real, K: Real, ratios: Ratios, dM: Real, dK: Real) -> Real:
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
def bodies_mass(n: int, bodies: tuple[Body, ...]) -> Real:
    """Mass matrix of the bodies behind `n` DOFs of the structure, which have none of it; read-only."""
    return frozen(block_diag(np.zeros((n, n)), *(body.mass_matrix() for body in bodies)))


def mass_of_bodies(n: int, bodies: tuple[Body, ...], masses: Mapping[str, Real], behind: int = 0) -> Real:
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


KCM = tuple[NDArray[Any], NDArray[Any], NDArray[Any]]
_NO_PROPORTIONAL = {"stiffness_proportional_damping": 0.0, "mass_proportional_damping": 0.0}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SectorMatrices:
    """The matrices of a structure with its bodies, and points without inertia, behind its coordinates."""

    structure: Annotated[MatricesStructure, "One sector, or the whole."]
    bodies: Annotated[tuple[Body, ...], "Of it."]
    points: Annotated[int, "How many points."]
    shapes: Annotated[
        NDArray[np.float64], "The DOFs of structure and bodies in the coordinates, (n_dofs, n)."
    ]

    @property
    def every_diameter(self) -> bool:
        """Whether all nodal diameters are known."""
        found = self.structure.diameters
        return found is None or len(found.diameters) == self.structure.sector_count // 2 + 1

    def at(self, diameter: int) -> KCM:
        """K, C and M at a nodal diameter, their Hermitian parts, real where the phase is; read-only.

        They are the same arrays each time, so that what follows from them can be kept.

        Raises
        ------
        SettingError
            The model was not reduced for this nodal diameter.
        """
        n, count = diameter % self.structure.sector_count, self.structure.sector_count
        found = _with_damping(self.structure, self.bodies, self.points, min(n, count - n))
        return found if 2 * n <= count else (found[0].conj(), found[1].conj(), found[2].conj())


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ProportionalDamping:
    """The derivatives by a proportional damping: C gains K or M of the structure, without its bodies."""

    sector: SectorMatrices
    which: Literal["K", "M"]

    def at(self, diameter: int) -> KCM:
        """Derivatives of K, C and M at a nodal diameter."""
        found = self.sector.at(diameter)[0 if self.which == "K" else 2].copy()
        found[len(found) - _behind(self.sector.bodies, self.sector.points) :] = 0.0
        nothing = np.zeros_like(found)
        return nothing, found, nothing


def _behind(bodies: tuple[Body, ...], points: int) -> int:
    """How many coordinates stand behind those of the structure."""
    return sum(len(body.dofs) for body in bodies) + points


@lru_cache(maxsize=16)
def sector_matrices(
    structure: MatricesStructure, bodies: tuple[Body, ...], points: int = 0
) -> SectorMatrices:
    """The matrices of a structure; the same object each time, so that what follows from them can be kept."""
    rows = list(structure.dofs.rows)
    if structure.modes is not None:
        own = structure.modes.modes[rows]
    else:
        if structure.has_sectors and structure.diameters is None:
            eliminated = full_elimination(structure)
            rows = [eliminated.row(row) for row in rows]
        own = np.zeros((len(rows), structure.n_coordinates))
        own[np.arange(len(rows)), rows] = 1.0
    shapes = frozen(block_diag(own, np.eye(_behind(bodies, points))))
    return SectorMatrices(structure=structure, bodies=bodies, points=points, shapes=shapes)


@lru_cache(maxsize=128)
def _with_damping(structure: MatricesStructure, bodies: tuple[Body, ...], points: int, n: int) -> KCM:
    own = structure.model_copy(update=_NO_PROPORTIONAL)
    K, C, M = _at(own, bodies, points, n)
    inner = slice(0, K.shape[0] - _behind(bodies, points))
    if structure.stiffness_proportional_damping or structure.mass_proportional_damping:
        C = C.copy()
        C[inner, inner] += structure.stiffness_proportional_damping * K[inner, inner]
        C[inner, inner] += structure.mass_proportional_damping * M[inner, inner]
    return K, frozen(C), M


@lru_cache(maxsize=128)
def _at(structure: MatricesStructure, bodies: tuple[Body, ...], points: int, n: int) -> KCM:
    """K, C and M without proportional damping."""
    K, C, M = _own(structure, n)
    if bodies or points:
        still, behind = np.zeros((points, points)), np.zeros((_behind(bodies, points),) * 2)
        K, C, M = (block_diag(K, behind), block_diag(C, behind), block_diag(M, bodies_mass(0, bodies), still))
    return frozen(K), frozen(C), frozen(M)


def _own(structure: MatricesStructure, n: int) -> KCM:
    """K, C and M of the structure alone, with its damping ratios."""
    modes, ratio = structure.modes, structure.damping_ratio
    if modes is not None:
        ratios = modes.damping_ratio
        if ratios is None:
            ratios = ratio_of_modes(0.0 if ratio is None else ratio, modes.omega2.size)
        return np.diag(modes.omega2), np.diag(2.0 * ratios * np.sqrt(modes.omega2)), np.eye(modes.omega2.size)
    # What is unsymmetric is among the extra terms; rounding must not look like it.
    K, C, M = (hermitian(matrix).copy() for matrix in at_diameter(structure, n))
    return K, C if ratio is None else C + modal_damping(M, K, ratio), M
