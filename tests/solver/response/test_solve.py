"""One periodic response: the reference values, the error estimate, flags, states and refusals."""

import json
import math
from typing import Any

import numpy as np
import pytest
from each import each
from scene_cases import (
    DISK_ROWS,
    TWO_DOF_ROWS,
    bladed_disk,
    loose_mass,
    mixed_disk,
    oscillator,
    row_name,
    row_scene,
    two_dof,
)

from solver import Scene, SettingError, SolutionStatus, march, solve
from solver.balance.balance import build
from solver.balance.workspace import Workspace
from solver.continuation.extrema.error_estimate import truncation_error
from solver.marching.march_result import MarchStatus
from solver.response.contact_response import ContactState

ROWS = TWO_DOF_ROWS + DISK_ROWS


@pytest.mark.parametrize("row", ROWS, ids=row_name)
def test_reference_values(row: dict[str, Any]):
    """Published balance with 61 harmonics; in full stick the mean, and so max|x|, is not a property."""
    solution = solve(row_scene(row), frequency_hz=row["frequency_hz"], harmonics=61)
    stuck = row.get("stuck", False)
    assert solution.converged
    assert solution.residual <= 1e-9
    assert ("mean_undetermined" in solution.flags) == stuck
    assert solution.half_peak_to_peak == pytest.approx(row["half_peak_to_peak_balance"], rel=1e-6)
    if not stuck:
        assert solution.max_abs == pytest.approx(row["max_abs_balance"], rel=1e-6)
    begin = 1 if stuck else 0
    np.testing.assert_allclose(
        solution.harmonics[begin:6], row["harmonics"][begin:], rtol=0.0, atol=1e-6 * solution.max_abs
    )


@pytest.mark.parametrize("row", ROWS, ids=row_name)
def test_the_error_estimate_bounds_the_error(row: dict[str, Any]):
    scene, frequency_hz = row_scene(row), row["frequency_hz"]
    truth = solve(scene, frequency_hz=frequency_hz, harmonics=61).max_abs
    for harmonics in (3, 7, 11, 21):
        solution = solve(scene, frequency_hz=frequency_hz, harmonics=harmonics)
        error = abs(solution.max_abs - truth)
        assert error <= solution.error_estimate + 1e-8 * truth, harmonics


def test_the_error_estimate_is_not_idle():
    """Where something slips, it exceeds the error by less than thirty times in most cases."""
    close = []
    for row in ROWS:
        scene, frequency_hz = row_scene(row), row["frequency_hz"]
        truth = solve(scene, frequency_hz=frequency_hz, harmonics=61)
        if "all_stuck" in truth.flags:
            continue
        for harmonics in (3, 7, 11, 21):
            solution = solve(scene, frequency_hz=frequency_hz, harmonics=harmonics)
            close.append(solution.error_estimate <= 30.0 * abs(solution.max_abs - truth.max_abs))
    assert np.mean(close) > 0.9


@pytest.mark.parametrize(
    ("harmonics", "micrometres"),
    [(1, 113.27), (3, 91.27), (5, 75.39), (7, 71.55), (11, 71.34), (21, 71.605), (41, 71.613)],
)
def test_what_harmonics_buy(harmonics: int, micrometres: float):
    """Amplitudes of the bladed disk at 700 Hz against the number of harmonics, to the digits known."""
    solution = solve(bladed_disk(N1=60.0), frequency_hz=700.0, harmonics=harmonics)
    assert 1e6 * solution.max_abs == pytest.approx(micrometres, abs=0.006)


def test_one_harmonic_misses_a_superharmonic_resonance_and_says_so():
    """At 600 Hz with a separating shroud: 14 µm by one harmonic, 177 µm in truth."""
    scene = bladed_disk(N1=400.0)
    single = solve(scene, frequency_hz=600.0, harmonics=1)
    assert 1e6 * single.max_abs == pytest.approx(14.0, abs=0.6)
    assert 1e6 * solve(scene, frequency_hz=600.0, harmonics=41).max_abs == pytest.approx(177.0, abs=1.0)
    assert single.error_estimate > 5.0 * single.max_abs


def states(scene: Scene, frequency_hz: float) -> list[ContactState]:
    return [contact.state for contact in solve(scene, frequency_hz=frequency_hz).contacts]


def test_every_state_and_flag():
    assert states(two_dof(N0=0.0), 1.2) == [ContactState.SEPARATED]
    assert states(two_dof(N0=1e4), 1.2) == [ContactState.STUCK]
    assert states(two_dof(), 1.2) == [ContactState.SLIPPING]
    assert states(two_dof(N1=200.0), 1.2) == [ContactState.LIFTING]
    assert states(bladed_disk(), 755.0) == [ContactState.SLIPPING, ContactState.STUCK]
    assert solve(two_dof(N0=1e4), frequency_hz=1.2).flags == ("all_stuck",)
    assert solve(two_dof(), frequency_hz=1.2).flags == ()
    assert solve(two_dof(N0=0.0), frequency_hz=1.2).flags == ("separation",)
    assert solve(two_dof(), frequency_hz=0.769).flags == ("mean_undetermined", "all_stuck")


def test_utilisation_of_a_stuck_contact():
    """Under a constant load it is kt max|u| / (μ N0); a stuck one that was pushed once reaches 1."""
    solution = solve(two_dof(N0=200.0, N1=0.0), frequency_hz=0.5)
    (contact,) = solution.contacts
    assert contact.utilisation == pytest.approx(30.0 * solution.half_peak_to_peak / (0.3 * 200.0), rel=1e-3)
    assert contact.utilisation < 1.0
    pushed = solve(two_dof(N0=100.0, N1=97.0), frequency_hz=0.3)
    assert pushed.contacts[0].state is ContactState.STUCK
    assert pushed.contacts[0].utilisation == pytest.approx(1.0, abs=1e-3)
    assert abs(pushed.mean) > 1e-6
    assert "mean_undetermined" in pushed.flags
    assert math.isnan(solve(two_dof(N0=0.0), frequency_hz=1.2).contacts[0].utilisation)
    assert solve(two_dof(), frequency_hz=1.2).contacts[0].utilisation == 1.0


@pytest.mark.parametrize("scene", [mixed_disk(), loose_mass()], ids=lambda scene: scene.name)
def test_other_scenes_converge_with_harmonics(scene: Scene):
    frequency_hz = 620.0 if scene.name == "bladed-disk" else 1.7
    truth = solve(scene, frequency_hz=frequency_hz, harmonics=61).max_abs
    for harmonics in (5, 11, 21):
        solution = solve(scene, frequency_hz=frequency_hz, harmonics=harmonics)
        assert solution.residual <= 1e-9
        assert abs(solution.max_abs - truth) <= solution.error_estimate + 1e-8 * truth


def test_a_part_that_nothing_holds_has_no_mean():
    """Both contacts of the loose mass slip: it may vibrate about any place, and the answer says so."""
    solution = solve(loose_mass(floor=30.0, N1=0.0), frequency_hz=1.7, harmonics=31)
    assert solution.converged
    assert solution.flags == ("mean_undetermined",)
    assert solution.half_peak_to_peak == pytest.approx(0.3201523, rel=1e-6)
    assert abs(solution.mean) < 1e-5


def test_a_part_that_creeps_has_no_periodic_motion():
    """Under a varying load the loose mass ratchets away; time marching sees it move for ever."""
    solution = solve(loose_mass(floor=30.0), frequency_hz=1.7)
    assert solution.status is SolutionStatus.RATCHETS
    assert not solution.converged
    assert math.isnan(solution.max_abs)
    marched = march(loose_mass(floor=30.0), frequency_hz=1.7, max_periods=3000)
    assert marched.status is MarchStatus.RATCHETS
    assert marched.drift > 1e-3 * marched.half_peak_to_peak


def random_scene(rng: np.random.Generator, disk: bool) -> tuple[Scene, float]:
    values = {
        "N0": 10.0 ** rng.uniform(-1.0, 4.0),
        "mu": 10.0 ** rng.uniform(-1.5, 0.3),
        "N1_phase": rng.uniform(-3.0, 3.0),
        "N1_ratio": float(rng.choice([0.0, 0.3, 0.9, 1.0, 1.5, 50.0])),
    }
    if disk:
        scene = bladed_disk(kt=10.0 ** rng.uniform(5.0, 8.0), **values)
        return scene.with_values({"root.N0": 10.0 ** rng.uniform(2.0, 4.0)}), rng.uniform(200.0, 1500.0)
    return two_dof(kt=10.0 ** rng.uniform(0.0, 4.0), **values), 10.0 ** rng.uniform(-1.0, 0.6)


@pytest.mark.few(2)
@pytest.mark.parametrize("count", [60, 200])
@pytest.mark.parametrize("disk", [False, True], ids=["two-dof", "bladed-disk"])
def test_a_start_is_always_found(disk: bool, count: int):
    """From nothing, anywhere: the ladder needs no good guess."""
    rng = np.random.default_rng(2)
    for _ in range(count):
        scene, frequency_hz = random_scene(rng, disk)
        solution = solve(scene, frequency_hz=frequency_hz, harmonics=int(rng.choice([1, 3, 7, 11])))
        assert solution.converged, (scene.contacts, frequency_hz)
        assert solution.residual <= 1e-9


def test_json():
    solution = solve(bladed_disk(), frequency_hz=755.0)
    obj = json.loads(json.dumps(solution.to_json(), allow_nan=False))
    keys = (
        "scene measured frequency_hz converged status max_abs half_peak_to_peak mean harmonics flags notes "
        "contacts stable stable_ground unique unique_ground residual error_estimate n_harmonics "
        "newton_iterations seconds"
    )
    assert list(obj) == keys.split()
    assert obj["max_abs"] == solution.max_abs
    assert len(obj["harmonics"]) == 12
    assert obj["contacts"] == {"shroud": "stick and slip", "root": "stuck"}
    assert obj["status"] == SolutionStatus.CONVERGED.value


@pytest.mark.parametrize(
    ("scene", "status"),
    [
        (oscillator({"kt": 0.5, "mu": 0.3, "N0": 100.0}, k=0.5), SolutionStatus.UNDAMPED),
        (oscillator({"kt": 0.3, "mu": 0.3, "N0": 0.1}, k=1.0), SolutionStatus.UNDAMPED),
        (oscillator(k=1.0), SolutionStatus.UNDAMPED),
        (oscillator(harmonic=0), SolutionStatus.NOT_CONVERGED),
    ],
    ids=["stuck", "slipping", "without a contact", "nothing holds the mass"],
)
def test_no_solution_is_an_outcome(scene: Scene, status: SolutionStatus):
    """Without damping, at a resonance: no bounded motion."""
    solution = solve(scene, frequency_hz=1.0 / (2.0 * math.pi), harmonics=3)
    assert solution.status is status
    assert not solution.converged
    assert math.isnan(solution.max_abs)
    assert np.isnan(solution.observed).all()
    assert solution.contacts == ()
    assert solution.to_json()["max_abs"] is None
    assert solution.to_json()["harmonics"] is None
    json.dumps(solution.to_json(), allow_nan=False)


def test_zero_harmonics_is_the_static_answer():
    scene = oscillator({"kt": 0.5, "mu": 0.3, "N0": 1.0}, k=0.5, c=0.1, harmonic=0)
    solution = solve(scene, frequency_hz=0.1, harmonics=0)
    assert solution.max_abs == pytest.approx((1.0 - 0.3) / 0.5)


def test_an_estimate_without_contacts_is_rounding():
    workspace = Workspace.of(build(oscillator(k=2.0, c=0.1)))
    assert 0.0 < truncation_error(workspace, np.zeros(0), 1.0).max_abs < 1e-13


@each(
    ("arguments", "name"),
    [
        ({"frequency_hz": 0.0}, "frequency_hz"),
        ({"frequency_hz": -3.0}, "frequency_hz"),
        ({"frequency_hz": math.nan}, "frequency_hz"),
        ({"frequency_hz": "1.2"}, "frequency_hz"),
        ({"frequency_hz": 1e300}, "frequency_hz"),
        ({"frequency_hz": 1e-300}, "frequency_hz"),
        ({"frequency_hz": 1.2, "harmonics": -1}, "harmonics"),
        ({"frequency_hz": 1.2, "harmonics": 2.5}, "harmonics"),
        ({"frequency_hz": 1.2, "harmonics": 5000}, "harmonics"),
    ],
)
def test_bad_arguments_name_field_and_value(arguments: dict[str, Any], name: str):
    with pytest.raises(SettingError) as error:
        solve(two_dof(), **arguments)
    assert error.value.name == name
    assert f"`{name}`" in str(error.value)
    assert repr(arguments[name]) in str(error.value)
