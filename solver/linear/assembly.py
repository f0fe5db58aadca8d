"""The linear structure of a scene as matrices with its contacts and forces, and their derivatives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.errors import SettingError
from solver.linear.extra_terms import (
    Coordinates,
    ExtraTerms,
    depends_on_speed,
    extra_terms,
    hysteretic,
    own_terms,
    terms_by_gas,
    terms_by_loss,
    terms_by_speed,
    terms_of_line,
)
from solver.linear.lumped_matrices import (
    Matrices,
    derivative_by_number,
    matrices_of_numbers,
    numbers_of,
    topology_of,
)
from solver.linear.matrix_model import mass_derivative, matrices_with_bodies
from solver.linear.model import ForceTerm, Identity, LinearModel, LinearModelDerivative
from solver.linear.moving_base import base_motions, derivative_with_base, with_base
from solver.linear.sector_matrices import ProportionalDamping, sector_matrices
from solver.matrices.values import frozen
from solver.scene.bodies.body import MOMENTS, Body
from solver.scene.bodies.kinematics import Form, force_derivatives
from solver.scene.bodies.paths import is_body_path
from solver.scene.bodies.shape_parts import motion_derivatives
from solver.scene.cyclic.annulus import written_out
from solver.scene.matrices_structure import Ratios
from solver.scene.parameter_paths import PROPORTIONAL, is_gas_path, is_loss, share, structure_names
from solver.scene.scene import (
    CyclicStructure,
    Damper,
    Excitation,
    LumpedStructure,
    Mass,
    MatricesStructure,
    Scene,
    Spring,
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


def structure_derivative(scene: Scene, name: str) -> LinearModelDerivative:
    """Derivatives of the matrices by the structural parameter `name` (without ``structure.``).

    By the value of a group they are the sum of those by its members, times their factors. Of a body, a load
    or the speed the name is the path, and the forces have derivatives too.

    Raises
    ------
    SettingError
        The structure has no parameter of that name.
    """
    found, base = _derivative_by(scene, name), base_motions(scene)
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


def _derivative_by(scene: Scene, name: str) -> LinearModelDerivative:
    """Derivatives of what `_without_base` gives."""
    structure = scene.structure
    slopes = motion_derivatives(scene, name)
    if slopes is not None:
        return _of_motions(scene, slopes)
    if is_body_path(scene, name):
        return _of_bodies(scene, name)
    if is_gas_path(scene, name):
        gas = terms_by_gas(scene, name.rpartition(".")[0], _coordinates_of(scene))
        return replace(_of_nothing(gas.K.shape[1]), extra=gas)
    if is_loss(structure, name):
        here = _coordinates_of(scene)
        nothing = _of_nothing(here.shapes.shape[1])
        return replace(nothing, by_loss_factor=True, extra=terms_by_loss(here))
    if isinstance(structure, MatricesStructure):
        return _proportional(structure, scene.bodies, name)
    parts: tuple[Mass | Spring | Damper, ...] = (*structure.masses, *structure.springs, *structure.dampers)
    shares = [(i, weight) for i, part in enumerate(parts) if name and (weight := share(part, name))]
    if not shares:
        raise _unknown(name, structure_names(structure))
    topology, numbers = topology_of(structure, scene.bodies), numbers_of(structure, scene.bodies)
    behind = len(topology.dofs) - len(
        structure.dofs
    )  # places of the bodies' DOFs, between masses and springs
    shares = [(i if i < len(structure.masses) else i + behind, weight) for i, weight in shares]
    own, ratios = len(structure.dofs), _modal_ratios(structure)
    members = [(derivative_by_number(topology, numbers, i, own, ratios), weight) for i, weight in shares]

    def total(key: str) -> FloatArray:
        return frozen(
            sum((weight * getattr(d, key) for d, weight in members), np.zeros(members[0][0].dM.shape))
        )

    dK0, dKp = total("dK0"), total("dKp")
    lossy = structure.loss_factor and (np.any(dK0) or np.any(dKp))
    return LinearModelDerivative(
        dM=total("dM"), dC0=total("dC0"), dCp=total("dCp"), dK0=dK0, dKp=dKp,
        affine=all(d.affine for d, _ in members),
        extra=hysteretic(len(dK0), structure.loss_factor) if lossy else None,
    )  # fmt: skip


def _coordinates_of(scene: Scene) -> Coordinates:
    """What the extra terms of a scene are written in."""
    shapes = _shapes(scene)
    return _coordinates(scene.structure, _identity(len(scene.dofs)) if shapes is None else shapes)


def _coordinates(structure: Structure, shapes: FloatArray) -> Coordinates:
    own = own_terms(structure) if isinstance(structure, MatricesStructure) else None
    return Coordinates(shapes=shapes, own=own)


def _of_nothing(n: int) -> LinearModelDerivative:
    """Derivatives of 0, of n coordinates."""
    nothing = _nothing(n)
    return LinearModelDerivative(dM=nothing, dC0=nothing, dCp=nothing, dK0=nothing, dKp=nothing, affine=True)


def _of_motions(scene: Scene, slopes: Mapping[str, tuple[Form, ...]]) -> LinearModelDerivative:
    """Derivatives where contacts are moved: of their motions alone."""
    dofs, shapes = scene.dofs, _shapes(scene)
    forms = [slopes.get(c.name, ((),) * len(c.directions)) for c in scene.contacts]
    here, beyond = _contact_selection(dofs, tuple(form for each in forms for form in each))
    if shapes is not None:
        here, beyond = frozen(here @ shapes), frozen(beyond @ shapes)
    return replace(_of_nothing(here.shape[1]), affine=False, contact_here=here, contact_next=beyond)


def _shapes(scene: Scene) -> FloatArray | None:
    """The DOFs in the coordinates of the matrices; None where they are the coordinates."""
    if not isinstance(scene.structure, MatricesStructure):
        return None
    if scene.structure.has_sectors:
        return sector_matrices(scene.structure, scene.bodies).shapes
    return matrices_with_bodies(scene.structure, scene.bodies).shapes


def _of_bodies(scene: Scene, path: str) -> LinearModelDerivative:
    """Derivatives by a number of bodies or loads, or by the speed: of the mass, and of constant forces."""
    dofs, shapes = scene.dofs, _shapes(scene)
    n = len(dofs) if shapes is None else shapes.shape[1]
    owner, _, key = path.rpartition(".")
    behind = sum(len(body.dofs) for body in scene.bodies)
    massive = key == "mass" or key in MOMENTS
    first, second = force_derivatives(scene, path)
    extra: tuple[ExtraTerms | None, ExtraTerms | None] = (None, None)
    if not owner and depends_on_speed(scene):
        extra = terms_by_speed(scene, _coordinates_of(scene))
    return replace(
        _of_nothing(n),
        dM=mass_derivative(n - behind, scene.bodies, owner, key) if massive else _nothing(n),
        forces=_terms(first, dofs, shapes), second_forces=_terms(second, dofs, shapes),
        extra=extra[0], second_extra=extra[1] if extra[1] is not None and np.any(extra[1].K) else None,
    )  # fmt: skip


def _proportional(structure: MatricesStructure, bodies: tuple[Body, ...], name: str) -> LinearModelDerivative:
    """Derivatives by the proportional damping, the only parameter of a structure given by its matrices."""
    if name not in PROPORTIONAL:
        raise _unknown(name, PROPORTIONAL)
    if structure.has_sectors:
        sector = sector_matrices(structure, bodies)
        damping = ProportionalDamping(sector=sector, which="K" if name == PROPORTIONAL[0] else "M")
        return replace(_of_nothing(sector.shapes.shape[1]), damping=damping)
    found = matrices_with_bodies(structure, bodies)
    dC = found.K if name == PROPORTIONAL[0] else found.M  # the symmetric part of K
    if bodies:  # which have no such damping
        dC = dC.copy()
        dC[-sum(len(body.dofs) for body in bodies) :] = 0.0
        dC = frozen(dC)
    return replace(_of_nothing(len(dC)), dC0=dC)


def _unknown(name: str, known: Sequence[str]) -> SettingError:
    return SettingError("name", name, f"must be one of {listing(known)}", nearest(str(name), known))


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
