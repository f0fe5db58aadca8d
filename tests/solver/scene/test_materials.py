"""Strengths in scenes, the utilisation of a stress, and rows of stresses from files."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases.stress_scenes import STEEL, TERMS, stressed
from each import each

import solver
from solver.balance.kernels.haigh import utilisation
from solver.errors import SceneError
from solver.scene.materials import LINES, haigh_of, utilisation_of
from solver.scene.scene import Scene
from solver.scene.toml import toml_text


@pytest.mark.parametrize(
    ("line", "mean", "expected"),
    [
        ("goodman", 300.0, 0.5),  # 100 / (300 · 2/3)
        ("gerber", 300.0, 0.375),  # 100 / (300 · 8/9)
        ("soderberg", 300.0, 7.0 / 12.0),  # 100 / (300 · 4/7)
        ("goodman", -300.0, 1.0 / 3.0),
        ("gerber", 0.0, 1.0 / 3.0),
        ("goodman", 950.0, np.inf),  # nothing is left
    ],
)
def test_utilisation_by_hand(line: str, mean: float, expected: float) -> None:
    scene = stressed(line=line)
    haigh = np.array(haigh_of(scene, "fillet")._replace(static=0.0), dtype=np.float64)
    found = utilisation_of(utilisation(haigh, mean + 100.0, mean - 100.0)[0])
    assert found == pytest.approx(expected, rel=1e-12)


@each("seed", range(40))
def test_derivatives_of_utilisation_are_differences(seed: int) -> None:
    random = np.random.default_rng(seed)
    strength = 10.0 ** random.uniform(-3, 9)
    haigh = np.array([
        random.integers(len(LINES)), strength * 10.0 ** random.uniform(-3, 1), strength,
        strength * random.choice([0.0, random.uniform(-1.0, 0.9)]),
    ])  # fmt: skip
    a, m = strength * 10.0 ** random.uniform(-4, 0), strength * random.uniform(-0.05, 0.05)
    if abs(haigh[3] + m) < 1e-3 * strength:
        m += 0.01 * strength  # the line has a corner at no mean stress

    def at(a: float, m: float) -> np.ndarray:
        return np.array(utilisation(haigh, m + a, m - a))

    value, by_a, by_m, bent, mixed, twice = at(a, m)
    step = 1e-6 * strength
    along_a, along_m = (
        (at(a + x, m + y) - at(a - x, m - y)) / (2.0 * step) for x, y in ((step, 0.0), (0.0, step))
    )
    scale = value / strength
    assert value > 0.0
    assert along_a[[0, 2]] == pytest.approx([by_a, mixed], rel=1e-6, abs=1e-6 * scale)
    assert along_a[1] == pytest.approx(bent, rel=1e-6, abs=1e-8 * by_a / a)
    assert along_m[[0, 1, 2]] == pytest.approx([by_m, mixed, twice], rel=1e-6, abs=1e-6 * scale)


def test_a_scene_keeps_its_materials() -> None:
    scene = stressed(line="gerber")
    assert Scene.from_dict(scene.to_dict()) == scene
    assert haigh_of(scene, "root") == (LINES.index("gerber"), 300e3, 900e3, 0.0)
    plain = {key: value for key, value in scene.to_dict().items() if key != "materials"}
    plain["recovery"] = [{"name": "fillet", "unit": "MPa", "terms": TERMS}]
    assert "materials" not in Scene.from_dict(plain).to_dict()


@each(
    ("material", "row", "message"),
    [
        ({"fatigue_strength": -1.0}, {}, "fatigue_strength"),
        ({"line": "walker"}, {}, "goodman"),
        ({"ultimate_strength": None}, {}, "needs `ultimate_strength`"),
        ({"line": "soderberg", "yield_strength": None}, {}, "needs `yield_strength`"),
        ({"name": "other"}, {}, "'steel' must be one of `materials`, which are other"),
        ({}, {"unit": "m"}, "'m' must be one of Pa, kPa, MPa"),
        ({}, {"static": 901.0}, "901.0 MPa must be below `ultimate_strength` of 'steel'"),
        ({"strength": 1.0}, {}, "strength"),
        ({}, {"mean": 1.0}, "mean"),
    ],
)
def test_what_is_wrong_is_said(material: dict[str, Any], row: dict[str, Any], message: str) -> None:
    raw = stressed().to_dict()
    first: dict[str, Any] = raw["recovery"][0]  # type: ignore[index]
    raw["materials"] = [{key: value for key, value in (STEEL | material).items() if value is not None}]
    raw["recovery"] = [first | row]
    with pytest.raises(SceneError, match=message):
        Scene.from_dict(raw)


def test_two_materials_of_one_name_are_refused() -> None:
    raw = stressed().to_dict()
    raw["materials"] = [STEEL, STEEL]
    with pytest.raises(SceneError, match="is taken by"):
        Scene.from_dict(raw)


def test_the_terms_of_a_row_may_stand_in_a_file(tmp_path: Path) -> None:
    raw = stressed().to_dict()
    rows: list[dict[str, Any]] = raw["recovery"]  # type: ignore[assignment]
    raw["recovery"] = [rows[0] | {"terms": "fillet.csv"}, *rows[1:]]
    (tmp_path / "scene.toml").write_text(toml_text(raw))
    (tmp_path / "fillet.csv").write_text("dof, factor\na, 900\nb, -700\n")
    assert solver.load_scene(tmp_path / "scene.toml") == stressed()
    (tmp_path / "fillet.csv").write_text("a, 900, 0.5\n")
    with pytest.raises(SceneError, match="line 1 must be a DOF, its factor, none twice"):
        solver.load_scene(tmp_path / "scene.toml")
