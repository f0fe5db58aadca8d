"""The proof that a periodic response exists: `certify`, and the certificate it gives.

The balance says where the orbit is, floats follow it from event to event, Newton's method in long numbers
puts a box around its unknowns; all that is claimed is proved by `solver.certificate.checker`, which knows
nothing of this.
"""

from __future__ import annotations

import json
import math
import time
from dataclasses import dataclass
from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal, localcontext
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from solver.errors import MissingExtraError, SettingError
from solver.response.exact.beside import orbit_beside
from solver.response.solution import Solution
from solver.response.solve import solve
from solver.results.files import whole
from solver.results.told import Piece
from solver.scene.cyclic.annulus import annulus

if TYPE_CHECKING:
    from solver.certificate.checker import Orbit, RejectedError
    from solver.response.exact.orbit import Orbit as ExactOrbit
    from solver.response.exact.piecewise import Piecewise

_BITS = (128, 256)
_NEWTON, _WIDER, _MOVES = 12, 4, 8  # steps; boxes tried; contacts moved
_GROWN = 1e11  # by which balls grow before a state is unknown anew
_SLOW = 1e-4  # by which a step falls with a derivative that still serves
_NARROW = 1e-16  # relative width of what is claimed; else more bits
_DIGITS = 25
_PEAK_BITS, _PEAK_WIDTH = 256, 1e-21  # half the relative width of the range a peak is proved in
_PEAK_STEP, _PEAK_LEAST, _PEAK_TRIES = 1e-4, 1e-14, 60  # of the parabolas that find it, relative
_MOVED = 1e-9  # of its limit, by which the force of what sticks at the edge of it is moved inward


class CertificateStatus(Enum):
    """Whether a response was proved; the value is a sentence a user can act on."""

    CERTIFIED = "Proved: exactly one periodic response with these events lies in the enclosure."
    NOT_CERTIFIED = (
        "Not proved, `reason` says which inequality fails: change a parameter a little, away from where a "
        "contact only just slips, opens or touches."
    )
    NO_ORBIT = "Not proved: no periodic motion was found from event to event beside this solution."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Certificate(Piece):
    """A proof of a periodic response, or why there is none."""

    JSON: ClassVar = (
        "certified=reached status reason max_abs frequency_hz half_peak_to_peak events held bits seconds"
        " certificate"
    )

    status: Annotated[CertificateStatus, "Whether it was proved."]
    reason: Annotated[str, "Which inequality fails, by how much; empty if none does."]
    max_abs: Annotated[
        tuple[float, float], "Bounds of the largest |x| of the observed DOF [m]; NaN if there are none."
    ]
    frequency_hz: Annotated[tuple[float, float], "The frequency; of a peak, bounds of it [Hz]."]
    half_peak_to_peak: Annotated[tuple[float, float], "Bounds of (max x - min x) / 2 [m]."]
    events: Annotated[int, "Changes of a contact's state in a period."]
    held: Annotated[
        tuple[str, ...],
        "Contacts that stick all the time. What is proved is for the force left in them that it names: "
        "`max_abs` depends on it.",
    ]
    bits: Annotated[int, "Precision it was proved with."]
    seconds: Annotated[float, "Time taken [s]."]
    certificate: Annotated[dict[str, Any] | None, "What `stickslip check-proof` checks; None if not proved."]

    @property
    def reached(self) -> bool:
        """Whether it is proved."""
        return self.status is CertificateStatus.CERTIFIED

    def save(self, file: str | Path) -> None:
        """Write the certificate to a JSON file.

        Raises
        ------
        SettingError
            There is none.
        """
        if self.certificate is None:
            raise SettingError(
                "certificate", self.reason or self.status.value, "must have been proved to be saved"
            )
        with whole(Path(file)) as temporary:
            temporary.write_text(json.dumps(self.certificate), encoding="utf-8")


def certify(solution: Solution, *, peak: bool = False) -> Certificate:
    """Prove a periodic response of piecewise linear contacts, and enclose its amplitude.

    Between two events all is linear, so the orbit is a zero of finitely many equations: Krawczyk's operator
    shows that it exists and is the only one near, interval arithmetic that no other event happens. See
    docs/certificates.md.

    Parameters
    ----------
    solution : one that converged, of contacts of the laws coulomb, elastic-normal and gap.
    peak : prove the peak of max|x| over the frequency beside it instead.

    Raises
    ------
    SettingError
        It did not converge, or the scene has a part that has no place in an exact solution.
    MissingExtraError
        Without python-flint.
    """
    begun = time.perf_counter()
    try:
        from solver.certificate.checker import RejectedError
        from solver.certificate.statement import system_of
    except ImportError as error:
        raise MissingExtraError("python-flint", "proof") from error
    if not solution.converged:
        raise SettingError("solution", solution.status.value, "must have converged")
    if solution.scene.structure.has_sectors:  # a disk written out is a system like any other
        solution = solve(
            annulus(solution.scene), frequency_hz=solution.frequency_hz, harmonics=solution.n_harmonics
        )
    piecewise, orbit = orbit_beside(solution, polish=1)  # exact numbers go on from there
    raw: dict[str, Any] = {"certifies": "periodic orbit", "scene": solution.scene.name}
    status, reason, bounds = CertificateStatus.NO_ORBIT, "", {}
    if orbit is not None:
        raw["system"] = system_of(piecewise, solution.frequency_hz)
        try:
            bounds = (_peak_proved if peak else _proved)(raw, piecewise, orbit)
            status = CertificateStatus.CERTIFIED
        except RejectedError as error:
            status, reason = CertificateStatus.NOT_CERTIFIED, str(error)
    unknown = (math.nan, math.nan)
    contacts, course = raw.get("system", {}).get("contacts", ()), raw.get("orbit", {})
    return Certificate(
        status=status, reason=reason, max_abs=bounds.get("peak", bounds.get("max_abs", unknown)),
        frequency_hz=bounds.get("frequency_hz", (solution.frequency_hz, solution.frequency_hz)),
        half_peak_to_peak=bounds.get("half_peak_to_peak", unknown), events=len(course.get("events", ())),
        held=tuple(contacts[int(j)]["name"] for j in course.get("fixed_sliders", ())),
        bits=raw.get("bits", 0), seconds=time.perf_counter() - begun, certificate=raw if bounds else None,
    )  # fmt: skip


def _proved(raw: dict[str, Any], piecewise: Piecewise, found: ExactOrbit) -> dict[str, tuple[float, float]]:
    """Complete a certificate by the box of its unknowns and by what it claims; return that as floats."""
    from flint import ctx

    from solver.certificate.checker import RejectedError

    kept = ctx.prec
    try:
        for bits in _BITS:
            ctx.prec = raw["bits"] = bits
            try:
                low, high = _kept_inward(raw, _stated(raw, piecewise, found))
            except RejectedError as error:
                if bits == _BITS[-1] or error.contact >= 0:
                    raise
                continue
            if bits == _BITS[-1] or (low.rad() + high.rad()) <= _NARROW * (high - low):
                return _claimed(raw, {"max_abs": high.max(-low), "half_peak_to_peak": (high - low) / 2})
        raise AssertionError
    finally:
        ctx.prec = kept


def _peak_proved(
    raw: dict[str, Any], piecewise: Piecewise, found: ExactOrbit
) -> dict[str, tuple[float, float]]:
    """Complete a certificate of a peak: orbits below, at and above it, and over that range; as `_proved`."""
    from flint import arb, ctx

    from solver.certificate.checker import prove

    kept = ctx.prec
    try:
        ctx.prec = raw["bits"] = _PEAK_BITS
        raw["certifies"] = "peak"
        y = _stated(raw, piecewise, found)
        at, y = _summit(raw, y)
        width = at * _PEAK_WIDTH
        spans = [f"{_digits(at)} +/- {(width * 1.01).str(5, radius=False)}"]
        spans += [_digits(at + k * width) for k in (-1, 0, 1)]
        raw["at"] = []
        for span in spans:
            orbit, thick = _orbit_at(raw, span), not raw["at"]
            y, now = (y, arb(0)) if thick else _settled(orbit, y)
            box, _ = _boxed(orbit, y, now + (_PEAK_WIDTH if thick else 0))
            raw["at"].append({"frequency_hz": span, "unknowns": box})
        return _claimed(raw, prove(raw))
    finally:
        ctx.prec = kept


def _summit(raw: dict[str, Any], y: list[Any]) -> tuple[Any, list[Any]]:
    """Return the frequency where parabolas through three heights have their top, with the unknowns there."""
    from flint import arb

    from solver.certificate.checker import RejectedError

    at, step = arb(raw["system"]["frequency_hz"]), _PEAK_STEP
    for _ in range(_PEAK_TRIES):
        heights = []
        try:
            for k in (-1, 1, 0):
                orbit = _orbit_at(raw, _digits(at * (1 + k * step)))
                y, now = _settled(orbit, y)
                low, high = _boxed(orbit, y, now)[1]
                heights.append(high.max(-low).mid())
        except RejectedError:
            if step < _PEAK_LEAST:
                raise
            step /= 8.0
            continue
        left, right, top = heights
        bends = left - 2 * top + right
        if not bends < 0:
            raise RejectedError(f"max|x| has no peak near {float(at):.9g} Hz: it does not bend down there")
        shift = step * (left - right) / (2 * bends)
        at = (at * (1 + max(-4 * step, min(4 * step, shift)))).mid()
        if abs(shift) < _PEAK_WIDTH / 100:
            return at, y
        if abs(shift) < step:
            step = max(step**1.5, _PEAK_LEAST)
    raise RejectedError(f"max|x| has no peak that was found near {float(at):.9g} Hz")


def _stated(raw: dict[str, Any], piecewise: Piecewise, found: ExactOrbit) -> list[Any]:
    """Put the order of events into a certificate, and where states are unknown anew; return the unknowns."""
    from solver.certificate.checker import Orbit, System
    from solver.certificate.statement import orbit_of

    system = System(raw["system"])
    raw["orbit"], start = orbit_of(piecewise, found, system)
    return _anew(raw["orbit"], Orbit(system, raw["orbit"]), start)


def _orbit_at(raw: dict[str, Any], frequency_hz: str | float) -> Orbit:
    from solver.certificate.checker import Orbit, System

    return Orbit(System(raw["system"] | {"frequency_hz": frequency_hz}), raw["orbit"])


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


def _kept_inward(raw: dict[str, Any], start: list[Any]) -> tuple[Any, Any]:
    """Prove an orbit, contacts that stick at the edge of their limit moved inward; return its extremes."""
    from solver.certificate.checker import RejectedError

    for step in range(_MOVES):
        orbit = _orbit_at(raw, raw["system"]["frequency_hz"])
        try:
            raw["orbit"]["unknowns"], extremes = _boxed(orbit, *_settled(orbit, start))
        except RejectedError as error:
            if not _moved_inward(raw, error, step):
                raise
            last = error
        else:
            return extremes
    raise last


def _settled(orbit: Orbit, start: list[Any]) -> tuple[list[Any], float]:
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


def _boxed(orbit: Orbit, y: list[Any], now: Any) -> tuple[list[str], tuple[Any, Any]]:
    """Return a box of the unknowns that holds exactly one orbit, and the extremes of its motion."""
    from flint import arb, ctx

    from solver.certificate.checker import RejectedError

    radii = [(arb(2) ** (-ctx.prec * 3 // 5) + now) * size for size in _sizes(orbit, y)]
    for wider in range(_WIDER):
        box = [_written(each, radius * 4 ** (2 * wider + 1)) for each, radius in zip(y, radii, strict=True)]
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


def _digits(middle: Any) -> str:
    """Return a number as text with the digits of the precision."""
    from flint import ctx

    return str(middle.str(ctx.prec * 3 // 10, radius=False))


def _written(middle: Any, radius: Any) -> str:
    """Return a ball as text."""
    return f"{_digits(middle)} +/- {radius.upper().str(5, radius=False)}"


def _claimed(raw: dict[str, Any], found: dict[str, Any]) -> dict[str, tuple[float, float]]:
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


def _moved_inward(raw: dict[str, Any], error: RejectedError, step: int) -> bool:
    """Take a little of its force from a contact that sticks all the time at the edge of its limit."""
    fixed, key = raw["orbit"]["fixed_sliders"], str(error.contact)
    if key not in fixed or error.follows not in (1, -1):
        return False
    contact = raw["system"]["contacts"][error.contact]
    force = 10.0**step * _MOVED * contact["mu"] * abs(contact["load"][0][1])
    fixed[key] += error.follows * force / contact["kt"]
    return True
