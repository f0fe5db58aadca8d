"""The linear structure of a scene as matrices with its contacts and forces, and their derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Real
from solver.errors import SettingError
from solver.linear.extra_terms import extra_slopes, extra_terms, own_terms, terms_of_line
from solver.linear.model import Coordinates, ForceTerm, Identity, LinearModel, LinearModelDerivative
from solver.linear.moving_base import base_motions, derivative_with_base, with_base
from solver.linear.structure_matrices import (
    Elements,
    Matrices,
    ProportionalDamping,
    mass_of_bodies,
    matrices_of_elements,
    sector_matrices,
    slopes_of_elements,
)
from solver.matrices.values import frozen
from solver.scene.bodies.kinematics import Form, static
from solver.scene.cyclic.annulus import written_out
from solver.scene.parameter_paths import parameter_of
from solver.scene.scene import CyclicStructure, Excitation, LumpedStructure, MatricesStructure, Scene
from solver.wording import listing, nearest


def linear_model(scene: Scene) -> LinearModel:
    """The matrices, contacts and forces of a scene, with the values it has now, and the base that moves.

    Where one sector does not stand for all they are those of the whole annulus. The matrices are cached:
    changing contacts or excitation costs microseconds.
    """
    return _linear_model(Identity(scene))


@lru_cache(maxsize=2)
def _linear_model(of: Identity[Scene]) -> LinearModel:
    scene = written_out(of.it) if of.it.structure.has_sectors else of.it
    model = _without_base(scene)
    return with_base(model, scene, base_motions(scene)) if scene.base_moves else model


def structure_derivative(scene: Scene, path: str) -> LinearModelDerivative:
    """Derivatives of the matrices, constant forces and motions of contacts by a parameter of the scene.

    By the value of a group they are the sum of those by its members, times their factors.

    Raises
    ------
    SettingError
        The scene has no parameter of that path.
    """
    found = _derivative_by(scene, path)
    if not scene.base_moves:
        return found
    return derivative_with_base(found, _without_base(scene), base_motions(scene))


def _without_base(scene: Scene) -> LinearModel:
    """The same with forces alone."""
    structure, here = scene.structure, _coordinates(scene)
    terms: dict[str, Any] = {}
    if not isinstance(structure, MatricesStructure):
        terms = matrices_of_elements(elements_of(structure, here.dofs), scene.bodies)._asdict()
    else:
        sector = sector_matrices(structure, scene.bodies, len(scene.points))
        terms["every_diameter"] = sector.every_diameter
        if structure.has_sectors:
            terms |= _in_matrices(*(_nothing(0),) * 3) | {"sector": sector}
        else:
            terms |= _in_matrices(*sector.at(0))
    if scene.couplings or scene.aerodynamics or structure.loss_factor or here.own:
        terms["extra"] = extra_terms(scene, here)
    if scene.couplings:
        terms["points"] = len(scene.points)
    if scene.speed_order is not None:
        terms |= {"line": terms_of_line(scene, here), "line_order": scene.speed_order}
    motions, beyond = _motions(here, scene.forms)
    return LinearModel(
        **terms, dofs=here.dofs, shapes=here.shapes, contact_here=motions, contact_next=beyond,
        stiffnesses=np.array([k for contact in scene.contacts for k in contact.stiffnesses], np.float64),
        forces=_force_terms(here, scene.forces),
        observe=here.rows(row_of(scene, scene.observe.dof)), engine_order=scene.engine_order,
        sectors=structure.sector_count,
    )  # fmt: skip


def elements_of(structure: LumpedStructure | CyclicStructure, dofs: tuple[str, ...]) -> Elements:
    """Return what a structure consists of, with the DOFs of bodies and points behind its own."""
    return Elements(
        dofs=dofs, masses=tuple([mass.m for mass in structure.masses]),
        springs=tuple([(spring.between, spring.k, spring.c) for spring in structure.springs]),
        dampers=tuple([(damper.between, damper.c) for damper in structure.dampers]),
        beta=structure.stiffness_proportional_damping,
        ratios=structure.damping_ratio if isinstance(structure, LumpedStructure) else None,
    )  # fmt: skip


def _in_matrices(K: Real, C: Real, M: Real) -> dict[str, Real]:
    """Matrices that join no sectors."""
    nothing = _nothing(len(M))
    return Matrices(M, C, nothing, K, nothing)._asdict()


def _motions(coordinates: Coordinates, forms: Sequence[tuple[Form, ...]]) -> tuple[Real, Real]:
    """Motions of all contacts as rows, of this sector and of the next."""
    here, beyond = _contact_selection(coordinates.dofs, tuple(form for each in forms for form in each))
    return coordinates.rows(here), coordinates.rows(beyond)


def row_of(scene: Scene, name: str) -> Real:
    """Return the row over the DOFs (n_dofs,) of a DOF or a recovered quantity of a scene.

    Raises
    ------
    SettingError
        There is none of that name.
    """
    dofs = scene.dofs
    if name in dofs:
        return _unit(dofs, name)
    terms = scene.seen(name)
    if terms is None:
        known = (*dofs, *(each.name for each in scene.recovery))
        raise SettingError("dof", name, f"must be one of {listing(known)}", nearest(str(name), known))
    return _sum_of(dofs, terms)


@lru_cache(maxsize=64)
def _sum_of(dofs: tuple[str, ...], terms: tuple[tuple[str, float], ...]) -> Real:
    found = np.zeros(len(dofs))
    for dof, factor in terms:
        found[dofs.index(dof)] += factor
    return frozen(found)


def _force_terms(coordinates: Coordinates, forces: tuple[Excitation, ...]) -> tuple[ForceTerm, ...]:
    """Forces on DOFs in the coordinates of the matrices."""
    dofs = coordinates.dofs

    def vector(force: Excitation) -> NDArray[Any]:
        along = _pattern(dofs, force.forces or ()) if force.dof is None else _unit(dofs, force.dof)
        return coordinates.rows(along)

    return tuple(
        ForceTerm(vector=vector(e), amplitude=e.amplitude, phase=e.phase, harmonic=e.harmonic)
        for e in forces
        if e.dof or e.forces
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
def _nothing(n: int) -> Real:
    return frozen(np.zeros((n, n)))


@lru_cache(maxsize=64)
def _identity(n: int) -> Real:
    return frozen(np.eye(n))


def _derivative_by(scene: Scene, path: str) -> LinearModelDerivative:
    """Derivatives of what `_without_base` gives."""
    slope, structure, here = parameter_of(scene, path).slope(), scene.structure, _coordinates(scene)
    n = here.shapes.shape[1]
    terms: dict[str, Any] = _in_matrices(*(_nothing(n),) * 3)
    if slope.damping is not None and isinstance(structure, MatricesStructure):
        sector = sector_matrices(structure, scene.bodies, len(scene.points))
        terms["sector"] = ProportionalDamping(sector=sector, which=slope.damping)
    if slope.parts and not isinstance(structure, MatricesStructure):
        found, terms["affine"] = slopes_of_elements(elements_of(structure, here.dofs), slope.parts)
        terms |= found._asdict()
    if slope.masses:
        terms["M"] = mass_of_bodies(n, scene.bodies, slope.masses, len(scene.points))
    if slope.motions is not None:
        moved = [slope.motions.get(c.name, ((),) * len(c.directions)) for c in scene.contacts]
        terms["contact_here"], terms["contact_next"] = _motions(here, moved)
        terms["affine"] = False
    gains = structure.loss_factor if np.any(terms["K0"]) or np.any(terms["Kp"]) else 0.0
    lossy = _without_base(scene) if slope.loss else None
    first, second = extra_slopes(scene, slope, here, gains if lossy is None else 1.0, lossy)
    return LinearModelDerivative(
        **terms, sectors=structure.sector_count, extra=first, second_extra=second,
        forces=_force_terms(here, static(slope.forces)),
        second_forces=_force_terms(here, static(slope.second_forces)),
    )  # fmt: skip


def _coordinates(scene: Scene) -> Coordinates:
    """What the terms of a scene are written in."""
    structure, dofs = scene.structure, scene.dofs
    if not isinstance(structure, MatricesStructure):
        return Coordinates(dofs=dofs, shapes=_identity(len(dofs)), direct=True)
    shapes = sector_matrices(structure, scene.bodies, len(scene.points)).shapes
    return Coordinates(dofs=dofs, shapes=shapes, own=own_terms(structure))


@lru_cache(maxsize=256)
def _contact_selection(dofs: tuple[str, ...], forms: tuple[Form, ...]) -> tuple[Real, Real]:
    here, beyond = np.zeros((len(forms), len(dofs))), np.zeros((len(forms), len(dofs)))
    for row, form in enumerate(forms):
        for dof, ahead, factor in form:
            (beyond if ahead else here)[row, dofs.index(dof)] += factor
    return frozen(here), frozen(beyond)


@lru_cache(maxsize=1024)
def _unit(dofs: Sequence[str], dof: str) -> Real:
    return frozen(np.array([1.0 if name == dof else 0.0 for name in dofs]))


def check_structure(scene: Scene, model: LinearModel, where: str) -> None:
    """Refuse what is no system of ordinary differential equations under forces; `where` that is asked for."""
    structure = scene.structure
    if model.sectors > 1 or structure.has_sectors:
        raise SettingError("structure", structure.kind, f"must be without sectors {where}")
    if model.extra is not None and not model.extra.is_real:
        raise SettingError(
            "loss_factor", structure.loss_factor, f"must be 0 {where}: it has no meaning in time"
        )
    if model.points:
        wanted = f"must make no point without inertia {where}"
        raise SettingError("couplings", scene.points[0], wanted)
    if model.prescribed or model.line is not None:
        what = "excitation" if model.prescribed else "speed_order"
        raise SettingError(what, scene.name, f"must be forces at a fixed speed {where}")
