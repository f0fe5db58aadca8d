"""Check a certificate of a periodic orbit of a piecewise linear system: python checker.py CERTIFICATE.json

Stands alone: it needs python-flint (`pip install python-flint`) and nothing of the package it comes with.
What is stated is in docs/certificates.md. The state is w = (x, dx/dτ, sliders, 1, cos kτ, sin kτ, …) in the
angle τ = ωt, so that w' = A w whatever the contacts do. With balls that enclose every rounding it is shown
that Krawczyk's operator maps the box of the unknowns (first state, instants of events, states where it begins
anew) into its interior: exactly one orbit with these events is in it; that every inequality of the contacts'
laws holds between the events, so that no other happens and these cross; and where the extremes of the
observed motion lie. (R. Krawczyk, Computing 4 (1969) 187.)
"""

import json
import math
import sys
from typing import Any

from flint import arb, arb_mat, arb_poly, ctx

STATES = {"stick": 0, "closed": 0, "slip+": 1, "slip-": -1, "open": 2}
CLOSES = 3  # what follows an open contact; the next piece tells how
WORDS = {0: "rests", 1: "slips forward", -1: "slips backward", 2: "opens", CLOSES: "closes"}
DEGREE, REACH, DEPTH = 32, 2.0, 70  # of Taylor polynomials; norm(A) times their length; halvings at most
ZERO = arb(0)


class RejectedError(Exception):
    """The certificate proves nothing: which inequality fails, and by how much."""

    def __init__(self, message: str, contact: int = -1, follows: int = 0, margin: float = 0.0) -> None:
        super().__init__(message)
        self.contact, self.follows, self.margin = contact, follows, margin


def require(holds: Any, message: str) -> None:
    """Reject what does not hold."""
    if not holds:
        raise RejectedError(message)


def column(entries: Any) -> Any:
    """Return a matrix of one column."""
    return arb_mat([[each] for each in entries])


class System:
    """A structure with contacts: rows over w; for each mode, a state of every contact, A and conditions."""

    def __init__(self, raw: dict[str, Any]) -> None:
        self.contacts, self.n, self.made = raw["contacts"], len(raw["mass"]), {}  # type: ignore[var-annotated]
        self.e, n = 2 * self.n + len(self.contacts), self.n  # where the constant stands in w
        waves = [wave for c in self.contacts for wave in c.get("load", ())]
        self.orders = sorted({1, *(wave[0] for wave in waves + [f["wave"] for f in raw["forces"]])} - {0})
        self.d, omega = self.e + 1 + 2 * len(self.orders), 2 * arb.pi() * arb(raw["frequency_hz"])
        mass, C, K = (arb_mat(raw[key]) for key in ("mass", "damping", "stiffness"))
        for ends, k, c in raw["springs"]:
            for i, a in ends:
                for j, b in ends:
                    K[i, j], C[i, j] = K[i, j] + arb(k) * a * b, C[i, j] + arb(c) * a * b
        self.inverse = mass.inv() * (1 / omega**2)
        within, damped = self.inverse * K, self.inverse * C * omega
        self.free = arb_mat(self.d, self.d)
        for i in range(n):
            self.free[i, n + i] = 1
            for j in range(n):
                self.free[n + i, j], self.free[n + i, n + j] = -within[i, j], -damped[i, j]
        for i, order in enumerate(self.orders):
            at = self.e + 1 + 2 * i
            self.free[at, at + 1], self.free[at + 1, at] = -order, order
        for force in raw["forces"]:
            self.free += self.pull(force["row"]) * self.wave([force["wave"]])
        self.observe = self.row(raw["observe"])
        self.load = [
            self.row(c.get("normal", ())) * arb(c.get("kn", 0)) + self.wave(c.get("load", ()))
            for c in self.contacts
        ]

    def row(self, terms: Any, shift: int = 0) -> Any:
        """Return the row of Σ factor w_i."""
        row = arb_mat(1, self.d)
        for i, factor in terms:
            row[0, i + shift] += factor
        return row

    def pull(self, terms: Any) -> Any:
        """Return what a unit force along Σ factor x_i adds to w'."""
        row = self.row(terms)
        pulled = self.inverse * column(row[0, i] for i in range(self.n))
        return column([0] * self.n + pulled.entries() + [0] * (self.d - 2 * self.n))

    def wave(self, terms: Any) -> Any:
        """Return the row of Σ amplitude cos(order τ + phase)."""
        row = arb_mat(1, self.d)
        for order, amplitude, phase in terms:
            at = self.e + 1 + 2 * self.orders.index(order) if order else self.e
            row[0, at] += arb(amplitude) * arb(phase).cos()
            if order:
                row[0, at + 1] -= arb(amplitude) * arb(phase).sin()
        return row

    def rigid(self, j: int) -> bool:
        """Whether a contact that sticks does not move at all."""
        return self.contacts[j].get("kt", 1) is None

    def constant(self, j: int) -> bool:
        """Whether the load of a contact is constant."""
        return not self.contacts[j]["kn"] and all(order == 0 for order, *_ in self.contacts[j]["load"])

    def apart(self, j: int) -> Any:
        """Return the row of how far a contact with a gap is pressed in."""
        return self.row([*self.contacts[j]["row"], (self.e, -self.contacts[j]["gap"])])

    def force(self, j: int, state: int) -> Any:
        """Return the row of a contact's force."""
        c = self.contacts[j]
        if state == 2:
            return arb_mat(1, self.d)
        if "gap" in c:
            return self.apart(j) * arb(c["k"])
        if state == 0:
            return self.row([*c["row"], (2 * self.n + j, -1)]) * arb(c["kt"])
        return self.load[j] * (state * arb(c["mu"]))

    def stops(self, j: int, old: int) -> Any:
        """Return the row of where the slider of a contact is left that comes to rest."""
        return self.row(self.contacts[j]["row"]) - self.force(j, old) * (1 / arb(self.contacts[j]["kt"]))

    def mode(self, mode: tuple[int, ...]) -> Any:
        """Return A and the conditions (contact, what follows, row that is positive) of a mode."""
        if mode in self.made:
            return self.made[mode]
        held = [j for j, state in enumerate(mode) if state == 0 and self.rigid(j)]
        A, forces = arb_mat(self.free), {j: self.force(j, mode[j]) for j in range(len(mode)) if j not in held}
        for j, c in enumerate(self.contacts):
            if j in forces:
                A -= self.pull(c["row"]) * forces[j]
            if c.get("presses"):
                pressed = self.row([(self.e, -c["rest"])])
                A -= self.pull(c["normal"]) * (pressed if mode[j] == 2 else pressed + self.load[j])
        if held:  # the forces that keep u'' = 0
            rates = arb_mat([self.row(self.contacts[j]["row"], self.n).entries() for j in held])
            pulls = arb_mat([self.pull(self.contacts[j]["row"]).entries() for j in held]).transpose()
            multipliers = (rates * pulls).solve(rates * A)
            A -= pulls * multipliers
            forces |= {j: arb_mat([each]) for j, each in zip(held, multipliers.tolist(), strict=True)}
        every = [(j, *each) for j, state in enumerate(mode) for each in self.laws(j, state, A, forces[j])]
        return self.made.setdefault(mode, (A, every))

    def laws(self, j: int, state: int, A: Any, force: Any) -> Any:
        """Return what must be positive as long as a contact stays in a state, and what follows then."""
        c, load = self.contacts[j], self.load[j]
        if "gap" in c:
            return [(CLOSES, -self.apart(j)) if state == 2 else (2, self.apart(j))]
        if state == 2:
            return [(CLOSES, -load)]
        if state == 0:
            return [(xi, load * arb(c["mu"]) - xi * force) for xi in (1, -1)]
        slides = state * self.row(c["row"], self.n)
        found = [(0, slides if self.rigid(j) else slides * arb(c["kt"]) - load * A * arb(c["mu"]))]
        return found if self.constant(j) else [*found, (2, load)]

    def flow(self, mode: tuple[int, ...], length: Any, scale: float) -> Any:
        """Return a length near, e^{A length/2^i} down to norm(A) length/2^i ≤ REACH, A times the first, and
        weights and size of the norm."""
        mantissa, exponent = math.frexp(float(length.mid()))
        whole = math.ldexp(round(mantissa * 2**38), exponent - 38)
        if (mode, whole) not in self.made:
            A, n = self.mode(mode)[0], self.n
            stiffest = max(sum(float(A[n + i, k].abs_upper()) for k in range(n)) for i in range(n))
            weights = [scale] * n + [scale * (math.sqrt(stiffest) or 1.0)] * n
            weights += [scale] * len(self.contacts) + [1.0] * (self.d - self.e)
            sizes = arb_mat([[abs(each) for each in row] for row in A.tolist()]) * column(weights)
            norm = max((each / w).upper() for each, w in zip(sizes.entries(), weights, strict=True))
            depth = max(0, math.ceil(math.log2(float(norm) * whole / REACH)))
            there = [k for k in range(self.d) if any(A[i, k] != 0 or A[k, i] != 0 for i in range(self.d))]  # others stay, alone
            small = arb_mat([[A[i, k] for k in there] for i in there]) * (arb(whole) / 2**depth)
            powers = [identity(self.d)]
            for i, row in zip(there, small.exp().tolist(), strict=True):
                for k, each in zip(there, row, strict=True):
                    powers[0][i, k] = each
            for _ in range(depth):
                powers.insert(0, powers[0] * powers[0])
            sizes = [[abs(each) for each in row] for row in powers[0].transpose().tolist()]
            tops = arb_mat(
                [[max((a / w).upper() for a, w in zip(each, weights, strict=True)) for each in sizes]]
            )
            self.made[mode, whole] = whole, powers, A * powers[0], weights, norm, tops
        return self.made[mode, whole]


def series(A: Any, states: Any, weights: Any, norm: Any, h: Any, degree: int) -> Any:
    """Return Taylor coefficients of columns of states, and in weights what derivatives lack at h or before."""
    found = [states]
    for k in range(1, degree + 1):
        found.append(A * found[-1] * (1 / arb(k)))
    size = max((abs(found[0][i, 0]) / w).upper() for i, w in enumerate(weights))
    for k in range(1, states.ncols()):
        size = max(size, *((abs(found[0][i, k]) / w).upper() for i, w in enumerate(weights)))
    rest = []
    for q in range(3):
        last = degree + 1 - q
        rest.append(size * norm**q * (norm * h) ** last / arb.fac_ui(last) / (1 - norm * h / (last + 1)))
    return found, rest


class Orbit:
    """A sequence of events; its unknowns are what lasts of its states, and the events' instants."""

    def __init__(self, system: System, raw: dict[str, Any]) -> None:
        mode = tuple(STATES[word] for word in raw["states"])
        self.system, self.begins, self.modes, self.events = system, arb(raw["begins"]), [mode], []  # type: ignore[var-annotated]
        self.fixed = {2 * system.n + int(j): value for j, value in raw["fixed_sliders"].items()}
        for each in raw["events"]:
            j, new = each["contact"], STATES[each["to"]]
            self.events.append((j, mode[j], new, "at_once" in each))
            mode = (*mode[:j], new, *mode[j + 1 :])
            self.modes.append(mode)
        require(mode == self.modes[0], "contacts do not end in the state they begin in")
        moved = {2 * system.n + j for j, *_ in self.events}
        require(self.fixed.keys() == self.sliders(mode) - moved, "other sliders are to be fixed")
        for i, event in enumerate(self.events):
            shared = not event[3] or (i and self.together(i))
            require(shared, f"events {i - 1} and {i} need not be at one instant")
        groups: list[list[int]] = []
        for i, event in enumerate(self.events):
            if event[3]:
                groups[-1].append(i)
            else:
                groups.append([i])
        self.first, begun, first = self.lasting(mode), -1, 0
        self.size, before = len(self.first), list[int]()
        self.pieces: list[Any] = []  # mode, events before and after, instants' unknowns, columns, what is new
        for group in [*groups, []]:
            ended, new = self.size if group else -1, list[int]()
            self.size += bool(group)
            if group and "anew" in raw["events"][group[-1]]:
                new = self.lasting(self.modes[group[-1] + 1])
            i = before[-1] + 1 if before else 0
            self.pieces.append([i, before, group, begun, ended, first, new])
            self.size, first = self.size + len(new), ended if new else first
            before, begun = group, ended

    def sliders(self, mode: tuple[int, ...]) -> set[int]:
        """Return where the sliders of elastic contacts that stick stand in w."""
        contacts, n = self.system.contacts, self.system.n
        return {2 * n + j for j, s in enumerate(mode) if s == 0 and contacts[j].get("kt") is not None}

    def lasting(self, mode: tuple[int, ...]) -> list[int]:
        """Return the numbers of w that tell how it goes on."""
        return [*range(2 * self.system.n), *sorted(self.sliders(mode) - self.fixed.keys())]

    def together(self, i: int) -> bool:
        """Whether event i is at the instant of the one before by the structure of the system."""
        (a, old_a, new_a, _), (b, old_b, new_b, _) = self.events[i - 1], self.events[i]
        one, other, system = self.system.contacts[a], self.system.contacts[b], self.system
        if a == b or "gap" in one or "gap" in other:
            return False
        if new_a == new_b == 2 or old_a == old_b == 2:  # one load opens or closes both
            return all(one[key] == other[key] for key in ("load", "normal", "kn"))
        turned = [[at, -factor] for at, factor in one["row"]]
        if other["row"] not in (one["row"], turned) or not (system.constant(a) and system.constant(b)):
            return False
        if new_a == new_b == 0:
            return True  # they come to rest with one motion
        count, ways = len(self.events), []  # else they came to rest together, and go on as before
        for at, j, new in ((i - 1, a, new_a), (i, b, new_b)):
            last = next(
                k % count for k in range(at - 1, at - 1 - count, -1) if self.events[k % count][0] == j
            )
            ways.append(last)
            if self.events[last][1:3] != (new, 0):
                return False
        return all(self.events[k][3] for k in range(min(ways) + 1, max(ways) + 1))

    def ended(self, i: int) -> tuple[int, int]:
        """Return the contact of event i, and what follows the condition that is 0 there."""
        j, old, new, _ = self.events[i]
        return j, CLOSES if old == 2 else 0 if self.system.rigid(j) and old + new == 0 else new

    def begun(self, i: int) -> dict[tuple[int, int], int]:
        """Return the conditions that are 0 after event i, with the first derivative that is not."""
        j, old, new, _ = self.events[i]
        if new == 2:
            return {(j, CLOSES): 1}
        if old == 2:
            return {(j, follows): 1 for follows in (1, -1, 2)}
        if self.system.rigid(j):
            return {} if new == 0 else {(j, 0): 2 if old == 0 else 1}
        return {(j, old): 2} if new == 0 else {}

    def length(self, y: list[Any], piece: int) -> Any:
        """Return how long a piece lasts."""
        _, _, _, begun, ended, *_ = self.pieces[piece]
        until = y[ended] if ended >= 0 else self.begins + 2 * arb.pi()
        length = until - (y[begun] if begun >= 0 else self.begins)
        require(length > 0, f"the event after piece {piece} does not come after the one before: {length}")
        return length

    def shoot(self, y: list[Any], away: list[Any] | None = None) -> Any:
        """Return the equations at y; for the box y + away their derivative, and how pieces begin in it."""
        system, d, values, starts = self.system, self.system.d, [], []  # type: ignore[var-annotated]
        self.scale = max(float(each.abs_upper()) for each in y[: system.n]) or 1.0
        waves = [each for k in system.orders for each in ((k * self.begins).cos(), (k * self.begins).sin())]
        z, slope = column([0] * system.e + [1, *waves]), arb_mat(self.size, self.size)
        for at, value in [*zip(self.first, y, strict=False), *self.fixed.items()]:
            z[at, 0] = value
        D = self.columns(0, self.first, 0)

        def zero(row: Any, of: int, first: int) -> None:
            """Add the equation that a row of w is 0, or an unknown."""
            for k, each in enumerate((row * D).entries() if away is not None else ()):
                slope[len(values), first + k] += each
            if of >= 0:
                slope[len(values), of] -= 1
            values.append((row * z)[0, 0] - (y[of] if of >= 0 else 0))

        for number, (i, _, group, begun, ended, first, new) in enumerate(self.pieces):
            mode, length = self.modes[i], self.length(y, number)
            A = system.mode(mode)[0]
            whole, powers, rates, weights, norm, tops = system.flow(mode, length, self.scale)
            starts.append((z, D))
            if away is not None:
                start = z + D * column(away[first : first + D.ncols()])
                rest = self.length([a + b for a, b in zip(y, away, strict=True)], number) - whole
                beside = (norm * rest).abs_upper()
                ball = column(arb(0, w) for w in weights) * (beside**2 / (2 - beside))
                E = powers[0] + rates * rest + ball * tops
                if begun >= 0:
                    D -= A * start * unit(D.ncols(), begun - first)
                D = E * D
                if group:
                    D += A * (E * start) * unit(D.ncols(), ended - first)
            terms, lacks = series(A, powers[0] * z, weights, norm, abs(length - whole).upper(), 6)
            z = column(arb(0, (lacks[0] * w).upper()) for w in weights)
            for k, term in enumerate(terms):
                z += term * (length - whole) ** k
            if not group:
                break
            row = next((each[2] for each in system.mode(mode)[1] if each[:2] == self.ended(group[0])), None)
            j, old, state, _ = self.events[group[0]]
            require(
                row is not None, f"event {i}: {system.contacts[j]['name']} cannot go from {old} to {state}"
            )
            zero(row, -1, first)
            for k in group:
                j, old, state, _ = self.events[k]
                if state == 0 and system.contacts[j].get("kt") is not None:  # the slider stays where it is
                    at, row = 2 * system.n + j, system.stops(j, old)
                    z[at, 0] = (row * z)[0, 0]
                    for c, each in enumerate((row * D).entries() if away is not None else ()):
                        D[at, c] = each
            for k, at in enumerate(new, start=ended + 1):
                zero(unit(d, at), k, first)
            for k, at in enumerate(new, start=ended + 1):
                z[at, 0] = y[k]
            if new and away is not None:
                D = self.columns(ended, new, 1, D * unit(D.ncols(), ended - first).transpose())
        for k, at in enumerate(self.first):
            zero(unit(d, at), k, first)
        return column(values), slope, starts

    def columns(self, first: int, states: list[int], shift: int, times: Any = None) -> Any:
        """Return how w depends on the unknowns from `first` on, where it begins with some of them."""
        until = next((piece[4] + 1 for piece in self.pieces if piece[4] > first and piece[6]), self.size)
        D = arb_mat(self.system.d, until - first)
        for k in range(self.system.d if shift else 0):
            D[k, 0] = 0 if k in states else times[k, 0]
        for k, at in enumerate(states):
            D[at, k + shift] = 1
        return D

    def included(self, box: list[Any]) -> tuple[list[Any], list[Any]]:
        """Require that Krawczyk's operator maps a box of the unknowns into its interior; return the image
        less the middle, and how pieces begin."""
        y, count = [each.mid() for each in box], len(box)
        away = [each - mid for each, mid in zip(box, y, strict=True)]
        value, slope, starts = self.shoot(y, away)
        inverse = isolated(slope)
        moved = ((identity(count) - inverse * slope) * column(away) - inverse * value).entries()
        for i, (new, old) in enumerate(zip(moved, away, strict=True)):
            if not old.contains_interior(new):
                raise RejectedError(
                    f"unknown {i}: Krawczyk's operator needs a radius of {new.abs_upper().str(3, radius=False)}, "
                    f"and the box has {old.rad().str(3, radius=False)}: it is not isolated, or not known so well",
                    margin=float(new.abs_upper() / old.rad()),
                )
        return moved, starts

    def extremes(self, box: list[Any]) -> tuple[Any, Any]:
        """Require that there is one orbit in the box and that it keeps every inequality; return enclosures
        of the least and the largest motion."""
        moved, starts = self.included(box)
        image = [each.mid() + more for each, more in zip(box, moved, strict=True)]
        leaves = []
        for piece, (z, D) in enumerate(starts):
            first = self.pieces[piece][5]
            start = z + D * column(moved[first : first + D.ncols()])
            leaves += self.piece(piece, start, self.length(image, piece))
        low, high = least(leaves), least([(-p, -v, *span) for p, v, *span in leaves])
        return low, -high

    def piece(self, piece: int, states: Any, length: Any) -> list[Any]:
        """Require the conditions of a piece; return the observed motion as polynomials with their rates."""
        i, before, after, *_ = self.pieces[piece]
        A, conditions = self.system.mode(self.modes[i])
        whole, powers, _, weights, norm, _ = self.system.flow(self.modes[i], length, self.scale)
        for power in powers[1:]:  # halved and halved again: no stiff piece is stepped through
            later = (power * states).tolist()
            states = arb_mat([[*old, *new] for old, new in zip(states.tolist(), later, strict=True)])
        begun = {key: order for k in before for key, order in self.begun(k).items()}
        ends, count = {self.ended(k) for k in after}, states.ncols()
        each = arb(whole) / count
        last = (each + length - whole).upper()
        rows = arb_mat([row.entries() for *_, row in conditions] + [self.system.observe.entries()])
        found, lacks = series(A, states, weights, norm, last.max(each.upper()), DEGREE)
        terms = [(rows * term).tolist() for term in found]
        leaves = []
        for r, (j, follows) in enumerate([*((j, follows) for j, follows, _ in conditions), (-1, 0)]):
            own = sum((abs(rows[r, k]) * w for k, w in enumerate(weights)), ZERO).upper()
            rest = [arb(0, (own * more).upper()) for more in lacks]
            for number in range(count):
                final = number == count - 1
                h = last if final else each.upper()
                p = arb_poly([term[r][number] for term in terms])
                order = 0 if number else begun.get((j, follows), 0)
                if j >= 0 and not order and not final and (p + rest[0])(arb(0).union(h)) > 0:
                    continue
                v = p.derivative()
                rates = p + rest[0], v + rest[1], v.derivative() + rest[2]
                if j < 0:
                    leaves.append((*rates[:2], ZERO, h))
                    continue
                low = settled(rates[order], ZERO, h) if order else ZERO
                high = settled(-rates[1], h, -h) if final and (j, follows) in ends else h
                if low is not None and high is not None:
                    margin = least([(*rates[:2], low, high)], ZERO) if low < high else arb(1)
                if low is None or high is None or not margin > 0:
                    side = "start" if low is None else "end" if high is None else "inside"
                    margin = (
                        rates[max(order, side == "end")](h if side == "end" else ZERO)
                        if side != "inside"
                        else margin
                    )
                    name = self.system.contacts[j]["name"]
                    told = f"piece {i}: {name} {WORDS[follows]} ({side}): {margin.str(5)}"
                    raise RejectedError(told, j, follows, float(margin))
        return leaves


def unit(size: int, i: int) -> Any:
    """Return a row of the unit matrix."""
    return arb_mat([[int(i == k) for k in range(size)]])


def identity(size: int) -> Any:
    """Return the unit matrix."""
    return arb_mat([[int(i == k) for k in range(size)] for i in range(size)])


def isolated(slope: Any) -> Any:
    """Return the inverse of the middle of a matrix."""
    try:
        return slope.mid().inv().mid()
    except ZeroDivisionError:
        raise RejectedError(
            "the derivative of the equations is singular: the orbit is not isolated"
        ) from None


def settled(p: Any, end: Any, length: Any) -> Any:
    """Return up to where a polynomial is positive from one end of its interval on; None: nowhere."""
    for _ in range(DEPTH):
        if p(end.union(end + length)) > 0:
            return end + length
        length = (length / 2).mid()
    return None


def least(parts: list[Any], enough: Any = None) -> Any:
    """Return an enclosure of the least of polynomials (p, p', low, high), or a bound above `enough`."""
    stack, bottom, best = [(*each, 0) for each in parts], arb("inf"), arb("inf")
    while stack:
        p, v, low, high, depth = stack.pop()
        over, middle = low.union(high), ((low + high) / 2).mid()
        rate, value = v(over), p(middle)
        monotone = bool(rate > 0 or rate < 0)
        bound = value = p(low).min(p(high)) if monotone else value
        if not monotone:
            bound = p(over).lower().max((value + rate * (over - middle)).lower())
        best = best.min(value.upper())
        near = best.abs_upper() * arb(2) ** (-ctx.prec * 3 // 5) + 8 * value.rad()  # no halving tells more
        if monotone or depth > DEPTH or bound.lower() >= (best - near if enough is None else enough):
            bottom = bottom.min(bound.lower())
        elif enough is not None and best <= enough:
            return best
        else:
            stack += [(p, v, low, middle, depth + 1), (p, v, middle, high, depth + 1)]
    return best.min(bottom).union(best) if enough is None else bottom


def prove(raw: dict[str, Any]) -> dict[str, Any]:
    """Return enclosures of max |x| and of half the range [m] that a certificate proves."""
    ctx.prec = raw["bits"]
    orbit, box = Orbit(System(raw["system"]), raw["orbit"]), [arb(each) for each in raw["orbit"]["unknowns"]]
    require(len(box) == orbit.size, f"there must be {orbit.size} unknowns, got {len(box)}")
    low, high = orbit.extremes(box)
    return {"max_abs": high.max(-low), "half_peak_to_peak": (high - low) / 2}


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
