"""What jobs of nonlinear modes give besides the curve: loops, shapes, and whole responses to compare with."""

import httpx
import numpy as np
import pytest
from service_helpers import is_problem

import solver

MODE = {"kind": "modes", "scene": "two-dof", "from": 0.1, "to": 100.0, "harmonics": 3}


def test_loops_shapes_and_exact_peaks(shipped: httpx.Client) -> None:
    body = {**MODE, "performance": True, "motions": True, "exact_peaks": 3}
    answer = shipped.post("/v1/jobs", json=body, headers={"Prefer": "wait=60"}).json()
    found = answer["result"]
    scene = solver.load_scene("two-dof")
    mode = solver.nonlinear_mode(scene, 1, amplitudes=(0.1, 100.0), harmonics=3)
    motions = found["motions"]
    assert motions["dofs"] == list(scene.dofs)
    for place, point in enumerate(motions["points"]):
        [loop] = motions["loops"]
        motion, force = np.array(loop["motion"][place]), np.array(loop["force"][place])
        assert (motion[0], force[0]) == (motion[-1], force[-1]), "the loop is closed"
        # Work of friction in a period, by the trapezoidal rule: none before the contact slips.
        work = float(np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(motion)))
        slips = found["states"][point] != ["stuck"]
        assert work > 0.0 if slips else abs(work) <= 1e-9 * np.abs(force).max() * np.abs(motion).max()
        shape = np.array(motions["shapes"]["real"][place]) + 1j * np.array(motions["shapes"]["imag"][place])
        np.testing.assert_allclose(shape, mode.shape(point), rtol=1e-6, atol=1e-9)
    exact = found["performance"]["exact"]
    assert len(exact) == 3
    for one in exact:
        force = one["excitation"] * scene.value("excitation.amplitude")
        swept = solver.sweep(scene.with_values({"excitation.amplitude": force}), harmonics=3)
        assert swept.peak is not None
        assert one["peak"] == pytest.approx(swept.peak.value, rel=1e-6)


def test_exact_peaks_need_the_curve(shipped: httpx.Client) -> None:
    problem = is_problem(shipped.post("/v1/jobs", json={**MODE, "exact_peaks": 2}), 422)
    assert [one["pointer"] for one in problem["errors"]] == ["/exact_peaks"]


def test_gas_on_one_mode_has_the_cycles_of_the_library(shipped: httpx.Client) -> None:
    scene = solver.load_scene("two-dof").with_values({"damper.N1": 0.0})
    mode = solver.nonlinear_mode(scene, 1, amplitudes=(0.1, 100.0), harmonics=3)
    aero = -0.5 * float(mode.damping_ratio.max())
    cycles = {}
    for alone in (False, True):
        body = {**MODE, "set": {"damper.N1": 0.0}, "aero_damping": aero, "mode_alone": alone}
        answer = shipped.post("/v1/jobs", json=body, headers={"Prefer": "wait=60"}).json()
        found = answer["result"]["limit_cycles"]
        assert found["mode_alone"] is alone
        cycles[alone] = [each["amplitude"] for each in found["cycles"]]
        expected = solver.limit_cycles(mode, aero, mode_alone=alone)
        assert cycles[alone] == pytest.approx([each.amplitude for each in expected.cycles], rel=1e-9)
    assert cycles[True]
    assert cycles[True] != pytest.approx(cycles[False], rel=1e-6)


def test_gas_on_one_mode_needs_the_gas(shipped: httpx.Client) -> None:
    problem = is_problem(shipped.post("/v1/jobs", json={**MODE, "mode_alone": True}), 422)
    assert [one["pointer"] for one in problem["errors"]] == ["/mode_alone"]
