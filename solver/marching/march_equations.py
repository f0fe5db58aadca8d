"""The equations of motion of a scene as the time march reads them: sparse rows in the angle tau = omega t.

They share nothing with the harmonic balance: matrices are inverted here, not decomposed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from scipy import linalg
from scipy.sparse import block_diag, csr_array, diags_array, vstack

from solver.errors import SettingError
from solver.marching.contacts import columns, selection, sparse_rows
from solver.marching.kernels import march_state as kernel
from solver.marching.march_base import with_base, with_sum
from solver.scene.bodies.body import REVOLUTIONS, Body
from solver.scene.bodies.kinematics import dof_names, pair_form
from solver.scene.linear_terms import End, dofs_at
from solver.scene.scene import LumpedStructure, MatricesStructure, Scene

FloatArray = NDArray[np.float64]
_INDEPENDENT = 1e-9  # smallest singular value of the modes at the DOFs in use, relative to the largest


Equations = tuple[FloatArray, FloatArray, FloatArray, dict[str, int]]
"""M⁻¹ K [1/s²], M⁻¹ C [1/s] and M⁻¹ [1/kg], (n, n) each, and the coordinate of each DOF in use."""


def _of_structure(structure: MatricesStructure, used: Sequence[str], spin: float) -> Equations:
    """The equations with the DOFs `used` as coordinates, at a speed of rotation `spin` [rad/s].

    Raises
    ------
    SettingError
        The structure is given by too few modes to tell the motions of these DOFs apart.
    """
    rows = dict(zip(structure.dofs, structure.dofs.rows, strict=True))
    if structure.modes is not None:
        return _of_modes(structure, list(dict.fromkeys(used)), rows)
    if structure.M is None or structure.K is None:
        raise SettingError("structure", structure.kind, "must have M and K, or `modes`")
    M, K = structure.M.array, structure.K.array
    symmetric = 0.5 * (K + K.T)
    C = structure.stiffness_proportional_damping * symmetric + structure.mass_proportional_damping * M
    if structure.C is not None:
        C = C + structure.C.array
    if structure.damping_ratio is not None:
        # C = 2 ζ M sqrt(M⁻¹ K): the square root taken in the coordinates where M is 1.
        factor = linalg.cholesky(M, lower=True)
        half = linalg.solve_triangular(factor, symmetric, lower=True)
        C = C + factor @ _modal_damping_root(linalg.solve_triangular(factor, half.T, lower=True),
                                            structure.damping_ratio) @ factor.T  # fmt: skip
    if structure.G is not None:
        C = C + spin * structure.G.array
    if structure.K_omega2 is not None:
        K = K + spin**2 * structure.K_omega2.array
    W = linalg.inv(M)
    return W @ K, W @ C, W, {name: rows[name] for name in used}


def _modal_damping_root(scaled: FloatArray, ratios: float | Sequence[float]) -> FloatArray:
    """Twice the square root of a stiffness where M is 1, each mode with its damping ratio."""
    values, vectors = linalg.eigh(scaled)
    zeta = _ratio_of_each(ratios, values.size)
    return np.asarray((vectors * (2.0 * zeta * np.sqrt(np.maximum(values, 0.0)))) @ vectors.T)


def _ratio_of_each(ratios: float | Sequence[float], count: int) -> FloatArray:
    """The damping ratio of each of `count` modes: the last one given also of those above it."""
    given = np.atleast_1d(np.array(ratios, dtype=np.float64))
    return np.concatenate([given, np.full(max(count - given.size, 0), given[-1])])[:count]


def _of_modes(structure: MatricesStructure, used: list[str], rows: dict[str, int]) -> Equations:
    """Coordinates y = S q: the DOFs in use, and what of the modes q is orthogonal to them."""
    modes = structure.modes
    if modes is None:
        raise SettingError("structure", structure.kind, "must have `modes`")
    seen = modes.modes[[rows[name] for name in used]]
    sizes = linalg.svdvals(seen)
    if seen.shape[0] > seen.shape[1] or sizes[-1] <= _INDEPENDENT * sizes[0]:
        raise SettingError(
            "scene",
            f"{modes.omega2.size} modes at the DOFs {', '.join(used)}",
            "must have modes that tell its DOFs in use apart to be marched in time (or M and K)",
        )
    S = np.vstack([seen, linalg.null_space(seen).T])
    inverse = linalg.inv(S)
    omega = np.sqrt(modes.omega2)
    ratio = modes.damping_ratio
    if ratio is None:
        ratio = _ratio_of_each(structure.damping_ratio or 0.0, omega.size)
    damping = (
        2.0 * ratio * omega
        + structure.stiffness_proportional_damping * modes.omega2
        + structure.mass_proportional_damping
    )
    index = {name: i for i, name in enumerate(used)}
    return (S * modes.omega2) @ inverse, (S * damping) @ inverse, S @ S.T, index


@dataclass(frozen=True, slots=True)
class MarchEquations:
    """The equations of a scene, and what its coordinates are."""

    system: kernel.System
    observed: Annotated[
        int, "Coordinate observed; one behind those of the DOFs where it is a sum of several."
    ]
    index: Annotated[dict[str, int], "Coordinate of each DOF."]
    seen: Annotated[tuple[tuple[int, float], ...], "Coordinates that `observed` adds up, with their factors."]
    modes: Annotated[FloatArray | None, "Motion of the DOFs in each, (n, n), where they are coordinates."] = (
        None
    )


_IN_TIME = "cannot be marched in time: it is a term of the frequency domain; give dashpots or damping ratios"


def _matrices(
    structure: LumpedStructure, bodies: tuple[Body, ...]
) -> tuple[FloatArray, csr_array, csr_array]:
    """Masses [kg] of the points, and damping and stiffness of a lumped structure with bodies."""
    M = np.array([mass.m for mass in structure.masses])
    k = np.array([spring.k for spring in structure.springs])
    c = np.array([spring.c for spring in structure.springs]) + structure.stiffness_proportional_damping * k
    dashpots = np.array([damper.c for damper in structure.dampers])
    index = {dof: i for i, dof in enumerate(dof_names(structure, bodies))}
    springs = selection([pair_form(spring.between) for spring in structure.springs], index, len(index))
    dampers = selection([pair_form(damper.between) for damper in structure.dampers], index, len(index))
    K = springs.T @ diags_array(k) @ springs
    C = springs.T @ diags_array(c) @ springs + dampers.T @ diags_array(dashpots) @ dampers
    if structure.damping_ratio is not None:
        root, own = np.sqrt(M), M.size
        scaled = K.toarray()[:own, :own] / np.outer(root, root)
        modal = np.outer(root, root) * _modal_damping_root(scaled, structure.damping_ratio)
        C = csr_array(C) + csr_array(np.pad(modal, (0, len(index) - own)))
    return M, csr_array(C), csr_array(K)


def _equations(scene: Scene) -> tuple[csr_array, csr_array, csr_array, dict[str, int]]:
    """A = M⁻¹ K, B = M⁻¹ C, W = M⁻¹ and the coordinate of each DOF in use."""
    structure, bodies = scene.structure, scene.bodies
    inertias = [csr_array(np.linalg.inv(body.mass_matrix())) for body in bodies]
    if isinstance(structure, MatricesStructure):
        return _of_matrices(scene, structure, inertias)
    if not isinstance(structure, LumpedStructure):
        raise SettingError("scene", scene.name, "must be written out as its annulus to be marched")
    M, C, K = _matrices(structure, bodies)
    inverse = diags_array(1.0 / M)
    if bodies:
        inverse = block_diag([inverse, *inertias], format="csr")
    index = {dof: i for i, dof in enumerate(dof_names(structure, bodies))}
    return csr_array(inverse @ K), csr_array(inverse @ C), csr_array(inverse), index


def _of_matrices(
    scene: Scene, structure: MatricesStructure, inertias: list[csr_array]
) -> tuple[csr_array, csr_array, csr_array, dict[str, int]]:
    """The same of a structure given by matrices, the bodies behind its coordinates."""
    own = [dof for body in scene.bodies for dof in body.dofs]
    ends = [term.dof for forms in scene.forms for form in forms for term in form]
    pushed = [dof for force in scene.forces for dof, *_ in force.parts]
    moved = [dof for force in scene.forces if force.base is not None for dof, *_ in force.base.shares]
    used = [*ends, *pushed, *moved, *(dof for dof, _ in scene.seen(scene.observe.dof) or ())]
    used += [dof for entry in scene.entries for end in (entry.on, entry.of) for dof in dofs_at(end)]
    spin = (scene.speed or 0.0) * REVOLUTIONS
    beside = {*own, *scene.points}
    *_, index = found = _of_structure(structure, [dof for dof in used if dof not in beside], spin)
    A, B, W = (csr_array(each) for each in found[:3])
    if not own:
        return A, B, W, index
    nothing, n = csr_array((len(own), len(own))), A.shape[0]
    A, B = (csr_array(block_diag([each, nothing])) for each in (A, B))
    W = csr_array(block_diag([W, *inertias]))
    return A, B, W, index | {dof: n + i for i, dof in enumerate(own)}


def _with_couplings(
    scene: Scene, A: csr_array, B: csr_array, W: csr_array, index: dict[str, int]
) -> tuple[csr_array, csr_array, csr_array, dict[str, int]]:
    """The same with the couplings: each is a force on one DOF by the motion of another.

    Raises
    ------
    SettingError
        A term of the frequency domain: structural damping, an imaginary coefficient.
    """
    if scene.structure.loss_factor:
        raise SettingError("loss_factor", scene.structure.loss_factor, _IN_TIME)
    spin, n, points = (scene.speed or 0.0) * REVOLUTIONS, W.shape[0], scene.points
    index = index | {point: n + i for i, point in enumerate(points)}
    nothing = csr_array((len(points),) * 2)
    A, B, W = (csr_array(block_diag([each, nothing])) if points else each for each in (A, B, W))
    K, C = np.zeros((2, len(points), n + len(points)))
    for entry in scene.entries:
        if entry.k.imag != 0.0:
            raise SettingError("k_imaginary", entry.k.imag, _IN_TIME)
        k, c = entry.k.real + spin**2 * entry.k_omega2, entry.c.real + spin * entry.g
        on, at = (_row_at(end, index, W.shape[0]) for end in (entry.on, entry.of))
        if isinstance(entry.on, str) and entry.on in points:
            row = index[entry.on] - n
            K[row], C[row] = K[row] + k * at.toarray()[0], C[row] + c * at.toarray()[0]
            continue
        push = W @ on.T
        A, B = A + k * (push @ at), B + c * (push @ at)
    A, B, W = (csr_array(each) for each in (A, B, W))
    return (*(_with_points(scene, A, B, W, K, C) if points else (A, B, W)), index)


def _row_at(end: End, index: dict[str, int], size: int) -> csr_array:
    """What an entry acts on as a row over the coordinates."""
    if isinstance(end, str):
        factors, columns = np.ones(1), np.array([index[end]])
    else:
        factors = end.factors
        columns = np.arange(factors.size) if end.dofs is None else np.array([index[dof] for dof in end.dofs])
    return csr_array((factors, (np.zeros(columns.size, np.int64), columns)), shape=(1, size))


def _with_points(
    scene: Scene, A: csr_array, B: csr_array, W: csr_array, K: FloatArray, C: FloatArray
) -> tuple[csr_array, csr_array, csr_array]:
    """The same with rows of the points without inertia, for which C x' + K x = 0.

    With x' + R x = 0, R = C_z⁻¹ K, S = C_z⁻¹ C, the second-order rows are (d/dt + r) (S x' + R x) = 0: what
    does not fulfil the equation at the start dies out by its own rate r, the diagonal of R.

    Raises
    ------
    SettingError
        A contact or a force on a point.
    """
    n, points = A.shape[0] - len(K), scene.points
    ends = [
        (one.name, t.dof)
        for one, own in zip(scene.contacts, scene.forms, strict=True)
        for f in own
        for t in f
    ]
    for name, dof in (*ends, *(("excitation", dof) for e in scene.forces for dof, *_ in e.parts)):
        if dof in points:
            raise SettingError(name, dof, "must not be a point without inertia where it is marched in time")
    R, S = (np.linalg.solve(C[:, n:], each) for each in (K, C))
    S[:, n:] = 0.0
    r, own = np.diag(R[:, n:])[:, None], np.eye(len(K), A.shape[0], n)
    more = (r * R - S @ A, R + r * (S + own) - S @ B, -(S @ W))
    return tuple(
        csr_array(vstack([each[:n], csr_array(rows)])) for each, rows in zip((A, B, W), more, strict=True)
    )


def equations_of_motion(scene: Scene, omega: float, *, swept: bool = False) -> MarchEquations:
    """The equations of a scene in the angle tau = omega t; `swept` as of `with_base`."""
    A, B, W, index = _with_couplings(scene, *_equations(scene))
    seen = tuple((index[dof], factor) for dof, factor in scene.seen(scene.observe.dof) or ())
    observed = seen[0][0]
    pushes = [
        (index[dof], force.amplitude * factor, force.phase + phase, force.harmonic)
        for force in scene.forces
        for dof, factor, phase in force.parts
    ]
    moves = any(force.base for force in scene.excitation)
    if scene.observed_unit != "m":
        wanted = "is not followed by the march, whose tolerance is one of displacements: observe DOFs"
        raise SettingError("observe", scene.observe.dof, wanted)
    if scene.observe.dof not in index and not moves:
        A, B, W, observed = with_sum(seen, A, B, W)
    if moves:
        A, B, W, seen, driving = with_base(scene, A, B, W, index, omega, swept=swept)
        observed, pushes = A.shape[0] - 1, pushes + driving
    A, B, W = A / omega**2, B / omega, W / omega**2
    dof, amplitude, phase, harmonic = zip(*pushes, strict=True) if pushes else ((), (), (), ())
    placed = [(row, own) for one, own in zip(scene.contacts, scene.forms, strict=True) for row in one.rows()]
    system = kernel.System(
        A=sparse_rows(A),
        B=sparse_rows(B),
        W=sparse_rows(W),
        force_dof=np.array(dof, dtype=np.int64),
        force_amplitude=np.array(amplitude, dtype=np.float64),
        force_phase=np.array(phase, dtype=np.float64),
        force_harmonic=np.array(harmonic, dtype=np.int64),
        omega=omega,
        **columns(placed, index, A.shape[0]),
    )
    return MarchEquations(system, observed, index, seen)
