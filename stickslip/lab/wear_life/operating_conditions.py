"""How worn contacts run: at a resonance peak, at fixed frequencies; rates and amplitude with derivatives.

At a frequency held fixed everything is differentiated through the solve. At a peak the frequency moves, df/dp
= −a_fp/a_ff of the amplitude a(f, p) (implicit function theorem), and with it what friction takes out; the
amplitude itself does not gain by that (envelope theorem).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Annotated

import numpy as np

from solver.results import units
from solver.arrays import Real
from solver.balance.balance import Balance, build, for_parameter
from solver.balance.simplifications import Effects
from solver.balance.workspace import Workspace
from solver.contacts.kernels.system import by_reference
from solver.continuation.branch import Branch
from solver.continuation.branches.sweep import sweep
from solver.continuation.extrema.kernels.peak_newton import SHARP, climb, find_summit
from solver.continuation.extrema.kernels.amplitude_hessian import (
    SIGN,
    SPENT,
    new_summit,
    summit_numbers,
    summit_seconds,
)
from solver.continuation.branch import Peak
from solver.continuation.walk import ContinuationSettings
from solver.balance.contact_hessian import second_numbers
from solver.response.wear import WearSensitivity
from solver.results.watch import ShouldStop
from solver.scene.scene import Scene
from solver.sensitivity.gradient import Sensitivities
from solver.sensitivity.nonsmooth import PeakKind, peak_gradient
from stickslip.lab.wear_life.wearing import Wearing

TWO_PI = 2.0 * math.pi
SETTINGS = ContinuationSettings(most_points=4000, unfinished_peaks=False, errors=False)
_FIRST_CLIMB = 1e-4  # of the frequency
_NEAR = 0.05  # relative distance of a peak that is the one followed


@dataclass(frozen=True, slots=True, kw_only=True)
class PeriodicMotion:
    """A periodic response from which neighbours begin."""

    hertz: Annotated[float, "Its frequency [Hz]."]
    u: Annotated[Real, "Slip motions [m], (n_unknowns,)."]
    moves: Annotated[bool, "A peak inside the band, whose frequency depends on the parameters."]


@dataclass(frozen=True, slots=True, kw_only=True)
class WornResponse:
    """What contacts worn by some depths do, n of them, with derivatives by q numbers."""

    motion: Annotated[PeriodicMotion, "The response, of several the one with the largest amplitude."]
    amplitude: Annotated[float, "Its max|x| of the observed DOF [m]."]
    by_amplitude: Annotated[Real, "Derivatives of that, (q,)."]
    power: Annotated[Real, "What friction takes out, the mean of all blocks [W], (n,)."]
    by_power: Annotated[Real, "Derivatives of that; NaN where they are not asked for or known, (n, q)."]


class LostError(Exception):
    """No response was found; the message says why."""


@dataclass(slots=True)
class OperatingConditions:
    """The frequencies that worn contacts run at.

    Parameters
    ----------
    blocks : (frequency [Hz], share of the time) of each; None for the peak, which is then the only one.
    harmonics : highest harmonic kept.
    paths : what is differentiated by.
    effects : what is paid for: the harmonics stay the same over the life.
    """

    blocks: tuple[tuple[float, float], ...] | None
    harmonics: int
    paths: tuple[str, ...]
    effects: Effects
    should_stop: ShouldStop = None
    solved: Annotated[int, "Responses so far."] = 0
    _known: dict[float, PeriodicMotion] = field(default_factory=dict)

    def balance(self, scene: Scene) -> Balance:
        """Return the balance of a worn scene."""
        return build(scene, harmonics=self.harmonics, effects=self.effects)

    def swept(self, scene: Scene) -> Branch:
        """Return the response over the band; LostError where it does not cover that, or has no peak."""
        branch = sweep(
            scene, harmonics=self.harmonics, settings=SETTINGS, should_stop=self.should_stop,
            effects=self.effects,
        )  # fmt: skip
        self.solved += len(branch.values)
        if not branch.reached or not branch.peaks:
            raise LostError(str(branch.status.value))
        return branch

    def at(
        self, wearing: Wearing, depths: Real, near: PeriodicMotion | None, *, rates: bool = True
    ) -> WornResponse:
        """Return what contacts do at depths (n,) [m]; LostError where no response is found.

        Parameters
        ----------
        near : a peak of a neighbour; None for the highest of the band.
        rates : whether the power is differentiated too.
        """
        scene = wearing.at(depths)
        if self.blocks is not None:
            return self._at_blocks(wearing, scene, rates=rates)
        balance = self.balance(scene)
        found = None if near is None else self._peak(balance, wearing, near)
        if found is None:
            found = self._searched(scene, near)
        return self._running(wearing, balance, found, rates=rates)

    def peak_near(self, wearing: Wearing, depths: Real, near: PeriodicMotion) -> PeriodicMotion | None:
        """Return the peak at depths (n,) [m] that continues one of a neighbour; None if none is found."""
        return self._peak(self.balance(wearing.at(depths)), wearing, near)

    def at_frequency(self, scene: Scene, hertz: float) -> tuple[Balance, PeriodicMotion]:
        """Return balance and motion of a worn scene at a frequency [Hz]; LostError without a response."""
        balance = self.balance(scene.at_frequency(hertz))
        space, before = Workspace.of(balance), self._known.get(hertz)
        found = None if before is None else space.solve_from(TWO_PI * hertz, before.u)
        if found is None or not found.converged:
            found = space.solve(TWO_PI * hertz)
        self.solved += 1
        if not found.converged:
            raise LostError(f"At {units.hertz(hertz)} no response was found.")
        motion = PeriodicMotion(hertz=hertz, u=found.u, moves=False)
        self._known[hertz] = motion
        return balance, motion

    def _at_blocks(self, wearing: Wearing, scene: Scene, *, rates: bool) -> WornResponse:
        """Return what contacts do at fixed frequencies: powers by the shares of time."""
        every = []
        for hertz, share in self.blocks or ():
            balance, motion = self.at_frequency(scene, hertz)
            every.append((share, self._running(wearing, balance, motion, rates=rates)))
        highest = max((one for _, one in every), key=lambda one: one.amplitude)
        return replace(
            highest, power=sum((share * one.power for share, one in every), np.zeros(1)),
            by_power=sum((share * one.by_power for share, one in every), np.zeros((1, 1))),
        )  # fmt: skip

    def _peak(self, balance: Balance, wearing: Wearing, near: PeriodicMotion) -> PeriodicMotion | None:
        """Return the peak near another by Newton's method, or uphill; None where neither finds it."""
        path, omega, u = wearing.losses[0].path, TWO_PI * near.hertz, near.u.copy()
        low, high = (TWO_PI * end for end in balance.scene.observe.band)
        system = by_reference(for_parameter(balance, path, near.hertz).system)
        p, summit = balance.scene.value(path), new_summit(system)
        summit_seconds(summit)[:] = second_numbers(balance.scene)
        good, _, there = find_summit(system, u, omega, p, 0.0, not near.moves, SHARP, summit)
        if near.moves and not (good and low <= there <= high):
            u, summit_numbers(summit)[SIGN] = near.u.copy(), 0.0
            good, there = climb(system, u, omega, p, 0.0, _FIRST_CLIMB * omega, low, high, summit)
        self.solved += int(summit_numbers(summit)[SPENT])
        return PeriodicMotion(hertz=there / TWO_PI, u=u, moves=near.moves) if good else None

    def _searched(self, scene: Scene, near: PeriodicMotion | None) -> PeriodicMotion:
        """Return the highest peak of a response, of those near another if there is one."""
        peaks = self.swept(scene).peaks
        if near is not None:
            beside = [peak for peak in peaks if abs(peak.at - near.hertz) <= _NEAR * near.hertz]
            peaks = tuple(beside) or peaks
        return PeriodicMotion(hertz=peaks[0].at, u=peaks[0].solution, moves=peaks[0].interior)

    def _running(
        self, wearing: Wearing, balance: Balance, motion: PeriodicMotion, *, rates: bool
    ) -> WornResponse:
        """Return powers and amplitude at a response, with derivatives."""
        hertz, u = motion.hertz, motion.u
        paths = (*self.paths, *(loss.path for loss in wearing.losses))
        sensitivities = Sensitivities(balance, paths)
        peak = Peak(value=math.nan, at=hertz, solution=u, interior=motion.moves)
        height = peak_gradient(sensitivities, peak)
        drift = height.drift
        if rates and height.kind is PeakKind.SMOOTH:
            drift = sensitivities.peak_hessian(u, hertz).drift
        point = WearSensitivity(balance, paths if rates else ()).at(hertz, u)
        power, by_power = np.zeros(len(wearing.places)), np.full((len(wearing.places), len(paths)), math.nan)
        for i, name in enumerate(wearing.names):
            work = point.work(name)
            power[i] = work.value * hertz
            if rates:
                by_power[i] = hertz * work.gradient
                by_power[i] += (work.value + hertz * work.by_frequency) * drift
        return WornResponse(
            motion=motion, amplitude=height.value, by_amplitude=height.gradient, power=power,
            by_power=by_power,
        )  # fmt: skip
