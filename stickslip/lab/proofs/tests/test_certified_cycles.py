"""Limit cycles with proofs: against the march in time, the balance, and the damping they were found with."""

from __future__ import annotations

import copy
import math
from typing import Any

import numpy as np
import pytest

import solver
from service.jobs.studies.modes_study import Modes
from service.jobs.study import Watch
from stickslip.lab.proofs import checker
from tests.cases.mode_cases import one_mass

AERO = -0.09


@pytest.fixture(scope="module")
def found() -> tuple[solver.Scene, solver.LimitCycles]:
    """A mass with a slider: a stable cycle, and an unstable one beyond it."""
    scene = one_mass(1.0, 39.478, 0.5, 30.0, 30.0)
    mode = solver.nonlinear_mode(scene, amplitudes=(0.3, 100.0), harmonics=31, errors=False)
    return scene, solver.limit_cycles(mode, AERO)


def test_cycles_are_proved_whether_they_attract_or_not(
    found: tuple[solver.Scene, solver.LimitCycles],
) -> None:
    scene, cycles = found
    assert [cycle.stable for cycle in cycles.cycles] == [True, False]
    for cycle in cycles.cycles:
        proof = solver.certify_cycle(scene, cycle, AERO)
        assert proof.reached, proof.reason
        (low, high), (slow, fast) = proof.max_abs, proof.frequency_hz
        assert high - low <= 1e-15 * high
        assert fast - slow <= 1e-15 * fast
        assert abs(cycle.max_abs - low) <= cycle.max_abs_error
        assert abs(cycle.frequency_hz - slow) <= cycle.frequency_error
        assert proof.certificate is not None
        gas = proof.certificate["system"]["springs"][-1][-1]
        assert gas == pytest.approx(4.0 * math.pi * AERO * slow, rel=1e-14)  # of its own frequency
        checker.check(proof.certificate)


def test_a_march_ends_in_the_cycle_that_attracts(found: tuple[solver.Scene, solver.LimitCycles]) -> None:
    scene, cycles = found
    proof = solver.certify_cycle(scene, cycles.cycles[0], AERO)
    raw = scene.to_dict()
    raw["couplings"] = [{"on": "x", "of": "x", "c": 4.0 * math.pi * AERO * proof.frequency_hz[0]}]
    fed = solver.Scene.from_dict(raw).with_values({"excitation.amplitude": 0.0})
    start = solver.MarchStart(displacements={"x": 0.9 * proof.max_abs[0]})
    marched = solver.march(fed, frequency_hz=proof.frequency_hz[0], start=start, tolerance=2e-7)
    assert marched.half_peak_to_peak == pytest.approx(proof.max_abs[0], rel=1e-6)


def test_two_masses_that_the_scene_itself_feeds() -> None:
    """Gas couples the masses, without symmetry; the balance with more harmonics lies ever nearer."""
    raw: dict[str, Any] = one_mass(1.0, 39.478, 0.5, 30.0, 30.0).to_dict()
    raw["structure"]["masses"]["y"] = 0.7
    raw["structure"]["springs"] += [{"name": "between", "between": ["x", "y"], "k": 25.0, "c": 0.1}]
    raw["structure"]["springs"] += [{"name": "other", "between": ["y", "ground"], "k": 20.0, "c": 0.1}]
    raw["couplings"] = [{"on": "x", "of": "x", "c": -1.3}, {"on": "y", "of": "x", "c": 0.05}]
    scene, off = solver.Scene.from_dict(raw), []
    for harmonics in (9, 31):
        mode = solver.nonlinear_mode(scene, amplitudes=(0.3, 30.0), harmonics=harmonics, errors=False)
        cycle = solver.limit_cycles(mode, stability=False).cycles[0]
        proof = solver.certify_cycle(scene, cycle)
        assert proof.reached, proof.reason
        off.append(abs(cycle.frequency_hz - proof.frequency_hz[0]))
    assert off[1] < 0.1 * off[0]


def test_spoilt_certificates_of_cycles_are_rejected(
    found: tuple[solver.Scene, solver.LimitCycles],
) -> None:
    scene, cycles = found
    proof = solver.certify_cycle(scene, cycles.cycles[1], AERO).certificate
    assert proof is not None
    rng = np.random.default_rng(5)
    for i in range(30):
        raw, off = copy.deepcopy(proof), 1.0 + float(10.0 ** rng.uniform(-12.0, -1.0))
        if i % 3 == 0:
            raw["orbit"]["pinned"][1] *= off
        elif i % 3 == 1:
            raw["system"]["springs"][i % len(raw["system"]["springs"])][-1] *= off
        else:
            raw["claims"]["frequency_hz"] = [repr(float(end) * off) for end in raw["claims"]["frequency_hz"]]
        with pytest.raises(checker.RejectedError):
            checker.check(raw)


def test_what_has_no_place_in_a_proof_of_a_cycle_is_refused(
    found: tuple[solver.Scene, solver.LimitCycles],
) -> None:
    scene, cycles = found
    rigid = scene.with_values({"damper.kt": math.inf})
    with pytest.raises(solver.SettingError, match=r"damper\.kt.*finite"):
        solver.certify_cycle(rigid, cycles.cycles[0], AERO)


def test_the_study_of_modes_proves_its_limit_cycles(found: tuple[solver.Scene, solver.LimitCycles]) -> None:
    scene, cycles = found
    asked = {"start": 0.3, "stop": 100.0, "harmonics": 31, "aero_damping": AERO, "certify": True}
    answer = Modes.compute(scene, asked, Watch())
    assert answer.reached
    for cycle, proof in zip(cycles.cycles, answer.json["certificates"], strict=True):
        assert (proof["proves"], proof["certified"]) == ("limit cycle", True)
        assert abs(cycle.max_abs - proof["max_abs"][0]) <= cycle.max_abs_error
    body = {"scene": "two-dof", "from": 0.3, "to": 30.0, "certify": True}
    assert [each.subject for each in Modes.model_validate(body).issues(scene)] == [("certify",)]
