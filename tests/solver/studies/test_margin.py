"""The designer's diagram, against dense responses and the root of another method."""

import numpy as np
import pytest
from cases.stress_scenes import TERMS, stressed
from scipy.optimize import brentq

import solver
from solver.errors import SettingError
from solver.studies.margin_diagram import most_used
from solver.studies.study_results import MarginStatus

DAMPERS = {"light": {"slides.N0": 0.5}, "heavy": {"slides.N0": 4.0}}


def used(load: float, level: float, line: str = "goodman") -> float:
    """The utilisation of the fillet from motions in time about its peak: Goodman's and Gerber's formulas."""
    scene = stressed(line=line).with_values({"slides.N0": load, "excitation.amplitude": level})

    def at(hertz: float) -> float:
        found = solver.solve(scene, frequency_hz=hertz, harmonics=5)
        a, b = (solver.time_history(found, dof, samples=2048)[1] for dof in "ab")
        stress = 60.0 + TERMS["a"] * a + TERMS["b"] * b
        amplitude, mean = 0.5 * (stress.max() - stress.min()), 0.5 * (stress.max() + stress.min())
        left = 1.0 - max(mean, 0.0) / 900.0 if line == "goodman" else 1.0 - (max(mean, 0.0) / 900.0) ** 2
        return float(amplitude / (300.0 * left))

    grid = np.linspace(0.5, 2.2, 80)
    best = grid[int(np.argmax([at(hertz) for hertz in grid]))]
    return max(at(hertz) for hertz in best + np.linspace(-0.025, 0.025, 200))


@pytest.mark.long
def test_levels_and_the_allowed_one_are_those_of_dense_responses() -> None:
    raw = stressed().to_dict()
    raw["recovery"] = raw["recovery"][:1]  # type: ignore[index]
    scene = solver.Scene.from_dict(raw)
    found = solver.margin_diagram(scene, start=0.5, stop=8.0, points=4, dampers=DAMPERS, harmonics=5)
    assert found.status is MarginStatus.COMPLETED
    assert (found.judged_by, found.unit, found.level_unit) == ("utilisation", "Pa", "N")
    for d, (name, values) in enumerate(DAMPERS.items()):
        one = found.allowed[d]
        assert (one.name, one.end) == (name, "within")
        for level, share in zip(found.level, found.used[d], strict=True):
            assert share == pytest.approx(used(values["slides.N0"], float(level)), rel=5e-5)
        assert used(values["slides.N0"], one.allowed) == pytest.approx(1.0, rel=5e-5)


def test_an_amplitude_is_allowed_up_to_its_limit() -> None:
    scene = solver.load_scene("two-dof")
    found = solver.margin_diagram(scene, start=20.0, stop=150.0, points=3, limit=2.0, harmonics=3)

    def over(level: float) -> float:
        branch = solver.sweep(scene.with_values({"excitation.amplitude": level}), harmonics=3)
        assert branch.peak is not None
        return branch.peak.value - 2.0

    assert found.allowed[0].allowed == pytest.approx(brentq(over, 20.0, 150.0, rtol=1e-12), rel=1e-8)
    assert found.allowed[0].value == pytest.approx(2.0, rel=1e-8)
    assert found.used[0] == pytest.approx(found.stress[0] / 2.0, rel=1e-14)


def test_ends_of_the_range_are_said() -> None:
    scene = solver.load_scene("two-dof")
    below = solver.margin_diagram(scene, start=100.0, stop=120.0, points=2, limit=0.1, harmonics=1)
    above = solver.margin_diagram(scene, start=1.0, stop=2.0, points=2, limit=100.0, harmonics=1)
    assert [below.allowed[0].end, above.allowed[0].end] == ["below", "above"]
    assert np.isnan([below.allowed[0].allowed, above.allowed[0].allowed]).all()
    told = str(above)
    assert "more than the range" in told
    nothing = solver.margin_diagram(scene, start=1.0, stop=2.0, points=2, harmonics=1)
    assert np.isnan(nothing.used).all()
    notes = [words for block in nothing.blocks() for name, words in block.pairs if name == "note"]
    assert notes == ["nothing says what is allowed: give stresses a material, or a limit"]
    assert solver.MarginDiagram.from_json(above.to_json()).to_json() == above.to_json()


def test_it_stops_when_asked() -> None:
    asked = iter([False, True])
    found = solver.margin_diagram(
        solver.load_scene("two-dof"), start=1.0, stop=2.0, points=3, limit=1.0, harmonics=1,
        should_stop=lambda: next(asked, True),
    )  # fmt: skip
    assert found.status is MarginStatus.STOPPED
    assert not found.reached


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"start": 0.0}, "start"),
        ({"stop": 1.0}, "stop"),
        ({"points": 1}, "points"),
        ({"limit": -1.0}, "limit"),
        ({"dampers": {}}, "dampers"),
        ({"dampers": {"x": {"damper.N9": 1.0}}}, "damper.N9"),
    ],
)
def test_what_is_wrong_is_told(keys: dict[str, object], message: str) -> None:
    with pytest.raises(SettingError, match=message):
        solver.margin_diagram(solver.load_scene("two-dof"), **{"start": 1.0, "stop": 1.0 + 1.0} | keys)  # type: ignore[arg-type]


def test_a_limit_beside_strengths_is_refused() -> None:
    with pytest.raises(SettingError, match="without strengths"):
        solver.margin_diagram(stressed(), start=1.0, stop=2.0, limit=1.0)


def test_of_a_disk_that_is_written_out_the_blade_that_is_used_most_counts() -> None:
    raw = solver.load_scene("bladed-disk").to_dict()
    steel = {"name": "steel", "fatigue_strength": 2e8, "ultimate_strength": 9e8}
    terms = {"tip": 5e5, "middle": -4e5}
    fillet = {"name": "fillet", "unit": "MPa", "terms": terms, "static": 100.0, "material": "steel"}
    mistuning = {"of": ["tip"], "spread": 0.02}
    mistuned = {**raw["structure"], "sectors": 3, "mistuning": mistuning}  # type: ignore[dict-item]
    scene = solver.Scene.from_dict({**raw, "structure": mistuned, "materials": [steel], "recovery": [fillet]})
    found = most_used(solver.sweep(scene, start=740.0, stop=770.0, harmonics=1))
    there = solver.solve(scene, frequency_hz=found.peak.at, harmonics=1)

    def used_of(sector: int) -> float:
        moved = {dof: solver.time_history(there, f"{dof}@{sector}", samples=2048)[1] for dof in terms}
        stress = 100.0 + sum(factor * moved[dof] for dof, factor in terms.items())
        mean = 0.5 * (stress.max() + stress.min())
        return float(0.5 * (stress.max() - stress.min()) / (200.0 * (1.0 - mean / 900.0)))

    shares = [used_of(sector) for sector in range(3)]
    assert found.row == f"fillet@{int(np.argmax(shares))}"
    assert found.used == pytest.approx(max(shares), rel=1e-5)
