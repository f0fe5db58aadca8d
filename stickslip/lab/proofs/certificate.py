"""The proof that a periodic response exists: `certify`, and the certificate it gives.

The balance says where the orbit is, floats follow it from event to event, Newton's method in long numbers
puts a box around its unknowns; all that is claimed is proved by `stickslip.lab.proofs.checker`, which knows
nothing of this.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from stickslip.lab.proofs.boxes import boxed, claimed, orbit_at, set_out, settled
from stickslip.lab.proofs.summits import least_proved, peak_proved
from solver.errors import MissingExtraError, SettingError
from stickslip.lab.proofs.exact.orbit import orbit_beside
from stickslip.lab.proofs.exact.piecewise import Piecewise
from solver.response.solution import Solution
from solver.response.solve import solve
from solver.results.files import whole
from solver.results.told import Piece
from solver.results.watch import ShouldStop
from solver.scene.cyclic.annulus import annulus
from solver.scene.scene import Scene

if TYPE_CHECKING:
    from stickslip.lab.proofs.exact.orbit import Orbit as ExactOrbit


from collections.abc import Sequence


_Bounds = dict[str, tuple[float, float]]
_BITS = (128, 192, 256)
MOST_WORK = 5000.0
_MOVES = 8  # contacts moved
_NARROW = 1e-16  # relative width of what is claimed; else more bits
_MOVED = 1e-9  # of its limit, by which the force of what sticks at the edge of it is moved inward


class CertificateStatus(Enum):
    """Whether a response was proved; the value is a sentence a user can act on."""

    CERTIFIED = "Proved: exactly one periodic response with these events lies in the enclosure."
    NOT_CERTIFIED = (
        "Not proved, `reason` says which inequality fails: change a parameter a little, away from where a "
        "contact only just slips, opens or touches."
    )
    WORK_USED_UP = (
        "Not proved: the work allowed is used up. Allow more (`most_work`), or a system with fewer "
        "coordinates or events."
    )
    STOPPED = "Not proved: stopped on request."
    NO_ORBIT = "Not proved: no periodic motion was found from event to event beside this solution."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Certificate(Piece):
    """A proof of a periodic response, or why there is none."""

    JSON: ClassVar = (
        "proves certified=reached status reason max_abs frequency_hz load_factor half_peak_to_peak events"
        " held bits work seconds certificate"
    )

    proves: Annotated[str, "What was to be proved: a response, a peak, a least peak, a limit cycle."]
    status: Annotated[CertificateStatus, "Whether it was proved."]
    reason: Annotated[str, "Which inequality fails, by how much, or why there is nothing to prove; or empty."]
    max_abs: Annotated[
        tuple[float, float], "Bounds of the largest |x| of the observed DOF [m]; NaN if there are none."
    ]
    frequency_hz: Annotated[tuple[float, float], "The frequency; of a peak, bounds of it [Hz]."]
    load_factor: Annotated[
        tuple[float, float], "Of a least peak, bounds of the load where it is, over the load of the scene."
    ]
    half_peak_to_peak: Annotated[tuple[float, float], "Bounds of (max x - min x) / 2 [m]."]
    events: Annotated[int, "Changes of a contact's state in a period."]
    held: Annotated[
        tuple[str, ...],
        "Contacts that stick all the time. What is proved is for the force left in them that it names: "
        "`max_abs` depends on it.",
    ]
    bits: Annotated[int, "Precision it was proved with."]
    work: Annotated[float, "Work done, in millions of products of balls of 128 bits."]
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


def certify(
    solution: Solution, *, peak: bool = False, least_over: str = "", most_work: float = MOST_WORK,
    should_stop: ShouldStop = None,
) -> Certificate:  # fmt: skip
    """Prove a periodic response of piecewise linear contacts, and enclose its amplitude.

    Between two events all is linear, so the orbit is a zero of finitely many equations: Krawczyk's operator
    shows that it exists and is the only one near, interval arithmetic that no other event happens. See
    docs/certificates.md.

    Parameters
    ----------
    solution : of contacts of the laws coulomb, elastic-normal and gap.
    peak : prove the peak of max|x| over the frequency beside it instead.
    least_over : the path of a load, such as ``damper.N0``, over which that peak is least near this solution;
        prove the least peak. With N0 all of the load varies, its harmonics likewise.
    most_work : work allowed, in millions of products of balls of 128 bits; it ends then with WORK_USED_UP.
    should_stop : asked now and then; True ends it with STOPPED.

    Raises
    ------
    SettingError
        The scene has a part that has no place in an exact solution, or the path is none of a load.
    MissingExtraError
        Without python-flint.
    """
    begun = time.perf_counter()
    check_extra()
    from stickslip.lab.proofs.proof_work import allowed
    from stickslip.lab.proofs.statement import system_of

    solution = _written_out(solution)
    orbit, reason = None, solution.status.value
    if solution.converged:
        check_certifiable(solution.scene)
        (piecewise, orbit), reason = orbit_beside(solution, polish=1), ""  # exact numbers go on from there
    raw: dict[str, Any] = {"certifies": "periodic orbit", "scene": solution.scene.name}
    status, bounds, work = CertificateStatus.NO_ORBIT, _Bounds(), 0.0
    if orbit is not None:
        raw["system"] = system_of(piecewise, solution.frequency_hz)
        if least_over:
            varying = loads_of(solution.scene, least_over)
            for j in varying:
                raw["system"]["contacts"][j]["varies"] = True
            if not varying:
                raise SettingError("least_over", least_over, "must be the path of a load, such as damper.N0")
        proved = least_proved if least_over else peak_proved if peak else _proved
        with allowed(most_work, should_stop) as allowance:
            status, reason, bounds = tried(partial(proved, raw, piecewise, orbit))
        work = allowance.done
    proves = "least peak" if least_over else "peak" if peak else "response"
    return told(raw, proves, (status, reason, bounds), work, begun, solution.frequency_hz)


def told(
    raw: dict[str, Any], proves: str, ended: tuple[CertificateStatus, str, _Bounds], work: float,
    begun: float, frequency_hz: float,
) -> Certificate:  # fmt: skip
    """Return a certificate for how a proof ended."""
    (status, reason, bounds), unknown = ended, (math.nan, math.nan)
    contacts, course = raw.get("system", {}).get("contacts", ()), raw.get("orbit", {})
    heights = (bounds[key] for key in ("least_peak", "peak", "max_abs") if key in bounds)
    return Certificate(
        proves=proves, status=status, reason=reason, max_abs=next(heights, unknown), work=work,
        frequency_hz=bounds.get("frequency_hz", (frequency_hz, frequency_hz)),
        load_factor=bounds.get("load_factor", (1.0, 1.0)),
        half_peak_to_peak=bounds.get("half_peak_to_peak", unknown), events=len(course.get("events", ())),
        held=tuple(contacts[int(j)]["name"] for j in course.get("fixed_forces", ())),
        bits=raw.get("bits", 0), seconds=time.perf_counter() - begun, certificate=raw if bounds else None,
    )  # fmt: skip


def _written_out(solution: Solution) -> Solution:
    """Return the solution of the whole disk where there is one: written out it is a system like any other."""
    if not solution.converged or not solution.scene.structure.has_sectors:
        return solution
    disk = annulus(solution.scene)
    return solve(disk, frequency_hz=solution.frequency_hz, harmonics=solution.n_harmonics)


def tried(prove: Callable[[], _Bounds]) -> tuple[CertificateStatus, str, _Bounds]:
    """Return how a proof ended, why, and the bounds that it proved."""
    from stickslip.lab.proofs.checker import RejectedError
    from stickslip.lab.proofs.proof_work import ProofHaltedError

    try:
        return CertificateStatus.CERTIFIED, "", prove()
    except RejectedError as error:
        return CertificateStatus.NOT_CERTIFIED, error.args[0], {}
    except ProofHaltedError as error:
        ended = CertificateStatus.STOPPED if error.stopped else CertificateStatus.WORK_USED_UP
        return ended, "", {}


def check_extra() -> None:
    """Raise what is missing for proofs."""
    try:
        import flint  # noqa: F401 - whether it is there
    except ImportError as error:
        raise MissingExtraError("python-flint", "proof") from error


def check_certifiable(scene: Scene, *, rigid: bool = True) -> None:
    """Raise what `certify` would, before what it is to prove is computed; `rigid`: friction may be."""
    check_extra()
    piecewise = Piecewise(annulus(scene) if scene.structure.has_sectors else scene, 1.0)
    for member in piecewise.members:
        name = piecewise.scene.contacts[member.contact].name
        for key, value in (("kt", 0.0 if rigid else float(piecewise.kt[member.slider])), ("kn", member.kn)):
            if math.isinf(value):
                wanted = "must be finite where something is proved: give it a large value"
                raise SettingError(f"{name}.{key}", value, wanted)


def loads_of(scene: Scene, path: str) -> list[int]:
    """Return the numbers of the contacts whose load a path is; none of a path of something else."""
    name, _, key = path.rpartition(".")
    found = [i for i, each in enumerate(scene.contacts) if name in (each.name, each.group)]
    return found if key == "N0" and all(scene.contacts[i].load is not None for i in found) else []


def _proved(raw: dict[str, Any], piecewise: Piecewise, found: ExactOrbit) -> _Bounds:
    """Complete a certificate by the box of its unknowns and by what it claims; return that as floats."""
    start = set_out(raw, piecewise, found.pieces)
    return in_more_bits(raw, partial(_kept_inward, raw, start))


def in_more_bits(raw: dict[str, Any], prove: Callable[[], tuple[Any, Any, Any]]) -> _Bounds:
    """Prove with 128 bits, and with more; return the claims as floats."""
    from flint import ctx

    from stickslip.lab.proofs.checker import RejectedError

    kept = ctx.prec
    try:
        for bits in _BITS:
            ctx.prec = raw["bits"] = bits
            try:
                low, high, period = prove()
            except RejectedError as error:
                if bits == _BITS[-1] or (len(error.args) > 1 and error.args[-1] < 0):
                    raise
                continue
            if bits == _BITS[-1] or (low.rad() + high.rad()) <= _NARROW * (high - low):
                reached = {"max_abs": high.max(-low), "half_peak_to_peak": (high - low) / 2}
                own = raw["system"]["frequency_hz"] is None
                return claimed(raw, reached | ({"frequency_hz": 1 / period} if own else {}))
        raise AssertionError
    finally:
        ctx.prec = kept


def _kept_inward(raw: dict[str, Any], start: list[Any]) -> tuple[Any, Any, Any]:
    """Prove an orbit, contacts that stick at the edge of their limit moved inward; return its extremes."""
    from stickslip.lab.proofs.checker import RejectedError

    for step in range(_MOVES):
        orbit = orbit_at(raw)
        try:
            start, now, _ = settled(orbit, start)
            unknowns, extremes = boxed(orbit, start, now)
        except RejectedError as error:
            if not _moved_inward(raw, step, *error.args):
                raise
            last = error
        else:
            raw["proof"] = {"unknowns": unknowns}
            return extremes
    raise last


def _moved_inward(
    raw: dict[str, Any], step: int, _: str, contact: int = -1, follows: int = 0, *_margin: Any
) -> bool:
    """Take a little of its force from a contact that sticks all the time at the edge of its limit."""
    fixed, key = raw["orbit"]["fixed_forces"], str(contact)
    if key not in fixed or follows not in (1, -1):
        return False
    of = raw["system"]["contacts"][contact]
    fixed[key] -= follows * 10.0**step * _MOVED * of["mu"] * abs(of["waves"][0][1])
    return True


def certified_peaks(
    peaks: Sequence[tuple[Scene, float]],
    *,
    least_over: str = "",
    harmonics: int = 11,
    should_stop: ShouldStop = None,
) -> tuple[Certificate, ...]:
    """Prove peaks that were found.

    One alone that is least over a load is proved to be that: if all of the load varies with N0, and where the
    proof succeeds. Of several each is proved by itself, which does not say that the highest is least.

    Parameters
    ----------
    peaks : of each the scene, with the values that make it, and its frequency [Hz].
    least_over : the path over which the highest is least, within the range.
    harmonics : highest harmonic of the balance that the search begins with.
    should_stop : asked now and then, as by `certify`.

    Raises
    ------
    SettingError
        A scene that cannot be certified.
    MissingExtraError
        Without python-flint.
    """
    for scene, _ in peaks:
        check_certifiable(scene)
    near = [solve(scene, frequency_hz=hertz, harmonics=harmonics) for scene, hertz in peaks]
    if len(near) == 1 and _all_in_proportion(peaks[0][0], least_over):
        least = certify(near[0], least_over=least_over, should_stop=should_stop)
        if least.reached or least.status is CertificateStatus.STOPPED:
            return (least,)
        return least, certify(near[0], peak=True, should_stop=should_stop)
    return tuple(certify(each, peak=True, should_stop=should_stop) for each in near)


def _all_in_proportion(scene: Scene, path: str) -> bool:
    """Whether a path is that of a load which varies in proportion to it."""
    loads = [scene.contacts[i].load for i in loads_of(scene, path)]
    return bool(loads) and all(load is not None and load.in_proportion for load in loads)
