"""Bodies, nodes and frames: kinematics against finite rotations, and what is refused."""

import copy
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from cases.body_scenes import block_in_space, planar_wedge, sector_with_damper
from each import each
from scipy.spatial.transform import Rotation

from solver import Scene, SceneError, SettingError
from solver.contacts.frames import frame
from solver.scene.bodies.kinematics import forms_of, placed_forms
from solver.scene.cyclic.annulus import annulus

RANDOM = np.random.default_rng(7)


def _motion(form: Any, values: dict[str, float]) -> float:
    return float(sum(term.factor * values[term.dof] for term in form))


def _vector() -> tuple[float, float, float]:
    x, y, z = RANDOM.normal(size=3)
    return (float(x), float(y), float(z))


def _unit() -> tuple[float, float, float]:
    v = np.array(_vector())
    x, y, z = v / np.linalg.norm(v)
    return (float(x), float(y), float(z))


@each("seed", range(10))
def test_points_move_as_in_a_small_finite_rotation(seed: int) -> None:
    rng = np.random.default_rng(seed)
    given = Scene.from_dict(block_in_space())
    values = {dof: float(1e-6 * rng.normal()) for dof in given.dofs}
    p, e = tuple(0.1 * rng.normal(size=3)), tuple(rng.normal(size=3))
    body = given.bodies[0]
    q, theta = (
        np.array([values[f"block.{c}"] for c in names]) for names in (("x", "y", "z"), ("rx", "ry", "rz"))
    )
    arm = np.array(p) - np.array(body.at)
    moved = np.array(body.at) + q + Rotation.from_rotvec(theta).as_matrix() @ arm - np.array(p)
    other = np.array([values["a1"], values["a2"], values["a3"]])
    (form,) = placed_forms(given, ("block", "a"), p, (e,))
    assert _motion(form, values) == pytest.approx(float(np.dot(e, moved - other)), rel=1e-5, abs=1e-16)


def test_power_of_contact_forces_is_the_generalised_power() -> None:
    given = Scene.from_dict(block_in_space())
    contact = given.contacts[1]
    assert contact.axes is not None
    assert contact.at is not None
    forms = placed_forms(given, contact.between, contact.at, contact.axes)
    speeds = {dof: float(RANDOM.normal()) for dof in given.dofs}
    forces = RANDOM.normal(size=3)
    pull = np.array(contact.axes).T @ forces
    v, w = (
        np.array([speeds[f"block.{c}"] for c in names]) for names in (("x", "y", "z"), ("rx", "ry", "rz"))
    )
    moment = np.cross(contact.at, pull)
    generalised = v @ pull + w @ moment - pull @ np.array([speeds["a1"], speeds["a2"], speeds["a3"]])
    power = sum(f * _motion(form, speeds) for f, form in zip(forces, forms, strict=True))
    assert power == pytest.approx(float(generalised), rel=1e-12)


def test_rows_of_the_wedge_are_those_derived_by_hand() -> None:
    angle = math.radians(30.0)
    c, s = math.cos(angle), math.sin(angle)
    given = Scene.from_dict(planar_wedge(angle))
    contact = given.contacts[3]  # right-1: 1 mm down the right face
    x, y = 0.005 + 0.001 * c, 0.002 - 0.001 * s
    tangent, normal = forms_of(given, contact)
    assert {t.dof: t.factor for t in normal} == pytest.approx(
        {"damper.x": s, "damper.y": c, "damper.rz": x * c - y * s, "bx": -s, "by": -c}
    )
    assert {t.dof: t.factor for t in tangent} == pytest.approx(
        {"damper.x": -c, "damper.y": s, "damper.rz": x * s + y * c, "bx": c, "by": -s}
    )


@each("seed", range(20))
def test_frames_are_orthonormal(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = rng.normal(size=3)
    n /= np.linalg.norm(n)
    axes = np.array(frame((float(n[0]), float(n[1]), float(n[2]))))
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)
    np.testing.assert_allclose(axes[2], n, atol=1e-15)
    assert abs(axes[0, 2]) < 1e-15 or abs(n[2]) > 0.999


def test_given_tangents_are_kept_up_to_typing() -> None:
    first, second, normal = frame((0.87, 0.5, 0.0), ((-0.5, 0.87, 0.0), (0.0, 0.0, -1.0)))
    assert second == pytest.approx((0.0, 0.0, -1.0))
    assert first == pytest.approx((-0.5 / 1.00344, 0.87 / 1.00344, 0.0), abs=1e-4)
    assert np.linalg.norm(normal) == pytest.approx(1.0, abs=1e-15)


def test_turning_everything_turns_the_forms() -> None:
    given = Scene.from_dict(block_in_space())
    R = Rotation.from_rotvec([0.3, -0.5, 0.8]).as_matrix()
    contact = given.contacts[2]
    assert contact.axes is not None
    assert contact.at is not None
    (form,) = placed_forms(given, ("block", "ground"), contact.at, (contact.axes[0],))
    (other,) = placed_forms(given, ("block", "ground"), R @ contact.at, (R @ contact.axes[0],))
    before, after = ({t.dof: t.factor for t in each} for each in (form, other))
    for names in (("x", "y", "z"), ("rx", "ry", "rz")):
        here, there = (np.array([d.get(f"block.{c}", 0.0) for c in names]) for d in (before, after))
        np.testing.assert_allclose(there, R @ here, atol=1e-15)


def test_ends_in_the_next_sector_move_in_turned_axes() -> None:
    given = Scene.from_dict(sector_with_damper(8))
    turn = Rotation.from_rotvec([0.0, 0.0, 2.0 * math.pi / 8]).as_matrix()
    form = forms_of(given, given.contacts[0])[0]
    next_factors = np.array([-t.factor for t in form if t.next])
    assert given.contacts[0].axes is not None
    # e · (turn q) = (turnᵀ e) · q
    np.testing.assert_allclose(next_factors, (turn.T @ given.contacts[0].axes[0])[:2], atol=1e-15)


def test_the_annulus_has_a_body_in_every_sector() -> None:
    whole = annulus(Scene.from_dict(sector_with_damper(4)))
    assert [body.name for body in whole.bodies] == [f"damper@{j}" for j in range(4)]
    assert whole.dofs[-3:] == ("damper.x@3", "damper.y@3", "damper.rz@3")
    assert Scene.from_dict(whole.to_dict()) == whole
    last = {term.dof for form in whole.forms[6] for term in form}
    assert {"damper.x@3", "bx@0"} <= last
    assert "bx@3" not in last


@pytest.mark.parametrize("raw", [planar_wedge(), block_in_space(), sector_with_damper()])
def test_scenes_with_bodies_survive_a_round_trip(raw: dict[str, Any]) -> None:
    given = Scene.from_dict(raw)
    assert Scene.from_dict(given.to_dict()) == given


def test_rotation_loads_bodies_outward() -> None:
    given = Scene.from_dict(planar_wedge())
    force = given.forces[-1]
    assert (force.dof, force.harmonic) == ("damper.y", 0)
    assert force.amplitude == pytest.approx(0.005 * 0.3 * (3000.0 * 2.0 * math.pi / 60.0) ** 2)


def test_loads_on_nodes_act_along_their_dofs() -> None:
    loads = [{"on": "a", "direction": [0.6, 0.8, 0.0], "force": 10.0}, {"dof": "damper.rz", "force": 0.1}]
    given = Scene.from_dict({**planar_wedge(), "loads": loads})
    found = {force.dof: force.amplitude for force in given.forces[1:3]}
    assert found == pytest.approx({"ax": 6.0, "ay": 8.0})
    assert given.forces[3].dof == "damper.rz"


Change = Callable[[dict[str, Any]], object]
MISTAKES: dict[str, tuple[Change, str, str]] = {
    "unknown body": (
        lambda s: s["contacts"][0].update(between=["damber", "a"]),
        "/contacts/0/between/0",
        "did you mean `damper`",
    ),
    "a DOF without position": (
        lambda s: s["contacts"][0].update(between=["damper", "ax"]),
        "/contacts/0/between/1",
        "has no position",
    ),
    "zero normal": (
        lambda s: s["contacts"][0].update(normal=[0.0, 0.0, 0.0]),
        "/contacts/0",
        "`normal` must be a unit vector",
    ),
    "long normal": (
        lambda s: s["contacts"][0].update(normal=[1.0, 1.0, 0.0]),
        "/contacts/0",
        "divide it by 1.41421",
    ),
    "no place": (lambda s: s["contacts"][0].pop("at"), "/contacts/0", "`normal` of a contact needs `at`"),
    "slanted tangents": (
        lambda s: s["contacts"][0].update(tangents=[[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
        "/contacts/0",
        "must be perpendicular",
    ),
    "pairs and a place": (
        lambda s: s["contacts"][0].update(normal_between=["ax", "bx"]),
        "/contacts/0/normal_between",
        "exclude each other",
    ),
    "unknown DOF of a node": (
        lambda s: s["nodes"][0]["dofs"].update(x="axx"),
        "/nodes/0/dofs/x",
        "did you mean `ax`",
    ),
    "unknown component": (lambda s: s["nodes"][0].update(dofs={"u": "ax"}), "/nodes/0/dofs", "dofs"),
    "name twice": (lambda s: s["nodes"][0].update(name="damper"), "/nodes/0/name", "is taken by"),
    "name of a contact": (lambda s: s["bodies"][0].update(name="left-0"), "/bodies/0/name", "one owner"),
    "reserved name": (lambda s: s["bodies"][0].update(name="speed"), "/bodies/0/name", "reserved"),
    "negative mass": (lambda s: s["bodies"][0].update(mass=-1.0), "/bodies/0/mass", "must be > 0"),
    "one moment in space": (lambda s: s["bodies"][0].pop("plane"), "/bodies/0", "three moments or a 3 x 3"),
    "out without radius": (lambda s: s["bodies"][0].pop("radius_of_rotation"), "/bodies/0", "needs `radius"),
    "long out": (
        lambda s: s["bodies"][0].update(out=[0.0, 2.0, 0.0]),
        "/bodies/0/out",
        "must be a unit vector",
    ),
    "load nowhere": (lambda s: s.update(loads=[{"force": 1.0}]), "/loads/0", "needs `dof` or `on`"),
    "load on nobody": (
        lambda s: s.update(loads=[{"on": "c", "direction": [1.0, 0.0, 0.0], "force": 1.0}]),
        "/loads/0/on",
        "there is no body or node 'c'",
    ),
    "unknown DOF of a body": (
        lambda s: s["observe"].update(dof="damper.z"),
        "/observe/dof",
        "there is no DOF 'damper.z'",
    ),
    "next sector": (
        lambda s: s["contacts"][0].update(between=["damper", "a@next"]),
        "/contacts/0/between/1",
        "needs a cyclic",
    ),
    "motions beside a place": (
        lambda s: s["contacts"][0].update(motions=[{"ax": 1.0}, {"ay": 1.0}]),
        "/contacts/0",
        "exclude each other",
    ),
}


@each("mistake", MISTAKES)
def test_mistakes_in_space_are_named(mistake: str) -> None:
    raw = copy.deepcopy(planar_wedge())
    change, pointer, words = MISTAKES[mistake]
    change(raw)
    with pytest.raises(SceneError) as caught:
        Scene.from_dict(raw)
    found = [issue for issue in caught.value.issues if issue.pointer == pointer and words in issue.said()]
    assert found, [(issue.pointer, issue.said()) for issue in caught.value.issues]


def test_contacts_into_the_next_sector_need_an_axis() -> None:
    raw = sector_with_damper()
    del raw["structure"]["axis"]
    with pytest.raises(SceneError, match="give the direction of the axis"):
        Scene.from_dict(raw)


def test_motions_are_one_for_each_of_the_law() -> None:
    raw = planar_wedge()
    contact = {key: raw["contacts"][0][key] for key in ("name", "law", "between", "kt", "kn", "mu", "N0")}
    raw["contacts"] = [{**contact, "motions": [{"ax": 1.0}]}]
    with pytest.raises(SceneError, match="must be 2, one for each relative motion"):
        Scene.from_dict(raw)


@pytest.mark.parametrize("path", ["damper.mass", "damper.Izz", "damper.radius_of_rotation", "speed"])
def test_numbers_of_bodies_are_parameters(path: str) -> None:
    given = Scene.from_dict(planar_wedge())
    assert path in given.parameter_paths()
    assert given.with_values({path: 2.5}).value(path) == 2.5
    with pytest.raises(SettingError, match="must be a number"):
        given.with_values({path: -1.0})


def test_groups_of_bodies_are_set_together() -> None:
    raw = planar_wedge()
    raw["bodies"] = [
        {**raw["bodies"][0], "group": "dampers"},
        {**raw["bodies"][0], "name": "d2", "group": "dampers"},
    ]
    scene = Scene.from_dict(raw)
    changed = scene.with_values({"dampers.mass": 0.004})
    assert [body.mass for body in changed.bodies] == [0.004, 0.004]
    with pytest.raises(SettingError, match=r"`dampers.mass` cannot be set together with `d2.mass`"):
        scene.with_values({"d2.mass": 0.003, "dampers.mass": 0.004})


def test_moments_of_a_tensor_are_set_on_its_diagonal() -> None:
    changed = Scene.from_dict(block_in_space()).with_values({"block.Iyy": 5e-6})
    np.testing.assert_allclose(changed.bodies[0].tensor, np.diag([3e-6, 5e-6, 4e-6]))
