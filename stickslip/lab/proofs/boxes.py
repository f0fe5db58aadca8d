"""Boxes around the unknowns of an orbit: Newton's method in long numbers, and what is written of it."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Sequence
from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal, localcontext
from itertools import accumulate, pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from stickslip.lab.proofs.checker import Orbit
    from stickslip.lab.proofs.exact.flow import FlowPiece
    from stickslip.lab.proofs.exact.piecewise import Piecewise

_NEWTON, _BOXES = 12, 4  # steps; boxes tried
_WIDE, _INFLATED = (
    4.0,
    2.0,
)  # the first box by how far off it may be, others by what Krawczyk's operator needs
_GROWN = 1e4  # by which a derivative is off more, and a state is unknown anew
_ANEW_BITS = 128
_FEW = 100  # instants of events times the size of a state for which none is
_LINEAR = 1e-11  # of a step, which the next is about in floats
_SLOW = 1e-4  # by which a step falls with a derivative that still serves
_DIGITS = 25
_AT_ONCE = 1e-7  # of 1 / ω: floats may have events this near each other in the wrong order
_KNOWN, _ORDER_BITS = 1e-24, 256  # of that, a last step after which their order is known; precision


def set_out(raw: dict[str, Any], piecewise: Piecewise, pieces: Sequence[FlowPiece]) -> list[Any]:
    """Put the order of events into a certificate; return the unknowns."""
    from stickslip.lab.proofs.statement import orbit_of

    raw["orbit"], start = orbit_of(piecewise, pieces, raw["system"])
    return _begun_anew(raw, _set_in_order(raw, start, _AT_ONCE / piecewise.omega))


def _begun_anew(raw: dict[str, Any], y: list[Any]) -> list[Any]:
    """Make states unknown anew before balls have grown too much; return the unknowns."""
    from flint import arb, ctx

    with ctx.workprec(_ANEW_BITS):
        orbit, y = orbit_at(raw), [each.mid() for each in map(arb, y)]
        if len(orbit.groups) * orbit.system.d <= _FEW:
            return y
        sizes, starts = np.array(_every_size(orbit, y)), orbit.shoot(y, np.zeros(len(y)))[2][1:]
    last = math.inf
    for (z, D, *_), group in zip(starts, orbit.groups, strict=True):
        off = float((D.off.max(axis=1) / sizes).max())
        last = min(last, off)
        if off > _GROWN * last:
            last, raw["orbit"]["events"][group[-1]]["anew"] = off, True
            y += [each.mid() for each in z.entries()]
    return y


def _set_in_order(raw: dict[str, Any], start: list[float], at_once: float) -> list[Any]:
    """Set events in their order where floats do not tell it: opposite blades of a disk slip at one instant.

    They are that only up to the rounding of the phases of their forces, so that Newton's method tells it.
    """
    from flint import arb, ctx

    from stickslip.lab.proofs.checker import inverse, rough

    with ctx.workprec(_ANEW_BITS):
        orbit, y = orbit_at(raw), [arb(each) for each in start]
        first = len(orbit.unknown)
        where = list(accumulate((length >= at_once for length in start[first + 1 :]), initial=0))  # clusters
        clusters = list(zip(where, orbit.groups, strict=False))
        contacts = Counter((at, orbit.events[i][0]) for at, group in clusters for i in group)
        if len(set(where)) == len(where) or max(contacts.values()) > 1:
            return y
        for _ in range(_NEWTON):
            value, slope, _ = orbit.shoot(y, np.zeros(len(y)))
            near = inverse(slope, np.array(_sizes(orbit, y)))
            steps = (near.middle @ rough(value).middle)[:, 0]
            y = [(each - step).mid() for each, step in zip(y, steps, strict=True)]
            ends = list(accumulate(y[first:]))
            order = sorted(range(len(ends)), key=lambda k: (where[k], ends[k]))
            if order != list(range(len(ends))):
                events = raw["orbit"]["events"]
                raw["orbit"]["events"] = [
                    events[i] for k in order if k < len(orbit.groups) for i in orbit.groups[k]
                ]
                ends = [arb(0), *(ends[k] for k in order)]
                y[first:] = [(after - before).mid() for before, after in pairwise(ends)]
                orbit = orbit_at(raw)
            elif float(abs(steps[first:]).max()) < _KNOWN * at_once:
                break
    return y


def orbit_at(raw: dict[str, Any], **at: str) -> Orbit:
    """Return the orbit at a frequency [Hz] and a factor of the loads that vary."""
    from stickslip.lab.proofs.checker import Orbit
    from stickslip.lab.proofs.proof_work import counted

    return Orbit(counted(raw["system"], at), raw["orbit"])


def settled(
    orbit: Orbit, start: list[Any], enough: float = 0.0, near: Any = None
) -> tuple[list[Any], float, Any]:
    """Return the unknowns by Newton's method, about how far off they are relative to their sizes, an inverse.

    `near`: the inverse of a derivative not far from here, in floats; `enough`: how far off they may be.
    """
    from flint import arb, ctx

    from stickslip.lab.proofs.checker import inverse, rough

    y, now, own = [arb(each) for each in start], math.inf, near is None
    sizes = np.array(_sizes(orbit, y))
    for _ in range(_NEWTON):
        value, slope, _ = orbit.shoot(y, np.zeros(len(y)) if near is None else None)
        near = inverse(slope, sizes).middle if near is None else near
        rest = rough(value)
        steps = (near @ rest.middle)[:, 0]
        y = [(each - step).mid() for each, step in zip(y, steps.tolist(), strict=True)]
        before, now = now, float((abs(steps) / sizes).max())
        unsure = float(((abs(near) @ rest.off)[:, 0] / sizes).max())
        gained = max(now, _LINEAR) if own else min(1.0, now / before) if before < math.inf else 1.0
        left = max(now * gained, unsure)
        if left <= max(2.0 ** (-ctx.prec * 3 // 5), unsure, enough):  # no step tells more than its rounding
            break
        if now > _SLOW * before:
            near, own = None, True
    return y, left, near


def boxed(orbit: Orbit, y: list[Any], now: float) -> tuple[list[str], tuple[Any, Any, Any]]:
    """Return a box of the unknowns that holds exactly one orbit, and the extremes of its motion.

    `now`: about how far off they are relative to their sizes.
    """
    from flint import arb, ctx

    from stickslip.lab.proofs.checker import RejectedError

    away = _WIDE * (2.0 ** (-ctx.prec * 3 // 5) + now) * np.array(_sizes(orbit, y))
    for tried in range(_BOXES):
        box = [written(each, arb(radius)) for each, radius in zip(y, away.tolist(), strict=True)]
        try:
            return box, orbit.extremes([arb(each) for each in box])
        except RejectedError as error:
            if tried == _BOXES - 1 or len(error.args) > 1:
                raise
            away = np.maximum(away, _INFLATED * orbit.moved(y, away)[0])
    raise AssertionError


def _sizes(orbit: Orbit, y: list[Any]) -> list[float]:
    """Return what a change of each unknown is compared with."""
    every, lengths = _every_size(orbit, y), [float(each) for each in orbit.lengths(y)]
    count = orbit.lasts - len(orbit.unknown)
    return [every[at] for at in orbit.unknown] + [max(lengths)] * count + every * len(orbit.anew)


def _every_size(orbit: Orbit, y: list[Any]) -> list[float]:
    """Return the size of each number of a state: the largest of its kind where it begins; of forces by kt."""
    n = orbit.system.n
    moved, fast = (
        max((abs(float(y[k])) for k, at in enumerate(orbit.unknown) if low <= at < low + n), default=1.0)
        or 1.0
        for low in (0, n)
    )
    forces = [(each["kt"] or 0.0) * moved or 1.0 for each in orbit.system.contacts]
    return [moved] * n + [fast] * n + forces + [1.0] * (orbit.system.d - orbit.system.one)


def digits(middle: Any) -> str:
    """Return a number as text with the digits of the precision."""
    from flint import ctx

    return str(middle.str(ctx.prec * 3 // 10, radius=False))


def written(middle: Any, radius: Any) -> str:
    """Return a ball as text."""
    return f"{digits(middle)} +/- {radius.upper().str(5, radius=False)}"


def claimed(raw: dict[str, Any], found: dict[str, Any]) -> dict[str, tuple[float, float]]:
    """Put what is proved into the certificate, and see that it can be read; return it as floats.

    All are rounded outward.
    """
    from stickslip.lab.proofs.checker import stated

    raw["claims"] = {
        name: [_decimal(each.lower(), ROUND_FLOOR), _decimal(each.upper(), ROUND_CEILING)]
        for name, each in found.items()
    }
    stated(json.loads(json.dumps(raw)))
    return {
        name: (math.nextafter(float(each.lower()), -math.inf), math.nextafter(float(each.upper()), math.inf))
        for name, each in found.items()
    }


def _decimal(exact: Any, rounding: str) -> str:
    """Return a number rounded to decimals."""
    mantissa, exponent = map(int, exact.man_exp())
    with localcontext(prec=_DIGITS, rounding=rounding):
        return str(+Decimal(mantissa << exponent) if exponent >= 0 else Decimal(mantissa) / (1 << -exponent))
