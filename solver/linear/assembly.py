"""The linear structure of a scene as matrices with its contacts and forces, and their derivatives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from solver.errors import SettingError
from solver.linear.extra_terms import (
    Coordinates,
    extra_slopes,
    extra_terms,
    own_terms,
    terms_of_line,
)
from solver.linear.lumped_matrices import (
    Matrices,
    derivative_by_numbers,
    matrices_of_numbers,
    numbers_of,
    topology_of,
)
from solver.linear.matrix_model import mass_of_bodies, matrices_with_bodies
from solver.linear.model import ForceTerm, Identity, LinearModel, LinearModelDerivative
from solver.linear.moving_base import base_motions, derivative_with_base, with_base
from solver.linear.sector_matrices import ProportionalDamping, sector_matrices
from solver.matrices.values import frozen
from solver.scene.bodies.body import Body
from solver.scene.bodies.kinematics import Form
from solver.scene.cyclic.annulus import written_out
from solver.scene.matrices_structure import Ratios
from solver.scene.parameter_paths import parameter_of
from solver.scene.scene import (
    CyclicStructure,
    Excitation,
    LumpedStructure,
    MatricesStructure,
    Scene,
    Structure,
)
from solver.wording import listing, nearest

FloatArray = NDArray[np.float64]


def linear_model(scene: Scene) -> LinearModel:
    """The matrices, contacts and forces of a scene, with the values it has now, and the base that moves.

    Where one sector does not stand for all they are those of the whole annulus. The matrices are cached:
    changing contacts or excitation costs microseconds.
    """
    return _linear_model(Identity(scene))


@lru_cache(maxsize=2)
def _linear_model(of: Identity[Scene]) -> LinearModel:
    scene = written_out(of.it)
    model, base = _without_base(scene), base_motions(scene)
    return with_base(model, scene, base) if base else model


def structure_derivative(scene: Scene, path: str) -> LinearModelDerivative:
    """Derivatives of the matrices, constant forces and motions of contacts by a parameter of the scene.

    By the value of a group they are the sum of those by its members, times their factors.

    Raises
    ------
    SettingError
        The scene has no parameter of that path.
    """
    found, base = _derivative_by(scene, path), base_motions(scene)
    return derivative_with_base(found, _without_base(scene), base) if base else found


def _without_base(scene: Scene) -> LinearModel:
    """The same with forces alone."""
    structure = scene.structure
    if isinstance(structure, MatricesStructure) and structure.has_sectors:
        sector = sector_matrices(structure, scene.bodies)
        return replace(_model(scene, Matrices(*(_nothing(0),) * 5), sector.shapes), sector=sector)
    if isinstance(structure, MatricesStructure):
        found = matrices_with_bodies(structure, scene.bodies)
        nothing = _nothing(found.M.shape[0])
        return _model(scene, Matrices(found.M, found.C, nothing, found.K, nothing), found.shapes)
    topology = topology_of(structure, scene.bodies)
    numbers = numbers_of(structure, scene.bodies)
    matrices = matrices_of_numbers(topology, numbers, scene.bodies, _modal_ratios(structure))
    return _model(scene, matrices, _identity(len(topology.dofs)))


def _modal_ratios(structure: LumpedStructure | CyclicStructure) -> Ratios | None:
    return structure.damping_ratio if isinstance(structure, LumpedStructure) else None


def _model(scene: Scene, matrices: Matrices, shapes: FloatArray) -> LinearModel:
    """Add contacts and forces to the matrices."""
    structure = scene.structure
    dofs = scene.dofs
    here, beyond = _contact_selection(dofs, tuple(form for forms in scene.forms for form in forms))
    whole = isinstance(structure, MatricesStructure)
    coordinates = _coordinates(structure, shapes)

    def rows(selected: FloatArray) -> FloatArray:
        return frozen(selected @ shapes) if whole else selected

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
        observe=rows(row_of(scene, scene.observe.dof)),
        engine_order=scene.engine_order,
        sectors=structure.sector_count,
        extra=extra_terms(scene, coordinates),
        line=None if scene.speed_order is None else terms_of_line(scene, coordinates),
        line_order=scene.speed_order or 1.0,
    )


def row_of(scene: Scene, name: str) -> FloatArray:
    """Return the row over the DOFs (n_dofs,) of a DOF or a recovered quantity of a scene.

    Raises
    ------
    SettingError
        There is none of that name.
    """
    terms = scene.seen(name)
    if terms is None:
        known = (*scene.dofs, *(each.name for each in scene.recovery))
        raise SettingError("dof", name, f"must be one of {listing(known)}", nearest(str(name), known))
    if terms == ((name, 1.0),):
        return _unit(scene.dofs, name)
    return _sum_of(scene.dofs, terms)


@lru_cache(maxsize=64)
def _sum_of(dofs: tuple[str, ...], terms: tuple[tuple[str, float], ...]) -> FloatArray:
    found = np.zeros(len(dofs))
    for dof, factor in terms:
        found[dofs.index(dof)] += factor
    return frozen(found)


def _terms(
    forces: tuple[Excitation, ...], dofs: tuple[str, ...], shapes: FloatArray | None
) -> tuple[ForceTerm, ...]:
    """Forces on DOFs in the coordinates of the matrices."""

    def vector(force: Excitation) -> NDArray[Any]:
        found = _pattern(dofs, force.forces or ()) if force.dof is None else _unit(dofs, force.dof)
        return found if shapes is None else frozen(found @ shapes)

    return tuple(
        ForceTerm(vector=vector(e), amplitude=e.amplitude, phase=e.phase, harmonic=e.harmonic)
        for e in forces
        if e.base is None
    )


@lru_cache(maxsize=64)
def _pattern(dofs: tuple[str, ...], parts: tuple[tuple[str, float, float], ...]) -> NDArray[Any]:
    """Factors of the DOFs, complex where they have phases."""
    at = {dof: i for i, dof in enumerate(dofs)}
    found = np.zeros(len(dofs), np.complex128)
    for dof, factor, phase in parts:
        found[at[dof]] += factor * np.exp(1j * phase)
    seen: NDArray[Any] = found if np.any(found.imag) else found.real.copy()
    return frozen(seen)


@lru_cache(maxsize=16)
def _nothing(n: int) -> FloatArray:
    return frozen(np.zeros((n, n)))


@lru_cache(maxsize=64)
def _identity(n: int) -> FloatArray:
    return frozen(np.eye(n))


def _derivative_by(scene: Scene, path: str) -> LinearModelDerivative:
    """Derivatives of what `_without_base` gives."""
    slope, structure, here = parameter_of(scene, path).slope(), scene.structure, _coordinates_of(scene)
    if isinstance(structure, MatricesStructure):
        found = _proportional(structure, scene.bodies, here.shapes.shape[1], slope.damping)
    else:
        found = derivative_by_numbers(
            topology_of(structure, scene.bodies), numbers_of(structure, scene.bodies), slope.parts,
            len(structure.dofs), _modal_ratios(structure),
        )  # fmt: skip
    lossy = structure.loss_factor if np.any(found.dK0) or np.any(found.dKp) else 0.0
    first, second = extra_slopes(scene, slope, here, lossy)
    dofs, shapes = scene.dofs, _shapes(scene)
    return replace(
        found, dM=found.dM if not slope.masses else mass_of_bodies(len(found.dM), scene.bodies, slope.masses),
        extra=first, second_extra=second, by_loss_factor=slope.loss, **_moved_contacts(scene, slope.motions),
        forces=_terms(slope.forces, dofs, shapes), second_forces=_terms(slope.second_forces, dofs, shapes),
    )  # fmt: skip


def _coordinates_of(scene: Scene) -> Coordinates:
    """What the extra terms of a scene are written in."""
    shapes = _shapes(scene)
    return _coordinates(scene.structure, _identity(len(scene.dofs)) if shapes is None else shapes)


def _coordinates(structure: Structure, shapes: FloatArray) -> Coordinates:
    own = own_terms(structure) if isinstance(structure, MatricesStructure) else None
    return Coordinates(shapes=shapes, own=own)


def _moved_contacts(scene: Scene, motions: Mapping[str, tuple[Form, ...]] | None) -> dict[str, Any]:
    """Derivatives where contacts are moved: of their motions."""
    if motions is None:
        return {}
    shapes = _shapes(scene)
    forms = [motions.get(c.name, ((),) * len(c.directions)) for c in scene.contacts]
    here, beyond = _contact_selection(scene.dofs, tuple(form for each in forms for form in each))
    if shapes is not None:
        here, beyond = frozen(here @ shapes), frozen(beyond @ shapes)
    return {"affine": False, "contact_here": here, "contact_next": beyond}


def _shapes(scene: Scene) -> FloatArray | None:
    """The DOFs in the coordinates of the matrices; None where they are the coordinates."""
    if not isinstance(scene.structure, MatricesStructure):
        return None
    if scene.structure.has_sectors:
        return sector_matrices(scene.structure, scene.bodies).shapes
    return matrices_with_bodies(scene.structure, scene.bodies).shapes


def _proportional(
    structure: MatricesStructure, bodies: tuple[Body, ...], n: int, which: Literal["K", "M"] | None
) -> LinearModelDerivative:
    """Derivatives by the proportional damping, the only one of a structure's own given by its matrices."""
    nothing = _nothing(n)
    found = LinearModelDerivative(dM=nothing, dC0=nothing, dCp=nothing, dK0=nothing, dKp=nothing, affine=True)
    if which is None:
        return found
    if structure.has_sectors:
        sector = sector_matrices(structure, bodies)
        return replace(found, damping=ProportionalDamping(sector=sector, which=which))
    dC = getattr(matrices_with_bodies(structure, bodies), which)  # the symmetric part of K
    if bodies:  # which have no such damping
        dC = dC.copy()
        dC[-sum(len(body.dofs) for body in bodies) :] = 0.0
        dC = frozen(dC)
    return replace(found, dC0=dC)


@lru_cache(maxsize=256)
def _contact_selection(dofs: tuple[str, ...], forms: tuple[Form, ...]) -> tuple[FloatArray, FloatArray]:
    here, beyond = np.zeros((len(forms), len(dofs))), np.zeros((len(forms), len(dofs)))
    for row, form in enumerate(forms):
        for dof, ahead, factor in form:
            (beyond if ahead else here)[row, dofs.index(dof)] += factor
    return frozen(here), frozen(beyond)


@lru_cache(maxsize=1024)
def _unit(dofs: Sequence[str], dof: str) -> FloatArray:
    return frozen(np.array([1.0 if name == dof else 0.0 for name in dofs]))
