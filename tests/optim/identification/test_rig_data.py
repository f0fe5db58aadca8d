"""Ring-downs, phase resonances and peaks of blades as data: exact derivatives, closed forms, known truth."""

import math
from typing import Any

import numpy as np
import pytest

import optim
import solver
from optim.identification.reading import read_data
from solver.studies.blades import blade_peaks, mistuned

MASS, STIFFNESS, DASHPOT = 1.0, 40.0, 0.12


def rig(kt: float = 1.0, mu: float = 0.3, load: float = 2.5) -> solver.Scene:
    """One mass on a spring and a slider."""
    return solver.Scene.from_dict(
        {
            "name": "rig",
            "structure": {
                "kind": "lumped",
                "masses": {"m": MASS},
                "springs": [{"name": "k", "between": ["m", "ground"], "k": STIFFNESS, "c": DASHPOT}],
            },
            "contacts": [{"name": "damper", "between": ["m", "ground"], "kt": kt, "mu": mu, "N0": load}],
            "excitation": {"dof": "m", "amplitude": 4.0},
            "observe": {"dof": "m", "band": [0.8, 1.4]},
        }
    )


def ring_down(
    scene: solver.Scene, begin: float, seconds: float, step: float = 5e-4, dashpot: float = DASHPOT
) -> dict[str, Any]:
    """The peaks of a free decay, by small steps of the mass and increments of the slider."""
    kt, limit = scene.value("damper.kt"), scene.value("damper.mu") * scene.value("damper.N0")
    x, v, force, before, found = begin, 0.0, 0.0, begin, []
    for i in range(int(seconds / step)):
        half = v + 0.5 * step * (-STIFFNESS * x - dashpot * v - force) / MASS
        x += step * half
        force = min(max(force + kt * step * half, -limit), limit)
        v, was = half + 0.5 * step * (-STIFFNESS * x - dashpot * half - force) / MASS, v
        if was > 0.0 >= v:
            found.append(((i + 1 - v / (v - was)) * step, max(x, before)))
        before = x
    time, peak = zip(*found, strict=True)
    return {"time": list(time), "modal_amplitude": list(peak)}


TABLES = {
    "decay": {"time": [0.0, 1.0, 3.0, 6.0], "modal_amplitude": [2.5, 2.0, 1.3, 0.9], "frequency": [1.0] * 4},
    "resonance": {"level": [2.0, 5.0], "resonance_amplitude": [1.0, 2.0], "resonance_frequency": [1.0, 1.0]},
    "peak": {"level": [2.0, 5.0], "peak": [1.0, 2.0]},
}


@pytest.mark.parametrize("kind", TABLES)
def test_derivatives_are_those_of_differences(kind: str) -> None:
    scene, paths = rig(), ("damper.kt", "damper.N0", "structure.k")
    (run,) = read_data(scene, [TABLES[kind]])
    model = run.model(scene, paths, 5)
    found = model.evaluate({})
    assert found.reached.all()
    plain = run.model(scene, (), 5).evaluate({})
    np.testing.assert_allclose(plain.values, found.values, rtol=1e-6)
    assert plain.slopes.shape == (found.values.size, 0)
    for j, path in enumerate(paths):
        value, h = scene.value(path), 1e-4
        high, low = (model.evaluate({path: value * (1.0 + way * h)}).values for way in (1.0, -1.0))
        wanted = (high - low) / (2.0 * h * value)
        np.testing.assert_allclose(found.slopes[:, j], wanted, rtol=1e-4, atol=1e-6 * np.abs(wanted).max())


def test_a_level_of_the_rows_stands_in_place_of_the_scene() -> None:
    scene = rig()
    for kind in ("resonance", "peak"):
        (run,) = read_data(scene, [TABLES[kind]])
        found = run.model(scene, ("excitation.amplitude",), 3).evaluate({"excitation.amplitude": 77.0})
        assert not found.slopes.any()
        with pytest.raises(optim.DataError, match="level"):
            read_data(scene, [{**TABLES[kind], "conditions": {"excitation.amplitude": 3.0}}])


def test_phase_resonance_of_one_harmonic_is_the_closed_form() -> None:
    """The first harmonic of a slider: T. K. Caughey, J. Appl. Mech. 27 (1960) 640."""
    scene, amplitudes = rig(kt=8.0), np.array([0.4, 1.0, 2.0])
    kt, limit = 8.0, 0.75
    theta = np.arccos(1.0 - 2.0 * limit / (kt * amplitudes))
    omega = np.sqrt((STIFFNESS + kt / np.pi * (theta - 0.5 * np.sin(2.0 * theta))) / MASS)
    level = DASHPOT * omega * amplitudes + 4.0 * limit * (1.0 - limit / (kt * amplitudes)) / np.pi
    table = {"level": level, "resonance_amplitude": amplitudes, "resonance_frequency": omega / (2.0 * np.pi)}
    (run,) = read_data(scene, [table])
    found = run.model(scene, (), 1).evaluate({})
    np.testing.assert_allclose(found.values, run.observations, rtol=1e-9)


@pytest.mark.parametrize(
    ("dashpot", "seconds", "of_kt", "of_mu"),
    [(0.12, 40.0, 1e-3, 4e-3), pytest.param(0.6, 8.0, 1e-2, 3e-2, marks=pytest.mark.long)],
)
def test_a_marched_ring_down_gives_the_slider(
    dashpot: float, seconds: float, of_kt: float, of_mu: float
) -> None:
    """Of a damping ratio of 1.3 % and of 5 % at most: right to the square of it."""
    scene = rig(kt=1.2, mu=0.4).to_dict()
    scene["structure"]["springs"][0]["c"] = dashpot
    found = optim.identify(
        solver.Scene.from_dict(scene),
        [ring_down(rig(), 3.5, seconds, dashpot=dashpot)],
        {"damper.kt": (0.3, 3.0), "damper.mu": (0.1, 1.0)},
        harmonics=5, starts=1, candidates={},
    )  # fmt: skip
    assert found.values["damper.kt"] == pytest.approx(1.0, rel=of_kt)
    assert found.values["damper.mu"] == pytest.approx(0.3, rel=of_mu)


def test_a_strongly_damped_ring_down_has_the_frequency_of_the_damped_motion() -> None:
    """A stuck slider is a spring: a = e^(−ζω₀t) at ω₀ √(1 − ζ²), with 19 % of damping."""
    dashpot, kt = 2.4, 1.0
    raw = rig(kt=kt).to_dict()
    raw["structure"]["springs"][0]["c"] = dashpot
    omega, rate = math.sqrt((STIFFNESS + kt) / MASS), 0.5 * dashpot / MASS
    time = np.linspace(0.0, 1.0, 6)
    hertz = math.sqrt(omega**2 - rate**2) / (2.0 * math.pi)
    table = {"time": time, "modal_amplitude": 0.1 * np.exp(-rate * time), "frequency": [hertz] * 6}
    (run,) = read_data(solver.Scene.from_dict(raw), [table])
    found = run.model(solver.Scene.from_dict(raw), (), 3).evaluate({})
    np.testing.assert_allclose(found.values, run.observations, rtol=1e-6)


@pytest.mark.long
def test_peaks_of_unequal_blades_are_those_of_each_blade() -> None:
    disk = mistuned(solver.load_scene("bladed-disk"), of="tip", spread=0.01, seed=3)
    peaks = blade_peaks(disk, harmonics=3).value
    (run,) = read_data(disk, [{"blade": [5.0, 0.0, 2.0], "peak": [1.0, 1.0, 1.0]}])
    found = run.model(disk, ("shroud.N0",), 3).evaluate({})
    np.testing.assert_allclose(found.values, peaks[[5, 0, 2]], rtol=1e-12)
    assert np.ptp(found.values) > 1e-3 * found.values.max()
    assert math.isfinite(found.slopes[0, 0])


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"time": [0.0, 1.0, 1.0, 2.0], "modal_amplitude": [4.0, 3.0, 2.0, 1.0]}, "upward or downward"),
        ({"time": [0.0, 1.0, 2.0, 3.0], "modal_amplitude": [1.0, 2.0, 3.0, 4.0]}, "must fall"),
        ({"time": [3.0, 2.0, 1.0, 0.0], "modal_amplitude": [4.0, 3.0, 2.0, 1.0]}, "must rise"),
        ({"level": [1.0], "resonance_amplitude": [-1.0]}, "must be > 0"),
        ({"level": [1.0], "resonance_amplitude": [1.0], "dof": "nowhere"}, "dof"),
        ({"blade": [0.0], "peak": [1.0]}, "dof"),
        ({"peak": [1.0], "from": "2", "to": "1"}, "below"),
    ],
)
def test_what_is_wrong_with_a_table_is_told(table: dict[str, Any], words: str) -> None:
    with pytest.raises(optim.DataError, match=words):
        read_data(rig(), [table])
