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


def elements_of(structure: LumpedStructure | CyclicStructure, bodies: tuple[Body, ...]) -> Elements:
    """Return what a structure with bodies consists of."""
    return Elements(
        dofs=dof_names(structure, bodies), masses=tuple(mass.m for mass in structure.masses),
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
        found.M[:] += bodies_mass(own, bodies)
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
