"""What sticks all the time in a periodic response, with its forces and limits over the period."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from solver.contacts.laws.contact_parts import Slider
from solver.jit import fourier
from solver.jit.fourier import Real
from solver.linear.contact_table import port_counts
from solver.response.contact_response import ContactResponse, ContactState
from solver.scene.scene import Scene

# A force with a circular limit that differs from kt u + c by less, relative to it, has not slipped.
SLIPS = 1e-6
_INSTANTS = 360  # at least, over the period


@dataclass(frozen=True, slots=True, kw_only=True)
class HeldContact:
    """What sticks all the time under one limit."""

    given: Slider
    found: Annotated[ContactResponse, "The answer of its contact."]
    number: Annotated[int, "Which of the scene's contacts that is."]
    begin: Annotated[int, "Where that begins among the ports of all contacts."]

    @property
    def ports(self) -> list[int]:
        """The motions it follows among the ports of all contacts, that of the load last."""
        normal = self.given.normal_port
        own = (*self.given.ports, *(() if normal is None else (normal,)))
        return [self.begin + port for port in own]

    def forces(self, tau: Real) -> Real:
        """Return the friction force [N], (directions, n)."""
        parts = [self.found.forces[port] for port in self.given.ports]
        return np.array([fourier.basis(tau, (part.size - 1) // 2) @ part for part in parts])

    def limit(self, tau: Real) -> Real:
        """Return μN [N], (n,)."""
        load = self.found.load
        return np.asarray(self.given.mu * (fourier.basis(tau, (load.size - 1) // 2) @ load))

    def lost(self, moved: Real) -> float:
        """Return the most that motions of all ports up to `moved` [m] take of the room to the limit [N]."""
        away, given = moved[self.ports], self.given
        lost = given.size(given.pull(away[: len(given.ports)]))
        if given.normal_port is not None:
            lost = lost + given.mu * given.normal_stiffness * away[-1]
        return float(lost)


def held_contacts(scene: Scene, contacts: Sequence[ContactResponse]) -> tuple[HeldContact, ...]:
    """Return what sticks all the time and can hold a force."""
    begins = np.append(0, np.cumsum(port_counts(scene))).tolist()
    return tuple(
        HeldContact(given=slider, found=response, number=number, begin=begins[number])
        for number, (contact, response) in enumerate(zip(scene.contacts, contacts, strict=True))
        for slider in held_sliders(contact.friction, response)
    )


def held_sliders(friction: Slider | None, response: ContactResponse) -> tuple[Slider, ...]:
    """Return those of the sliders of a contact, one for each limit, that are held all the time."""
    sliders = () if friction is None else friction.limited
    return tuple(slider for slider in sliders if _sticks(slider, response))


def _sticks(slider: Slider, response: ContactResponse) -> bool:
    """Return whether what has one limit sticks all the time; of a contact that slips one direction may."""
    if response.state is ContactState.STUCK:
        return True
    if not slider.limits_apart or response.state is not ContactState.SLIPPING:
        return False
    motions, forces, ports = np.array(response.motions), np.array(response.forces), list(slider.ports)
    slips = np.abs(forces[ports, 1:] - slider.pull(motions[ports, 1:]))
    largest = float(np.abs(forces[ports, 1:]).max(initial=0.0))
    return float(slips.max(initial=0.0)) <= SLIPS * largest


def instants_of(size: int) -> Real:
    """Return angles over the period at which forces of motions of `size` coefficients are compared, (n,)."""
    n = max(_INSTANTS, 8 * size)
    return np.linspace(0.0, 2.0 * math.pi, n, endpoint=False)
