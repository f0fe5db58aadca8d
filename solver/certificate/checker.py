"""Check a certificate of a periodic orbit of a piecewise linear system: python checker.py CERTIFICATE.json

Stands alone: it needs python-flint (`pip install python-flint`) and nothing of the package it comes with.
What is stated is in docs/certificates.md. The state is w = (x, dx/dτ, sliders, 1, cos kτ, sin kτ, …) in the
angle τ = ωt, so that w' = A w whatever the contacts do. With balls that enclose every rounding it is shown
that Krawczyk's operator maps the box of the unknowns (first state, instants of events) into its interior:
exactly one orbit with these events is in it; that every inequality of the contacts' laws holds between the
events, so that no other happens and these cross; and where the extremes of the observed motion lie. (R.
Krawczyk, Computing 4 (1969) 187.)
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


class RejectedError(Exception):
    """The certificate proves nothing: which inequality fails, and by how much."""

    def __init__(self, message: str, contact: int = -1, follows: int = 0, margin: float = 0.0) -> None:
        super().__init__(message)
        self.contact, self.follows, self.margin = contact, follows, margin


def require(holds: Any, message: str) -> None:
    """Reject what does not hold."""
    if not holds:
        raise RejectedError(message)


def part(matrix: Any, i: int) -> Any:
    """Return a row of a matrix."""
    return arb_mat([[matrix[i, k] for k in range(matrix.ncols())]])


def rounded(length: Any) -> float:
    """Return a length to 30 bits: the exponential for it serves all that are near."""
    mantissa, exponent = math.frexp(float(length.mid()))
    return math.ldexp(round(mantissa * 2**30), exponent - 30)


def identity(n: int) -> Any:
    """Return the unit matrix."""
    return arb_mat([[int(i == k) for k in range(n)] for i in range(n)])


class System:
    """A structure with contacts: rows over w; for each mode, a state of every contact, A and conditions."""

    def __init__(self, raw: dict[str, Any]) -> None:
        self.contacts, self.n = raw["contacts"], len(raw["mass"])
        self.e = 2 * self.n + len(self.contacts)  # where the constant stands in w
        waves = [wave for c in self.contacts for wave in c.get("load", ())] + [
            f["wave"] for f in raw["forces"]
        ]
        self.orders = sorted({1, *(order for order, *_ in waves if order > 0)})
        self.d, self.scale, self.made = self.e + 1 + 2 * len(self.orders), 1.0, {}  # type: ignore[var-annotated]
        self.omega = 2 * arb.pi() * arb(raw["frequency_hz"])
        mass, C, K = (arb_mat(raw[key]) for key in ("mass", "damping", "stiffness"))
        for ends, k, c in raw["springs"]:
            for i, a in ends:
                for j, b in ends:
                    K[i, j], C[i, j] = K[i, j] + arb(k) * a * b, C[i, j] + arb(c) * a * b
        self.inverse = mass.inv() * (1 / self.omega**2)
        push = arb_mat([[-K[i, j] for j in range(self.n)] + [-self.omega * C[i, j] for j in range(self.n)]
                        + [0] * (self.d - 2 * self.n) for i in range(self.n)])  # fmt: skip
        self.free, self.observe = self.inverse * push, self.motion(raw["observe"])
        for force in raw["forces"]:
            self.free += self.pull(force["row"]) * self.wave([force["wave"]])
        self.u, self.rate = ([self.motion(c["row"], at) for c in self.contacts] for at in (0, self.n))
        self.load = [
            self.motion(c.get("normal", ())) * arb(c.get("kn", 0)) + self.wave(c.get("load", ()))
            for c in self.contacts
        ]

    def motion(self, terms: Any, shift: int = 0) -> Any:
        """Return the row of Σ factor w_i."""
        row = arb_mat(1, self.d)
        for i, factor in terms:
            row[0, i + shift] += factor
        return row

    def pull(self, terms: Any) -> Any:
        """Return the accelerations by a unit force along Σ factor x_i."""
        row = self.motion(terms)
        return self.inverse * arb_mat([[row[0, i]] for i in range(self.n)])

    def wave(self, terms: Any) -> Any:
        """Return the row of Σ amplitude cos(order τ + phase)."""
        found = []
        for order, amplitude, phase in terms:
            at, size = self.e, arb(amplitude)
            if order:
                at += 1 + 2 * self.orders.index(order)
                found.append((at + 1, -size * arb(phase).sin()))
            found.append((at, size * arb(phase).cos()))
        return self.motion(found)

    def begin(self, tau: Any) -> Any:
        """Return w at τ with its constant and harmonics alone."""
        waves = [each for k in self.orders for each in ((k * tau).cos(), (k * tau).sin())]
        return arb_mat([[each] for each in [arb(0)] * self.e + [arb(1), *waves]])

    def rigid(self, j: int) -> bool:
        """Whether a contact that sticks does not move at all."""
        return self.contacts[j].get("kt", 1) is None

    def force(self, j: int, state: int) -> Any:
        """Return the row of a contact's force."""
        c = self.contacts[j]
        if state == 2:
            return arb_mat(1, self.d)
        if "gap" in c:
            return self.motion([*c["row"], (self.e, -c["gap"])]) * arb(c["k"])
        if state == 0:
            return self.motion([*c["row"], (2 * self.n + j, -1)]) * arb(c["kt"])
        return self.load[j] * (state * arb(c["mu"]))

    def mode(self, mode: tuple[int, ...]) -> Any:
        """Return A and the conditions (contact, what follows, row that is positive) of a mode."""
        if mode in self.made:
            return self.made[mode]
        rates, held = arb_mat(self.free), [j for j, state in enumerate(mode) if state == 0 and self.rigid(j)]
        forces = [None if j in held else self.force(j, state) for j, state in enumerate(mode)]
        for j, (c, state) in enumerate(zip(self.contacts, mode, strict=True)):
            if j not in held:
                rates -= self.pull(c["row"]) * forces[j]
            if c.get("presses"):
                pressed = self.motion([(self.e, -c["rest"])])
                rates -= self.pull(c["normal"]) * (pressed if state == 2 else pressed + self.load[j])
        if held:  # the forces that keep u'' = 0
            pulls = [self.pull(self.contacts[j]["row"]) for j in held]
            along = arb_mat([[self.u[j][0, i] for i in range(self.n)] for j in held])
            both = arb_mat([[(part(along, r) * pull)[0, 0] for pull in pulls] for r in range(len(held))])
            multipliers = both.solve(along * rates)
            for r, j in enumerate(held):
                forces[j] = part(multipliers, r)
                rates -= pulls[r] * forces[j]
        A = arb_mat(self.d, self.d)
        for i in range(self.n):
            A[i, self.n + i] = 1
            for k in range(self.d):
                A[self.n + i, k] = rates[i, k]
        for i, order in enumerate(self.orders):
            at = self.e + 1 + 2 * i
            A[at, at + 1], A[at + 1, at] = -order, order
        every = [
            (j, *each) for j, state in enumerate(mode) for each in self.conditions(j, state, A, forces[j])
        ]
        return self.made.setdefault(mode, (A, every))

    def conditions(self, j: int, state: int, A: Any, force: Any) -> Any:
        """Return what must be positive as long as a contact stays in a state, and what follows then."""
        c, load = self.contacts[j], self.load[j]
        if "gap" in c:
            apart = self.motion([*c["row"], (self.e, -c["gap"])])
            return [(CLOSES, -apart) if state == 2 else (2, apart)]
        if state == 2:
            return [(CLOSES, -load)]
        if state == 0:
            return [(xi, load * arb(c["mu"]) - xi * force) for xi in (1, -1)]
        slides = state * self.rate[j]
        found = [(0, slides if self.rigid(j) else slides * arb(c["kt"]) - load * A * arb(c["mu"]))]
        return found if self.constant(j) else [*found, (2, load)]

    def constant(self, j: int) -> bool:
        """Whether the load of a contact is constant."""
        return not self.contacts[j]["kn"] and all(order == 0 for order, *_ in self.contacts[j]["load"])

    def flow(self, mode: tuple[int, ...], length: float) -> Any:
        """Return e^{A length/2^i} down to norm(A) length/2^i ≤ REACH, and weights and size of the norm."""
        if (mode, length) not in self.made:
            A, n, scale = self.mode(mode)[0], self.n, self.scale
            fast = (
                math.sqrt(max(sum(float(A[n + i, k].abs_upper()) for k in range(n)) for i in range(n))) or 1.0
            )
            weights = (
                [scale] * n + [scale * fast] * n + [scale] * len(self.contacts) + [1.0] * (self.d - self.e)
            )
            sums = (
                sum((abs(A[i, k]) * weights[k] for k in range(self.d)), arb(0)) / w
                for i, w in enumerate(weights)
            )
            norm = max(each.upper() for each in sums)
            depth = max(0, math.ceil(math.log2(float(norm) * length / REACH)))
            powers = [(A * (arb(length) / 2**depth)).exp()]
            for _ in range(depth):
                powers.insert(0, powers[0] * powers[0])
            self.made[mode, length] = powers, weights, norm
        return self.made[mode, length]


class Orbit:
    """A sequence of events; its unknowns are what lasts of the first state, and their instants."""

    def __init__(self, system: System, raw: dict[str, Any]) -> None:
        self.system, self.begins, mode = (
            system,
            arb(raw["begins"]),
            tuple(STATES[word] for word in raw["states"]),
        )
        self.fixed = {2 * system.n + int(j): value for j, value in raw["fixed_sliders"].items()}
        self.modes, self.events = [mode], []
        for each in raw["events"]:
            j, new = each["contact"], STATES[each["to"]]
            self.events.append((j, mode[j], new, "at_once" in each))
            mode = (*mode[:j], new, *mode[j + 1 :])
            self.modes.append(mode)
        require(mode == self.modes[0], "contacts do not end in the state they begin in")
        contacts, moved = system.contacts, {j for j, *_ in self.events}
        sliders = {
            2 * system.n + j: j for j, s in enumerate(mode) if s == 0 and contacts[j].get("kt") is not None
        }
        require(
            self.fixed.keys() == {at for at, j in sliders.items() if j not in moved},
            "other sliders are to be fixed",
        )
        self.lasting = [*range(2 * system.n), *(at for at, j in sliders.items() if j in moved)]
        self.size = len(self.lasting) + sum(not event[3] for event in self.events)
        for i, event in enumerate(self.events):
            require(
                not event[3] or (i and self.together(i)), f"events {i - 1} and {i} need not be at one instant"
            )

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
        ways = [self.before(i - 1, a), self.before(i, b)]  # they came to rest together, and go on as before
        rested = all(self.events[k][2] == 0 for k in ways) and [self.events[k][1] for k in ways] == [
            new_a,
            new_b,
        ]
        return rested and all(self.events[k][3] for k in range(min(ways) + 1, max(ways) + 1))

    def before(self, i: int, j: int) -> int:
        """Return the number of the last event of contact j before event i, round the period."""
        count = len(self.events)
        return next(k % count for k in range(i - 1, i - 1 - count, -1) if self.events[k % count][0] == j)

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

    def shoot(self, y: list[Any], derivative: bool = False) -> Any:
        """Return the equations at y, their derivative if asked for, and pieces (number, w, length)."""
        system, z, D = self.system, self.system.begin(self.begins), arb_mat(self.system.d, self.size)
        system.scale = max(float(each.abs_upper()) for each in y[: system.n]) or 1.0
        for i, at in enumerate(self.lasting):
            z[at, 0], D[at, i] = y[i], 1
        for at, value in self.fixed.items():
            z[at, 0] = value
        values, slopes, pieces = [], [], []
        tau, ended = self.begins, len(self.lasting) - 1
        begun: Any = None
        for i, mode in enumerate(self.modes):
            event = self.events[i] if i < len(self.events) else None
            if event is None or not event[3]:
                ended += 1
                until = y[ended] if event else self.begins + 2 * arb.pi()
                pieces.append((i, z, until - tau))
                require(
                    until - tau > 0, f"event {i} does not come after the one before, but by {until - tau}"
                )
                A, whole, started = system.mode(mode)[0], rounded(until - tau), z
                E = system.flow(mode, whole)[0][0] * (A * (until - tau - whole)).exp()
                z = E * z
                if derivative:
                    rates = A * started, A * z
                    for r in range(system.d if begun is not None else 0):
                        D[r, begun] -= rates[0][r, 0]
                    D = E * D
                    for r in range(system.d if event else 0):
                        D[r, ended] += rates[1][r, 0]
                tau, begun = until, ended
            if event is None:
                break
            j, old, new, at_once = event
            if not at_once:
                row: Any = next((each[2] for each in system.mode(mode)[1] if each[:2] == self.ended(i)), None)
                require(
                    row is not None, f"event {i}: {system.contacts[j]['name']} cannot go from {old} to {new}"
                )
                values.append(row * z)
                slopes.append(row * D)
            if new == 0 and system.contacts[j].get("kt") is not None:  # the slider stays where it is now
                row = system.u[j] - system.force(j, old) * (1 / arb(system.contacts[j]["kt"]))
                own = identity(system.d)
                for k in range(system.d):
                    own[2 * system.n + j, k] = row[0, k]
                z, D = own * z, own * D
        for i, at in enumerate(self.lasting):
            values.append(arb_mat([[z[at, 0] - y[i]]]))
            slopes.append(part(D, at))
            slopes[-1][0, i] -= 1
        return (
            arb_mat([[each[0, 0]] for each in values]),
            arb_mat([each.entries() for each in slopes]),
            pieces,
        )

    def included(self, box: list[Any]) -> list[Any]:
        """Require that Krawczyk's operator maps a box of the unknowns into its interior; return the image."""
        y, count = [each.mid() for each in box], len(box)
        value, slope = self.shoot(y)[0], self.shoot(box, derivative=True)[1]
        inverse = isolated(slope)
        away = arb_mat([[each - mid] for each, mid in zip(box, y, strict=True)])
        moved = (identity(count) - inverse * slope) * away - inverse * value
        for i in range(count):
            if not away[i, 0].contains_interior(moved[i, 0]):
                needed, given = moved[i, 0].abs_upper(), box[i].rad()
                raise RejectedError(
                    f"unknown {i}: Krawczyk's operator needs a radius of {needed.str(3, radius=False)}, "
                    f"and the box has {given.str(3, radius=False)}: it is not isolated, or not known so well",
                    margin=float(needed / given),
                )
        return [mid + moved[i, 0] for i, mid in enumerate(y)]

    def extremes(self, box: list[Any]) -> tuple[Any, Any]:
        """Require every inequality between events; return enclosures of the least and the largest motion."""
        leaves = [leaf for piece in self.shoot(box)[2] for leaf in self.piece(*piece)]
        low, high = least(leaves), least([(-p, -v, *span) for p, v, *span in leaves])
        return low, -high

    def piece(self, i: int, z: Any, length: Any) -> list[Any]:
        """Require the conditions of a piece; return the observed motion as polynomials with their rates."""
        (A, conditions), whole = self.system.mode(self.modes[i]), rounded(length)
        powers, weights, norm = self.system.flow(self.modes[i], whole)
        states = [z]
        for power in powers[1:]:  # halved and halved again: no stiff piece is stepped through
            states = [w for state in states for w in (state, power * state)]
        before = next((k for k in range(i, 0, -1) if not self.events[k - 1][3]), 1) - 1
        begun = {key: order for k in range(before, i) for key, order in self.begun(k).items()}
        last = next((k for k in range(i + 1, len(self.events)) if not self.events[k][3]), len(self.events))
        ends = {self.ended(k) for k in range(i, last)}
        rows, leaves = [row for *_, row in conditions] + [self.system.observe], []
        sizes = [sum((abs(row[0, k]) * w for k, w in enumerate(weights)), arb(0)).upper() for row in rows]
        for number, series in enumerate([state] for state in states):
            final = number == len(states) - 1
            h = (arb(whole) / len(states) + (length - whole if final else 0)).upper()
            for k in range(1, DEGREE + 1):
                series.append(A * series[-1] * (1 / arb(k)))
            size = max((abs(series[0][k, 0]) / w).upper() for k, w in enumerate(weights))
            rest = [
                size
                * norm**q
                * (norm * h) ** (DEGREE + 1 - q)
                / arb.fac_ui(DEGREE + 1 - q)
                / (1 - norm * h / (DEGREE + 2 - q))
                for q in range(3)
            ]
            for (j, follows, row), own in zip(
                [*conditions, (-1, 0, self.system.observe)], sizes, strict=True
            ):
                p = arb_poly([(row * w)[0, 0] for w in series])
                each = [
                    q + arb(0, (own * more).upper())
                    for q, more in zip((p, p.derivative(), p.derivative().derivative()), rest, strict=True)
                ]
                if j < 0:
                    leaves.append((*each[:2], arb(0), h))
                    continue
                order = 0 if number else begun.get((j, follows), 0)
                low = settled(each[order], arb(0), h) if order else arb(0)
                high = settled(-each[1], h, -h) if final and (j, follows) in ends else h
                margin = (
                    None
                    if low is None or high is None
                    else least([(*each[:2], low, high)], arb(0))
                    if low < high
                    else arb(1)
                )
                if margin is None or not margin > 0:
                    name, side = (
                        self.system.contacts[j]["name"],
                        "start" if low is None else "end" if high is None else "inside",
                    )
                    raise RejectedError(
                        f"piece {i}: {name} {WORDS[follows]} ({side}): {margin}",
                        j,
                        follows,
                        float(margin or 0),
                    )
        return leaves


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
    stack, bottom = [(*each, 0) for each in parts], arb("inf")
    best = arb("inf")
    while stack:
        p, v, low, high, depth = stack.pop()
        over, middle = low.union(high), ((low + high) / 2).mid()
        rate, centre = v(over), p(middle)
        if rate > 0 or rate < 0:
            bound = p(low).min(p(high))
            best = best.min(bound.upper())
        else:
            bound = p(over).lower().max((centre + rate * (over - middle)).lower())
            best = best.min(centre.upper())
        near = best.abs_upper() * arb(2) ** (-ctx.prec * 3 // 5) + 8 * centre.rad()  # no halving tells more
        if (
            bound.lower() >= (best - near if enough is None else enough)
            or rate > 0
            or rate < 0
            or depth > DEPTH
        ):
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
    low, high = orbit.extremes(orbit.included(box))
    return {"max_abs": high.max(-low), "half_peak_to_peak": (high - low) / 2}


def check(raw: dict[str, Any]) -> None:
    """Raise `RejectedError` where a certificate, the object in its file, does not prove what it claims."""
    found = prove(raw)
    for key, (low, high) in raw["claims"].items():
        require(
            arb(low) <= found[key] <= arb(high),
            f"{key} is in {found[key].str(25)}, not within [{low}, {high}]",
        )


if __name__ == "__main__":
    with open(sys.argv[1], encoding="utf-8") as file:
        certificate = json.load(file)
    try:
        check(certificate)
    except RejectedError as error:
        sys.exit(f"rejected: {error}")
    sys.stdout.write(f"accepted: {certificate['claims']}\n")
