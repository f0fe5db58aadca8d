"""Check a certificate of periodic motions of a piecewise linear system: python checker.py CERTIFICATE.json

Stands alone: it needs python-flint and nothing of the package; docs/certificates.md says what is stated. The
state w = (x, dx/dt, a friction force of each contact, cos kωt, sin kωt, …) does not jump, and between events
w' = A w. With balls that enclose every rounding it is shown that Krawczyk's operator (Computing 4 (1969) 187)
maps the box of the unknowns, the first state and how long pieces last, into its interior: exactly one orbit
with these events is in it; that all inequalities of the contacts hold; and where the motion's extremes lie.
"""

import json
import math
import sys
from itertools import pairwise
from typing import Any

from flint import arb, arb_mat, arb_poly, ctx

STICK, OPEN = 0, 2  # ±1 slips
STATES = {"stick": STICK, "closed": STICK, "slip+": 1, "slip-": -1, "open": OPEN}
WORDS = {STICK: "rests", 1: "slips forward", -1: "slips backward", OPEN: "opens or closes"}


class RejectedError(Exception):
    """The certificate proves nothing: which inequality fails; its contact, what follows, by how much."""


def require(holds: Any, *told: Any) -> None:
    """Reject what does not hold."""
    if not holds:
        raise RejectedError(*told)


def absolute(matrix: Any) -> Any:
    """Return upper bounds of the sizes of its entries."""
    return arb_mat([[each.abs_upper() for each in row] for row in matrix.tolist()])


class System:
    """A structure with contacts, as rows over w, at a frequency and with a factor of the loads that vary."""

    def __init__(self, raw: dict[str, Any], at: dict[str, Any]) -> None:
        n, self.contacts, self.made = len(raw["mass"]), raw["contacts"], dict[Any, Any]()
        waves = [wave for each in [*raw["forces"], *self.contacts] for wave in each["waves"]]
        self.n, self.one, self.orders = n, 2 * n + len(self.contacts), sorted({0, *(k for k, *_ in waves)})
        self.d, frequency = self.one + 2 * len(self.orders), at.get("frequency_hz", raw["frequency_hz"])
        self.period = frequency and 1 / arb(frequency)  # None: nothing drives it
        push, self.pull, self.free = (arb_mat(self.d, self.d) for _ in range(3))
        for ends, terms, k, c in raw["springs"]:
            push -= self.row(ends).transpose() * (self.row(terms) * arb(k) + self.row(terms, n) * arb(c))
        for each in raw["forces"]:
            push += self.row(each["row"]).transpose() * self.row([], 0, each["waves"])
        for i, inverse in enumerate(arb_mat(raw["mass"]).inv().tolist()):
            self.free[i, n + i] = 1
            for k, each in enumerate(inverse):
                self.pull[n + i, k] = each  # times the column of a force: what that adds to w'
        for i, order in zip(range(self.one + 2, self.d, 2), self.orders[1:], strict=True):
            self.free[i + 1, i] = order * 2 * arb.pi() / self.period
            self.free[i, i + 1] = -self.free[i + 1, i]
        self.free += self.pull * push
        self.observe, factor, self.loads = self.row(raw["observe"]), arb(at.get("load_factor", 1)), []
        for c in self.contacts:
            elastic = self.row([*c["normal"], [self.one, -arb(c["gap"])]]) * arb(c["kn"])
            self.loads.append(elastic + self.row([], 0, c["waves"]) * (factor if c["varies"] else 1))

    def row(self, terms: Any, shift: int = 0, waves: Any = ()) -> Any:
        """Return the row of Σ factor w_i + Σ amplitude cos(order ωt + phase)."""
        row = arb_mat(1, self.d)
        for i, factor in terms:
            row[0, i + shift] += factor
        for order, amplitude, phase in waves:
            i = self.one + 2 * self.orders.index(order)
            row[0, i] += arb(amplitude) * arb(phase).cos()
            row[0, i + 1] -= arb(amplitude) * arb(phase).sin()
        return row

    def mode(self, mode: tuple[int, ...]) -> Any:
        """Return A; rows that are positive, by contact and what follows; a span h; Σ |A h|^i."""
        if mode in self.made:
            return self.made[mode]
        A, rows = arb_mat(self.free), {}
        for j, (c, state, load) in enumerate(zip(self.contacts, mode, self.loads, strict=True)):
            force, speed = self.row([[2 * self.n + j, 1]]), self.row(c["row"], self.n) * arb(c["kt"])
            limit, slips = load * arb(c["mu"]), state if state != OPEN else 0
            pressed = (load * int(state != OPEN) - self.row([[self.one, c["rest"]]])) * int(c["presses"])
            A += force.transpose() * (speed if state == STICK else limit * self.free * slips)
            A -= self.pull * self.row(c["row"]).transpose() * force
            A -= self.pull * self.row(c["normal"]).transpose() * pressed
            rows[j, OPEN] = -load if state == OPEN else load
            if slips:
                rows[j, STICK] = speed * slips - limit * self.free
            elif state == STICK and c["kt"]:
                rows[j, 1], rows[j, -1] = limit - force, limit + force
        sizes = power = absolute(A)
        for _ in range(6):
            power = (power * power).mid()
        h = 0.8 / float(max(power.entries()).root(64))
        bound = (arb_mat(self.d, self.d, 1) - sizes * h).inv()
        sums = (bound * arb_mat(self.d, 1, [1] * self.d)).entries()
        require(all(each > 0 for each in sums), "polynomials reach too far")
        return self.made.setdefault(mode, (A, rows, h, bound))

    def flow(self, mode: tuple[int, ...], length: Any) -> list[Any]:
        """Return e^{A length/2^i}, i = 0, 1, …, down to what polynomials reach."""
        if (key := (mode, length.mid().man_exp())) not in self.made:
            A, _, h, _ = self.mode(mode)
            depth = max(0, math.ceil(math.log2(0.4 * float(length.mid()) / h)))
            self.made[key] = [(A * (length.mid() / 2**depth)).exp()]
            for _ in range(depth):
                self.made[key].insert(0, self.made[key][0] * self.made[key][0])
        return self.made[key]  # type: ignore[no-any-return]

    def series(self, mode: tuple[int, ...], states: Any, h: Any, degree: int) -> Any:
        """Return Taylor coefficients of columns of states, and balls of what they lack up to h."""
        (A, _, most, bound), terms, h = self.mode(mode), [states], abs(h).upper()
        require(h <= most * (degree + 1), "a length is not known well enough")  # Σ |A h / (degree + 1)|^i
        for k in range(1, degree + 2):
            terms.append(A * terms[-1] * (1 / arb(k)))
        lack = absolute(bound * absolute(terms.pop())) * h ** (degree + 1)
        return terms, arb_mat([[arb(0, each) for each in row] for row in lack.tolist()])

    def after(self, mode: tuple[int, ...], states: Any, length: Any, more: Any = 0) -> Any:
        """Return columns of states after a length and a little more or less."""
        later = self.flow(mode, length)[0] * states
        return later + self.series(mode, later, length - length.mid() + more, 0)[1]


class Orbit:
    """A sequence of events; its unknowns are what is not known of the first state, and pieces' lengths."""

    def __init__(self, system: System, raw: dict[str, Any]) -> None:
        self.system, self.begins, self.events, self.groups = system, arb(raw["begins"]), [], list[list[int]]()
        mode, n, known = tuple(STATES[word] for word in raw["states"]), 2 * system.n, raw["fixed_forces"]
        self.modes = [mode]
        for each in raw["events"]:
            j, new = each["contact"], STATES[each["to"]]
            self.events.append((j, mode[j], new))
            mode = (*mode[:j], new, *mode[j + 1 :])
            self.modes.append(mode)
        self.twins = {b: (a, way) for (a, *_), (b, *_) in pairwise(self.events) if (way := self.twin(a, b))}
        for i, each in enumerate(raw["events"]):
            twin, alone = each["contact"] in self.twins, "at_once" not in each
            self.groups += [[]] if alone and not twin else []  # of events at one instant
            self.groups[-1].append(i)
            require(twin or alone or self.together(i), f"events {i - 1} and {i} need not be at one instant")
        require(mode == self.modes[0], "contacts do not end in the state they begin in")
        rub, moved = {j for j, c in enumerate(system.contacts) if c["kt"]}, {j for j, *_ in self.events}
        self.known = {n + int(j): value for j, value in known.items()}
        self.known |= [raw["pinned"]] if "pinned" in raw else []
        self.returns = [*range(n), *(n + j for j in sorted(rub & moved - self.twins.keys()))]
        free = [*self.returns, *(n + j for j in sorted(rub - moved) if mode[j] == STICK)]
        self.unknown = [at for at in free if at not in self.known]  # what sticks returns as its motion does
        count = len(self.returns) - (system.period is None)  # what nothing drives begins at a given place
        require(len(self.unknown) == count == len(free) - len(self.known), "other states are to be fixed")
        self.size = len(self.returns) + len(self.groups)
        self.set = [(at, k, 1) for k, at in enumerate(self.unknown)]
        for b, (a, way) in self.twins.items():
            self.set += [(n + b, k, way * of) for at, k, of in self.set if at == n + a]

    def twin(self, a: int, b: int) -> int:
        """Return ±1 where contact b is as a but for the sign of its row, and does right after it all that a
        does: its force may be ±1 times that of a, and then its events are those of a; else 0."""
        one, other = (self.system.contacts[j] | {"name": ""} for j in (a, b))
        way, each = 1 if one["row"] == other["row"] else -1, pairwise(self.events)
        same = other == one | {"row": [[at, way * factor] for at, factor in one["row"]]}
        does = [((b, *(s if s == OPEN else way * s for s in old)), new) for (j, *old), new in each if j == a]
        same = same and len(does) == sum(j == b for j, *_ in self.events)
        return way * (same and all(mirrored == new for mirrored, new in does))

    def together(self, i: int) -> bool:
        """Whether event i must be at the instant of the one before: one load opens or closes both, or under
        constant loads what moves along one line comes to rest, or goes on as before where it did."""
        (a, old, new), (b, before, after) = self.events[i - 1], self.events[i]
        one, other = self.system.contacts[a], self.system.contacts[b]
        if a == b or new == after == OPEN or old == before == OPEN:
            load = ("waves", "normal", "kn", "gap", "varies")
            return a != b and all(one[key] == other[key] for key in load)
        lines = one["row"], [[at, -factor] for at, factor in one["row"]]
        if other["row"] not in lines or any(c["kn"] or c["waves"][1:] for c in (one, other)):
            return False
        rests = [max((k for k in range(i - 1) if self.events[k][0] == j), default=-1) for j in (a, b)]
        ways = [self.events[k] for k in rests] == [(a, new, STICK), (b, after, STICK)]
        return new == after == STICK or (ways and any(set(rests) <= set(group) for group in self.groups))

    def zeros(self, i: int) -> tuple[tuple[int, int], dict[tuple[int, int], int]]:
        """Return the condition that is 0 at event i; those after it, with the derivative that is not."""
        j, old, new = self.events[i]
        if OPEN in (old, new):
            return (j, OPEN), {(j, follows): 1 for follows in (1, -1, OPEN)}
        return (j, new), {(j, old): 2} if new == STICK else {}

    def lengths(self, y: Any) -> list[Any]:
        """Return how long pieces last."""
        found = list(y[len(self.unknown) :])
        found += [] if self.system.period is None else [self.system.period - sum(found, arb(0))]
        require(all(each > 0 for each in found), "a piece does not end after its start")
        return found

    def shoot(self, y: list[Any], away: Any = None) -> Any:
        """Return the equations at y; of the box y + away their derivative; and how pieces begin in it."""
        system, states, values, slope, starts = self.system, len(self.unknown), [], [], []
        z, D, lengths = arb_mat(system.d, 1), arb_mat(system.d, self.size), self.lengths(y)
        box = y if away is None else (arb_mat([y]).transpose() + away).entries()
        spare = [over - length.mid() for over, length in zip(self.lengths(box), lengths, strict=True)]
        for at, value in self.known.items():
            z[at, 0] = value
        for k, order in zip(range(system.one, system.d, 2), system.orders, strict=True):
            z[k, 0], z[k + 1, 0] = (order * self.begins).cos(), (order * self.begins).sin()
        for at, k, factor in self.set:
            z[at, 0], D[at, k] = factor * y[k], factor
        first = z, D
        for piece, group in enumerate([*self.groups, []]):
            mode, length, own = self.modes[group[0] if group else -1], lengths[piece], states + piece
            A, rows, *_ = system.mode(mode)
            starts.append((z, D, length))
            if away is not None:  # the last piece lasts less as others last longer, if the period is given
                changes = [int(k == own) - int(k >= states and own == self.size) for k in range(self.size)]
                moves = A * system.after(mode, z + D * away, length, spare[piece])
                D = system.after(mode, D, length, spare[piece]) + moves * arb_mat(1, self.size, changes)
            z = system.after(mode, z, length)
            for key in [self.zeros(k)[0] for k in group[:1]]:
                require(key in rows, f"event {group[0]} cannot be in its mode")
                values.append((rows[key] * z).entries())
                slope.append((rows[key] * D).entries())
        values += [[z[at, 0] - first[0][at, 0]] for at in self.returns]
        slope += [(D - first[1]).tolist()[at] for at in self.returns]
        return arb_mat(values), arb_mat(slope), starts

    def extremes(self, box: list[Any]) -> tuple[Any, Any, Any]:
        """Require one orbit in the box, and all inequalities; return its extremes and its period."""
        y = [each.mid() for each in box]
        away = arb_mat([[each - middle] for each, middle in zip(box, y, strict=True)])
        value, slope, starts = self.shoot(y, away)
        try:
            inverse = slope.mid().inv().mid()
        except ZeroDivisionError:
            raise RejectedError("the derivative of the equations is singular: it is not isolated") from None
        moved = (arb_mat(self.size, self.size, 1) - inverse * slope) * away - inverse * value
        for i, (new, old) in enumerate(zip(moved.entries(), away.entries(), strict=True)):
            told = f"needs a radius of {float(new.abs_upper()):.2e}, the box has {float(old.rad()):.2e}"
            told = f"unknown {i}: Krawczyk's operator {told}: not isolated, or not known so well"
            require(old.contains_interior(new), told)
        lengths, motion = self.lengths((arb_mat([y]).transpose() + moved).entries()), []
        for piece, (z, D, length) in enumerate(starts):
            motion += self.kept(piece, z + D * moved, length, lengths[piece] - length.mid())
        return least(motion), -least([(-p, rest, h) for p, rest, h in motion]), sum(lengths, arb(0))

    def kept(self, piece: int, states: Any, length: Any, more: Any) -> list[Any]:
        """Require the conditions of a piece; return the motion: polynomials, what they lack, spans."""
        before, after = self.groups[piece - 1] if piece else [], [*self.groups, []][piece]
        mode = self.modes[after[0] if after else -1]
        _, *powers = self.system.flow(mode, length)
        for power in powers:  # halved and halved again: no stiff piece is stepped through
            later = (power * states).tolist()
            states = arb_mat([[*old, *new] for old, new in zip(states.tolist(), later, strict=True)])
        begun = {key: order for k in before for key, order in self.zeros(k)[1].items()}
        ends, count, degree, motion = {self.zeros(k)[0] for k in after}, states.ncols(), ctx.prec // 4, []
        spans = [length.mid() / count] * (count - 1) + [length.mid() / count + more]
        terms, lack = self.system.series(mode, states, spans[0].max(spans[-1]), degree)
        for key, row in [*self.system.mode(mode)[1].items(), (None, self.system.observe)]:
            values = zip(*((row * term).entries() for term in terms), strict=True)
            for k, (h, value, rest) in enumerate(zip(spans, values, (row * lack).entries(), strict=True)):
                p = arb_poly(list(value))
                if key is None:
                    motion.append((p, rest, h.upper()))
                    continue
                order = 0 if k else begun.get(key, 0)  # p, and p' of a double zero, is 0 at 0
                p, rest = arb_poly(p.coeffs()[order:]), rest / h**order
                if k == count - 1 and key in ends:  # p is 0 at h
                    p, rest = arb_poly(p(arb_poly([h, -1])).coeffs()[1:]), rest * (2 * degree) / h
                if not (p(arb(0).union(h.upper())) + rest) > 0:
                    margin = least([(p, rest, h.upper())], abs(p(h)).upper() / 2**20)
                    told = f"{self.system.contacts[key[0]]['name']} {WORDS[key[1]]} in piece {piece}"
                    require(margin > 0, f"{told}, by {margin.str(5)}", *key, margin)
        return motion


def least(parts: list[Any], best: Any = math.inf) -> Any:
    """Return an enclosure of the least of `best` and of polynomials p + rest on [0, h]."""
    stack, best, bottom = [(p, p.derivative(), rest, arb(0), h) for p, rest, h in parts], arb(best), []
    while stack:
        p, v, rest, low, high = stack.pop()
        middle, over, rate = ((low + high) / 2).mid(), low.union(high), v(low.union(high))
        value = p(low).min(p(high)) + rest if rate > 0 or rate < 0 else p(middle) + rest
        bound = value if rate > 0 or rate < 0 else value + rate * (over - middle)
        best = best.min(value.upper())
        near = best.abs_upper() * arb(2) ** (-ctx.prec * 3 // 5) + 8 * value.rad()  # no halving tells more
        if rate > 0 or rate < 0 or bound.lower() >= best - near:
            bottom.append(bound.lower())
        else:
            stack += [(p, v, rest, low, middle), (p, v, rest, middle, high)]
    return min([best, *bottom]).union(best)


def prove(raw: dict[str, Any], at: dict[str, Any], kind: type[System] = System) -> dict[str, Any]:
    """Return enclosures of what an orbit, a peak or a least peak reaches, and of where that is.

    Of three orbits on the branch `over` a range of the frequency that in the middle reaches most: a peak is
    between. Of three peaks that in the middle is least, and none between is below what is reached at its
    frequency `over` all loads: a least peak is between.
    """
    if "unknowns" in at:
        orbit, box = Orbit(kind(raw["system"], at), raw["orbit"]), [arb(each) for each in at["unknowns"]]
        require(len(box) == orbit.size, f"there must be {orbit.size} unknowns, got {len(box)}")
        low, high, period = orbit.extremes(box)
        where = {"load_factor": arb(at.get("load_factor", 1)), "frequency_hz": 1 / period, "box": box}
        return where | {"max_abs": high.max(-low), "half_peak_to_peak": (high - low) / 2}
    over, *three = (prove(raw, each, kind) for each in (at["over"], *at["three"]))
    peak = "unknowns" in at["three"][0]
    along, other = ("frequency_hz", "load_factor") if peak else ("load_factor", "frequency_hz")
    places, (left, top, right) = ([each[key] for each in three] for key in (along, "max_abs"))
    ordered = places[0] < places[1] < places[2] and all(over[along].contains(each) for each in places)
    require(ordered, f"{along} is not in its order")
    higher = left < top > right if peak else left > top < right
    require(higher, f"it is no extreme: {left.str(30)}, {top.str(30)}, {right.str(30)}")
    where = {along: places[0].union(places[2]), other: three[1][other]}
    if not peak:
        return where | {"least_peak": over["max_abs"].union(top)}
    same = all(a.contains(b) for each in three for a, b in zip(over["box"], each["box"], strict=True))
    factors = {each.get(other) for each in (at["over"], *at["three"])}
    require(same and len(factors) == 1, "the orbits are not on one branch")
    return where | {"max_abs": over["max_abs"], "peak": over["max_abs"]}


def check(raw: dict[str, Any]) -> None:
    """Raise `RejectedError` where a certificate, the object in its file, does not prove what it claims."""
    ctx.prec = raw["bits"]
    found = prove(raw, raw["proof"])
    for key, (low, high) in raw["claims"].items():
        told = f"{key} is in {found[key].str(25)}, not within [{low}, {high}]"
        require(arb(low) <= found[key] <= arb(high), told)


if __name__ == "__main__":
    with open(sys.argv[1], encoding="utf-8") as file:
        check(certificate := json.load(file))
    sys.stdout.write(f"accepted: {certificate['claims']}\n")
