"""Every row a design is judged by: gradient and second derivatives against differences of the whole solve."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache

import numpy as np
import pytest

import solver
from optim.criteria.constraint_rows import DesignEvaluation, nearest
from optim.criteria.criterion import CriterionRow
from optim.criteria.evaluation import evaluate
from optim.criteria.frequency_ranges import FORBIDDEN
from optim.criteria.friction_work import FRICTION_WORK
from optim.criteria.peak_criterion import BAND, PEAK
from optim.criteria.separation import SEPARATION
from optim.problem.design_problem import Problem, pose

DISK_OPTIMUM = 185.46090223680778


@dataclass(frozen=True)
class Point:
    """A design at which rows are differentiated, and the problem around it."""

    scene: str
    values: Mapping[str, float]
    changed: Mapping[str, float] = field(default_factory=dict)
    limit: float | None = None
    forbidden: tuple[float, float] | None = None
    work: bool = False
    never_separates: str | None = None
    # How far from something that is not smooth, in relative steps of every variable.
    room: float = 2e-4


POINTS = {
    "smooth": Point("two-dof", {"damper.N0": 120.0, "damper.kt": 28.0, "damper.mu": 0.31}, limit=1.5),
    "separating": Point(
        "two-dof", {"damper.N0": 100.0, "damper.mu": 0.31}, {"damper.N1": 200.0}, limit=1.5, work=True
    ),
    "shared": Point("bladed-disk", {"shroud.mu,root.mu": 0.31, "shroud.N0": 150.0}, limit=0.8e-4),
    "work": Point("bladed-disk", {"shroud.N0": 210.0, "shroud.kt": 5.4e6}, work=True),
    "forbidden": Point(
        "bladed-disk", {"shroud.N0": 210.0, "shroud.kt": 5.4e6}, limit=0.8e-4, forbidden=(760.0, 775.0)
    ),
    "separation": Point(
        "two-dof", {"damper.N0": 100.0, "damper.N1_ratio": 0.8}, never_separates="damper", limit=1.5
    ),
    "just below the exchange": Point(
        "bladed-disk", {"shroud.N0": DISK_OPTIMUM - 0.01, "shroud.kt": 5.53e6}, room=1e-5
    ),
    "just above the exchange": Point(
        "bladed-disk", {"shroud.N0": DISK_OPTIMUM + 0.01, "shroud.kt": 5.53e6}, room=1e-5
    ),
}
# Limits a little above and below the second peak of two-dof: its part of the band vanishes and appears.
SECOND_PEAK = "two-dof", {"damper.N0": 120.0, "damper.kt": 28.0}


def problem_of(point: Point) -> Problem:
    scene = solver.load_scene(point.scene).with_values(dict(point.changed))
    return pose(
        scene,
        variables={path: (0.5 * value, 2.0 * value) for path, value in point.values.items()},
        limit=point.limit,
        forbidden_hz=None if point.forbidden is None else [point.forbidden],
        max_friction_work=1e9 if point.work else None,
        contact_states=None if point.never_separates is None else {point.never_separates: "never-separates"},
    )


@cache
def evaluated(name: str) -> DesignEvaluation:
    return evaluate(problem_of(POINTS[name]), POINTS[name].values)


Moved = Callable[[CriterionRow, str, float], CriterionRow]


def stepping(point: Point) -> Moved:
    """The same row a step of a variable further; each place is evaluated once, for all rows."""
    problem = problem_of(point)

    @cache
    def there(path: str, step: float) -> DesignEvaluation:
        found = evaluate(problem, {**point.values, path: point.values[path] + step})
        assert found.good
        return found

    def moved(row: CriterionRow, path: str, step: float) -> CriterionRow:
        rows = there(path, step).rows
        place = nearest(row, rows)
        assert place is not None
        return rows[place]

    return moved


def difference(moved: Moved, row: CriterionRow, path: str, step: float) -> tuple[float, float]:
    """The derivative by Richardson-extrapolated central differences, and how sure it is."""

    def slope(h: float) -> float:
        ahead, behind = (moved(row, path, way * h).value for way in (1.0, -1.0))
        return (ahead - behind) / (2.0 * h)

    coarse, fine = slope(step), slope(0.5 * step)
    return (4.0 * fine - coarse) / 3.0, abs(fine - coarse)


@pytest.mark.few(3)
@pytest.mark.parametrize("name", POINTS)
def test_gradients_equal_differences_of_the_whole_solve(name: str) -> None:
    point, moved = POINTS[name], stepping(POINTS[name])
    rows = evaluated(name).rows
    wanted = {PEAK, BAND}
    wanted |= {FORBIDDEN} if point.forbidden else set()
    wanted |= {FRICTION_WORK} if point.work else set()
    wanted |= {SEPARATION} if point.never_separates else set()
    assert wanted == {row.quantity for row in rows}
    for row in rows:
        for i, path in enumerate(point.values):
            found, doubt = difference(moved, row, path, point.room * point.values[path])
            scale = max(abs(found), abs(row.value / point.values[path]))
            rounding = 1e-11 * abs(row.value) / (point.room * point.values[path])
            assert abs(row.gradient[i] - found) <= 1e-6 * scale + 0.05 * doubt + rounding, (row.what, path)


def test_beside_an_exchange_both_peaks_are_rows_and_change_places() -> None:
    below, above = evaluated("just below the exchange"), evaluated("just above the exchange")
    assert [round(row.at_hz) for row in below.peaks[:2]] == [766, 753]
    assert [round(row.at_hz) for row in above.peaks[:2]] == [753, 766]
    assert below.peaks[0].gradient[0] < 0.0 < above.peaks[0].gradient[0]


@pytest.mark.parametrize("share", [1.0 - 1e-4, 1.0 + 1e-4])
def test_gradient_of_the_band_beside_edges_that_appear_or_vanish(share: float) -> None:
    name, values = SECOND_PEAK
    plain = evaluate(problem_of(Point(name, values)), values)
    second = plain.responses[0].branch.peaks[1].value
    point = Point(name, values, limit=share * second, room=5e-6)
    problem, moved = problem_of(point), stepping(point)
    band = evaluate(problem, values).band
    assert band is not None
    # Below the height of the second peak its interval is there, just above it is not.
    intervals = evaluate(problem, values).responses[0].branch.band.intervals  # type: ignore[union-attr]
    assert len(intervals) == (2 if share < 1.0 else 1)
    for i, path in enumerate(values):
        found, doubt = difference(moved, band, path, point.room * values[path])
        scale = max(abs(found), abs(band.value / values[path]))
        rounding = 1e-10 * abs(band.value) / (point.room * values[path])
        assert abs(band.gradient[i] - found) <= 1e-6 * scale + 0.05 * doubt + rounding, path


@pytest.mark.parametrize("name", ["smooth", "shared", "forbidden", "just below the exchange"])
def test_second_derivatives_equal_differences_of_gradients(name: str) -> None:
    point, moved = POINTS[name], stepping(POINTS[name])
    for row in evaluated(name).rows:
        assert row.second is not None
        second = row.second()
        if not np.all(np.isfinite(second)):
            continue  # a corner of the response has no second derivatives, and says so
        for i, path in enumerate(point.values):
            step = point.room * point.values[path]
            ahead = moved(row, path, step).gradient
            behind = moved(row, path, -step).gradient
            found = (ahead - behind) / (2.0 * step)
            sizes = np.array([abs(row.value / point.values[p]) for p in point.values]) / point.values[path]
            scale = np.maximum(np.abs(second[i]), sizes)
            np.testing.assert_array_less(np.abs(second[i] - found), 2e-5 * scale)
