"""Checks to rounding: energy, scaling, symmetry, linear limits, one sector and the annulus, time marching."""

import math
from typing import Any

import numpy as np
import pytest
from each import each
from other_units import in_other_units
from scene_cases import DISK_ROWS, bladed_disk, loose_mass, mixed_disk, oscillator, row_scene, two_dof

from solver import (
    Scene,
    SettingError,
    Solution,
    annulus,
    hysteresis_loop,
    march,
    motion,
    power_balance,
    solve,
    time_history,
)
from solver.jit.fourier import basis, derivative, to_complex
from solver.linear.assembly import linear_model
from solver.linear.condensation import force_amplitudes
from solver.response.time_history import matrices

CASES = {
    "slipping": (two_dof(), 1.198),
    "separating": (two_dof(N1=200.0), 1.198),
    "separating, stiff": (two_dof(N1=150.0, N1_phase=1.0, kt=3e4), 2.2),
    "disk": (bladed_disk(), 755.0),
    "disk, separating": (bladed_disk(N1=400.0), 640.0),
    "disk, both slipping": (bladed_disk(N0=60.0).with_values({"root.N0": 40.0}), 560.0),
    "mixed disk": (mixed_disk(), 540.0),
    "loose mass": (loose_mass(), 1.7),
}
every_case = pytest.mark.parametrize("name", CASES)


def solved(name: str, harmonics: int = 11) -> Solution:
    scene, frequency_hz = CASES[name]
    solution = solve(scene, frequency_hz=frequency_hz, harmonics=harmonics)
    assert solution.converged
    return solution


def rotated(coefficients: np.ndarray, turn: float) -> np.ndarray:
    """Complex amplitudes of q(tau + turn)."""
    amplitudes = to_complex(coefficients)
    return amplitudes * np.exp(1j * turn * np.arange(amplitudes.shape[-1]))


@every_case
@pytest.mark.parametrize("harmonics", [1, 4, 11, 30])
def test_power_in_is_power_out(name: str, harmonics: int):
    solution = solved(name, harmonics)
    power = power_balance(solution)
    assert power.input_w > 0.0
    assert power.viscous_w > 0.0
    assert power.friction_w > 0.0
    assert abs(power.input_w - power.viscous_w - power.friction_w) <= 1e-10 * power.input_w
    assert power.imbalance <= 1e-10
    assert power.friction_w == pytest.approx(sum(power.contacts_w.values()))
    assert list(power.contacts_w) == [contact.name for contact in solution.contacts]


@every_case
def test_power_of_friction_is_the_area_of_the_loops(name: str):
    solution = solved(name)
    power = power_balance(solution)
    for contact in solution.contacts:
        u, f = hysteresis_loop(solution, contact.name, samples=20_000)
        area = 0.5 * float((f + np.roll(f, -1)) @ (np.roll(u, -1) - u))
        lost = power.contacts_w[contact.name]
        assert solution.frequency_hz * area == pytest.approx(lost, abs=1e-6 * power.input_w)


@every_case
def test_power_from_histories(name: str):
    """Forces times velocities and dashpots, summed over the instants of a period."""
    solution = solved(name)
    scene, power = solution.scene, power_balance(solution)
    omega = 2.0 * math.pi * solution.frequency_hz
    tau = np.linspace(0.0, 2.0 * math.pi, 256, endpoint=False)
    velocities = omega * basis(tau, 11) @ derivative(motion(solution)).T
    put_in = sum(
        float(
            np.mean(
                force.amplitude * np.cos(force.harmonic * tau + force.phase) * (velocities @ force.vector)
            )
        )
        for force in linear_model(scene).forces
    )
    assert put_in == pytest.approx(power.input_w, rel=1e-9)


@every_case
def test_motion_of_the_whole_structure(name: str):
    """It holds the observed DOF, and the contacts between its DOFs slip as the solution says."""
    solution = solved(name)
    model = linear_model(solution.scene)
    coefficients = motion(solution)
    assert coefficients.shape == (len(model.dofs), 23)
    scale = np.abs(coefficients).max()
    np.testing.assert_allclose(model.observe @ coefficients, solution.observed, atol=1e-10 * scale)
    amplitudes = to_complex(coefficients)
    for k in range(12):
        _, _, L = matrices(model, k)
        slips = [to_complex(contact.slip)[k] for contact in solution.contacts]
        np.testing.assert_allclose(L @ amplitudes[:, k], slips, atol=1e-9 * scale)


@every_case
def test_homogeneity(name: str):
    """Forces and loads scaled together scale the motion and its error estimate."""
    scene, frequency_hz = CASES[name]
    factor = 7.3
    scaled = scene.with_values(
        {
            "excitation.amplitude": factor * scene.value("excitation.amplitude"),
            **{f"{c.name}.N0": factor * c.N0 for c in scene.contacts},
            **{f"{c.name}.N1": factor * c.N1_value for c in scene.contacts},
        }
    )
    one, other = solved(name), solve(scaled, frequency_hz=frequency_hz)
    assert other.max_abs == pytest.approx(factor * one.max_abs, rel=1e-10)
    np.testing.assert_allclose(other.observed, factor * one.observed, atol=1e-10 * other.max_abs)
    assert other.error_estimate == pytest.approx(factor * one.error_estimate, rel=1e-3)


@every_case
@pytest.mark.parametrize(("length", "time"), [(1e-3, 1.0), (1.0, 1e-3), (0.3048, 60.0)])
def test_units(name: str, length: float, time: float):
    """Metres or millimetres, seconds or minutes: the same motion."""
    scene, frequency_hz = CASES[name]
    one = solved(name)
    other = solve(in_other_units(scene, length=length, time=time), frequency_hz=frequency_hz * time)
    assert length * other.max_abs == pytest.approx(one.max_abs, rel=1e-10)
    np.testing.assert_allclose(length * other.observed, one.observed, atol=1e-10 * one.max_abs)
    assert power_balance(other).input_w * length / time == pytest.approx(power_balance(one).input_w, rel=1e-9)


@pytest.mark.parametrize(
    ("scene", "frequency_hz"),
    [(two_dof(N1=0.0), 1.198), (bladed_disk(N1=0.0), 755.0), (bladed_disk(N0=90.0, N1=0.0), 640.0)],
    ids=["two-dof", "disk", "disk at a superharmonic"],
)
def test_a_constant_load_has_odd_harmonics_only(scene: Scene, frequency_hz: float):
    solution = solve(scene, frequency_hz=frequency_hz, harmonics=21)
    assert solution.harmonics[3] > 1e-4 * solution.harmonics[1]
    assert solution.harmonics[0::2].max() < 1e-12 * solution.max_abs
    assert abs(solution.mean) < 1e-12 * solution.max_abs
    assert solution.max_abs == pytest.approx(solution.half_peak_to_peak, rel=1e-12)


def linear_amplitudes(scene: Scene, frequency_hz: float, *, stuck: bool, harmonics: int) -> np.ndarray:
    """Complex amplitudes of the observed DOF with all contacts stuck, or none there."""
    model, omega = linear_model(scene), 2.0 * math.pi * frequency_hz
    kt = np.array([contact.kt for contact in scene.contacts]) * stuck
    found = []
    for k in range(harmonics + 1):
        K, C, L = matrices(model, k)
        Z = K + L.conj().T @ (kt[:, None] * L) - (k * omega) ** 2 * model.M + 1j * k * omega * C
        force = force_amplitudes(model, np.array([k]))[0]
        found.append(model.observe @ np.linalg.solve(Z, force) if np.any(force) else 0.0)
    return np.array(found)


@pytest.mark.parametrize("name", ["slipping", "disk", "mixed disk"])
@pytest.mark.parametrize("stuck", [True, False])
def test_linear_limits(name: str, stuck: bool):
    scene, frequency_hz = CASES[name]
    load = 1e9 if stuck else 0.0
    limit = scene.with_values({f"{contact.name}.N0": load for contact in scene.contacts})
    limit = limit.with_values({f"{contact.name}.N1": 0.0 for contact in scene.contacts})
    solution = solve(limit, frequency_hz=frequency_hz, harmonics=3)
    expected = linear_amplitudes(scene, frequency_hz, stuck=stuck, harmonics=3)
    np.testing.assert_allclose(to_complex(solution.observed), expected, atol=1e-11 * np.abs(expected).max())
    assert power_balance(solution).friction_w == pytest.approx(
        0.0, abs=1e-12 * power_balance(solution).input_w
    )


@each("name", ["slipping", "separating", "separating, stiff", "disk", "disk, separating"])
@each("turn", [0.1, 1.7, -2.5])
def test_shift_of_the_origin_of_time(name: str, turn: float):
    scene, frequency_hz = CASES[name]
    later = scene.with_values(
        {
            "excitation.phase": scene.value("excitation.phase") + turn,
            **{f"{c.name}.N1_phase": c.N1_phase + turn for c in scene.contacts},
        }
    )
    one, other = solved(name), solve(later, frequency_hz=frequency_hz)
    np.testing.assert_allclose(
        to_complex(other.observed), rotated(one.observed, turn), atol=1e-10 * one.max_abs
    )
    assert other.max_abs == pytest.approx(one.max_abs, rel=1e-10)


@pytest.mark.parametrize("name", ["disk", "disk, separating", "disk, both slipping", "mixed disk"])
def test_one_sector_is_the_whole_annulus(name: str):
    scene, frequency_hz = CASES[name]
    one = solved(name, 5)
    whole = solve(annulus(scene), frequency_hz=frequency_hz, harmonics=5)
    assert whole.residual <= 1e-9
    np.testing.assert_allclose(whole.observed, one.observed, atol=1e-9 * one.max_abs)
    assert whole.max_abs == pytest.approx(one.max_abs, rel=1e-9)
    phase = linear_model(scene).interblade_phase
    sectors = len(whole.contacts) // len(one.contacts)
    for j in range(sectors):
        for i, contact in enumerate(one.contacts):
            there = whole.contacts[j * len(one.contacts) + i]
            expected = rotated(contact.slip, j * phase)
            np.testing.assert_allclose(to_complex(there.slip), expected, atol=1e-8 * one.max_abs)
    assert power_balance(whole).input_w == pytest.approx(sectors * power_balance(one).input_w, rel=1e-8)


@pytest.mark.parametrize(
    ("scene", "frequency_hz", "last"),
    [(two_dof(), 1.198, 2e-7), (two_dof(N1=200.0), 1.198, 2e-6), (two_dof(N0=60.0), 2.2, 2e-7)],
    ids=["slipping", "separating", "second resonance"],
)
def test_the_balance_goes_to_time_marching(scene: Scene, frequency_hz: float, last: float):
    marched = march(scene, frequency_hz=frequency_hz)
    errors = [
        abs(solve(scene, frequency_hz=frequency_hz, harmonics=H).max_abs / marched.max_abs - 1.0)
        for H in (3, 9, 27, 81)
    ]
    assert errors[0] > errors[1] > errors[2] > errors[3]
    assert errors[3] < last
    fine = solve(scene, frequency_hz=frequency_hz, harmonics=81)
    np.testing.assert_allclose(fine.harmonics[:11], marched.harmonics, atol=1e-6 * marched.max_abs)


@pytest.mark.parametrize("row", DISK_ROWS, ids=lambda row: f"N1={row['N1']} {row['frequency_hz']} Hz")
def test_the_disk_goes_to_the_marched_annulus(row: dict[str, Any]):
    errors = [
        abs(
            solve(row_scene(row), frequency_hz=row["frequency_hz"], harmonics=H).max_abs
            / row["max_abs_marching"]
            - 1.0
        )
        for H in (3, 21, 61)
    ]
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 5e-6


@pytest.mark.parametrize("name", ["slipping", "separating", "separating, stiff", "disk, both slipping"])
def test_loops_follow_the_law(name: str):
    solution = solved(name)
    given = solution.scene.contacts[0]
    u, f = hysteresis_loop(solution, given.name, samples=4000)
    tau = 2.0 * math.pi / 4000 * np.arange(4000)
    limit = given.mu * np.maximum(basis(tau, 1) @ solution.contacts[0].load, 0.0)
    scale = limit.max()
    assert np.all(np.abs(f) <= limit + 1e-9 * scale)
    inside = np.abs(f) < limit - 1e-6 * scale
    steps = inside & np.roll(inside, -1) & (np.roll(limit, -1) > 0.0)
    assert steps.sum() > 3
    stiffness = (np.roll(f, -1) - f)[steps] / (np.roll(u, -1) - u)[steps]
    assert np.median(stiffness) == pytest.approx(given.kt, rel=1e-6)
    harmonics = np.fft.rfft(f) / 2000.0
    np.testing.assert_allclose(
        harmonics[1:12], to_complex(solution.contacts[0].force)[1:12], atol=2e-3 * scale
    )


def test_loops_of_contacts_that_do_not_slip():
    stuck = solve(two_dof(N0=1e4), frequency_hz=1.0)
    u, f = hysteresis_loop(stuck, "damper")
    np.testing.assert_allclose(f, 30.0 * u, atol=1e-12 * np.abs(f).max())
    pushed = solve(two_dof(N0=100.0, N1=97.0), frequency_hz=0.3)
    u, f = hysteresis_loop(pushed, "damper")
    assert np.ptp(f - 30.0 * u) < 1e-9 * np.abs(f).max()
    assert abs(np.mean(f - 30.0 * u)) > 0.1 * np.abs(f).max()
    free = solve(two_dof(N0=0.0), frequency_hz=1.0)
    assert not hysteresis_loop(free, "damper")[1].any()
    assert power_balance(free).friction_w == 0.0


def test_time_history():
    solution = solved("disk")
    t, x = time_history(solution, "tip", samples=1000)
    assert t[0] == 0.0
    assert t[1] * 1000 == pytest.approx(1.0 / 755.0)
    assert np.abs(x).max() == pytest.approx(solution.max_abs, rel=1e-4)
    np.testing.assert_allclose(
        np.fft.rfft(x)[1:12] / 500.0, to_complex(solution.observed)[1:], atol=1e-12 * solution.max_abs
    )
    assert time_history(solution, "disk")[1].size == 512


def test_nothing_moves_without_a_force():
    solution = solve(oscillator({"kt": 1.0, "mu": 0.3, "N0": 1.0}, k=1.0, amplitude=0.0), frequency_hz=0.1)
    power = power_balance(solution)
    assert (power.input_w, power.viscous_w, power.friction_w, power.imbalance) == (0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("call", "name", "value"),
    [
        (lambda s: hysteresis_loop(s, "dmaper"), "contact", "dmaper"),
        (lambda s: hysteresis_loop(s, "damper", samples=1), "samples", 1),
        (lambda s: hysteresis_loop(s, "damper", samples=2.0), "samples", 2.0),
        (lambda s: time_history(s, "m3"), "dof", "m3"),
        (lambda s: time_history(s, "m1", samples=True), "samples", True),
    ],
)
def test_bad_arguments_name_field_and_value(call: Any, name: str, value: object):
    with pytest.raises(SettingError) as error:
        call(solved("slipping"))
    assert error.value.name == name
    assert f"`{name}`" in str(error.value)
    assert repr(value) in str(error.value)


def test_what_did_not_converge_has_no_motion():
    scene = oscillator({"kt": 0.5, "mu": 0.3, "N0": 100.0}, k=0.5)
    failed = solve(scene, frequency_hz=1.0 / (2.0 * math.pi), harmonics=3)
    for call in (
        motion,
        power_balance,
        lambda s: time_history(s, "x"),
        lambda s: hysteresis_loop(s, "damper"),
    ):
        with pytest.raises(SettingError, match="must have converged") as error:
            call(failed)
        assert error.value.name == "solution"


@pytest.mark.parametrize("loads", [{"N1_ratio": 1.0}, {"load": [{"order": 2, "amplitude": 100.0}]}])
def test_a_load_that_touches_zero_does_not_open_by_rounding(loads: dict[str, Any]):
    """Whether the least of it is 1e-17 N or -1e-17 N is a matter of the origin of time."""
    raw: dict[str, Any] = two_dof(N0=100.0).to_dict()
    contact = raw["contacts"][0]
    contact.pop("N1_ratio")
    found = []
    for phase in np.linspace(-3.0, 3.0, 23).tolist():
        given = {"N1_phase": phase, **loads}
        if "load" in loads:
            given = {"load": [{**loads["load"][0], "phase": 2.0 * phase}]}
        raw["contacts"][0] = contact | given
        raw["excitation"]["phase"] = phase
        found.append(solve(Scene.from_dict(raw), frequency_hz=1.198))
    assert {each.flags for each in found} == {()}
    assert [each.contacts[0].state.name for each in found] == ["SLIPPING"] * len(found)
    np.testing.assert_allclose([each.max_abs for each in found], found[0].max_abs, rtol=1e-10)


@each("phase", np.linspace(-3.0, 3.0, 13).tolist())
def test_a_part_at_rest_under_a_load_that_touches_zero_stays(phase: float):
    """Rounding decided whether the contact that alone holds it held anything."""
    raw = loose_mass().to_dict()
    raw["structure"]["masses"]["still"] = 1.0  # type: ignore[index]
    touching = {"kt": 40.0, "mu": 0.3, "N0": 30.0, "N1_ratio": 1.0, "N1_phase": phase}
    still = {"name": "still", "between": ["still", "ground"], **touching}
    raw["contacts"].append(still)  # type: ignore[attr-defined]
    solution = solve(Scene.from_dict(raw), frequency_hz=1.7)
    assert solution.converged
    assert solution.contacts[-1].state.name == "STUCK"
    assert solution.max_abs == pytest.approx(solved("loose mass").max_abs, rel=1e-9)
