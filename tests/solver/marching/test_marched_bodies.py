"""Bodies held by contacts: the balance beside time marching, and what no frame may change."""

import math

import numpy as np
import pytest
from cases.body_scenes import as_matrices, block_in_space, cylinder_in_space, planar_wedge, sector_with_damper

from solver import Effects, Scene, solve
from solver.marching.march import march
from solver.response.time_history import time_history


def agrees(given: Scene, frequency_hz: float, harmonics: int, *, rel: float) -> None:
    marched = march(given, frequency_hz=frequency_hz)
    solution = solve(given, frequency_hz=frequency_hz, harmonics=harmonics)
    assert marched.converged
    assert solution.converged
    assert solution.half_peak_to_peak == pytest.approx(marched.half_peak_to_peak, rel=rel)


@pytest.mark.long
@pytest.mark.parametrize("frequency_hz", [250.0, 330.0, 420.0])
def test_a_pressed_wedge_agrees_with_the_march(frequency_hz: float) -> None:
    given = Scene.from_dict(planar_wedge())
    agrees(given, frequency_hz, 11, rel=1e-8)


def test_a_slipping_wedge_agrees_with_the_march() -> None:
    """Little friction: every contact slips most of the time, and no history is left."""
    raw = planar_wedge(excitation={"dof": "ax", "amplitude": 10.0})
    for contact in raw["contacts"]:
        contact["mu"] = 0.05
    given = Scene.from_dict(raw)
    marched = march(given, frequency_hz=312.0)
    solution = solve(given, frequency_hz=312.0, harmonics=25)
    assert marched.converged
    assert solution.converged
    error = abs(solution.half_peak_to_peak - marched.half_peak_to_peak)
    assert error <= min(solution.error_estimate, 1e-3 * marched.half_peak_to_peak)


def test_preload_of_a_wedge_is_its_equilibrium() -> None:
    """Without friction, on platforms that hardly move, N = CF / (2 cos angle) on each face."""
    angle = math.radians(30.0)
    raw = planar_wedge(angle, excitation={"dof": "ax", "amplitude": 1e-3})
    raw["structure"]["springs"] = [{**spring, "k": 1e13} for spring in raw["structure"]["springs"]]
    for contact in raw["contacts"]:
        contact["mu"] = 0.0
    given = Scene.from_dict(raw)
    solution = solve(given, frequency_hz=300.0, harmonics=3)
    load = given.forces[-1].amplitude
    # Two points of 1.5e6 N/m a face give way by y cos(angle) each.
    expected = load / (4.0 * 1.5e6 * math.cos(angle) ** 2)
    _, y = time_history(solution, "damper.y")
    assert float(y.mean()) == pytest.approx(expected, rel=1e-6)


def test_a_block_in_space_agrees_with_the_march() -> None:
    given = Scene.from_dict(block_in_space(limit="box"))
    agrees(given, 240.0, 25, rel=1e-6)


@pytest.mark.few(2)
@pytest.mark.parametrize("limit", ["circle", "box"])
def test_a_block_under_loads_that_move_agrees_with_the_march(limit: str) -> None:
    raw = block_in_space(law="coulomb-3d", limit=limit, kn=3e6, N0=60.0, prestressed=True)
    given = Scene.from_dict(raw)
    agrees(given, 240.0, 9, rel=1e-8)


def test_a_pressed_cylinder_agrees_with_the_march() -> None:
    """All six motions of a body, which contacts in space alone hold."""
    raw = cylinder_in_space(law="coulomb-3d")
    raw["structure"]["springs"] = [s for s in raw["structure"]["springs"] if "roll.z" not in s["between"]]
    given = Scene.from_dict(raw)
    agrees(given, 240.0, 7, rel=1e-8)


@pytest.mark.parametrize("form", ["matrices", "modes"])
def test_bodies_beside_matrices_respond_as_beside_masses(form: str) -> None:
    raw = block_in_space(limit="box")
    lumped = {**raw, "structure": {k: v for k, v in raw["structure"].items() if k != "dampers"}}
    given, other = Scene.from_dict(lumped), Scene.from_dict(as_matrices(lumped, form))
    solutions = [solve(scene, frequency_hz=240.0, harmonics=9).half_peak_to_peak for scene in (given, other)]
    assert solutions[1] == pytest.approx(solutions[0], rel=1e-8)
    starts = [march(scene, frequency_hz=240.0, max_periods=5).half_peak_to_peak for scene in (given, other)]
    assert starts[1] == pytest.approx(starts[0], rel=1e-6)


def test_axes_of_tangents_do_not_matter_to_a_circle() -> None:
    amplitudes = []
    for angle in (0.0, 0.7, 2.0):
        c, s = math.cos(angle), math.sin(angle)
        tangents = [[0.0, c, s], [0.0, -s, c]]
        given = Scene.from_dict(block_in_space(tangents=tangents))
        amplitudes.append(solve(given, frequency_hz=260.0, harmonics=7).half_peak_to_peak)
    assert amplitudes[1:] == pytest.approx(amplitudes[:1] * 2, rel=1e-8)


@pytest.mark.parametrize("power", [1, 2])
def test_turning_the_whole_scene_changes_nothing(power: int) -> None:
    turn = np.linalg.matrix_power(np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), power)
    amplitudes = [
        solve(Scene.from_dict(raw), frequency_hz=260.0, harmonics=7).half_peak_to_peak
        for raw in (block_in_space(), block_in_space(turn))
    ]
    assert amplitudes[1] == pytest.approx(amplitudes[0], rel=1e-8)


def test_one_sector_with_a_body_stands_for_all() -> None:
    given = Scene.from_dict(sector_with_damper())
    one = solve(given, frequency_hz=340.0, harmonics=7)
    whole = solve(given, frequency_hz=340.0, harmonics=7, effects=Effects(every_sector=True))
    assert one.converged
    assert whole.converged
    assert whole.half_peak_to_peak == pytest.approx(one.half_peak_to_peak, rel=1e-7)


def test_a_disk_with_bodies_agrees_with_the_march() -> None:
    given = Scene.from_dict(sector_with_damper(4))
    agrees(given, 340.0, 15, rel=1e-4)
