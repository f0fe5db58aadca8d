"""Peak amplitude and resonance band: their gradients against differences through the whole solve."""

import numpy as np
import pytest

import solver
from optim.criteria.constraint_rows import DesignEvaluation
from optim.criteria.evaluation import evaluate
from optim.problem.design_problem import pose

# scene, changed values, design point; the bladed disk in three regimes and with separation.
CASES = {
    "two-dof N0": ("two-dof", {}, {"damper.N0": 105.0}),
    "two-dof N0, N1 apart": ("two-dof", {"damper.N1": 40.0}, {"damper.N0": 120.0}),
    "two-dof separation": ("two-dof", {"damper.N1": 200.0}, {"damper.N0": 100.0}),
    "two-dof contact": (
        "two-dof",
        {},
        {"damper.kt": 28.0, "damper.mu": 0.31, "damper.N1_ratio": 0.25, "damper.N1_phase": 0.4},
    ),
    "two-dof structure": ("two-dof", {}, {"structure.k1": 160.0, "structure.k2": 40.0}),
    "two-dof force": ("two-dof", {}, {"excitation.amplitude": 90.0, "damper.N0": 100.0}),
    "bladed-disk N0": ("bladed-disk", {}, {"shroud.N0": 185.0}),
    "bladed-disk low": ("bladed-disk", {}, {"shroud.N0": 95.0, "shroud.kt": 5.4e6}),
    "bladed-disk separation": ("bladed-disk", {"shroud.N1": 400.0}, {"shroud.N0": 200.0}),
}
CRITERIA = ("peak", "band", "half power band")


def _evaluate(case: str, values: dict[str, float], limit: float | None) -> DesignEvaluation:
    name, changed, _ = CASES[case]
    scene = solver.load_scene(name).with_values(changed)
    bounds = {
        path: (value - 1.0, value + 1.0) if value < 1.0 else (0.5 * value, 2.0 * value)
        for path, value in values.items()
    }
    bounds = {path: (max(low, 0.0), high) for path, (low, high) in bounds.items()}
    return evaluate(pose(scene, variables=bounds, limit=limit), values)


def _difference(case: str, path: str, limit: float | None, criterion: str) -> tuple[float, float]:
    """Return the derivative by Richardson-extrapolated central differences, and how sure it is."""
    _, _, values = CASES[case]
    step = 2e-4 * abs(values[path]) if values[path] else 1e-4

    def at(move: float) -> float:
        criteria = _evaluate(case, values | {path: values[path] + move}, limit)
        assert criteria.good
        assert criteria.band is not None
        return criteria.peaks[0].value if criterion == "peak" else criteria.band.value

    coarse = (at(step) - at(-step)) / (2.0 * step)
    fine = (at(0.5 * step) - at(-0.5 * step)) / step
    return (4.0 * fine - coarse) / 3.0, abs(fine - coarse)


# Every case by one criterion or two, and every criterion in cases of each scene.
@pytest.mark.few(4)
@pytest.mark.parametrize("criterion", CRITERIA)
@pytest.mark.parametrize("case", CASES)
def test_gradient_equals_differences_of_the_whole_solve(case: str, criterion: str) -> None:
    values = CASES[case][2]
    plain = _evaluate(case, values, None)
    limit = 0.8 * plain.peaks[0].value if criterion == "band" else None
    criteria = _evaluate(case, values, limit)
    assert criteria.band is not None
    gradient = criteria.peaks[0].gradient if criterion == "peak" else criteria.band.gradient
    value = criteria.peaks[0].value if criterion == "peak" else criteria.band.value
    for i, path in enumerate(values):
        difference, doubt = _difference(case, path, limit, criterion)
        scale = max(abs(difference), abs(value / values[path]))
        assert abs(gradient[i] - difference) <= 1e-6 * scale + doubt * 0.05, (path, gradient[i], difference)


def test_every_competing_peak_has_its_own_gradient() -> None:
    criteria = _evaluate("bladed-disk N0", {"shroud.N0": 185.46}, None)
    first, second = criteria.peaks[:2]
    assert first.value == pytest.approx(second.value, rel=1e-4)
    assert abs(first.at_hz - second.at_hz) > 5.0
    assert first.gradient[0] * second.gradient[0] < 0.0


def test_the_band_is_the_measure_above_the_limit() -> None:
    limit = 1.5
    criteria = _evaluate("two-dof N0", {"damper.N0": 105.0}, limit)
    scene = solver.load_scene("two-dof").with_values({"damper.N0": 105.0})
    band = criteria.band
    assert band is not None
    inside = outside = 0
    for low, high in criteria.branch.band.intervals:  # type: ignore[union-attr]
        for share in (0.01, 0.5, 0.99):
            amplitude = solver.solve(scene, frequency_hz=low + share * (high - low)).max_abs
            inside += amplitude > limit
        for edge in (low, high):
            assert solver.solve(scene, frequency_hz=edge).max_abs == pytest.approx(limit, rel=1e-7)
        outside += solver.solve(scene, frequency_hz=low - 1e-3).max_abs < limit
        outside += solver.solve(scene, frequency_hz=high + 1e-3).max_abs < limit
    count = len(criteria.branch.band.intervals)  # type: ignore[union-attr]
    assert (inside, outside) == (3 * count, 2 * count)


def test_a_limit_above_every_peak_gives_an_empty_band() -> None:
    criteria = _evaluate("two-dof N0", {"damper.N0": 105.0}, 100.0)
    assert criteria.band is not None
    assert criteria.band.value == 0.0
    np.testing.assert_array_equal(criteria.band.gradient, 0.0)


def test_a_response_that_was_stopped_is_not_a_value() -> None:
    scene = solver.load_scene("two-dof")
    problem = pose(scene, variables={"damper.N0": (20.0, 500.0)})
    criteria = evaluate(problem, {"damper.N0": 100.0}, should_stop=lambda: True)
    assert not criteria.good
    assert criteria.peaks == ()
