"""Check a certificate of periodic motions of a piecewise linear system: python checker.py CERTIFICATE.json

Stands alone: it needs python-flint, numpy, nothing of the package; docs/certificates.md says what is stated.
First all that is stated is looked at (`stated`), before anything is computed from it; then it is proved.

The state w = (x, dx/dt, a friction force of each contact, cos kωt, sin kωt, …) does not jump, and between
events w' = A w. With balls that enclose every rounding it is shown that Krawczyk's operator (Computing 4
(1969) 187) maps the box of the unknowns, the first state, how long pieces last, some later states, into its
interior: exactly one orbit with these events is in it; that all inequalities of the contacts hold; and where
the motion's extremes lie. Derivatives, which multiply small differences alone, are floats with bounds.
"""

import json
import math
import re
import sys
from collections import Counter
from functools import reduce
from itertools import pairwise
from typing import Any

import numpy as np
from flint import arb, arb_mat, arb_poly, ctx

STICK, OPEN = 0, 2  # ±1 slips
STATES = {"stick": STICK, "closed": STICK, "slip+": 1, "slip-": -1, "open": OPEN}
WORDS = {STICK: "rests", 1: "slips forward", -1: "slips backward", OPEN: "opens or closes"}
GAP, SPRING, RIGID = "a gap", "friction with a spring", "rigid friction"
NEXT = {  # the states after each state
    GAP: {"open": ["closed"], "closed": ["open"]},
    SPRING: {  # before it opens its limit is 0, so that it slips
        "stick": ["slip+", "slip-"], "slip+": ["stick", "open"], "slip-": ["stick", "open"],
        "open": ["stick", "slip+", "slip-"],
    },
    RIGID: {  # what moves when it closes slips: its limit is 0
        "stick": ["slip+", "slip-"], "slip+": ["slip-", "stick", "open"],
        "slip-": ["slip+", "stick", "open"], "open": ["slip+", "slip-"],
    },
}  # fmt: skip
LARGE, SMALL = 1e100, 1e-100  # numbers are below, and what must be positive is above
COORDINATES, CONTACTS, ORDER, EVENTS, UNKNOWNS = 300, 500, 1000, 20_000, 100_000  # at most
PRODUCTS, NUMBERS, HALVINGS = 2e9, 2e7, 20_000  # of balls of 128 bits; in polynomials; for extremes: at most
WIDER = 8  # boxes tried
SIZE = r"[0-9]{1,400}(\.[0-9]{1,400})?([eE][+-]?[0-9]{1,3})?"
PLAIN, BALL = f"-?{SIZE}", rf"-?{SIZE}( \+/- {SIZE})?|\[-?{SIZE} \+/- {SIZE}\]"
REACH, TERMS = 2, 18  # halvings of a span for its exponential in floats; powers in that
ROUNDING, SLACK, TINY = 2.0**-53, 1.0 + 1e-9, 1e-290  # of a float; what bounds lack by their own rounding


class RejectedError(Exception):
    """The certificate proves nothing: which inequality fails; its contact, what follows, by how much."""

    def __str__(self) -> str:
        return str(self.args[0])


def require(holds: Any, *told: Any) -> None:
    """Reject what does not hold."""
    if not holds:
        raise RejectedError(*told)


# What is stated


def meant(holds: Any, place: str, value: Any, right: str) -> None:
    """Reject a value that means nothing at its place, and say what would."""
    if not holds:
        told, small = f"a {type(value).__name__}", not isinstance(value, int) or abs(value) < LARGE
        if isinstance(value, list | dict):
            told += f" of {len(value)}"
        elif small and isinstance(value, str | float | int | None):
            told = repr(value)[:60]
        raise RejectedError(f"{place} is {told}, it must be {right}")


def fields(value: Any, place: str, needed: str, more: str = "") -> None:
    """Look at an object's keys: all that are needed, none without a meaning."""
    meant(type(value) is dict, place, value, f"an object with {needed}")
    for key in needed.split():
        require(key in value, f"{place} has no {key!r}")
    for key in value:
        meant(key in f"{needed} {more}".split(), f"a key of {place}", key, f"one of {needed} {more}".strip())


def many(value: Any, place: str, least: int, most: float) -> list[tuple[str, Any]]:
    """Return the entries of a list, each with its place."""
    size = f"{least}" if least == most else f"{least} to {most}"
    meant(type(value) is list and least <= len(value) <= most, place, value, f"a list of {size}")
    return [(f"{place}[{i}]", each) for i, each in enumerate(value)]


def whole(value: Any, place: str, low: int, high: int) -> None:
    """Look at a whole number."""
    meant(type(value) is int and low <= value <= high, place, value, f"a whole number from {low} to {high}")


def number(value: Any, place: str, low: float = -LARGE) -> None:
    """Look at a number, which means its binary value."""
    good = isinstance(value, int | float) and type(value) is not bool and low <= value <= LARGE
    meant(good, place, value, f"a number from {low:g} to {LARGE:g}")


def written(value: Any, place: str, pattern: str = PLAIN) -> None:
    """Look at a number with many digits, which is written as text."""
    right = "a decimal number as text" + (", or two as middle +/- radius" if pattern == BALL else "")
    meant(type(value) is str and re.fullmatch(pattern, value), place, value, right)


def words(value: Any, place: str, known: Any) -> None:
    """Look at a word."""
    meant(type(value) is str and value in known, place, value, f"one of {', '.join(map(str, known))}")


def named(value: Any, place: str) -> None:
    """Look at a name."""
    good = type(value) is str and 0 < len(value) <= 200 and value.isprintable()
    meant(good, place, value, "a name of 1 to 200 characters that can be printed")


def terms(value: Any, place: str, n: int, least: int = 1) -> None:
    """Look at a row over the coordinates: each at most once, with a factor."""
    for at, each in many(value, place, least, n):
        many(each, at, 2, 2)
        whole(each[0], f"{at}[0]", 0, n - 1)
        number(each[1], f"{at}[1]")
    once([at for at, _ in value], place)


def waves(value: Any, place: str, least: int, highest: int) -> None:
    """Look at waves: whole orders from 0, each at most once, with an amplitude and a phase."""
    for at, each in many(value, place, least, highest + 1):
        many(each, at, 3, 3)
        whole(each[0], f"{at}[0]", 0, highest)
        number(each[1], f"{at}[1]")
        number(each[2], f"{at}[2]")
    once([order for order, *_ in value], place)


def once(every: list[Any], place: str) -> None:
    """Look at what may not be there twice."""
    twice = sorted(repr(each)[:60] for each, count in Counter(every).items() if count > 1)
    require(not twice, f"{place} has {', '.join(twice[:5])} twice")


def kind_of(contact: Any) -> str:
    """Return which of the three kinds a contact is."""
    return GAP if not contact["row"] else RIGID if contact["kt"] is None else SPRING


def stated(raw: Any) -> None:
    """Raise `RejectedError` where a certificate, the object in its file, states what has no meaning."""
    fields(raw, "the certificate", "bits system orbit proof claims", "certifies scene")
    whole(raw["bits"], "bits", 64, 1024)
    if "scene" in raw:
        named(raw["scene"], "scene")
    state_system(raw["system"])
    state_orbit(raw["orbit"], raw["system"]["contacts"], len(raw["system"]["mass"]))
    state_proof(raw, raw["system"]["frequency_hz"] is not None)


def state_system(raw: Any) -> None:
    """Look at the masses, springs, forces and contacts."""
    fields(raw, "system", "frequency_hz mass springs contacts forces observe")
    if driven := raw["frequency_hz"] is not None:
        number(raw["frequency_hz"], "system.frequency_hz", SMALL)
    n, highest = len(many(raw["mass"], "system.mass", 1, COORDINATES)), ORDER if driven else 0
    for i, (at, line) in enumerate(many(raw["mass"], "system.mass", n, n)):
        for k, (where, each) in enumerate(many(line, at, n, n)):
            number(each, where, SMALL if i == k else -LARGE)
    M, columns = np.array(raw["mass"], float), zip(*raw["mass"], strict=True)
    require(raw["mass"] == list(map(list, columns)), "system.mass is not symmetric")
    scale = 2.0 ** -np.round(np.log2(np.diag(M)) / 2)
    try:  # that it is done for a little less shows it of the matrix (Rump, BIT 46 (2006) 433)
        less = 8 * (n + 2) ** 2 * ROUNDING * np.eye(n)
        heavy = np.isfinite(np.linalg.cholesky(M * scale * scale[:, None] - less)).all()
    except np.linalg.LinAlgError:
        heavy = False
    require(heavy, "system.mass is not positive definite: some motion has no mass")
    for at, each in many(raw["springs"], "system.springs", 0, n * n + UNKNOWNS):
        many(each, at, 4, 4)
        terms(each[0], f"{at}[0]", n)
        terms(each[1], f"{at}[1]", n)
        number(each[2], f"{at}[2]")
        number(each[3], f"{at}[3]")
    for at, each in many(raw["forces"], "system.forces", 0, UNKNOWNS):
        fields(each, at, "row waves")
        terms(each["row"], f"{at}.row", n)
        waves(each["waves"], f"{at}.waves", 1, highest)
    terms(raw["observe"], "system.observe", n)
    for at, each in many(raw["contacts"], "system.contacts", 0, CONTACTS):
        state_contact(each, at, n, highest)
    once([each["name"] for each in raw["contacts"]], "system.contacts")


def state_contact(c: Any, at: str, n: int, highest: int) -> None:
    """Look at a contact: N = kn (n·x - gap) + its waves; friction along its row, or a gap without one."""
    fields(c, at, "name row mu kt waves kn gap normal rest presses varies")
    named(c["name"], f"{at}.name")
    for key in ("presses", "varies"):
        meant(type(c[key]) is bool, f"{at}.{key}", c[key], "true or false")
    for key, low in (("mu", 0.0), ("kn", 0.0), ("gap", -LARGE), ("rest", -LARGE)):
        number(c[key], f"{at}.{key}", low)
    terms(c["row"], f"{at}.row", n, 0)
    terms(c["normal"], f"{at}.normal", n, 0)
    waves(c["waves"], f"{at}.waves", int(bool(c["row"])), highest)
    meant(bool(c["normal"]) == bool(c["kn"]), f"{at}.kn", c["kn"], "positive with a normal, and 0 without")
    for key in ("presses", "gap", "rest"):
        meant(not c[key] or c["normal"], f"{at}.{key}", c[key], "0 or false without a normal")
    if kind_of(c) == GAP:
        meant(c["presses"], f"{at}.presses", c["presses"], "true of a gap, whose row is empty")
        for key in ("mu", "kt", "rest", "varies", "waves"):
            meant(c[key] in (0, []) and c[key] is not None, f"{at}.{key}", c[key], "0, false or [] of a gap")
    elif c["kt"] is not None:
        number(c["kt"], f"{at}.kt", SMALL)


def state_orbit(raw: Any, contacts: list[Any], n: int) -> None:
    """Look at the order of events: each contact goes on as its kind can, and ends as it began."""
    fields(raw, "orbit", "begins states events fixed_forces", "pinned")
    number(raw["begins"], "orbit.begins")
    states = many(raw["states"], "orbit.states", len(contacts), len(contacts))
    for c, (at, word) in zip(contacts, states, strict=True):
        words(word, at, NEXT[kind_of(c)])
    now, moved = list(raw["states"]), set()
    for at, each in many(raw["events"], "orbit.events", 0, EVENTS):
        fields(each, at, "contact to", "at_once anew")
        whole(each["contact"], f"{at}.contact", 0, len(contacts) - 1)
        kind, old = kind_of(contacts[j := each["contact"]]), now[each["contact"]]
        where = f"{at}.to, of contact {j} ({kind}) that is {old},"
        words(each["to"], where, NEXT[kind][old])
        for key in each.keys() & {"at_once", "anew"}:
            meant(each[key] is True, f"{at}.{key}", each[key], "true, or left out")
        now[j] = each["to"]
        moved.add(j)
    require(now == raw["states"], "orbit.events: contacts do not end in the state they begin in")
    require("at_once" not in (raw["events"] or [{}])[0], "orbit.events[0].at_once: there is no event before")
    held = [str(j) for j, c in enumerate(contacts) if j not in moved and c["kt"] and now[j] == "stick"]
    meant(type(raw["fixed_forces"]) is dict, "orbit.fixed_forces", raw["fixed_forces"], "an object")
    for key, value in raw["fixed_forces"].items():
        right = "the number of a contact with a spring that sticks all the time"
        meant(type(key) is str and key in held, "a key of orbit.fixed_forces", key, right)
        number(value, f"orbit.fixed_forces.{key}")
    if "pinned" in raw:
        many(raw["pinned"], "orbit.pinned", 2, 2)
        whole(raw["pinned"][0], "orbit.pinned[0]", 0, n - 1)
        number(raw["pinned"][1], "orbit.pinned[1]")


def state_proof(raw: Any, driven: bool) -> None:
    """Look at the boxes of a proof, and at the claims that its kind can have."""
    proof = raw["proof"]
    meant(type(proof) is dict, "proof", proof, "an object")
    kind = "periodic orbit" if driven else "limit cycle"
    if "unknowns" in proof:
        state_box(proof, "proof", {})
    else:
        require(driven, "proof: what nothing drives has no peak over the frequency")
        fields(proof, "proof", "over three")
        peaks = many(proof["three"], "proof.three", 3, 3)
        least = type(peaks[0][1]) is dict and "three" in peaks[0][1]
        kind = "least peak" if least else "peak"
        if least:
            state_box(proof["over"], "proof.over", {"frequency_hz": PLAIN, "load_factor": BALL})
        for at, each in peaks if least else [("proof", proof)]:
            fields(each, at, "over three")
            orbits = [(f"{at}.over", each["over"]), *many(each["three"], f"{at}.three", 3, 3)]
            for k, (where, one) in enumerate(orbits):
                state_box(one, where, {"frequency_hz": PLAIN if k else BALL}, {"load_factor": PLAIN})
            same = len({one.get("load_factor", "1") for _, one in orbits}) == 1
            require(same, f"{at}: a peak over the frequency must have one load_factor in its four orbits")
        if not least and "load_factor" in proof["over"]:
            one = proof["over"]["load_factor"]
            meant(arb(one) == 1, "proof.over.load_factor", one, "1 of a peak: the loads are those stated")
    if "certifies" in raw:
        words(raw["certifies"], "certifies, of such a proof,", [kind])
    known = {"peak": "peak max_abs frequency_hz", "least peak": "least_peak load_factor frequency_hz"}
    names = known.get(kind, "max_abs half_peak_to_peak frequency_hz").split()
    fields(raw["claims"], "claims", "", " ".join(names))
    require(raw["claims"], f"claims is empty, it must have one of {', '.join(names)}")
    for key, value in raw["claims"].items():
        for at, each in many(value, f"claims.{key}", 2, 2):
            written(each, at)


def state_box(value: Any, place: str, needed: dict[str, str], more: dict[str, str] | None = None) -> None:
    """Look at the box of an orbit's unknowns, and at the frequency and the factor of the loads it has."""
    more = more or {}
    fields(value, place, " ".join(["unknowns", *needed]), " ".join(more))
    for key, pattern in (needed | more).items():
        if key in value:
            written(value[key], f"{place}.{key}", pattern)
            meant(arb(value[key]) > 0, f"{place}.{key}", value[key], "positive")
    for at, each in many(value["unknowns"], f"{place}.unknowns", 1, UNKNOWNS):
        written(each, at, BALL)


# What is computed


class Work:
    """How much may still be computed: who writes a certificate may not make its check endless."""

    def __init__(self, products: float = PRODUCTS) -> None:
        self.left = products

    def spend(self, products: float) -> None:
        """Count products of balls."""
        self.left -= products * ctx.prec / 128
        require(self.left > 0, f"it would take more than {PRODUCTS:.0e} products of numbers")


class Rough:
    """A matrix of floats, and how far off it is at most: a product A B of floats, whatever the order of its
    sums of m terms, by m 2^-53 / (1 - m 2^-53) |A| |B| (Higham, Accuracy and Stability, 2002, chapter 3)."""

    def __init__(self, middle: Any, off: Any = None) -> None:
        self.middle, self.off = middle, np.zeros_like(middle) if off is None else off * SLACK + TINY
        self.size = (abs(middle) + self.off) * SLACK  # upper bounds of the sizes of its entries

    def __matmul__(self, other: "Rough") -> "Rough":
        a, b, rounding = abs(self.middle), abs(other.middle), (len(other.middle) + 4) * ROUNDING
        off = a @ (other.off + rounding * b) + self.off @ other.size
        return Rough(self.middle @ other.middle, off)

    def __sub__(self, other: "Rough") -> "Rough":
        middle = self.middle - other.middle
        return Rough(middle, self.off + other.off + ROUNDING * abs(middle))


def rough(matrix: Any) -> Rough:
    """Return balls as floats."""
    shape, every = (matrix.nrows(), matrix.ncols()), matrix.entries()
    middle, off = (np.array([float(e) for e in each]).reshape(shape) for each in (every, radii(every)))
    return Rough(middle, off + ROUNDING * abs(middle))


def radii(balls: Any) -> Any:
    """Return the radii of balls."""
    return np.array([float(each.rad()) for each in balls])


def around(column: Any, more: Any) -> Any:
    """Return a column of balls with a little more or less."""
    return column + arb_mat([[arb(0, each * SLACK + TINY)] for each in more.ravel().tolist()])


def inverse(slope: Rough, sizes: Any) -> Rough:
    """Return floats near the inverse of a matrix, of unknowns of these sizes."""
    columns = slope.middle * sizes
    rows = 1.0 / abs(columns).max(1, keepdims=True, initial=TINY)
    try:
        return Rough(sizes[:, None] * np.linalg.inv(columns * rows) * rows.T)
    except np.linalg.LinAlgError:
        raise RejectedError("the derivative of the equations is singular: it is not isolated") from None


class System:
    """A structure with contacts, as rows over w, at a frequency and with a factor of the loads that vary."""

    def __init__(self, raw: dict[str, Any], at: dict[str, Any], work: Any = None) -> None:
        n, self.contacts, self.made = len(raw["mass"]), raw["contacts"], dict[Any, Any]()
        self.work = work or Work()
        waves = [wave for each in [*raw["forces"], *self.contacts] for wave in each["waves"]]
        self.n, self.one, self.orders = n, 2 * n + len(self.contacts), sorted({0, *(k for k, *_ in waves)})
        self.d, frequency = self.one + 2 * len(self.orders), at.get("frequency_hz", raw["frequency_hz"])
        self.period = None if frequency is None else 1 / arb(frequency)  # None: nothing drives it
        self.work.spend(self.d**3 + len(raw["forces"]) * self.d**2)
        push, self.pull, self.free = (arb_mat(self.d, self.d) for _ in range(3))
        self.work.spend(sum(len(ends) * len(terms) for ends, terms, *_ in raw["springs"]))
        for ends, terms, k, c in raw["springs"]:
            for (i, one), (j, other) in ((end, term) for end in ends for term in terms):
                push[i, j] -= arb(one) * other * k
                push[i, n + j] -= arb(one) * other * c
        for each in raw["forces"]:
            push += self.row(each["row"]).transpose() * self.row([], 0, each["waves"])
        for i, inverted in enumerate(arb_mat(raw["mass"]).inv().tolist()):
            self.free[i, n + i] = 1
            for k, each in enumerate(inverted):
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
            row[0, i + shift] += arb(factor)
        for order, amplitude, phase in waves:
            i = self.one + 2 * self.orders.index(order)
            row[0, i] += arb(amplitude) * arb(phase).cos()
            row[0, i + 1] -= arb(amplitude) * arb(phase).sin()
        return row

    def mode(self, mode: tuple[int, ...]) -> Any:
        """Return A; A in floats; rows that are positive, by contact and what follows; h; Σ |A h|^i."""
        if mode in self.made:
            return self.made[mode]
        self.work.spend(self.d**3)
        parts = [self.part(j, state) for j, state in enumerate(mode)]
        A = sum((part for part, *_ in parts), self.free)
        rows = {key: row for _, own, _ in parts for key, row in own.items()}
        held = {j: own for j, (_, _, own) in enumerate(parts) if own}
        if held:  # by the forces under which u'' = 0
            lines, speeds = (arb_mat([each[i].entries() for each in held.values()]) for i in (0, 1))
            pulls = self.pull * lines.transpose()
            require((speeds * pulls).det() != 0, "the forces in contacts without springs are not determined")
            forces = (speeds * pulls).solve(speeds * A)
            A -= pulls * forces
            for (j, (*_, limit)), force in zip(held.items(), forces.tolist(), strict=True):
                rows |= {(j, way): limit - arb_mat([force]) * way for way in (1, -1)}
        h = 0.8 / float(max(abs(np.linalg.eigvals((floats := rough(A)).size))))
        bound = (arb_mat(self.d, self.d, 1) - arb_mat(floats.size.tolist()) * h).inv()
        sums = (bound * arb_mat(self.d, 1, [1] * self.d)).entries()
        require(all(each > 0 for each in sums), "polynomials reach too far")
        return self.made.setdefault(mode, (A, floats, rows, h, rough(bound).size))

    def part(self, j: int, state: int) -> Any:
        """Return what a contact adds to A, its rows, and the line, rate and limit of what sticks rigidly."""
        if (key := ("part", j, state)) in self.made:
            return self.made[key]
        c, load, held = self.contacts[j], self.loads[j], tuple[Any, ...]()
        own, limit, slips = self.row([[2 * self.n + j, 1]]), load * arb(c["mu"]), state * (state != OPEN)
        line, speed, rate = self.row(c["row"]), self.row(c["row"], self.n), limit * self.free * slips
        A, rows = arb_mat(self.d, self.d), {(j, OPEN): -load if state == OPEN else load}
        if c["kt"] is None:  # without a spring
            own, rate, held = limit * slips, 0 * rate, (line, speed, limit) if state == STICK else ()
        else:
            speed *= arb(c["kt"])
            A += own.transpose() * (speed if state == STICK else rate)
            rows |= {(j, way): limit - own * way for way in (1, -1) if state == STICK and c["kt"]}
        rows |= {(j, STICK): (speed - rate) * slips} if slips else {}
        pressed = (load * int(state != OPEN) - self.row([[self.one, c["rest"]]])) * int(c["presses"])
        A -= self.pull * line.transpose() * own
        A -= self.pull * self.row(c["normal"]).transpose() * pressed
        return self.made.setdefault(key, (A, rows, held))

    def powers(self, mode: tuple[int, ...], length: Any) -> tuple[list[Rough], Any]:
        """Return e^{A length/2^i}, i = …, 1, 0, from a span on; Σ |what leads from a span to later ones|."""
        if (key := (mode, length.mid().man_exp())) not in self.made:
            A, *_, h, sums = self.mode(mode)
            depth = max(0, math.ceil(math.log2(float(length.mid()) / h) + 1e-9) - REACH)
            numbers = self.d * 2.0 ** min(depth, 99) * (ctx.prec // 4 + 22)
            require(numbers < NUMBERS, "a piece is too long for the fastest of its motions to be followed")
            step, E, P = rough(A * (length.mid() / 2 ** (depth + REACH))), *[every := np.eye(self.d)] * 2
            for k in range(TERMS, 0, -1):
                E, P = every + step.middle @ E / k, every + step.size @ P / k
            off = P @ (step.off @ P + (self.d + 8) * ROUNDING * P) + sums / math.factorial(TERMS + 1)
            powers = [Rough(E, off)]
            for _ in range(REACH + depth):
                powers.append(powers[-1] @ powers[-1])
            for power in (powers := powers[REACH:])[:-1]:
                every = every + power.size @ every
            self.made[key] = powers, every
        return self.made[key]  # type: ignore[no-any-return]

    def series(self, mode: tuple[int, ...], states: Any, h: Any, most: Any = 1) -> Any:
        """Return Taylor terms of columns of states after h, and what they lack up to `most` times as long."""
        A, *_, span, sums = self.mode(mode)
        step, terms, count = A * h, [states], ctx.prec // 4 + 22  # 4^22 / 22! and so on are below 2^-prec
        self.work.spend(self.d**2 * states.ncols() * count)
        require(h * most < span * 2**REACH * 2, "a length is not known well enough")
        for k in range(1, count + 1):
            terms.append(step * terms[-1] * (1 / arb(k)))
        return terms, sums @ rough(terms.pop() * arb(most) ** count).size

    def march(self, mode: tuple[int, ...], z: Any, length: Any) -> tuple[list[Any], Any]:
        """Return points near the first states of spans and the last one, and how far off these are at most of
        one that begins at the first point."""
        powers, every = self.powers(mode, length)
        self.work.spend(self.d**3 + self.d**2 * 2 ** (len(powers) - 1))
        count, off, points = 2 ** (len(powers) - 1), np.zeros((self.d, 1)), [z.mid()]
        part, few = length.mid() / count, count <= self.d // 8
        flow = None if few else (self.mode(mode)[0] * part).exp()
        for _ in range(count):
            terms, lack = self.series(mode, points[-1], part) if few else ([flow * points[-1]], 0.0 * off)
            found = sum(terms[1:], terms[0])
            points.append(found.mid())
            off = np.maximum(off, radii(found.entries())[:, None] + lack)
        return points, every @ off * SLACK


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
            j, alone = each["contact"], "at_once" not in each
            twin = j in self.twins
            self.groups += [[]] if alone and not twin else []  # of events at one instant
            self.groups[-1].append(i)
            require(twin or alone or self.together(i), f"events {i - 1} and {i} need not be at one instant")
            again = len({self.events[k][0] for k in self.groups[-1]}) < len(self.groups[-1])
            require(not again, f"event {i}: contact {j} changes twice at one instant")
        rub, moved = {j for j, c in enumerate(system.contacts) if c["kt"]}, {j for j, *_ in self.events}
        for group in self.groups:  # another event there might leave it u'' ≠ 0
            goes = [j for j, old, _ in map(self.events.__getitem__, group) if old == STICK]
            rigid = any(system.contacts[j]["kt"] is None for j in goes)
            require(not rigid or len(group) == 1, "rigid friction that begins to slip must do so alone")
        self.known = {n + int(j): value for j, value in known.items()}
        self.known |= [raw["pinned"]] if "pinned" in raw else []
        self.during = [*(self.modes[group[0]] for group in self.groups), mode]
        self.returns = [*range(n), *(n + j for j in sorted(rub & moved - self.twins.keys()))]
        free = [*self.returns, *(n + j for j in sorted(rub - moved) if mode[j] == STICK)]
        self.unknown = [at for at in free if at not in self.known]  # what sticks returns as its motion does
        count = len(self.returns) - (system.period is None)  # what nothing drives begins at a given place
        require(len(self.unknown) == count == len(free) - len(self.known), "other states are to be fixed")
        self.size = self.lasts = len(self.returns) + len(self.groups)
        self.anew = dict[int, int]()
        for piece, group in enumerate(self.groups, start=1):
            if "anew" in raw["events"][group[-1]]:  # all of its first state is as unknown
                self.anew[piece], self.size = self.size, self.size + system.d
        self.set = [(at, k, 1) for k, at in enumerate(self.unknown)]
        for b, (a, way) in self.twins.items():
            self.set += [(n + b, k, way * of) for at, k, of in self.set if at == n + a]

    def twin(self, a: int, b: int) -> int:
        """Return ±1 where contact b is as a but for the sign of its row, and does right after it all that a
        does: its force may be ±1 times that of a, and then its events are those of a; else 0."""
        one, other = (self.system.contacts[j] | {"name": ""} for j in (a, b))
        way, each = 1 if one["row"] == other["row"] else -1, pairwise(self.events)
        if other != one | {"row": [[at, way * factor] for at, factor in one["row"]]}:
            return 0
        does = [((b, *(s if s == OPEN else way * s for s in old)), new) for (j, *old), new in each if j == a]
        same = len(does) == sum(j == b for j, *_ in self.events)
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
        constant = not any(c["kn"] or any(order for order, *_ in c["waves"]) for c in (one, other))
        if not constant or other["row"] not in lines or OPEN in (old, before):
            return False
        rests = [max((k for k in range(i - 1) if self.events[k][0] == j), default=-1) for j in (a, b)]
        ways = one["kt"] and other["kt"] and all(k >= 0 for k in rests)
        ways = ways and [self.events[k] for k in rests] == [(a, new, STICK), (b, after, STICK)]
        return new == after == STICK or (ways and any(set(rests) <= set(group) for group in self.groups))

    def zeros(self, i: int) -> tuple[tuple[int, int], dict[tuple[int, int], int]]:
        """Return the condition that is 0 at event i; those after it, with the derivative that is not.

        Each 0 follows from the equations. N is 0 where it opens or closes, and so is f, which is ±μN where it
        opens and then stays. Friction with a spring comes to rest with f = ±μN, and then df/dt is ±μ dN/dt.
        Rigid friction rests and turns where u' = 0, which it keeps while it rests; what makes it go on is
        that the force which holds it has grown to ±μN, so that u'' is 0 as well where it does.
        """
        j, old, new = self.events[i]
        if OPEN in (old, new):
            return (j, OPEN), {(j, follows): 1 for follows in (1, -1, OPEN)}
        if self.system.contacts[j]["kt"] is None:
            begun = {} if new == STICK else {(j, STICK): 2 if old == STICK else 1}
            return (j, new if old == STICK else STICK), begun
        return (j, new), {(j, old): 2} if new == STICK else {}

    def lengths(self, y: Any) -> list[Any]:
        """Return how long pieces last."""
        found = list(y[len(self.unknown) : self.lasts])
        found += [] if self.system.period is None else [self.system.period - sum(found, arb(0))]
        require(all(each > 0 for each in found), "a piece does not end after its start")
        return found

    def shoot(self, y: list[Any], away: Any = None) -> Any:
        """Return the equations at y; of the box y ± away their derivative; and how pieces begin in it."""
        system, states, values, slopes, starts, ends = self.system, len(self.unknown), [], [], [], list[Any]()
        z, set_, lengths = arb_mat(system.d, 1), np.zeros((system.d, self.size)), self.lengths(y)
        box = y if away is None else around(arb_mat([y]).transpose(), away).entries()
        for at, value in self.known.items():
            z[at, 0] = value
        for k, order in zip(range(system.one, system.d, 2), system.orders, strict=True):
            z[k, 0], z[k + 1, 0] = (order * self.begins).cos(), (order * self.begins).sin()
        for at, k, factor in self.set:
            z[at, 0], set_[at, k] = factor * y[k], factor
        first = z, (D := Rough(set_))
        for piece, (group, over) in enumerate(zip([*self.groups, []], self.lengths(box), strict=True)):
            if at := self.anew.get(piece, 0):
                own = arb_mat([y[at : at + system.d]]).transpose(), Rough(np.eye(system.d, self.size, at))
                ends.append(((z, D), own, range(system.d)))
                z, D = own
            mode, length, place = self.during[piece], lengths[piece], states + piece
            _, A, rows, span, sums = system.mode(mode)
            points, off = system.march(mode, z, length)
            starts.append((z, D, length.mid(), points, off))
            if away is None:
                z = points[-1]
            else:
                spare = float((over - length.mid()).abs_upper()) * SLACK
                require(spare < span, "a length is not known well enough")
                changes = np.eye(1, self.size, place if place < self.lasts else self.size)
                if not group and system.period is not None:  # the last piece lasts less as others last longer
                    changes[0, states:place] = -1.0
                E, rate, last = system.powers(mode, length)[0][-1], sums @ A.size, rough(points[-1])
                near = off + E.size @ radii(z.entries())[:, None]
                far = near + E.size @ (D.size @ away)[:, None]
                far += rate @ (last.size + far) * spare  # as it lasts a little more or less
                z = around(points[-1], near + rate @ (last.size + near) * float(length.rad()))
                D = Rough(E.middle, E.off + rate @ E.size * spare) @ D
                D -= A @ Rough(last.middle, last.off + far) @ Rough(-changes)
            for key in [self.zeros(k)[0] for k in group[:1]]:
                require(key in rows, f"event {group[0]} cannot be in its mode")
                values += (rows[key] * z).entries()
                slopes.append(rough(rows[key]) @ D)
        for (end, slope), (own, unit), each in [*ends, ((z, D), first, self.returns)]:
            values += [end[at, 0] - own[at, 0] for at in each]
            slopes.append(Rough((slope - unit).middle[each], (slope - unit).off[each]))
        every = (np.vstack([getattr(each, key) for each in slopes]) for key in ("middle", "off"))
        return arb_mat([values]).transpose(), Rough(*every), starts

    def moved(self, y: list[Any], away: Any) -> tuple[Any, Any]:
        """Return the radii of what Krawczyk's operator maps the box y ± away to; how pieces begin in it."""
        value, slope, starts = self.shoot(y, away)
        near = inverse(slope, away)
        moved = (Rough(np.eye(self.size)) - near @ slope).size @ away + (near @ rough(value)).size[:, 0]
        return moved * SLACK, starts

    def extremes(self, box: list[Any]) -> tuple[Any, Any, Any]:
        """Require one orbit in the box, and all inequalities; return its extremes and its period."""
        y, away = [each.mid() for each in box], radii(box)
        moved, starts = self.moved(y, away)
        for i, (new, old) in enumerate(zip(moved, away, strict=True)):
            told = f"needs a radius of {new:.2e}, the box has {old:.2e}"
            told = f"unknown {i}: Krawczyk's operator {told}: not isolated, or not known so well"
            require(new < old, told)
        lengths, motion = self.lengths(around(arb_mat([y]).transpose(), moved).entries()), []
        require(
            self.system.period is not None or not self.repeats(lengths), "it is one motion several times over"
        )
        for piece, ((z, D, *found), length) in enumerate(zip(starts, lengths, strict=True)):
            motion += self.kept(piece, radii(z.entries()) + D.size @ moved, length, *found)
        return least(motion), -least([(-p, rest, h) for p, rest, h in motion]), sum(lengths, arb(0))

    def repeats(self, lengths: list[Any]) -> bool:
        """Whether a cycle may consist of parts that are alike, each of which would be the cycle then."""
        does = [[self.events[i] for i in group] for group in self.groups]
        lasts = [lengths[0] + lengths[-1], *lengths[1:-1]]  # of the pieces up to each instant
        for part in (k for k in range(1, len(does)) if len(does) % k == 0):
            if does == does[part:] + does[:part]:
                others = lasts[part:] + lasts[:part]
                if all(one.overlaps(other) for one, other in zip(lasts, others, strict=True)):
                    return True
        return False

    def kept(
        self, piece: int, more: Any, length: Any, middle: Any, points: Any, off: Any, *, near: bool = False
    ) -> list[Any]:
        """Require the conditions of a piece; return the motion: polynomials, what they lack, spans.

        `near`: it is but near an orbit, so that what is 0 there is only nearly 0 here.
        """
        before, after = self.groups[piece - 1] if piece else [], [*self.groups, []][piece]
        mode, more, count = self.during[piece], more[:, None], len(points) - 1
        for power in self.system.powers(mode, middle)[0][:-1]:
            more = np.hstack([more, power.size @ more])
        begins = zip(points[:-1], (off + more).T * SLACK, strict=True)
        states = arb_mat([around(*each).entries() for each in begins]).transpose()
        begun = {key: order for k in before for key, order in self.zeros(k)[1].items()}
        ends, motion, last = {self.zeros(k)[0] for k in after}, [], 1 + (length - middle) / middle * count
        terms, lack = self.system.series(mode, states, middle / count, last.upper().max(arb(1)))
        lack, degree = arb_mat([[arb(0, each) for each in row] for row in lack.tolist()]), len(terms)
        for key, row in [*self.system.mode(mode)[2].items(), (None, self.system.observe)]:
            values = zip(*((row * term).entries() for term in terms), strict=True)
            for k, (value, rest) in enumerate(zip(values, (row * lack).entries(), strict=True), start=1):
                p, h = arb_poly(list(value)), last if k == count else arb(1)
                if key is None:
                    motion.append((p, rest, h.upper()))
                    continue
                told = f"{self.system.contacts[key[0]]['name']} {WORDS[key[1]]} in piece {piece}"
                order, dropped = 0 if k > 1 else begun.get(key, 0), []
                if order:  # p, and p' of a double zero, is 0 at 0
                    dropped, p, rest = p.coeffs()[:order], arb_poly(p.coeffs()[order:]), rest / h**order
                if k == count and key in ends:  # p is 0 at h
                    dropped.append(p(h) + rest)
                    p, rest = arb_poly(p(arb_poly([h, -1])).coeffs()[1:]), rest * (2 * degree) / h
                require(near or all(each.contains(0) for each in dropped), f"{told}: it is not 0 at an event")
                if not (p(arb(0).union(h.upper())) + rest) > 0:
                    margin = least([(p, rest, h.upper())], abs(p(h)).upper() / 2**20)
                    require(margin > 0, f"{told}, by {margin.str(5)}", *key, margin)
        return motion


def least(parts: list[Any], best: Any = math.inf) -> Any:
    """Return an enclosure of the least of `best` and of polynomials p + rest on [0, h]."""
    stack, best, bottom = [(p, p.derivative(), rest, arb(0), h) for p, rest, h in parts], arb(best), []
    most = len(stack) + HALVINGS
    while stack:
        require((most := most - 1) > 0, "extremes are not known well enough")
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


def proved(work: Any, raw: dict[str, Any], at: dict[str, Any]) -> tuple[Any, Any, Any]:
    """Return the extremes and the period of an orbit."""
    orbit, box = Orbit(System(raw["system"], at, work), raw["orbit"]), [arb(each) for each in at["unknowns"]]
    require(len(box) == orbit.size, f"there must be {orbit.size} unknowns, got {len(box)}")
    return orbit.extremes(box)


def prove(raw: dict[str, Any], at: dict[str, Any], work: Any, extremes: Any = proved) -> dict[str, Any]:
    """Return enclosures of what an orbit, a peak or a least peak reaches, and of where that is.

    Of three orbits on the branch `over` a range of the frequency that in the middle reaches most: a peak is
    between. Of three peaks that in the middle is least, and none between is below what is reached at a
    frequency `over` all loads, all of them on one branch: a least peak is between.
    """
    if "unknowns" in at:
        (low, high, period), box = extremes(work, raw, at), [arb(each) for each in at["unknowns"]]
        where = {"load_factor": arb(at.get("load_factor", 1)), "frequency_hz": 1 / period, "box": box}
        if (stated := at.get("frequency_hz", raw["system"]["frequency_hz"])) is not None:
            where["frequency_hz"] = arb(stated)
        return where | {"max_abs": high.max(-low), "half_peak_to_peak": (high - low) / 2}
    over, *three = (prove(raw, each, work, extremes) for each in (at["over"], *at["three"]))
    peak = "unknowns" in at["three"][0]
    along, other = ("frequency_hz", "load_factor") if peak else ("load_factor", "frequency_hz")
    places, (left, top, right) = ([each[key] for each in three] for key in (along, "max_abs"))
    ordered = places[0] < places[1] < places[2] and all(over[along].contains(each) for each in places)
    require(ordered, f"{along} is not in its order")
    higher = left < top > right if peak else left > top < right
    require(higher, f"it is no extreme: {left.str(30)}, {top.str(30)}, {right.str(30)}")
    where = {along: places[0].union(places[2]), other: three[1][other]}
    if not peak:
        one_branch(work, raw, [at["over"], *(each["over"] for each in at["three"])])
        return where | {"least_peak": over["max_abs"].union(top)}
    same = all(a.contains(b) for each in three for a, b in zip(over["box"], each["box"], strict=True))
    require(same, "the orbits are not on one branch")
    return where | {"max_abs": over["max_abs"], "peak": over["max_abs"]}


def one_branch(work: Any, raw: dict[str, Any], every: list[dict[str, Any]]) -> None:
    """Require that over all frequencies and loads of some orbits one branch holds them all."""
    frequency, factor = (
        reduce(arb.union, [arb(each.get(key, 1)) for each in every])
        for key in ("frequency_hz", "load_factor")
    )
    box = [
        reduce(arb.union, map(arb, each)) for each in zip(*(one["unknowns"] for one in every), strict=True)
    ]
    orbit = Orbit(
        System(raw["system"], {"frequency_hz": frequency, "load_factor": factor}, work), raw["orbit"]
    )
    y, away = [each.mid() for each in box], 2.0 * radii(box)
    for _ in range(WIDER):
        moved, _ = orbit.moved(y, away)
        if (moved < away).all():
            return
        away = np.maximum(away, 2.0 * moved)
    raise RejectedError("the peaks are not on one branch, or too far from each other")


def check(raw: dict[str, Any]) -> None:
    """Raise `RejectedError` where a certificate, the object in its file, does not prove what it claims."""
    stated(raw)
    try:
        with ctx.workprec(raw["bits"]), np.errstate(over="raise", invalid="raise", divide="raise"):
            found = prove(raw, raw["proof"], Work())
            for key, (low, high) in raw["claims"].items():
                told = f"{key} is in {found[key].str(25)}, not within [{low}, {high}]"
                require(arb(low) <= found[key] <= arb(high), told)
    except (ArithmeticError, ValueError, MemoryError, np.linalg.LinAlgError) as error:
        told = "the numbers are too large, too small or too far apart to be computed with"
        raise RejectedError(f"{told}: {error}") from error


def read(text: str | bytes) -> Any:
    """Return what JSON says; `RejectedError` where it is none, has a key twice or a number that is none."""

    def keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        once([key for key, _ in pairs], "an object")
        return dict(pairs)

    def none(word: str) -> None:
        raise RejectedError(f"{word} is no number")

    try:
        return json.loads(text, object_pairs_hook=keys, parse_constant=none)
    except (ValueError, RecursionError) as error:
        raise RejectedError(f"it is no JSON: {error}") from error


if __name__ == "__main__":
    try:
        with open(sys.argv[1], "rb") as file:
            check(certificate := read(file.read()))
    except (OSError, IndexError, RejectedError) as error:
        sys.exit(f"rejected: {error}")
    sys.stdout.write(f"accepted: {certificate['claims']}\n")
