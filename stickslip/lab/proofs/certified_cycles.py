"""Limit cycles proved: motions that nothing drives, stable or not, whose period is one of the unknowns."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.lab.proofs.boxes import boxed, set_out, settled
from stickslip.lab.proofs.certificate import (
    MOST_WORK,
    Certificate,
    CertificateStatus,
    check_certifiable,
    in_more_bits,
    told,
    tried,
)
from solver.errors import SettingError
from solver.jit.timer import clock
from solver.jit.fourier import to_complex
from solver.linear.assembly import linear_model
from stickslip.lab.proofs.exact.orbit import begun_at
from stickslip.lab.proofs.exact.flow import Flow, NoMotionError
from stickslip.lab.proofs.exact.piecewise import Piecewise
from solver.results.watch import ShouldStop
from solver.scene.scene import Scene

if TYPE_CHECKING:
    from stickslip.lab.limit_cycles.limit_cycles import LimitCycle
    from stickslip.lab.proofs.exact.flow import FlowPiece

_PERIOD = 2.0 * math.pi
_ROUNDS, _SAME = 8, 2e-15  # of the gas, whose damping is in proportion to the frequency


def certify_cycle(
    scene: Scene, cycle: LimitCycle, aero_damping: float = 0.0, *, most_work: float = MOST_WORK,
    should_stop: ShouldStop = None,
) -> Certificate:  # fmt: skip
    """Prove a limit cycle of piecewise linear contacts; enclose its frequency and amplitude.

    Its period is unknown, and one coordinate has the value it begins with. What is proved is the cycle of the
    fixed damping matrix 2 ζ_aero ω M, with ω that of the cycle to rounding.

    Parameters
    ----------
    scene : without sectors, contacts of the laws coulomb, elastic-normal and gap; what drives it is left out.
    cycle : of `solver.limit_cycles`.
    aero_damping : damping ratio ζ_aero of the gas, as it was found with.
    most_work, should_stop : as of `solver.certify`.

    Raises
    ------
    SettingError
        The scene has a part that has no place in an exact solution, or more coordinates than DOFs.
    MissingExtraError
        Without python-flint.
    """
    begun, still = clock(), scene.with_values({"excitation.amplitude": 0.0})
    check_certifiable(still, rigid=False)
    from stickslip.lab.proofs.proof_work import allowed

    shapes = np.real(linear_model(still).shapes)
    if np.linalg.matrix_rank(shapes) < shapes.shape[1]:
        raise SettingError("structure", still.structure.kind, "must have no coordinates besides its DOFs")
    omega, raw = _PERIOD * cycle.frequency_hz, {"certifies": "limit cycle", "scene": scene.name}
    piecewise = Piecewise(still, omega, 2.0 * aero_damping * omega)
    pieces = _period_of(piecewise, cycle)
    if pieces is None:
        return told(raw, "limit cycle", (CertificateStatus.NO_ORBIT, "", {}), 0.0, begun, cycle.frequency_hz)

    with allowed(most_work, should_stop) as allowance:
        ended = tried(lambda: _proved(raw, piecewise, pieces, aero_damping))
    return told(raw, "limit cycle", ended, allowance.done, begun, cycle.frequency_hz)


def _period_of(piecewise: Piecewise, cycle: LimitCycle) -> Sequence[FlowPiece] | None:
    """Return the pieces of a period that begins within the longest; None where contacts end otherwise."""
    scene, record, contacts = piecewise.scene, cycle.record, piecewise.scene.contacts
    motions = np.split(record.motions, np.cumsum([len(each.end_keys) for each in contacts])[:-1])
    forces = [
        each.force_at(moved, each.normal_load(moved), np.zeros(1))
        for each, moved in zip(contacts, motions, strict=True)
    ]
    dofs = np.array([to_complex(each) for each in record.dofs])
    amplitudes = np.linalg.lstsq(np.real(linear_model(scene).shapes), dofs, rcond=None)[0].T
    flow = Flow(piecewise, *begun_at(piecewise, amplitudes, forces), 0.0)
    try:
        flow.run(_PERIOD)
        longest = max(flow.pieces, key=lambda each: each.length)
        flow.run(longest.tau + 0.5 * longest.length)
        begun = flow.state.key
        flow.run(_PERIOD)
    except NoMotionError:
        return None
    return flow.pieces if flow.state.key == begun else None


def _proved(
    raw: dict[str, Any], piecewise: Piecewise, pieces: Sequence[FlowPiece], aero_damping: float
) -> dict[str, tuple[float, float]]:
    """Complete a certificate; the damping of the gas is what its frequency makes it."""
    from flint import ctx

    from stickslip.lab.proofs.boxes import orbit_at
    from stickslip.lab.proofs.checker import RejectedError
    from stickslip.lab.proofs.statement import system_of

    raw["system"], kept = system_of(piecewise, None), ctx.prec
    start = set_out(raw, piecewise, pieces)

    def prove() -> tuple[Any, Any, Any]:
        nonlocal start
        for _ in range(_ROUNDS):
            orbit = orbit_at(raw)
            start, now, _ = settled(orbit, start)
            omega = _PERIOD / float(sum(orbit.lengths(start)))
            gas = 2.0 * aero_damping * omega
            if abs(gas - piecewise.mass_damping) <= _SAME * abs(gas):
                break
            raw["system"] = system_of(Piecewise(piecewise.scene, omega, gas), None)
            piecewise.mass_damping = gas
        else:
            raise RejectedError("the frequency and the damping that follows it do not settle")
        unknowns, extremes = boxed(orbit, start, now)
        raw["proof"] = {"unknowns": unknowns}
        return extremes

    try:
        return in_more_bits(raw, prove)
    finally:
        ctx.prec = kept
