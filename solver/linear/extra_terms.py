"""What a structure has beside springs and dashpots: couplings, gyroscopic and hysteretic terms, gas.

Kept apart from the symmetric matrices of `solver.linear.model.LinearModel` as Σ_m X_m e^{jmθ} over offsets m
between sectors, complex where a term is one of the frequency domain. A hysteretic term (structural damping
K (1 + iη), an imaginary coefficient) is of a motion e^{iωt} with ω > 0 and has no share in the mean.

A sector given by its matrices has G, K_omega2 and what is unsymmetric as blocks at the offsets 0, 1 and −1,
as its high boundary is eliminated; structural damping goes with its stiffness at each nodal diameter, however
that is known.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from solver.matrices.sectors.blocks import full_elimination
from solver.matrices.values import frozen
from solver.scene.bodies.body import REVOLUTIONS
from solver.scene.linear_terms import Entry
from solver.scene.scene import MatricesStructure, Scene
from solver.scene.scene_parameter import Slope

if TYPE_CHECKING:
    from solver.linear.model import Terms

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Blocks = tuple[tuple[int, Real], ...]  # offsets between sectors, and a matrix for each


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ExtraTerms:
    """Terms beside the symmetric matrices; all arrays read-only, m offsets.

    Attributes
    ----------
    offsets : tuple of int
        Sectors ahead; (0,) of a structure without sectors.
    K, C : (m, n, n) array
        Complex stiffness [N/m] and damping [N s/m].
    still : (n, n) array or None
        Stiffness of the mean alone [N/m].
    loss_factor : float
        The symmetric stiffness times i and this belongs to it too.
    lossy : Terms or None
        Those whose stiffness it is; None: of the terms beside which these stand.
    """

    offsets: tuple[int, ...]
    K: Complex
    C: Complex
    still: Real | None = None
    loss_factor: float = 0.0
    lossy: Terms | None = None

    @property
    def is_real(self) -> bool:
        """Whether all of it is a term of equations in time."""
        return not (self.loss_factor or np.any(self.K.imag) or np.any(self.C.imag))

    @property
    def keeps_energy(self) -> bool:
        """Whether it is gyroscopic alone: no stiffness, and antisymmetric damping, which does no work."""
        if self.loss_factor or np.any(self.K) or np.any(self.C.imag):
            return False
        by = dict(zip(self.offsets, self.C, strict=True))
        return all(
            -offset in by and np.allclose(C, -by[-offset].T, rtol=0.0, atol=1e-12 * np.abs(C).max())
            for offset, C in by.items()
        )

    def at(
        self, turns: Complex, moving: NDArray[np.bool_], stiffness: Callable[[], NDArray[Any]]
    ) -> tuple[Complex, Complex]:
        """Return what it adds to K and C, (ns, n, n), at e^{jθ} of structures that move or are at rest.

        `stiffness` gives the symmetric one (ns, n, n), with which structural damping goes.
        """
        powers = turns[:, None] ** np.array(self.offsets)
        K = np.einsum("sm,mij->sij", powers, self.K)
        if not np.all(moving) and np.any(self.K.imag):
            still = np.einsum("sm,mij->sij", powers, self.K.real.astype(np.complex128))
            K = np.where(moving[:, None, None], K, still)
        if self.still is not None:
            K = K + np.where(moving, 0.0, 1.0)[:, None, None] * self.still
        if self.loss_factor:
            K = K + np.where(moving, 1j * self.loss_factor, 0.0)[:, None, None] * stiffness()
        return K, np.einsum("sm,mij->sij", powers, self.C)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OwnTerms:
    """What a structure given by matrices has beside the symmetric ones, as blocks by offsets between sectors.

    Attributes
    ----------
    skew : Blocks, Blocks
        Antisymmetric parts of K and C.
    G, K_omega2 : Blocks
        Damping per speed and stiffness per squared speed.
    """

    skew: tuple[Blocks, Blocks]
    G: Blocks
    K_omega2: Blocks


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Coordinates:
    """What extra terms are written in.

    Attributes
    ----------
    dofs : tuple of str
        Names of the DOFs.
    shapes : (n_dofs, n) array
        The DOFs in the coordinates of the matrices.
    direct : bool
        Whether they are these coordinates themselves, as of a lumped structure.
    own : OwnTerms or None
        What the structure's own coordinates, in front of those of bodies, have beside symmetric matrices.
    """

    dofs: tuple[str, ...]
    shapes: Real
    direct: bool = False
    own: OwnTerms | None = None

    def rows(self, selected: NDArray[Any]) -> NDArray[Any]:
        """Return rows over the DOFs as rows over the coordinates; read-only."""
        return selected if self.direct else frozen(selected @ self.shapes)

    @property
    def key(self) -> tuple[object, ...]:
        """Tells equal ones apart from others: the objects are the same as long as the structure is."""
        return id(self.shapes), id(self.own), self.dofs

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Coordinates) and self.key == other.key

    def __hash__(self) -> int:
        return hash(self.key)


def own_terms(structure: MatricesStructure) -> OwnTerms | None:
    """Return the terms of a structure beside its symmetric matrices; None where there are none.

    The same object each time for the same structure.
    """
    if structure.symmetric and structure.G is None and structure.K_omega2 is None:
        return None
    return _own(structure)


@lru_cache(maxsize=16)
def _own(structure: MatricesStructure) -> OwnTerms | None:
    K, C = (
        None if structure.symmetric or matrix is None else 0.5 * (matrix.array - matrix.array.T)
        for matrix in (structure.K, structure.C)
    )
    G, K_omega2 = (None if matrix is None else matrix.array for matrix in (structure.G, structure.K_omega2))
    found = OwnTerms(
        skew=(_blocks(structure, K), _blocks(structure, C)),
        G=_blocks(structure, G), K_omega2=_blocks(structure, K_omega2),
    )  # fmt: skip
    return found if any((*found.skew, found.G, found.K_omega2)) else None


def _blocks(structure: MatricesStructure, matrix: Real | None) -> Blocks:
    """A matrix of the structure in its coordinates."""
    if matrix is None or not np.any(matrix):
        return ()
    if not structure.has_sectors:
        return ((0, matrix),)
    left = full_elimination(structure).of(matrix)
    return (0, left.own), (1, left.next), (-1, left.last)


def extra_terms(scene: Scene, coordinates: Coordinates) -> ExtraTerms | None:
    """Return the extra terms of a scene; None if it has none.

    The same object each time for the same parts, so that what follows from it can be kept.
    """
    loss = scene.structure.loss_factor
    if not (scene.couplings or scene.aerodynamics or loss or coordinates.own):
        return None
    spin = (scene.speed or 0.0) * REVOLUTIONS
    return _terms(_entries(scene), loss, spin, coordinates)


@lru_cache(maxsize=64)
def _terms(entries: tuple[Entry, ...], loss: float, spin: float, coordinates: Coordinates) -> ExtraTerms:
    total = _Sum(coordinates)
    total.add_entries(entries)
    if coordinates.own is not None:
        total.add_own(*coordinates.own.skew, 1.0 + 1j * loss)
    total.add_turning(entries, spin**2, spin)
    return total.terms(loss)


def extra_slopes(
    scene: Scene, slope: Slope, coordinates: Coordinates, loss_factor: float, lossy: Terms | None
) -> tuple[ExtraTerms | None, ExtraTerms | None]:
    """Return the first and second derivatives of the extra terms by a parameter; None where they are 0.

    `loss_factor` is that of what the symmetric stiffness gains, or 1 of the stiffness of `lossy`.
    """
    spinning = slope.speed and depends_on_speed(scene)
    if not (slope.entries or loss_factor or spinning):
        return None, None
    first, second = (_Sum(coordinates) for _ in range(2))
    first.add_entries(slope.entries)
    if coordinates.own is not None and slope.loss:
        first.add_own(coordinates.own.skew[0], (), 1j)
    if spinning:
        spin, entries = (scene.speed or 0.0) * REVOLUTIONS, _entries(scene)
        first.add_turning(entries, 2.0 * spin * REVOLUTIONS, REVOLUTIONS)
        second.add_turning(entries, 2.0 * REVOLUTIONS**2, 0.0)
    bent = second.terms()
    return first.terms(loss_factor, lossy), bent if np.any(bent.K) else None


def terms_of_line(scene: Scene, coordinates: Coordinates) -> ExtraTerms | None:
    """Return what K gains per squared speed and C per speed [rad/s]; None where nothing depends on it."""
    if not depends_on_speed(scene):
        return None
    total = _Sum(coordinates)
    total.add_turning(_entries(scene), 1.0, 1.0)
    return total.terms()


def depends_on_speed(scene: Scene) -> bool:
    """Whether matrices of a scene depend on the speed of rotation."""
    given = scene.structure
    spinning = isinstance(given, MatricesStructure) and not (given.G is None and given.K_omega2 is None)
    return spinning or any(coupling.turns for coupling in scene.couplings)


class _Sum:
    """Adds entries up in the coordinates of the matrices."""

    def __init__(self, coordinates: Coordinates) -> None:
        self._in = coordinates
        self._n = coordinates.shapes.shape[1]
        self._K: dict[int, Complex] = {}
        self._C: dict[int, Complex] = {}

    def add_entries(self, entries: tuple[Entry, ...]) -> None:
        """Add what does not depend on the speed."""
        for entry in entries:
            self._add(entry, entry.k, entry.c)

    def _add(self, entry: Entry, k: complex, c: complex) -> None:
        """Add k and c in the row of one DOF and the column of another."""
        on, of = (self._in.shapes[self._in.dofs.index(dof)] for dof in (entry.on, entry.of))
        self._at(self._K, entry.offset)[:] += k * np.outer(on, of)
        self._at(self._C, entry.offset)[:] += c * np.outer(on, of)

    def add_own(self, K: Blocks, C: Blocks, by: complex = 1.0, by_c: complex = 1.0) -> None:
        """Add multiples of the structure's own matrices, in front of the coordinates of bodies."""
        for to, blocks, factor in ((self._K, K, by), (self._C, C, by_c)):
            for offset, matrix in blocks:
                size = len(matrix)
                self._at(to, offset)[:size, :size] += factor * matrix

    def add_turning(self, entries: tuple[Entry, ...], square: float, spin: float) -> None:
        """Add what goes with the squared speed and with the speed, times these factors."""
        for entry in entries:
            self._add(entry, square * entry.k_omega2, spin * entry.g)
        if self._in.own is not None:
            self.add_own(self._in.own.K_omega2, self._in.own.G, square, spin)

    def terms(self, loss_factor: float = 0.0, lossy: Terms | None = None) -> ExtraTerms:
        """Return what was added, with structural damping."""
        offsets = tuple(sorted({0, *self._K, *self._C}))
        K, C = (frozen(np.array([self._at(part, m) for m in offsets])) for part in (self._K, self._C))
        return ExtraTerms(offsets=offsets, K=K, C=C, loss_factor=loss_factor, lossy=lossy)

    def _at(self, part: dict[int, Complex], offset: int) -> Complex:
        return part.setdefault(offset, np.zeros((self._n, self._n), np.complex128))


def _entries(scene: Scene) -> tuple[Entry, ...]:
    """Every entry that couplings and gas add."""
    own = [entry for coupling in scene.couplings for entry in coupling.entries()]
    own += [entry for gas in scene.aerodynamics for entry in gas.entries(scene.structure.sector_count)]
    return tuple(own)
