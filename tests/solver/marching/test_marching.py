"""Time marching against closed forms, a crude return map, energy, and the reference values."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from each import each

from solver.errors import SettingError
from solver.marching import march as marching
from solver.marching.kernels import taylor as kernel
from solver.marching.kernels.event_roots import NONE, first_fall
from solver.marching.march import MarchResult, march
from solver.marching.march_result import MarchStatus
from solver.scene.scene import Scene, load_scene

DATA = Path(__file__).parent.parent.parent / "data"
TWO_DOF = json.loads((DATA / "two_dof.json").read_text())["rows"]
DISK = json.loads((DATA / "bladed_disk.json").read_text())["rows"]


def oscillator(contacts: list[dict[str, Any]], **force: Any) -> Scene:
    return Scene.from_dict(
        {
            "name": "oscillator",
            "structure": {
                "kind": "lumped",
                "masses": {"m": 2.0},
                "springs": [{"between": ["m", "ground"], "k": 50.0, "c": 3.0}],
            },
            "contacts": [{"name": f"c{i}", "between": ["m", "ground"], **c} for i, c in enumerate(contacts)],
            "excitation": {"dof": "m", "amplitude": 10.0, **force},
            "observe": {"dof": "m", "band": [0.1, 2.0]},
        }
    )


def linear_amplitude(k: float, frequency_hz: float, harmonic: int = 1) -> float:
    omega = 2 * math.pi * frequency_hz * harmonic
    return 10.0 / abs(k - 2.0 * omega**2 + 3j * omega)


def two_dof(row: dict[str, Any]) -> Scene:
    keys = ("N0", "N1", "N1_phase")
    return load_scene("two-dof").with_values({f"damper.{key}": row[key] for key in keys})


def is_open(row: dict[str, Any]) -> bool:
    return bool(abs(row["N1"]) > row["N0"])


@pytest.mark.parametrize(
    ("contacts", "k"),
    [
        ([], 50.0),
        ([{"kt": 30.0, "mu": 0.0, "N0": 100.0}], 50.0),
        ([{"kt": 30.0, "mu": 0.3, "N0": 0.0}], 50.0),
        ([{"kt": 30.0, "mu": 0.3, "N0": 1e6}], 80.0),
    ],
    ids=["no contact", "no friction", "no load", "stuck"],
)
@pytest.mark.parametrize("harmonic", [1, 3])
def test_linear_limits(contacts: list[dict[str, Any]], k: float, harmonic: int):
    result = march(oscillator(contacts, harmonic=harmonic, phase=0.7), frequency_hz=0.4)
    amplitude = linear_amplitude(k, 0.4, harmonic)
    assert result.converged
    assert result.half_peak_to_peak == pytest.approx(amplitude, rel=1e-9)
    assert result.harmonics[harmonic] == pytest.approx(amplitude, rel=1e-9)


def test_a_static_load_shifts_the_mean():
    result = march(oscillator([], harmonic=0), frequency_hz=0.4)
    assert result.mean == pytest.approx(10.0 / 50.0, rel=1e-9)
    assert result.max_abs == pytest.approx(10.0 / 50.0, rel=1e-9)
    assert result.half_peak_to_peak == pytest.approx(0.0, abs=1e-10)


def return_map(scene: Scene, frequency_hz: float, steps: int, periods: int) -> tuple[float, float]:
    """The crudest march there is: central differences, and the friction force clipped at its limit."""
    (spring,), contact, omega = scene.structure.springs, scene.contacts[0], 2 * math.pi * frequency_hz
    h, m = 1.0 / (frequency_hz * steps), scene.structure.masses[0].m
    x = before = f = 0.0
    low = high = 0.0
    for i in range(steps * periods):
        push = scene.excitation[0].amplitude * math.cos(omega * i * h) - spring.k * x - f
        inertia, drag = m / h**2, spring.c / (2 * h)
        after = (push + inertia * (2 * x - before) + drag * before) / (inertia + drag)
        limit = contact.mu * max(contact.N0 + contact.N1_value * math.cos(omega * (i + 1) * h), 0.0)
        f = min(max(f + contact.kt * (after - x), -limit), limit)
        before, x = x, after
        if i >= steps * (periods - 1):
            low, high = min(low, x), max(high, x)
    return low, high


@pytest.mark.parametrize("N1", [0.0, 8.0, 20.0], ids=["constant", "varying", "separating"])
def test_against_a_crude_return_map(N1: float):
    scene = oscillator([{"kt": 60.0, "mu": 0.5, "N0": 10.0, "N1": N1}])
    result = march(scene, frequency_hz=0.7)
    low, high = return_map(scene, 0.7, steps=8000, periods=12)
    assert result.max_abs == pytest.approx(max(-low, high), rel=2e-4)
    assert result.half_peak_to_peak == pytest.approx((high - low) / 2, rel=2e-4)


def test_power_balance():
    """Over a period the force's work is what dashpot and friction dissipate."""
    result = march(oscillator([{"kt": 60.0, "mu": 0.5, "N0": 10.0, "N1": 8.0}]), frequency_hz=0.7)
    force = 10.0 * np.cos(2 * np.pi * 0.7 * result.time)
    supplied = np.mean(force * result.velocity)
    viscous, frictional = (
        np.mean(3.0 * result.velocity**2),
        np.mean(result.contact_force[0] * result.velocity),
    )
    assert frictional > 0.1 * supplied
    assert supplied == pytest.approx(viscous + frictional, rel=1e-6)


def test_histories_follow_the_law():
    row = next(row for row in TWO_DOF if is_open(row))
    result = march(two_dof(row), frequency_hz=row["frequency_hz"])
    assert result.contacts == ("damper",)
    limit = 0.3 * result.normal_load
    assert np.all(np.abs(result.contact_force) <= limit + 1e-9)
    assert np.any(limit == 0.0)
    assert np.any(np.abs(result.contact_force) > 0.999999 * limit)
    np.testing.assert_allclose(result.slip[0], result.displacement)
    assert result.time[1] * result.time.size == pytest.approx(1.0 / row["frequency_hz"])
    spectrum = np.abs(np.fft.rfft(result.displacement)) / result.time.size
    assert result.harmonics[2] == pytest.approx(2 * spectrum[2])
    assert result.harmonics[0] == pytest.approx(abs(result.mean))


@pytest.mark.parametrize("row", TWO_DOF, ids=lambda row: f"N1={row['N1']} {row['frequency_hz']} Hz")
def test_two_dof_references(row: dict[str, Any]):
    """The marched reference is 3e-5 from the balance where the contact opens: there the balance counts.

    In full stick `half_peak_to_peak` alone is a property of the scene.
    """
    result = march(two_dof(row), frequency_hz=row["frequency_hz"])
    assert result.converged
    assert result.error_estimate < 1e-8
    if row["stuck"]:
        assert result.half_peak_to_peak == pytest.approx(row["half_peak_to_peak_balance"], rel=1e-8)
    elif is_open(row):
        assert result.max_abs == pytest.approx(row["max_abs_balance"], rel=5e-6)
        assert result.max_abs == pytest.approx(row["max_abs_marching"], rel=1e-4)
    else:
        assert result.max_abs == pytest.approx(row["max_abs_marching"], rel=1e-6)
        np.testing.assert_allclose(result.harmonics[:6], row["harmonics"], atol=1e-7 * result.max_abs)


@pytest.mark.few(4)
@pytest.mark.parametrize("row", DISK, ids=lambda row: f"N1={row['N1']} {row['frequency_hz']} Hz")
def test_bladed_disk_references(row: dict[str, Any]):
    scene = load_scene("bladed-disk").with_values({"shroud.N0": row["N0"], "shroud.N1": row["N1"]})
    result = march(scene, frequency_hz=row["frequency_hz"])
    assert result.converged
    assert result.error_estimate < 1e-7
    assert result.max_abs == pytest.approx(row["max_abs_marching"], rel=1e-6)
    assert result.half_peak_to_peak == pytest.approx(row["half_peak_to_peak_balance"], rel=3e-6)


def test_a_sector_moves_like_its_neighbour_an_eighth_of_a_period_later():
    scene = load_scene("bladed-disk")
    result = march(scene, frequency_hz=755.0)
    force = result.contact_force[:: len(scene.contacts)]
    eighth = result.time.size // 8
    np.testing.assert_allclose(force[1], np.roll(force[0], -eighth), atol=1e-6 * np.abs(force).max())


def test_eighth_order():
    """Halving the step divides the error by about 2^8 across changes of state; the estimate knows it."""
    scene = load_scene("two-dof").with_values({"damper.N1": 200.0})
    exact = march(scene, frequency_hz=0.346, steps_per_period=512, tolerance=1e-12)
    runs = [march(scene, frequency_hz=0.346, steps_per_period=n, tolerance=1e-12) for n in (64, 128)]
    errors = [abs(run.max_abs / exact.max_abs - 1.0) for run in runs]
    assert errors[0] / errors[1] > 2**6.5
    for run, error in zip(runs, errors, strict=True):
        assert error < 6.0 * run.error_estimate


def test_shifted_time_shifts_the_history():
    scene = load_scene("two-dof")
    shifted = scene.with_values({"excitation.phase": math.pi / 2, "damper.N1_phase": math.pi / 2})
    one, other = (march(s, frequency_hz=1.198) for s in (scene, shifted))
    quarter = one.time.size // 4
    np.testing.assert_allclose(other.displacement, np.roll(one.displacement, -quarter), atol=1e-8)


def test_json():
    result = march(load_scene("two-dof"), frequency_hz=1.198)
    obj = json.loads(json.dumps(result.to_json(), allow_nan=False))
    keys = "max_abs half_peak_to_peak mean harmonics periods steps_per_period error_estimate status seconds"
    assert list(obj) == keys.split()
    assert obj["status"] == MarchStatus.CONVERGED.value
    assert len(obj["harmonics"]) == 11


def test_progress_rises_to_one():
    seen: list[tuple[float, int]] = []
    result = march(
        load_scene("two-dof"),
        frequency_hz=0.769,
        on_progress=lambda done, periods: seen.append((done, periods)),
    )
    fractions, periods = zip(*seen, strict=True)
    assert list(fractions) == sorted(fractions)
    assert list(periods) == sorted(periods)
    assert len(seen) > 1
    assert seen[-1] == (1.0, result.periods)


def test_stop_on_request():
    result = march(load_scene("two-dof"), frequency_hz=0.769, should_stop=lambda: True)
    assert result.status is MarchStatus.STOPPED
    assert not result.converged
    assert result.periods <= 50
    assert math.isfinite(result.max_abs)


def test_too_few_periods():
    result = march(load_scene("two-dof"), frequency_hz=0.769, max_periods=3)
    assert result.status is MarchStatus.MAX_PERIODS
    assert result.periods == 3
    assert result.error_estimate > 1e-6


def test_growth_without_bound(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(marching, "steps_for", lambda *_: 4)
    result = march(load_scene("two-dof"), frequency_hz=0.01, max_periods=100)
    assert result.status is MarchStatus.NOT_FINITE
    assert result.to_json()["max_abs"] is None
    json.dumps(result.to_json(), allow_nan=False)


def test_endless_changes_are_reported(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(kernel, "run_periods", lambda *_: (kernel.CHATTER, 0))
    result: MarchResult = march(load_scene("two-dof"), frequency_hz=1.0)
    assert result.status is MarchStatus.CHATTER
    assert result.to_json()["error_estimate"] is None


@each(
    ("arguments", "says"),
    [
        ({"frequency_hz": 0.0}, "`frequency_hz` must be a frequency > 0 Hz"),
        ({"frequency_hz": math.nan}, "got nan"),
        ({"frequency_hz": "1"}, "got '1'"),
        ({"tolerance": 1e-20}, "`tolerance` must be a number from 1e-13"),
        ({"max_periods": 0}, "`max_periods` must be a whole number"),
        ({"steps_per_period": 127}, "`steps_per_period` must be an even number"),
        ({"steps_per_period": 2}, "at least 64 steps"),
        ({"steps_per_period": 128.0}, "even number"),
        ({"frequency_hz": 1e-6}, "need at least"),
    ],
)
def test_bad_settings(arguments: dict[str, Any], says: str):
    with pytest.raises(SettingError, match=says):
        march(load_scene("two-dof"), **{"frequency_hz": 1.0, **arguments})


@pytest.mark.parametrize(
    ("q", "place"),
    [
        ([1.0, 0.0, 0.0], NONE),
        ([1.0, -2.0, 0.0], 0.5),
        ([-1e-9, -1.0, 0.0], 0.0),
        ([0.0, 1.0, -4.0], 0.25),
        ([0.0025, -0.1, 0.9999], 0.0510051),
        ([0.0025, -0.1, 1.0001], NONE),
        ([1e-20, -1.0, 0.0], 1e-20),
    ],
    ids=["never", "crossing", "at once", "after a rise", "dips below", "stays above", "tiny"],
)
def test_first_fall(q: list[float], place: float):
    expected = place if place != 0.0510051 else (0.1 - math.sqrt(0.01 - 4 * 0.9999 * 0.0025)) / (2 * 0.9999)
    assert first_fall(np.array(q)) == pytest.approx(expected, rel=1e-12, abs=1e-15)


@pytest.mark.long
def test_random_contacts_converge():
    rng = np.random.default_rng(0)
    scene = load_scene("two-dof")
    for _ in range(200):
        load, variation = (float(rng.choice([0.0, 100.0, 10 ** rng.uniform(-1, 3)])) for _ in range(2))
        values = {"damper.N0": load, "damper.N1": variation, "damper.N1_phase": rng.uniform(-3, 3)}
        values |= {"damper.kt": 10 ** rng.uniform(0, 4), "damper.mu": float(rng.choice([0.0, 0.3, 1.0]))}
        frequency_hz = 10 ** rng.uniform(-1, 0.5)
        assert march(scene.with_values(values), frequency_hz=frequency_hz).converged
