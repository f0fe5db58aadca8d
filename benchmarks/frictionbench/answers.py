"""Answers by two ways that share no code, with an enclosure: `python -m benchmarks.frictionbench answers`."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Iterator
from typing import Any

import stickslip
from benchmarks.frictionbench import proofs, scenes
from benchmarks.frictionbench.closed_forms import FORMS
from benchmarks.frictionbench.model import HERE, Case, NotOfferedError, load
from benchmarks.frictionbench.multipliers import SHOWN
from solver.response.stability.floquet import stability

Answer = dict[str, Any]
WANTED = 10  # digits in which two ways are to agree
FIRST, FAR, NEAR, CIRCLES = (
    40,
    960,
    160,
    80,
)  # harmonics of the balance: the first, the most of few contacts, of optima, of circles
PATCH, FACE = 12, 60  # contacts in space beyond which the balance is not taken so far, and not marched
BITS, NONE, ATTRACTING = 256, "none", "attracting"
SMALL = 1e-10  # of the value, by which it changes with the last doubling where no more is done
BESIDE = 1e-4  # of the frequency of a peak, by which its neighbours lie apart


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
    for way, by in _ways(most):
        # Time marching is the third way, where two are not to be had or do not agree so well.
        if way == "march" and (len(ways) > 1 and _agreed(list(ways.values())) >= WANTED):
            continue
        begun = time.process_time()
        try:
            ways[way] = by(case) | {"seconds": round(time.process_time() - begun, 2)}
        except NotOfferedError as error:
            failed[way] = str(error)
        except ArithmeticError as error:
            failed[way] = f"{type(error).__name__}: {error}"
    return _told(case, ways, failed)


def _ways(most: int) -> Iterator[tuple[str, Callable[[Case], Answer]]]:
    yield "closed form", _closed
    yield "events", proofs.prove
    yield "floats", _floats
    yield "balance", lambda case: _balance(case, most)
    yield "march", _march


def _agreed(ways: list[Answer]) -> float:
    """Return in how many digits the first way and that of the others nearest to it agree."""
    first, *others = (float(one["value"]) for one in ways)
    return max((digits(other, first) for other in others), default=0.0)


def _told(case: Case, ways: dict[str, Answer], failed: dict[str, str]) -> Answer:
    order = [way for way in ("closed form", "events", "floats", "march", "balance") if way in ways]
    if not order:
        raise ArithmeticError(f"{case['name']}: no way leads to an answer: {failed}")
    best = ways[order[0]]
    agreed = _agreed([ways[way] for way in order])
    told: Answer = {"name": case["name"], "value": best["value"], "enclosure": best.get("enclosure")}
    if "at" in best:
        told["at"] = best["at"]
    told["proof"] = ways.get("events", {}).pop("proof", None)
    told |= attraction(case, ways)
    told |= {"ways": len(order), "agreed_digits": round(agreed, 1), "by": ways}
    if failed := {way: why for way, why in failed.items() if why != NONE}:
        told["not_by"] = failed
    if note := case["asked"].get("which") or SETS.get(case["asked"]["what"]):
        told["set"] = note
    return told


def attraction(case: Case, ways: dict[str, Answer]) -> Answer:
    """Return whether the orbit attracts, with its multipliers: bounds of a proof, else estimates alone."""
    if "harmonics" in case["asked"] or case["asked"]["what"] == "amplification":
        closed = ways.get("closed form", {}).pop("attracts", None)
        return {"attracts": closed, "multipliers": "none: of one harmonic alone, or of no orbit"}
    found = ways.get("events", {}).pop("multipliers", None)
    if found is None:
        one = stability(scenes.solved(scenes.scene(case), case["asked"], CIRCLES // 2))
        every = [
            [round(float(part), 9) for part in (each.real, each.imag)] for each in one.multipliers[:SHOWN]
        ]
        if one.neutral:
            raise ArithmeticError(f"{case['name']}: which contacts stick all the time is not known")
        return {"attracts": one.stable, "multipliers": {"estimates": every, "neutral": []}}
    low, high = (float(each) for each in found["largest"])
    if low <= 1.0 <= high:
        raise ArithmeticError(f"{case['name']}: whether it attracts is not known, a multiplier is about 1")
    return {"attracts": high < 1.0, "multipliers": found}


SETS = {
    "half-peak-to-peak": "the mean is any within the limits of what sticks: half the range is asked for",
    "amplification": "a supremum: no disk reaches it",
}


def digits(found: float, known: float) -> float:
    """Return in how many digits two numbers agree, at most 16."""
    return min(16.0, -math.log10(max(abs(found - known) / abs(known), 1e-16)))


def _closed(case: Case) -> Answer:
    if case["name"] not in FORMS:
        raise NotOfferedError(NONE)
    with proofs.precision(BITS):
        found = FORMS[case["name"]](case)
        return proofs.ball(found["value"]) | {
            key: float(value.mid()) if key == "at" else value
            for key, value in found.items()
            if key != "value"
        }


def _floats(case: Case) -> Answer:
    if all(one.get("kt") != "inf" for one in case["contacts"]):
        raise NotOfferedError(NONE)
    return {"value": repr(float(scenes.answer(case, 41)["value"])), "how": "rigid friction has no balance"}


def _balance(case: Case, most: int) -> Answer:
    """Double H until the value is known; the tail of a force with kinks makes an error of order H^-3."""
    asked, more = case["asked"], {}
    if any(one.get("kt") == "inf" for one in case["contacts"]):
        raise NotOfferedError("rigid friction has no balance")
    if asked["what"] == "amplification":
        raise NotOfferedError("a formula")
    if asked.get("which") == ATTRACTING and asked["what"] == "amplitude":
        raise NotOfferedError("it leads to the shorter motion, which repels")
    if "harmonics" in asked:
        return {"value": repr(float(scenes.answer(case, asked["harmonics"])["value"]))}
    top, levels, v = min(most, _most(case)), list[int](), list[float]()
    if asked["what"] == "peak":
        more["at"] = scenes.answer(case, NEAR)["at"]
    while len(v) < 3 or (2 * levels[-1] <= top and abs(v[-1] - v[-2]) > SMALL * abs(v[-1])):
        levels.append(2 * levels[-1] if levels else min(FIRST, top // 4))
        if asked["what"] == "peak":
            v.append(_peak_near(case, more["at"], levels[-1]))
            continue
        found = scenes.answer(case, levels[-1])
        v.append(float(found["value"]))
        more |= {"at": found["at"]} if "at" in found else {}
    return {
        "harmonics": levels,
        "values": [repr(one) for one in v],
        "value": repr(v[-1] + (v[-1] - v[-2]) / 7.0),
    } | more


def _peak_near(case: Case, hz: float, H: int) -> float:
    """Return the vertex of the parabola through the amplitudes at three frequencies."""
    made = scenes.scene(case)
    left, middle, right = (
        scenes.solved(made, {"frequency_hz": hz * (1.0 + side * BESIDE)}, H).max_abs for side in (-1, 0, 1)
    )
    return float(middle - (right - left) ** 2 / (8.0 * (right - 2.0 * middle + left)))


def _most(case: Case) -> int:
    """Return how many harmonics are affordable."""
    rows = len(case["contacts"])
    if any(one["law"] == "coulomb-3d" for one in case["contacts"]):
        return CIRCLES if rows <= PATCH else CIRCLES // 2 if rows <= FACE else CIRCLES // 8
    if "frequency_hz" in case["asked"] and "which" in case["asked"]:  # all solutions are looked for
        return CIRCLES
    if case["asked"]["what"] in ("least-peak", "limit-cycle"):
        return NEAR
    return FAR if rows <= 4 and not any("kn" in one for one in case["contacts"]) else FAR // 3


def _march(case: Case) -> Answer:
    asked = case["asked"]
    if (
        asked["what"] not in ("amplitude", "half-peak-to-peak")
        or asked.get("which", ATTRACTING) != ATTRACTING
    ):
        raise NotOfferedError("a march answers single amplitudes alone")
    if len(case["contacts"]) > FACE:  # of one sector
        raise NotOfferedError("too many contacts in space for a march")
    found = stickslip.march(scenes.scene(case), frequency_hz=asked["frequency_hz"])
    if not found.converged:
        raise ArithmeticError(found.status.value)
    half = asked["what"] == "half-peak-to-peak"
    return {"value": repr(float(found.half_peak_to_peak if half else found.max_abs))}
