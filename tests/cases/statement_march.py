"""The statement of a certificate marched in time with floats: its judge, and the source of forgeries.

Knows the format of certificates and nothing of how they are proved: contacts change their states by the laws
as the motion comes to it, not in the order a certificate has. `wrong` leaves out or spoils one of the laws.
"""

from __future__ import annotations

import math
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.linalg import expm

OPEN, STICK = "open", "stick"
SIGN = {"slip+": 1.0, "slip-": -1.0}
WAY = {1.0: "slip+", -1.0: "slip-"}
STEPS, CHANGES, HARDLY = 200, 60, 1e-12

Guard = tuple[float, str, bool]


class LostError(Exception):
    """The motion was not followed."""


class Motion:
    """w = (x, v, f, 1, cos kωt, sin kωt …) of a statement; between changes of state w' = A w."""

    def __init__(self, raw: dict[str, Any], hertz: float, factor: float = 1.0, wrong: str = "") -> None:
        self.contacts, self.wrong, self.M = raw["contacts"], wrong, np.array(raw["mass"], float)
        self.n, self.m, self.omega = len(self.M), len(self.contacts), 2.0 * math.pi * hertz
        loads = [wave for c in [*raw["forces"], *self.contacts] for wave in c["waves"]]
        self.orders = sorted({order for order, *_ in loads} - {0})
        self.one = 2 * self.n + self.m
        self.d = self.one + 1 + 2 * len(self.orders)
        eye = np.eye(self.d)
        self.x, self.v = eye[: self.n], eye[self.n : 2 * self.n]
        self.f = eye[2 * self.n : self.one]
        self.push = np.zeros((self.n, self.d))
        for ends, terms, k, c in raw["springs"]:
            self.push -= np.outer(self.vector(ends), self.vector(terms) @ (k * self.x + c * self.v))
        for each in raw["forces"]:
            self.push += np.outer(self.vector(each["row"]), self.waves(each["waves"]))
        self.rows = [self.vector(c["row"]) for c in self.contacts]
        self.normals = [self.vector(c["normal"]) for c in self.contacts]
        self.loads = [
            c["kn"] * (normal @ self.x - c["gap"] * eye[self.one])
            + self.waves(c["waves"]) * (factor if c["varies"] else 1.0)
            for c, normal in zip(self.contacts, self.normals, strict=True)
        ]
        if wrong == "steady load":
            self.loads = [row * (np.arange(self.d) <= self.one) for row in self.loads]
        self.observe = self.vector(raw["observe"]) @ self.x
        self.drift = np.zeros((self.d, self.d))
        self.drift[: self.n] = self.v
        for i, order in enumerate(self.orders):
            at = self.one + 1 + 2 * i
            self.drift[at, at + 1], self.drift[at + 1, at] = -order * self.omega, order * self.omega
        self.flow = cache(self._flow)
        self.fast = cache(lambda states: float(np.abs(self.flow(states)[0]).sum(axis=1).max()))
        self.step = cache(lambda states: expm(self.flow(states)[0] * self.period / STEPS))

    @property
    def period(self) -> float:
        return 2.0 * math.pi / self.omega

    def vector(self, terms: Any) -> Any:
        found = np.zeros(self.n)
        for i, factor in terms:
            found[i] += factor
        return found

    def waves(self, waves: Any) -> Any:
        row = np.zeros(self.d)
        for order, amplitude, phase in waves:
            at = self.one if order == 0 else self.one + 1 + 2 * self.orders.index(order)
            row[at] += amplitude * math.cos(phase)
            if order:
                row[at + 1] -= amplitude * math.sin(phase)
        return row

    def first(self, x: Any, v: Any, f: Any, angle: float) -> Any:
        waves = [turn(order * angle) for order in self.orders for turn in (math.cos, math.sin)]
        return np.array([*x, *v, *f, 1.0, *waves])

    def _flow(self, states: tuple[str, ...]) -> tuple[Any, dict[int, Any]]:
        """Return A, and the rows of the forces of what sticks without a spring."""
        A, push, held = self.drift.copy(), self.push.copy(), []
        for j, (c, state) in enumerate(zip(self.contacts, states, strict=True)):
            rate, way = self.loads[j] @ self.drift, SIGN.get(state, 0.0)
            way *= -1.0 if self.wrong == "friction drives" else 1.0
            pressed = self.loads[j] if state != OPEN else 0.0 * self.loads[j]
            pressed = pressed - c["rest"] * np.eye(self.d)[self.one]
            if c["presses"] and self.wrong != "no reaction":
                push -= np.outer(self.normals[j], pressed)
            if not c["row"]:
                continue
            if c["kt"] is None:
                force = way * c["mu"] * self.loads[j]
                held += [j] if state == STICK else []
            else:
                force = self.f[j]
                if state == STICK:
                    A[2 * self.n + j] = c["kt"] * self.rows[j] @ self.v
                elif state in SIGN:
                    A[2 * self.n + j] = way * c["mu"] * rate
            push -= np.outer(self.rows[j], force)
        forces = {}
        if held and self.wrong != "rest without force":
            R = np.array([self.rows[j] for j in held])
            found = np.linalg.solve(R @ np.linalg.solve(self.M, R.T), R @ np.linalg.solve(self.M, push))
            push -= R.T @ found
            forces = dict(zip(held, found, strict=True))
        A[self.n : 2 * self.n] = np.linalg.solve(self.M, push)
        return A, forces

    def guards(self, w: Any, states: tuple[str, ...]) -> list[tuple[int, str, float]]:
        """Return what must not become negative: its contact, what follows then, its value over its size."""
        found, wrong, forces = [], self.wrong, self.flow(states)[1]
        size = 1.0 + float(np.abs(self.push @ w).max())
        for j, (c, state) in enumerate(zip(self.contacts, states, strict=True)):
            load, gap = float(self.loads[j] @ w), not c["row"]
            if state == OPEN:
                if not (gap and wrong == "goes through") and wrong != "stays open":
                    found.append((j, "closes", -load / size))
                continue
            if wrong != "pulls":
                found.append((j, OPEN, load / size))
            if gap:
                continue
            limit, speed = c["mu"] * load, float(self.rows[j] @ w[self.n : 2 * self.n])
            limit *= 0.8 if wrong == "slips early" else 1.0
            if state == STICK:
                force = float(forces[j] @ w if j in forces else w[2 * self.n + j])
                if wrong not in ("never slips", "rest without force"):
                    found += [(j, WAY[s], (limit - s * force) / size) for s in (1.0, -1.0)]
            else:
                way, rate = SIGN[state], float(self.loads[j] @ self.drift @ w)
                if wrong == "slips on" and c["kt"] is not None:
                    continue
                kt = 1.0 if c["kt"] is None else c["kt"]
                rate *= 0.0 if c["kt"] is None else c["mu"]
                found.append(
                    (j, "rests", (way * kt * speed - rate) / (size + kt * abs(w[self.n : 2 * self.n]).max()))
                )
        return found

    def changed(self, w: Any, states: tuple[str, ...], j: int, to: str) -> tuple[Any, tuple[str, ...]]:
        """Return the state after a change, and what w is then."""
        c, wrong = self.contacts[j], self.wrong
        at, speed = 2 * self.n + j, float(self.rows[j] @ w[self.n : 2 * self.n])
        rate = c["mu"] * float(self.loads[j] @ self.drift @ w)
        w = w.copy()
        if to == OPEN and c["row"] and wrong != "holds while open":
            w[at] = 0.0
        if to == "closes":
            to = "closed"
            if c["row"] and c["kt"] is None:
                to = STICK if wrong == "rest without force" else WAY[math.copysign(1.0, speed)]
            elif c["row"]:
                to = STICK if abs(c["kt"] * speed) <= rate else WAY[math.copysign(1.0, speed)]
            if not c["row"] and wrong == "bounces":
                w[self.n : 2 * self.n] *= -0.5
        elif to == "rests":
            to = STICK
            if c["kt"] is None:
                tried = tuple(STICK if k == j else s for k, s in enumerate(states))
                force = float(self.flow(tried)[1][j] @ w) if wrong != "rest without force" else 0.0
                beyond = abs(force) > c["mu"] * float(self.loads[j] @ w)
                if (beyond and wrong != "never slips") or wrong == "turns at once":
                    to = WAY[-SIGN[states[j]] if wrong == "turns at once" else math.copysign(1.0, force)]
            elif wrong == "turns at once":
                to = WAY[-SIGN[states[j]]]
                w[at] *= -1.0
            elif wrong == "forgets":
                w[at] = 0.0
        return w, tuple(to if k == j else s for k, s in enumerate(states))

    def later(self, w: Any, states: tuple[str, ...], length: float) -> Any:
        """Return w a part of a step later."""
        A = self.flow(states)[0]
        if self.fast(states) * length > 2.0:
            return expm(A * length) @ w
        found, term = w, w
        for k in range(1, 40):
            term = A @ term * (length / k)
            found = found + term
            if np.abs(term).max() <= 1e-17 * np.abs(found).max():
                break
        return found

    def run(self, w: Any, states: tuple[str, ...], duration: float) -> tuple[Any, Any, list[Any], list[Any]]:
        """Return w and the states after a time, the changes on the way, and the observed motion."""
        t, changes, seen, h = 0.0, [], [], self.period / STEPS
        while t < duration * (1.0 - 1e-13):
            length = min(h, duration - t)
            after = self.step(states) @ w if length == h else self.later(w, states, length)
            if self.least(after, states)[2] < -HARDLY:
                low, high = 0.0, length
                if self.least(w, states)[2] < -HARDLY:
                    high = 0.0
                while high - low > 1e-15 * self.period:
                    middle = 0.5 * (low + high)
                    below = self.least(self.later(w, states, middle), states)[2] < -HARDLY
                    low, high = (low, middle) if below else (middle, high)
                w, t = self.later(w, states, high), t + high
                j, to, _ = self.least(w, states)
                if self.least(w, states)[2] >= -HARDLY:
                    continue
                w, states = self.changed(w, states, j, to)
                changes.append((t, j, states[j], self.observe @ w))
                if len(changes) > CHANGES * max(1.0, duration / self.period):
                    raise LostError("too many changes")
            else:
                w, t = after, t + length
            seen.append((self.observe @ w, self.observe[: self.n] @ w[self.n : 2 * self.n], t))
        return w, states, changes, seen

    def least(self, w: Any, states: tuple[str, ...]) -> tuple[int, str, float]:
        return min(self.guards(w, states), key=lambda each: each[2], default=(0, "", 1.0))


def extremes(seen: list[Any]) -> tuple[float, float]:
    """Return the least and the most of a motion from values and speeds, by cubics between."""
    low, high = (turn(each[0] for each in seen) for turn in (min, max))
    for (a, va, s), (b, vb, t) in pairwise(seen):
        if va * vb < 0.0 and t > s:
            at = np.linspace(0.0, 1.0, 33)
            h00, h10 = (1 + 2 * at) * (1 - at) ** 2, at * (1 - at) ** 2
            h01, h11 = at**2 * (3 - 2 * at), at**2 * (at - 1)
            cubic = h00 * a + h10 * (t - s) * va + h01 * b + h11 * (t - s) * vb
            low, high = min(low, float(cubic.min())), max(high, float(cubic.max()))
    return low, high


def middle(text: str) -> float:
    """Return the middle of a ball that is written."""
    return float(text.strip("[]").split(" +/- ")[0])


def judged(raw: dict[str, Any], within: float = 1e-5) -> str:
    """Return what is false of a certificate, marched for a period from where its orbit begins, or nothing."""
    system, orbit, proof, factor = raw["system"], raw["orbit"], raw["proof"], 1.0
    while "three" in proof:
        proof = proof["three"][1]
    claims = {key: [float(end) for end in span] for key, span in raw["claims"].items()}
    hertz = system["frequency_hz"] or 1.0
    if "frequency_hz" in proof and "unknowns" not in raw["proof"]:
        hertz, factor = middle(proof["frequency_hz"]), middle(proof.get("load_factor", "1"))
    motion = Motion(system, hertz, factor)
    n, known, contacts = motion.n, {}, system["contacts"]
    known |= {2 * n + int(j): value for j, value in orbit["fixed_forces"].items()}
    known |= dict([orbit["pinned"]]) if "pinned" in orbit else {}
    moved, start, at = {each["contact"] for each in orbit["events"]}, np.zeros(2 * n + motion.m), 0
    sprung = [j for j, c in enumerate(contacts) if c["kt"]]
    order = [j for j in sprung if j in moved and not _follows(contacts, orbit["events"], j)]
    order += [j for j in sprung if j not in moved and orbit["states"][j] == STICK]
    for place in (*range(2 * n), *(2 * n + j for j in order)):
        if place in known:
            start[place] = known[place]
        else:
            start[place], at = middle(proof["unknowns"][at]), at + 1
    for j in sprung:
        if j in moved and j not in order:
            a = _follows(contacts, orbit["events"], j)[0]
            same = contacts[a]["row"] == contacts[j]["row"]
            start[2 * n + j] = start[2 * n + a] * (1.0 if same else -1.0)
    if system["frequency_hz"] is None:
        hertz = 1.0 / sum(middle(each) for each in proof["unknowns"][at:])
        motion.omega = 2.0 * math.pi * hertz
    w = motion.first(start[:n], start[n : 2 * n], start[2 * n :], orbit["begins"])
    states, size = tuple(orbit["states"]), np.abs(start).max()
    if (worst := motion.least(w, states))[2] < -1e-7:
        return f"it begins where {worst} does not hold"
    for j, c in enumerate(contacts):
        load, force = float(motion.loads[j] @ w), float(w[2 * n + j])
        if (
            states[j] in SIGN
            and c["kt"]
            and abs(force - SIGN[states[j]] * c["mu"] * load) > 1e-6 * (size + abs(load))
        ):
            return f"{c['name']} slips with another force"
        if c["row"] and states[j] == OPEN and abs(force) > 1e-6 * size:
            return f"{c['name']} has a force while it is open"
        if c["kt"] is None and states[j] == STICK and abs(motion.rows[j] @ w[n : 2 * n]) > 1e-7 * size:
            return f"{c['name']} moves while it sticks"
    try:
        after, _, _, seen = motion.run(w, states, motion.period)
    except LostError as error:
        return str(error)
    scale = np.maximum(
        np.abs(w),
        [np.abs(w[:n]).max()] * n + [np.abs(w[n : 2 * n]).max()] * n + [1e-3 * size] * (len(w) - 2 * n),
    )
    off = float((np.abs(after - w) / (scale + 1e-300)).max())
    if off > 1e3 * within:
        return f"after a period it is off by {off:.1e}"
    low, high = extremes([(motion.observe @ w, motion.observe[:n] @ w[n : 2 * n], 0.0), *seen])
    found = {"max_abs": max(high, -low), "half_peak_to_peak": 0.5 * (high - low), "frequency_hz": hertz}
    found |= {"peak": found["max_abs"], "least_peak": found["max_abs"], "load_factor": factor}
    for key, (least, most) in claims.items():
        if not least - within * abs(least) <= found[key] <= most + within * abs(most):
            return f"{key} is {found[key]!r}, not within {least} to {most}"
    return ""


def _follows(contacts: list[Any], events: list[Any], j: int) -> list[int]:
    """Return the contact like j whose events those of j follow at once, in a list, or none."""
    before = {events[i - 1]["contact"] for i, each in enumerate(events) if each["contact"] == j and i}
    if len(before) != 1 or events[0]["contact"] == j:
        return []
    (a,) = before
    one, other = ({key: value for key, value in contacts[k].items() if key != "name"} for k in (a, j))
    turned = one | {"row": [[at, -factor] for at, factor in one["row"]]}
    count = [sum(each["contact"] == k for each in events) for k in (a, j)]
    return [a] if other in (one, turned) and count[0] == count[1] else []


def forged(raw: dict[str, Any], wrong: str = "", periods: int = 18, radius: float = 1e-9) -> dict[str, Any]:
    """Return a certificate for a system, of what its motion becomes where one law is wrong."""
    motion = Motion(raw, raw["frequency_hz"], wrong=wrong)
    n, states = motion.n, tuple("open" if not c["row"] else STICK for c in motion.contacts)
    w = motion.first(np.zeros(n), np.zeros(n), np.zeros(motion.m), 0.0)
    for j in range(motion.m):
        load = float(motion.loads[j] @ w)
        word = OPEN if load < 0.0 else STICK if motion.contacts[j]["row"] else "closed"
        states = tuple(word if k == j else s for k, s in enumerate(states))
    w, states, *_ = motion.run(w, states, periods * motion.period)
    _, _, changes, _ = motion.run(w, states, motion.period)
    times = [0.0, *(t for t, *_ in changes), motion.period]
    k = int(np.argmax(np.diff(times)))
    w, states, *_ = motion.run(w, states, 0.5 * (times[k] + times[k + 1]))
    begun, word = w, states
    _, ended, changes, seen = motion.run(w, states, motion.period)
    if ended != word:
        raise LostError("it does not repeat")
    angle = math.atan2(begun[motion.one + 2], begun[motion.one + 1]) if motion.orders[0] == 1 else 0.0
    moved = sorted({j for _, j, *_ in changes if motion.contacts[j]["kt"]})
    stuck = [j for j, c in enumerate(motion.contacts) if c["kt"] and word[j] == STICK and j not in moved]
    values = [*begun[: 2 * n], *(begun[2 * n + j] for j in moved)]
    lengths = np.diff([0.0, *(t for t, *_ in changes)])
    sizes = [np.abs(begun[:n]).max()] * n + [np.abs(begun[n : 2 * n]).max()] * n
    sizes += [np.abs(begun[2 * n : motion.one]).max() or 1.0] * len(moved) + [motion.period] * len(lengths)
    low, high = extremes(seen)
    top = max(high, -low)
    return {
        "bits": 128, "system": raw,
        "orbit": {
            "begins": angle, "states": list(word),
            "events": [{"contact": j, "to": to} for _, j, to, _ in changes],
            "fixed_forces": {str(j): float(begun[2 * n + j]) for j in stuck},
        },
        "proof": {"unknowns": [
            f"{value:.17e} +/- {radius * size:.3e}"
            for value, size in zip([*values, *lengths], sizes, strict=True)
        ]},
        "claims": {"max_abs": [f"{top * (1 - 1e-5):.12e}", f"{top * (1 + 1e-5):.12e}"]},
    }  # fmt: skip
