"""The matrices of masses, springs and dashpots, and their derivatives from the same lines."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.linear.matrix_model import bodies_mass, modal_damping, modal_damping_derivative
from solver.matrices.values import frozen
from solver.scene.bodies.body import Body
from solver.scene.bodies.kinematics import dof_names
from solver.scene.matrices_structure import Ratios
from solver.scene.scene import CyclicStructure, End, LumpedStructure

FloatArray = NDArray[np.float64]
_Ends = tuple[End, End]
Assembled = LumpedStructure | CyclicStructure


class Topology(NamedTuple):
    """What joins what: everything of a structure but its numbers."""

    dofs: tuple[str, ...]
    springs: tuple[_Ends, ...]
    dampers: tuple[_Ends, ...]


class Matrices(NamedTuple):
    """Mass, damping and stiffness of a sector; p: to the next one."""

    M: FloatArray
    C0: FloatArray
    Cp: FloatArray
    K0: FloatArray
    Kp: FloatArray


def topology_of(structure: Assembled, bodies: tuple[Body, ...]) -> Topology:
    """Return what joins what in a structure with bodies."""
    springs = tuple(spring.ends for spring in structure.springs)
    dampers = tuple(damper.ends for damper in structure.dampers)
    return Topology(dof_names(structure, bodies), springs, dampers)


def numbers_of(structure: Assembled, bodies: tuple[Body, ...]) -> tuple[float, ...]:
    """All numbers: masses, stiffnesses, dashpots, dashpots of springs, proportional damping.

    The mass of a body is no point mass and stands apart: 0 here.
    """
    return (
        *(mass.m for mass in structure.masses),
        *(0.0 for body in bodies for _ in body.dofs),
        *(spring.k for spring in structure.springs),
        *(damper.c for damper in structure.dampers),
        *(spring.c for spring in structure.springs),
        structure.stiffness_proportional_damping,
    )


def _assembled(topology: Topology, q: tuple[float, ...]) -> Matrices:
    """Return the matrices of the numbers `q`, in the order of `numbers_of`."""
    n, n_springs, n_dampers = len(topology.dofs), len(topology.springs), len(topology.dampers)
    M, C0, Cp, K0, Kp = (np.zeros((n, n)) for _ in range(5))
    k, c, c_spring = n, n + n_springs, n + n_springs + n_dampers
    beta = q[c_spring + n_springs]
    index = {dof: i for i, dof in enumerate(topology.dofs)}
    for i in range(n):
        M[i, i] = q[i]
    for i, ends in enumerate(topology.springs):
        _join(K0, Kp, ends, q[k + i], index)
        _join(C0, Cp, ends, q[c_spring + i] + beta * q[k + i], index)
    for i, ends in enumerate(topology.dampers):
        _join(C0, Cp, ends, q[c + i], index)
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
def matrices_of_numbers(
    topology: Topology, numbers: tuple[float, ...], bodies: tuple[Body, ...], ratios: Ratios | None
) -> Matrices:
    """Return the matrices of a topology with these numbers, bodies and modal damping; read-only."""
    n = len(topology.dofs)
    own = n - sum(len(body.dofs) for body in bodies)
    found = _assembled(topology, numbers)
    if ratios is not None:
        found.C0[:own, :own] += modal_damping(found.M[:own, :own], found.K0[:own, :own], ratios)
    if bodies:
        found.M[:] += bodies_mass(own, bodies)
    return Matrices(*map(frozen, found))


@lru_cache(maxsize=256)
def slopes_by_numbers(
    topology: Topology, numbers: tuple[float, ...], parts: tuple[tuple[int, float], ...], own: int,
    ratios: Ratios | None,
) -> tuple[Matrices, bool]:  # fmt: skip
    """Return their slopes where masses, springs and dashpots, counted in this order, gain so much.

    The first `own` DOFs are the structure's. All but modal damping is linear in these numbers, so the slopes
    are constant: that is told too.
    """
    behind = len(topology.dofs) - own  # places of the bodies' DOFs, between masses and springs
    gained = [0.0] * (len(numbers) - 1) + [numbers[-1]]
    for i, weight in parts:
        gained[i if i < own else i + behind] += weight
    found = _assembled(topology, tuple(gained))
    affine = ratios is None or not (np.any(found.M) or np.any(found.K0))
    if ratios is not None:
        at, inner = matrices_of_numbers(topology, numbers, (), None), np.s_[:own, :own]
        found.C0[inner] += modal_damping_derivative(
            at.M[inner], at.K0[inner], ratios, found.M[inner], found.K0[inner]
        )
    return Matrices(*map(frozen, found)), affine
