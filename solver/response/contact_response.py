"""What each contact does at a periodic response, and every mean that those leave which stick all the time.

Under given loads the force f of a contact that sticks all the time may change by any constant Δf that keeps
|f + Δf| ≤ μN at every instant, and with it the mean moves by −observe K⁻¹ Lᵀ Δf
(`solver.response.history_dependence`): each force has a room down to min(μN + f) and up to min(μN − f) over
the period, and all of them may be used up together. Two directions under one limit are bounded by the
rectangle around what each instant leaves, so the range may be somewhat wide there; one direction reaches its
ends.

The derivatives of the upper end follow from those of f and μN at the instant where the room is least.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise
from typing import Annotated

import numpy as np

from solver.balance.workspace import Workspace
from solver.contacts.kernels.columns import CLOSED, DEFORMING, TOUCHING
from solver.contacts.kernels.stick_slip_events import LIFTING, SEPARATED, SLIPPING, STUCK
from solver.contacts.laws.contact_parts import Slider
from solver.contacts.pieces.line import values_at
from solver.errors import SettingError
from solver.jit import fourier
from solver.jit.fourier import Complex, Real
from solver.linear.assembly import linear_model
from solver.linear.condensation import CANCELLED_STIFFNESS
from solver.linear.model import LinearModel, LinearModelDerivative
from solver.matrices.normal_modes import least_stiffness
from solver.response.solution import HISTORY_DEPENDENT, MEAN_UNDETERMINED, Solution
from solver.results.told import Piece
from solver.scene.bodies.body import Load
from solver.scene.scene import AnyContact, Scene

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
        return values_at(np.array([self.found.forces[port] for port in self.given.ports]), tau)

    def limit(self, tau: Real) -> Real:
        """Return μN [N], (n,)."""
        return self.given.limit(values_at(self.found.load, tau))

    def lost(self, moved: Real) -> float:
        """Return the most that motions of all ports up to `moved` [m] take of the room to the limit [N]."""
        away, given = moved[self.ports], self.given
        lost = given.size(given.pull(away[: len(given.ports)]))
        if given.normal_port is not None:
            lost = lost + given.limit_rise * away[-1]
        return float(lost)


def held_contacts(scene: Scene, contacts: Sequence[ContactResponse]) -> tuple[HeldContact, ...]:
    """Return what sticks all the time and can hold a force."""
    begins = np.append(0, np.cumsum(scene.port_counts, dtype=np.int64)).tolist()
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Room:
    """How far the force of what sticks may move by a constant along one direction."""

    held: HeldContact
    port: Annotated[int, "Among those of all contacts."]
    down: Annotated[float, "How far it may fall [N]."]
    up: Annotated[float, "How far it may rise [N]."]
    down_at: Annotated[float, "The instant that leaves no more [rad]."]
    up_at: Annotated[float, "Likewise [rad]."]
    mean: Annotated[float, "Of the force as it is [N]."]


def rooms_of(sticking: Sequence[HeldContact], tau: Real) -> Iterator[Room]:
    """Yield the room of every direction of what sticks, by its forces at the instants `tau` (n,)."""
    for held in sticking:
        limit, forces = held.limit(tau), held.forces(tau)
        for port, force in zip(held.ports, forces, strict=False):
            down, up = limit + force, limit - force
            first, second = int(np.argmin(down)), int(np.argmin(up))
            yield Room(
                held=held, port=port, down=max(float(down[first]), 0.0), up=max(float(up[second]), 0.0),
                down_at=float(tau[first]), up_at=float(tau[second]), mean=float(force.mean()),
            )  # fmt: skip


def mean_range(solution: Solution, sticking: tuple[HeldContact, ...]) -> tuple[float, float]:
    """Return the bounds of the mean over all residual forces [m]; NaN where none is known."""
    gains = mean_gains(linear_model(solution.scene))
    if gains is None:
        return math.nan, math.nan
    low = high = solution.mean
    for room in rooms_of(sticking, instants_of(solution.observed.size)):
        rises, falls = shares(gains[:, room.port])
        # The mean moves by −gain Δf.
        low -= rises * room.up + falls * room.down
        high += rises * room.down + falls * room.up
    return low, high


def shares(gains: Real) -> tuple[float, float]:
    """Return what gains of all sectors (sectors,) of either sign come to: the positive, the negative ones."""
    return float(np.maximum(gains, 0.0).sum()), float(np.maximum(-gains, 0.0).sum())


def of_diameters(model: LinearModel) -> Iterator[tuple[int, Complex, Complex, Complex]]:
    """Yield K, C and L at rest at every nodal diameter, with its number."""
    for n in range(model.sectors):
        here = np.array([n])
        K, C, _ = model.at(here, np.zeros(1, np.bool_))
        yield n, K[0], C[0], model.ports_at(here)[0]


def mean_gains(model: LinearModel) -> Real | None:
    """Return observe K⁻¹ Lᵀ of contacts of each sector [m/N], (sectors, n_ports); None if it is singular or
    not known at every nodal diameter.

    What rounding leaves of the stiffness against a rigid-body motion is none.
    """
    rows = []
    if not model.every_diameter:
        return None
    for _, K, _, L in of_diameters(model):
        if least_stiffness(K) <= CANCELLED_STIFFNESS:
            return None
        rows.append(model.observe @ np.linalg.solve(K, L.conj().T))
    return _by_sector(rows)


def mean_gain_slopes(model: LinearModel, by: Mapping[int, LinearModelDerivative]) -> dict[int, Real]:
    """Return the derivatives of gains that are known, by paths of the structure with their numbers."""
    found: dict[int, list[Complex]] = {i: [] for i in by}
    for n, K, _, L in of_diameters(model):
        here, still = np.array([n]), np.zeros(1, np.bool_)
        pushed, seen = np.linalg.solve(K, L.conj().T), np.linalg.solve(K.T, model.observe)
        for i, each in by.items():
            row = -seen @ each.at(here, still)[0][0] @ pushed
            if each.contact_here is not None and each.contact_next is not None:
                moved = each.contact_here + each.contact_next * model.turns(here)[0]
                row = row + seen @ moved.conj().T
            found[i].append(row)
    return {i: _by_sector(rows) for i, rows in found.items()}


def _by_sector(rows: list[Complex]) -> Real:
    """Return numbers of each nodal diameter as those of each sector."""
    return np.asarray(np.fft.fft(np.array(rows), axis=0).real / len(rows))


@dataclass(frozen=True, slots=True)
class LeftForces:
    """Forces that contacts which stick go on holding, as constant loads on the parts they join.

    `sliding` are the contacts' numbers with the relative motion that each force is along.
    """

    sliding: tuple[tuple[int, int], ...]
    terms: tuple[tuple[str, str, int, float], ...]

    @classmethod
    def of(cls, scene: Scene, stuck: Sequence[int]) -> LeftForces:
        """Return the forces of contacts, by their numbers; SettingError where one joins two sectors."""
        sliding = tuple((i, port) for i in stuck for port in scene.contacts[i].RUBBING)
        forms = [scene.forms[i][port] for i, port in sliding]
        if any(term.next for form in forms for term in form):
            raise SettingError("scene", "contacts", "must not join one sector with the next")
        terms = tuple(
            (f"left-{k}-{j}", term.dof, k, term.factor)
            for k, form in enumerate(forms)
            for j, term in enumerate(form)
        )
        return cls(sliding, terms)

    @property
    def paths(self) -> list[str]:
        """The parameters of a scene with them that they are."""
        return [f"{name}.force" for name, *_ in self.terms]

    def by_force(self, slopes: Real) -> Real:
        """Return derivatives (…, forces) by the forces from those by `paths`."""
        spread = np.zeros((len(self.terms), len(self.sliding)))
        for row, (_, _, k, factor) in enumerate(self.terms):
            spread[row, k] = -factor
        return np.asarray(slopes @ spread)

    def on(self, scene: Scene, forces: Real) -> Scene:
        """Return a scene whose contacts stick whatever they carry, with the forces left in them as loads."""
        stuck = {i for i, _ in self.sliding}
        contacts = tuple(
            contact.held_fast() if i in stuck else contact for i, contact in enumerate(scene.contacts)
        )
        loads = tuple(
            Load(name=name, dof=dof, force=-float(forces[k]) * factor) for name, dof, k, factor in self.terms
        )
        return scene.model_copy(update={"contacts": contacts, "loads": (*scene.loads, *loads)})


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
