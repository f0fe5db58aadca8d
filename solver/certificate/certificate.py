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
from solver.results.files import whole
from solver.results.told import Piece

if TYPE_CHECKING:
    from solver.certificate.checker import Orbit, RejectedError, System
    from solver.response.exact.orbit import Orbit as ExactOrbit
    from solver.response.exact.piecewise import Piecewise

_BITS = (128, 256)
_NEWTON, _WIDER, _MOVES = 12, 4, 8  # steps; boxes tried; contacts moved
_GROWN = 1e11  # by which balls grow before a state is unknown anew
_SLOW = 1e-4  # by which a step falls with a derivative that still serves
_NARROW = 1e-16  # relative width of what is claimed; else more bits
_DIGITS = 25
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
        "certified=reached status reason max_abs half_peak_to_peak events held bits seconds certificate"
    )

    status: Annotated[CertificateStatus, "Whether it was proved."]
    reason: Annotated[str, "Which inequality fails, by how much; empty if none does."]
    max_abs: Annotated[
        tuple[float, float], "Bounds of the largest |x| of the observed DOF [m]; NaN if there are none."
    ]
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


def certify(solution: Solution) -> Certificate:
    """Prove a periodic response of piecewise linear contacts, and enclose its amplitude.

    Between two events all is linear, so the orbit is a zero of finitely many equations: Krawczyk's operator
    shows that it exists and is the only one near, interval arithmetic that no other event happens. See
    docs/certificates.md.

    Parameters
    ----------
    solution : one that converged, of contacts of the laws coulomb, elastic-normal and gap.

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
    piecewise, orbit = orbit_beside(solution, polish=1)  # exact numbers go on from there
    raw: dict[str, Any] = {"certifies": "periodic orbit", "scene": solution.scene.name}
    status, reason, bounds = CertificateStatus.NO_ORBIT, "", {}
    if orbit is not None:
        raw["system"] = system_of(piecewise, solution.frequency_hz)
        try:
            bounds = _proved(raw, piecewise, orbit)
            status = CertificateStatus.CERTIFIED
        except RejectedError as error:
            status, reason = CertificateStatus.NOT_CERTIFIED, str(error)
    unknown = (math.nan, math.nan)
    contacts, course = raw.get("system", {}).get("contacts", ()), raw.get("orbit", {})
    return Certificate(
        status=status, reason=reason, max_abs=bounds.get("max_abs", unknown),
        half_peak_to_peak=bounds.get("half_peak_to_peak", unknown), events=len(course.get("events", ())),
        held=tuple(contacts[int(j)]["name"] for j in course.get("fixed_sliders", ())),
        bits=raw.get("bits", 0),
        seconds=time.perf_counter() - begun, certificate=raw if bounds else None,
    )  # fmt: skip


def _proved(raw: dict[str, Any], piecewise: Piecewise, found: ExactOrbit) -> dict[str, tuple[float, float]]:
    """Complete a certificate by the box of its unknowns and by what it claims; return that as floats."""
    from flint import ctx

    from solver.certificate.checker import Orbit, RejectedError, System
    from solver.certificate.statement import orbit_of

    kept = ctx.prec
    try:
        for bits in _BITS:
            ctx.prec = raw["bits"] = bits
            system = System(raw["system"])
            raw["orbit"], start = orbit_of(piecewise, found, system)
            try:
                start = _anew(raw["orbit"], Orbit(system, raw["orbit"]), start)
                low, high = _kept_inward(raw, system, start)
            except RejectedError as error:
                if bits == _BITS[-1] or error.contact >= 0:
                    raise
                continue
            if bits == _BITS[-1] or (low.rad() + high.rad()) <= _NARROW * (high - low):
                return _claimed(raw, low, high)
        raise AssertionError
    finally:
        ctx.prec = kept


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


def _kept_inward(raw: dict[str, Any], system: System, start: list[Any]) -> tuple[Any, Any]:
    """Prove an orbit, contacts that stick at the edge of their limit moved inward; return its extremes."""
    from solver.certificate.checker import Orbit, RejectedError

    for step in range(_MOVES):
        orbit = Orbit(system, raw["orbit"])
        try:
            return _enclosed(raw, orbit, start)
        except RejectedError as error:
            if not _moved_inward(raw, error, step):
                raise
            last = error
    raise last


def _enclosed(raw: dict[str, Any], orbit: Orbit, start: list[Any]) -> tuple[Any, Any]:
    """Put a box of the unknowns that holds exactly one orbit into the certificate; return its extremes."""
    from flint import arb, ctx

    from solver.certificate.checker import RejectedError, isolated

    y = [arb(each) for each in start]
    sizes, inverse, before = _sizes(orbit, y), None, math.inf
    for _ in range(_NEWTON):
        value, slope, _ = orbit.shoot(y, [arb(0)] * len(y) if inverse is None else None)
        inverse = isolated(slope) if inverse is None else inverse
        steps = (inverse * value).entries()
        y = [(each - step).mid() for each, step in zip(y, steps, strict=True)]
        now = max(float(step.abs_upper()) / size for step, size in zip(steps, sizes, strict=True))
        if now <= 2.0 ** (-ctx.prec // 2):
            break
        if now > _SLOW * before:
            inverse = None
        before = now
    radii = [(arb(2) ** (-ctx.prec * 3 // 5) + now) * size for size in sizes]
    for wider in range(_WIDER):
        box = [_written(each, radius * 4 ** (2 * wider + 1)) for each, radius in zip(y, radii, strict=True)]
        try:
            extremes = orbit.extremes([arb(each) for each in box])
        except RejectedError as error:
            if wider == _WIDER - 1 or error.contact >= 0:
                raise
            continue
        raw["orbit"]["unknowns"] = box
        return extremes
    raise AssertionError


def _sizes(orbit: Orbit, y: list[Any]) -> list[float]:
    """Return what a change of each unknown is compared with: the largest of its kind, and 1 of instants."""
    n, sizes = orbit.system.n, [1.0] * orbit.size
    sliding, rate = (max(abs(float(each)) for each in y[k : k + n]) or 1.0 for k in (0, n))
    for start, states in orbit.anew.values():
        for k, at in enumerate(states, start=start):
            sizes[k] = rate if n <= at < 2 * n else sliding
    return sizes


def _written(middle: Any, radius: Any) -> str:
    """Return a ball as text with the digits of the precision it has."""
    from flint import ctx

    return f"{middle.str(ctx.prec * 3 // 10, radius=False)} +/- {radius.upper().str(5, radius=False)}"


def _claimed(raw: dict[str, Any], low: Any, high: Any) -> dict[str, tuple[float, float]]:
    """Put what is proved of the extremes into the certificate; return it as floats; all rounded outward."""
    found = {"max_abs": high.max(-low), "half_peak_to_peak": (high - low) / 2}
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
