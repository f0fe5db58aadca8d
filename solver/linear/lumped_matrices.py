"""The matrices of masses, springs and dashpots, and their derivatives: one CasADi expression carries both.

The expression of a scene's structure is symbolic in every mass, stiffness and dashpot, so a named parameter
has its derivative from the same lines that give the value.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.linear.matrix_model import bodies_mass, modal_damping, modal_damping_derivative
from solver.linear.model import LinearModelDerivative
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


class _Expression(NamedTuple):
    """The matrices side by side, M | C0 | Cp | K0 | Kp, as an expression in all parameters."""

    parameters: Any
    stacked: Any


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


@lru_cache(maxsize=64)
def _expression(topology: Topology) -> _Expression:
    """The matrices in symbols, in the order of `_numbers`, for their derivatives."""
    import casadi  # the values of the matrices need no symbols

    n = len(topology.dofs)
    q = casadi.SX.sym("q", n + 2 * len(topology.springs) + len(topology.dampers) + 1)
    return _Expression(q, casadi.horzcat(*_assembled(topology, q, casadi.SX(n, n))))


def _assembled(topology: Topology, q: Any, zero: Any) -> tuple[Any, ...]:
    """Return M, C0, Cp, K0, Kp in floats or in symbols, as the parameters `q` and the (n, n) `zero` are."""
    n, n_springs, n_dampers = len(topology.dofs), len(topology.springs), len(topology.dampers)
    M, C0, Cp, K0, Kp = (zero + 0.0 for _ in range(5))
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
    return M, C0, Cp, K0, Kp


def _join(X0: Any, Xp: Any, ends: _Ends, value: Any, index: dict[str, int]) -> None:
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
    found = Matrices(*_assembled(topology, numbers, np.zeros((n, n))))
    if ratios is not None:
        found.C0[:own, :own] += modal_damping(found.M[:own, :own], found.K0[:own, :own], ratios)
    if bodies:
        found.M[:] += bodies_mass(own, bodies)
    return Matrices(*map(frozen, found))


@lru_cache(maxsize=256)
def derivative_by_number(
    topology: Topology, numbers: tuple[float, ...], i: int, own: int, ratios: Ratios | None
) -> LinearModelDerivative:
    """Return their derivative by number i; the first `own` DOFs are the structure's."""
    import casadi

    expression = _expression(topology)
    derivative, affine = _derivative_function(topology, i)
    stacked = casadi.reshape(derivative(np.asarray(numbers)), *expression.stacked.shape)
    dense = np.asarray(casadi.DM(stacked).full(), dtype=np.float64)
    n = dense.shape[0]
    d = Matrices(*(dense[:, i * n : (i + 1) * n].copy() for i in range(5)))
    if ratios is not None:
        at = matrices_of_numbers(topology, numbers, (), None)
        d.C0[:own, :own] += modal_damping_derivative(
            at.M[:own, :own], at.K0[:own, :own], ratios, d.M[:own, :own], d.K0[:own, :own]
        )
        affine = affine and not (np.any(d.M) or np.any(d.K0))
    d = Matrices(*map(frozen, d))
    return LinearModelDerivative(dM=d.M, dC0=d.C0, dCp=d.Cp, dK0=d.K0, dKp=d.Kp, affine=affine)


@lru_cache(maxsize=256)
def _derivative_function(topology: Topology, i: int) -> tuple[Any, bool]:
    """Derivative of the stacked matrices by parameter i as a function of all, and whether it is constant."""
    import casadi

    q, stacked = _expression(topology)
    vector = casadi.vec(stacked)
    jacobian = casadi.jacobian(vector, q[i])
    return casadi.Function("derivative", [q], [jacobian]), bool(casadi.is_linear(vector, q[i]))
