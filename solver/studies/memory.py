"""How much memory solving a scene takes: the bytes of its dense matrices, from sizes alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from solver.linear.condensation import FEWEST_PORTS, WORTHWHILE
from solver.scene.cyclic.annulus import sectors_needed
from solver.scene.scene import Scene
from solver.scene.scene_harmonics import MULTIPLES, even_harmonics_reason, kept_harmonics
from solver.scene.scene_records import MatricesStructure

_REAL, _COMPLEX = 8, 16
# Matrices of n x n that are there together while a structure is decomposed: with damping that is diagonal in
# the modes, and with the state matrix and both its eigenvectors. Measured, see docs/operations.md.
_OF_MODES = 26
_OF_POLES = 48
_OF_A_MARCH = 8
# Of the ports at each harmonic: receptance and slope; and what a Jacobian is condensed with.
_OF_PORTS = 2
_OF_CONDENSATION = 6
_OF_LEADING = 3
_OF_ALL_PORTS = 4  # while the model is condensed, before the leading ones are known
# Resonances are looked for in many matrices of the modes kept at a time, with their eigenvectors.
_LOOKED_AT = 2_000_000
_OF_RESONANCES = 4
_MODES_LOOKED_AT = 160
_POINTS_LOOKED_AT = 20
# The balance in which the error is estimated has H + max(H, 8) harmonics, and the receptance of four times as
# many is looked at.
_LEAST_BEYOND = 8
_TAIL = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class DenseBytes:
    """The memory that dense matrices take [bytes]."""

    structure: Annotated[int, "Of the linear part: the matrices, their modes, and what finding these takes."]
    balance: Annotated[
        int,
        "Of the balance, of the larger one in which its error is estimated, and of what resonances are "
        "looked for in.",
    ]

    @property
    def total(self) -> int:
        """Of both."""
        return self.structure + self.balance


def dense_bytes(scene: Scene, harmonics: int, *, every_sector: bool = False) -> DenseBytes:
    """Return the memory that a response takes, whichever parameter it is followed in.

    Nothing is built: sectors, DOFs, motions of contacts and harmonics are counted.

    Parameters
    ----------
    scene : what vibrates.
    harmonics : highest one kept.
    every_sector : whether all sectors of a disk are solved though one would stand for them.
    """
    sectors = _sectors(scene, every_sector)
    n, ports = _dofs(scene) * sectors, sum(scene.port_counts) * sectors
    odd = even_harmonics_reason(scene) is None
    beyond = harmonics + max(harmonics, _LEAST_BEYOND)
    kept = kept_harmonics(scene, (), harmonics, odd=odd)
    more = kept_harmonics(scene, (), beyond, odd=odd, multiples=2 * MULTIPLES)
    structures, number = 1, _REAL
    if scene.structure.has_sectors and sectors == 1:
        # One for each nodal diameter that is met.
        structures = np.unique((kept * scene.engine_order) % scene.structure.sector_count).size
        number = _COMPLEX
    modes = min(n, _MODES_LOOKED_AT)
    # No more motions lead than there are coordinates, in one sector those with the neighbour's.
    leading = min(ports, n * (1 if number == _REAL else 2))
    if ports < FEWEST_PORTS or leading > WORTHWHILE * ports:
        leading = ports
    resonances = min(_LOOKED_AT, _POINTS_LOOKED_AT * kept.size * modes**2)
    return DenseBytes(
        structure=structures * (_OF_MODES if _is_diagonal(scene) else _OF_POLES) * number * n**2,
        balance=_balance(ports, leading, kept)
        + _balance(ports, leading, more)
        + _OF_PORTS * _COMPLEX * (_TAIL * beyond + 1) * leading**2
        + _OF_RESONANCES * _COMPLEX * resonances,
    )


def march_bytes(scene: Scene) -> int:
    """Return the memory that time marching takes, of all sectors [bytes]."""
    return _OF_A_MARCH * _REAL * whole_coordinates(scene) ** 2


def whole_coordinates(scene: Scene) -> int:
    """Return the coordinates that all sectors have."""
    return _dofs(scene) * _sectors(scene, every_sector=True)


def _sectors(scene: Scene, every_sector: bool) -> int:
    structure = scene.structure
    if not structure.has_sectors:
        return 1
    return structure.sector_count if every_sector else sectors_needed(scene).sectors


def _dofs(scene: Scene) -> int:
    structure = scene.structure
    own = structure.n_coordinates if isinstance(structure, MatricesStructure) else len(structure.dofs)
    return own + len(scene.points)


def _is_diagonal(scene: Scene) -> bool:
    """Return whether it is sure, without looking at modes, that the damping does not couple them."""
    structure = scene.structure
    if scene.couplings or scene.aerodynamics or structure.loss_factor:
        return False
    if isinstance(structure, MatricesStructure):
        if structure.G is not None or structure.K_omega2 is not None:
            return False
        return structure.C is None and (structure.diameters is None or structure.diameters.C is None)
    ratios = {spring.c / spring.k if spring.k else np.inf for spring in structure.springs if spring.c}
    undamped = not all(spring.c for spring in structure.springs)
    return not structure.dampers and (not ratios or (len(ratios) == 1 and not undamped))


def _balance(ports: int, leading: int, ks: np.ndarray) -> int:
    """Return the bytes of `solver.contacts.kernels.system.Evaluation` and `Receptance`."""
    coefficients = 2 * ks.size - int(ks[0] == 0)
    unknowns, kept = ports * coefficients, leading * coefficients
    at_contacts = 2 * ports * coefficients**2
    if leading < ports:
        # Factors, Pᵀ G P, and G P of one coefficient.
        matrices = (kept + 1) ** 2 + kept**2 + ports * kept
        receptances = _OF_LEADING * leading**2 + _OF_ALL_PORTS * ports**2
        return _REAL * (matrices + at_contacts) + _COMPLEX * ks.size * receptances
    jacobian = unknowns**2 + (unknowns + 1) ** 2
    return _REAL * (jacobian + at_contacts) + _COMPLEX * _OF_CONDENSATION * ks.size * ports**2
