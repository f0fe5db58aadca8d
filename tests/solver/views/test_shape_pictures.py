"""Mode shapes and deflections as they are drawn: against histories of DOFs, rigid bodies, and eigenvalues."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation

import solver
from solver.scene.scene import Scene
from solver.views.picture import picture_of, turned
from solver.views.shapes import Shape, deflection_shape, mode_shape, shape_of_motion


def over_a_period(shape: Shape, sector: int, tau: np.ndarray) -> np.ndarray:
    """The motion of every point of a sector, in its own directions, (instants, points, 3)."""
    own = shape.motions[sector if len(shape.motions) > 1 else 0]
    angle = tau[:, None] + sector * shape.turn
    waves = np.exp(1j * shape.harmonics * angle)
    return np.asarray(np.einsum("tk,kpc->tpc", waves, own).real)


@pytest.mark.parametrize(
    ("name", "hertz", "dof", "direction"),
    [("two-dof", 1.05, "m2", 0), ("bladed-disk", 740.0, "tip", 2), ("shroud-3d", 300.0, "flap", 1)],
)
def test_a_deflection_is_the_history_of_its_dofs(name: str, hertz: float, dof: str, direction: int) -> None:
    scene = solver.load_scene(name)
    solution = solver.solve(scene, frequency_hz=hertz, harmonics=7)
    shape = deflection_shape(scene, solution)
    _, x = solver.time_history(solution, dof, samples=64)
    point = shape.picture.names.index("tip" if name == "shroud-3d" else dof)
    tau = 2.0 * math.pi * np.arange(64) / 64
    found = over_a_period(shape, 0, tau)[:, point]
    assert found[:, direction] == pytest.approx(x, abs=3e-3 * np.abs(x).max())
    about_the_mean = found - found.mean(axis=0)
    assert shape.amplitude[0, point] == pytest.approx(np.linalg.norm(about_the_mean, axis=1).max(), rel=1e-2)
    assert shape.states == {contact.name: contact.state.value for contact in solution.contacts}


def test_points_of_a_body_move_as_a_rigid_body_does() -> None:
    scene = solver.load_scene("platform-wedge")
    solution = solver.solve(scene, frequency_hz=370.0, harmonics=5)
    shape, size = deflection_shape(scene, solution), 1e-7
    drawn = [i for i, role in enumerate(shape.picture.roles) if role == "body"]
    at = np.array([shape.picture.points[i] for i in drawn])
    dofs = np.array([solver.time_history(solution, f"wedge.{c}", samples=8)[1] for c in ("x", "y", "z")]).T
    turns = np.array(
        [solver.time_history(solution, f"wedge.{c}", samples=8)[1] for c in ("rx", "ry", "rz")]
    ).T
    tau = 2.0 * math.pi * np.arange(8) / 8
    moved = over_a_period(shape, 0, tau)[:, drawn]
    for now, move, turn in zip(moved, dofs, turns, strict=True):
        # A rotation so small that its arm moves along the tangent.
        rotated = (Rotation.from_rotvec(size * turn).apply(at) - at) / size
        assert now == pytest.approx(move + rotated, abs=5e-3 * np.abs(moved).max())
    # The faces rub where the contacts are, and the prism has its corners around the centre of mass.
    contacts = [shape.picture.points[i] for i in shape.picture.contacts.values()]
    assert sorted(map(tuple, contacts)) == sorted(contact.at or (0.0, 0.0, 0.0) for contact in scene.contacts)
    low, high = at.min(axis=0), at.max(axis=0)
    assert np.all((low < 0.0) & (high > 0.0))


def test_a_linear_mode_is_an_eigenvector_of_its_nodal_diameter() -> None:
    raw: dict[str, Any] = solver.load_scene("bladed-disk").to_dict()
    scene = Scene.from_dict({**raw, "contacts": [each | {"N0": 1e9} for each in raw["contacts"]]})
    for n in (0, 2, 4):
        shape = mode_shape(scene, 1, nodal_diameter=n)
        turn = np.exp(2j * math.pi * n / 8)
        names = ("tip", "middle", "root", "disk")
        K = np.zeros((4, 4), complex)
        for spring in [
            *raw["structure"]["springs"],
            *({"between": c["between"], "k": c["kt"]} for c in raw["contacts"]),
        ]:
            row = np.zeros(4, complex)
            for end, sign in zip(spring["between"], (1.0, -1.0), strict=True):
                if end != "ground":
                    row[names.index(end.removesuffix("@next"))] += sign * (
                        turn if end.endswith("@next") else 1.0
                    )
            K += spring["k"] * np.outer(row.conj(), row)
        values, vectors = eigh(K, np.diag([raw["structure"]["masses"][name] for name in names]))
        assert shape.frequency_hz == pytest.approx(math.sqrt(values[0]) / (2.0 * math.pi), rel=1e-6)
        assert shape.nodal_diameter == n
        assert shape.turn == pytest.approx(2.0 * math.pi * n / 8)
        points = [shape.picture.names.index(name) for name in names]
        found = shape.motions[0, list(shape.harmonics).index(1)][points, 2]
        alike = abs(np.vdot(found, vectors[:, 0])) / (np.linalg.norm(found) * np.linalg.norm(vectors[:, 0]))
        assert alike == pytest.approx(1.0, abs=1e-9)


def test_a_nonlinear_mode_is_drawn_as_its_result_tells_it() -> None:
    scene = solver.load_scene("bladed-disk")
    curve = solver.nonlinear_mode(
        scene, 1, amplitudes=(1e-6, 1e-4), nodal_diameter=2, harmonics=3, errors=False
    )
    shape = shape_of_motion(scene, curve.scene.dofs, curve.shape(-1), float(curve.frequency_hz[-1]), {}, 2)
    assert (shape.nodal_diameter, list(shape.harmonics)) == (2, [1])
    tip = shape.motions[0, 0, shape.picture.names.index("tip"), 2]
    assert tip == pytest.approx(curve.shape(-1)[curve.scene.dofs.index("tip")])
    with pytest.raises(solver.SettingError, match="disk"):
        shape_of_motion(scene, ("tip", "middle", "root"), np.ones(3, complex), 700.0, {})


def test_every_sector_of_a_mistuned_disk_has_its_own_motion() -> None:
    raw: dict[str, Any] = solver.load_scene("bladed-disk").to_dict()
    raw["structure"] |= {"sectors": 3, "mistuning": {"of": ["tip"], "spread": 0.05}}
    scene = Scene.from_dict(raw)
    solution = solver.solve(scene, frequency_hz=740.0, harmonics=3)
    shape = deflection_shape(scene, solution)
    assert len(shape.motions) == 3
    assert shape.turn == 0.0
    point, tau = shape.picture.names.index("tip"), 2.0 * math.pi * np.arange(16) / 16
    for j in range(3):
        _, x = solver.time_history(solution, f"tip@{j}", samples=16)
        assert over_a_period(shape, j, tau)[:, point, 2] == pytest.approx(x, abs=3e-3 * shape.amplitude.max())


def test_what_has_no_place_is_said() -> None:
    assert picture_of(solver.load_scene("shroud-3d")).notes == ["Without a place, so not drawn: disk."]
    assert "tells no places" in picture_of(solver.load_scene("two-dof")).notes[0]
    placed = picture_of(solver.load_scene("fe-disk"))
    assert placed.notes == []  # the mesh moves, and so do the DOFs that are on it
    assert placed.roles.count("mesh") == 114
    assert set(placed.contacts) == {"lower", "upper"}


def test_a_contact_with_the_next_sector_is_between_both() -> None:
    picture = picture_of(solver.load_scene("bladed-disk"))
    tip = np.array(picture.points[picture.names.index("tip")])
    shroud = np.array(picture.points[picture.contacts["shroud"]])
    assert shroud == pytest.approx(0.5 * (tip + turned(tip, (0.0, 0.0, 1.0), math.pi / 4)))
    assert turned(np.array([1.0, 0.0, 2.0]), (0.0, 0.0, 1.0), math.pi / 2) == pytest.approx([0.0, 1.0, 2.0])
