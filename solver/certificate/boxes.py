"""Boxes around the unknowns of an orbit: Newton's method in long numbers, and what is written of it."""

from __future__ import annotations

import math
from collections import Counter
from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal, localcontext
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from solver.certificate.checker import Orbit, System
    from solver.response.exact.orbit import Orbit as ExactOrbit
    from solver.response.exact.piecewise import Piecewise

_NEWTON, _WIDER = 12, 4  # steps; boxes tried
_GROWN = 1e11  # by which balls grow before a state is unknown anew
_SLOW = 1e-4  # by which a step falls with a derivative that still serves
_DIGITS = 25
_KNOWN = 1e-31  # rad: a last step of Newton's method after which the order of events is known
_AT_ONCE = 1e-7  # rad: floats may have events this near each other in the wrong order


def set_out(raw: dict[str, Any], piecewise: Piecewise, found: ExactOrbit) -> list[Any]:
    """Put the order of events into a certificate, and where states are unknown anew; return the unknowns."""
    from solver.certificate.checker import Orbit, stated
    from solver.certificate.proof_work import Counted
    from solver.certificate.statement import orbit_of

    system = stated(raw, {}, Counted)
    raw["orbit"], start = orbit_of(piecewise, found, system)
    _set_in_order(raw["orbit"], system, start)
    return _anew(raw["orbit"], Orbit(system, raw["orbit"]), start)


def _set_in_order(raw: dict[str, Any], system: System, start: list[float]) -> None:
    """Set events in their order where floats do not tell it: opposite blades of a disk slip at one instant.

    They are that only up to the rounding of the phases of their forces, so that Newton's method tells it.
    """
    from flint import arb

    from solver.certificate.checker import Orbit

    orbit = Orbit(system, raw)
    first = len(start) - len(orbit.groups)
    where = [0] * len(orbit.groups)  # groups of events in clusters
    for k in range(1, len(where)):
        where[k] = where[k - 1] + (start[first + k] - start[first + k - 1] >= _AT_ONCE)
    contacts = Counter((where[k], orbit.events[i][0]) for k, group in enumerate(orbit.groups) for i in group)
    if len(set(where)) == len(where) or max(contacts.values()) > 1:
        return
    y = [arb(each) for each in start]
    for _ in range(_NEWTON):
        value, slope, _ = orbit.shoot(y, [arb(0)] * len(y))
        steps = slope.mid().solve(value.mid()).entries()
        y = [(each - step).mid() for each, step in zip(y, steps, strict=True)]
        order = sorted(range(len(where)), key=lambda k: (where[k], y[first + k]))
        if order != list(range(len(where))):
            raw["events"] = [raw["events"][i] for k in order for i in orbit.groups[k]]
            y[first:], orbit = [y[first + k] for k in order], Orbit(system, raw)
        elif max(float(abs(step)) for step in steps[first:]) < _KNOWN:
            return


def orbit_at(raw: dict[str, Any], **at: str) -> Orbit:
    """Return the orbit at a frequency [Hz] and a factor of the loads that vary."""
    from solver.certificate.checker import Orbit, stated
    from solver.certificate.proof_work import Counted

    return Orbit(stated(raw, at, Counted), raw["orbit"])


def _anew(raw: dict[str, Any], orbit: Orbit, start: list[float]) -> list[Any]:
    """Let the state be unknown anew before balls have grown too much; return the unknowns then."""
    from flint import arb

    if any(orbit.system.rigid):
        return list(start)
    found, grown = list(start[: len(orbit.anew[0][1])]), 0.0
    starts = orbit.shoot([arb(each) for each in start])[2]
    for piece, (group, (z, *_)) in enumerate(zip(orbit.groups, starts[1:], strict=True), start=1):
        found.append(start[orbit.at[piece]])
        radius = max(float(z[i, 0].rad()) for i in range(orbit.system.n))
        grown = grown or radius
        if radius > _GROWN * grown:
            grown = radius
            raw["events"][group[-1]]["anew"] = True
            found += [z[at, 0].mid() for at in orbit.lasting(orbit.modes[group[-1] + 1])]
    return found


def settled(orbit: Orbit, start: list[Any]) -> tuple[list[Any], float]:
    """Return the unknowns by Newton's method, and its last step relative to their sizes."""
    from flint import arb, ctx

    from solver.certificate.checker import isolated

    y = [arb(each) for each in start]
    sizes, inverse, now = _sizes(orbit, y), None, math.inf
    for _ in range(_NEWTON):
        value, slope, _ = orbit.shoot(y, [arb(0)] * len(y) if inverse is None else None)
        inverse = isolated(slope) if inverse is None else inverse
        steps = (inverse * value).entries()
        y = [(each - step).mid() for each, step in zip(y, steps, strict=True)]
        before, now = now, max(
            float(step.abs_upper()) / size for step, size in zip(steps, sizes, strict=True)
        )  # fmt: skip
        if now <= 2.0 ** (-ctx.prec // 2):
            break
        if now > _SLOW * before:
            inverse = None
    return y, now


def boxed(orbit: Orbit, y: list[Any], now: Any) -> tuple[list[str], tuple[Any, Any]]:
    """Return a box of the unknowns that holds exactly one orbit, and the extremes of its motion."""
    from flint import arb, ctx

    from solver.certificate.checker import RejectedError

    radii = [(arb(2) ** (-ctx.prec * 3 // 5) + now) * size for size in _sizes(orbit, y)]
    for wider in range(_WIDER):
        box = [written(each, radius * 4 ** (2 * wider + 1)) for each, radius in zip(y, radii, strict=True)]
        try:
            return box, orbit.extremes([arb(each) for each in box])
        except RejectedError as error:
            if wider == _WIDER - 1 or error.contact >= 0:
                raise
    raise AssertionError


def _sizes(orbit: Orbit, y: list[Any]) -> list[float]:
    """Return what a change of each unknown is compared with: the largest of its kind, and 1 of instants."""
    n, sizes = orbit.system.n, [1.0] * orbit.size
    sliding, rate = (max(abs(float(each)) for each in y[k : k + n]) or 1.0 for k in (0, n))
    for start, states in orbit.anew.values():
        for k, at in enumerate(states, start=start):
            sizes[k] = rate if n <= at < 2 * n else sliding
    return sizes


def digits(middle: Any) -> str:
    """Return a number as text with the digits of the precision."""
    from flint import ctx

    return str(middle.str(ctx.prec * 3 // 10, radius=False))


def written(middle: Any, radius: Any) -> str:
    """Return a ball as text."""
    return f"{digits(middle)} +/- {radius.upper().str(5, radius=False)}"


def claimed(raw: dict[str, Any], found: dict[str, Any]) -> dict[str, tuple[float, float]]:
    """Put what is proved into the certificate; return it as floats; all rounded outward."""
    raw["claims"] = {
        name: [_decimal(each.lower(), ROUND_FLOOR), _decimal(each.upper(), ROUND_CEILING)]
        for name, each in found.items()
    }
    return {
        name: (math.nextafter(float(each.lower()), -math.inf), math.nextafter(float(each.upper()), math.inf))
        for name, each in found.items()
    }


def _decimal(exact: Any, rounding: str) -> str:
    """Return a number rounded to decimals."""
    mantissa, exponent = map(int, exact.man_exp())
    with localcontext(prec=_DIGITS, rounding=rounding):
        return str(+Decimal(mantissa << exponent) if exponent >= 0 else Decimal(mantissa) / (1 << -exponent))
