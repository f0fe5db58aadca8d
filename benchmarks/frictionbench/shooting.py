"""Exact events in extended precision: a periodic orbit of a piecewise linear system, enclosed.

State w = (x, dx/dτ, slider positions s, 1, cos kτ, sin kτ, …): in every mode of the contacts dw/dτ = A w,
stick f = kt (u - s), slip f = ξ μN, open 0, gap k (u - gap). A march in floats finds the order of the events;
the first state and the instants of the events are then the zero of as many equations (each condition 0 at its
event, the state back after a period), by Newton's method and Krawczyk's operator (R. Krawczyk, Computing 4
(1969) 187; A. Neumaier, Interval Methods, 1990, ch. 5) on matrix exponentials in python-flint's balls. The
march from the zero must have the same events at the same instants, else it is no motion.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from flint import arb, arb_mat, ctx
from scipy.linalg import expm

from benchmarks.frictionbench.model import Model

STICK, OPEN, CLOSE = 0, 2, 3  # slip is its sign; of a gap 0 is open, 1 closed
LEVELS, BITS, TRIES, PERIODS = 44, 256, 40, 12
_Row = dict[int, Any]


class NoOrbitError(Exception):
    """No periodic orbit was found, or it could not be enclosed."""


@dataclass(slots=True)
class Orbit:
    """Order of events [(row, old, new)], first mode, unknowns; fixed sliders of what sticks throughout."""

    start: float
    mode: tuple[int, ...]
    events: list[tuple[int, int, int]]
    free: list[int]
    fixed: dict[int, float]
    unknowns: list[Any]
    span: float
    free_running: bool = False  # the period is unknown: it ends with the last event


class System:
    """Rows of A and of the conditions of a model at one frequency, in balls."""

    def __init__(self, model: Model, omega: Any, changes: dict[str, Any] | None = None) -> None:
        """Take ω [rad/s], a float or a ball; `changes` sets N0 of rows by the contact's name."""
        self.model, self.omega, n = model, arb(omega), len(model.M)
        self.harmonics = sorted({1} | {k for *_, k in model.loads})
        self.n, self.one = n, 2 * n + len(model.rows)
        self.size = self.one + 1 + 2 * len(self.harmonics)
        self._A: dict[Any, arb_mat] = {}
        self._floats: dict[Any, Any] = {}
        inverse = arb_mat(model.M.tolist()).inv()
        self.inverse = [[(j, inverse[i, j]) for j in range(n) if inverse[i, j] != 0] for i in range(n)]
        self.u = [_sparse(row.b) for row in model.rows]
        self.loads: list[_Row] = []
        for row in model.rows:
            mean = (changes or {}).get(row.name, row.N0)
            load: _Row = {self.one: arb(mean)}
            if row.N1:
                phase = arb(row.phase)
                load[self.one + 1], load[self.one + 2] = arb(row.N1) * phase.cos(), -arb(row.N1) * phase.sin()
            if row.kn and row.n is not None:
                load.update({i: arb(row.kn) * q for i, q in _sparse(row.n).items()})
            self.loads.append(load)

    def angle(self, tau: Any) -> list[Any]:
        """Return 1, cos kτ, sin kτ."""
        return [arb(1), *(f for k in self.harmonics for f in ((k * tau).cos(), (k * tau).sin()))]

    def force(self, r: int, mode: int) -> _Row:
        """Return the row of a contact's force in its mode; of what is rigid and sticks nothing."""
        row = self.model.rows[r]
        if row.law == "gap":
            if mode == 0:
                return {}
            return {i: arb(row.kt) * q for i, q in self.u[r].items()} | {
                self.one: -arb(row.kt) * arb(row.gap)
            }
        if mode == OPEN or (mode == STICK and math.isinf(row.kt)):
            return {}
        if mode == STICK:
            return {i: arb(row.kt) * q for i, q in self.u[r].items()} | {2 * self.n + r: -arb(row.kt)}
        return {i: mode * arb(row.mu) * q for i, q in self.loads[r].items()}

    def push(self, mode: tuple[int, ...]) -> list[_Row]:
        """Return the force on every DOF."""
        model, n = self.model, self.n
        rows: list[_Row] = [{} for _ in range(n)]
        for i in range(n):
            for j in range(n):
                if model.K[i, j] or model.C[i, j]:
                    _add(rows[i], {j: -arb(model.K[i, j]), n + j: -self.omega * arb(model.C[i, j])})
        for dof, amplitude, phase, k in model.loads:
            at = self.one + 1 + 2 * self.harmonics.index(k)
            p, a = arb(phase), arb(amplitude)
            _add(rows[dof], {at: a * p.cos(), at + 1: -a * p.sin()})
        for r, row in enumerate(model.rows):
            for i, q in self.u[r].items():
                _add(rows[i], self.force(r, mode[r]), -q)
            if row.kn and row.reacts and row.n is not None and mode[r] != OPEN:
                for i, q in _sparse(row.n).items():
                    _add(rows[i], self.loads[r], -q)
        return rows

    def A(self, mode: tuple[int, ...]) -> arb_mat:
        """Return the matrix of a mode."""
        key = (mode, ctx.prec)
        if key not in self._A:
            made, n, push = arb_mat(self.size, self.size), self.n, self.push(mode)
            held = [self._held(r) for r, m in enumerate(mode) if m == STICK and self._rigid(r)]
            for i in range(n):
                made[i, n + i] = 1
                if i not in held:
                    total: _Row = {}
                    for j, q in self.inverse[i]:
                        _add(total, push[j], q / self.omega**2)
                    for column, q in total.items():
                        made[n + i, column] = q
            for k, h in enumerate(self.harmonics):
                at = self.one + 1 + 2 * k
                made[at, at + 1], made[at + 1, at] = -h, h
            self._A[key] = made
        return self._A[key]

    def _rigid(self, r: int) -> bool:
        return math.isinf(self.model.rows[r].kt)

    def _held(self, r: int) -> int:
        """Return the DOF that a rigid contact holds to the ground."""
        (held,) = self.u[r]
        return held

    def rate(self, row: _Row, mode: tuple[int, ...]) -> _Row:
        """Return the row of the derivative."""
        A, found = self.A(mode), {}
        for i, q in row.items():
            _add(found, {j: A[i, j] for j in range(self.size) if A[i, j] != 0}, q)
        return found

    def conditions(self, mode: tuple[int, ...]) -> list[tuple[int, _Row, int]]:
        """Return (row, what is positive on the piece, the mode that follows its zero)."""
        found: list[tuple[int, _Row, int]] = []
        for r, row in enumerate(self.model.rows):
            m, load = mode[r], _add({}, self.loads[r], arb(row.mu))
            if row.law == "gap":
                opened = _add({self.one: -arb(row.gap)}, self.u[r])
                found.append((r, _add({}, opened, 1 if m == 1 else -1), 1 - m))
            elif m == STICK:
                held = self.push(mode)[self._held(r)] if self._rigid(r) else self.force(r, STICK)
                found += [(r, _add(dict(load), held, -sign), sign) for sign in (1, -1)]
            elif m == OPEN:
                found.append((r, _add({}, load, -1), CLOSE))
            else:
                slip = {self.n + i: m * q for i, q in self.u[r].items()}
                if not self._rigid(r):
                    slip = _add(_add({}, slip, arb(row.kt)), self.rate(load, mode), -1)
                found.append((r, slip, STICK))
                if row.kn or row.N1:
                    found.append((r, dict(load), OPEN))
        return found

    def reset(self, r: int, old: int) -> _Row:
        """Return the slider position with which sticking begins: s = u - f / kt."""
        row, found = self.model.rows[r], dict(self.u[r])
        if old != OPEN:
            _add(found, self.loads[r], -old * arb(row.mu) / arb(row.kt))
        return found

    def tied(self, events: list[tuple[int, int, int]]) -> list[bool]:
        """Return which events share the instant of the one before: parallel sliders turn together."""
        rows = self.model.rows
        return [
            i > 0
            and new == STICK == events[i - 1][2]
            and not any(rows[q].N1 or rows[q].kn for q in (r, events[i - 1][0]))
            and bool(np.array_equal(abs(rows[r].b), abs(rows[events[i - 1][0]].b)))
            for i, (r, _, new) in enumerate(events)
        ]

    # ---- in floats
    def floats(
        self, mode: tuple[int, ...], h: float
    ) -> tuple[list[np.ndarray], np.ndarray, list[tuple[int, int]]]:
        """Return exp(A h / 2^k), the conditions as a matrix, and what follows each."""
        if (mode, h) not in self._floats:
            A, G = _floats(self.A(mode)), np.zeros((0, self.size))
            conditions = self.conditions(mode)
            G = np.zeros((len(conditions), self.size))
            for g, (_, row, _) in zip(G, conditions, strict=True):
                for i, q in row.items():
                    g[i] = float(q)
            steps = [expm(A * h / 2**k) for k in range(LEVELS)]
            self._floats[mode, h] = steps, G, [(r, new) for r, _, new in conditions]
        return self._floats[mode, h]  # type: ignore[no-any-return]

    def march(
        self, w: np.ndarray, mode: tuple[int, ...], tau: float, span: float, steps: int
    ) -> tuple[np.ndarray, tuple[int, ...], list[tuple[Any, ...]]]:
        """March in floats, by halves of a step up to an event: (instant, row, old, new, state after it)."""
        h, events = span / steps, []
        for step in range(steps):
            left, k, last = 1.0, 0, None
            while k < LEVELS:
                powers, G, follows = self.floats(mode, h)
                if left < 2.0**-k:
                    k += 1
                    continue
                ahead = powers[k] @ w
                margin = G @ ahead + 3e-13 * (abs(G) @ abs(ahead))
                if margin.size and margin.min() < 0.0:
                    last = follows[int(np.argmin(margin / (abs(G) @ abs(ahead) + 1e-300)))]
                    k += 1
                else:
                    w, left = ahead, left - 2.0**-k
                if k == LEVELS and last is not None:
                    w, mode, old = self._switch(w, mode, last)
                    events.append((tau + (step + 1 - left) * h, last[0], old, mode[last[0]], (w, mode)))
                    k, last = 0, None
                    if len(events) > 800:
                        raise NoOrbitError("more than 800 events")
            w[self.one :] = [float(v) for v in self.angle(arb(tau + (step + 1) * h))]
        return w, mode, events

    def turned(self, w: np.ndarray, mode: tuple[int, ...]) -> tuple[np.ndarray, tuple[int, ...]]:
        """Return the state after a share of the period with its sectors renumbered, as it is at τ = 0."""
        n, found, modes = self.n, w.copy(), list(mode)
        turn, row_turn = self.model.turn, self.model.row_turn
        found[turn], found[n + turn], found[2 * n + row_turn] = w[:n], w[n : 2 * n], w[2 * n : self.one]
        for r, to in enumerate(row_turn):
            modes[to] = mode[r]
        found[self.one :] = [float(v) for v in self.angle(arb(0))]
        return found, tuple(modes)

    def _switch(
        self, w: np.ndarray, mode: tuple[int, ...], to: tuple[int, int]
    ) -> tuple[np.ndarray, tuple[int, ...], int]:
        r, new = to
        row, old = self.model.rows[r], mode[r]
        value = lambda sparse: sum(float(q) * w[i] for i, q in sparse.items())  # noqa: E731
        if new == CLOSE:
            drive = row.kt * sum(float(q) * w[self.n + i] for i, q in self.u[r].items())
            allowed = row.mu * value(self.rate(self.loads[r], mode))
            new = STICK if abs(drive) < allowed else (1 if drive > 0 else -1)
        if new == STICK and row.law != "gap":
            if self._rigid(r):
                w = w.copy()
                w[self.n + self._held(r)] = 0.0
                held = value(self.push((*mode[:r], STICK, *mode[r + 1 :]))[self._held(r)])
                if abs(held) > row.mu * value(self.loads[r]):
                    new = 1 if held > 0 else -1
            else:
                w = w.copy()
                w[2 * self.n + r] = value(self.reset(r, old))
        return w, (*mode[:r], new, *mode[r + 1 :]), old

    def rest(self) -> tuple[np.ndarray, tuple[int, ...]]:
        """Return the state and mode of rest at τ = 0."""
        w = np.zeros(self.size)
        w[self.one :] = [float(v) for v in self.angle(arb(0))]
        closed = [sum(float(q) * w[i] for i, q in load.items()) > 0 for load in self.loads]
        return w, tuple(
            (1 if row.gap < 0 else 0) if row.law == "gap" else STICK if on else OPEN
            for row, on in zip(self.model.rows, closed, strict=True)
        )

    # ---- in balls
    def shoot(self, orbit: Orbit, Y: list[Any], pieces: list[Any] | None = None) -> tuple[arb_mat, arb_mat]:
        """Return what the equations leave and their Jacobian; `pieces` collects (mode, state, begin, end)."""
        n, m = self.n, len(self.model.rows)
        tied = self.tied(orbit.events)
        first = 2 * n + len(orbit.free)
        slot, at = [], first - 1
        for same in tied:
            at += not same
            slot.append(at)
        size = len(Y)
        w, D = arb_mat(self.size, 1), arb_mat(self.size, size)
        for place, i in enumerate([*range(2 * n), *(2 * n + r for r in orbit.free)]):
            w[i, 0], D[i, place] = Y[place], 1
        for r, value in orbit.fixed.items():
            w[2 * n + r, 0] = arb(value)
        start = arb(orbit.start)
        for i, value in enumerate(self.angle(start)):
            w[self.one + i, 0] = value
        end = start + 2 * arb.pi() / round(1 / orbit.span)
        left, jacobian, mode, ta, ia = [], [], orbit.mode, start, None
        for i in range(len(orbit.events) + 1):
            last = i == len(orbit.events)
            if last and orbit.free_running:
                break
            if last or not tied[i]:
                ib = None if last else slot[i]
                tb = end if ib is None else Y[ib]
                if pieces is not None:
                    pieces.append((mode, w, ta, tb))
                A = self.A(mode)
                E = (A * (tb - ta)).exp()
                slope = E * (A * w)
                w, D = E * w, E * D
                ahead = A * w
                for j in range(self.size):
                    if ia is not None:
                        D[j, ia] = D[j, ia] - slope[j, 0]
                    if ib is not None:
                        D[j, ib] = D[j, ib] + ahead[j, 0]
                ta, ia = tb, ib
            if last:
                break
            r, old, new = orbit.events[i]
            if not tied[i]:
                row = self._condition(mode, r, new)
                left.append(_value(row, w))
                jacobian.append([_dot(row, D, c) for c in range(size)])
            if new == STICK and self.model.rows[r].law != "gap" and not self._rigid(r):
                row = self.reset(r, old)
                value, slopes = _value(row, w), [_dot(row, D, c) for c in range(size)]
                w[2 * n + r, 0] = value
                for c in range(size):
                    D[2 * n + r, c] = slopes[c]
            mode = (*mode[:r], new, *mode[r + 1 :])
        turn, row_turn = self.model.turn, self.model.row_turn
        goes = {i: int(turn[i]) for i in range(n)} | {n + i: n + int(turn[i]) for i in range(n)}
        goes |= {2 * n + r: 2 * n + int(row_turn[r]) for r in range(m)}
        places = {i: p for p, i in enumerate([*range(2 * n), *(2 * n + r for r in orbit.free)])}
        for i, to in goes.items():
            if to in places:
                left.append(w[i, 0] - Y[places[to]])
                jacobian.append([D[i, c] - (c == places[to]) for c in range(size)])
        return arb_mat(size, 1, left), arb_mat(jacobian)

    def _condition(self, mode: tuple[int, ...], r: int, new: int) -> _Row:
        follow = [(row, to) for q, row, to in self.conditions(mode) if q == r]
        opening = mode[r] == OPEN
        # A rigid contact that turns at once leaves slip by the same zero of its velocity as one that sticks.
        wanted = CLOSE if opening else STICK if self._rigid(r) and mode[r] and new != OPEN else new
        return next(row for row, to in follow if to == wanted)


def find(system: System, guess: tuple[np.ndarray, tuple[int, ...]] | None = None) -> Orbit:
    """March from rest, or from a guess, until Newton's method on the events of the last period holds.

    Raises
    ------
    NoOrbitError
        Nothing repeated after some hundred periods.
    """
    before, ctx.prec = ctx.prec, 128
    try:
        w, mode = guess or system.rest()
        share = system.model.share
        span = 2.0 * math.pi * share
        steps = max(60, int(share * max(600, 16 * _stiffest(system))))
        pause = 0 if guess else PERIODS
        for _ in range(TRIES):
            for _ in range(pause):
                w, mode, _ = system.march(w, mode, 0.0, span, steps)
                w, mode = system.turned(w, mode)
            ahead, mode2, events = system.march(w.copy(), mode, 0.0, span, steps)
            orbit = _orbit(system, w, mode, events, share)
            if (
                system.turned(ahead, mode2)[1] == mode
                and _converges(system, orbit)
                and _is_motion(system, orbit, steps)
            ):
                return orbit
            pause = max(pause, 1) + 5
        raise NoOrbitError("nothing repeats: no order of events was confirmed")
    finally:
        ctx.prec = before


def find_cycle(system: System, start: float, settle: int) -> Orbit:
    """March without forces from a displacement of the observed DOF; return the cycle between like events.

    Raises
    ------
    NoOrbitError
        It moves on, or Newton's method does not end.
    """
    w, mode = system.rest()
    w[system.model.seen] = start
    for r, row in enumerate(system.model.rows):
        motion, most = float(row.b @ w[: system.n]), row.mu * row.N0 / row.kt
        w[2 * system.n + r] = motion - float(np.clip(motion, -most, most)) if row.law != "gap" else 0.0
        if row.law == "gap":
            mode = (*mode[:r], int(motion > row.gap), *mode[r + 1 :])
    steps, turn = max(600, int(16 * _stiffest(system))), 2.0 * math.pi
    for _ in range(settle):
        w, mode, _ = system.march(w, mode, 0.0, turn, steps)
    *_, events = system.march(w, mode, 0.0, 2.2 * turn, 2 * steps)
    first = next((e for e in events if e[3] == STICK and system.model.rows[e[1]].law != "gap"), None)
    if first is None:
        raise NoOrbitError("nothing slips")
    after = events[events.index(first) + 1 :]
    again = next((i for i, e in enumerate(after) if e[1:4] == first[1:4]), None)
    if again is None:
        raise NoOrbitError("no event happens twice")
    period = [(t - first[0], *rest) for t, *rest in after[: again + 1]]
    orbit = _orbit(system, *first[4], period, 1.0)
    orbit.free_running = True
    if not _converges(system, orbit):
        raise NoOrbitError("Newton's method does not end")
    return orbit


def _orbit(system: System, w: np.ndarray, mode: tuple[int, ...], events: list[Any], share: float) -> Orbit:
    n, moved = system.n, {r for _, r, *_ in events}
    turn = [int(t) for t in system.model.row_turn]
    # In a travelling wave a row repeats what another does: it moves if any of its orbit moves.
    for _ in mode:
        moved |= {turn[r] for r in moved}
    friction = [r for r, row in enumerate(system.model.rows) if row.law != "gap" and not math.isinf(row.kt)]
    free = [r for r in friction if r in moved and mode[r] == STICK]
    fixed = {r: float(w[2 * n + r]) for r in friction if r not in moved}
    order = [(r, old, new) for _, r, old, new, _ in events]
    times = [arb(t) for (t, *_), same in zip(events, system.tied(order), strict=True) if not same]
    unknowns = [*(arb(float(v)) for v in w[: 2 * n]), *(arb(float(w[2 * n + r])) for r in free), *times]
    return Orbit(0.0, mode, order, free, fixed, unknowns, share)


def _converges(system: System, orbit: Orbit) -> bool:
    try:
        return polish(system, orbit, 14, 1e-20)
    except (ZeroDivisionError, ValueError):
        return False


def polish(system: System, orbit: Orbit, most: int = 12, to: float = 1e-60) -> bool:
    """Take Newton's steps until the last is below `to` of the unknowns; False if they do not end there."""
    Y, n = orbit.unknowns, 2 * system.n + len(orbit.free)
    for _ in range(most):
        left, J = system.shoot(orbit, Y)
        step = J.mid().solve(left.mid())
        Y = [(y - step[i, 0]).mid() for i, y in enumerate(Y)]
        largest = max([abs(float(y)) for y in Y[:n]], default=1.0) or 1.0
        size = max(abs(float(step[i, 0])) / (largest if i < n else 1.0) for i in range(len(Y)))
        if not math.isfinite(size) or size > 1e8:
            return False
        if size < to:
            orbit.unknowns = Y
            return True
    return False


def _is_motion(system: System, orbit: Orbit, steps: int) -> bool:
    """Tell whether a march in floats from the zero has the same events at the same instants."""
    n, Y = system.n, orbit.unknowns
    w, _ = system.rest()
    w[: 2 * n] = [float(y) for y in Y[: 2 * n]]
    for place, r in enumerate(orbit.free):
        w[2 * n + r] = float(Y[2 * n + place])
    for r, value in orbit.fixed.items():
        w[2 * n + r] = value
    try:
        _, _, events = system.march(w, orbit.mode, 0.0, 2.0 * math.pi * orbit.span, steps)
    except NoOrbitError:
        return False
    tied, at, times = system.tied(orbit.events), 2 * n + len(orbit.free) - 1, []
    for same in tied:
        at += not same
        times.append(float(Y[at]))
    found = sorted((round(t, 5), r, new) for t, r, _, new, _ in events)
    told = sorted((round(t, 5), r, new) for t, (r, _, new) in zip(times, orbit.events, strict=True))
    return len(found) == len(told) and all(
        a[1:] == b[1:] and abs(a[0] - b[0]) < 3e-5
        for a, b in zip(
            sorted(found, key=lambda e: e[1:] + e[:1]), sorted(told, key=lambda e: e[1:] + e[:1]), strict=True
        )
    )


def enclose(system: System, orbit: Orbit) -> list[Any]:
    """Return a box that holds exactly one zero of the equations, by Krawczyk's operator.

    Raises
    ------
    NoOrbitError
        The operator does not map the box into itself: not isolated, or grazing.
    """
    if not polish(system, orbit):
        raise NoOrbitError("Newton's method does not end at full precision")
    Y = orbit.unknowns
    left, J = system.shoot(orbit, Y)
    P, size = J.mid().inv().mid(), len(Y)
    new = P * left
    X = []
    for i, y in enumerate(Y):
        radius = 4 * abs(new[i, 0]).upper() + (abs(y).upper() + 1) * arb(2) ** (-3 * ctx.prec // 4)
        X.append(y + arb(0, radius.upper().mid()))
    _, JX = system.shoot(orbit, X)
    one = arb_mat(size, size)
    for i in range(size):
        one[i, i] = 1
    box = arb_mat(size, 1, [x - y for x, y in zip(X, Y, strict=True)])
    K = (one - P * JX) * box - new
    if not all((X[i] - Y[i]).contains_interior(K[i, 0]) for i in range(size)):
        raise NoOrbitError("Krawczyk's operator does not map the box into itself")
    return [y + K[i, 0] for i, y in enumerate(Y)]


def extremes(system: System, orbit: Orbit, X: list[Any]) -> tuple[Any, Any]:
    """Return the greatest and the least of the observed DOF over a period, as balls."""
    pieces: list[Any] = []
    system.shoot(orbit, X, pieces)
    found: list[list[Any]] = [[], []]
    rough: list[list[Any]] = [[], []]
    for mode, w, ta, tb in pieces:
        A = _floats(system.A(mode))
        z, length = np.array([float(w[i, 0]) for i in range(system.size)]), float(tb - ta)
        many = max(4, int(40 * length * _stiffest(system) / 2.0) if length > 0 else 4)
        step = expm(A * length / many)
        for k in range(many + 1):
            for copy in system.model.copies:
                for side, sign in enumerate((1.0, -1.0)):
                    rough[side].append((sign * z[copy], mode, w, length * k / many, copy))
            z = step @ z
    for side, sign in enumerate((1, -1)):
        best = sorted(rough[side], key=lambda one: -one[0])[:3]
        found[side] = [sign * _turning(system, *one[1:]) for one in best]
    greatest, least = found[0][0], found[1][0]
    for high in found[0][1:]:
        greatest = greatest.max(high)
    for low in found[1][1:]:
        least = least.max(low)
    return greatest, -least


def _turning(system: System, mode: tuple[int, ...], w: arb_mat, t: float, dof: int) -> Any:
    """Return x where its velocity is 0 near an instant of a piece; there t counts in second order only."""
    A, at = system.A(mode), arb(t)
    for _ in range(60):
        ahead = (A * at).exp() * w
        v, a = ahead[system.n + dof, 0], (A * ahead)[system.n + dof, 0]
        step = (v.mid() / a.mid()).mid()
        if not abs(float(step)) < 0.3:
            return ahead[dof, 0]
        at = (at - step).mid()
        if abs(float(step)) < 1e-35:
            break
    ahead = (A * at).exp() * w
    v, a = ahead[system.n + dof, 0], (A * ahead)[system.n + dof, 0]
    return ahead[dof, 0] + arb(0, (4 * v * v / abs(a)).upper().mid() if not a.contains(0) else 0)


def _stiffest(system: System) -> float:
    """Return the highest natural frequency over that of the excitation, all contacts stuck."""
    model = system.model
    K = model.K.copy()
    for row in model.rows:
        K += 0.0 if math.isinf(row.kt) else row.kt * np.outer(row.b, row.b)
        if row.kn and row.n is not None:
            K += row.kn * np.outer(row.n, row.n)
    values = np.linalg.eigvals(np.linalg.solve(model.M, K)).real
    return math.sqrt(max(values.max(), 0.0)) / float(system.omega)


def _sparse(b: np.ndarray) -> _Row:
    return {int(i): arb(float(b[i])) for i in np.flatnonzero(b)}


def _add(to: _Row, row: _Row, factor: Any = 1) -> _Row:
    for i, q in row.items():
        to[i] = to.get(i, arb(0)) + factor * q
    return to


def _value(row: _Row, w: arb_mat) -> Any:
    return sum((q * w[i, 0] for i, q in row.items()), arb(0))


def _dot(row: _Row, D: arb_mat, column: int) -> Any:
    return sum((q * D[i, column] for i, q in row.items()), arb(0))


def _floats(A: arb_mat) -> np.ndarray:
    return np.array([[float(A[i, j].mid()) for j in range(A.ncols())] for i in range(A.nrows())])
