"""The motion of a piecewise linear system from event to event, to rounding, with its derivative by the start.

Within a mode w(τ + t) = e^{At} w. Powers of one step's exponential give the state at many instants at once;
the cubics through the conditions there and their slopes tell the step in which one may end, its Taylor series
whether and where. The derivative of the state jumps at an event by
(R A⁻ − A⁺ R) w dt, R what the event resets, dt = −r δw / (r A⁻ w) (M. A. Aizerman, F. R. Gantmakher,
Q. J. Mech. Appl. Math. 11 (1958) 225).

A condition may begin at 0: that of the limit with its rate where slip ended or began, that of the load where
a contact closed. What counts is then the first derivative that is not rounding.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import product

import numpy as np

from solver.jit.fourier import Real
from stickslip.lab.proofs.exact.piecewise import (
    AT_GAP,
    LIFTS,
    TO_CLOSE,
    TO_OPEN,
    TO_REST,
    TO_SLIP,
    MemberState,
    Mode,
    Piecewise,
)
from solver.contacts.pieces.line import FREE, STICK, line_left

DEGREE = 22  # of a Taylor series over a step, in which the fastest motion turns by TURN
TURN = 0.7
_MOST_STEPS, _BYTES = 64, 4e6  # of the powers kept of a mode
_SAMPLES = np.linspace(0.0, 1.0, 17)
_ROUNDING = 1e-10  # of the size a number is a sum of: less is 0 where a piece begins
_AT_ONCE = 40  # events at one instant that are one too many
_MOST_EVENTS = 20_000
_PIVOTS, _FEW = 30, 8
_MARGIN = 1e-2  # of its variation over a step: by so much a condition may lie below the cubic
_TIE = 1e-12  # of the size a number is a sum of: a force that far beyond its limit is on it


class LiftsError(Exception):
    """A rigid normal contact is about to open."""

    def __init__(self, member: int) -> None:
        super().__init__(member)
        self.member = member


class NoMotionError(Exception):
    """No motion goes on: events without end, or no state of the contacts that is consistent."""


@dataclass(slots=True)
class _Steps:
    """What a mode needs to be followed: e^{Ah} and its powers, and A h to powers over factorials."""

    h: float
    powers: Real  # (m + 1, nw, nw)
    rates: Real  # conditions' derivatives by t / h, (nc, nw)


@dataclass(slots=True)
class FlowPiece:
    """A stretch of one mode: from `tau` on for `length` from the state `w`; `phi` as in `Flow`."""

    tau: float
    length: float
    w: Real
    mode: Mode
    state: MemberState
    phi: Real | None


@dataclass(slots=True)
class Flow:
    """A motion under way; `phi` is the derivative of its state by where it began, if that is followed."""

    system: Piecewise
    w: Real
    state: MemberState
    tau: float
    phi: Real | None = None
    pieces: list[FlowPiece] = field(default_factory=list)

    def run(self, length: float) -> None:
        """Go on for an angle, the pieces of the way in `pieces`; raises LiftsError, NoMotionError."""
        self.pieces = []
        end, at_once = self.tau + length, 0
        for _ in range(_MOST_EVENTS):
            mode = self.system.mode(self.state)
            begun, w, phi = self.tau, self.w, self.phi
            ended = self._piece(mode, end - self.tau)
            if self.tau > begun:
                self.pieces.append(FlowPiece(begun, self.tau - begun, w, mode, self.state.copy(), phi))
                at_once = 0
            if ended is None:
                self.tau = end
                return
            at_once += 1
            if at_once > _AT_ONCE or not np.all(np.isfinite(self.w)):
                break
            self._change(mode, ended)
        raise NoMotionError

    # A piece

    def _piece(self, mode: Mode, length: float) -> int | None:
        """Go to the end of a piece; return the condition that ended it, None at the end of the way."""
        steps = steps_of(mode)
        series = taylor(mode, self.w, steps.h)
        values = mode.conditions @ series.T
        order: list[int] | None = _orders(values, np.abs(mode.conditions), series)
        for c, k in enumerate(order or ()):
            if k >= 0 and values[c, k] < 0.0:
                return c
        left = length
        while True:
            states = steps.powers @ self.w
            count, full = len(states) - 1, int(left / steps.h)
            j = min(_first_suspect(mode, steps, states, order), full, count)
            if j < count:
                rest = min(left - j * steps.h, steps.h)
                found = self._root(mode, states[j], steps.h, rest / steps.h, order if j == 0 else None)
                if found is not None or j == full:
                    self._advance(mode, steps, j, rest if found is None else found[1] * steps.h, states[j])
                    return None if found is None else found[0]
                j += 1
            self.w = states[j]
            if self.phi is not None:
                self.phi = steps.powers[j] @ self.phi
            self.tau += j * steps.h
            left -= j * steps.h
            order = None

    def _advance(self, mode: Mode, steps: _Steps, j: int, t: float, here: Real) -> None:
        """Go j steps and a part t of one."""
        self.w = taylor_at(taylor(mode, here, steps.h), t / steps.h)
        self.tau += j * steps.h + t
        if self.phi is not None:
            self.phi = exponential(mode.A * t) @ (steps.powers[j] @ self.phi)

    def _root(
        self, mode: Mode, w: Real, h: float, end: float, order: list[int] | None
    ) -> tuple[int, float] | None:
        """Return the first condition that ends within a step, and where, as a share of it; None: none."""
        values = mode.conditions @ taylor(mode, w, h).T
        earliest: tuple[int, float] | None = None
        sure = values[:, 0] > np.abs(values[:, 1:]) @ end ** np.arange(1, values.shape[1])
        for c, coefficients in enumerate(values):
            k = 0 if order is None else order[c]
            if k < 0 or (k == 0 and sure[c]):
                continue
            t = first_root(coefficients[k:], end if earliest is None else earliest[1])
            if t is not None:
                earliest = c, t
        return earliest

    # An event

    def _change(self, mode: Mode, ended: int) -> None:
        """Change state at the end of a piece, with what that resets, and the derivative."""
        system, (what, which, direction) = self.system, mode.ends[ended]
        row, before = mode.conditions[ended], mode.A @ self.w
        state, resets = self.state.copy(), np.eye(system.nw)
        if what == LIFTS:
            raise LiftsError(which)
        if what == TO_SLIP:
            state.sliders[which] = direction
        elif what == TO_REST:
            if system.rigid[which]:
                state = self._decided(state, [which])
            else:
                state.sliders[which] = STICK
                _at_limit(system, resets, which, direction, mode.limits[which])
        elif what == AT_GAP:
            state.pressed[which] = not state.pressed[which]
        elif what == TO_OPEN:
            state.closed[which] = False
            slider = system.members[which].slider
            if not any(state.closed[i] for i in system.of_slider[slider]):
                state.sliders[slider] = FREE
        elif what == TO_CLOSE:
            state.closed[which] = True
            state = self._closed(mode, state, resets, which)
        after = system.mode(state)
        resets = after.to_rates @ resets
        moved = resets @ self.w
        if self.phi is not None:
            rate = float(row @ before)
            if rate != 0.0:
                jump = resets @ before - after.A @ moved
                self.phi = resets @ self.phi - np.outer(jump, (row @ self.phi) / rate)
            else:
                self.phi = resets @ self.phi
        self.w, self.state = moved, state

    def _closed(self, mode: Mode, state: MemberState, resets: Real, which: int) -> MemberState:
        """Decide what a slider does when a contact of it has closed; its load begins at 0."""
        system, slider = self.system, self.system.members[which].slider
        if state.sliders[slider] != FREE:
            return state
        rate = float(system.d[slider] @ self.w[system.n : 2 * system.n])
        if system.rigid[slider]:
            state.sliders[slider] = 1 if rate >= 0.0 else -1
            return state if rate != 0.0 else self._decided(state, [slider])
        _at_limit(system, resets, slider, 0, np.zeros(system.nw))
        grows = system.members[which].weight * float(mode.loads[which] @ (mode.A @ self.w))
        slips = abs(system.kt[slider] * rate) > grows
        state.sliders[slider] = (1 if rate > 0.0 else -1) if slips else STICK
        return state

    def _decided(self, state: MemberState, which: list[int]) -> MemberState:
        """Decide what rigid sliders at rest do: stick within the limit, or slip the way they are sped up."""
        system = self.system
        resting = which + [i for i, xi in enumerate(state.sliders) if xi == STICK and system.rigid[i]]
        resting = list(dict.fromkeys(resting))
        state.sliders[resting] = STICK
        for _ in range(_PIVOTS + 3 * len(resting)):
            wrong = self._inconsistent(state, resting)
            if wrong is None:
                return state
            state.sliders[wrong[0]] = wrong[1]
        if len(resting) <= _FEW:
            for tried in product((STICK, 1, -1), repeat=len(resting)):
                state.sliders[resting] = tried
                if self._inconsistent(state, resting) is None:
                    return state
        raise NoMotionError

    def _inconsistent(self, state: MemberState, resting: list[int]) -> tuple[int, int] | None:
        """Return the slider at rest whose state is least consistent, with a better one; None if all are."""
        mode, worst, found = self.system.mode(state), _TIE, None
        for i in resting:
            force, limit = float(mode.forces[i] @ self.w), float(mode.limits[i] @ self.w)
            xi = int(state.sliders[i])
            if xi == STICK:
                size = float(np.abs(mode.forces[i]) @ np.abs(self.w))
                beyond, better = abs(force) - limit, 1 if force > 0.0 else -1
            else:
                row = self.system.motion(self.system.d[i], rate=True) @ mode.A
                size = float(np.abs(row) @ np.abs(self.w))
                beyond, better = -xi * float(row @ self.w), STICK
            if beyond > worst * size:
                worst, found = beyond / size, (i, better)
        return found


def _at_limit(system: Piecewise, resets: Real, slider: int, direction: int, limit: Real) -> None:
    """Reset the position of an elastic slider to where a slip leaves it, its limit a row."""
    u = system.motion(system.d[slider])
    resets[system.elastic_at[slider]] = line_left(direction, system.kt[slider], u, limit)


def _orders(values: Real, noise: Real, series: Real) -> list[int]:
    """Return the first Taylor coefficient of every condition that is not rounding; -1: there is none."""
    rounding = _ROUNDING * (noise @ np.abs(series).T).max(axis=1, initial=0.0)
    there = np.abs(values) > rounding[:, None]
    return [int(np.argmax(each)) if each.any() else -1 for each in there]


def _first_suspect(mode: Mode, steps: _Steps, states: Real, order: list[int] | None) -> int:
    """Return the first step in which a condition may end; past the last where none does."""
    if not len(mode.ends):
        return len(states)
    g, slope = states @ mode.conditions.T, states @ steps.rates.T
    # Between two instants the cubic of values and slopes lies above the least of its Bézier ordinates.
    ordinates = np.array([g[:-1], g[:-1] + slope[:-1] / 3.0, g[1:] - slope[1:] / 3.0, g[1:]])
    least = ordinates.min(axis=0)
    suspect = least <= _MARGIN * (ordinates.max(axis=0) - least)
    if order is not None:
        suspect[0] |= np.array(order) != 0
        suspect[:, np.array(order) < 0] = False
    where = np.flatnonzero(suspect.any(axis=1))
    return int(where[0]) if where.size else len(states)


def steps_of(mode: Mode) -> _Steps:
    """Return what a mode needs to be followed, found once."""
    if mode.steps is None:
        fastest = float(np.abs(np.linalg.eigvals(mode.A)).max())
        h = min(TURN / fastest, 2.0 * math.pi / 16)
        nw = len(mode.A)
        count = int(np.clip(_BYTES / (8 * nw * nw), 8, _MOST_STEPS))
        one, powers = exponential(mode.A * h), np.empty((count + 1, nw, nw))
        powers[0] = np.eye(nw)
        for j in range(count):
            powers[j + 1] = one @ powers[j]
        mode.steps = _Steps(h, powers, mode.conditions @ mode.A * h)
    found: _Steps = mode.steps
    return found


def exponential(A: Real) -> Real:
    """Return e^A of a matrix whose eigenvalues are below 1 or so."""
    total = term = np.eye(len(A))
    for k in range(1, DEGREE + 1):
        term = A @ term / k
        total = total + term
    return total


def taylor(mode: Mode, w: Real, h: float) -> Real:
    """Return the Taylor coefficients of the motion from `w` by t / h, (DEGREE + 1, nw)."""
    series = np.empty((DEGREE + 1, w.size))
    series[0] = w
    for k in range(1, DEGREE + 1):
        series[k] = mode.A @ series[k - 1] * (h / k)
    return series


def taylor_at(series: Real, share: float) -> Real:
    """Return the state at a share of the step."""
    return np.asarray(share ** np.arange(DEGREE + 1) @ series)


def first_root(coefficients: Real, end: float) -> float | None:
    """Return the first zero in (0, end] of a polynomial that begins above 0; None if it stays so."""
    t = _SAMPLES * end
    values = np.polynomial.polynomial.polyval(t, coefficients)
    below = np.flatnonzero(values[1:] <= 0.0)
    until = int(below[0]) + 1 if below.size else len(t) - 1
    dips = (
        np.flatnonzero((values[1:until] < values[: until - 1]) & (values[1:until] < values[2 : until + 1]))
        + 1
    )
    slopes = coefficients[1:] * np.arange(1, len(coefficients))
    for at in dips.tolist():
        lowest = _bisected(slopes, float(t[at - 1]), float(t[at + 1]), rising=True)
        if np.polynomial.polynomial.polyval(lowest, coefficients) <= 0.0:
            return _bisected(coefficients, float(t[at - 1]), lowest, rising=False)
    if not below.size:
        return None
    return _bisected(coefficients, float(t[until - 1]), float(t[until]), rising=False)


def _bisected(coefficients: Real, low: float, high: float, *, rising: bool) -> float:
    """Return where a polynomial changes its sign, by bisection and Newton's steps within it."""
    reverse = coefficients[::-1].tolist()
    sign = -1.0 if rising else 1.0
    t = 0.5 * (low + high)
    for _ in range(100):
        value = slope = 0.0
        for c in reverse:
            slope = slope * t + value
            value = value * t + c
        if sign * value > 0.0:
            low = t
        else:
            high = t
        newton = t - value / slope if slope != 0.0 else math.nan
        following = newton if low < newton < high else 0.5 * (low + high)
        if abs(following - t) <= 4e-16 * high or high - low <= 4e-16 * high:
            return following
        t = following
    return t
