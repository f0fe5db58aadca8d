"""Bodies that nothing but contacts holds: tracked, mapped, designed, stable, against single responses."""

from __future__ import annotations

import itertools
import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from floating_cases import pulled, two_blades, underplatform
from return_map import Return

import optim
from optim.results.design_result import DesignStatus
from optim.results.studies_result import CampbellStatus
from optim.robust.robust_result import RobustStatus
from service.cli import main
from solver import (
    BranchStatus,
    Scene,
    least_peak,
    response_map,
    solve,
    stability,
    sweep,
    track_peak,
)
from solver.studies.peaks.track_results import TrackStatus
from solver.studies.study_results import MapStatus

H = 3
LOADS = (30.0, 800.0)


def blades(**extra: float) -> Scene:
    """Two blades with a damper between them, round the resonances."""
    raw = two_blades(**extra).to_dict()
    return Scene.from_dict({**raw, "observe": {"dof": "b1", "band": [290.0, 350.0]}})


def peak(values: Mapping[str, float], scene: Scene | None = None, harmonics: int = H) -> float:
    """The highest peak of one response."""
    branch = sweep((scene or blades()).with_values(dict(values)), harmonics=harmonics)
    assert branch.status is BranchStatus.COMPLETED
    assert branch.peak is not None
    return branch.peak.value


def test_a_tracked_peak():
    track = track_peak(blades(), "left.N0", 60.0, 85.0, harmonics=H, checks=0)
    assert track.status is TrackStatus.TRACKED
    for i in np.linspace(0, track.parameter.size - 1, 4).astype(int):
        load = float(track.parameter[i])
        assert track.peak[i] == pytest.approx(peak({"left.N0": load}), rel=1e-8)
        at = solve(
            blades().with_values({"left.N0": load}), frequency_hz=float(track.frequency[i]), harmonics=H
        )
        assert at.half_peak_to_peak == pytest.approx(track.peak[i], rel=1e-8)


def test_a_map():
    found = response_map(blades(), "left.N0", 30.0, 150.0, steps=3, frequencies=5, harmonics=H, ridge=False)
    assert found.status is MapStatus.COMPLETED
    for (i, load), (j, hz) in itertools.product(enumerate(found.parameter), enumerate(found.frequency)):
        there = blades().with_values({"left.N0": float(load)})
        point = solve(there, frequency_hz=float(hz), harmonics=H)
        assert found.amplitude[i, j] == pytest.approx(point.max_abs, rel=1e-8)


def test_a_campbell_diagram():
    diagram = optim.campbell_diagram(blades(), speeds_rpm=(17_400.0, 21_000.0), orders=[1], harmonics=H)
    assert diagram.status is CampbellStatus.COMPLETED
    ((crossing,),) = (order.crossings for order in diagram.orders)
    point = solve(blades(), frequency_hz=crossing.frequency_hz, harmonics=H)
    assert point.half_peak_to_peak == pytest.approx(crossing.amplitude, rel=1e-8)
    assert crossing.amplitude == pytest.approx(peak({}), rel=1e-8)


def test_the_best_load_of_one_contact():
    """Design and least peak agree, and no load of a grid, coarse and round the optimum, is better."""
    result = optim.design(blades(), variables={"left.N0": LOADS}, harmonics=H)
    assert result.status is DesignStatus.OPTIMAL
    assert result.evaluation is not None
    enough = result.problem.harmonics  # three leave half peak to peak open by 7 %
    assert result.known.measure == "half_peak_to_peak"
    assert result.known.relative <= 0.05
    best, at = result.evaluation.objective, result.optimum["left.N0"]
    assert peak({"left.N0": at}, harmonics=enough) == pytest.approx(best, rel=1e-8)
    for load in (*np.geomspace(*LOADS, 6), *(at * np.linspace(0.98, 1.02, 4))):
        assert peak({"left.N0": float(load)}, harmonics=enough) >= best * (1.0 - 1e-6)
    least = least_peak(blades(), "left.N0", 50.0, 100.0, harmonics=enough)
    assert least.peak == pytest.approx(best, rel=1e-6)


def test_the_commands(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    path = tmp_path / "blades.json"
    path.write_text(json.dumps(blades().to_dict()))
    few = ["--parameter", "left.N0", "--from", "60", "--to", "65", "--harmonics", str(H), "--json"]
    assert main(["peaks", str(path), *few, "--checks", "0"]) == 0
    tracked = json.loads(capsys.readouterr().out)
    assert tracked["peak"][0] == pytest.approx(peak({"left.N0": 60.0}), rel=1e-8)
    assert main(["map", str(path), *few, "--steps", "2", "--frequencies", "3"]) == 0
    mapped = json.loads(capsys.readouterr().out)
    assert np.isfinite(np.array(mapped["amplitude"])).all()


@pytest.mark.parametrize("right", [50.0, pytest.param(5000.0, marks=pytest.mark.long)])
def test_multipliers_against_the_marched_return_map(right: float):
    """Both contacts slip: the damper's place is a gauge, told apart; one sticks: its slider is instead."""
    scene = blades().with_values({"right.N0": right})
    found = stability(solve(scene, frequency_hz=317.428, harmonics=41))
    returns = Return(scene, 317.428, steps=128)
    marched = np.linalg.eigvals(returns.jacobian())
    marched = marched[np.argsort(-np.abs(marched))]
    held = int(returns.sliders.size)
    assert found.neutral == 1
    assert found.stable
    assert held == (0 if right == 50.0 else 1)
    if not held:
        assert marched[0] == pytest.approx(1.0, abs=1e-6)
        marched = marched[1:]
    moving = np.sort(np.abs(found.multipliers))[::-1][:4]
    others = np.abs(marched[np.abs(marched - 1.0) > 1e-6])[:4]
    np.testing.assert_allclose(moving, others, atol=5e-3)
    assert found.radius == pytest.approx(float(others[0]), abs=1e-4)


@pytest.mark.long
def test_two_loads_and_a_load_with_its_friction():
    for variables in (
        {"left.N0": LOADS, "right.N0": LOADS},
        {"left.N0": LOADS, "left.mu": (0.1, 0.5)},
    ):
        result = optim.design(blades(), variables=variables, harmonics=H)
        assert result.evaluation is not None
        best, enough = result.evaluation.objective, result.problem.harmonics
        assert peak(result.optimum, harmonics=enough) == pytest.approx(best, rel=1e-8)
        axes = [np.geomspace(low, high, 7) for low, high in variables.values()]
        fine = [value * np.linspace(0.99, 1.01, 5) for value in result.optimum.values()]
        for grid in (axes, fine):
            for values in itertools.product(*grid):
                pairs = zip(variables.items(), values, strict=True)
                there = {name: float(np.clip(value, *ends)) for (name, ends), value in pairs}
                assert peak(there, harmonics=enough) >= best * (1.0 - 1e-6), (variables.keys(), there)


@pytest.mark.long
def test_a_robust_load():
    uncertain = {"left.mu": [0.25, 0.35], "right.kt": [0.8e6, 1.2e6]}
    result = optim.robust_design(
        blades(), uncertain=uncertain, variables={"left.N0": LOADS}, samples=3, harmonics=H
    )
    assert result.status is RobustStatus.OPTIMAL
    boxes = itertools.product(np.linspace(0.25, 0.35, 7), np.linspace(0.8e6, 1.2e6, 7))
    enough = result.problem.harmonics
    worst = max(peak({**result.optimum, "left.mu": mu, "right.kt": kt}, harmonics=enough) for mu, kt in boxes)
    assert worst <= result.objective * (1.0 + 1e-6)
    assert result.robust is not None
    assert result.robust.worst_scenario is not None
    said = result.robust.worst_scenario.to_json()["parameters"]  # between the points of the grid
    there = {row["path"]: row["value"] for row in said}  # type: ignore[attr-defined]
    assert peak({**result.optimum, **there}, harmonics=enough) == pytest.approx(result.objective, rel=1e-8)
    assert worst >= result.objective * (1.0 - 1e-3)


@pytest.mark.long
def test_the_underplatform_damper_is_designed():
    """One load for both contacts: no load of a grid, coarse and round the optimum, is better by 1e-6."""
    scene = underplatform(60.0)
    result = optim.design(scene, variables={"L.N0,R.N0": (10.0, 400.0)}, harmonics=5)
    assert result.evaluation is not None
    best, at = result.evaluation.objective, result.optimum["L.N0,R.N0"]
    for load in (*np.geomspace(10.0, 400.0, 25), *(at * np.linspace(0.99, 1.01, 21))):
        both = {"L.N0": float(load), "R.N0": float(load)}
        assert peak(both, scene, 5) >= best * (1.0 - 1e-6)


@pytest.mark.long
def test_a_static_force_changes_no_design():
    """The damper slips both ways wherever it stands: half peak to peak has the same best load."""
    free = least_peak(blades(), "left.N0", 40.0, 120.0, harmonics=H)
    held = least_peak(pulled(blades(), "b1", 30.0), "left.N0", 40.0, 120.0, harmonics=H)
    assert held.peak == pytest.approx(free.peak + 30.0 / 4e5, rel=1e-5)
