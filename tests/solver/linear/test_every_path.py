"""Every parameter path of every scene: what it reads it sets, and its slopes are those of differences."""

from typing import Any

import numpy as np
import pytest
from body_scenes import cylinder_in_space, planar_wedge, sector_with_damper, shaped_wedge
from each import each
from floating_scenes import floating_scene
from one_variable_scenes import one_variable
from random_scenes import random_scene
from random_space import random_space
from scene_cases import bladed_disk, two_dof

from solver.balance.balance import Kind, Parameter, contact_rows, resolve
from solver.contacts.laws.load_harmonics import load_slopes
from solver.linear.assembly import linear_model, structure_derivative
from solver.linear.condensation import force_amplitudes, term_amplitudes
from solver.scene.cyclic.annulus import annulus
from solver.scene.scene import Scene, load_scene, shipped_scenes

STEP = 1e-5
KS = np.arange(4)


def turning() -> Scene:
    """Springs and dashpots with damping ratios and a loss factor, and what turns with the speed."""
    raw = two_dof().to_dict()
    raw["structure"] |= {"loss_factor": 0.02, "damping_ratio": [0.01, 0.02]}  # type: ignore[operator]
    entry = {"name": "seal", "on": "m1", "of": "m2", "k": 0.2, "k_imaginary": 0.03, "c": 0.01}
    entry |= {"antisymmetric": True, "gyroscopic": 0.01, "k_omega2": 1e-4}
    load = {"name": "pull", "dof": "m1", "force": -3.0}
    return Scene.from_dict({**raw, "speed": 3000.0, "couplings": [entry], "loads": [load]})


def in_gas() -> Scene:
    raw = bladed_disk().to_dict()
    influence = [{"offset": 0, "stiffness": 3.0, "imaginary": 5.0}, {"offset": 1, "damping": 0.1}]
    gas = {"dof": bladed_disk().dofs[0], "name": "gas", "factor": 1.5, "influence": influence}
    return Scene.from_dict({**raw, "aerodynamics": [gas]})


SCENES: dict[str, Scene] = {
    **{name: load_scene(name) for name in shipped_scenes()},
    **{f"random {seed}": random_scene(seed)[0] for seed in range(12)},
    **{f"in space {seed}": random_space(seed)[0] for seed in range(12)},
    **{f"one variable {seed}": one_variable(seed).scene for seed in range(6)},
    **{f"floating {seed}": floating_scene(seed) for seed in range(6)},
    "wedge": Scene.from_dict(planar_wedge()),
    "shaped wedge": Scene.from_dict(shaped_wedge()),
    "cylinder": Scene.from_dict(cylinder_in_space()),
    "sector with damper": Scene.from_dict(sector_with_damper()),
    "turning": turning(),
    "gas": in_gas(),
    "annulus": annulus(in_gas()),
}


def paths_of(scene: Scene) -> list[str]:
    """Those of numbers without steps that the scene gives (a law in space may leave out its kn)."""
    paths = [path for path in scene.parameter_paths() if not path.endswith(".points")]
    return [path for path in paths if not path.endswith(".kn") or scene.value(path) > 0.0]


@each("name", SCENES)
def test_a_value_is_read_as_it_was_set(name: str) -> None:
    scene = SCENES[name]
    for path in paths_of(scene):
        value = scene.value(path)
        assert scene.with_values({path: value}).value(path) == pytest.approx(value, rel=1e-15), path
        moved = value * 1.01 if value else 0.01
        there = scene.with_values({path: moved})
        assert there.value(path) == pytest.approx(moved, rel=1e-15), path
        assert there != scene


@pytest.mark.parametrize("name", SCENES)
def test_slopes_are_those_of_differences(name: str) -> None:
    scene = SCENES[name]
    for path in paths_of(scene):
        value = scene.value(path) or 1e-3
        step = STEP * abs(value)
        parameter = resolve(scene, path)
        sides = (scene.with_values({path: value + sign * step}) for sign in (1.0, -1.0))
        up, down = (sizes(side, parameter.column) for side in sides)
        found = slopes(scene.with_values({path: value}), parameter)  # N1 is no longer tied to N0
        for what, slope in found.items():
            difference = (up[what] - down[what]) / (2.0 * step)
            rounding = 1e-15 * np.abs(up[what]).max(initial=0.0) / step
            scale = 1e-7 * np.abs(difference).max(initial=0.0) + 20.0 * rounding
            np.testing.assert_allclose(slope, difference, rtol=0.0, atol=scale, err_msg=f"{path}: {what}")


def sizes(scene: Scene, column: int) -> dict[str, Any]:
    """Everything that parameters change; of the contact table, a column."""
    model = linear_model(scene)
    diameters = model.diameters(KS)
    K, C, M = model.at(diameters, KS > 0)
    loads = [[] if c.load is None else c.load.coefficients for c in scene.contacts]
    return {
        "K": K, "C": C, "M": M, "L": model.ports_at(diameters), "f": force_amplitudes(model, KS),
        "table": np.nan_to_num(contact_rows(scene, 3)[:, column]),
        "loads": np.concatenate([np.zeros(0), *loads]),
    }  # fmt: skip


def slopes(scene: Scene, parameter: Parameter) -> dict[str, Any]:
    """Their derivatives as the program has them."""
    model, here = linear_model(scene), sizes(scene, parameter.column)
    diameters, found = model.diameters(KS), {key: np.zeros_like(each) for key, each in here.items()}
    if parameter.kind is Kind.STRUCTURE:
        d = structure_derivative(scene, parameter.path)
        found["K"], found["C"], found["M"] = d.at(diameters, KS > 0)
        found["f"] = term_amplitudes(d.forces, model.observe.size, KS)
        if d.contact_here is not None and d.contact_next is not None:
            found["L"] = d.contact_here + d.contact_next * model.turns(diameters)[:, None, None]
    elif parameter.kind is Kind.CONTACTS:
        rows = contact_rows(scene, 3)
        gained = np.zeros_like(rows)
        found["table"] = gained[:, parameter.column] = parameter.active
        loads = load_slopes(rows, gained, parameter.column)
        carrying = [i for i, c in enumerate(scene.contacts) if c.load is not None]
        kept = [loads[i, : scene.contacts[i].load.coefficients.size] for i in carrying]  # type: ignore[union-attr]
        found["loads"] = np.concatenate([np.zeros(0), *kept])
    elif parameter.kind is Kind.LEVEL:
        found["f"] = (here["f"] - constant(scene)) / scene.value(parameter.path)
    else:
        found["f"] = 1j * (here["f"] * (KS > 0)[:, None])
    return found


def constant(scene: Scene) -> Any:
    """The forces that are no excitation."""
    still = linear_model(scene.with_values({"excitation.amplitude": 0.0}))
    return force_amplitudes(still, KS)
