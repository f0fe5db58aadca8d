"""Answers by two ways that share no code, with an enclosure: `python -m benchmarks.frictionbench answers`."""

from __future__ import annotations

import json
import math
import time
from dataclasses import replace
from typing import Any

import numpy as np
from flint import arb, ctx

from benchmarks.frictionbench import scenes, shooting
from benchmarks.frictionbench.closed_forms import FORMS
from benchmarks.frictionbench.model import HERE, Case, Model, load, model
from benchmarks.frictionbench.shooting import BITS, NoOrbitError, Orbit, System

Answer = dict[str, Any]
WANTED = 10  # digits in which both ways are to agree
STARTS = 12  # from which several solutions are looked for
FAR = 320  # the most harmonics of the balance
COSTLY = 12  # contacts in space from which neither the balance is taken far nor the march begun
MANY = 12  # rows beyond which events are left to the march


def path(name: str) -> Any:
    """Return the file of an answer."""
    return HERE / "answers" / f"{name}.json"


def stored(name: str) -> Answer:
    """Return a stored answer."""
    return dict(json.loads(path(name).read_text()))


def recompute(name: str, *, most: int = FAR) -> Answer:
    """Compute the answer of a case by every way there is; `most` harmonics of the balance."""
    case = load(name)
    ways: dict[str, Answer] = {}
    failed: dict[str, str] = {}
    before, ctx.prec = ctx.prec, BITS
    try:
        for way, by in (
            ("closed form", _closed),
            ("events", _events),
            ("balance", _balance(most)),
            ("march", _march),
        ):
            # Time marching stands in where events cannot be followed in extended precision.
            if way == "march" and len(ways) > 1:
                continue
            begun = time.process_time()
            try:
                ways[way] = by(case) | {"seconds": round(time.process_time() - begun, 2)}
            except (scenes.NotOfferedError, NotImplementedError) as error:
                if "no closed form" not in str(error):
                    failed[way] = str(error)
            except (NoOrbitError, ArithmeticError) as error:
                failed[way] = f"{type(error).__name__}: {error}"
    finally:
        ctx.prec = before
    return _told(case, ways, failed)


def _told(case: Case, ways: dict[str, Answer], failed: dict[str, str]) -> Answer:
    order = [way for way in ("closed form", "events", "march", "balance") if way in ways]
    if not order:
        raise NoOrbitError(f"{case['name']}: no way leads to an answer: {failed}")
    best = ways[order[0]]
    agreed = 0.0
    if len(order) > 1:
        values = [float(ways[way]["value"]) for way in order[:2]]
        # Where one definition holds for both (one harmonic, a rigid contact) the ways differ by rounding.
        agreed = digits(values[1], values[0])
    told: Answer = {"name": case["name"], "value": best["value"], "enclosure": best.get("enclosure")}
    if "at" in best:
        told["at"] = best["at"]
    told |= {"ways": len(order), "agreed_digits": round(agreed, 1), "by": ways}
    if failed:
        told["not_by"] = failed
    if note := case["asked"].get("which") or SETS.get(case["asked"]["what"]):
        told["set"] = note
    return told


SETS = {
    "half-peak-to-peak": "the mean is any within the limits of what sticks: half the range is asked for",
    "amplification": "a supremum: no disk reaches it",
}


def digits(found: float, known: float) -> float:
    """Return in how many digits two numbers agree, at most 16."""
    return min(16.0, -math.log10(max(abs(found - known) / abs(known), 1e-16)))


def _ball(value: Any) -> Answer:
    low, high = value.lower(), value.upper()
    return {
        "value": value.mid().str(20, radius=False),
        "enclosure": [low.mid().str(24, radius=False), high.mid().str(24, radius=False)],
    }


def _closed(case: Case) -> Answer:
    if case["name"] not in FORMS:
        raise scenes.NotOfferedError("no closed form")
    found = FORMS[case["name"]](case)
    return _ball(found["value"]) | ({"at": float(found["at"].mid())} if "at" in found else {})


# ---- exact events
def _events(case: Case) -> Answer:
    asked, what = case["asked"], case["asked"]["what"]
    if "harmonics" in asked or what == "amplification":
        raise NotImplementedError("defined by one harmonic" if "harmonics" in asked else "a supremum")
    made = model(case)
    if len(made.rows) > MANY:
        raise NotImplementedError(f"events of {len(made.rows)} contacts are not followed here")
    if what == "limit-cycle":
        return _cycle(case, made)
    if what in ("peak", "least-peak"):
        return _stationary(case, made)
    omega = 2 * arb.pi() * arb(asked["frequency_hz"])
    system = System(made, omega)
    if "which" in asked:
        return _one_of(system, asked["which"])
    orbit = shooting.find(system)
    ctx.prec = BITS
    value = _loss(system, orbit) if what == "loss" else _amplitude(system, orbit, half=what != "amplitude")
    return _ball(value) | _facts(orbit)


def _facts(orbit: Orbit) -> Answer:
    return {"events": len(orbit.events), "stuck": {str(r): v for r, v in orbit.fixed.items()}}


def _amplitude(system: System, orbit: Orbit, *, half: bool = False, box: bool = True) -> Any:
    X = shooting.enclose(system, orbit) if box else orbit.unknowns
    high, low = shooting.extremes(system, orbit, X)
    return (high - low) / 2 if half else abs(high).max(abs(low))


def _loss(system: System, orbit: Orbit) -> Any:
    """Return the friction work of a period: μN times the slip, under constant loads."""
    pieces: list[Any] = []
    X = shooting.enclose(system, orbit)
    system.shoot(orbit, X, pieces)
    total = arb(0)
    for mode, w, ta, tb in pieces:
        ahead = (system.A(mode) * (tb - ta)).exp() * w
        for r, row in enumerate(system.model.rows):
            if row.law == "friction" and mode[r] in (1, -1):
                if row.N1 or row.kn:
                    raise NotImplementedError("losses under moving loads")
                moved = sum((q * (ahead[i, 0] - w[i, 0]) for i, q in system.u[r].items()), arb(0))
                total += mode[r] * arb(row.mu) * arb(row.N0) * moved
    return total


def _one_of(system: System, which: str) -> Answer:
    draw, found = np.random.default_rng(1), []
    for _ in range(STARTS):
        w, mode = system.rest()
        w[: 2 * system.n] = draw.uniform(-4.0, 4.0, 2 * system.n)
        mode = tuple(
            int(row.b @ w[: system.n] > row.gap) if row.law == "gap" else m
            for row, m in zip(system.model.rows, mode, strict=True)
        )
        orbit = shooting.find(system, (w, mode))
        ctx.prec = BITS
        found.append((_amplitude(system, orbit), orbit))
    value, orbit = (max if which == "largest" else min)(found, key=lambda one: float(one[0]))
    every = sorted({round(float(one), 9) for one, _ in found})
    return _ball(value) | _facts(orbit) | {"attracting_amplitudes": every}


def _cycle(case: Case, made: Model) -> Answer:
    asked = case["asked"]
    guess = scenes.answer(case, 11)
    system = System(made, 2 * arb.pi() * arb(guess["at"]))
    orbit = shooting.find_cycle(system, guess["value"], 0)
    ctx.prec = BITS
    X = shooting.enclose(system, orbit)
    high, low = shooting.extremes(system, orbit, X)
    hz = arb(guess["at"]) * 2 * arb.pi() / X[-1]
    return _ball(abs(high).max(abs(low))) | _facts(orbit) | {"at": float(hz.mid()), "which": asked["which"]}


def _stationary(case: Case, made: Model) -> Answer:
    """Newton's method on dA/dω = 0, for a least peak on dA/dN0 = 0 too; differences of 2^-50 in 256 bits."""
    asked, least = case["asked"], case["asked"]["what"] == "least-peak"
    guess = scenes.answer(case, 41)
    name = asked["variable"].split(".")[0] if least else ""
    if least:
        at = guess["at"]
        case = {
            **case,
            "contacts": [{**one, "N0": at} if one["name"] == name else one for one in case["contacts"]],
        }
        hz = scenes.answer({**case, "asked": {**asked, "what": "peak"}}, 41)["at"]
        made, p = model(case), [arb(2 * math.pi * hz), arb(at)]
    else:
        p = [2 * arb.pi() * arb(guess["at"])]

    def system(p: list[Any]) -> System:
        return System(made, p[0], {name: p[1]} if least else None)

    orbit = shooting.find(system([q.mid() for q in p]))
    ctx.prec = BITS

    def value(p: list[Any]) -> Any:
        here, near = system(p), replace(orbit, unknowns=list(orbit.unknowns))
        if not shooting.polish(here, near):
            raise NoOrbitError("the order of events changes at the peak")
        return _amplitude(here, near, box=False).mid()

    for _ in range(12):
        gradient, hessian = _differences(value, p)
        step = hessian.solve(gradient)
        p = [(q - step[i, 0]).mid() for i, q in enumerate(p)]
        if max(abs(float(step[i, 0] / q)) for i, q in enumerate(p)) < 1e-22:
            break
    else:
        raise NoOrbitError("the largest amplitude is not stationary there")
    here = system(p)
    orbit = shooting.find(here)
    ctx.prec = BITS
    found = _amplitude(here, orbit)
    gradient, hessian = _differences(value, p)
    step = hessian.solve(gradient)
    missing = sum((abs(gradient[i, 0] * step[i, 0]) for i in range(len(p))), arb(0)).upper().mid()
    where = p[1] if least else p[0] / (2 * arb.pi())
    return _ball(found + arb(0, missing)) | _facts(orbit) | {"at": float(where.mid())}


def _differences(value: Any, p: list[Any]) -> Any:
    from flint import arb_mat

    n, h = len(p), [(q * arb(2) ** -50).mid() for q in p]
    move = lambda *signs: value([q + s * d for q, s, d in zip(p, signs, h, strict=True)])  # noqa: E731
    middle, gradient, hessian = value(p), arb_mat(n, 1), arb_mat(n, n)
    unit = np.eye(n, dtype=int).tolist()
    for i in range(n):
        up, down = move(*unit[i]), move(*(-s for s in unit[i]))
        gradient[i, 0], hessian[i, i] = (
            ((up - down) / (2 * h[i])).mid(),
            ((up - 2 * middle + down) / h[i] ** 2).mid(),
        )
    if n == 2:
        mixed = (move(1, 1) - move(1, -1) - move(-1, 1) + move(-1, -1)) / (4 * h[0] * h[1])
        hessian[0, 1] = hessian[1, 0] = mixed.mid()
    return gradient, hessian


# ---- harmonic balance
def _balance(most: int) -> Any:
    def by(case: Case) -> Answer:
        """Take H, 2H and 4H harmonics; the tail of a force with kinks makes an error of order H^-3."""
        asked = case["asked"]
        if any(one.get("kt") == "inf" for one in case["contacts"]):
            found = scenes.answer(case, 41)
            return {
                "value": repr(float(found["value"])),
                "how": "exact orbit in floats: rigid friction has no balance",
            }
        top = asked.get("harmonics") or min(most, _most(case))
        levels = [top] if "harmonics" in asked else [top // 4, top // 2, top]
        values = [scenes.answer(case, level) for level in levels]
        v = [float(one["value"]) for one in values]
        told: Answer = {"harmonics": levels, "values": [repr(one) for one in v], "value": repr(v[-1])}
        if len(v) == 3:
            told["value"] = repr(v[2] + (v[2] - v[1]) / 7.0)
        return told | ({"at": float(values[-1]["at"])} if "at" in values[-1] else {})

    return by


def _most(case: Case) -> int:
    rows = len(case["contacts"])
    circle = any(one.get("limit") == "circle" for one in case["contacts"])
    small = FAR if rows == 1 else FAR // 2 if rows <= 3 else FAR // 4
    if case["asked"]["what"] not in ("amplitude", "half-peak-to-peak", "peak"):
        small = min(small, FAR // 2)
    return 40 if circle and rows > COSTLY else 80 if circle else small


def _march(case: Case) -> Answer:
    import stickslip

    if case["asked"]["what"] not in ("amplitude", "half-peak-to-peak"):
        raise NotImplementedError("a march answers amplitudes alone")
    if len(case["contacts"]) > COSTLY:  # of one sector
        raise NotImplementedError("too many contacts in space for a march")
    found = stickslip.march(scenes.scene(case), frequency_hz=case["asked"]["frequency_hz"])
    if not found.converged:
        raise ArithmeticError(found.status.value)
    half = case["asked"]["what"] == "half-peak-to-peak"
    return {"value": repr(float(found.half_peak_to_peak if half else found.max_abs))}
