"""What a structure has beside springs and dashpots: couplings, gyroscopic and hysteretic terms, gas.

A sector given by its matrices has G, K_omega2 and what is unsymmetric as blocks at the offsets 0, 1 and −1,
as its high boundary is eliminated; structural damping goes with its stiffness at each nodal diameter, however
that is known.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from solver.arrays import Complex, Real
from solver.linear.model import Blocks, Coordinates, ExtraTerms, OwnTerms, Terms
from solver.matrices.values import frozen
from solver.scene.bodies.body import REVOLUTIONS
from solver.scene.cyclic.sector_blocks import full_elimination
from solver.scene.linear_terms import Entry
from solver.scene.scene import MatricesStructure, Scene
from solver.scene.scene_parameter import Slope


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


def extra_terms(scene: Scene, coordinates: Coordinates) -> ExtraTerms:
    """Return the extra terms of a scene.

    The same object each time for the same parts, so that what follows from it can be kept.
    """
    spin = (scene.speed or 0.0) * REVOLUTIONS
    return _terms(scene.entries, scene.structure.loss_factor, spin, coordinates)


@lru_cache(maxsize=64)
def _terms(entries: tuple[Entry, ...], loss: float, spin: float, coordinates: Coordinates) -> ExtraTerms:
    total = _Sum(coordinates)
    total.add_entries(entries, 1.0, spin**2, spin)
    total.add_own(1.0 + 1j * loss, 1.0, spin**2, spin)
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
    spin = (scene.speed or 0.0) * REVOLUTIONS
    first.add_entries(slope.entries, 1.0, spin**2, spin)
    if slope.loss:
        first.add_own(1j, 0.0, 0.0, 0.0)
    if spinning:
        first.add_turning(scene, 2.0 * spin * REVOLUTIONS, REVOLUTIONS)
        second.add_turning(scene, 2.0 * REVOLUTIONS**2, 0.0)
    bent = second.terms()
    return first.terms(loss_factor, lossy), bent if np.any(bent.K) else None


def terms_of_line(scene: Scene, coordinates: Coordinates) -> ExtraTerms | None:
    """Return what K gains per squared speed and C per speed [rad/s]; None where nothing depends on it."""
    if not depends_on_speed(scene):
        return None
    total = _Sum(coordinates)
    total.add_turning(scene, 1.0, 1.0)
    return total.terms()


def depends_on_speed(scene: Scene) -> bool:
    """Whether matrices of a scene depend on the speed of rotation."""
    given = scene.structure
    spinning = isinstance(given, MatricesStructure) and not (given.G is None and given.K_omega2 is None)
    return spinning or any(entry.turns for entry in scene.entries)


class _Sum:
    """Adds entries up in the coordinates of the matrices."""

    def __init__(self, coordinates: Coordinates) -> None:
        self._in = coordinates
        self._n = coordinates.shapes.shape[1]
        self._K: dict[int, Complex] = {}
        self._C: dict[int, Complex] = {}

    def add_entries(self, entries: tuple[Entry, ...], one: float, square: float, spin: float) -> None:
        """Add what is constant, goes with the squared speed and with the speed, times these factors."""
        for entry in entries:
            on, of = self._in.at(entry.on), self._in.at(entry.of)
            place = np.outer(on, of)
            self._at(self._K, entry.offset)[:] += (one * entry.k + square * entry.k_omega2) * place
            self._at(self._C, entry.offset)[:] += (one * entry.c + spin * entry.g) * place

    def add_own(self, K: complex, C: float, square: float, spin: float) -> None:
        """Add the structure's own matrices times these factors, in front of the coordinates of bodies."""
        own = self._in.own
        if own is None:
            return
        skew_K, skew_C = own.skew
        parts = (skew_K, K), (own.K_omega2, square), (skew_C, C), (own.G, spin)
        for to, (blocks, factor) in zip((self._K, self._K, self._C, self._C), parts, strict=True):
            for offset, matrix in blocks if factor else ():
                size = len(matrix)
                self._at(to, offset)[:size, :size] += factor * matrix

    def add_turning(self, scene: Scene, square: float, spin: float) -> None:
        """Add all that goes with the squared speed and with the speed, times these factors."""
        self.add_entries(scene.entries, 0.0, square, spin)
        self.add_own(0.0, 0.0, square, spin)

    def terms(self, loss_factor: float = 0.0, lossy: Terms | None = None) -> ExtraTerms:
        """Return what was added, with structural damping."""
        offsets = tuple(sorted({0, *self._K, *self._C}))
        K, C = (frozen(np.array([self._at(part, m) for m in offsets])) for part in (self._K, self._C))
        return ExtraTerms(offsets=offsets, K=K, C=C, loss_factor=loss_factor, lossy=lossy)

    def _at(self, part: dict[int, Complex], offset: int) -> Complex:
        return part.setdefault(offset, np.zeros((self._n, self._n), np.complex128))
