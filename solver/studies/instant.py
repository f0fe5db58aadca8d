"""A periodic response at its first instant, from which the time march may go on."""

from __future__ import annotations

import math

import numpy as np

from solver.errors import SettingError
from solver.marching.march import MarchStart
from solver.marching.march_equations import rows
from solver.response.solution import Solution
from solver.response.time_history import motion
from solver.scene.scene import LumpedStructure


def start_of(solution: Solution) -> MarchStart:
    """Return displacements, velocities and friction forces of a response at the angle 0.

    A march from there stays at the response if it is one, but for the harmonics left out; if other residual
    tractions have led another march elsewhere, both are responses.

    Raises
    ------
    SettingError
        The solution did not converge, or its structure is not lumped (a cyclic one is, with every sector).
    """
    scene, omega = solution.scene, 2.0 * math.pi * solution.frequency_hz
    if not isinstance(scene.structure, LumpedStructure):
        wanted = "must be of a lumped structure, or of a cyclic one with every sector"
        raise SettingError("solution", scene.name, wanted)
    coefficients = motion(solution)
    ks = np.arange(1, solution.highest_harmonic + 1)
    displacements = coefficients[:, 0] + coefficients[:, 1::2].sum(axis=1)
    velocities = omega * (coefficients[:, 2::2] @ ks)
    tractions: dict[str, float] = {}
    for contact, found in zip(scene.contacts, solution.contacts, strict=True):
        if contact.friction is None:
            continue
        forces = contact.friction_at(np.array(found.motions), found.load, np.zeros(1))[:, 0]
        names = [row.name for row in rows((contact,))]
        tractions.update(zip(names, forces.tolist(), strict=True))
    return MarchStart(
        displacements=dict(zip(scene.dofs, displacements.tolist(), strict=True)),
        velocities=dict(zip(scene.dofs, velocities.tolist(), strict=True)),
        tractions=tractions,
    )
