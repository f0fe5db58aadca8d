"""Derivatives by mass, inertia, loads and speed, and continuation in them."""

import math
from typing import Any

import numpy as np
import pytest
from cases.body_scenes import block_in_space, cylinder_in_space, planar_wedge, shaped_wedge

from solver import Scene, SettingError, load_scene
from solver.balance.balance import build
from solver.balance.workspace import Workspace
from solver.sensitivity.gradient import Sensitivities

TWO_PI = 2.0 * math.pi


def _amplitude(scene: Scene, at_hz: float, start: Any) -> float:
    balance = build(scene, harmonics=7)
    found = Workspace.of(balance).solve(TWO_PI * at_hz, start)
    assert found.converged
    return Sensitivities(balance, ()).gradient(found.u, at_hz).value


def _check(scene: Scene, paths: list[str], at_hz: float, rel: float = 1e-5) -> None:
    balance = build(scene, harmonics=7)
    found = Workspace.of(balance).solve(TWO_PI * at_hz)
    assert found.converged
    slopes = Sensitivities(balance, paths).gradient(found.u, at_hz).by_parameters
    for path, slope in zip(paths, slopes, strict=True):
        value = scene.value(path)
        step = (
            1e-3 if path.endswith("Izz") else 1e-5
        ) * value  # inertia hardly matters: it needs a large one
        sides = [_amplitude(scene.with_values({path: value + e}), at_hz, found.u) for e in (step, -step)]
        least = 1e-6 * sides[0] / value
        assert slope == pytest.approx((sides[0] - sides[1]) / (2.0 * step), rel=rel, abs=least), path


def _wedge() -> Scene:
    loads = [{"name": "pull", "on": "damper", "direction": [0.6, 0.8, 0.0], "force": 5.0}]
    return Scene.from_dict(planar_wedge(loads=loads, excitation={"dof": "ax", "amplitude": 20.0}))


def test_gradients_of_a_pressed_wedge_are_those_of_differences() -> None:
    paths = ["damper.mass", "damper.radius_of_rotation", "speed", "pull.force", "excitation.amplitude"]
    _check(_wedge(), [*paths, "damper.Izz"], 318.0, rel=2e-4)


def test_gradients_by_the_mass_of_a_floating_block_are_those_of_differences() -> None:
    """Contacts alone hold the block, and the damping is not proportional."""
    raw = block_in_space(limit="box", N0=5.0)
    del raw["structure"]["dampers"]
    _check(Scene.from_dict(raw), ["block.mass", "block.Ixx", "block.Izz"], 240.0, rel=1e-4)


@pytest.mark.parametrize("held", [True, False], ids=["held", "floating"])
def test_gradients_by_the_shape_of_a_wedge_are_those_of_differences(held: bool) -> None:
    raw = shaped_wedge()
    if not held:
        del raw["structure"]["dampers"]
    names = ("angle", "width", "length", "mass", "radius_of_rotation", "Izz", "mu", "kt", "kn", "N0")
    _check(Scene.from_dict(raw), [f"damper.{name}" for name in names], 318.0, rel=1e-3)


def test_gradients_by_the_shape_of_a_block_are_those_of_differences() -> None:
    """A cylinder between masses with x, y and z, all six of its motions."""
    _check(
        Scene.from_dict(cylinder_in_space()), ["roll.angle", "roll.radius", "roll.length", "roll.mass"], 240.0
    )


@pytest.mark.parametrize("name", ["wedge", "cylinder"])
def test_gradients_of_a_shipped_damper_are_those_of_differences(name: str) -> None:
    paths = [f"{name}.{key}" for key in ("mass", "angle", "mu", "kt")]
    _check(load_scene(f"platform-{name}"), [*paths, "speed"], 345.0, rel=1e-6)


def test_places_of_contacts_are_not_continued_in() -> None:
    with pytest.raises(SettingError, match="moves the contacts"):
        build(Scene.from_dict(shaped_wedge()), "damper.angle", harmonics=3, frequency_hz=300.0)


@pytest.mark.parametrize("path", ["speed", "damper.mass", "pull.force", "excitation.amplitude"])
def test_continuation_follows_constant_forces(path: str) -> None:
    scene = _wedge()
    value = scene.value(path)
    moved = 1.07 * value
    along = Workspace.of(build(scene, path, harmonics=5, frequency_hz=330.0))
    there = Workspace.of(build(scene.with_values({path: moved}), harmonics=5))
    found = there.solve(TWO_PI * 330.0)
    assert found.converged
    norm, _ = along.evaluate(found.u, moved)
    assert norm < 1e-9
    # And its slope by the parameter is that of differences.
    step = 1e-4 * value
    slope = np.array(along.receptance(moved).u_linear[1])
    sides = [np.array(along.receptance(moved + e).u_linear[0]) for e in (step, -step)]
    np.testing.assert_allclose(
        slope, (sides[0] - sides[1]) / (2.0 * step), rtol=1e-6, atol=1e-8 * float(np.abs(slope).max())
    )


def test_the_level_of_the_excitation_leaves_loads_alone() -> None:
    scene = _wedge()
    along = Workspace.of(build(scene, "excitation.amplitude", harmonics=3, frequency_hz=330.0))
    means = [along.receptance(level).u_linear[0, 0].copy() for level in (1.0, 50.0)]
    np.testing.assert_array_equal(means[0], means[1])


def test_a_level_of_both_static_forces_and_loads_is_refused() -> None:
    forces = [{"dof": "ax", "amplitude": 5.0}, {"dof": "ay", "amplitude": 5.0, "harmonic": 0}]
    scene = Scene.from_dict(planar_wedge(excitation=forces))
    with pytest.raises(SettingError, match="write those as"):
        build(scene, "excitation.amplitude", harmonics=3, frequency_hz=330.0)


def test_hessians_by_masses_and_loads_are_differences_of_gradients() -> None:
    raw = block_in_space(limit="box", N0=20.0)
    for contact in raw["contacts"]:  # slides in one direction, whose second derivatives are known
        contact["law"] = "coulomb"
        del contact["limit"]
    loads = [{"name": "pull", "on": "block", "direction": [0.0, 1.0, 0.0], "force": 8.0}]
    raw["structure"]["springs"] += [
        {"between": [f"block.{way}", "ground"], "k": k}
        for way, k in {"x": 1e5, "y": 1e4, "z": 1e5, "rx": 10.0, "ry": 10.0, "rz": 10.0}.items()
    ]
    scene = Scene.from_dict({**raw, "loads": loads})
    paths = ["block.mass", "pull.force", "excitation.amplitude"]
    balance = build(scene, harmonics=7)
    found = Workspace.of(balance).solve(TWO_PI * 240.0)
    assert found.converged
    hessian = Sensitivities(balance, paths).hessian(found.u, 240.0).hessian
    for i, path in enumerate(paths):
        value = scene.value(path)
        step = 1e-4 * value
        sides = []
        for moved in (value + step, value - step):
            near = build(scene.with_values({path: moved}), harmonics=7)
            there = Workspace.of(near).solve(TWO_PI * 240.0, found.u)
            sides.append(Sensitivities(near, paths).gradient(there.u, 240.0).by_parameters)
        difference = (sides[0] - sides[1]) / (2.0 * step)
        np.testing.assert_allclose(hessian[i], difference, rtol=1e-4, atol=1e-6 * np.abs(difference).max())


def test_hessians_by_the_speed_are_refused() -> None:
    raw = planar_wedge()
    raw["contacts"] = [
        {"name": "rub", "between": ["ax", "damper.x"], "kt": 1e6, "mu": 0.3, "N0": 20.0},
        {"name": "rest", "between": ["by", "damper.y"], "kt": 1e6, "mu": 0.3, "N0": 1e5},
    ]
    scene = Scene.from_dict(raw)
    balance = build(scene, harmonics=3)
    found = Workspace.of(balance).solve(TWO_PI * 300.0)
    with pytest.raises(SettingError, match="only gradients"):
        Sensitivities(balance, ["speed"]).hessian(found.u, 300.0)


def test_gradients_by_a_damping_beside_a_load_are_those_of_differences() -> None:
    """Of a structure given by its matrices, whose modes carry the damping alone."""
    raw = load_scene("fe-disk").to_dict()
    loads = [{"name": "pull", "dof": raw["observe"]["dof"], "force": 1.0}]  # type: ignore[index]
    paths = ["structure.stiffness_proportional_damping", "pull.force"]
    low, high = load_scene("fe-disk").observe.band
    scene = Scene.from_dict({**raw, "loads": loads}).with_values({paths[0]: 1e-6})
    _check(scene, paths, 0.5 * (low + high), rel=1e-4)
