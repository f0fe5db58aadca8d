"""Couplings, gas, structural damping and speed on a sector given by its matrices, against the lumped disk."""

import math
from typing import Any

import numpy as np
import pytest
from sector_cases import ROWS, as_matrices, sector_matrices

import solver
from solver import Effects, Scene, SceneError, SettingError, load_scene
from solver.balance.balance import build
from solver.balance.workspace import Workspace
from solver.contacts.kernels.system import MODES
from solver.linear.assembly import linear_model, structure_derivative
from solver.linear.modal import decompose
from solver.linear.natural_frequencies import natural_frequencies
from solver.scene.cyclic.annulus import annulus
from solver.sensitivity.gradient import Sensitivities

LUMPED = load_scene("bladed-disk").to_dict()
HZ = 690.0
GYROSCOPIC = {"on": "tip", "of": "root", "antisymmetric": True, "gyroscopic": 2.0e-3}
ONE_WAY = {"on": "tip", "of": "middle", "k": 4.0e4, "c": 1.5}
BEYOND = {
    "on": "tip", "of": "disk", "offset": 1, "antisymmetric": True, "gyroscopic": -1.0e-3, "k_omega2": 0.01,
}  # fmt: skip
GAS = {"dof": "tip", "name": "gas", "factor": 0.7, "influence": [
    {"damping": 0.5}, {"offset": 1, "stiffness": 900.0}, {"offset": -1, "stiffness": -900.0},
]}  # fmt: skip
WAVES = {"dof": "tip", "nodal_diameters": [{"diameter": 1, "stiffness": -700.0, "imaginary": 900.0}]}
TERMS: dict[str, dict[str, Any]] = {
    "gyroscopic": {"couplings": [GYROSCOPIC, BEYOND], "speed": 3000.0},
    "one way": {"couplings": [ONE_WAY]},
    "gas": {"aerodynamics": [GAS]},
    "waves": {"aerodynamics": [WAVES]},
    "speed order": {"couplings": [GYROSCOPIC], "speed_order": 6.0},
}


def both(terms: dict[str, Any], **structure: Any) -> tuple[Scene, Scene]:
    """The disk lumped and by matrices, with the same terms."""
    raw: dict[str, Any] = LUMPED | terms
    raw["structure"] = LUMPED["structure"] | structure
    given = as_matrices(load_scene("bladed-disk"), **structure) | terms
    return Scene.from_dict(raw), Scene.from_dict(given)


def solved(scene: Scene, harmonics: int = 5, **options: Any) -> Any:
    found = solver.solve(scene, frequency_hz=HZ, harmonics=harmonics, **options)
    assert found.converged
    return found


@pytest.mark.parametrize("terms", TERMS.values(), ids=TERMS)
def test_terms_of_a_sector_of_matrices_are_those_of_the_lumped_disk(terms: dict[str, Any]) -> None:
    plain, (lumped, given) = solved(both({})[0]), both(terms)
    one, other = solved(lumped), solved(given)
    assert other.max_abs == pytest.approx(one.max_abs, rel=1e-9)
    assert abs(one.max_abs - plain.max_abs) > 1e-4 * plain.max_abs  # the terms do something
    np.testing.assert_allclose(other.observed, one.observed, atol=1e-9 * np.abs(one.observed).max())
    found = [natural_frequencies(scene, stuck=True) for scene in (lumped, given)]
    np.testing.assert_allclose(found[1], found[0], rtol=1e-9)


@pytest.mark.parametrize("terms", [TERMS["gyroscopic"], TERMS["gas"], {}], ids=["gyroscopic", "gas", "loss"])
def test_every_sector_with_the_terms_is_one_sector(terms: dict[str, Any]) -> None:
    loss = {} if terms else {"loss_factor": 0.02}
    lumped, given = both(terms, **loss)
    whole = solved(given, 3, effects=Effects(every_sector=True))
    assert whole.max_abs == pytest.approx(solved(given, 3).max_abs, rel=1e-8)
    assert whole.max_abs == pytest.approx(solved(lumped, 3).max_abs, rel=1e-8)


def test_structural_damping_of_a_full_and_of_a_reduced_sector() -> None:
    lumped, full = both({}, loss_factor=0.03)
    raw = full.to_dict()
    by_hand: dict[str, Any] = {"diameters": list(range(5)), "M": [], "K": []}
    for n in range(5):
        K, _, M = (each[0] for each in linear_model(full).plain(np.array([n])))
        for key, matrix in (("M", M), ("K", K)):
            by_hand[key].append({"real": matrix.real.tolist(), "imag": matrix.imag.tolist()})
    for key in "MK":
        del raw["structure"][key]
    raw["structure"] |= {"diameters": by_hand, "cyclic": {}}
    reduced = Scene.from_dict(raw)
    one, other, third = (solved(scene) for scene in (lumped, full, reduced))
    assert one.max_abs < 0.99 * solved(both({})[0]).max_abs
    assert other.max_abs == pytest.approx(one.max_abs, rel=1e-9)
    assert third.max_abs == pytest.approx(one.max_abs, rel=1e-9)


def test_matrices_of_the_speed_and_unsymmetric_ones_of_a_full_sector() -> None:
    """As files they are what the couplings of the same rows are; the high boundary is the next sector's."""
    _, K = sector_matrices()
    tip, root, disk, high = ROWS["tip"], ROWS["root"], ROWS["disk"], 4
    G, K2, K1 = np.zeros((5, 5)), np.zeros((5, 5)), K.copy()
    for row, column, value in ((tip, root, 2.0e-3), (disk, high, 1.0e-3)):
        G[row, column], G[column, row] = value, -value
    K2[tip, tip], K2[tip, high], K2[high, tip] = 0.3, -0.1, -0.1
    K1[tip, root] += 4.0e4
    K1[tip, high] += 2.0e4
    whole = {"symmetric": False, "K": K1.tolist(), "G": G.tolist(), "K_omega2": K2.tolist()}
    given = Scene.from_dict(as_matrices(load_scene("bladed-disk"), **whole) | {"speed": 3000.0})
    terms = [
        {"on": "tip", "of": "root", "antisymmetric": True, "gyroscopic": 2.0e-3},
        {"on": "disk", "of": "disk", "offset": 1, "gyroscopic": 1.0e-3},
        {"on": "disk", "of": "disk", "offset": -1, "gyroscopic": -1.0e-3},
        {"on": "tip", "of": "tip", "k_omega2": 0.3},
        {"on": "tip", "of": "disk", "offset": 1, "k_omega2": -0.1},
        {"on": "disk", "of": "tip", "offset": -1, "k_omega2": -0.1},
        {"on": "tip", "of": "root", "k": 4.0e4},
        {"on": "tip", "of": "disk", "offset": 1, "k": 2.0e4},
    ]
    # Proportional damping goes with the symmetric part of K, of which a coupling is no part.
    other, given = (
        scene.with_values({"structure.stiffness_proportional_damping": 0.0})
        for scene in (both({"couplings": terms, "speed": 3000.0})[1], given)
    )
    n, moving = np.arange(8), np.ones(8, np.bool_)
    for one, two in zip(linear_model(other).at(n, moving), linear_model(given).at(n, moving), strict=True):
        np.testing.assert_allclose(two, one, atol=1e-12 * np.abs(one).max())
    assert solved(given, 3, effects=Effects(every_sector=True)).max_abs == pytest.approx(
        solved(given, 3).max_abs, rel=1e-8
    )


def test_a_sector_without_terms_keeps_its_modes_found_once() -> None:
    """Scenes with other loads have the same matrices, the same object, and the form of modes."""
    given = both({})[1]
    n, moving = np.array([0, 1, 2]), np.array([False, True, True])
    scenes = given, given.with_values({"root.N0": 3.0})
    held = [linear_model(scene).matrices(n, moving) for scene in scenes]
    assert held[0] is held[1]
    found = decompose(held[0])
    assert found is not None
    assert found.form == MODES


@pytest.mark.parametrize(
    ("terms", "structure", "path"),
    [
        (TERMS["gas"], {}, "gas.factor"),
        ({}, {"loss_factor": 0.02}, "structure.loss_factor"),
        (TERMS["gyroscopic"], {}, "speed"),
        ({}, {"loss_factor": 0.02, "mass_proportional_damping": 2.0}, "structure.mass_proportional_damping"),
    ],
    ids=["gas", "loss", "speed", "proportional"],
)
def test_gradients_are_differences(terms: dict[str, Any], structure: dict[str, Any], path: str) -> None:
    scene = Scene.from_dict(as_matrices(load_scene("bladed-disk"), **structure) | terms)
    at = scene.value(path)
    step = 1e-4 * at
    sides = [scene.with_values({path: at + s}) for s in (step, -step)]
    balance = build(scene, harmonics=3)
    u = Workspace.of(balance).solve(2.0 * math.pi * HZ).u
    found = Sensitivities(balance, (path,)).gradient(u, HZ).by_parameters[0]
    high, low = (solved(side, 3).max_abs for side in sides)
    assert found == pytest.approx((high - low) / (2.0 * step), rel=1e-5)

    derivative = structure_derivative(scene, path)
    n, moving = np.array([0, 1, 2, 4, 7]), np.array([False, True, True, True, True])
    up, down = (linear_model(side).at(n, moving) for side in sides)
    for dX, above, below in zip(derivative.at(n, moving), up, down, strict=True):
        difference = (above - below) / (2.0 * step)
        # What a matrix of this size leaves of a difference over so small a step.
        rounding = 1e-15 * np.abs(above).max() / step
        np.testing.assert_allclose(dX, difference, atol=1e-6 * np.abs(difference).max() + rounding)


def test_the_march_follows_gas_and_speed() -> None:
    raw = as_matrices(load_scene("bladed-disk"), sectors=3) | {
        "couplings": [GYROSCOPIC], "aerodynamics": [GAS], "speed": 3000.0,
    }  # fmt: skip
    scene = Scene.from_dict(raw).with_values({"shroud.N0": 20.0})
    marched = solver.march(scene, frequency_hz=HZ, steps_per_period=400)
    assert marched.half_peak_to_peak == pytest.approx(solved(scene, 31).half_peak_to_peak, rel=1e-4)


def reduced_sector(**structure: Any) -> dict[str, Any]:
    """The disk at nodal diameter 1, as if it were reduced there."""
    full = both({})[1]
    K, _, M = (each[0] for each in linear_model(full).plain(np.array([1])))
    table = {key: [{"real": X.real.tolist(), "imag": X.imag.tolist()}] for key, X in (("M", M), ("K", K))}
    raw: dict[str, Any] = full.to_dict()
    raw["structure"] = {key: value for key, value in raw["structure"].items() if key not in "MK"} | {
        "diameters": {"diameters": [1], **table}, "cyclic": {},
    } | structure  # fmt: skip
    return raw | {"speed": 3000.0}


def test_what_a_sector_cannot_have_is_said() -> None:
    skew = np.array([[0.0, 1.0], [-1.0, 0.0]])
    for key, value in (("G", np.pad(skew, (0, 2))), ("K_omega2", np.eye(4))):
        with pytest.raises(SceneError, match=f"`{key}` is a matrix of a full sector, not of a reduced one"):
            Scene.from_dict(reduced_sector(**{key: value.tolist()}))
    with pytest.raises(SceneError, match="`symmetric` = false is for K and C of a full sector"):
        Scene.from_dict(reduced_sector(symmetric=False))
    given = as_matrices(load_scene("bladed-disk"))
    with pytest.raises(SceneError, match="`ground` moves a base, which a cyclic structure has not"):
        Scene.from_dict(given | {"excitation": {"ground": {"tip": 1.0}, "amplitude": 1.0}})
    apart = Scene.from_dict(as_matrices(load_scene("bladed-disk"), damping_ratio=[0.01, 0.02]))
    assert solved(apart).converged
    with pytest.raises(SettingError, match=r"damping_ratio.*must be one number where all sectors are solved"):
        annulus(apart)
    lossy = both({}, loss_factor=0.02)[1]
    with pytest.raises(SettingError, match=r"loss_factor.*cannot be marched"):
        solver.march(lossy, frequency_hz=HZ)


@pytest.mark.parametrize("which", [0, 1], ids=["lumped", "matrices"])
def test_a_response_is_the_only_one_where_terms_do_no_work(which: int) -> None:
    """Gyroscopic terms leave the proof as it is; stiffness that is not symmetric, and loss, do not."""
    assert solved(both({})[which]).uniqueness.proven
    assert solved(both({"couplings": [GYROSCOPIC], "speed": 3000.0})[which]).uniqueness.proven
    for scene in (
        both(TERMS["gyroscopic"]),
        both(TERMS["gas"]),
        both(TERMS["one way"]),
        both({}, loss_factor=0.02),
    ):
        assert not solved(scene[which]).uniqueness.proven
