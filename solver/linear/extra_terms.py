"""What a structure has beside springs and dashpots: couplings, gyroscopic and hysteretic terms, gas.

Kept apart from the symmetric matrices of `solver.linear.model.LinearModel` as Σ_m X_m e^{jmθ} over offsets m
between sectors, complex where a term is one of the frequency domain. A hysteretic term (structural damping
K (1 + iη), an imaginary coefficient) is of a motion e^{iωt} with ω > 0 and has no share in the mean.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from solver.matrices.values import Matrix
from solver.scene.bodies.body import REVOLUTIONS
from solver.scene.scene import CyclicStructure, MatricesStructure, Scene, Structure
from solver.scene.terms.linear_terms import Entry

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


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
    """

    offsets: tuple[int, ...]
    K: Complex
    C: Complex
    still: Real | None = None

    @property
    def is_real(self) -> bool:
        """Whether all of it is a term of equations in time."""
        return not (np.any(self.K.imag) or np.any(self.C.imag))

    @property
    def keeps_energy(self) -> bool:
        """Whether it is gyroscopic alone: no stiffness, and antisymmetric damping, which does no work."""
        if np.any(self.K) or np.any(self.C.imag):
            return False
        by = dict(zip(self.offsets, self.C, strict=True))
        return all(
            -offset in by and np.allclose(C, -by[-offset].T, rtol=0.0, atol=1e-12 * np.abs(C).max())
            for offset, C in by.items()
        )

    def at(self, turns: Complex, moving: NDArray[np.bool_]) -> tuple[Complex, Complex]:
        """Return what it adds to K and C, (ns, n, n), at e^{jθ} of structures that move or are at rest."""
        powers = turns[:, None] ** np.array(self.offsets)
        K = np.einsum("sm,mij->sij", powers, self.K)
        if not np.all(moving) and np.any(self.K.imag):
            still = np.einsum("sm,mij->sij", powers, self.K.real.astype(np.complex128))
            K = np.where(moving[:, None, None], K, still)
        if self.still is not None:
            K = K + np.where(moving, 0.0, 1.0)[:, None, None] * self.still
        return K, np.einsum("sm,mij->sij", powers, self.C)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Symmetric:
    """The symmetric stiffness that structural damping goes with, and what a matrix of a file has beside it.

    Attributes
    ----------
    K0, Kp : (n, n) array
        Stiffness [N/m] of a sector, and to the next one.
    shapes : (n_dofs, n) array
        The DOFs in the coordinates of the matrices.
    skew : tuple of arrays or None
        Antisymmetric parts of K and C.
    """

    K0: Real
    Kp: Real
    shapes: Real
    skew: tuple[Real, Real] | None = None

    @property
    def key(self) -> tuple[int, ...]:
        """Tells equal ones apart from others: the arrays are the same as long as the structure is."""
        return tuple(map(id, (self.K0, self.Kp, self.shapes, *(self.skew or ()))))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Symmetric) and self.key == other.key

    def __hash__(self) -> int:
        return hash(self.key)


def extra_terms(scene: Scene, symmetric: Symmetric) -> ExtraTerms | None:
    """Return the extra terms of a scene; None if it has none.

    The same object each time for the same parts, so that what follows from it can be kept.
    """
    structure = scene.structure
    spinning = _spinning(structure)
    own = structure.loss_factor or any(spinning) or symmetric.skew
    if not (scene.couplings or scene.aerodynamics or own):
        return None
    spin = (scene.speed or 0.0) * REVOLUTIONS
    return _terms(_entries(scene), scene.dofs, structure.loss_factor, spin, spinning, symmetric)


@lru_cache(maxsize=64)
def _terms(
    entries: tuple[Entry, ...],
    dofs: tuple[str, ...],
    loss: float,
    spin: float,
    spinning: tuple[Matrix | None, Matrix | None],
    symmetric: Symmetric,
) -> ExtraTerms:
    total = _Sum(symmetric.shapes, dofs)
    for entry in entries:
        total.add(entry, entry.k + spin**2 * entry.k_omega2, entry.c + spin * entry.g)
    if symmetric.skew is not None:
        total.add_own(*symmetric.skew)
    G, K_omega2 = (0.0 if matrix is None else matrix.array for matrix in spinning)
    if any(spinning):
        total.add_own(spin**2 * K_omega2, spin * G)
    if loss:
        total.add_stiffness(1j * loss, symmetric.K0, symmetric.Kp)
    return total.terms()


def terms_by_stiffness(scene: Scene, dK0: Real, dKp: Real) -> ExtraTerms | None:
    """Return the derivative of the extra terms by a parameter that changes K0 and Kp: structural damping."""
    if not scene.structure.loss_factor or not (np.any(dK0) or np.any(dKp)):
        return None
    total = _Sum(np.eye(dK0.shape[0]), ())
    total.add_stiffness(1j * scene.structure.loss_factor, dK0, dKp)
    return total.terms()


def terms_by_loss(symmetric: Symmetric) -> ExtraTerms:
    """Return their derivative by the loss factor."""
    total = _Sum(symmetric.shapes, ())
    total.add_stiffness(1j, symmetric.K0, symmetric.Kp)
    return total.terms()


def terms_by_gas(scene: Scene, name: str, symmetric: Symmetric) -> ExtraTerms:
    """Return their derivative by the factor of aerodynamic influence of that name."""
    total = _Sum(symmetric.shapes, scene.dofs)
    for gas in scene.aerodynamics:
        if gas.name == name and isinstance(scene.structure, CyclicStructure):
            for entry in gas.model_copy(update={"factor": 1.0}).entries(scene.structure.sectors):
                total.add(entry, entry.k, entry.c)
    return total.terms()


def terms_of_line(scene: Scene, symmetric: Symmetric) -> ExtraTerms | None:
    """Return what K gains per squared speed and C per speed [rad/s]; None where nothing depends on it."""
    if not depends_on_speed(scene):
        return None
    G, K_omega2 = (0.0 if m is None else m.array for m in _spinning(scene.structure))
    total = _Sum(symmetric.shapes, scene.dofs)
    for entry in _entries(scene):
        total.add(entry, entry.k_omega2, entry.g)
    total.add_own(K_omega2, G)
    return total.terms()


def terms_by_speed(scene: Scene, symmetric: Symmetric) -> tuple[ExtraTerms, ExtraTerms]:
    """Return their first and second derivative by the speed in 1/min."""
    G, K_omega2 = (0.0 if m is None else m.array for m in _spinning(scene.structure))
    spin = (scene.speed or 0.0) * REVOLUTIONS
    first, second = (_Sum(symmetric.shapes, scene.dofs) for _ in range(2))
    for entry in _entries(scene):
        first.add(entry, 2.0 * spin * REVOLUTIONS * entry.k_omega2, REVOLUTIONS * entry.g)
        second.add(entry, 2.0 * REVOLUTIONS**2 * entry.k_omega2, 0.0)
    first.add_own(2.0 * spin * REVOLUTIONS * K_omega2, REVOLUTIONS * G)
    second.add_own(2.0 * REVOLUTIONS**2 * K_omega2, 0.0)
    return first.terms(), second.terms()


def depends_on_speed(scene: Scene) -> bool:
    """Whether matrices of a scene depend on the speed of rotation."""
    return any(coupling.turns for coupling in scene.couplings) or any(_spinning(scene.structure))


class _Sum:
    """Adds entries up in the coordinates of the matrices."""

    def __init__(self, shapes: Real, dofs: tuple[str, ...]) -> None:
        self._shapes, self._dofs = shapes, dofs
        self._n = shapes.shape[1]
        self._K: dict[int, Complex] = {}
        self._C: dict[int, Complex] = {}

    def add(self, entry: Entry, k: complex, c: complex) -> None:
        """Add k and c in the row of one DOF and the column of another."""
        on, of = (self._shapes[self._dofs.index(dof)] for dof in (entry.on, entry.of))
        self._at(self._K, entry.offset)[:] += k * np.outer(on, of)
        self._at(self._C, entry.offset)[:] += c * np.outer(on, of)

    def add_own(self, K: Real | float, C: Real | float) -> None:
        """Add matrices of the structure's own coordinates, in front of those of bodies."""
        for to, matrix in ((self._K, K), (self._C, C)):
            size = np.shape(matrix)[0] if np.ndim(matrix) else 0
            self._at(to, 0)[:size, :size] += matrix

    def add_stiffness(self, factor: complex, K0: Real, Kp: Real) -> None:
        """Add a multiple of the stiffness of a sector."""
        for offset, matrix in ((0, K0), (1, Kp), (-1, Kp.T)):
            if offset == 0 or np.any(Kp):
                self._at(self._K, offset)[:] += factor * matrix

    def terms(self) -> ExtraTerms:
        """Return what was added."""
        offsets = tuple(sorted({0, *self._K, *self._C}))
        K, C = (np.array([self._at(part, m) for m in offsets]) for part in (self._K, self._C))
        for array in (K, C):
            array.setflags(write=False)
        return ExtraTerms(offsets=offsets, K=K, C=C)

    def _at(self, part: dict[int, Complex], offset: int) -> Complex:
        return part.setdefault(offset, np.zeros((self._n, self._n), np.complex128))


def _spinning(structure: Structure) -> tuple[Matrix | None, Matrix | None]:
    """G and K_omega2 of a structure given by matrices."""
    if not isinstance(structure, MatricesStructure):
        return None, None
    return structure.G, structure.K_omega2


def _entries(scene: Scene) -> tuple[Entry, ...]:
    """Every entry that couplings and gas add."""
    own = [entry for coupling in scene.couplings for entry in coupling.entries()]
    if isinstance(scene.structure, CyclicStructure):
        own += [entry for gas in scene.aerodynamics for entry in gas.entries(scene.structure.sectors)]
    return tuple(own)
