"""Stresses and their margins as what designs are judged by, against dense responses and differences."""

from typing import Any

import numpy as np
import pytest
from cases.stress_scenes import TERMS, stressed

import optim
import solver
from optim.criteria.evaluation import evaluate
from optim.criteria.stress import STRESS
from optim.criteria.utilisation import UTILISATION
from optim.errors import DesignError
from optim.problem.problem import pose
from solver.scene.scene import Scene

HARMONICS = 7
VARIABLES = {"slides.N0": (0.5, 6.0), "slides.kt": (10.0, 60.0), "structure.neck": (10.0, 40.0)}
DESIGN = {"slides.N0": 1.5, "slides.kt": 30.0, "structure.neck": 20.0}
BOTH = {"stress": 1e-6, "utilisation": 1.0}


def of_time(scene: Scene, hertz: float) -> tuple[float, float]:
    """Amplitude and middle of the range of the fillet's stress [MPa] from its motion in time."""
    found = solver.solve(scene, frequency_hz=hertz, harmonics=HARMONICS)
    a, b = (solver.time_history(found, dof, samples=4096)[1] for dof in "ab")
    stress = TERMS["a"] * a + TERMS["b"] * b
    return 0.5 * (stress.max() - stress.min()), 0.5 * (stress.max() + stress.min())


def used(line: str, amplitude: float, mean: float) -> float:
    """Of the formulas of the lines as books have them."""
    if line == "gerber":
        return amplitude / (300.0 * (1.0 - (mean / 900.0) ** 2)) if mean > 0.0 else amplitude / 300.0
    return amplitude / (300.0 * (1.0 - max(mean, 0.0) / {"goodman": 900.0, "soderberg": 700.0}[line]))


@pytest.mark.few(2)
@pytest.mark.parametrize(
    ("line", "static"), [("goodman", 60.0), ("gerber", 400.0), ("soderberg", 300.0), ("goodman", -400.0)]
)
def test_values_are_the_highest_of_dense_responses(line: str, static: float) -> None:
    scene = stressed(line=line, static=static)
    found = evaluate(pose(scene, variables=VARIABLES, weights=BOTH, harmonics=HARMONICS), DESIGN)
    stress = next(row for row in found.of(STRESS) if "fillet" in row.what)
    utilisation = next(row for row in found.of(UTILISATION) if "fillet" in row.what)
    grid = np.unique([*np.linspace(0.5, 2.2, 60), *(stress.at_hz + np.linspace(-2e-3, 2e-3, 41))])
    seen = np.array([of_time(scene, hertz) for hertz in grid])
    assert stress.value == pytest.approx(1e6 * seen[:, 0].max(), rel=2e-6)
    dense = max(used(line, amplitude, mean + static) for amplitude, mean in seen)
    assert utilisation.value == pytest.approx(dense, rel=2e-6)
    there = of_time(scene, utilisation.at_hz)
    assert utilisation.value == pytest.approx(used(line, there[0], there[1] + static), rel=2e-6)


def test_the_march_has_the_stress() -> None:
    scene = stressed()
    problem = pose(scene, variables=VARIABLES, weights={"stress": 1.0}, harmonics=41)
    row = next(row for row in evaluate(problem, DESIGN).of(STRESS) if "fillet" in row.what)
    metres = Scene.from_dict(scene.to_dict() | {"observe": {"dof": "metres", "band": [0.5, 2.2]}})
    marched = solver.march(metres, frequency_hz=row.at_hz)
    assert row.value == pytest.approx(1e9 * marched.half_peak_to_peak, rel=1e-4)


@pytest.mark.few(3)
@pytest.mark.parametrize("quantity", [STRESS, UTILISATION], ids=str)
@pytest.mark.parametrize(
    ("line", "second", "static"),
    [("goodman", 0.3, 60.0), ("gerber", 0.5, 200.0), ("soderberg", 0.0, 100.0), ("goodman", 0.3, -300.0)],
)
def test_gradient_and_hessian_are_differences(
    quantity: Any, line: str, second: float, static: float
) -> None:  # fmt: skip
    scene = stressed(line=line, second=second, static=static)
    problem = pose(scene, variables=VARIABLES, weights=BOTH, harmonics=HARMONICS)
    row = evaluate(problem, DESIGN).of(quantity)[0]
    assert row.second is not None
    hessian = row.second()
    for i, (path, value) in enumerate(DESIGN.items()):
        step = 1e-4 * value
        below, above = (evaluate(problem, DESIGN | {path: value + s}).of(quantity)[0] for s in (-step, step))
        assert row.gradient[i] == pytest.approx((above.value - below.value) / (2.0 * step), rel=1e-5)
        assert hessian[i] == pytest.approx((above.gradient - below.gradient) / (2.0 * step), rel=2e-5)


def test_a_design_has_the_least_stress_within_a_margin() -> None:
    scene, bounds = stressed(), {"slides.N0": (0.5, 6.0)}
    problem = pose(scene, variables=bounds, weights=BOTH, harmonics=5)
    grid = {
        load: evaluate(problem, {"slides.N0": load}, gradients=False) for load in np.geomspace(0.5, 6.0, 13)
    }
    found = optim.design(scene, variables=bounds, weights={"stress": 1e-6}, harmonics=5)
    assert found.reached, found.status
    least = min(one.of(STRESS)[0].value for one in grid.values())
    best = evaluate(problem, found.optimum).of(STRESS)[0].value
    assert 0.9 * least <= best <= least
    # A margin that the least peak does not have.
    free = optim.design(scene, variables=bounds, harmonics=5)
    peak_has = evaluate(problem, free.optimum).of(UTILISATION)[0].value
    top = min(one.of(UTILISATION)[0].value for one in grid.values())
    assert top < peak_has
    wanted = 2.0 / (peak_has + top)
    limited = optim.design(scene, variables=bounds, min_margin=wanted, harmonics=5)
    assert limited.reached, limited.status
    assert limited.peak is not None
    assert free.peak is not None
    assert limited.peak.value > free.peak.value
    after = evaluate(problem, limited.optimum)
    assert after.of(UTILISATION)[0].value == pytest.approx(1.0 / wanted, rel=1e-5)
    kept = [one for one in grid.values() if one.of(UTILISATION)[0].value <= 1.0 / wanted]
    assert limited.peak.value <= min(one.peaks[0].value for one in kept)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"max_stress": {"rim": 1e6}}, r"max_stress.*must name rows of `recovery`: fillet, root"),
        ({"max_stress": -1.0}, r"max_stress.*> 0"),
        ({"min_margin": {"fillet": 0.0}}, r"min_margin.*> 0"),
        ({"weights": {"strain": 1.0}}, r"`stress`, `utilisation`.* can be minimised"),
    ],
)
def test_what_is_wrong_is_told(keys: dict[str, Any], message: str) -> None:
    with pytest.raises(DesignError, match=message):
        pose(stressed(), variables=VARIABLES, **keys)


def test_a_scene_without_a_stress_has_none_to_judge() -> None:
    scene = solver.load_scene("two-dof")
    for keys in ({"weights": {"stress": 1.0}}, {"max_stress": 1e6}):
        with pytest.raises(DesignError, match="needs a stress in `recovery`, in Pa"):
            pose(scene, **keys)
    for keys in ({"weights": {"utilisation": 1.0}}, {"min_margin": 1.5}):
        with pytest.raises(DesignError, match="needs a stress in `recovery` with a `material`"):
            pose(scene, **keys)
