"""Depths of the contacts over hours, by an embedded Runge-Kutta pair, with exact sensitivities.

dw/dt = r(w, θ) with r the rates at operating conditions, and the variational equations dS/dt = (∂r/∂w) S +
∂r/∂θ for S = ∂w/∂θ, are integrated together by the pair of order 8 with 5 and 3 of Hairer, Nørsett and Wanner
(Solving Ordinary Differential Equations I, 1993, section II.10), which controls the error of both. At a peak
the highest one of the band counts: every step ends with a look at the whole band, and where another peak has
overtaken, at t* with h = a_other − a = 0, the rates jump from r⁻ to r⁺ and

    S⁺ = S⁻ + (r⁻ − r⁺) ∂t*/∂θ,   ∂t*/∂θ = −(h_w S⁻ + h_θ)/(h_w · r⁻).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Annotated

import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import brentq

from solver.arrays import Real
from solver.results.watch import OnProgress, ShouldStop
from stickslip.lab.wear_life.life_result import WearLifeStatus
from stickslip.lab.wear_life.operating_conditions import LostError, OperatingConditions, PeriodicMotion
from stickslip.lab.wear_life.wearing import SECONDS_AN_HOUR, Loss, Wearing

FEWEST_STEPS = 8
MOST_STEPS = 2000
_HIGHER = 1e-9  # relative height by which another peak has overtaken
_SAME = 1e-13  # of the whole time, to which instants are located
_SAME_PEAK = 1e-7  # relative distance of frequencies
_CLOSE = 1e-7  # of the whole time: a step that is shorter goes on without derivatives
_MOST_KNOWN = 40


@dataclass(frozen=True, slots=True, kw_only=True)
class Here:
    """Rates and amplitude at depths (n,), with derivatives by those and by θ, m numbers."""

    hours: Annotated[float, "Running time [h]."]
    depths: Annotated[Real, "[m], (n,)."]
    slopes: Annotated[Real, "Derivatives S of the depths by θ, (n, m)."]
    motion: Annotated[PeriodicMotion, "The response."]
    power: Annotated[Real, "What friction takes out [W], (n,)."]
    rates: Annotated[Real, "Depth an hour [m/h], (n,)."]
    amplitude: Annotated[float, "max|x| of the observed DOF [m]."]
    amplitude_by_depths: Annotated[Real, "(n,)."]
    amplitude_by_own: Annotated[Real, "By θ at fixed depths, (m,)."]

    @property
    def gradient(self) -> Real:
        """Derivatives of the amplitude at a fixed time by θ, (m,)."""
        return self.amplitude_by_depths @ self.slopes + self.amplitude_by_own

    @property
    def rise(self) -> float:
        """Change of the amplitude an hour [m/h]."""
        return float(self.amplitude_by_depths @ self.rates)

    @property
    def instant_moves(self) -> Real:
        """Derivatives by θ of the time at which the amplitude has a fixed value [h per unit], (m,)."""
        return -self.gradient / self.rise if self.rise != 0.0 else self.gradient * math.nan


@dataclass(frozen=True, slots=True, kw_only=True)
class WearStretch:
    """A part of the life over which the same peak is highest."""

    begin: Here
    end: Here
    dense: Annotated[Callable[[float], Real], "State (n + n m,) at a time of it [h]."]


@dataclass(slots=True)
class WearCourse:
    """The life of worn contacts, followed as far as it goes.

    Parameters
    ----------
    wearing, conditions : what wears, and how it runs.
    paths : θ, parameter paths and entries of wear coefficients.
    hours : how long it runs [h].
    tolerance : relative error of a step.
    """

    wearing: Wearing
    conditions: OperatingConditions
    paths: tuple[str, ...]
    hours: float
    tolerance: float
    stretches: Annotated[list[WearStretch], "What was followed."] = field(default_factory=list)
    switches: Annotated[list[float], "When another peak became the highest [h]."] = field(
        default_factory=list
    )
    status: WearLifeStatus = WearLifeStatus.COMPLETED
    why: Annotated[str, "What ended it."] = ""
    smooth: Annotated[bool, "Sensitivities are known all the way."] = True
    _known: list[tuple[Real, PeriodicMotion]] = field(default_factory=list)
    _rival: PeriodicMotion | None = None

    # What the equations are made of

    @property
    def followed(self) -> float:
        """How far the life was followed [h]."""
        return self.stretches[-1].end.hours if self.stretches else 0.0

    @property
    def n(self) -> int:
        """Contacts that wear."""
        return len(self.wearing.places)

    def here(self, hours: float, state: Real, near: PeriodicMotion | None, *, rates: bool = False) -> Here:
        """Return everything at a time and its state; LostError where no response is found."""
        return self._all(hours, state, near, rates=rates)[0]

    def _all(
        self, hours: float, state: Real, near: PeriodicMotion | None, *, rates: bool
    ) -> tuple[Here, Real, Real]:
        """Return everything at a time and its state, with ∂r/∂w (n, n) and ∂r/∂θ (n, m)."""
        wearing, depths = self.wearing, state[: self.n].copy()
        found = self.conditions.at(wearing, depths, near, rates=rates)
        rate = wearing.per_watt * found.power
        by_depths, by_own = self.by_state(wearing.per_watt[:, None] * found.by_power, depths)
        for k, path in enumerate(self.paths):
            if path in wearing.entries:
                of = np.array(wearing.of_entry) == wearing.entries.index(path)
                by_own[of, k] = (SECONDS_AN_HOUR / wearing.areas * found.power)[of]
        amplitude_by_depths, amplitude_by_own = self.by_state(found.by_amplitude, depths)
        here = Here(
            hours=hours, depths=depths, slopes=state[self.n :].reshape(self.n, -1).copy(),
            motion=found.motion, power=found.power, rates=rate, amplitude=found.amplitude,
            amplitude_by_depths=amplitude_by_depths, amplitude_by_own=amplitude_by_own,
        )  # fmt: skip
        return here, by_depths, by_own

    def by_state(self, by_numbers: Real, depths: Real) -> tuple[Real, Real]:
        """Return derivatives by depths (…, n), and by θ at fixed depths (…, m), 0 by wear coefficients.

        `by_numbers` (…, q) are those by the paths of the conditions, then by what depths take from.
        """
        wearing, known = self.wearing, self.conditions.paths
        taken = np.zeros((len(wearing.losses), self.n))
        for i, loss in enumerate(wearing.losses):
            taken[i, loss.contact] = -loss.per_depth
        by_worn = by_numbers[..., len(known) :]
        by_paths = by_numbers[..., : len(known)] + by_worn @ wearing.moved(known, depths)
        by_own = np.zeros((*by_numbers.shape[:-1], len(self.paths)))
        for k, path in enumerate(self.paths):
            if path not in wearing.entries:
                by_own[..., k] = by_paths[..., known.index(path)]
        return by_worn @ taken, by_own

    def _slope(self, hours: float, state: Real) -> Real:
        """Return the right-hand side of depths and sensitivities."""
        if not np.isfinite(state).all():
            return np.full(state.size, math.nan)  # of a step that is taken again
        near = min(self._known, key=lambda one: float(np.abs(one[0] - state[: self.n]).sum()))[1]
        here, by_depths, by_own = self._all(hours, state, near, rates=bool(self.paths))
        self._know(here)
        if not self.paths:
            return here.rates
        slopes = by_depths @ here.slopes + by_own
        if not np.isfinite(slopes).all():
            # A peak that is about to vanish, behind where another overtakes it: a shorter step is taken.
            if hours - self.followed > _CLOSE * self.hours:
                return np.full(state.size, math.nan)
            self.smooth, slopes = False, np.zeros_like(slopes)
        return np.concatenate([here.rates, slopes.ravel()])

    def _know(self, here: Here) -> None:
        self._known.append((here.depths, here.motion))
        del self._known[:-_MOST_KNOWN]

    def _allowed(self, begin: Here) -> Real:
        """Return the absolute errors allowed of the state: relative to what is worn away, or can be."""
        sizes = np.array([self.wearing.size(i) for i in range(self.n)])
        fast = begin.rates * self.hours
        depth = np.minimum(sizes, np.where(fast > 0.0, fast, fast.max(initial=0.0)))
        depth = np.where(np.isfinite(depth) & (depth > 0.0), depth, 1.0)
        values = [self._value(path) for path in self.paths]
        by = np.array([1.0 / abs(value) if value else 1.0 for value in values])
        return self.tolerance * np.concatenate([depth, np.outer(depth, by).ravel()])

    def _value(self, path: str) -> float:
        """Return the value of a parameter."""
        wearing = self.wearing
        if path in wearing.entries:
            return float(wearing.coefficients[wearing.of_entry.index(wearing.entries.index(path))])
        return wearing.scene.value(path)

    # Following

    def follow(self, on_progress: OnProgress = None, should_stop: ShouldStop = None) -> None:
        """Integrate to the end, or as far as it goes; `status` says how it ended."""
        state = np.zeros(self.n * (1 + len(self.paths)))
        try:
            begin = self.here(0.0, state, None)
            allowed = self._allowed(begin)
            self._know(begin)
            while begin.hours < self.hours and self.status is WearLifeStatus.COMPLETED:
                for stretch in self._steps(begin, allowed):
                    self.stretches.append(stretch)
                    begin = stretch.end
                    if on_progress is not None:
                        on_progress(begin.hours / self.hours, self.conditions.solved)
                    if should_stop is not None and should_stop():
                        self.status = WearLifeStatus.STOPPED
                        break
                    if len(self.stretches) >= MOST_STEPS:
                        self.status = WearLifeStatus.TOO_MANY_STEPS
                        break
                begin = self._switched(begin) if begin.hours < self.hours else begin
        except LostError as lost:
            stopped = should_stop is not None and should_stop()
            self.status = WearLifeStatus.STOPPED if stopped else WearLifeStatus.NO_RESPONSE
            self.why = str(lost)

    def _steps(self, begin: Here, allowed: Real) -> Iterator[WearStretch]:
        """Yield the steps from a state on, up to the end, or to where another peak is highest."""
        at = np.concatenate([begin.depths, begin.slopes.ravel()])
        steps = DOP853(
            self._slope, begin.hours, at, self.hours, rtol=self.tolerance, atol=allowed,
            max_step=self.hours / FEWEST_STEPS,
        )  # fmt: skip
        while steps.status == "running":
            steps.step()
            if steps.status == "failed":
                self.status = WearLifeStatus.STALLED
                return
            dense = steps.dense_output()
            end = self._worn_out(begin.hours, steps.t, dense)
            here = self.here(end, dense(end), begin.motion)
            if self.conditions.blocks is None:
                rival = self._overtaker(here)
                meets = None if rival is None else self._meeting(begin, here, rival, dense)
                if meets is not None:
                    self._rival, self.status, self.why = rival, WearLifeStatus.COMPLETED, ""
                    here = self.here(meets, dense(meets), begin.motion)
                    yield WearStretch(begin=begin, end=here, dense=dense)
                    return
            yield WearStretch(begin=begin, end=here, dense=dense)
            if self.status is not WearLifeStatus.COMPLETED:
                return
            begin = here
            self._know(here)

    def _worn_out(self, begin: float, end: float, dense: Callable[[float], Real]) -> float:
        """Return the end of a step: where the first number of a contact reaches its least, if one does."""
        for loss in self.wearing.losses:
            above = partial(self._above, loss, dense)
            if above(end) < 0.0 < above(begin):
                end = float(brentq(above, begin, end, xtol=_SAME * self.hours, rtol=1e-14))
                self.status, self.why = WearLifeStatus.WORN_OUT, loss.path
        return end

    def _above(self, loss: Loss, dense: Callable[[float], Real], hours: float) -> float:
        """Return how far a number of a contact is above its least at a time of a step."""
        return self.wearing.number(loss, dense(hours)) - loss.least

    def _overtaker(self, here: Here) -> PeriodicMotion | None:
        """Return the highest peak of the band if it is another one."""
        top = self.conditions.swept(self.wearing.at(here.depths)).peaks[0]
        same = abs(top.at - here.motion.hertz) <= _SAME_PEAK * top.at
        if same or top.value <= here.amplitude * (1.0 + _HIGHER):
            return None
        return PeriodicMotion(hertz=top.at, u=top.solution, moves=top.interior)

    def _meeting(
        self, begin: Here, end: Here, rival: PeriodicMotion, dense: Callable[[float], Real]
    ) -> float | None:
        """Return when another peak becomes the highest within a step [h]; None if it is the same one."""

        known = [(end.hours, rival)]

        def above(hours: float) -> float:
            here = self.here(hours, dense(hours), begin.motion)
            near = min(known, key=lambda one: abs(one[0] - hours))[1]
            other = self.conditions.peak_near(self.wearing, here.depths, near)
            if other is None or abs(other.hertz - here.motion.hertz) <= _SAME_PEAK * other.hertz:
                return -here.amplitude  # it was not there yet
            known.append((hours, other))
            return self.here(hours, dense(hours), other).amplitude - here.amplitude

        if above(end.hours) <= 0.0:
            return None
        if above(begin.hours) > 0.0:
            return begin.hours
        return float(brentq(above, begin.hours, end.hours, xtol=_SAME * self.hours, rtol=1e-14))

    def _switched(self, here: Here) -> Here:
        """Return a state with the other peak that is as high, and the sensitivities behind the jump."""
        rival, self._rival = self._rival, None
        if rival is None or self.status is not WearLifeStatus.COMPLETED:
            return here
        state = np.concatenate([here.depths, here.slopes.ravel()])
        other = self.here(here.hours, state, rival)
        by_depths = other.amplitude_by_depths - here.amplitude_by_depths
        if float(by_depths @ other.rates) < 0.0:
            self.status = WearLifeStatus.TWO_PEAKS
            return here
        rise = float(by_depths @ here.rates)
        moves = -(by_depths @ here.slopes + other.amplitude_by_own - here.amplitude_by_own) / rise
        slopes = here.slopes + np.outer(here.rates - other.rates, moves)
        self.switches.append(here.hours)
        self._known = [(other.depths, other.motion)]
        return self.here(here.hours, np.concatenate([here.depths, slopes.ravel()]), other.motion)

    # Looking

    def at(self, hours: float) -> Here:
        """Return everything at a time of the life that was followed."""
        stretch = next((one for one in self.stretches if hours <= one.end.hours), self.stretches[-1])
        return self.here(hours, stretch.dense(hours), stretch.begin.motion)

    def maxima(self, begin: float = 0.0, end: float = math.inf) -> list[Here]:
        """Return the local maxima of the amplitude between two times [h], ends too, highest first."""
        last = self.stretches[-1].end.hours
        begin, end = min(begin, last), min(end, last)
        parts = [
            (
                one.begin if one.begin.hours >= begin else self.at(begin),
                one.end if one.end.hours <= end else self.at(end),
            )
            for one in self.stretches
            if one.begin.hours < end and one.end.hours > begin
        ]
        if not parts:
            return [self.at(end)]
        found, before = [], math.inf if parts[0][0].rise <= 0.0 else 0.0
        for left, right in parts:
            if before > 0.0 >= left.rise:
                found.append(left)
            if left.rise > 0.0 > right.rise:
                found.append(self.at(self._root(lambda hours: self.at(hours).rise, left, right)))
            before = right.rise
        if before >= 0.0 or not found:
            found.append(right)
        return sorted(found, key=lambda one: -one.amplitude)

    def reaches(self, limit: float) -> Here | None:
        """Return when the amplitude first reaches a limit [m]; None if it does not."""
        if self.stretches and self.stretches[0].begin.amplitude >= limit:
            return self.stretches[0].begin
        for stretch in self.stretches:
            ends: Sequence[Here] = (stretch.begin, stretch.end)
            if stretch.begin.rise > 0.0 > stretch.end.rise:
                top = self.at(self._root(lambda hours: self.at(hours).rise, *ends))
                ends = (stretch.begin, top)
            if ends[1].amplitude >= limit:
                return self.at(self._root(lambda hours: self.at(hours).amplitude - limit, *ends))
        return None

    def _root(self, value: Callable[[float], float], left: Here, right: Here) -> float:
        """Return where a number changes its sign between two states [h]."""
        xtol = max(_SAME * self.hours, 4e-16)
        return float(brentq(value, left.hours, right.hours, xtol=xtol, rtol=1e-14))
