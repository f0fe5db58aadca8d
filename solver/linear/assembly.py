"""The linear structure of a scene as matrices, and their derivatives: one CasADi expression carries both.

The expression of a scene's structure is symbolic in every mass, stiffness and dashpot, so a named parameter
has its derivative from the same lines that give the value.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.errors import SettingError
from solver.linear.matrix_model import matrix_model
from solver.scene.annulus import written_out
from solver.scene.parameter_paths import PROPORTIONAL, share, structure_names
from solver.scene.scene import (
    CyclicStructure,
    Damper,
    End,
    LumpedStructure,
    Mass,
    MatricesStructure,
    Scene,
    Spring,
    parse_end,
)
from solver.scene.validation import listing, nearest

FloatArray = NDArray[np.float64]
_Ends = tuple[End, End]
_Assembled = LumpedStructure | CyclicStructure


@dataclass(frozen=True, slots=True, kw_only=True)
class ForceTerm:
    """One force amplitude * cos(harmonic * omega t + phase) along `vector`.

    Attributes
    ----------
    vector : (n,) array
        Selects the DOF.
    amplitude : float
        Force [N].
    phase : float
        Phase [rad].
    harmonic : int
        Multiple of the excitation frequency; 0 is a static load.
    """

    vector: FloatArray
    amplitude: float
    phase: float
    harmonic: int


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearModel:
    """The structure without its contacts: one sector of a tuned disk, or the whole structure.

    A matrix at interblade phase theta is X(theta) = X0 + Xp e^{j theta} + Xp^T e^{-j theta}; the neighbour
    x of the next sector is X e^{j k i phi} for harmonic k, engine order i and phi = 2 pi / sectors. All
    arrays are read-only.

    Attributes
    ----------
    dofs : tuple of str
        Names of the DOFs.
    shapes : (n_dofs, n) array
        The DOFs in the coordinates of the matrices: the identity, or what a structure given by matrices or
        modes names.
    M : (n, n) array
        Mass [kg].
    C0, Cp : (n, n) array
        Damping [N s/m]; `Cp` couples to the next sector, 0 if lumped.
    K0, Kp : (n, n) array
        Stiffness [N/m]; `Kp` couples to the next sector, 0 if lumped.
    contact_here, contact_next : (n_ports, n) array
        L(theta) = contact_here + contact_next e^{j theta}; relative motions u = L x, x the coordinates.
    forces : tuple of ForceTerm
        The excitation.
    observe : (n,) array
        Selects the observed DOF.
    engine_order : int
        Engine order of the excitation, 0 if lumped.
    sectors : int
        Number of sectors, 1 if lumped.
    """

    dofs: tuple[str, ...]
    shapes: FloatArray
    M: FloatArray
    C0: FloatArray
    Cp: FloatArray
    K0: FloatArray
    Kp: FloatArray
    contact_here: FloatArray
    contact_next: FloatArray
    forces: tuple[ForceTerm, ...]
    observe: FloatArray
    engine_order: int
    sectors: int

    @property
    def interblade_phase(self) -> float:
        """Phase of harmonic 1 from one sector to the next [rad]."""
        return 2.0 * math.pi * self.engine_order / self.sectors


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearModelDerivative:
    """Derivatives of a `LinearModel` by one structural parameter, in units per unit of the parameter.

    Attributes
    ----------
    dM, dC0, dCp, dK0, dKp : (n, n) array
        Derivatives of the matrices; read-only.
    affine : bool
        The matrices are affine in this parameter, so these derivatives are constant.
    """

    dM: FloatArray
    dC0: FloatArray
    dCp: FloatArray
    dK0: FloatArray
    dKp: FloatArray
    affine: bool


class _Topology(NamedTuple):
    """What joins what: everything of a structure but its numbers."""

    dofs: tuple[str, ...]
    springs: tuple[_Ends, ...]
    dampers: tuple[_Ends, ...]


class _Matrices(NamedTuple):
    M: FloatArray
    C0: FloatArray
    Cp: FloatArray
    K0: FloatArray
    Kp: FloatArray


class _Expression(NamedTuple):
    """The matrices side by side, M | C0 | Cp | K0 | Kp, as an expression in all parameters."""

    parameters: Any
    stacked: Any


def linear_model(scene: Scene) -> LinearModel:
    """The matrices, contacts and forces of a scene, with the values it has now.

    Where one sector does not stand for all they are those of the whole annulus. The matrices are cached:
    changing contacts or excitation costs microseconds.
    """
    scene = written_out(scene)
    structure = scene.structure
    if isinstance(structure, MatricesStructure):
        found = matrix_model(structure)
        nothing = _nothing(found.M.shape[0])
        return _model(scene, _Matrices(found.M, found.C, nothing, found.K, nothing), found.shapes)
    matrices = _matrices(_topology(structure), _numbers(structure))
    return _model(scene, matrices, _identity(len(structure.dofs)))


def _model(scene: Scene, matrices: _Matrices, shapes: FloatArray) -> LinearModel:
    """Add contacts and forces to the matrices."""
    structure = scene.structure
    dofs = tuple(structure.dofs)
    here, beyond = _contact_selection(dofs, tuple(pair for c in scene.contacts for pair in c.pairs))
    whole = isinstance(structure, MatricesStructure)

    def rows(selected: FloatArray) -> FloatArray:
        return _frozen(selected @ shapes) if whole else selected

    forces = tuple(
        ForceTerm(vector=rows(_unit(dofs, e.dof)), amplitude=e.amplitude, phase=e.phase, harmonic=e.harmonic)
        for e in scene.excitation
    )
    return LinearModel(
        dofs=dofs,
        shapes=shapes,
        M=matrices.M,
        C0=matrices.C0,
        Cp=matrices.Cp,
        K0=matrices.K0,
        Kp=matrices.Kp,
        contact_here=rows(here),
        contact_next=rows(beyond),
        forces=forces,
        observe=rows(_unit(dofs, scene.observe.dof)),
        engine_order=scene.engine_order,
        sectors=structure.sectors if isinstance(structure, CyclicStructure) else 1,
    )


@lru_cache(maxsize=16)
def _nothing(n: int) -> FloatArray:
    return _frozen(np.zeros((n, n)))


@lru_cache(maxsize=64)
def _identity(n: int) -> FloatArray:
    return _frozen(np.eye(n))


def structure_derivative(scene: Scene, name: str) -> LinearModelDerivative:
    """Derivatives of the matrices by the structural parameter `name` (without ``structure.``).

    By the value of a group they are the sum of those by its members, times their factors.

    Raises
    ------
    SettingError
        The structure has no parameter of that name.
    """
    structure = scene.structure
    if isinstance(structure, MatricesStructure):
        return _proportional(structure, name)
    parts: tuple[Mass | Spring | Damper, ...] = (*structure.masses, *structure.springs, *structure.dampers)
    shares = [(i, weight) for i, part in enumerate(parts) if name and (weight := share(part, name))]
    if not shares:
        raise _unknown(name, structure_names(structure))
    topology, numbers = _topology(structure), _numbers(structure)
    members = [(_derivative(topology, numbers, i), weight) for i, weight in shares]
    matrices = {
        key: _frozen(
            sum((weight * getattr(d, key) for d, weight in members), np.zeros(members[0][0].dM.shape))
        )
        for key in ("dM", "dC0", "dCp", "dK0", "dKp")
    }
    return LinearModelDerivative(**matrices, affine=all(d.affine for d, _ in members))


def _proportional(structure: MatricesStructure, name: str) -> LinearModelDerivative:
    """Derivatives by the proportional damping, the only parameter of a structure given by its matrices."""
    if name not in PROPORTIONAL:
        raise _unknown(name, PROPORTIONAL)
    found = matrix_model(structure)
    nothing = _nothing(found.M.shape[0])
    dC = found.K if name == PROPORTIONAL[0] else found.M
    return LinearModelDerivative(dM=nothing, dC0=dC, dCp=nothing, dK0=nothing, dKp=nothing, affine=True)


def _unknown(name: str, known: Sequence[str]) -> SettingError:
    return SettingError("name", name, f"must be one of {listing(known)}", nearest(str(name), known))


def _topology(structure: _Assembled) -> _Topology:
    springs = tuple(spring.ends for spring in structure.springs)
    return _Topology(structure.dofs, springs, tuple(damper.ends for damper in structure.dampers))


def _numbers(structure: _Assembled) -> tuple[float, ...]:
    """All numbers: masses, stiffnesses, dashpots, dashpots of springs, proportional damping."""
    return (
        *(mass.m for mass in structure.masses),
        *(spring.k for spring in structure.springs),
        *(damper.c for damper in structure.dampers),
        *(spring.c for spring in structure.springs),
        structure.stiffness_proportional_damping,
    )


@lru_cache(maxsize=64)
def _expression(topology: _Topology) -> _Expression:
    """The matrices in symbols, in the order of `_numbers`, for their derivatives."""
    import casadi  # the values of the matrices need no symbols

    n = len(topology.dofs)
    q = casadi.SX.sym("q", n + 2 * len(topology.springs) + len(topology.dampers) + 1)
    return _Expression(q, casadi.horzcat(*_assembled(topology, q, casadi.SX(n, n))))


def _assembled(topology: _Topology, q: Any, zero: Any) -> tuple[Any, ...]:
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
def _matrices(topology: _Topology, numbers: tuple[float, ...]) -> _Matrices:
    n = len(topology.dofs)
    return _Matrices(*map(_frozen, _assembled(topology, numbers, np.zeros((n, n)))))


@lru_cache(maxsize=256)
def _derivative(topology: _Topology, numbers: tuple[float, ...], i: int) -> LinearModelDerivative:
    import casadi

    expression = _expression(topology)
    derivative, affine = _derivative_function(topology, i)
    stacked = casadi.reshape(derivative(np.asarray(numbers)), *expression.stacked.shape)
    dense = np.asarray(casadi.DM(stacked).full(), dtype=np.float64)
    n = dense.shape[0]
    d = _Matrices(*(_frozen(dense[:, i * n : (i + 1) * n].copy()) for i in range(5)))
    return LinearModelDerivative(dM=d.M, dC0=d.C0, dCp=d.Cp, dK0=d.K0, dKp=d.Kp, affine=affine)


@lru_cache(maxsize=256)
def _derivative_function(topology: _Topology, i: int) -> tuple[Any, bool]:
    """Derivative of the stacked matrices by parameter i as a function of all, and whether it is constant."""
    import casadi

    q, stacked = _expression(topology)
    vector = casadi.vec(stacked)
    jacobian = casadi.jacobian(vector, q[i])
    return casadi.Function("derivative", [q], [jacobian]), bool(casadi.is_linear(vector, q[i]))


@lru_cache(maxsize=256)
def _contact_selection(
    dofs: tuple[str, ...], betweens: tuple[tuple[str, str], ...]
) -> tuple[FloatArray, FloatArray]:
    here, beyond = np.zeros((len(betweens), len(dofs))), np.zeros((len(betweens), len(dofs)))
    for row, between in enumerate(betweens):
        for end, sign in zip(map(parse_end, between), (1.0, -1.0), strict=True):
            if end.dof is not None:
                (beyond if end.next else here)[row, dofs.index(end.dof)] += sign
    return _frozen(here), _frozen(beyond)


@lru_cache(maxsize=1024)
def _unit(dofs: Sequence[str], dof: str) -> FloatArray:
    return _frozen(np.array([1.0 if name == dof else 0.0 for name in dofs]))


def _frozen(array: FloatArray) -> FloatArray:
    array.setflags(write=False)
    return array
