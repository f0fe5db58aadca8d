"""The linear model of a scene: known frequencies, exact derivatives, caching."""

import math
from typing import Any

import numpy as np
import pytest
from each import each
from scipy.linalg import eigvalsh

from solver.errors import SettingError
from solver.linear.assembly import linear_model, structure_derivative
from solver.linear.model import LinearModel
from solver.scene.scene import Scene, load_scene


def frequencies(scene: Scene, diameter: int, stuck: tuple[int, ...] = ()) -> np.ndarray:
    """Undamped eigenfrequencies [Hz] of a nodal diameter with some contacts stuck."""
    model = linear_model(scene)
    turn = np.exp(2j * np.pi * diameter / model.sectors)
    K = model.K0 + model.Kp * turn + model.Kp.T / turn
    L = model.contact_here + model.contact_next * turn
    for i in stuck:
        K = K + scene.contacts[i].kt * np.outer(L[i].conj(), L[i])
    return np.sqrt(eigvalsh(K, model.M)) / (2 * np.pi)


def laxalde() -> Scene:
    """Lumped bladed disk of Laxalde et al., Eur. J. Mech. A 26 (2007) 676, without contacts."""
    return Scene.from_dict(
        {
            "name": "laxalde",
            "structure": {
                "kind": "cyclic",
                "sectors": 24,
                "masses": {"disk": 1.2, "lower": 0.35, "upper": 0.25},
                "springs": [
                    {"between": ["disk", "ground"], "k": 6e5},
                    {"between": ["disk", "disk@next"], "k": 5e7},
                    {"between": ["disk", "lower"], "k": 1e6},
                    {"between": ["lower", "upper"], "k": 2e6},
                ],
            },
            "excitation": {"dof": "upper", "amplitude": 1.0, "engine_order": 3},
            "observe": {"dof": "upper", "band": [10.0, 100.0]},
        }
    )


def mixed(kind: str) -> Scene:
    """Every kind of element, with names."""
    other = "b@next" if kind == "cyclic" else "b"
    structure: dict[str, Any] = {
        "kind": kind,
        "stiffness_proportional_damping": 1e-3,
        "masses": {"a": {"m": 1.0, "name": "ma"}, "b": 2.0},
        "springs": [
            {"between": ["ground", "a"], "k": 10.0, "c": 0.2, "name": "k1"},
            {"between": [other, "a"], "k": 7.0, "c": 0.3, "name": "k2"},
            {"between": ["a", "b"], "k": 5.0},
        ],
        "dampers": [
            {"between": ["a", other], "c": 0.1, "name": "d1"},
            {"between": ["b", "ground"], "c": 0.4},
        ],
    }
    raw: dict[str, object] = {
        "name": "mixed",
        "structure": structure | ({"sectors": 5} if kind == "cyclic" else {}),
        "excitation": {"dof": "a", "amplitude": 1.0},
        "observe": {"dof": "b", "band": [0.1, 1.0]},
    }
    return Scene.from_dict(raw)


def test_bladed_disk_has_the_published_frequencies():
    scene = load_scene("bladed-disk")
    shroud, root = 0, 1
    free = [frequencies(scene, d, (root,))[0] for d in range(5)]
    stuck = [frequencies(scene, d, (shroud, root))[0] for d in range(1, 5)]
    assert free[0] == pytest.approx(575.0, abs=0.06)
    assert free[-1] == pytest.approx(587.1, abs=0.06)
    assert stuck[0] == pytest.approx(755.0, abs=0.06)
    assert stuck[-1] == pytest.approx(785.0, abs=0.06)
    assert frequencies(scene, 0)[0] == pytest.approx(507.3, abs=0.06)


def test_laxalde_disk():
    scene = laxalde()
    assert linear_model(scene).contact_here.shape == (0, 3)
    lowest = [frequencies(scene, d)[0] for d in range(3)]
    np.testing.assert_allclose(lowest, [88.26374399, 169.3441295, 189.3018526], rtol=1e-9)
    assert frequencies(scene, 0)[1] == pytest.approx(249.31165161, rel=1e-10)
    assert frequencies(scene, 12)[-1] == pytest.approx(2062.97567761, rel=1e-10)


def test_two_dof_matrices():
    model = linear_model(load_scene("two-dof"))
    k1, k2 = (4 * math.pi) ** 2, (2 * math.pi) ** 2
    np.testing.assert_allclose(model.K0, [[k1 + k2, -k2], [-k2, k2]], rtol=1e-15)
    np.testing.assert_allclose(model.C0, [[1.0, -0.5], [-0.5, 0.5]])
    np.testing.assert_array_equal(model.M, np.eye(2))
    np.testing.assert_array_equal(model.contact_here, [[0.0, 1.0]])
    assert not model.Kp.any()
    assert not model.Cp.any()
    assert not model.contact_next.any()
    np.testing.assert_array_equal(model.observe, [0.0, 1.0])
    (force,) = model.forces
    assert (force.amplitude, force.phase, force.harmonic) == (100.0, 0.0, 1)
    np.testing.assert_array_equal(force.vector, [1.0, 0.0])
    assert (model.engine_order, model.sectors, model.interblade_phase) == (0, 1, 0.0)


def test_interblade_phase_and_next_sector():
    model = linear_model(load_scene("bladed-disk"))
    assert model.interblade_phase == pytest.approx(math.pi / 4)
    np.testing.assert_array_equal(model.contact_here[0], [1, 0, 0, 0])
    np.testing.assert_array_equal(model.contact_next[0], [-1, 0, 0, 0])
    np.testing.assert_array_equal(model.contact_here[1], [0, 0, 1, -1])


def test_a_spring_reads_the_same_from_both_ends():
    """``[b@next, a]`` and ``[a, b@next]`` are one spring; the far end loads the next sector's DOF."""
    model = linear_model(mixed("cyclic"))
    np.testing.assert_allclose(model.Kp, [[0.0, -7.0], [0.0, 0.0]])
    np.testing.assert_allclose(model.Cp, [[0.0, -0.3 - 0.1 - 7e-3], [0.0, 0.0]])
    np.testing.assert_allclose(np.diag(model.K0), [22.0, 12.0])


@each("kind", ["lumped", "cyclic"])
@each("name", ["k1", "k2", "d1", "ma"])
def test_derivatives_against_central_differences(kind: str, name: str):
    scene = mixed(kind)
    path, h = f"structure.{name}", 1e-3
    derivative = structure_derivative(scene, path)
    q = scene.value(path)
    above, below = (linear_model(scene.with_values({path: q + step})) for step in (h, -h))
    for matrix in ("M", "C0", "Cp", "K0", "Kp"):
        difference = (getattr(above, matrix) - getattr(below, matrix)) / (2 * h)
        np.testing.assert_allclose(getattr(derivative, matrix), difference, atol=1e-9)
    assert derivative.affine


def test_an_unknown_parameter_is_refused():
    for name in ("k9", ""):
        with pytest.raises(SettingError, match=r"structure\.ma, structure\.k1, structure\.k2, structure\.d1"):
            structure_derivative(mixed("lumped"), f"structure.{name}")


def test_matrices_are_shared_and_read_only():
    scene = load_scene("bladed-disk")
    model, again = linear_model(scene), linear_model(scene.with_values({"shroud.N0": 3.0}))
    assert isinstance(model, LinearModel)
    assert model.K0 is again.K0
    with pytest.raises(ValueError, match="read-only"):
        model.K0[0, 0] = 1.0
