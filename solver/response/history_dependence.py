"""What of a periodic response depends on how the vibration began.

Under loads that are given, two motions of one scene never move apart: their distance

    D = ½ Δvᵀ M Δv + ½ Δxᵀ K Δx + Σ Δf² / (2 kt)

only falls, by Δvᵀ C Δv and by what slips differently (the elastic sliders are a sweeping process in moving
convex sets: J. J. Moreau, J. Differ. Equ. 26 (1977) 347, doi:10.1016/0022-0396(77)90085-7). Two periodic
responses therefore keep their distance: they have the same velocities, and the forces of each contact differ
by a constant Δf. A contact that slips anywhere in the period, or opens, leaves no room for one: Δf = 0. A
contact that sticks all the time leaves every constant that keeps |f + Δf| ≤ μN (where each direction has its
own limit, each is a contact by itself: one may slip and the other keep a force), so

- all means that any history can leave are an interval, `mean_range`, and half peak to peak is the same;
- a start from rest without contact forces leads to Δf = 0 if the contact has not slipped on the way. Its
  motion is Δu away from the response, D is known at τ = 0, and as long as nothing of what sticks has slipped

      ½ K_s[Δx, Δx] ≤ D(0),  so  |Δu| ≤ √(2 D(0) L K_s⁻¹ Lᵀ),  K_s = K + Σ kt Lᵀ L over what sticks.

  If |f| + kt |Δu| stays below μN the contact never slips. Else the mean counts as not determined.

Where every contact sticks and stays closed a load that moves is a spring and the same bound holds; in all
other cases with a moving load, a gap or a nonlinear spring nothing is known to decay, so a contact that
sticks leaves the mean open, and half peak to peak with it, since a displaced mean moves loads and springs.
There several responses may exist without any contact that sticks all the time, too: `solve` looks for one
more from no motion, and says so if it finds one, but no more than that.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from solver.balance.workspace import Workspace
from solver.contacts.laws.parts import Slider
from solver.jit import fourier
from solver.jit.fourier import Complex, Real
from solver.linear.assembly import linear_model
from solver.linear.condensation import CANCELLED_STIFFNESS
from solver.linear.contact_table import port_counts, port_stiffnesses
from solver.linear.model import LinearModel
from solver.matrices.normal_modes import hermitian, least_stiffness
from solver.response.contact_response import ContactResponse, ContactState
from solver.response.solution import Solution
from solver.response.start_from_rest import Start, keeps_sticking
from solver.response.time_history import all_coordinates

_TURN = 2.0 * math.pi
# A force with a circular limit that differs from kt u + c by less, relative to it, has not slipped.
SLIPS = 1e-6
_ELSEWHERE = 1e-5  # relative difference of two motions beyond which they are two
_ROUNDING = 1e-10  # of a damping matrix
_INSTANTS = 360  # at least, over the period
# What a transient may do between two instants 0.1 rad of its fastest motion apart, relative: (0.1)²/8.
_BETWEEN = 2e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class History:
    """What a response does not say without its history."""

    mean_open: Annotated[bool, "Whether a start from rest may lead to another mean."]
    half_range_open: Annotated[bool, "Whether it may lead to another half peak to peak too."]
    mean_range: Annotated[
        tuple[float, float],
        "Bounds of the mean of the observed DOF over every history [m], residual forces from assembly "
        "included; NaN where no bound is known.",
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Contact:
    """What sticks all the time under one limit, its contact's answer, and where that begins in the ports."""

    given: Slider
    found: ContactResponse
    begin: int

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


def history_of(solution: Solution) -> History:
    """Return what a converged response does not say without its history."""
    sticking, scene = _sticking(solution), solution.scene
    given = all(contact.load_is_given for contact in scene.contacts)
    pairs = zip(scene.contacts, solution.contacts, strict=False)
    if any(contact.friction is None and found.state is ContactState.STUCK for contact, found in pairs):
        # What keeps no slider, as friction with a dashpot, says nothing of what it holds after the start.
        return History(mean_open=True, half_range_open=not given, mean_range=(math.nan, math.nan))
    if not sticking:
        only = (solution.mean, solution.mean) if given else (math.nan, math.nan)
        return History(mean_open=False, half_range_open=False, mean_range=only)
    bounded = given or _every_one(solution, sticking)
    mean_open = not (bounded and _sticks_from_rest(solution, sticking))
    return History(
        mean_open=mean_open, half_range_open=mean_open and not given,
        mean_range=_mean_range(solution, sticking) if given else (math.nan, math.nan),
    )  # fmt: skip


def has_another_solution(workspace: Workspace, u: Real, p: float, *, from_nothing: bool) -> bool:
    """Return whether Newton's method from no motion leads elsewhere.

    If `u` is what a search from nothing has found (`from_nothing`), that is not made again.

    Under loads that are given, without gaps and nonlinear springs, there is one solution but for residual
    forces; else there may be several, of which this looks for one more: finding none proves nothing.
    """
    if all(contact.load_is_given for contact in workspace.balance.scene.contacts):
        return False
    guess = np.zeros_like(u)
    other = workspace.solve_from(p, guess) if from_nothing else workspace.solve(p, guess)
    if not other.converged:
        return False
    return float(np.abs(other.u - u).max(initial=0.0)) > _ELSEWHERE * float(np.abs(u).max(initial=0.0))


def _sticking(solution: Solution) -> tuple[_Contact, ...]:
    """Return what sticks all the time and can hold a force."""
    begins = np.append(0, np.cumsum(port_counts(solution.scene))).tolist()
    return tuple(
        _Contact(given=slider, found=response, begin=begin)
        for contact, response, begin in zip(solution.scene.contacts, solution.contacts, begins, strict=False)
        for slider in held_sliders(contact.friction, response)
    )


def held_sliders(friction: Slider | None, response: ContactResponse) -> tuple[Slider, ...]:
    """Return those of the sliders of a contact, one for each limit, that are held all the time."""
    sliders = () if friction is None else friction.limited
    return tuple(slider for slider in sliders if _sticks(slider, response))


def _every_one(solution: Solution, sticking: tuple[_Contact, ...]) -> bool:
    """Whether all of every contact sticks; one without friction never does."""
    count = sum(1 if c.friction is None else len(c.friction.limited) for c in solution.scene.contacts)
    return len(sticking) == count


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


def _instants(solution: Solution) -> Real:
    n = max(_INSTANTS, 8 * solution.observed.size)
    return np.linspace(0.0, 2.0 * math.pi, n, endpoint=False)


def _sticks_from_rest(solution: Solution, sticking: tuple[_Contact, ...]) -> bool:
    """Return whether what sticks has certainly not slipped on the way from rest."""
    tau = _instants(solution)
    room = [contact.limit(tau) - contact.given.size(contact.forces(tau)) for contact in sticking]
    if any(np.any(each <= 0.0) for each in room):
        return False
    model = linear_model(solution.scene)
    stiffness = np.zeros(model.contact_here.shape[0])
    for contact in sticking:
        stiffness[contact.ports] = port_stiffnesses(solution.scene, model)[contact.ports]
    reach = _compliances(model, stiffness, [contact.ports for contact in sticking])
    if reach is None:
        return False

    least = [float(np.min(each)) for each in room]
    start = _start(solution, model, stiffness)
    distance = start.distance(start.x, start.v) + _in_sliders(solution, model, sticking)
    lost = [_most_lost(each.given, distance, *by) for each, by in zip(sticking, reach, strict=True)]
    if all(left > most for left, most in zip(least, lost, strict=True)):
        return True
    if not _every_one(solution, sticking):
        return False

    def holds(moved: Real) -> bool:
        """Whether motions of the ports up to these [m] cannot make a contact slip."""
        return all(left > each.lost(moved) for each, left in zip(sticking, least, strict=True))

    angles = np.arange(model.sectors, dtype=np.float64) * model.interblade_phase
    return keeps_sticking(start, _Fits(sticking, angles), holds)


def _most_lost(given: Slider, distance: float, slip: float, approach: float) -> float:
    """Return the most that motion within a distance [J] takes of the room below the limit [N]."""
    lost = max(given.stiffnesses) * math.sqrt(2.0 * distance * slip)
    if given.normal_port is not None:
        lost += given.mu * given.normal_stiffness * math.sqrt(2.0 * distance * approach)
    return lost


class _Fits:
    """Whether every contact sticks where its ports are moved away from the response.

    The sectors run ahead by `angles`. What the response does at the instants of a period is found once:
    a transient may take thousands of periods.
    """

    def __init__(self, sticking: tuple[_Contact, ...], angles: Real) -> None:
        self._sticking, self._angles = sticking, angles
        self._tau = np.zeros(0)
        self._known: list[tuple[_Contact, Real, Real]] = []

    def __call__(self, moved: Real, tau: Real) -> bool:
        """Judge motions `moved` (n, sectors, n_ports) [m] at `tau` (n,)."""
        if tau is not self._tau:
            self._tau = tau
            here = tau[:, None] + self._angles
            self._known = [
                (
                    contact, contact.limit(here.ravel()).reshape(here.shape),
                    contact.forces(here.ravel()).reshape(-1, *here.shape),
                )
                for contact in self._sticking
            ]  # fmt: skip
        return all(self._sticks(moved, *known) for known in self._known)

    @staticmethod
    def _sticks(moved: Real, contact: _Contact, limit: Real, forces: Real) -> bool:
        away = np.moveaxis(moved[:, :, contact.ports], 2, 0)
        given = contact.given
        if given.normal_port is not None:
            limit = limit + given.mu * given.normal_stiffness * away[-1]
        change = given.pull(away[: len(given.ports)])
        between = _BETWEEN * np.abs(change).max(axis=(0, 1), initial=0.0)
        return not bool(np.any(given.size(forces + change) + between >= limit))


def _of_diameters(model: LinearModel) -> Iterator[tuple[Complex, Complex, Complex]]:
    """Yield K, C and L at rest at every nodal diameter."""
    for n in np.arange(model.sectors)[:, None]:
        K, C, _ = model.at(n, np.zeros(1, np.bool_))
        yield K[0], C[0], model.ports_at(n)[0]


def _compliances(
    model: LinearModel, stiffness: Real, ports: list[list[int]]
) -> list[tuple[float, float]] | None:
    """Return L K_s⁻¹ Lᵀ of slip and approach of each contact [m/N].

    None where nothing holds a part, a nodal diameter is not known, or where damping or a stiffness that is
    not symmetric may give power, so that distances may grow.

    Of two directions the larger one stands for both: it is the largest eigenvalue. In an annulus it is the
    average over its nodal diameters.
    """
    total = np.zeros((stiffness.size, stiffness.size), dtype=np.complex128)
    if not (model.is_symmetric and model.every_diameter):
        return None
    for K, damping, L in _of_diameters(model):
        C = hermitian(damping)  # gyroscopic terms do no work
        if np.linalg.eigvalsh(C)[0] < -_ROUNDING * np.abs(C).max():
            return None
        held = K + L.conj().T @ (stiffness[:, None] * L)
        try:
            np.linalg.cholesky(held)
            total += L @ np.linalg.solve(held, L.conj().T) / model.sectors
        except np.linalg.LinAlgError:
            return None
    reach = []
    for port in ports:
        block = total[np.ix_(port, port)]
        if block.shape[0] == 1:
            reach.append((float(block[0, 0].real), 0.0))
            continue
        both = float(np.linalg.eigvalsh(block)[-1])
        reach.append((both, both))
    return reach


def _start(solution: Solution, model: LinearModel, stiffness: Real) -> Start:
    """Return the response of all sectors at τ = 0."""
    ks = np.arange(solution.harmonics.size)
    amplitudes = all_coordinates(solution)
    turns = np.exp(1j * np.outer(np.arange(model.sectors), ks) * model.interblade_phase)
    omega = 2.0 * math.pi * solution.frequency_hz
    v = (turns @ (1j * omega * ks[:, None] * amplitudes)).real
    return Start(model=model, stiffness=stiffness, x=(turns @ amplitudes).real, v=v, omega=omega)


def _in_sliders(solution: Solution, model: LinearModel, sticking: tuple[_Contact, ...]) -> float:
    """Return Σ f² / (2 kt) over what slips, at the beginning [J]; a part of a force is below its limit."""
    angles = np.arange(model.sectors, dtype=np.float64) * model.interblade_phase % (2.0 * math.pi)
    total = 0.0
    for contact, response in zip(solution.scene.contacts, solution.contacts, strict=True):
        held = [each.given for each in sticking if each.found is response]
        for slider in () if contact.friction is None else contact.friction.limited:
            if slider in held:
                continue
            load = fourier.basis(angles, (response.load.size - 1) // 2) @ response.load
            squares = (slider.mu * np.maximum(load, 0.0)) ** 2
            if len(slider.ports) == 1:
                along = contact.friction_at(np.array(response.motions), response.load, angles)
                squares = np.minimum(squares, along[slider.ports[0]] ** 2)
            total += float(np.sum(squares)) / (2.0 * min(slider.stiffnesses))
    return total


def _mean_range(solution: Solution, sticking: tuple[_Contact, ...]) -> tuple[float, float]:
    """Return bounds of the mean over all residual forces [m].

    The mean moves by −observe K⁻¹ Lᵀ Δf. Two directions are bounded by the rectangle around what each
    instant leaves, so the bounds may be somewhat wide there; one direction reaches its bounds.
    """
    gains = _mean_gains(linear_model(solution.scene))
    if gains is None:
        return math.nan, math.nan
    low = high = solution.mean
    tau = _instants(solution)
    for contact in sticking:
        limit, forces = contact.limit(tau), contact.forces(tau)
        for port, force in zip(contact.ports, forces, strict=False):
            room = max(float(np.min(limit + force)), 0.0), max(float(np.min(limit - force)), 0.0)
            for gain in gains[:, port].tolist():
                # f may fall by room[0] and rise by room[1], and the mean moves by −gain Δf.
                low -= room[1] * gain if gain > 0.0 else -room[0] * gain
                high += room[0] * gain if gain > 0.0 else -room[1] * gain
    return low, high


def _mean_gains(model: LinearModel) -> Real | None:
    """Return observe K⁻¹ Lᵀ of contacts of each sector [m/N], (sectors, n_ports); None if it is singular or
    not known at every nodal diameter.

    What rounding leaves of the stiffness against a rigid-body motion is none.
    """
    rows = []
    if not model.every_diameter:
        return None
    for K, _, L in _of_diameters(model):
        if least_stiffness(K) <= CANCELLED_STIFFNESS:
            return None
        rows.append(model.observe @ np.linalg.solve(K, L.conj().T))
    return np.asarray(np.fft.fft(np.array(rows), axis=0).real / model.sectors)
