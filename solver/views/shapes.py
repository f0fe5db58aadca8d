"""Mode shapes and operating deflection shapes, with what is drawn of them (`solver.views.picture`).

The motion of point p in sector j of a disk at the angle τ = ωt is u(τ) = R_j Re Σ_k U_kp e^{ik(τ + jθ)}: R_j
turns it with its sector, θ is the phase of harmonic 1 from one sector to the next. Where all sectors were
solved each has motions of its own, and θ = 0.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from solver.arrays import Complex, Integer, Real
from solver.errors import SettingError
from solver.jit import fourier
from solver.linear.assembly import linear_model
from solver.modes.nonlinear_mode import at_nodal_diameter, pose
from solver.modes.records import diameter_of
from solver.response.solution import Solution
from solver.response.time_history import motion
from solver.scene.cyclic.annulus import written_out
from solver.scene.scene import Scene
from solver.views.picture import Picture, picture_of

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
    coefficients = motion(solution)
    states = {contact.name: contact.state.value for contact in solution.contacts}
    amplitudes = np.array([fourier.to_complex(row) for row in coefficients])
    return _shape(scene, solution.scene.dofs, amplitudes, solution.frequency_hz, "m", states)


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
    moved = linear_model(solved).shapes @ problem.mode.shape
    return _shape(scene, solved.dofs, _first(moved), problem.mode.omega / (2.0 * math.pi), "1/√kg", {})


def shape_of_motion(
    scene: Scene, dofs: Sequence[str], motion: Complex, frequency_hz: float, states: dict[str, str],
    nodal_diameter: int | None = None,
) -> Shape:  # fmt: skip
    """Return the shape of harmonic 1 of a nonlinear mode over its amplitude, as its results tell it.

    Parameters
    ----------
    dofs : names, of one sector or of all.
    motion : (n,) harmonic 1 of each [1/√kg], see `solver.modes.results.NonlinearMode.shape`.
    frequency_hz, states : what it has there.
    nodal_diameter : of a disk of which one sector was solved; that of the engine order if left out.

    Raises
    ------
    SettingError
        A DOF that is missing, or a nodal diameter that cannot be.
    """
    scene = at_nodal_diameter(scene, nodal_diameter)
    needed = scene.dofs if scene.dofs[0] in dofs else written_out(scene).dofs
    missing = next((dof for dof in needed if dof not in dofs), None)
    if missing is not None:
        raise SettingError("dofs", missing, "is missing: the motion of every DOF must be told, it lacks")
    return _shape(scene, tuple(dofs), _first(motion), frequency_hz, "1/√kg", states)


def _first(motion: Complex) -> Complex:
    """Harmonics 0 and 1 of which the second alone moves anything."""
    return np.stack([np.zeros_like(motion), motion], axis=1)


def _shape(
    scene: Scene,
    dofs: tuple[str, ...],
    amplitudes: Complex,
    frequency_hz: float,
    unit: str,
    states: dict[str, str],
) -> Shape:
    """The shape of complex amplitudes of the DOFs that were solved, of one sector or all, (n_dofs, H + 1)."""
    picture = picture_of(scene)
    whole = scene.dofs[0] not in dofs
    count = scene.structure.sector_count if whole else 1
    row = {dof: i for i, dof in enumerate(dofs)}
    factors = picture.factors(scene.dofs)
    motions = np.empty((count, amplitudes.shape[1], len(picture.points), 3), np.complex128)
    for j in range(count):
        own = amplitudes[[row[f"{dof}@{j}" if whole else dof] for dof in scene.dofs]]
        motions[j] = np.einsum("pcd,dk->kpc", factors, own)
    sizes = np.linalg.norm(motions, axis=-1).max(axis=(0, 2), initial=0.0)
    kept = np.flatnonzero(sizes >= FAINT * sizes.max(initial=0.0))
    kept = kept if sizes.any() else np.array([1], dtype=np.int64)
    motions = motions[:, kept]
    tau = np.linspace(0.0, 2.0 * math.pi, _INSTANTS, endpoint=False)
    waves = np.where(kept > 0, np.exp(1j * np.outer(tau, kept)), 0.0)
    over = np.einsum("tk,skpc->stpc", waves, motions).real
    return Shape(
        picture=picture, unit=unit, frequency_hz=frequency_hz,
        nodal_diameter=diameter_of(scene), turn=linear_model(scene).interblade_phase if not whole else 0.0,
        harmonics=kept.astype(np.int64), motions=motions,
        amplitude=np.linalg.norm(over, axis=-1).max(axis=1), states=states,
    )  # fmt: skip
