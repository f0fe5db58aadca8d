"""One state of a contact over part of a period, linearised about the motion.

A contact remembers numbers w [m]: the places its sliders are held at, or in a slip in space how far the force
has turned. With δu the perturbation of its motions and ' = d/dτ, τ = ωt, in one state

    δf = tangent δu + grip δw,      δw' = by_motion δu + by_rate δu' + own δw,

and where the state begins δw = from_motion δu + from_memory δw⁻, with w⁻ of the state that ends there.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, NamedTuple

import numpy as np

from solver.contacts.fields import Real

SHORTEST = 1e-12  # rad; a state of a contact that lasts no longer does nothing
TURN = 2.0 * math.pi


class Rates(NamedTuple):
    """How force and memory follow, with m motions and s numbers remembered.

    tangent (m, m) [N/m], grip (m, s) [N/m]; by_motion (s, m), by_rate (s, m), own (s, s) by τ. At t instants
    each of them is (t, …).
    """

    tangent: Real
    grip: Real
    by_motion: Real
    by_rate: Real
    own: Real


class StateEntry(NamedTuple):
    """What is remembered where a state begins; `from_memory` None: nothing was before.

    from_motion (s, m), from_memory (s, s⁻).
    """

    from_motion: Real
    from_memory: Real | None


@dataclass(frozen=True, slots=True, kw_only=True)
class StatePiece:
    """One state of a contact with m motions."""

    begin: Annotated[float, "When it begins [rad], at any angle."]
    end: Annotated[float, "When it ends [rad], at most a period later."]
    rates: Annotated[
        Rates | Callable[[Real], Rates],
        "How it follows; of angles (t,), as (t, …) arrays, where that changes within the state.",
    ]
    entry: Annotated[
        StateEntry | None, "None where nothing is remembered, or a slider is held all the time."
    ] = None
    carried: Annotated[
        Real, "How what is remembered moves with a constant displacement that it gives way to, (s, m)."
    ]
    edges: Annotated[
        tuple[float, ...],
        "Angles between begin and end where `rates` is not smooth or begins to change faster.",
    ] = ()

    @property
    def lasts(self) -> float:
        """Its duration [rad]."""
        return self.end - self.begin

    @property
    def memory(self) -> int:
        """How many numbers it remembers."""
        return int(self.carried.shape[0])

    @property
    def constant(self) -> bool:
        """Whether its rates stay the same."""
        return isinstance(self.rates, Rates)

    @property
    def held(self) -> bool:
        """Whether its sliders are held all the time: what they hold never changes."""
        return self.memory > 0 and self.entry is None

    def at(self, tau: Real) -> Rates:
        """Return its rates at angles (t,), (t, …) each."""
        if not isinstance(self.rates, Rates):
            return self.rates(tau)
        return Rates(*(np.broadcast_to(each, (len(tau), *each.shape)) for each in self.rates))

    def holds_at(self, tau: float) -> bool:
        """Whether it lasts at `tau`."""
        return (tau - self.begin) % TURN < self.lasts or self.lasts >= TURN

    def earlier(self, turn: float) -> StatePiece:
        """Return the same state a part of a period earlier [rad]."""
        rates = self.rates
        moved = rates if isinstance(rates, Rates) else lambda tau: rates(tau + turn)
        edges = tuple(edge - turn for edge in self.edges)
        return replace(self, begin=self.begin - turn, end=self.end - turn, rates=moved, edges=edges)


class ContactPart(NamedTuple):
    """What pulls along some of the motions of a contact: those, and its states one after the other.

    Where no state lasts it exerts no force (separation).
    """

    ports: tuple[int, ...]
    pieces: tuple[StatePiece, ...]


def steady(tangent: Real, grip: Real | None = None) -> Rates:
    """Return rates that stay the same: what is remembered does not change."""
    m = tangent.shape[0]
    grip = np.zeros((m, 0)) if grip is None else grip
    s = grip.shape[1]
    return Rates(tangent, grip, np.zeros((s, m)), np.zeros((s, m)), np.zeros((s, s)))


def spring(begin: float, end: float, tangent: Real) -> StatePiece:
    """Return a state that is a spring."""
    return StatePiece(begin=begin, end=end, rates=steady(tangent), carried=np.zeros((0, tangent.shape[0])))
