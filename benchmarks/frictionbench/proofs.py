"""Proved answers: exact events in extended precision, enclosed in balls by Krawczyk's operator.

What is proved is checked by `stickslip/lab/proofs/checker.py`, which needs nothing of stickslip; only where
to look comes from the balance.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from decimal import Decimal
from typing import Any

from flint import arb, ctx

import stickslip
from benchmarks.frictionbench import multipliers, scenes
from benchmarks.frictionbench.model import Case, NotOfferedError, piecewise_linear
from stickslip.lab.proofs.certified_cycles import certify_cycle
from stickslip.lab.proofs.checker import STICK, Orbit, System, around, radii

Answer = dict[str, Any]
HARMONICS = 41  # of the balance that says where to look
WORK = 1e5  # millions of products of balls


class NotProvedError(ArithmeticError):
    """No orbit was found, or an inequality fails."""


def prove(case: Case) -> Answer:
    """Return value, enclosure, the proof and what is known of the orbit.

    Raises
    ------
    NotOfferedError
        The contacts are not piecewise linear, or what is asked is no property of one orbit.
    NotProvedError
        The proof does not succeed.
    """
    asked = case["asked"]
    if "harmonics" in asked or asked["what"] == "amplification":
        raise NotOfferedError("a supremum" if asked["what"] == "amplification" else "of one harmonic alone")
    case = piecewise_linear(case)
    if asked["what"] == "limit-cycle":
        made = scenes.scene(case)
        return told(certify_cycle(made, scenes.limit_cycle(made, asked, HARMONICS), most_work=WORK), asked)
    made, hz, least = scenes.scene(case), asked.get("frequency_hz"), asked.get("variable", "")
    if least:
        guess = scenes.answer(case, HARMONICS)["at"]
        made = made.with_values({least: guess})
    if hz is None:
        highest = stickslip.sweep(made, harmonics=HARMONICS).peak
        if highest is None:
            raise NotProvedError("there is no peak")
        hz = highest.at
    near = scenes.solved(made, {**asked, "frequency_hz": hz}, HARMONICS)
    proof = stickslip.certify(near, peak=asked["what"] == "peak", least_over=least, most_work=WORK)
    found = told(proof, asked)
    return found | ({"at": float(guess * sum(proof.load_factor) / 2.0)} if least else {})


def told(proof: stickslip.solutions.Certificate, asked: Answer) -> Answer:
    """Return what a proof says of what is asked."""
    if proof.certificate is None:
        raise NotProvedError(proof.reason or proof.status.value)
    known = {"events": proof.events, "held": list(proof.held), "proof": proof.certificate}
    with precision(proof.bits):
        known["multipliers"] = multipliers.of_proof(proof.certificate)
    if asked["what"] in ("peak", "limit-cycle"):
        known["at"] = sum(proof.frequency_hz) / 2.0
    if asked["what"] == "loss":
        with precision(proof.bits):
            return ball(loss(proof.certificate)) | known
    key = {"half-peak-to-peak": "half_peak_to_peak", "peak": "peak", "least-peak": "least_peak"}
    return between(*proof.certificate["claims"][key.get(asked["what"], "max_abs")]) | known


def between(low: str, high: str) -> Answer:
    """Return a value with its enclosure from the decimals of a proof."""
    return {"value": str(+((Decimal(low) + Decimal(high)) / 2)), "enclosure": [low, high]}


def ball(value: Any) -> Answer:
    """Return a value with its enclosure from a ball."""
    low, high = (one.mid().str(24, radius=False) for one in (value.lower(), value.upper()))
    return {"value": value.mid().str(20, radius=False), "enclosure": [low, high]}


@contextmanager
def precision(bits: int) -> Iterator[None]:
    """Let balls have so many bits inside."""
    before, ctx.prec = ctx.prec, bits
    try:
        yield
    finally:
        ctx.prec = before


def loss(raw: dict[str, Any]) -> Any:
    """Return the friction work of a period: μN times the way of every slider, under constant loads."""
    orbit = Orbit(System(raw["system"], {}), raw["orbit"])
    box = [arb(one) for one in raw["proof"]["unknowns"]]
    away = radii(box)
    *_, starts = orbit.shoot([one.mid() for one in box], away)
    contacts, n = orbit.system.contacts, orbit.system.n
    places = defaultdict(list)
    for (z, D, *_), group in zip(starts[1:], orbit.groups, strict=True):
        w = around(z, D.size @ away)
        for j, _, new in (orbit.events[i] for i in group):
            if contacts[j]["kn"] or contacts[j]["waves"][1:]:
                raise NotOfferedError("losses under moving loads")
            if new == STICK:
                slider = orbit.system.row([*contacts[j]["row"], [2 * n + j, -1 / arb(contacts[j]["kt"])]])
                places[j].append((slider * w)[0, 0])
    return sum(
        arb(contacts[j]["mu"]) * arb(contacts[j]["waves"][0][1]) * abs(one - other)
        for j, every in places.items()
        for one, other in zip(every, [*every[1:], every[0]], strict=True)
    )
