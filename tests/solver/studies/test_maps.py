"""Maps: every point a solution at exactly its place, the ridge, pictures, every way to end."""

from __future__ import annotations

import math

import numpy as np
import pytest

import solver
from solver.balance.workspace import PointSolution, Workspace
from solver.errors import SettingError
from solver.studies import response_map as maps
from solver.studies.response_map import response_map
from solver.studies.study_results import MapStatus


@pytest.fixture(scope="module")
def disk() -> solver.ResponseMap:
    return response_map(solver.load_scene("bladed-disk"), "shroud.N0", 20.0, 3000.0, steps=9, frequencies=60)


def test_every_point_is_the_solution_at_its_place(disk: solver.ResponseMap) -> None:
    assert disk.status is MapStatus.COMPLETED
    assert disk.amplitude.shape == (9, 60)
    assert disk.largest_residual < 1e-9
    scene, rng = solver.load_scene("bladed-disk"), np.random.default_rng(0)
    for _ in range(25):
        row, column = int(rng.integers(9)), int(rng.integers(60))
        there = scene.with_values({"shroud.N0": float(disk.parameter[row])})
        solution = solver.solve(there, frequency_hz=float(disk.frequency[column]))
        assert disk.amplitude[row, column] == pytest.approx(solution.max_abs, rel=1e-7)
        assert disk.half_peak_to_peak[row, column] == pytest.approx(solution.half_peak_to_peak, rel=1e-7)


def test_a_row_lies_on_its_sweep(disk: solver.ResponseMap) -> None:
    row = 4
    scene = solver.load_scene("bladed-disk").with_values({"shroud.N0": float(disk.parameter[row])})
    branch = solver.sweep(scene)
    dense = np.interp(disk.frequency, branch.values, branch.amplitude)
    assert np.abs(disk.amplitude[row] / dense - 1.0).max() < 0.05
    assert branch.peak is not None
    assert disk.amplitude[row].max() <= branch.peak.value * (1.0 + 1e-9)


def test_the_grid_spans_band_and_range(disk: solver.ResponseMap) -> None:
    assert disk.parameter[[0, -1]].tolist() == [20.0, 3000.0]
    assert disk.frequency[[0, -1]].tolist() == [500.0, 900.0]
    assert np.diff(np.log(disk.parameter)) == pytest.approx(math.log(150.0) / 8.0)
    narrow = response_map(
        solver.load_scene("two-dof"), "damper.mu", 0.4, 0.2, steps=3, frequencies=5, ridge=False
    )
    assert narrow.parameter == pytest.approx([0.4, 0.3, 0.2])
    assert narrow.ridge is None


def test_the_picture_spans_the_grid_beyond_the_ridge(disk: solver.ResponseMap) -> None:
    axes = disk.plot().axes[0]
    assert axes.get_xlim() == (500.0, 900.0)
    assert axes.get_ylim() == (20.0, 3000.0)


def test_the_ridge_is_above_every_row(disk: solver.ResponseMap) -> None:
    ridge = disk.ridge
    assert ridge is not None
    assert ridge.reached
    for row, value in enumerate(disk.parameter):
        right = int(np.clip(np.searchsorted(ridge.parameter, value), 1, ridge.parameter.size - 1))
        top = ridge.peak[[right - 1, right]].max()
        length = ridge.parameter[right] - ridge.parameter[right - 1]
        top += 0.25 * length * np.abs(np.diff(ridge.slope[[right - 1, right]]))[0]
        assert disk.amplitude[row].max() <= top * (1.0 + 1e-9)


def test_points_without_a_solution_stay_empty(monkeypatch: pytest.MonkeyPatch) -> None:
    """A row of which no point can be begun: its values are NaN, null in JSON, and the status says so."""

    def nothing(self: Workspace, _p: float, _guess: np.ndarray | None = None) -> PointSolution:
        return PointSolution(converged=False, u=np.zeros(self.balance.n_unknowns), iterations=3, residual=1.0)

    monkeypatch.setattr(Workspace, "solve", nothing)
    found = response_map(
        solver.load_scene("two-dof"), "damper.N0", 50.0, 60.0, steps=2, frequencies=4, ridge=False
    )
    assert found.status is MapStatus.HOLES
    assert not found.reached
    assert np.isnan(found.amplitude).all()
    assert found.to_json()["amplitude"] == [[None] * 4] * 2


def test_stopped_by_the_caller() -> None:
    asked = iter([False, True])
    seen: list[tuple[float, int]] = []
    found = response_map(
        solver.load_scene("two-dof"), "damper.N0", 50.0, 60.0, steps=3, frequencies=7,
        should_stop=lambda: next(asked, True), on_progress=lambda share, count: seen.append((share, count)),
    )  # fmt: skip
    assert found.status is MapStatus.STOPPED
    assert seen == [(pytest.approx(0.7 / 3.0), 7)]
    assert np.isfinite(found.amplitude[0]).all()
    assert np.isnan(found.amplitude[1:]).all()


def test_the_ridge_counts_and_can_be_stopped_too() -> None:
    two_dof, seen = solver.load_scene("two-dof"), []
    keys = {"steps": 3, "frequencies": 7, "harmonics": 3}
    whole = response_map(
        two_dof, "damper.N0", 50.0, 60.0, **keys, on_progress=lambda share, count: seen.append((share, count))
    )
    assert whole.reached
    assert seen == sorted(seen)
    assert seen[2] == (pytest.approx(0.7), 21)
    assert len(seen) > 4
    assert seen[-1] == (pytest.approx(1.0), 21)
    asked = iter([False] * 4)
    found = response_map(
        two_dof, "damper.N0", 50.0, 60.0, **keys, should_stop=lambda: next(asked, True),
    )  # fmt: skip
    assert found.status is MapStatus.STOPPED
    assert np.isfinite(found.amplitude).all()


def test_json_carries_the_grid_and_the_ridge(disk: solver.ResponseMap) -> None:
    found = disk.to_json()
    assert {"parameter", "frequency", "amplitude", "ridge", "seconds", "status"} <= set(found)
    assert np.array(found["amplitude"]).shape == (9, 60)


@pytest.mark.parametrize(
    ("more", "word"),
    [({"steps": 1}, "steps"), ({"frequencies": 1}, "frequencies"), ({"steps": maps.MOST_POINTS}, "at most"),
     ({"harmonics": -1}, "harmonics")],
)  # fmt: skip
def test_bad_input_is_refused(more: dict[str, int], word: str) -> None:
    with pytest.raises(SettingError, match=word):
        response_map(solver.load_scene("two-dof"), "damper.N0", 50.0, 60.0, **more)


def test_the_frequency_is_refused() -> None:
    with pytest.raises(SettingError, match="frequency"):
        response_map(solver.load_scene("two-dof"), "frequency", 1.0, 2.0)
