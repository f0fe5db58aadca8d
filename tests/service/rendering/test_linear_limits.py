"""The linear limits of page and report against the matrices themselves, however narrow the resonances are."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from light_scenes import light_scene

import solver
from service.jobs.common.scene_requests import linear_limit
from service.jobs.kinds.previews import run_limits
from service.jobs.outputs import Silent
from service.rendering.report.sections import linear_lines
from solver.linear.assembly import linear_model
from solver.linear.condensation import force_amplitudes
from solver.response.time_history import matrices

DEFECTS = Path(__file__).parent.parent.parent / "data" / "defects"


def limits(scene, contact=None):
    spec = {"scene": scene.to_dict(), "contact": contact}
    return run_limits(spec, Silent(), lambda: False).result


def amplitudes(scene, hz, *, stuck):
    """|x| of the observed DOF at every frequency, from the matrices; of forces of the first harmonic."""
    model = linear_model(scene)
    K, C, L = matrices(model, 1)
    if stuck:
        K = K + L.conj().T @ (model.port_stiffnesses[:, None] * L)
    force = force_amplitudes(model, np.array([1]))[0]
    omega = 2.0 * math.pi * np.asarray(hz)[:, None, None]
    motion = np.linalg.solve(
        K - omega**2 * model.M + 1j * omega * C, np.tile(force[:, None], (len(hz), 1, 1))
    )
    return np.abs(model.observe @ motion[:, :, 0].T), (K, C, model.M)


def highest(scene, *, stuck):
    """The highest amplitude over the band: a grid round the eigenvalues, refined twice."""
    low, high = scene.observe.band
    _, (K, C, M) = amplitudes(scene, [low], stuck=stuck)
    n, inverse = len(K), np.linalg.inv(M)
    state = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ K, -inverse @ C]])
    values = np.linalg.eigvals(state) / (2.0 * math.pi)
    widths = np.geomspace(1e-3, 1e5, 400)
    near = [v.imag + np.outer([-1.0, 1.0], abs(v.real) * widths).ravel() for v in values if v.imag > 0.0]
    hz = np.concatenate([np.linspace(low, high, 2000), *near])
    hz = np.unique(hz[(hz >= low) & (hz <= high)])
    for _ in range(3):
        size, _ = amplitudes(scene, hz, stuck=stuck)
        top = int(size.argmax())
        hz = np.linspace(hz[max(top - 1, 0)], hz[min(top + 1, len(hz) - 1)], 2000)
    return float(size.max())


@pytest.mark.parametrize("name", ["twolumped", "C_missed_peak_142", "D_second_peak"])
def test_limits_of_lightly_damped_scenes(name):
    """The curves hold the narrow resonances that a coarse grid of frequencies steps over."""
    scene = solver.load_scene(DEFECTS / f"{name}.toml")
    found = limits(scene)
    for key, stuck in (("free", False), ("stuck", True)):
        response = found[key]
        true = highest(scene, stuck=stuck)
        assert response["completed"]
        assert response["peak_certificate"]["known"]
        assert response["peak"]["value"] == pytest.approx(true, rel=1e-6)
        assert max(response["amplitude"]) == pytest.approx(true, rel=1e-6)
        at, size = response["parameter"][::7], response["amplitude"][::7]
        assert size == pytest.approx(amplitudes(scene, at, stuck=stuck)[0], rel=1e-6)


def test_twolumped_stuck_limit():
    """Its stuck limit is the resonance that the contact does not see."""
    found = limits(solver.load_scene(DEFECTS / "twolumped.toml"))
    assert found["stuck"]["peak"]["value"] == pytest.approx(1.1317e-3, rel=1e-3)
    assert found["stuck"]["peak"]["at"] == pytest.approx(351.584, rel=1e-5)


@pytest.mark.parametrize("seed", range(12))
def test_limits_of_random_scenes(seed):
    """Of random lightly damped scenes, forces of the first harmonic."""
    scene = light_scene(seed).scene
    if any(force.harmonic != 1 for force in scene.excitation) or not scene.contacts:
        pytest.skip("its forces have other harmonics, or it is linear already")
    found = limits(scene)
    for key, stuck in (("free", False), ("stuck", True)):
        if found[key]["peak_certificate"]["known"]:
            assert found[key]["peak"]["value"] == pytest.approx(highest(scene, stuck=stuck), rel=1e-5)
        assert found[key]["completed"]


def test_a_force_of_a_high_harmonic_has_limits():
    """More harmonics are kept than were asked for; what depends on them is as long as they are."""
    found = limits(solver.load_scene(DEFECTS / "A_harmonic_dropped.toml"))
    assert found["stuck"]["completed"]
    assert found["free"]["completed"]


def test_a_load_that_acts_on_the_parts_does_not_shift_them():
    """A contact whose load moves with the parts is open throughout, or pressed from where it stands."""
    raw = solver.load_scene("two-dof").to_dict()
    contact = raw["contacts"][0]
    contact |= {"law": "elastic-normal", "kn": 20.0, "normal_between": contact["between"], "N0": 40.0}
    for key in ("N1", "N1_ratio", "N1_phase"):
        contact.pop(key, None)
    scene = solver.Scene.from_dict(raw)
    for removed in ([], [contact["name"]]):
        branch = solver.sweep(linear_limit(scene, removed), harmonics=1)
        true = highest(scene, stuck=not removed)
        assert branch.reached
        assert branch.peak.value == pytest.approx(true, rel=1e-5)
        assert abs(branch.mean).max() <= 1e-5 * true


def test_the_report_of_dampers_has_no_linear_limits():
    """They move by themselves: without the friction they stand nowhere."""
    for name in ("platform-wedge", "platform-cylinder"):
        scene = solver.load_scene(name)
        assert linear_lines(scene, [f"{scene.dampers[0].name}.mass"]) == []
