"""Proved answers: exact events in extended precision, enclosed in balls by Krawczyk's operator.

What is proved is checked by `solver/certificate/checker.py`, which needs nothing of stickslip; only where to
look comes from the balance.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from decimal import Decimal
from types import SimpleNamespace
from typing import Any

import numpy as np
from flint import arb, arb_mat, ctx

import stickslip
from benchmarks.frictionbench import scenes
from benchmarks.frictionbench.model import Case, piecewise_linear
from solver.certificate.boxes import boxed, settled
from solver.certificate.checker import STICK, Orbit, System, stated
from solver.certificate.statement import orbit_of, system_of
from solver.response.exact.flow import Flow
from solver.response.exact.piecewise import Piecewise

Answer = dict[str, Any]
HARMONICS = 41  # of the balance that says where to look
WORK = 1e5  # millions of products of balls
SETTLED = 600  # periods of a march into an attracting cycle
SOON = 2.0**-10  # rad after an event at which a cycle begins


class NotProvedError(ArithmeticError):
    """No orbit was found, or an inequality fails."""


def prove(case: Case) -> Answer:
    """Return value, enclosure, the proof and what is known of the orbit.

    Raises
    ------
    NotImplementedError
        The contacts are not piecewise linear, or what is asked is no property of one orbit.
    NotProvedError
        The proof does not succeed.
    """
    asked = case["asked"]
    if "harmonics" in asked or asked["what"] == "amplification":
        raise NotImplementedError(
            "a supremum" if asked["what"] == "amplification" else "of one harmonic alone"
        )
    case = piecewise_linear(case)
    if asked["what"] == "limit-cycle":
        return cycle(case)
    made, hz, least = scenes.scene(case), asked.get("frequency_hz"), asked.get("variable", "")
    if least:
        guess = scenes.answer(case, HARMONICS)["at"]
        made = made.with_values({least: guess})
    if hz is None:
        hz = stickslip.sweep(made, harmonics=HARMONICS).peak.at
    near = scenes.solved(made, {**asked, "frequency_hz": hz}, HARMONICS)
    proof = stickslip.certify(near, peak=asked["what"] == "peak", least_over=least, most_work=WORK)
    if not proof.reached:
        raise NotProvedError(proof.reason or proof.status.value)
    told = {"events": proof.events, "held": list(proof.held), "proof": proof.certificate}
    claims = proof.certificate["claims"]
    if asked["what"] == "loss":
        with precision(proof.bits):
            return ball(loss(proof.certificate)) | told
    key = {"half-peak-to-peak": "half_peak_to_peak", "peak": "peak", "least-peak": "least_peak"}
    if least:
        told["at"] = float(guess * sum(proof.load_factor) / 2.0)
    elif asked["what"] == "peak":
        told["at"] = sum(proof.frequency_hz) / 2.0
    return between(*claims[key.get(asked["what"], "max_abs")]) | told


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
    orbit = Orbit(stated(raw, {}), raw["orbit"])
    box = [arb(one) for one in raw["orbit"]["unknowns"]]
    y = [one.mid() for one in box]
    away = [one - middle for one, middle in zip(box, y, strict=True)]
    *_, starts = orbit.shoot(y, away)
    places = defaultdict(list)
    for (z, D, first), group in zip(starts[1:], orbit.groups, strict=True):
        w = z + D * arb_column(away[first : first + D.ncols()])
        for j, _, new in (orbit.events[i] for i in group):
            if not orbit.system.constant[j]:
                raise NotImplementedError("losses under moving loads")
            if new == STICK:
                places[j].append(w[2 * orbit.system.n + j, 0])
    contacts = orbit.system.contacts
    return sum(
        arb(contacts[j]["mu"]) * arb(contacts[j]["load"][0][1]) * abs(one - other)
        for j, every in places.items()
        for one, other in zip(every, [*every[1:], every[0]], strict=True)
    )


def arb_column(entries: list[Any]) -> Any:
    """Return a column of balls."""
    return arb_mat([[each] for each in entries])


# ---- cycles
class FreeCycle(Orbit):
    """A motion without forces: its period ends `SOON` after its last event, whenever that is."""

    def length(self, y: list[Any], piece: int) -> Any:
        """As that of an orbit; how long the last piece is, is known."""
        return arb(SOON) if piece == len(self.groups) else super().length(y, piece)

    def shoot(self, y: list[Any], away: list[Any] | None = None) -> Any:
        """As that of an orbit; the last piece does not become shorter where the last event is later."""
        values, slope, starts = super().shoot(y, away)
        if away is not None:
            (z, D, first), mode, system = starts[-1], self.modes[-1], self.system
            end = system.after(mode, z + D * arb_column(away[first : first + D.ncols()]), arb(SOON), 6)
            rate, lasting = system.mode(mode)[0] * end, self.anew[0][1]
            for row, at in enumerate(lasting, start=len(y) - len(lasting)):
                slope[row, self.at[-1]] += rate[at, 0]
        return values, slope, starts


def cycle(case: Case) -> Answer:
    """Return the largest displacement of a limit cycle: of an attracting one a march leads to it."""
    asked, guess = case["asked"], scenes.answer(case, 161)
    system = Piecewise(scenes.scene(case), 2.0 * math.pi * guess["at"])
    system.base[:, system.nd :] = 0.0  # the scene has a force so as to be one
    w, state = system.at_rest()
    seen = case["structure"]["dofs"].index(asked["dof"])
    w[seen] = guess["value"]
    for member in system.members:
        place = float(system.d[member.slider] @ w[: system.n])
        most = member.mu * float(member.given @ w) / system.kt[member.slider]
        w[system.elastic_at[member.slider]] = place - np.clip(place, -most, most)
    for i, (_, row, _, gap) in enumerate(system.gaps):
        state.pressed[i] = row @ w[: system.n] > gap
    flow = Flow(system, w, state, 0.0)
    if asked["which"] == "attracting":
        flow.run(2.0 * math.pi * SETTLED)
    pieces = _once(flow)
    raw = {"system": system_of(system, guess["at"]) | {"forces": []}}
    with precision(256):
        made = System(raw["system"])
        raw["orbit"], start = orbit_of(system, SimpleNamespace(pieces=pieces), made)
        orbit = FreeCycle(made, raw["orbit"])
        y, now = settled(orbit, start)
        low, high = boxed(orbit, y, now)[1]
        period, found = float(y[orbit.at[-1]] - orbit.begins) + SOON, ball(high.max(-low))
    return found | {"events": len(orbit.events), "at": guess["at"] * 2.0 * math.pi / period}


def _once(flow: Flow) -> list[Any]:
    """Return the pieces of one period, from `SOON` after a slider came to rest."""
    flow.tau = 0.0
    flow.run(4.4 * math.pi)
    before, rests = flow.pieces[0], []
    for at, piece in enumerate(flow.pieces[1:], start=1):
        slid, state = before.state.sliders, piece.state
        if slid[0] != STICK and state.sliders[0] == STICK:
            rests.append((at, int(slid[0]), state.key))
        before = piece
    again = next((at for at, *how in rests[1:] if tuple(how) == rests[0][1:]), None)
    if again is None:
        raise NotProvedError("nothing slips twice alike in two periods")
    pieces = flow.pieces[rests[0][0] : again + 1]
    follow = Flow(flow.system, pieces[0].w, pieces[0].state.copy(), pieces[0].tau)
    follow.run(SOON)
    first = pieces[0]
    return [SimpleNamespace(tau=follow.tau, w=follow.w, state=first.state, mode=first.mode), *pieces[1:]]
