"""Mode shapes and operating deflection shapes, with what is drawn of them (`solver.views.picture`).

The motion of point p in sector j of a disk at the angle τ = ωt is u(τ) = R_j Re Σ_k U_kp e^{ik(τ + jθ)}: R_j
turns it with its sector, θ is the phase of harmonic 1 from one sector to the next. Where all sectors were
solved each has motions of its own, and θ = 0.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, cast

import numpy as np

from solver.arrays import Complex, Integer, Real
from solver.errors import SettingError
from solver.linear.assembly import linear_model
from solver.linear.model import LinearModel
from solver.matrices.sectors.elimination import phase_factor
from solver.matrices.sectors.outline import SectorOutline
from solver.matrices.values import Matrix
from solver.modes.nonlinear_mode import at_nodal_diameter, diameter_of, pose
from solver.response.solution import Solution
from solver.response.time_history import all_coordinates
from solver.scene.cyclic.annulus import written_out
from solver.scene.cyclic.sector_blocks import full_elimination
from solver.scene.scene import MatricesStructure, Scene
from solver.views.picture import Picture, mesh_moves, picture_of

FAINT = 1e-3
"""Harmonics that move every point less than this share of the largest motion are left out."""
_INSTANTS = 96


@dataclass(frozen=True, slots=True, kw_only=True)
class Shape:
    """How a scene moves over one period."""

    picture: Annotated[Picture, "Points at rest, and what is drawn between them."]
    unit: Annotated[str, "Of the motions: m, or 1/√kg of a mode that is linear."]
    frequency_hz: Annotated[float, "Its frequency [Hz]."]
    nodal_diameter: Annotated[
        int | None, "Of harmonic 1, negative for a wave that travels backward; None where it is no wave."
    ]
    turn: Annotated[float, "Phase of harmonic 1 from a sector to the next [rad]."]
    harmonics: Annotated[Integer, "The mean, if it is there, and those that move something, (nk,)."]
    motions: Annotated[
        Complex, "Complex amplitudes, (ns, nk, n_points, 3); of one sector, or of each where all were solved."
    ]
    amplitude: Annotated[Real, "Largest motion of each point about its mean over the period, (ns, n_points)."]
    states: Annotated[dict[str, str], "What every contact does, where it is known."]


def deflection_shape(scene: Scene, solution: Solution) -> Shape:
    """Return the operating deflection shape of a converged response of a scene.

    Raises
    ------
    SettingError
        The solution did not converge.
    """
    coordinates, states = all_coordinates(solution).T, {c.name: c.state.value for c in solution.contacts}
    return _shape(scene, solution.scene, coordinates, solution.frequency_hz, "m", states)


def mode_shape(scene: Scene, mode: int, *, nodal_diameter: int | None = None, harmonics: int = 11) -> Shape:
    """Return the shape of a linear mode, mass-normalised, with the contacts as they are at rest.

    Parameters
    ----------
    scene : what vibrates; its loads count, its excitation gives the phase alone.
    mode, nodal_diameter, harmonics : as of `solver.modes.nonlinear_mode.nonlinear_mode`.

    Raises
    ------
    SettingError
        A mode, nodal diameter or harmonics that cannot be.
    """
    scene = at_nodal_diameter(scene, nodal_diameter)
    problem = pose(scene, mode, None, harmonics)
    solved = problem.equations.balance.scene
    moved, hertz = _first(problem.mode.shape), problem.mode.omega / (2.0 * math.pi)
    return _shape(scene, solved, moved, hertz, "1/√kg", {})


def shape_of_motion(
    scene: Scene, dofs: Sequence[str], motion: Complex, frequency_hz: float, states: dict[str, str],
    nodal_diameter: int | None = None,
) -> Shape:  # fmt: skip
    """Return the shape of harmonic 1 of a nonlinear mode over its amplitude, as its results tell it.

    Parameters
    ----------
    dofs : names, of one sector or of all.
    motion : (n,) harmonic 1 of each [1/√kg], see `solver.modes.mode_results.NonlinearMode.shape`.
    frequency_hz, states : what it has there.
    nodal_diameter : of a disk of which one sector was solved; that of the engine order if left out.

    Raises
    ------
    SettingError
        A DOF that is missing, or a nodal diameter that cannot be.
    """
    scene = at_nodal_diameter(scene, nodal_diameter)
    solved = scene if scene.dofs[0] in dofs else written_out(scene)
    missing = next((dof for dof in solved.dofs if dof not in dofs), None)
    if missing is not None:
        raise SettingError("dofs", missing, "is missing: the motion of every DOF must be told, it lacks")
    told = np.array([motion[dofs.index(dof)] for dof in solved.dofs])
    coordinates = _following(linear_model(solved), told, 2.0 * math.pi * frequency_hz)
    return _shape(scene, solved, _first(coordinates), frequency_hz, "1/√kg", states)


def _first(motion: Complex) -> Complex:
    """Harmonics 0 and 1 of which the second alone moves anything."""
    return np.stack([np.zeros_like(motion), motion], axis=1)


def _following(model: LinearModel, told: Complex, omega: float) -> Complex:
    """Coordinates (n,) of harmonic 1, of which the DOFs are told; no contact or force acts on the others.

    (K − ω² M) q = 0 in their rows: the damping is small beside it. Where DOFs are no coordinates but sums of
    modes, the least ones that move them so: nothing else is drawn of such a structure.
    """
    place = np.argmax(np.abs(model.shapes), axis=1)
    if not np.array_equal(model.shapes, np.eye(model.n_coordinates)[place]):
        return np.asarray(np.linalg.pinv(model.shapes) @ told)
    K, _, M = (each[0] for each in model.at(model.diameters(np.ones(1, np.int64)), np.ones(1, np.bool_)))
    rest = np.setdiff1d(np.arange(len(M)), place)
    dynamic = (K - omega**2 * M)[rest]
    coordinates = np.zeros(len(M), np.complex128)
    coordinates[place] = told
    coordinates[rest] = np.linalg.solve(dynamic[:, rest], -dynamic[:, place] @ told)
    return coordinates


def _shape(
    scene: Scene,
    solved: Scene,
    coordinates: Complex,
    frequency_hz: float,
    unit: str,
    states: dict[str, str],
) -> Shape:
    """The shape of complex amplitudes of the coordinates of a scene or of its annulus, (n, H + 1)."""
    picture, model, dofs = picture_of(scene), linear_model(solved), linear_model(solved).dofs
    amplitudes = model.shapes @ coordinates
    whole = scene.dofs[0] not in dofs
    count = scene.structure.sector_count if whole else 1
    row = {dof: i for i, dof in enumerate(dofs)}
    factors = picture.factors(scene.dofs)
    motions = np.empty((count, amplitudes.shape[1], len(picture.points), 3), np.complex128)
    for j in range(count):
        own = amplitudes[[row[f"{dof}@{j}" if whole else dof] for dof in scene.dofs]]
        motions[j] = np.einsum("pcd,dk->kpc", factors, own)
    if mesh_moves(scene):
        turning = None if whole else model.diameters(np.arange(coordinates.shape[1])).tolist()
        found = _of_mesh(scene, coordinates, turning)
        motions[:, :, : found.shape[2]] = found
    sizes = np.linalg.norm(motions, axis=-1).max(axis=(0, 2), initial=0.0)
    kept = np.flatnonzero(sizes >= FAINT * sizes.max(initial=0.0))
    kept = kept if sizes.any() else np.array([1], dtype=np.int64)
    motions = motions[:, kept]
    tau = np.linspace(0.0, 2.0 * math.pi, _INSTANTS, endpoint=False)
    waves = np.where(kept > 0, np.exp(1j * np.outer(tau, kept)), 0.0)
    over = (np.einsum("tk,kpc->tpc", waves, each).real for each in motions)
    return Shape(
        picture=picture, unit=unit, frequency_hz=frequency_hz,
        nodal_diameter=diameter_of(scene), turn=linear_model(scene).interblade_phase if not whole else 0.0,
        harmonics=kept.astype(np.int64), motions=motions,
        amplitude=np.array([np.linalg.norm(each, axis=-1).max(axis=0) for each in over]), states=states,
    )  # fmt: skip


def _of_mesh(scene: Scene, coordinates: Complex, waves: list[int] | None) -> Complex:
    """The motion of the points of the mesh of a sector, (sectors, H + 1, n_points, 3).

    Without the waves of the harmonics the coordinates are those of all sectors, a sum of waves each.
    """
    structure, count = cast(MatricesStructure, scene.structure), scene.structure.sector_count
    n, moved = structure.n_coordinates, _by_wave(structure, count)
    if waves is not None:
        still = np.zeros_like(moved(0, np.zeros(n, np.complex128)))
        return np.array(
            [[moved(m, q) if q.any() else still for m, q in zip(waves, coordinates[:n].T, strict=True)]]
        )
    sectors = np.fft.fft(coordinates[: count * n].reshape(count, n, -1), axis=0)
    return np.fft.ifft(np.array([[moved(m, q) for q in own.T] for m, own in enumerate(sectors)]), axis=0)


def _by_wave(structure: MatricesStructure, count: int) -> Callable[[int, Complex], Complex]:
    """What gives the motion (n_points, 3) of the coordinates (n,) of a sector in a wave of all of them."""
    sector = structure.diameters
    if sector is not None and sector.motion is not None:
        motion, built = sector.motion, sector.diameters

        def of_patterns(wave: int, q: Complex) -> Complex:
            back = 2 * wave > count  # it runs backward: the complex conjugate of the one ahead
            found = motion.at(built.index(min(wave, count - wave)), q.conj() if back else q)
            return found.conj() if back else found

        return of_patterns
    outline, M = cast(SectorOutline, structure.outline), cast(Matrix, structure.M)
    gone, moving = full_elimination(structure), outline.moving(M.size)
    here, beyond = moving @ gone.here, moving @ gone.beyond

    def of_rows(wave: int, q: Complex) -> Complex:
        return np.asarray(here @ q + phase_factor(wave, count) * (beyond @ q)).reshape(-1, 3)

    return of_rows
