"""What the plan leaves out changes nothing: every shipped scene with everything forced on, and one by one."""

from dataclasses import fields
from functools import cache

import numpy as np
import pytest
from scene_cases import bladed_disk, loose_mass, two_dof

import solver
from solver import Effects, Scene, SettingError, solve, sweep
from solver.balance.balance import build, for_parameter
from solver.balance.workspace import Workspace
from solver.errors import SolverError
from solver.response.solution import Solution

SWITCHES = [field.name for field in fields(Effects)]
SCENES = [
    *(solver.load_scene(name) for name in ("two-dof", "bladed-disk")),
    two_dof(N1=0.0),
    two_dof(N1=200.0),
    bladed_disk(N1=0.0),
    bladed_disk(N1=400.0),
]


@cache
def lean_at(index: int, frequency_hz: float) -> Solution:
    """What is computed without anything forced on, once for all switches."""
    return solve(SCENES[index], frequency_hz=frequency_hz)


def frequencies(scene: Scene) -> list[float]:
    low, high = scene.observe.band
    return [low + share * (high - low) for share in (0.13, 0.37, 0.61, 0.85)]


@pytest.mark.few(3)
@pytest.mark.parametrize("every", [2, pytest.param(1, marks=pytest.mark.long)])
@pytest.mark.parametrize("switch", [*SWITCHES, "everything"])
@pytest.mark.parametrize("index", range(len(SCENES)), ids=lambda index: SCENES[index].name)
def test_nothing_changes_with_effects_forced_on(index: int, switch: str, every: int):
    scene = SCENES[index]
    asked = Effects.everything() if switch == "everything" else Effects(**{switch: True})
    for frequency_hz in frequencies(scene)[::every]:
        lean = lean_at(index, frequency_hz)
        whole = solve(scene, frequency_hz=frequency_hz, effects=asked)
        assert lean.converged
        assert whole.converged
        assert whole.half_peak_to_peak == pytest.approx(lean.half_peak_to_peak, rel=1e-8)
        np.testing.assert_allclose(whole.observed, lean.observed, atol=1e-8 * lean.max_abs)


@pytest.mark.parametrize("scene", [two_dof(N1=0.0), bladed_disk(N1=0.0)], ids=lambda scene: scene.name)
def test_responses_are_the_same(scene: Scene):
    asked = Effects(even_harmonics=True, every_contact=True, whole_matrices=True)
    lean, whole = sweep(scene), sweep(scene, effects=asked)
    assert lean.reached
    assert whole.reached
    assert lean.balance.n_unknowns < 0.6 * whole.balance.n_unknowns
    assert whole.peak is not None
    assert lean.peak is not None
    assert whole.peak.value == pytest.approx(lean.peak.value, rel=1e-9)
    assert whole.peak.at == pytest.approx(lean.peak.at, rel=1e-7)
    assert whole.band is not None
    assert lean.band is not None
    assert whole.band.width == pytest.approx(lean.band.width, rel=1e-7)


def test_odd_harmonics_only_where_the_response_is_symmetric():
    assert list(build(two_dof(N1=0.0), harmonics=6).system.ks) == [1, 3, 5]
    assert build(two_dof(N1=0.0), harmonics=6).n_harmonics == 6
    assert list(build(two_dof(N1=0.0), harmonics=0).system.ks) == [1]
    for scene, path, frequency_hz in (
        (two_dof(N1=1.0), "frequency", None),
        (two_dof(N1=0.0), "damper.N1", 1.0),
        (two_dof(N1=0.0), "damper.N1_ratio", 1.0),
        (loose_mass(), "frequency", None),
    ):
        kept = build(scene, path, harmonics=3, frequency_hz=frequency_hz).system.ks
        assert list(kept) == [0, 1, 2, 3]
    assert list(build(loose_mass(N1=0.0), harmonics=3).system.ks) == [1, 3]
    static = two_dof(N1=0.0).to_dict()
    static["excitation"] = [static["excitation"], {"dof": "m1", "amplitude": 1.0, "harmonic": 0}]
    assert list(build(Scene.from_dict(static), harmonics=3).system.ks) == [0, 1, 2, 3]


def test_a_slope_that_needs_the_even_harmonics_says_so():
    balance = build(two_dof(N1=0.0), harmonics=3)
    with pytest.raises(SettingError, match="even harmonics"):
        for_parameter(balance, "damper.N1", 1.0)


def test_contacts_that_cannot_slip_leave_the_newton_step():
    """The root of the disk at 700 Hz sticks and the shroud slips: only the shroud is solved for."""
    balance = build(bladed_disk(), harmonics=5)
    workspace = Workspace.of(balance)
    omega = 2.0 * np.pi * 700.0
    found = workspace.solve(omega)
    assert found.converged
    workspace.measure(found.u, omega)
    _, point = workspace.evaluate(found.u, omega)
    assert np.isnan(point.slopes).sum() == 1
    assert point.counts[0] == 1
    assert point.counts[1] == 1


@pytest.mark.parametrize("text", ["none", "even harmonics", "all,auto", ""])
def test_unknown_effects_are_named(text: str):
    with pytest.raises(SolverError) as error:
        Effects.read(text)
    assert "even-harmonics" in str(error.value)


def test_effects_are_read():
    assert Effects.read("auto") == Effects()
    assert Effects.read("all") == Effects.everything()
    assert Effects.read("every-sector, even-harmonics") == Effects(every_sector=True, even_harmonics=True)
