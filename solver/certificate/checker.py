"""Check a certificate of a periodic orbit of a piecewise linear system: python checker.py CERTIFICATE.json

Stands alone: it needs python-flint (`pip install python-flint`) and nothing of the package it comes with.
What is stated is in docs/certificates.md. The state is w = (x, dx/dτ, sliders, 1, cos kτ, sin kτ, …) in the
angle τ = ωt, so that w' = A w whatever the contacts do. With balls that enclose every rounding it is shown
that Krawczyk's operator maps the box of the unknowns (first state, instants of events, states that are
unknown anew) into its interior: exactly one orbit with these events is in it; that every inequality of the
contacts' laws holds between events, so that no other happens and these cross; and where the extremes of the
observed motion lie. A gap is a contact without friction, its load k (u - gap). (R. Krawczyk, Computing 4
(1969) 187.)
"""

import json
import math
import sys
from typing import Any

from flint import arb, arb_mat, arb_poly, ctx

STICK, OPEN, CLOSES = 0, 2, 3  # ±1 slips; CLOSES follows an open contact, the next piece tells how
STATES = {"stick": STICK, "closed": STICK, "slip+": 1, "slip-": -1, "open": OPEN}
WORDS = {STICK: "rests", 1: "slips forward", -1: "slips backward", OPEN: "opens", CLOSES: "closes"}
REACH = 2.0  # norm(A) times the length of Taylor polynomials, at most


class RejectedError(Exception):
    """The certificate proves nothing: which inequality fails, and by how much."""

    def __init__(self, message: str, contact: int = -1, follows: int = 0) -> None:
        super().__init__(message)
        self.contact, self.follows = contact, follows


def require(holds: Any, message: str, contact: int = -1, follows: int = 0) -> None:
    """Reject what does not hold."""
    if not holds:
        raise RejectedError(message, contact, follows)


def unit(size: int, i: int) -> Any:
    """Return a row of the unit matrix."""
    return arb_mat(1, size, [int(i == k) for k in range(size)])


class System:
    """A structure with contacts: rows over w; for each mode, a state of every contact, A and conditions."""

    def __init__(self, raw: dict[str, Any]) -> None:
        self.contacts, self.n, self.made, self.scale = raw["contacts"], len(raw["mass"]), {}, 1.0  # type: ignore[var-annotated]
        n, self.e = self.n, 2 * self.n + len(self.contacts)  # e: where the constant stands in w
        waves = [wave for c in self.contacts for wave in c.get("load", ())]
        self.orders = sorted({1, *(wave[0] for wave in waves + [f["wave"] for f in raw["forces"]])} - {0})
        self.d, omega = self.e + 1 + 2 * len(self.orders), 2 * arb.pi() * arb(raw["frequency_hz"])
        one = unit(self.d, self.e)
        held, self.pull, self.free = (arb_mat(self.d, self.d) for _ in range(3))
        for ends, k, c in raw["springs"]:
            held += self.row(ends).transpose() * (
                self.row(ends) * arb(k) + self.row(ends, n) * arb(c) * omega
            )
        for i, (k, c) in enumerate(zip(raw["stiffness"], raw["damping"], strict=True)):
            every = self.row(enumerate(k)) + self.row(enumerate(c), n) * omega
            held += unit(self.d, i).transpose() * every
        for i, row in enumerate((arb_mat(raw["mass"]).inv() * (1 / omega**2)).tolist()):
            self.free[i, n + i] = 1
            for k, each in enumerate(row):
                self.pull[n + i, k] = each  # times the column of a force: what that adds to w'
        for i, order in enumerate(self.orders):
            at = self.e + 1 + 2 * i
            self.free[at, at + 1], self.free[at + 1, at] = -order, order
        for force in raw["forces"]:
            held -= self.row(force["row"]).transpose() * self.wave([force["wave"]])
        self.free -= self.pull * held
        self.observe, self.u, self.v, self.load = self.row(raw["observe"]), [], [], []
        self.rigid, self.constant = [c.get("kt", 1) is None for c in self.contacts], []
        for c in self.contacts:
            self.u.append(self.row(c["row"]))
            self.v.append(self.row(c["row"], n))
            if "gap" in c:
                self.load.append((self.u[-1] - one * arb(c["gap"])) * arb(c["k"]))
            else:
                self.load.append(self.row(c["normal"]) * arb(c["kn"]) + self.wave(c["load"]))
            self.constant.append(not c.get("kn", 1) and all(order == 0 for order, *_ in c["load"]))

    def row(self, terms: Any, shift: int = 0) -> Any:
        """Return the row of Σ factor w_i."""
        row = arb_mat(1, self.d)
        for i, factor in terms:
            row[0, i + shift] += factor
        return row

    def wave(self, terms: Any) -> Any:
        """Return the row of Σ amplitude cos(order τ + phase)."""
        row = arb_mat(1, self.d)
        for order, amplitude, phase in terms:
            at = self.e + 1 + 2 * self.orders.index(order) if order else self.e
            row[0, at] += arb(amplitude) * arb(phase).cos()
            if order:
                row[0, at + 1] -= arb(amplitude) * arb(phase).sin()
        return row

    def mode(self, mode: tuple[int, ...]) -> Any:
        """Return A and the conditions (contact, what follows, row that is positive) of a mode."""
        if mode in self.made:
            return self.made[mode]
        A, held, forces, conditions = arb_mat(self.free), [], [], []
        for j, (c, state, load) in enumerate(zip(self.contacts, mode, self.load, strict=True)):
            if state == STICK and "gap" not in c:
                held += [j] if self.rigid[j] else []
                spring = self.u[j] - unit(self.d, 2 * self.n + j)
                forces.append(spring * arb(0 if self.rigid[j] else c["kt"]))
            else:
                forces.append(load * (0 if state == OPEN else 1 if "gap" in c else state * arb(c["mu"])))
            A -= self.pull * self.u[j].transpose() * forces[j]
            if c.get("presses"):
                pressed = (load if state != OPEN else 0 * load) - unit(self.d, self.e) * arb(c["rest"])
                A -= self.pull * self.row(c["normal"]).transpose() * pressed
        if held:  # the forces that keep u'' = 0
            rates = arb_mat([self.v[j].entries() for j in held])
            pulls = self.pull * arb_mat([self.u[j].entries() for j in held]).transpose()
            multipliers = (rates * pulls).solve(rates * A)
            A -= pulls * multipliers
            for j, row in zip(held, multipliers.tolist(), strict=True):
                forces[j] = arb_mat([row])
        for j, (c, state, load) in enumerate(zip(self.contacts, mode, self.load, strict=True)):
            if state == OPEN:
                conditions.append((j, CLOSES, -load))
            elif state == STICK and "gap" not in c:
                conditions += [(j, xi, load * arb(c["mu"]) - xi * forces[j]) for xi in (1, -1)]
            else:
                if state != STICK:
                    speeds = 0 * load if self.rigid[j] else load * A * (arb(c["mu"]) / arb(c["kt"]))
                    conditions.append((j, STICK, state * self.v[j] - speeds))
                conditions += [] if self.constant[j] else [(j, OPEN, load)]
        return self.made.setdefault(mode, (A, conditions))

    def flow(self, mode: tuple[int, ...], length: Any) -> Any:
        """Return a length near, e^{A length/2^i} to norm(A) length/2^i ≤ REACH, and weights of the norm."""
        mantissa, exponent = math.frexp(float(length.mid()))
        whole = math.ldexp(round(mantissa * 2**38), exponent - 38)
        A, n, d = self.mode(mode)[0], self.n, self.d
        if (mode, whole) not in self.made:
            fast = math.sqrt(max(sum(float(abs(A[n + i, k]).upper()) for k in range(n)) for i in range(n)))
            weights = [self.scale] * n + [self.scale * (fast or 1.0)] * n + [self.scale] * (self.e - 2 * n)
            weights += [1.0] * (d - self.e)
            sizes = [sum(abs(a) * w for a, w in zip(row, weights, strict=True)) for row in A.tolist()]
            norm = max((each / w).upper() for each, w in zip(sizes, weights, strict=True))
            depth = max(0, math.ceil(math.log2(float(norm) * whole / REACH)))
            there = [k for k in range(d) if any(A[i, k] != 0 or A[k, i] != 0 for i in range(d))]
            small = arb_mat([[A[i, k] for k in there] for i in there]) * (arb(whole) / 2**depth)
            powers = [arb_mat(d, d, 1)]
            for i, row in zip(there, small.exp().tolist(), strict=True):
                for k, each in zip(there, row, strict=True):
                    powers[0][i, k] = each
            for _ in range(depth):
                powers.insert(0, powers[0] * powers[0])
            self.made[mode, whole] = whole, powers, weights, norm
        return self.made[mode, whole]

    def series(self, mode: tuple[int, ...], states: Any, length: Any, h: Any, degree: int) -> Any:
        """Return Taylor coefficients of columns of states, and balls of what they lack up to h."""
        (A, _), (_, _, weights, norm) = self.mode(mode), self.flow(mode, length)
        terms = [states]
        for k in range(1, degree + 1):
            terms.append(A * terms[-1] * (1 / arb(k)))
        size = max((abs(a) / w).upper() for row, w in zip(states.tolist(), weights, strict=True) for a in row)
        rest = size * (norm * h) ** (degree + 1) / arb.fac_ui(degree + 1) / (1 - norm * h / (degree + 2))
        return terms, arb_mat([[arb(0, (rest * w).upper())] for w in weights])

    def after(self, mode: tuple[int, ...], states: Any, length: Any, degree: int) -> Any:
        """Return columns of states after a length."""
        whole, powers, *_ = self.flow(mode, length)
        beside = length - whole
        terms, lack = self.series(mode, powers[0] * states, length, abs(beside).upper(), degree)
        found = lack * arb_mat(1, states.ncols(), [1] * states.ncols())
        for k, term in enumerate(terms):
            found += term * beside**k
        return found


class Orbit:
    """A sequence of events; its unknowns are what lasts of its states, and the events' instants."""

    def __init__(self, system: System, raw: dict[str, Any]) -> None:
        mode = tuple(STATES[word] for word in raw["states"])
        self.system, self.begins, self.modes, self.events = system, arb(raw["begins"]), [mode], []
        self.groups: list[list[int]] = []  # events at one instant
        for i, each in enumerate(raw["events"]):
            j, new = each["contact"], STATES[each["to"]]
            self.events.append((j, mode[j], new))
            mode = (*mode[:j], new, *mode[j + 1 :])
            self.modes.append(mode)
            self.groups += [] if "at_once" in each else [[]]
            self.groups[-1].append(i)
        require(mode == self.modes[0], "contacts do not end in the state they begin in")
        for i in (i for group in self.groups for i in group[1:]):
            require(self.together(i), f"events {i - 1} and {i} need not be at one instant")
        moved, self.fixed = {2 * system.n + j for j, *_ in self.events}, dict[int, float]()
        still = set(self.lasting(mode)[2 * system.n :]) - moved
        self.fixed = {2 * system.n + int(j): value for j, value in raw["fixed_sliders"].items()}
        require(self.fixed.keys() == still, "other sliders are to be fixed")
        # Of pieces: where their instants stand among the unknowns; whence those of their state, if there are.
        self.at, self.anew, self.size = [-1], {0: (0, self.lasting(mode))}, len(self.lasting(mode))
        for number, group in enumerate(self.groups, start=1):
            self.at.append(self.size)
            self.size += 1
            if "anew" in raw["events"][group[-1]]:
                self.anew[number] = self.size, self.lasting(self.modes[group[-1] + 1])
                self.size += len(self.anew[number][1])

    def lasting(self, mode: tuple[int, ...]) -> list[int]:
        """Return the numbers of w that tell how it goes on and are not known."""
        n, contacts = self.system.n, self.system.contacts
        stuck = (2 * n + j for j, c in enumerate(contacts) if mode[j] == STICK and c.get("kt") is not None)
        return [*range(2 * n), *(at for at in stuck if at not in self.fixed)]

    def together(self, i: int) -> bool:
        """Whether event i is at the instant of the one before by the structure of the system."""
        (a, old_a, new_a), (b, old_b, new_b) = self.events[i - 1], self.events[i]
        one, other, system = self.system.contacts[a], self.system.contacts[b], self.system
        if a == b or "gap" in one or "gap" in other:
            return False
        if new_a == new_b == OPEN or old_a == old_b == OPEN:  # one load opens or closes both
            return all(one[key] == other[key] for key in ("load", "normal", "kn"))
        turned = [[at, -factor] for at, factor in one["row"]]
        same = 1 if other["row"] == one["row"] else -1 if other["row"] == turned else 0
        if not same or not (system.constant[a] and system.constant[b]):
            return False
        alike = new_b == same * new_a and all(one[key] == other[key] for key in ("kt", "mu", "load"))
        return new_a == new_b == STICK or self.resumed(i, alike)  # they come to rest with one motion, or

    def resumed(self, i: int, alike: bool) -> bool:
        """Whether the contacts of event i and the one before came to rest together, and go on as before,
        or turn: those that are alike do so together."""
        last, ways = [], set()
        for at in (i - 1, i):
            j, _, new = self.events[at]
            order = [*range(at - 1, -1, -1), *range(len(self.events) - 1, at - 1, -1)]
            last.append(next(k for k in order if self.events[k][0] == j))
            ways.add(self.events[last[-1]][1] * new if self.events[last[-1]][2] == STICK else 0)
        return ways <= ({1} if not alike or len(ways) > 1 else {1, -1}) and any(
            set(last) <= set(group) for group in self.groups
        )

    def ended(self, i: int) -> tuple[int, int]:
        """Return the contact of event i, and what follows the condition that is 0 there."""
        j, old, new = self.events[i]
        return j, CLOSES if old == OPEN else STICK if self.system.rigid[j] and old + new == 0 else new

    def begun(self, i: int) -> dict[tuple[int, int], int]:
        """Return the conditions that are 0 after event i, with the first derivative that is not."""
        j, old, new = self.events[i]
        if OPEN in (old, new):
            return {(j, follows): 1 for follows in (CLOSES, 1, -1, OPEN)}
        if self.system.rigid[j]:
            return {} if new == STICK else {(j, STICK): 2 if old == STICK else 1}
        return {(j, old): 2} if new == STICK else {}

    def length(self, y: list[Any], piece: int) -> Any:
        """Return how long a piece lasts."""
        begun = y[self.at[piece]] if piece else self.begins
        until = y[self.at[piece + 1]] if piece < len(self.groups) else self.begins + 2 * arb.pi()
        require(until - begun > 0, f"the end of piece {piece} is not after its start, but by {until - begun}")
        return until - begun

    def shoot(self, y: list[Any], away: list[Any] | None = None) -> Any:
        """Return the equations at y; for the box y + away their derivative, and how pieces begin in it."""
        system, d, n, values, starts = self.system, self.system.d, self.system.n, [], []  # type: ignore[var-annotated]
        system.scale = max(float(each.abs_upper()) for each in y[:n]) or 1.0
        box = None if away is None else [each + more for each, more in zip(y, away, strict=True)]
        slope, z, D, first = arb_mat(self.size, self.size), arb_mat(d, 1), arb_mat(d, 1), -1
        for at, value in self.fixed.items():
            z[at, 0] = value
        waves = (each for k in system.orders for each in ((k * self.begins).cos(), (k * self.begins).sin()))
        for k, each in enumerate([1, *waves], start=system.e):
            z[k, 0] = each

        def vanishes(row: Any, of: int = -1) -> None:
            """Add the equation that a row of w is 0, or an unknown."""
            for k, each in enumerate((row * D).entries() if box else ()):
                slope[len(values), first + k] += each
            if of >= 0:
                slope[len(values), of] -= 1
            values.append((row * z)[0, 0] - (y[of] if of >= 0 else 0))

        for piece, group in enumerate([*self.groups, []]):
            if piece in self.anew:
                begin, states = self.anew[piece]
                for k, at in enumerate(states if piece else (), start=begin):
                    vanishes(unit(d, at), k)
                old, before, first = D, first, self.at[piece] if piece else 0
                until = min((self.at[p] + 1 for p in self.anew if p > piece), default=self.size)
                D = arb_mat(d, until - first)
                for k in range(d if piece and box else 0):
                    D[k, 0] = old[k, first - before]
                for k, at in enumerate(states, start=begin):
                    z[at, 0], D[at, 0], D[at, k - first] = y[k], 0, 1
            starts.append((z, D, first))
            mode, length = self.modes[group[0] if group else -1], self.length(y, piece)
            if box is not None and away is not None:
                A, lasts = system.mode(mode)[0], self.length(box, piece)
                start = z + D * arb_mat([[each] for each in away[first : first + D.ncols()]])
                if piece:
                    D -= A * start * unit(D.ncols(), self.at[piece] - first)
                D = system.after(mode, D, lasts, 2)
                if group:
                    end = system.after(mode, start, lasts, 6)
                    D += A * end * unit(D.ncols(), self.at[piece + 1] - first)
            z = system.after(mode, z, length, ctx.prec // 20)
            for k in group:
                j, old_state, new = self.events[k]
                if k == group[0]:
                    row = next((row for *key, row in system.mode(mode)[1] if (*key,) == self.ended(k)), None)
                    require(row is not None, f"contact {j} cannot go from {old_state} to {new}")
                    vanishes(row)
                c, at = system.contacts[j], 2 * n + j
                if new == STICK and c.get("kt") is not None:  # the slider stays where it is
                    row = system.u[j]
                    if old_state != OPEN:
                        row = row - system.load[j] * (old_state * arb(c["mu"]) / arb(c["kt"]))
                    z[at, 0] = (row * z)[0, 0]
                    for k, each in enumerate((row * D).entries() if box else ()):
                        D[at, k] = each
        for k, at in enumerate(self.anew[0][1]):
            vanishes(unit(d, at), k)
        return arb_mat([[each] for each in values]), slope, starts

    def extremes(self, box: list[Any]) -> tuple[Any, Any]:
        """Require one orbit in the box, and all inequalities; enclose the least and the largest motion."""
        y = [each.mid() for each in box]
        away = [each - mid for each, mid in zip(box, y, strict=True)]
        value, slope, starts = self.shoot(y, away)
        inverse = isolated(slope)
        moved = arb_mat(self.size, self.size, 1) - inverse * slope
        moved = (moved * arb_mat([[each] for each in away]) - inverse * value).entries()
        for i, (new, old) in enumerate(zip(moved, away, strict=True)):
            needed, given = new.abs_upper().str(3, radius=False), old.rad().str(3, radius=False)
            told = f"unknown {i}: Krawczyk's operator needs a radius of {needed}, and the box has {given}"
            require(old.contains_interior(new), f"{told}: it is not isolated, or not known so well")
        image, low, high = [mid + more for mid, more in zip(y, moved, strict=True)], [], []
        for piece, (z, D, first) in enumerate(starts):
            start = z + D * arb_mat([[each] for each in moved[first : first + D.ncols()]])
            for p, rest, h in self.kept(piece, start, self.length(image, piece)):
                low.append((p, rest, h))
                high.append((-p, rest, h))
        return least(low), -least(high)

    def kept(self, piece: int, states: Any, length: Any) -> list[Any]:
        """Require the conditions of a piece; return the motion: polynomials, what they lack, spans."""
        before, after = self.groups[piece - 1] if piece else [], [*self.groups, []][piece]
        mode = self.modes[after[0] if after else -1]
        conditions, (whole, powers, *_) = self.system.mode(mode)[1], self.system.flow(mode, length)
        for power in powers[1:]:  # halved and halved again: no stiff piece is stepped through
            later = (power * states).tolist()
            states = arb_mat([[*old, *new] for old, new in zip(states.tolist(), later, strict=True)])
        begun = {key: order for k in before for key, order in self.begun(k).items()}
        ends, count, motion = {self.ended(k) for k in after}, states.ncols(), []
        each, degree = arb(whole) / count, ctx.prec // 4
        last = each + length - whole
        rows = arb_mat([row.entries() for *_, row in conditions] + [self.system.observe.entries()])
        terms, lack = self.system.series(mode, states, length, last.upper().max(each.upper()), degree)
        values, lacks = [(rows * term).tolist() for term in terms], (rows * lack).entries()
        for r, (j, follows) in enumerate([*((j, follows) for j, follows, _ in conditions), (-1, 0)]):
            for number in range(count):
                h, rest = last if number == count - 1 else each, lacks[r]
                p = arb_poly([value[r][number] for value in values])
                if j < 0:
                    motion.append((p, rest, h.upper()))
                    continue
                order = 0 if number else begun.get((j, follows), 0)  # p, and p' of a double zero, is 0 at 0
                if order:
                    p, rest = arb_poly(p.coeffs()[order:]), rest / h**order
                if number == count - 1 and (j, follows) in ends:  # p is 0 at h
                    p, rest = arb_poly(p(arb_poly([h, -1])).coeffs()[1:]), rest * (2 * degree) / h
                if not (p(arb(0).union(h.upper())) + rest) > 0:
                    margin = least([(p, rest, h.upper())], arb(0))
                    name = self.system.contacts[j]["name"]
                    told = f"{name} {WORDS[follows]} in piece {piece}, by {margin.str(5)}"
                    require(margin > 0, told, j, follows)
        return motion


def isolated(slope: Any) -> Any:
    """Return the inverse of the middle of a matrix."""
    try:
        return slope.mid().inv().mid()
    except ZeroDivisionError:
        raise RejectedError("the derivative of the equations is singular: it is not isolated") from None


def least(parts: list[Any], enough: Any = None) -> Any:
    """Return an enclosure of the least of polynomials p + rest on [0, h], or a bound of it above `enough`."""
    stack = [(p, p.derivative(), rest, arb(0), h, 0) for p, rest, h in parts]
    bottom = best = arb("inf")
    while stack:
        p, v, rest, low, high, depth = stack.pop()
        over, middle = low.union(high), ((low + high) / 2).mid()
        rate, value = v(over), p(middle) + rest
        bound = value + rate * (over - middle)
        if monotone := bool(rate > 0 or rate < 0):
            bound = value = p(low).min(p(high)) + rest
        best = best.min(value.upper())
        near = best.abs_upper() * arb(2) ** (-ctx.prec * 3 // 5) + 8 * value.rad()  # no halving tells more
        if monotone or depth > ctx.prec or bound.lower() >= (best - near if enough is None else enough):
            bottom = bottom.min(bound.lower())
        elif enough is not None and best <= enough:
            return best
        else:
            stack += [(p, v, rest, low, middle, depth + 1), (p, v, rest, middle, high, depth + 1)]
    return best.min(bottom).union(best) if enough is None else bottom


def stated(raw: dict[str, Any], at: dict[str, Any], kind: type[System] = System) -> System:
    """Return the system at a frequency, the loads of the contacts that vary times a factor."""
    contacts, factor = list(raw["system"]["contacts"]), arb(at.get("load_factor", 1))
    for j in raw.get("varies", ()):
        load = [[order, arb(amplitude) * factor, phase] for order, amplitude, phase in contacts[j]["load"]]
        contacts[j] = contacts[j] | {"load": load}
    frequency = at.get("frequency_hz", raw["system"]["frequency_hz"])
    return kind(raw["system"] | {"frequency_hz": frequency, "contacts": contacts})


def summit(found: list[Any]) -> tuple[Any, Any]:
    """Return enclosures of a peak and of its frequency, proved by a branch over a range and orbits in it:
    what is reached in the middle is more than at both ends, and at most what is reached over the range."""
    (over, most, _), (before, left, _), (at, top, _), (after, right, _) = found
    inside = all(a.contains(b) for one in (before, at, after) for a, b in zip(over, one, strict=True))
    require(inside and before[1] < at[1] < after[1], "the three are not in their order on one branch")
    require(left < top > right, f"it is no peak: {left.str(30)}, {top.str(30)}, {right.str(30)}")
    return top.lower().union(most.upper()), before[1].union(after[1])


def prove(raw: dict[str, Any], kind: type[System] = System) -> dict[str, Any]:
    """Return enclosures of max |x| and half the range [m], or of a peak or a least peak and where it is.

    Of three peaks that in the middle is the least, and for every load between max |x| is not below the last
    orbit's at its frequency.
    """
    ctx.prec, found = raw["bits"], []
    for at in raw.get("at", [raw["orbit"]]):
        system, box = stated(raw, at, kind), [arb(each) for each in at["unknowns"]]
        orbit = Orbit(system, raw["orbit"])
        require(len(box) == orbit.size, f"there must be {orbit.size} unknowns, got {len(box)}")
        low, high = orbit.extremes(box)
        where = [arb(at.get("load_factor", 1)), arb(at.get("frequency_hz", 0))]
        found.append(([*where, *box], high.max(-low), (high - low) / 2))
    if raw["certifies"] == "periodic orbit":
        return {"max_abs": found[0][1], "half_peak_to_peak": found[0][2]}
    if raw["certifies"] == "peak":
        peak, frequency = summit(found)
        return {"peak": peak, "frequency_hz": frequency}
    (one, _), (least_peak, frequency), (other, _) = (summit(found[k : k + 4]) for k in (0, 4, 8))
    (over, least_reached, _), factors = found[12], [at["load_factor"] for at in raw["at"][:12]]
    require(factors == [factors[4 * (i // 4)] for i in range(12)], "a peak is of one load")
    loads = [each[0][0] for each in found[:12:4]]
    ordered = loads[0] < loads[1] < loads[2] and all(over[0].contains(load) for load in loads)
    require(ordered, "the loads are not three in their order, or not all between are looked at")
    told = f"it is not the least: {one.str(30)}, {least_peak.str(30)}, {other.str(30)}"
    require(one > least_peak < other, told)
    least_peak = least_reached.lower().union(least_peak.upper())
    return {"least_peak": least_peak, "load_factor": loads[0].union(loads[2]), "frequency_hz": frequency}


def check(raw: dict[str, Any]) -> None:
    """Raise `RejectedError` where a certificate, the object in its file, does not prove what it claims."""
    found = prove(raw)
    for key, (low, high) in raw["claims"].items():
        holds = arb(low) <= found[key] <= arb(high)
        require(holds, f"{key} is in {found[key].str(25)}, not within [{low}, {high}]")


if __name__ == "__main__":
    with open(sys.argv[1], encoding="utf-8") as file:
        certificate = json.load(file)
    try:
        check(certificate)
    except RejectedError as error:
        sys.exit(f"rejected: {error}")
    sys.stdout.write(f"accepted: {certificate['claims']}\n")
