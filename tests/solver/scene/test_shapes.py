"""Dampers by their shape: the bodies and contacts they make, their parameters, what is refused."""

import copy
import math
from typing import Any

import numpy as np
import pytest
from cases.body_scenes import cylinder_in_space, planar_wedge, shaped_wedge

from solver import Scene, SceneError, SettingError
from solver.linear.assembly import linear_model, structure_derivative
from solver.scene.bodies.body_shapes import SHAPES

FACES: dict[str, dict[str, Any]] = {
    "wedge": {"angle": 0.5, "width": 0.01, "length": 0.004},
    "cylinder": {"angle": 0.5, "radius": 0.004, "length": 0.01},
    "asymmetric": {"angle": 0.5, "curved_angle": 0.7, "width": 0.01, "radius": 0.004, "length": 0.004},
    "split-ring": {"width": 0.02},
}


def shaped(shape: str, **change: Any) -> Scene:
    raw = shaped_wedge()
    common = {key: value for key, value in raw["dampers"][0].items() if key not in ("shape", *FACES["wedge"])}
    return Scene.from_dict({**raw, "dampers": [{**common, "shape": shape, **FACES[shape], **change}]})


def test_a_wedge_is_the_body_and_the_contacts_written_by_hand() -> None:
    raw = shaped_wedge(N0=0.0)
    by_shape, by_hand = linear_model(Scene.from_dict(raw)), linear_model(_by_hand())
    np.testing.assert_array_equal(by_shape.M, by_hand.M)
    np.testing.assert_allclose(by_shape.contact_here, by_hand.contact_here, atol=1e-15)
    assert [t.amplitude for t in by_shape.forces] == [t.amplitude for t in by_hand.forces]


def _by_hand() -> Scene:
    """Points 1 mm off the middles of the faces, which are 5 mm off the centre of mass."""
    raw = planar_wedge()
    c, s = math.cos(math.radians(30.0)), math.sin(math.radians(30.0))
    for contact, (side, along) in zip(
        raw["contacts"], [(-1, -0.001), (-1, 0.001), (1, -0.001), (1, 0.001)], strict=True
    ):
        contact["at"] = [side * 0.005 + along * c, -side * along * s, 0.0]
        contact["tangents"] = [[c, -side * s, 0.0], [0.0, 0.0, 1.0]]
    return Scene.from_dict(raw)


@pytest.mark.parametrize("shape", FACES)
def test_faces_share_their_stiffness_out_over_their_points(shape: str) -> None:
    for points in (1, 3, 10):
        given = shaped(shape, points=points)
        assert len(given.contacts) == 2 * points
        assert sum(c.stiffnesses[0] for c in given.contacts) == pytest.approx(2.0 * 2e6)
        assert sum(c.stiffnesses[1] for c in given.contacts) == pytest.approx(2.0 * 3e6)


@pytest.mark.parametrize("shape", FACES)
def test_faces_press_outward_and_apart(shape: str) -> None:
    given = shaped(shape)
    for contact in given.contacts:
        assert contact.axes is not None
        across, outward, _ = contact.axes[2]
        assert outward > 0.5
        assert across * (1.0 if "right" in contact.name else -1.0) >= 0.0


@pytest.mark.parametrize("shape", FACES)
def test_derivatives_by_the_geometry_are_those_of_differences(shape: str) -> None:
    given = shaped(shape)
    for key in FACES[shape]:
        path = f"damper.{key}"
        value = given.value(path)
        ends = [linear_model(given.with_values({path: value * (1.0 + e)})) for e in (1e-5, -1e-5)]
        difference = (ends[0].contact_here - ends[1].contact_here) / (2e-5 * value)
        found = structure_derivative(given, path).contact_here
        assert found is not None
        assert np.any(found != 0.0) or path == "damper.length"  # along z a body in the plane does not move
        np.testing.assert_allclose(found, difference, rtol=1e-6, atol=1e-8)


def test_a_shroud_joins_two_nodes_without_a_body() -> None:
    raw = {**shaped_wedge(), "dampers": []}
    shroud = {
        "name": "shroud", "shape": "shroud", "between": ["a", "b"], "law": "elastic-normal", "angle": 0.4,
        "length": 0.01, "points": 4, "kt": 4e6, "kn": 4e6, "mu": 0.3, "N0": 40.0,
    }  # fmt: skip
    raw["structure"] = {**raw["structure"], "dampers": []}
    given = Scene.from_dict({**raw, "dampers": [shroud], "speed": 0.0})
    assert given.bodies == ()
    assert [given.to_dict()["dampers"][0]["N0"], *(c.N0 for c in given.contacts)] == [40.0] + [10.0] * 4
    assert given.contacts[0].axes is not None
    assert given.contacts[0].axes[2] == pytest.approx((math.cos(0.4), 0.0, math.sin(0.4)))


@pytest.mark.parametrize("raw", [shaped_wedge(), cylinder_in_space()])
def test_scenes_with_shapes_keep_them(raw: dict[str, Any]) -> None:
    given = Scene.from_dict(raw)
    tables = given.to_dict()
    assert "contacts" in tables
    assert tables["contacts"] == []
    assert "bodies" not in tables
    assert Scene.from_dict(tables) == given


def test_shapes_are_set_by_their_parameters() -> None:
    given = Scene.from_dict(shaped_wedge())
    changed = given.with_values(
        {"damper.points": 5, "damper.angle": 0.4, "damper.kt": 1e6, "damper.mass": 0.01}
    )
    assert len(changed.contacts) == 10
    assert changed.bodies[0].mass == 0.01
    assert changed.value("damper.angle") == 0.4
    assert changed.contacts[0].stiffnesses[0] == pytest.approx(2e5)
    assert Scene.from_dict(changed.to_dict()) == changed


def test_parts_of_shapes_are_no_parameters_of_their_own() -> None:
    given = Scene.from_dict(shaped_wedge())
    assert not any(path.startswith(("damper-left", "damper-faces")) for path in given.parameter_paths())
    with pytest.raises(SettingError, match="must be one of"):
        given.with_values({"damper-left-0.mu": 0.1})


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("damper.points", 2.5),
        ("damper.points", 101),
        ("damper.angle", 2.0),
        ("damper.width", 0.0),
        ("damper.mass", -1.0),
    ],
)
def test_values_out_of_range_are_named(path: str, value: float) -> None:
    with pytest.raises(SettingError, match=path):
        Scene.from_dict(shaped_wedge()).with_values({path: value})


@pytest.mark.parametrize(
    ("change", "pointer", "words"),
    [
        ({"shape": "wege"}, "/dampers/0/shape", "did you mean `wedge`"),
        ({"between": ["a", "c"]}, "/dampers/0/between/1", "there is no body or node 'c'"),
        ({"between": ["a", "b@next"]}, "/dampers/0/between/1", "needs a cyclic structure"),
        ({"radius": 1.0}, "/dampers/0/radius", "a damper of the shape `wedge`"),
        ({"axial": [0.0, 1.0, 0.0]}, "/dampers/0", "must be perpendicular"),
        ({"points": 0}, "/dampers/0/points", "must be >= 1"),
        ({"name": "a"}, "/dampers/0/name", "is taken"),
    ],
)
def test_mistakes_in_shapes_are_named(change: dict[str, Any], pointer: str, words: str) -> None:
    raw = copy.deepcopy(shaped_wedge())
    raw["dampers"][0].update(change)
    with pytest.raises(SceneError) as caught:
        Scene.from_dict(raw)
    found = [issue for issue in caught.value.issues if issue.pointer == pointer and words in issue.said()]
    assert found, [(issue.pointer, issue.said()) for issue in caught.value.issues]


def test_every_shape_is_tried_here() -> None:
    assert {*FACES, "shroud", "patch"} == set(SHAPES)  # the last in tests/solver/matrices/test_faces.py
