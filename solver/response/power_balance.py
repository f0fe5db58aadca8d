"""Where the power goes: what the excitation puts in, what dampers and contacts take out, over a period."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from solver.jit import fourier
from solver.linear.assembly import linear_model
from solver.linear.condensation import force_amplitudes
from solver.linear.model import dynamic_stiffness
from solver.response.solution import Solution
from solver.response.time_history import all_coordinates
from solver.results.told import Piece


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class PowerBalance(Piece):
    """Mean power over a period, of one sector if the structure is cyclic.

    A solution of the balance loses none: input = viscous + friction to rounding, whatever the number of
    harmonics.
    """

    input_w: Annotated[
        float,
        "Put in by the excitation [W]; of a base that moves what it puts into the coordinates that move "
        "freely, in which dashpots to the base then take out.",
    ]
    viscous_w: Annotated[
        float, "Taken out by the dampers of the structure, structural damping and gas included [W]."
    ]
    friction_w: Annotated[float, "Taken out by all contacts [W]."]
    contacts_w: Annotated[dict[str, float], "Taken out by each contact [W]."]

    @property
    def imbalance(self) -> float:
        """What is unaccounted for, relative to the largest of the three (0 if nothing moves)."""
        largest = max(abs(self.input_w), abs(self.viscous_w), abs(self.friction_w))
        return abs(self.input_w - self.viscous_w - self.friction_w) / largest if largest > 0.0 else 0.0


def power_balance(solution: Solution) -> PowerBalance:
    """Return the mean powers of a periodic response.

    With velocities v̂_k = ikω x̂_k: input ½ Re Σ f̂ᴴ v̂, viscous ½ Σ v̂ᴴ (C + K/(ikω)) v̂ (of
    which a symmetric, real K takes nothing), friction ½ Re Σ F̂* ikω û.

    Raises
    ------
    SettingError
        The solution did not converge.
    """
    model = linear_model(solution.scene)
    free, omega = model.free, 2.0 * math.pi * solution.frequency_hz
    put_in = taken = 0.0
    ks = np.arange(1, solution.highest_harmonic + 1)
    diameters = model.diameters(ks)
    given = model.at(diameters, ks > 0)
    parts = *given, dynamic_stiffness(*given, ks[:, None, None], omega)[0], model.ports_at(diameters)
    forces = force_amplitudes(model, ks)
    for k, motion, force, K, C, _, Z, L in zip(
        ks.tolist(), all_coordinates(solution, first=1), forces, *parts, strict=True
    ):
        velocity, moved = 1j * k * omega * motion[free], motion[~free]
        put_in += 0.5 * float(np.vdot(velocity, force[free] - Z[np.ix_(free, ~free)] @ moved).real)
        rubbing = [fourier.to_complex(each)[k] for contact in solution.contacts for each in contact.forces]
        if moved.size and rubbing:
            put_in += 0.5 * float(np.vdot(1j * k * omega * L[:, ~free] @ moved, rubbing).real)
        taken += 0.5 * float(np.vdot(velocity, C[np.ix_(free, free)] @ velocity).real)
        if model.extra is not None:  # what a stiffness that is not symmetric or not real takes out
            taken += 0.5 / (k * omega) * float(np.vdot(velocity, K[np.ix_(free, free)] @ velocity).imag)
    friction = {}
    for contact in solution.contacts:
        friction[contact.name] = 0.5 * sum(
            float(force[1:] @ (omega * fourier.derivative(motion))[1:])
            for motion, force in zip(contact.motions, contact.forces, strict=True)
        )
    return PowerBalance(
        input_w=put_in, viscous_w=taken, friction_w=sum(friction.values()), contacts_w=friction
    )
