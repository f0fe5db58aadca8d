"""Bodies in the matrices: by hand, as lumped masses, beside matrices, and their derivatives."""

from typing import Any

import numpy as np
import pytest
from cases.body_scenes import as_matrices, block_in_space, planar_wedge, sector_with_damper

from solver import Scene
from solver.linear.assembly import linear_model, structure_derivative


def test_the_mass_of_a_body_stands_behind_the_structure() -> None:
    model = linear_model(Scene.from_dict(block_in_space()))
    expected = np.diag([0.2] * 6 + [0.02] * 3 + [3e-6, 2e-6, 4e-6])
    np.testing.assert_allclose(model.M, expected, rtol=1e-14)


def test_springs_join_bodies_and_masses() -> None:
    raw = planar_wedge()
    raw["structure"]["springs"].append({"name": "tie", "between": ["ax", "damper.x"], "k": 7e3})
    given = Scene.from_dict(raw)
    K = linear_model(given).K0
    at, damper = given.dofs.index("ax"), given.dofs.index("damper.x")
    assert K[at, damper] == -7e3
    assert K[damper, damper] == 7e3
    derivative = structure_derivative(given, "structure.tie").K0
    assert derivative[damper, damper] == 1.0
    assert np.count_nonzero(derivative) == 4


def test_a_body_is_masses_with_motions_written_out() -> None:
    raw = planar_wedge()
    given = Scene.from_dict(raw)
    masses = {**raw["structure"]["masses"], "dx": 0.005, "dy": 0.005, "turn": 1e-7}
    names = {"damper.x": "dx", "damper.y": "dy", "damper.rz": "turn"}
    dampers = [
        {**d, "between": [names.get(end, end) for end in d["between"]]} for d in raw["structure"]["dampers"]
    ]
    contacts = [
        {
            **{key: value for key, value in contact.items() if key not in ("at", "normal")},
            "motions": [{names.get(t.dof, t.dof): t.factor for t in form} for form in forms],
        }
        for contact, forms in zip(raw["contacts"], given.forms, strict=True)
    ]
    nodes = [
        *raw["nodes"],
        {"name": "damper", "at": [0.0, 0.0, 0.0], "dofs": {"x": "dx", "y": "dy", "rz": "turn"}},
    ]
    written = Scene.from_dict(
        {
            **{key: value for key, value in raw.items() if key not in ("bodies", "speed")},
            "structure": {**raw["structure"], "masses": masses, "dampers": dampers},
            "nodes": nodes,
            "contacts": contacts,
        }
    )
    one, other = linear_model(given), linear_model(written)
    for name in ("M", "C0", "K0", "contact_here"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_bodies_beside_matrices_are_those_beside_masses() -> None:
    raw = block_in_space()
    del raw["structure"]["dampers"]  # which join the body to the ground
    one, other = linear_model(Scene.from_dict(raw)), linear_model(Scene.from_dict(as_matrices(raw)))
    for name in ("M", "C0", "K0", "contact_here"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), atol=1e-9)


@pytest.mark.parametrize("raw", [planar_wedge(), block_in_space(), as_matrices(block_in_space())])
def test_derivatives_by_bodies_are_those_of_differences(raw: dict[str, Any]) -> None:
    given = Scene.from_dict({**raw, "loads": [{"name": "pull", "dof": raw["observe"]["dof"], "force": 3.0}]})
    paths = [p for p in given.parameter_paths() if p.split(".")[0] in ("damper", "block", "pull", "speed")]
    assert len(paths) >= 4
    for path in paths:
        value = given.value(path)
        sides = [linear_model(given.with_values({path: value * (1.0 + e)})) for e in (1e-4, -1e-4)]
        found = structure_derivative(given, path)
        difference = (sides[0].M - sides[1].M) / (2e-4 * value)
        np.testing.assert_allclose(found.M, difference, rtol=1e-8, atol=1e-12)
        forces = [sum(t.amplitude * t.vector for t in each.forces if t.harmonic == 0) for each in sides]
        slope = sum((t.amplitude * t.vector for t in found.forces), np.zeros(found.M.shape[0]))
        np.testing.assert_allclose(slope, (forces[0] - forces[1]) / (2e-4 * value), rtol=1e-8, atol=1e-12)


def test_second_derivatives_by_the_speed_are_those_of_differences() -> None:
    given = Scene.from_dict(planar_wedge())
    sides = [structure_derivative(given.with_values({"speed": 3000.0 + e}), "speed") for e in (1.0, -1.0)]
    difference = (sides[0].forces[0].amplitude - sides[1].forces[0].amplitude) / 2.0
    (second,) = structure_derivative(given, "speed").second_forces
    assert second.amplitude == pytest.approx(difference, rel=1e-9)


def test_motions_of_the_next_sector_are_in_their_own_matrix() -> None:
    model = linear_model(Scene.from_dict(sector_with_damper()))
    assert np.count_nonzero(model.contact_next[:2].any(axis=0)) == 2
    assert not model.contact_next[2:].any()
