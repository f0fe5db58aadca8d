"""What forces left in contacts that stick all the time may do to the amplitude.

A contact that sticks all the time keeps a constant force s beside kt u, whatever brought it there, as long as
|kt u + s| ≤ μN at every instant. Under loads that are given s moves the mean alone, in closed form
(`solver.response.history_dependence`). Under a load that moves, or with springs that bend, it changes the
vibration too: its least and largest amplitude over all s are looked for from the ends of each force alone, by
steps along the exact gradient, s acting as a constant load on the parts. The range is one that can be
reached; a wider one is not excluded.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from solver.contacts.pieces.line import values_at
from solver.balance.balance import build
from solver.balance.kernels.output import HALF_RANGE, MAX_ABS, MEAN
from solver.balance.simplifications import Effects
from solver.balance.workspace import Workspace
from solver.continuation.walk import Pace
from solver.jit import fourier
from solver.jit.fourier import Real
from solver.response.contact_response import ContactState, contact_responses
from solver.response.contact_response import LeftForces, held_sliders
from solver.response.solution import Solution
from solver.results.told import Piece
from solver.sensitivity.gradient import Sensitivities

_PACE, _MOST = Pace(first=0.25, least=1e-4, grow=1.5), 60  # steps of the largest limit, and how many
_INSTANTS = 360


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class AmplitudeRange(Piece):
    """Amplitudes over the forces that contacts which stick all the time may hold."""

    max_abs: Annotated[
        tuple[float, float], "Least and largest [m] that were reached; NaN where it was not looked for."
    ]
    half_peak_to_peak: Annotated[tuple[float, float], "The same of half peak to peak [m]."]
    mean: Annotated[tuple[float, float], "Of the mean [m]."]
    contacts: Annotated[tuple[str, ...], "Which contacts stick all the time, in one direction at least."]
    exact: Annotated[bool, "The range is known; else it is what a search along gradients reached."]


def amplitude_range(solution: Solution, effects: Effects | None = None) -> AmplitudeRange | None:
    """Return what residual forces may do to a response; None where no contact sticks all the time.

    Parameters
    ----------
    solution : that converged.
    effects : those it was computed with.
    """
    scene = solution.scene
    stuck = [
        i
        for i, (contact, response) in enumerate(zip(scene.contacts, solution.contacts, strict=True))
        if held_sliders(contact.friction, response)
    ]
    if not stuck:
        return None
    names = tuple(scene.contacts[i].name for i in stuck)
    if all(contact.load_is_given for contact in scene.contacts):
        low, high = solution.mean_range
        half = (solution.half_peak_to_peak, solution.half_peak_to_peak)
        reach = solution.half_peak_to_peak + max(abs(low), abs(high))
        # max|x| is where the mean is largest only of a motion that is as far to both sides.
        symmetric = not np.any(solution.harmonics[2::2])
        least = solution.half_peak_to_peak + (0.0 if low <= 0.0 <= high else min(abs(low), abs(high)))
        most = (least, reach) if symmetric else (math.nan, math.nan)
        return AmplitudeRange(
            max_abs=most, half_peak_to_peak=half, mean=(low, high), contacts=names, exact=True
        )
    ends = [(math.nan, math.nan)] * 3
    # What slips in one direction cannot be made to stick for the sake of the other.
    whole = all(solution.contacts[i].state is ContactState.STUCK for i in stuck)
    if whole and not scene.structure.has_sectors:
        search = _Search(solution, stuck, effects or Effects())
        search.both_ways()
        ends = [search.ends(which) for which in range(3)]
    return AmplitudeRange(
        max_abs=ends[0], half_peak_to_peak=ends[1], mean=ends[2], contacts=names, exact=False
    )


@dataclass(frozen=True, slots=True)
class _Reached:
    """A response with forces left in contacts: these [N], the motion, and max|x|, half range, mean [m]."""

    forces: Real
    u: Real
    numbers: tuple[float, float, float]


class _Search:
    """Responses whose contacts hold other forces."""

    def __init__(self, solution: Solution, stuck: list[int], effects: Effects) -> None:
        self._solution, self._stuck = solution, stuck
        self._effects = replace(effects, even_harmonics=True)
        scene = solution.scene
        self._left = LeftForces.of(scene, stuck)
        self._sliding = self._left.sliding
        self.reached: list[_Reached] = []
        limits = []
        for i in stuck:
            given, load = scene.contacts[i].friction, solution.contacts[i].load
            limits.append(0.0 if given is None else given.limit(float(np.abs(load).sum())))
        self._pace = _PACE.times(max(limits))

    def ends(self, which: int) -> tuple[float, float]:
        """Least and largest of one of the numbers reached."""
        values = [each.numbers[which] for each in self.reached] or [math.nan]
        return min(values), max(values)

    def both_ways(self) -> None:
        """Step to the least and to the largest amplitude from the forces of the response itself."""
        start = []
        for i, port in self._sliding:
            contact, response = self._solution.scene.contacts[i], self._solution.contacts[i]
            own = contact.stiffnesses[port] * response.motions[port][0]
            start.append(float(response.forces[port][0]) - own)
        first = self._at(np.array(start), None)
        if first is None:
            return
        # max|x| is the larger of two curves and may rise on both sides: the ends are looked at first.
        for k in range(len(self._sliding)):
            for side in (1.0, -1.0):
                self._reach(first, side * np.eye(len(self._sliding))[k])
        for sign in (1.0, -1.0):
            self._climb(max(self.reached, key=lambda one: sign * one.numbers[0]), sign)

    def _reach(self, here: _Reached, way: Real) -> None:
        """Go as far along a direction as the contacts can hold the forces."""
        step, solves = self._pace.first, 0
        while step > self._pace.least and solves < _MOST:
            solves += 1
            there = self._at(here.forces + step * way, here.u)
            if there is None:
                step = self._pace.shorter(step)
            else:
                here = there

    def _climb(self, here: _Reached, sign: float) -> None:
        """Go uphill (or down, `sign` −1) while the contacts can hold the forces."""
        step, solves = self._pace.first, 0
        ways = self._ways(here, sign)
        while step > self._pace.least and solves < _MOST and ways:
            for way in ways:
                solves += 1
                there = self._at(here.forces + step * way, here.u)
                if there is not None and sign * (there.numbers[0] - here.numbers[0]) > 0.0:
                    here, step = there, self._pace.after(step)
                    ways = self._ways(here, sign)
                    break
            else:
                step = self._pace.shorter(step)

    def _ways(self, here: _Reached, sign: float) -> list[Real]:
        """Return the gradient's direction, and each force alone on its side of it."""
        scene = self._left.on(self._solution.scene, here.forces)
        balance = build(scene, harmonics=self._solution.n_harmonics, effects=self._effects)
        slopes = Sensitivities(balance, self._left.paths).gradient(here.u, self._solution.frequency_hz)
        gradient = self._left.by_force(slopes.by_parameters)
        size = float(np.linalg.norm(gradient))
        if not size > 0.0 or not math.isfinite(size):
            return []
        alone = [np.eye(len(gradient))[k] * np.sign(sign * g) for k, g in enumerate(gradient) if g != 0.0]
        return [sign * gradient / size, *(alone if len(alone) > 1 else ())]

    def _at(self, forces: Real, guess: Real | None) -> _Reached | None:
        """Return the response with forces left in contacts, if these can hold them."""
        hertz = self._solution.frequency_hz
        omega = 2.0 * math.pi * hertz
        scene = self._left.on(self._solution.scene, forces)
        balance = build(scene, harmonics=self._solution.n_harmonics, effects=self._effects)
        workspace = Workspace.of(balance)
        if guess is None:
            motions = np.concatenate([np.array(each.motions) for each in self._solution.contacts])
            guess = fourier.from_full(motions, balance.system.ks).reshape(-1)
        found = workspace.solve_from(omega, guess)
        if not found.converged or not self._hold(workspace, found.u, omega, forces):
            return None
        measures = workspace.measure(found.u, omega)
        if measures is None:
            return None
        numbers = (
            float(measures.values[MAX_ABS]), float(measures.values[HALF_RANGE]), float(measures.values[MEAN])
        )  # fmt: skip
        self.reached.append(_Reached(forces, found.u.copy(), numbers))
        return self.reached[-1]

    def _hold(self, workspace: Workspace, u: Real, omega: float, forces: Real) -> bool:
        """Whether every contact sticks with what it carries, kt u and what is left in it."""
        tau = np.linspace(0.0, 2.0 * math.pi, _INSTANTS, endpoint=False)
        responses = contact_responses(workspace, u, omega)
        for i in self._stuck:
            given, response = self._solution.scene.contacts[i].friction, responses[i]
            if given is None or response.state is not ContactState.STUCK:
                return False
            carried = np.array([response.forces[port] for port in given.ports])
            carried[:, 0] += [s for s, (j, _) in zip(forces, self._sliding, strict=True) if j == i]
            if np.any(given.size(values_at(carried, tau)) > given.limit(values_at(response.load, tau))):
                return False
        return True
