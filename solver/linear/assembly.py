"""The linear structure of a scene as matrices, and their derivatives: one CasADi expression carries both.

The expression of a scene's structure is symbolic in every mass, stiffness and dashpot, so a named parameter
has its derivative from the same lines that give the value.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.errors import SettingError
from solver.linear.body_matrices import bodies_mass, mass_derivative, matrices_with_bodies
from solver.linear.model import ForceTerm, LinearModel, LinearModelDerivative
from solver.scene.bodies.body import MOMENTS, Body
from solver.scene.bodies.kinematics import Form, dof_names, force_derivatives
from solver.scene.bodies.paths import is_body_path
from solver.scene.bodies.shape_parts import motion_derivatives
from solver.scene.cyclic.annulus import written_out
from solver.scene.parameter_paths import PROPORTIONAL, share, structure_names
from solver.scene.scene import (
    CyclicStructure,
    Damper,
    End,
    Excitation,
    LumpedStructure,
    Mass,
    MatricesStructure,
    Scene,
    Spring,
)
from solver.scene.validation import listing, nearest

FloatArray = NDArray[np.float64]
_Ends = tuple[End, End]
_Assembled = LumpedStructure | CyclicStructure


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
        found = matrices_with_bodies(structure, scene.bodies)
        nothing = _nothing(found.M.shape[0])
        return _model(scene, _Matrices(found.M, found.C, nothing, found.K, nothing), found.shapes)
    topology = _topology(structure, scene.bodies)
    matrices = _matrices(topology, _numbers(structure, scene.bodies), scene.bodies)
    return _model(scene, matrices, _identity(len(topology.dofs)))


def _model(scene: Scene, matrices: _Matrices, shapes: FloatArray) -> LinearModel:
    """Add contacts and forces to the matrices."""
    structure = scene.structure
    dofs = scene.dofs
    here, beyond = _contact_selection(dofs, tuple(form for forms in scene.forms for form in forms))
    whole = isinstance(structure, MatricesStructure)

    def rows(selected: FloatArray) -> FloatArray:
        return _frozen(selected @ shapes) if whole else selected

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
        forces=_terms(scene.forces, dofs, shapes if whole else None),
        observe=rows(_unit(dofs, scene.observe.dof)),
        engine_order=scene.engine_order,
        sectors=structure.sectors if isinstance(structure, CyclicStructure) else 1,
    )


def _terms(
    forces: tuple[Excitation, ...], dofs: tuple[str, ...], shapes: FloatArray | None
) -> tuple[ForceTerm, ...]:
    """Forces on DOFs in the coordinates of the matrices."""

    def vector(dof: str) -> FloatArray:
        return _unit(dofs, dof) if shapes is None else _frozen(_unit(dofs, dof) @ shapes)

    return tuple(
        ForceTerm(vector=vector(e.dof), amplitude=e.amplitude, phase=e.phase, harmonic=e.harmonic)
        for e in forces
    )


@lru_cache(maxsize=16)
def _nothing(n: int) -> FloatArray:
    return _frozen(np.zeros((n, n)))


@lru_cache(maxsize=64)
def _identity(n: int) -> FloatArray:
    return _frozen(np.eye(n))


def structure_derivative(scene: Scene, name: str) -> LinearModelDerivative:
    """Derivatives of the matrices by the structural parameter `name` (without ``structure.``).

    By the value of a group they are the sum of those by its members, times their factors. Of a body, a load
    or the speed the name is the path, and the forces have derivatives too.

    Raises
    ------
    SettingError
        The structure has no parameter of that name.
    """
    structure = scene.structure
    slopes = motion_derivatives(scene, name)
    if slopes is not None:
        return _of_motions(scene, slopes)
    if is_body_path(scene, name):
        return _of_bodies(scene, name)
    if isinstance(structure, MatricesStructure):
        return _proportional(structure, scene.bodies, name)
    parts: tuple[Mass | Spring | Damper, ...] = (*structure.masses, *structure.springs, *structure.dampers)
    shares = [(i, weight) for i, part in enumerate(parts) if name and (weight := share(part, name))]
    if not shares:
        raise _unknown(name, structure_names(structure))
    topology, numbers = _topology(structure, scene.bodies), _numbers(structure, scene.bodies)
    behind = len(topology.dofs) - len(
        structure.dofs
    )  # places of the bodies' DOFs, between masses and springs
    shares = [(i if i < len(structure.masses) else i + behind, weight) for i, weight in shares]
    members = [(_derivative(topology, numbers, i), weight) for i, weight in shares]

    def total(key: str) -> FloatArray:
        return _frozen(
            sum((weight * getattr(d, key) for d, weight in members), np.zeros(members[0][0].dM.shape))
        )

    return LinearModelDerivative(
        dM=total("dM"), dC0=total("dC0"), dCp=total("dCp"), dK0=total("dK0"), dKp=total("dKp"),
        affine=all(d.affine for d, _ in members),
    )  # fmt: skip


def _of_motions(scene: Scene, slopes: Mapping[str, tuple[Form, ...]]) -> LinearModelDerivative:
    """Derivatives where contacts are moved: of their motions alone."""
    dofs, shapes = scene.dofs, _shapes(scene)
    forms = [slopes.get(c.name, ((),) * len(c.directions)) for c in scene.contacts]
    here, beyond = _contact_selection(dofs, tuple(form for each in forms for form in each))
    if shapes is not None:
        here, beyond = _frozen(here @ shapes), _frozen(beyond @ shapes)
    nothing = _nothing(here.shape[1])
    return LinearModelDerivative(
        dM=nothing, dC0=nothing, dCp=nothing, dK0=nothing, dKp=nothing, affine=False,
        contact_here=here, contact_next=beyond,
    )  # fmt: skip


def _shapes(scene: Scene) -> FloatArray | None:
    """The DOFs in the coordinates of the matrices; None where they are the coordinates."""
    if not isinstance(scene.structure, MatricesStructure):
        return None
    return matrices_with_bodies(scene.structure, scene.bodies).shapes


def _of_bodies(scene: Scene, path: str) -> LinearModelDerivative:
    """Derivatives by a number of bodies or loads, or by the speed: of the mass, and of constant forces."""
    dofs, shapes = scene.dofs, _shapes(scene)
    n = len(dofs) if shapes is None else shapes.shape[1]
    owner, _, key = path.rpartition(".")
    behind = sum(len(body.dofs) for body in scene.bodies)
    massive = key == "mass" or key in MOMENTS
    nothing = _nothing(n)
    first, second = force_derivatives(scene, path)
    return LinearModelDerivative(
        dM=mass_derivative(n - behind, scene.bodies, owner, key) if massive else nothing,
        dC0=nothing, dCp=nothing, dK0=nothing, dKp=nothing, affine=True,
        forces=_terms(first, dofs, shapes), second_forces=_terms(second, dofs, shapes),
    )  # fmt: skip


def _proportional(structure: MatricesStructure, bodies: tuple[Body, ...], name: str) -> LinearModelDerivative:
    """Derivatives by the proportional damping, the only parameter of a structure given by its matrices."""
    if name not in PROPORTIONAL:
        raise _unknown(name, PROPORTIONAL)
    found = matrices_with_bodies(structure, bodies)
    nothing = _nothing(found.M.shape[0])
    dC = found.K if name == PROPORTIONAL[0] else found.M
    if bodies:  # which have no such damping
        dC = dC.copy()
        dC[-sum(len(body.dofs) for body in bodies) :] = 0.0
        dC = _frozen(dC)
    return LinearModelDerivative(dM=nothing, dC0=dC, dCp=nothing, dK0=nothing, dKp=nothing, affine=True)


def _unknown(name: str, known: Sequence[str]) -> SettingError:
    return SettingError("name", name, f"must be one of {listing(known)}", nearest(str(name), known))


def _topology(structure: _Assembled, bodies: tuple[Body, ...]) -> _Topology:
    springs = tuple(spring.ends for spring in structure.springs)
    dampers = tuple(damper.ends for damper in structure.dampers)
    return _Topology(dof_names(structure, bodies), springs, dampers)


def _numbers(structure: _Assembled, bodies: tuple[Body, ...]) -> tuple[float, ...]:
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
def _matrices(topology: _Topology, numbers: tuple[float, ...], bodies: tuple[Body, ...]) -> _Matrices:
    n = len(topology.dofs)
    M, *others = _assembled(topology, numbers, np.zeros((n, n)))
    if bodies:
        M += bodies_mass(n - sum(len(body.dofs) for body in bodies), bodies)
    return _Matrices(*map(_frozen, (M, *others)))


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
def _contact_selection(dofs: tuple[str, ...], forms: tuple[Form, ...]) -> tuple[FloatArray, FloatArray]:
    here, beyond = np.zeros((len(forms), len(dofs))), np.zeros((len(forms), len(dofs)))
    for row, form in enumerate(forms):
        for dof, ahead, factor in form:
            (beyond if ahead else here)[row, dofs.index(dof)] += factor
    return _frozen(here), _frozen(beyond)


@lru_cache(maxsize=1024)
def _unit(dofs: Sequence[str], dof: str) -> FloatArray:
    return _frozen(np.array([1.0 if name == dof else 0.0 for name in dofs]))


def _frozen(array: FloatArray) -> FloatArray:
    array.setflags(write=False)
    return array
