"""What a unit of each parameter path changes: the numbers of the contacts and their loads, the structure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, cast

import numpy as np

from solver.balance.balance import Balance, Kind, Parameter, check_level, resolve
from solver.balance.kernels.residual import contact_values
from solver.contacts.kernels.laws import law_force
from solver.contacts.kernels.system import MODES, Evaluation
from solver.contacts.laws.load_harmonics import is_of_variation, load_slopes
from solver.errors import SettingError
from solver.jit.fourier import Complex, Real
from solver.linear.assembly import structure_derivative
from solver.linear.condensation import reduce_model, term_amplitudes
from solver.linear.model import ExtraTerms, LinearModelDerivative
from solver.scene.bodies.shape_parts import FORCE
from solver.scene.cyclic.annulus import check_in_annulus
from solver.scene.parameter_paths import follows_speed, parameter_of
from solver.scene.scene import MatricesStructure, Scene
from solver.scene.scene_harmonics import even_harmonics_reason

_SAME = 1e-12  # relative: less is rounding


def resolved(balance: Balance, paths: Sequence[str]) -> tuple[Parameter, ...]:
    """Return what paths mean; SettingError for one unknown, or that calls for harmonics left out."""
    scene, found = balance.scene, []
    if scene.speed_order is not None:
        _check_given_loads(scene, paths)
    for path in paths:
        parameter = resolve(scene, path)
        if parameter.kind is Kind.FREQUENCY:
            raise SettingError("paths", path, "must be a value of the scene; the frequency is not")
        if parameter.kind is Kind.LEVEL:
            check_level(scene)
        reason = even_harmonics_reason(scene, (path,)) if balance.system.ks[0] != 0 else None
        if reason is not None:
            raise SettingError("paths", path, f"needs a balance with even harmonics: {reason}")
        found.append(parameter)
    return tuple(found)


def _check_given_loads(scene: Scene, paths: Iterable[str]) -> None:
    """Raise SettingError where a path is of a load that follows the frequency with its contact's N0."""
    for path in paths:
        owner, _, key = path.rpartition(".")
        if is_of_variation(key) and follows_speed(scene, f"{owner}.N0") is not None:
            raise SettingError("paths", path, f"must not be of a load that follows the speed ({owner}.N0)")


def reason_without(scene: Scene, balance: Balance, path: str) -> str:
    """Return why a path has no value or no derivative in the balance of a scene; empty if it has both."""
    try:
        scene.value(path)
        if balance.scene is not scene:
            check_in_annulus(scene, path)
        resolved(balance, [path])
    except SettingError as error:
        return str(error)
    return ""


def contact_slopes(balance: Balance, parameters: Sequence[Parameter]) -> tuple[Real, Real]:
    """Return the derivatives of the contacts' numbers and loads by each parameter.

    Returns
    -------
    (n_paths, n_contacts, ·) of the rows of the contact table, and (n_paths, n_contacts, 1 + 2 K) of the
    coefficients of the loads, see `solver.contacts.laws.load_harmonics`.
    """
    rows = balance.system.contacts
    slopes = np.zeros((len(parameters), *rows.shape))
    loads = np.zeros((len(parameters), rows.shape[0], 2 * balance.system.load_ks.size - 1))
    for slope, load, parameter in zip(slopes, loads, parameters, strict=True):
        acts = parameter.active > 0.0
        if acts.any():
            slope[acts, parameter.column] = parameter.active[acts]
            load[:] = load_slopes(rows, slope, parameter.column)
    return slopes, loads


def force_along(
    balance: Balance, point: Evaluation, e: int, motions: Real, omega: float, slope: Real, dload: Real
) -> tuple[Real, Real, int]:
    """Return a contact's force, its derivative along changes of its numbers and load, and the state code.

    Parameters
    ----------
    point : by value; what is returned are its rows, (ports, n) each.
    motions : (ports, n) of contact `e` [m].
    slope, dload : of one path, as `contact_slopes` gives them.
    """
    system = balance.system
    ports = slice(int(system.first_port[e]), int(system.first_port[e + 1]))
    blocks = slice(int(system.first_block[e]), int(system.first_block[e + 1]))
    table, load, _, _ = contact_values(system, omega, 0.0)
    state, _ = law_force(
        system.laws[e], np.ascontiguousarray(motions, dtype=np.float64), system.ks, load[e], system.load_ks,
        table[e], slope, dload, system.cos_table, system.sin_table, point.segments, point.F[ports],
        point.dF_dU[blocks], point.dF_dp[ports],
    )  # fmt: skip
    return point.F[ports], point.dF_dp[ports], int(state)


def excitation_slopes(balance: Balance, parameters: Sequence[Parameter]) -> tuple[Real, Real]:
    """Return what a unit of each parameter gives all forces, as a share and as a phase, (n_paths,)."""
    kinds = [parameter.kind for parameter in parameters]
    level = balance.scene.level or 1.0 if Kind.LEVEL in kinds else 1.0
    return (
        np.array([1.0 / level if kind is Kind.LEVEL else 0.0 for kind in kinds]),
        np.array([1.0 if kind is Kind.FORCE_PHASE else 0.0 for kind in kinds]),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class HarmonicMatrices:
    """The linear part as matrices, for each kept harmonic, with its derivatives by structural parameters."""

    K: Annotated[Complex, "Stiffness, (nk, n, n); contacts that alone hold a part in place are in it."]
    C: Annotated[Complex, "Damping, (nk, n, n); of the mean none."]
    M: Annotated[Complex, "Mass, (nk, n, n); of the mean none."]
    L: Annotated[Complex, "Relative motions u = L x, (nk, nc, n)."]
    observe: Annotated[Complex, "Selects the observed DOF, (n,)."]
    forces: Annotated[Complex, "Complex force amplitudes [N], (nk, n)."]
    by: Annotated[
        dict[int, tuple[Complex, Complex, Complex]],
        "(dK, dC, dM) of each structural path by its number, (nk, n, n) each.",
    ]
    forces_by: Annotated[
        dict[int, Complex], "Derivatives of the forces, (nk, n), by those paths that change them."
    ] = field(default_factory=dict)
    motions_by: Annotated[dict[int, Complex], "Those of L, (nk, nc, n), likewise."] = field(
        default_factory=dict
    )


def modal_dampings(balance: Balance, parameters: Sequence[Parameter]) -> dict[int, Complex]:
    """Return ∂C/∂q in the modes, (nk, nm), by the number of each path of a proportional damping.

    Empty where the modes do not carry it: a lumped or cyclic structure, damping that couples the modes, or a
    part that contacts alone hold. Of mass-normalised modes M is 1 and K the squared frequency.
    """
    system, structure = balance.system, balance.scene.structure
    if not isinstance(structure, MatricesStructure) or system.form != MODES or system.shift.any():
        return {}
    if balance.scene.bodies or balance.model.extra is not None:  # which have no such damping
        return {}
    of = {
        i: parameter_of(balance.scene, p.path).slope().damping
        for i, p in enumerate(parameters)
        if p.kind is Kind.STRUCTURE
    }
    if None in of.values():
        return {}
    values = {"K": system.eigenvalues, "M": np.ones_like(system.eigenvalues)}
    return {i: values[which][system.which] for i, which in of.items() if which is not None}


def matrices_of_paths(
    balance: Balance, parameters: Sequence[Parameter], *, whole: bool = False
) -> HarmonicMatrices | None:
    """Return the linear part as matrices where a parameter needs them, one of the structure, else None.

    `whole`: also where modes carry it, see `modal_dampings`.
    """
    structural = {i: p.path for i, p in enumerate(parameters) if p.kind is Kind.STRUCTURE}
    if not structural or (modal_dampings(balance, parameters) and not whole):
        return None
    scene, model, ks = balance.scene, balance.model, balance.system.ks
    dense = reduce_model(model, ks, whole_matrices=True)
    diameters, moving, which = model.diameters(ks), ks > 0, dense.which
    moves, turn = moving[:, None, None], model.turns(diameters)[:, None, None]
    L, shift = dense.L[which], balance.system.shift
    by, forces_by, motions_by = {}, {}, {}
    for i, path in structural.items():
        d = structure_derivative(scene, path)
        dK, dC, dM = (each + 0j for each in d.at(diameters, moving))
        if d.contact_here is not None and d.contact_next is not None:
            dL = motions_by[i] = d.contact_here + d.contact_next * turn
            dK = dK + _stiffness(dL, shift, L) + _stiffness(L, shift, dL)
        by[i] = (dK, moves * dC, moves * dM)
        if d.forces:
            forces_by[i] = term_amplitudes(d.forces, dense.observe.size, ks)
    # The stiffness moved from the contacts into the structure is that of the balance.
    K = dense.K[which] + _stiffness(L, shift - dense.shift, L)
    return HarmonicMatrices(
        K=K, C=dense.C[which], M=dense.M[which], L=L, observe=dense.observe,
        forces=dense.forces, by=by, forces_by=forces_by, motions_by=motions_by,
    )  # fmt: skip


def check_smooth_structure(scene: Scene, parameters: Sequence[Parameter]) -> None:
    """Raise SettingError where forces or places of contacts have second derivatives by the paths.

    By the speed and by a radius of rotation the centrifugal load has: they are for gradients. So are two
    paths of whose product the matrices are.
    """
    by = {p.path: structure_derivative(scene, p.path) for p in parameters if p.kind is Kind.STRUCTURE}
    bent = [path for path, d in by.items() if _is_bent(d)]
    tied = _multiplied(scene, {path: d.extra for path, d in by.items() if path not in bent})
    if tied:
        wanted = "must not be multiplied by another path in the matrices: only gradients"
        raise SettingError("paths", tied, wanted)
    pulling = [path for path, d in by.items() if d.forces]
    if bent or len([path for path in pulling if not path.endswith(f".{FORCE}")]) > 1:
        raise SettingError(
            "paths", bent or pulling, "must not change loads or places together: only gradients"
        )


def _multiplied(scene: Scene, slopes: Mapping[str, ExtraTerms | None]) -> list[str]:
    """Return the paths whose slopes beside springs and dashpots change with the others' values.

    As of the relaxation time of a branch with its stiffness, of a gyroscopic term with the speed, of a
    stiffness with the loss factor.
    """
    beside = {path: extra for path, extra in slopes.items() if extra is not None}
    moved = scene
    for path in beside if len(beside) > 1 else ():
        moved = moved.with_values({path: 0.5 * scene.value(path) or 1.0})

    def changes(path: str, here: ExtraTerms) -> bool:
        there = cast(ExtraTerms, structure_derivative(moved, path).extra)
        pairs = ((here.K, there.K), (here.C, there.C), (here.loss_factor, there.loss_factor))
        return any(np.abs(a - b).max() > _SAME * np.abs(a).max() for a, b in pairs)

    return [path for path, here in beside.items() if moved is not scene and changes(path, here)]


def _is_bent(found: LinearModelDerivative) -> bool:
    bends = bool(found.second_forces) or found.second_extra is not None
    return bends or found.contact_here is not None or not found.affine


def _stiffness(left: Complex, k: Real, right: Complex) -> Complex:
    """Return leftᴴ k right of each harmonic, (nk, n, n)."""
    return np.asarray(np.einsum("kci,c,kcj->kij", left.conj(), k, right))
