"""The annulus written out has the motion of its sector."""

import math

import numpy as np
import pytest
from each import each
from scipy.linalg import eigvalsh

from solver.errors import SettingError
from solver.linear.assembly import linear_model
from solver.scene.cyclic.annulus import annulus
from solver.scene.scene import CyclicStructure, LumpedStructure, Scene, load_scene


def disk(sectors: int = 8, order: int = 3) -> Scene:
    raw = load_scene("bladed-disk").to_dict()
    raw["structure"] = {
        **raw["structure"],  # type: ignore[dict-item]
        "sectors": sectors,
        "dampers": [{"between": ["root@next", "middle"], "c": 2.0, "name": "d"}],
    }
    raw["excitation"] = [
        {"dof": "middle", "amplitude": 50.0, "phase": 0.1, "engine_order": order},
        {"dof": "tip", "amplitude": 5.0, "harmonic": 2},
        {"dof": "tip", "amplitude": 7.0, "harmonic": 0},
    ]
    return Scene.from_dict(raw).with_values({"shroud.N1_phase": 0.2})


def sector_response(scene: Scene, omega: float, k: int) -> np.ndarray:
    """Complex amplitudes of harmonic k in sector 0, without contacts."""
    model = linear_model(scene)
    turn = np.exp(1j * k * model.interblade_phase)
    K, C = (X0 + Xp * turn + Xp.T / turn for X0, Xp in ((model.K0, model.Kp), (model.C0, model.Cp)))
    force = sum(f.vector * f.amplitude * np.exp(1j * f.phase) for f in model.forces if f.harmonic == k)
    return np.linalg.solve(K - (k * omega) ** 2 * model.M + 1j * k * omega * C, force)


@each("k", [0, 1, 2])
@each("order", [0, 1, 3, 11])
def test_linear_response_is_that_of_one_sector(k: int, order: int):
    scene = disk(order=order)
    omega = 2 * np.pi * 560.0
    one, whole = sector_response(scene, omega, k), sector_response(annulus(scene), omega, k)
    phase = np.exp(1j * k * linear_model(scene).interblade_phase * np.arange(8))
    expected = np.outer(phase, one).ravel()
    np.testing.assert_allclose(whole, expected, atol=1e-12 * np.abs(expected).max())


def test_contact_rows_are_those_of_one_sector():
    scene = disk()
    model, whole = linear_model(scene), linear_model(annulus(scene))
    rng = np.random.default_rng(1)
    one = rng.normal(size=4) + 1j * rng.normal(size=4)
    phase = np.exp(1j * model.interblade_phase * np.arange(8))
    slip = (model.contact_here + model.contact_next * phase[1]) @ one
    np.testing.assert_allclose(
        whole.contact_here @ np.outer(phase, one).ravel(), np.outer(phase, slip).ravel()
    )


def test_frequencies_are_those_of_all_diameters():
    scene = load_scene("bladed-disk")
    model, whole = linear_model(scene), linear_model(annulus(scene))
    turns = np.exp(2j * np.pi * np.arange(8) / 8)
    each = [eigvalsh(model.K0 + model.Kp * t + model.Kp.T / t, model.M) for t in turns]
    np.testing.assert_allclose(eigvalsh(whole.K0, whole.M), np.sort(np.concatenate(each)), rtol=1e-9)


def test_names_groups_and_phases():
    whole = annulus(disk())
    assert isinstance(whole.structure, LumpedStructure)
    assert whole.structure.dofs[:5] == ("tip@0", "middle@0", "root@0", "disk@0", "tip@1")
    assert whole.contacts[2].name == "shroud@1"
    assert whole.contacts[2].between == ("tip@1", "tip@2")
    assert whole.contacts[14].between == ("tip@7", "tip@0")
    assert whole.contacts[2].N1_phase == pytest.approx(0.2 + 3 * math.pi / 4)
    assert whole.observe.dof == "tip@0"
    assert whole.value("structure.tip_middle@3") == 5.09e5
    middle, tip, static = whole.excitation[3:6]
    assert middle.phase == pytest.approx(0.1 + 3 * math.pi / 4)
    assert tip.phase == pytest.approx(2 * 3 * math.pi / 4)
    assert static.phase == 0.0
    assert Scene.from_dict(whole.to_dict()) == whole


def test_paths_set_before_or_after_writing_out():
    scene, values = disk(), {"shroud.N0": 123.0, "shroud.N1_ratio": 0.4, "excitation.amplitude": 20.0}
    assert annulus(scene.with_values(values)) == annulus(scene).with_values(values)


def test_a_group_stays():
    scene = load_scene("bladed-disk")
    raw = scene.to_dict()
    raw["contacts"][0]["group"] = "all"  # type: ignore[index]
    assert annulus(Scene.from_dict(raw)).contacts[0].group == "all"


@pytest.mark.parametrize("sectors", [1, 2])
def test_few_sectors(sectors: int):
    """One sector joins nothing to itself; two are joined twice."""
    scene = disk(sectors=sectors, order=sectors - 1)
    assert isinstance(scene.structure, CyclicStructure)
    whole = annulus(scene)
    assert len(whole.contacts) == (1 if sectors == 1 else 4)
    omega = 2 * np.pi * 560.0
    np.testing.assert_allclose(
        sector_response(whole, omega, 1)[:4], sector_response(scene, omega, 1), rtol=1e-9
    )


def test_a_lumped_scene_is_refused():
    with pytest.raises(SettingError, match="must have a cyclic structure"):
        annulus(load_scene("two-dof"))
