"""The exact orbit beside a solution of the balance: the march begins where that motion is at τ = 0."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from solver.jit.fourier import Complex, Real
from stickslip.lab.proofs.exact.flow import LiftsError, NoMotionError
from stickslip.lab.proofs.exact.orbit import POLISH, Orbit, beside, find
from stickslip.lab.proofs.exact.piecewise import MemberState, Piecewise
from solver.contacts.pieces.line import FREE, STICK
from solver.response.solution import Solution
from solver.response.time_history import all_coordinates

_START = np.zeros(1)  # the angle


def orbit_beside(solution: Solution, polish: int = POLISH) -> tuple[Piecewise, Orbit | None]:
    """Return the system of a solution that converged and the periodic motion near it; None if none is found.

    Sliders begin where the forces of the balance hold them, so that what sticks throughout keeps its force.
    `polish`: Newton's steps beyond convergence.

    Raises
    ------
    SettingError
        A part of the scene that has no place in an exact solution, see `Piecewise`.
    """
    system = Piecewise(solution.scene, 2.0 * math.pi * solution.frequency_hz)
    try:
        if system.rigid.any() or any(member.rigid_normal for member in system.members):
            found = find(system, *system.at_rest())  # it is exact itself
        else:
            given = zip(solution.contacts, solution.scene.contacts, strict=True)
            forces = [each.force_over(contact, _START) for each, contact in given]
            found = beside(system, *begun_at(system, all_coordinates(solution), forces), 0.0, polish=polish)
    except (LiftsError, NoMotionError):
        return system, None
    return system, found if isinstance(found, Orbit) else None


def begun_at(system: Piecewise, amplitudes: Complex, forces: Sequence[Real]) -> tuple[Real, MemberState]:
    """Return the state at τ = 0 of a motion; what slips there is told by its force at once.

    Parameters
    ----------
    amplitudes : (H + 1, n) of the harmonics.
    forces : of every contact, its force at τ = 0 as an array of one [N].
    """
    n, (w, state) = system.n, system.at_rest()
    w[:n] = amplitudes.real.sum(axis=0)
    w[n : 2 * n] = -(np.arange(len(amplitudes)) @ amplitudes.imag)
    for i, member in enumerate(system.members):
        load, at = float(member.given @ w), float(system.d[member.slider] @ w[:n])
        state.closed[i] = load > 0.0
        state.sliders[member.slider] = STICK if load > 0.0 else FREE
        force = float(forces[member.contact][0])
        limit = member.friction.limit(max(load, 0.0))
        w[system.elastic_at[member.slider]] = at - min(max(force, -limit), limit) / system.kt[member.slider]
    for i, (_, row, _, gap) in enumerate(system.gaps):
        state.pressed[i] = row @ w[:n] > gap
    return w, state
