"""The utilisation of a recovered stress at the worst mean that contacts which stick all the time may hold.

Where the mean of a response depends on how it began (`MEAN_UNDETERMINED`), a stress is judged by the largest
mean that is possible, the upper end of `contact_response.mean_range`. A band is run through: what slips at
one of its frequencies may hold anything at the others, and so may all that sticks where the flag is set at
the peak, or where contacts have the least room. Else a start from rest leads to the mean that was found, but
another may not: of a mean load that stuck contacts hold there any part may be lost, and a stress is judged by
the largest mean without it. Half peak to peak is the same of all.

The worst is looked for over the points of a response, since a mean may be worst where little vibrates, and
polished between them. Where no range is known (loads that move with the parts, gaps, laws that keep no
slider), that is said, and the utilisation is that of the response as it was found.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from solver.balance.balance import Balance, Kind
from solver.balance.kernels.haigh import STATIC, utilisation
from solver.balance.kernels.output import extremes
from solver.balance.workspace import PointSolution, Workspace
from solver.contacts.kernels.columns import MU
from solver.contacts.pieces.line import values_at
from solver.continuation.bracketing import least_between
from solver.continuation.branch import Branch, Peak
from solver.errors import SettingError
from solver.jit import fourier
from solver.jit.fourier import Real
from solver.jit.timer import clock
from solver.linear.assembly import linear_model, structure_derivative
from solver.linear.model import LinearModel
from solver.response.contact_response import (
    ContactState,
    HeldContact,
    Room,
    code_of,
    contact_responses,
    held_contacts,
    instants_of,
    mean_gain_slopes,
    mean_gains,
    rooms_of,
    shares,
)
from solver.response.solution import MEAN_UNDETERMINED, Solution
from solver.response.solve import describe
from solver.results.known import MEAN_STRESS_OPEN, WORST_MEAN
from solver.scene.materials import ENDLESS
from solver.scene.scene import Scene
from solver.sensitivity.gradient import Gradient, Sensitivities

TWO_PI = 2.0 * math.pi
_FINE = 1e-8  # relative distance of frequencies to which the worst one is found
_MOST = 25  # solutions to find it


@dataclass(frozen=True, slots=True, kw_only=True)
class UsedMost:
    """Where a recovered stress is used most over a frequency response."""

    peaks: Annotated[tuple[Peak, ...], "Of the utilisation with the means as they were found."]
    worst: Annotated[Peak | None, "Where a worse mean is possible and it is more than any of these."] = None
    free: Annotated[frozenset[int], "Numbers of the contacts that may hold anything where they stick."] = (
        frozenset()
    )
    known: Annotated[bool, "Whether the worst mean is known."] = True

    @property
    def highest(self) -> Peak:
        """The most of all."""
        return self.peaks[0] if self.worst is None else self.worst

    @property
    def flags(self) -> tuple[str, ...]:
        """What is to be said of it."""
        return () if self.known and self.worst is None else (WORST_MEAN if self.known else MEAN_STRESS_OPEN,)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Side:
    """How far the force of what sticks may move to one side, which is what raises the mean."""

    room: Room
    left: Annotated[float, "How far [N]."]
    sign: Annotated[float, "1 of a force that falls, −1 of one that rises."]
    at: Annotated[float | None, "The instant that leaves no more [rad]; None: what it holds of a mean load."]


class WorstMean:
    """What stuck contacts may add to the mean of the row that a balance observes by its utilisation.

    Parameters
    ----------
    free : numbers of the contacts that may hold anything where they stick; None: all of them where the
        response itself says that its mean is free.
    """

    def __init__(self, balance: Balance, free: frozenset[int] | None = None) -> None:
        self.balance, self._free = balance, free
        self._workspace = Workspace.of(balance)
        self._models: list[tuple[Scene, LinearModel, Real | None]] = []

    def solution(self, u: Real, at_hz: float) -> Solution:
        """Return the response with flags and the range of its mean."""
        found = PointSolution(converged=True, u=u, iterations=0, residual=0.0)
        return describe(self._workspace, found, at_hz, clock(), estimated=False)

    def solved(self, at_hz: float, guess: Real) -> Real | None:
        """Return the solution at a frequency; None if none is found."""
        found = self._workspace.solve_from(TWO_PI * at_hz, guess)
        return found.u if found.converged else None

    def model(self, at_hz: float) -> tuple[LinearModel, Real | None]:
        """Return the linear part with what contacts move the mean by, `mean_gains`."""
        scene = self.balance.scene.at_frequency(at_hz)
        if not self._models or self._models[0][0] is not scene:
            model = linear_model(scene)
            self._models[:] = [(scene, model, mean_gains(model))]
        return self._models[0][1:]

    def sides(self, u: Real, at_hz: float) -> tuple[_Side, ...] | None:
        """Return how far what sticks may move to either side; None where the range is not known."""
        scene, free = self.balance.scene, self._free
        if free is None:
            flagged = MEAN_UNDETERMINED in self.solution(u, at_hz).flags
            free = frozenset(range(len(scene.contacts)) if flagged else ())
        contacts = contact_responses(self._workspace, u, TWO_PI * at_hz)
        sticking = held_contacts(scene, contacts)
        stuck = any(found.state is ContactState.STUCK for found in contacts)
        if not sticking and not stuck:
            return () if self.known_at(at_hz) or not free else None
        pairs = zip(scene.contacts, contacts, strict=True)
        no_slider = any(c.friction is None and found.state is ContactState.STUCK for c, found in pairs)
        if no_slider or not self.known_at(at_hz):
            return None
        instants = instants_of(2 * self.balance.highest_harmonic + 1)
        return tuple(
            _side(room, sign, free=room.held.number in free)
            for room in rooms_of(sticking, instants)
            for sign in (1.0, -1.0)
        )

    def known_at(self, at_hz: float) -> bool:
        """Whether the range of means is known: all loads are given, and what contacts move the mean by."""
        given = all(contact.load_is_given for contact in self.balance.scene.contacts)
        return given and self.model(at_hz)[1] is not None

    def added(self, sides: Iterable[_Side], at_hz: float) -> float:
        """Return by how much all of them raise the mean [its unit]."""
        gains = self.model(at_hz)[1]
        return 0.0 if gains is None else float(sum(side.left * share_of(gains, side) for side in sides))

    def used(self, u: Real, at_hz: float) -> float | None:
        """Return the utilisation at the worst mean, counted on; None where that mean is not known."""
        sides, measures = self.sides(u, at_hz), self._workspace.measure(u, TWO_PI * at_hz)
        if sides is None or measures is None:
            return None
        return self.at(measures.observed, self.added(sides, at_hz))[0]

    def at(self, x: Real, added: float) -> tuple[float, float]:
        """Return the utilisation of a motion by its coefficients, of the harmonics kept, and its slope by
        the mean, with so much added to the mean."""
        high, _, low, _ = extremes(self.balance.system, x)
        used, _, by_mean, *_ = utilisation(self.balance.system.haigh, high + added, low + added)
        return used, by_mean


def _side(room: Room, sign: float, *, free: bool) -> _Side:
    """Return how far a force may move to a side: as far as its limit lets it, or as it holds a mean load."""
    left, at = (room.down, room.down_at) if sign > 0.0 else (room.up, room.up_at)
    held = max(sign * room.mean, 0.0)
    if free or left <= held:
        return _Side(room=room, left=left, sign=sign, at=at)
    return _Side(room=room, left=held, sign=sign, at=None)


def share_of(gains: Real, side: _Side) -> float:
    """Return what moving a force to one side raises the mean by [its unit per N]."""
    return shares(side.sign * gains[:, side.room.port])[0]


def used_most(seen: Branch) -> UsedMost:
    """Return where a recovered stress is used most over a response that observes its utilisation.

    Parameters
    ----------
    seen : completed, as `solver.continuation.branches.observation.observing` gives it by a `Haigh`.
    """
    balance, peak, u = seen.balance, seen.peaks[0], seen.solutions[:, :-1]
    slips = np.isin(seen.states, [code_of(ContactState.SLIPPING), code_of(ContactState.LIFTING)])
    sliders = [contact.friction for contact in balance.scene.contacts]
    apart = np.array([slider is not None and slider.limits_apart for slider in sliders], np.bool_)
    held = (seen.states == code_of(ContactState.STUCK)) | (slips & apart)
    rows = np.flatnonzero(held.any(axis=1)).tolist()
    alone = WorstMean(balance)
    if not rows and alone.known_at(peak.at):
        return UsedMost(peaks=seen.peaks)
    if not alone.known_at(peak.at):
        open_there = rows or MEAN_UNDETERMINED in alone.solution(peak.solution, peak.at).flags
        return UsedMost(peaks=seen.peaks, known=not open_there)
    # Where the stuck contacts carry most the least is known of a start from rest.
    tightest = max(rows, key=lambda i: float(np.linalg.norm(u[i])))
    looks = ((peak.solution, peak.at), (u[tightest].copy(), float(seen.values[tightest])))
    flagged = any(MEAN_UNDETERMINED in alone.solution(*look).flags for look in looks)
    free = frozenset(np.flatnonzero(slips.any(axis=0) | flagged).tolist())
    means = WorstMean(balance, free)
    observed = fourier.from_full(seen.observed, balance.system.ks)
    most = _mean_limits(means, looks[1])
    best, top = peak.value, -1
    at_most = {i: means.at(observed[i], float(most[held[i]].sum()))[0] for i in rows}
    for i in sorted(rows, key=lambda i: -at_most[i]):
        if at_most[i] <= best:
            break
        used = means.used(u[i].copy(), float(seen.values[i]))
        if used is None:
            return UsedMost(peaks=seen.peaks, known=False)
        if used > best:
            best, top = used, i
    if top < 0:
        return UsedMost(peaks=seen.peaks)
    worst = Peak(
        value=best, at=float(seen.values[top]), solution=u[top].copy(),
        interior=bool(seen.values.min() < seen.values[top] < seen.values.max()),
    )  # fmt: skip
    if best < ENDLESS:
        worst = _polished(means, seen.values, worst)
    return UsedMost(peaks=seen.peaks, worst=worst, free=free)


def _mean_limits(means: WorstMean, look: tuple[Real, float]) -> Real:
    """Return the most by which each contact may raise the mean [its unit], (n_contacts,).

    The mean of what it holds, and a constant beside it, are at most the mean limit each.
    """
    u, at_hz = look
    gains, scene, begin = means.model(at_hz)[1], means.balance.scene, 0
    responses = contact_responses(Workspace.of(means.balance), u, TWO_PI * at_hz)
    most = np.full(len(responses), 1e300)  # what keeps no slider is looked at first
    for i, (contact, found) in enumerate(zip(scene.contacts, responses, strict=True)):
        end = begin + len(found.motions)
        if contact.friction is not None and gains is not None:
            limit = contact.friction.limit(abs(float(found.load[0])))
            most[i] = 2.0 * limit * np.abs(gains[:, begin:end]).sum()
        begin = end
    return most


def _polished(means: WorstMean, values: Real, worst: Peak) -> Peak:
    """Return where most is used between the points beside the one where most is."""
    below, above = values[values < worst.at], values[values > worst.at]
    ends = float(below.max(initial=values.min())), float(above.min(initial=values.max()))

    def at(at_hz: float) -> Peak | None:
        solution = means.solved(at_hz, worst.solution)
        used = None if solution is None else means.used(solution, at_hz)
        if solution is None or used is None:
            return None
        return Peak(value=used, at=at_hz, solution=solution.copy(), interior=True)

    found = least_between(at, lambda peak: -peak.value, *ends, _FINE * ends[1], _MOST, -worst.value)
    return worst if found is None or found.value <= worst.value else found


class WorstMeanSlopes(Sensitivities):
    """Derivatives of the utilisation at the worst mean; of the one found where that is not free."""

    def __init__(self, balance: Balance, paths: Sequence[str], free: frozenset[int] | None = None) -> None:
        super().__init__(balance, paths)
        self._means = WorstMean(balance, free)

    def gradient(self, solution: Real, at_hz: float) -> Gradient:
        """Return the utilisation and its derivatives at a solution, as `Sensitivities.gradient`.

        They are NaN where a law has no second derivatives and stuck contacts add to the mean.
        """
        u = np.ascontiguousarray(solution, dtype=np.float64)
        sides = self._means.sides(u, at_hz) or ()
        added, measures = self._means.added(sides, at_hz), self._workspace.measure(u, TWO_PI * at_hz)
        if measures is None or not added > 0.0:
            return super().gradient(u, at_hz)
        by_mean = self._means.at(measures.observed, added)[1]
        haigh = self.balance.system.haigh.copy()
        haigh[STATIC] += added
        raised = replace(self.balance, system=self.balance.system._replace(haigh=haigh))
        plain, slopes = Sensitivities(raised, self.paths).gradient(u, at_hz), self._added(sides, u, at_hz)
        return Gradient(
            value=plain.value, by_frequency=plain.by_frequency + TWO_PI * by_mean * slopes[0],
            by_parameters=plain.by_parameters + by_mean * slopes[1:],
        )  # fmt: skip

    def _added(self, sides: Iterable[_Side], u: Real, at_hz: float) -> Real:
        """Return the derivatives of what may be added to the mean by ω and by the paths, (1 + n_paths,)."""
        total, (model, gains) = np.zeros(1 + len(self.paths)), self._means.model(at_hz)
        try:
            forces = self.forces(u, at_hz)
        except SettingError:
            forces = None
        if forces is None or gains is None:
            return np.full(total.shape, math.nan)
        structural = {
            i: structure_derivative(self.balance.scene, parameter.path)
            for i, parameter in enumerate(self._parameters)
            if parameter.kind is Kind.STRUCTURE
        }
        gains_by = mean_gain_slopes(model, structural)
        forces = fourier.to_full(forces, self.balance.system.ks, self.balance.highest_harmonic)
        for side in sides:
            port, share = side.room.port, share_of(gains, side)
            if side.left <= 0.0:
                continue
            if side.at is None:
                total += share * side.sign * forces[:, port, 0]
            else:
                along = fourier.basis(np.array([side.at]), self.balance.highest_harmonic)[0]
                total += share * side.sign * (forces[:, port] @ along)
                total[1:] += share * self._limit_slopes(side.room.held, side.at)
            raises = side.sign * gains[:, port] > 0.0
            for i, by in gains_by.items():
                total[1 + i] += side.left * side.sign * float(by[raises, port].sum())
        return total

    def _limit_slopes(self, held: HeldContact, tau: float) -> Real:
        """Return the derivatives of μN of a contact at an instant by the paths, (n_paths,)."""
        load, by = held.found.load, self._loads[:, held.number]
        at = np.array([tau])
        N, dN = float(values_at(load, at)[0]), values_at(by, at)[:, 0]
        return np.asarray(self._slopes[:, held.number, MU] * N + held.given.limit(dN))
