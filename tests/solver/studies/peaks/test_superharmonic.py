"""One harmonic of the motion as what is measured: superharmonic resonances are peaks like all others."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from each import each
from law_scene_cases import CUBIC, RUB
from law_scene_cases import scene as of_laws
from scene_cases import two_dof

import solver
from solver.balance.simplifications import Effects
from solver.continuation.branches.observation import highest_peaks
from solver.errors import SettingError
from solver.scene.scene import Scene
from solver.sensitivity.gradient import Sensitivities
from solver.sensitivity.nonsmooth import peak_gradient


def measured(scene: Scene, harmonic: int | None, **further: Any) -> Scene:
    observe = scene.observe.model_copy(update={"harmonic": harmonic, **further})
    return scene.model_copy(update={"observe": observe})


def oscillator(contact: dict[str, Any], k: float, c: float, force: float, harmonic: int | None = 3) -> Scene:
    """A mass of 1 kg with one contact, under cos ωt."""
    spring = {"name": "k", "between": ["m", "ground"], "k": k, "c": c}
    scene = Scene.from_dict({
        "name": "oscillator",
        "structure": {"kind": "lumped", "masses": {"m": 1.0}, "springs": [spring]},
        "contacts": [{"name": "j", "between": ["m", "ground"], **contact}],
        "excitation": {"dof": "m", "amplitude": force}, "observe": {"dof": "m", "band": [0.035, 0.1]},
    })  # fmt: skip
    return measured(scene, harmonic)


def jenkins(force: float, harmonic: int | None = 3) -> Scene:
    """Of tests/test_vprnm.py of tmdsimpy 17d5fc3: m = 1, c = 0.01, k = 0.75, kt = 0.25, limit 0.2."""
    return oscillator({"kt": 0.25, "mu": 1.0, "N0": 0.2}, 0.75, 0.01, force, harmonic)


def duffing(force: float) -> Scene:
    return oscillator({"law": "polynomial", "a3": 1.0}, 1.0, 0.05, force)


def test_the_response_is_that_of_tmdsimpy_where_its_superharmonic_is_in_phase_resonance() -> None:
    """Its solution with harmonics up to 3, friction by samples in time: sin, not -sin, in its order."""
    known = [1.28497308, 0.2842021, 0.0, 0.0, 0.50030017, 0.22542694]
    at = 0.3115958 / (2.0 * math.pi)
    whole = solver.solve(jenkins(1.0, None), frequency_hz=at, harmonics=3)
    np.testing.assert_allclose(whole.observed[1:], known, atol=3e-5)
    third = solver.solve(jenkins(1.0), frequency_hz=at, harmonics=3)
    assert third.max_abs == pytest.approx(math.hypot(*known[-2:]), rel=5e-5)
    assert third.max_abs == pytest.approx(whole.harmonics[3], rel=1e-9)


@pytest.mark.parametrize(("case", "low", "high"), [(jenkins, 0.95, 1.3), (duffing, 0.3, 0.5)])
def test_its_peak_is_tracked_as_peaks_are(case: Any, low: float, high: float) -> None:
    track = solver.track_peak(case(low), "excitation.amplitude", low, high, checks=1)
    assert track.reached
    for i in (0, len(track.parameter) // 2, -1):
        scene, peak = case(float(track.parameter[i])), track.peak[i]
        swept = solver.sweep(scene).peak
        assert swept is not None
        assert peak == pytest.approx(swept.value, rel=1e-9)
        assert peak == pytest.approx(solver.march(scene, frequency_hz=track.frequency[i]).max_abs, rel=3e-4)
        beside = [solver.march(scene, frequency_hz=s * track.frequency[i]).max_abs for s in (0.995, 1.005)]
        assert max(beside) < peak * (1.0 + 1e-6)


@each(("scene", "hertz"), [(two_dof(N1_ratio=0.7), 1.05), (of_laws(RUB), 0.3), (of_laws(CUBIC), 0.3)])
@each("harmonic", [1, 2, 3, 13])
def test_it_is_that_harmonic_of_the_whole_motion(scene: Scene, hertz: float, harmonic: int) -> None:
    whole = solver.solve(measured(scene, harmonic), frequency_hz=hertz)
    for effects in (Effects(), Effects.everything()):
        plain = solver.solve(scene, frequency_hz=hertz, harmonics=13, effects=effects)
        ours = solver.solve(measured(scene, harmonic), frequency_hz=hertz, harmonics=13, effects=effects)
        assert ours.max_abs == pytest.approx(plain.harmonics[harmonic], rel=1e-7, abs=1e-12)
        assert ours.half_peak_to_peak == pytest.approx(ours.max_abs, rel=1e-9, abs=1e-12)
    assert whole.harmonics.size == max(11, harmonic) + 1


def test_peaks_of_several_dofs_are_those_of_sweeps_that_observe_them() -> None:
    scene = measured(two_dof(N1_ratio=0.7), 3)
    branch = solver.sweep(scene)
    for dof in ("m1", "m2"):
        found = highest_peaks(branch, [dof])[0][0]
        own = solver.sweep(measured(scene, 3, dof=dof)).peak
        assert own is not None
        assert found.value == pytest.approx(own.value, rel=1e-7)


@pytest.mark.parametrize("path", ["damper.N0", "damper.mu", "structure.k2", "excitation.amplitude"])
def test_gradients_and_second_derivatives_are_differences(path: str) -> None:
    scene = measured(two_dof(N1_ratio=0.7), 3)
    value, step = scene.value(path), 1e-5 * scene.value(path)
    gradients, heights, bends = [], [], []
    for at in (value - step, value, value + step):
        branch = solver.sweep(scene.with_values({path: at}))
        sensitivities, peak = Sensitivities(branch.balance, [path]), branch.peaks[0]
        gradients.append(peak_gradient(sensitivities, peak).gradient[0])
        heights.append(peak.value)
        bends.append(sensitivities.peak_hessian(peak.solution, peak.at).hessian[0, 0])
    assert gradients[1] == pytest.approx((heights[2] - heights[0]) / (2.0 * step), rel=1e-5)
    assert bends[1] == pytest.approx((gradients[2] - gradients[0]) / (2.0 * step), rel=1e-3)


def test_where_nothing_slips_there_is_no_third_harmonic_and_no_peak_of_it() -> None:
    track = solver.track_peak(jenkins(0.1), "excitation.amplitude", 0.1, 0.2, checks=0)
    assert np.all(np.abs(track.peak) < 1e-12)


def test_studies_of_the_whole_motion_refuse_it() -> None:
    scene = jenkins(1.0)
    for ask in (
        lambda: solver.transient(scene, begin_hz=0.04, end_hz=0.05, ramp_seconds=10.0),
        lambda: solver.quasi_periodic(scene, frequency_hz=0.04, second_hz=0.06, amplitude=1.0),
        lambda: solver.nonlinear_mode(scene, amplitudes=[0.5, 1.0]),
        lambda: solver.solve(scene, frequency_hz=0.05, exact=True),
    ):
        with pytest.raises(SettingError, match="whole motion"):
            ask()
