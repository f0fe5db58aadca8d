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

With all contacts stuck and closed the way from rest is a linear transient, followed to its end: the motion
differs from the response by a free decay of

    M Δẍ + C Δẋ + K_s Δx = 0,  Δx(0) = −x(0),  Δẋ(0) = −ẋ(0),

until the first contact slips, if one does. In an annulus it falls into nodal diameters, in each of them into
modes e^{λτ} that decay, so that it is exact at every instant looked at, and from any period on a motion of a
port is at most the sum of the amplitudes of its modes there.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from solver.balance.workspace import Workspace
from solver.contacts.laws.contact_parts import Slider
from solver.contacts.pieces.line import values_at
from solver.jit.fourier import Complex, Real
from solver.linear.assembly import linear_model
from solver.linear.model import LinearModel
from solver.matrices.normal_modes import hermitian
from solver.response.contact_response import (
    ContactState,
    HeldContact,
    held_contacts,
    instants_of,
    mean_range,
    of_diameters,
)
from solver.response.solution import Solution
from solver.response.time_history import all_coordinates

LARGEST = 400  # coordinates of the annulus: above, the modes would cost more than the response
_FINE = 0.1  # rad of the fastest motion from instant to instant
_MOST_INSTANTS = 4096
_MOST_PERIODS = 3000
_MOST_PRODUCTS = 200_000_000  # multiplications of all periods, were there no nodal diameters
# Condition of the modes above which they do not span what moves; of a pair of equal modes it is 1e8.
_WORST = 1e10
_GROWS = 1e-9  # of a mode's speed: a rate of growth below is rounding
_SLACK = 1e-6  # of a bound, for what rounding leaves

_ELSEWHERE = 1e-5  # relative difference of two motions beyond which they are two
_ROUNDING = 1e-10  # of a damping matrix
# What a transient may do between two instants 0.1 rad of its fastest motion apart, relative: (0.1)²/8.
_BETWEEN = 2e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class Start:
    """Rest, as seen from the response at τ = 0, over all sectors."""

    model: Annotated[LinearModel, "The structure."]
    stiffness: Annotated[Real, "Of the ports of what sticks [N/m], 0 elsewhere, (n_ports,)."]
    x: Annotated[Real, "Displacements of the response [m], (sectors, n)."]
    v: Annotated[Real, "Its velocities [m/s], (sectors, n)."]
    omega: Annotated[float, "[rad/s]."]

    def distance(self, x: Real, v: Real) -> float:
        """Return the energy of displacements and velocities (sectors, n) [J]."""
        beyond = np.roll(x, -1, axis=0)
        u = x @ self.model.contact_here.T + beyond @ self.model.contact_next.T
        K, _, M = self.model.at(np.arange(len(x)), np.zeros(len(x), np.bool_))
        xs, vs = np.fft.fft(x, axis=0), np.fft.fft(v, axis=0)
        kinetic = np.einsum("si,sij,sj->", vs.conj(), M, vs).real / len(x)
        elastic = np.einsum("si,sij,sj->", xs.conj(), K, xs).real / len(x)
        return 0.5 * float(kinetic + elastic + np.sum(self.stiffness * u**2))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Transient:
    """What is left of the start, in the modes of every nodal diameter; 2 n of them in each."""

    rates: Annotated[Complex, "λ by τ, (sectors, 2 n)."]
    amplitudes: Annotated[Complex, "Of the modes at the beginning of a period, (sectors, 2 n)."]
    ports: Annotated[Complex, "Their motions of the ports of sector 0, (sectors, n_ports, 2 n)."]

    @classmethod
    def of(cls, start: Start) -> _Transient | None:
        """Return the transient at its beginning; None if its modes do not span it, or one of them grows."""
        ns = np.arange(len(start.x))
        model, omega = start.model, start.omega
        L = model.ports_at(ns)
        K, C, M = model.at(ns, np.zeros(ns.size, np.bool_))
        K = K + np.swapaxes(L.conj(), 1, 2) @ (start.stiffness[:, None] * L)
        inverse, n = np.linalg.inv(M), start.x.shape[1]
        generator = np.zeros((ns.size, 2 * n, 2 * n), np.complex128)
        generator[:, :n, n:] = np.eye(n)
        generator[:, n:, :n], generator[:, n:, n:] = -inverse @ K / omega**2, -inverse @ C / omega
        state = -np.fft.fft(np.hstack([start.x, start.v / omega]), axis=0) / ns.size
        try:
            rates, modes = np.linalg.eig(generator.real if ns.size == 1 else generator)
            duals = np.linalg.inv(modes)
        except np.linalg.LinAlgError:
            return None
        condition = np.linalg.norm(modes, axis=(1, 2)) * np.linalg.norm(duals, axis=(1, 2))
        if not np.all(condition <= _WORST) or np.any(rates.real > _GROWS * np.abs(rates)):
            return None
        return cls(
            rates=np.minimum(rates.real, 0.0) + 1j * rates.imag,
            amplitudes=(duals @ state[..., None])[..., 0],
            ports=L @ modes[:, :n],
        )  # fmt: skip

    def later(self, periods: int) -> _Transient:
        """Return the same some periods on."""
        return replace(self, amplitudes=self.amplitudes * np.exp(2.0 * math.pi * periods * self.rates))

    def bound(self) -> Real:
        """Return what a port of any sector moves at most, now and later, (n_ports,) [m]."""
        largest = np.einsum("spm,sm->p", np.abs(self.ports), np.abs(self.amplitudes))
        return np.asarray((1.0 + _SLACK) * largest)

    def motions(self, over_a_period: Complex) -> Real:
        """Return the motions of all ports, (count, sectors, n_ports) [m], at the instants of e^{λτ} given."""
        moved = (over_a_period * self.amplitudes[:, None]) @ np.swapaxes(self.ports, 1, 2)
        return np.swapaxes(len(moved) * np.fft.ifft(moved, axis=0).real, 0, 1)


def keeps_sticking(start: Start, fits: Callable[[Real, Real], bool], holds: Callable[[Real], bool]) -> bool:
    """Return whether the transient ends without a slip, as far as bounded work can tell.

    Parameters
    ----------
    start : where it begins.
    fits : whether motions of all ports away from the response, (n, sectors, n_ports) [m], at the angles (n,)
        of a period keep every contact stuck.
    holds : whether every contact sticks at any instant whose motions of the ports of its sector, (n_ports,)
        [m], are at most these.
    """
    sectors, n = start.x.shape
    transient = _Transient.of(start) if sectors * n <= LARGEST else None
    if transient is None:
        return False
    if holds(transient.bound()):
        return True
    count = max(128, math.ceil(2.0 * math.pi * float(np.abs(transient.rates).max()) / _FINE))
    if count > _MOST_INSTANTS:
        return False
    size = count * sectors * start.stiffness.size * 2 * sectors * n
    periods = _first(transient, holds, min(_MOST_PERIODS, _MOST_PRODUCTS // max(size, 1)))
    if periods is None:
        return False
    tau = 2.0 * math.pi / count * np.arange(count, dtype=np.float64)
    over_a_period = np.exp(transient.rates[:, None] * tau[:, None])
    return all(fits(transient.later(i).motions(over_a_period), tau) for i in range(periods))


def _first(transient: _Transient, holds: Callable[[Real], bool], most: int) -> int | None:
    """Return the number of periods from which on no contact can slip; None if `most` are not enough.

    What a port moves at most only falls.
    """
    if not holds(transient.later(most).bound()):
        return None
    low, high = 0, most
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if holds(transient.later(middle).bound()) else (middle, high)
    return high


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


def history_of(solution: Solution) -> History:
    """Return what a converged response does not say without its history."""
    sticking, scene = held_contacts(solution.scene, solution.contacts), solution.scene
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
        mean_range=mean_range(solution, sticking) if given else (math.nan, math.nan),
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


def _every_one(solution: Solution, sticking: tuple[HeldContact, ...]) -> bool:
    """Whether all of every contact sticks; one without friction never does."""
    count = sum(1 if c.friction is None else len(c.friction.limited) for c in solution.scene.contacts)
    return len(sticking) == count


def _sticks_from_rest(solution: Solution, sticking: tuple[HeldContact, ...]) -> bool:
    """Return whether what sticks has certainly not slipped on the way from rest."""
    tau = instants_of(solution.observed.size)
    room = [contact.limit(tau) - contact.given.size(contact.forces(tau)) for contact in sticking]
    if any(np.any(each <= 0.0) for each in room):
        return False
    model = linear_model(solution.scene)
    stiffness = np.zeros(model.contact_here.shape[0])
    for contact in sticking:
        stiffness[contact.ports] = model.port_stiffnesses[contact.ports]
    reach = _compliances(model, stiffness, [contact.ports for contact in sticking])
    if reach is None:
        return False

    least = [float(np.min(each)) for each in room]
    # The response of all sectors at τ = 0.
    ks = np.arange(solution.harmonics.size)
    amplitudes = all_coordinates(solution)
    turns = np.exp(1j * np.outer(np.arange(model.sectors), ks) * model.interblade_phase)
    omega = 2.0 * math.pi * solution.frequency_hz
    v = (turns @ (1j * omega * ks[:, None] * amplitudes)).real
    start = Start(model=model, stiffness=stiffness, x=(turns @ amplitudes).real, v=v, omega=omega)
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
        lost += given.limit_rise * math.sqrt(2.0 * distance * approach)
    return lost


class _Fits:
    """Whether every contact sticks where its ports are moved away from the response.

    The sectors run ahead by `angles`. What the response does at the instants of a period is found once:
    a transient may take thousands of periods.
    """

    def __init__(self, sticking: tuple[HeldContact, ...], angles: Real) -> None:
        self._sticking, self._angles = sticking, angles
        self._tau = np.zeros(0)
        self._known: list[tuple[HeldContact, Real, Real]] = []

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
    def _sticks(moved: Real, contact: HeldContact, limit: Real, forces: Real) -> bool:
        away = np.moveaxis(moved[:, :, contact.ports], 2, 0)
        given = contact.given
        if given.normal_port is not None:
            limit = limit + given.limit_rise * away[-1]
        change = given.pull(away[: len(given.ports)])
        between = _BETWEEN * np.abs(change).max(axis=(0, 1), initial=0.0)
        return not bool(np.any(given.size(forces + change) + between >= limit))


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
    for _, K, damping, L in of_diameters(model):
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


def _in_sliders(solution: Solution, model: LinearModel, sticking: tuple[HeldContact, ...]) -> float:
    """Return Σ f² / (2 kt) over what slips, at the beginning [J]; a part of a force is below its limit."""
    angles = np.arange(model.sectors, dtype=np.float64) * model.interblade_phase % (2.0 * math.pi)
    total = 0.0
    for contact, response in zip(solution.scene.contacts, solution.contacts, strict=True):
        held = [each.given for each in sticking if each.found is response]
        for slider in () if contact.friction is None else contact.friction.limited:
            if slider in held:
                continue
            load = values_at(response.load, angles)
            squares = slider.limit(np.maximum(load, 0.0)) ** 2
            if len(slider.ports) == 1:
                along = contact.friction_at(np.array(response.motions), response.load, angles)
                squares = np.minimum(squares, along[slider.ports[0]] ** 2)
            total += float(np.sum(squares)) / (2.0 * min(slider.stiffnesses))
    return total
