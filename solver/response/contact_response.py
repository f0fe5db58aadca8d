"""What each contact does at a periodic response: its motion, force, state and utilisation."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise
from typing import Annotated

import numpy as np

from solver.balance.workspace import Workspace
from solver.contacts.kernels.columns import CLOSED, DEFORMING, TOUCHING
from solver.contacts.kernels.stick_slip_events import LIFTING, SEPARATED, SLIPPING, STUCK
from solver.contacts.pieces.line import values_at
from solver.jit import fourier
from solver.jit.fourier import Real
from solver.response.solution import HISTORY_DEPENDENT, MEAN_UNDETERMINED
from solver.results.told import Piece
from solver.scene.scene import AnyContact


class ContactState(Enum):
    """What a contact does over a period; the value is what a user reads."""

    SEPARATED = "separated"
    STUCK = "stuck"
    SLIPPING = "stick and slip"
    LIFTING = "stick, slip and separation"
    CLOSED = "closed"
    TOUCHING = "opens and closes"
    DEFORMING = "deforms"


_STATES = {
    SEPARATED: ContactState.SEPARATED,
    STUCK: ContactState.STUCK,
    SLIPPING: ContactState.SLIPPING,
    LIFTING: ContactState.LIFTING,
    CLOSED: ContactState.CLOSED,
    TOUCHING: ContactState.TOUCHING,
    DEFORMING: ContactState.DEFORMING,
}


def state_of(code: int) -> ContactState:
    """The state a compiled loop says by a number, as in `Branch.states`."""
    return _STATES[code]


def code_of(state: ContactState) -> int:
    """The number of a state, as in `Branch.states`."""
    return next(code for code, each in _STATES.items() if each is state)


OPENS = (ContactState.SEPARATED, ContactState.LIFTING, ContactState.TOUCHING)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class ContactResponse(Piece):
    """The motion and force of one contact."""

    name: Annotated[str, "Name of the contact."]
    state: Annotated[ContactState, "What it does over the period."]
    slip: Annotated[Real, "Coefficients of the slip motion u [m], (2H + 1,)."]
    force: Annotated[Real, "Coefficients of the friction force [N], (2H + 1,)."]
    load: Annotated[
        Real,
        "Coefficients of the normal load N [N] before it is cut at 0; 0 of a contact without friction, "
        "(3,) or (2H + 1,).",
    ]
    utilisation: Annotated[
        float,
        "max|f| / (μ N) of a stuck contact, 1 for one that slips, NaN for one that is separated throughout.",
    ]
    second_motion: Annotated[
        Real | None,
        "The other relative motion [m]: the normal one of a rubbing contact, or the second direction it "
        "slides in, (2H + 1,).",
    ] = None
    second_force: Annotated[Real | None, "The force along it [N], (2H + 1,)."] = None
    third_motion: Annotated[Real | None, "That of a law with three relative motions [m], (2H + 1,)."] = None
    third_force: Annotated[Real | None, "The force along that [N], (2H + 1,)."] = None

    @property
    def motions(self) -> tuple[Real, ...]:
        """Coefficients of all its relative motions [m]."""
        every = (self.slip, self.second_motion, self.third_motion)
        return tuple(motion for motion in every if motion is not None)

    @property
    def forces(self) -> tuple[Real, ...]:
        """Coefficients of the forces along them [N]."""
        every = (self.force, self.second_force, self.third_force)
        return tuple(force for force in every if force is not None)

    @property
    def work(self) -> float:
        """Work that its forces take out in a period [J], by their harmonics and those of its motions."""
        every = zip(self.motions, self.forces, strict=True)
        orders = np.arange(1, (self.slip.size - 1) // 2 + 1)
        return float(sum(np.pi * orders @ (f[1::2] * u[2::2] - f[2::2] * u[1::2]) for u, f in every))

    def force_over(self, given: AnyContact, tau: Real) -> Real:
        """Return the force of the contact `given` along its first motion [N] at angles, evenly spaced from 0.

        It is what the law gives for the motion, with its corners; the motion of a rigid contact does not tell
        its force, which is then the sum of the harmonics kept.
        """
        if given.is_rigid:
            return values_at(self.force, tau)
        return given.force_at(np.array(self.motions), self.load, tau)


def contact_responses(workspace: Workspace, u: Real, p: float) -> tuple[ContactResponse, ...]:
    """Return motion, force and state of every contact at a solution (u, λ = p)."""
    balance = workspace.balance
    _, point = workspace.forces(u, p)
    ks, top = balance.system.ks, balance.highest_harmonic
    slips = fourier.to_full(u.reshape(balance.n_ports, balance.n_coefficients), ks, top)
    forces = fourier.to_full(point.F, ks, top)
    ports = [slice(first, end) for first, end in pairwise(balance.system.first_port)]
    return tuple(
        _contact(contact, int(state), slips[port], forces[port])
        for contact, state, port in zip(balance.scene.contacts, point.states, ports, strict=True)
    )


def flags_of(
    contacts: tuple[ContactResponse, ...], *, mean_open: bool, half_range_open: bool
) -> tuple[str, ...]:
    """Return the flags of a response with such contacts; whether its mean and half its range are open."""
    stuck = [contact for contact in contacts if contact.state is ContactState.STUCK]
    flags = {
        MEAN_UNDETERMINED: mean_open, HISTORY_DEPENDENT: half_range_open,
        "all_stuck": bool(stuck) and len(stuck) == len(contacts),
        "separation": any(contact.state in OPENS for contact in contacts),
    }  # fmt: skip
    return tuple(flag for flag, holds in flags.items() if holds)


def _contact(contact: AnyContact, state: int, motions: Real, forces: Real) -> ContactResponse:
    load, utilisation = contact.normal_load(motions), 1.0
    if state == STUCK:
        utilisation = contact.utilisation(forces, load)
    elif state == SEPARATED:
        utilisation = math.nan
    return ContactResponse(
        name=contact.name, state=state_of(state), slip=motions[0], force=forces[0], load=load,
        utilisation=utilisation,
        second_motion=motions[1] if len(motions) > 1 else None,
        second_force=forces[1] if len(forces) > 1 else None,
        third_motion=motions[2] if len(motions) > 2 else None,
        third_force=forces[2] if len(forces) > 2 else None,
    )  # fmt: skip
