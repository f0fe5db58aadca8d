"""Stresses and their margins as what designs are judged by, against dense responses and differences."""

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from cases.stress_scenes import STEEL, TERMS, stressed

import optim
import solver
from optim.criteria.evaluation import evaluate
from optim.criteria.stress import STRESS, UTILISATION
from optim.problem.checks import DesignError
from optim.problem.design_problem import pose
from optim.results.design_result import DesignStatus
from solver.balance.kernels.haigh import utilisation
from solver.scene.materials import counted, utilisation_of
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
    assert utilisation.bound_told is None, "that there is an end to it is no limit asked for"
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


def beyond(mean: float, *, line: str = "goodman", force: float = 1.0) -> Scene:
    """One mass on a spring of 1 N/m: a constant force that is its mean stress [GPa] beside the vibration."""
    return Scene.from_dict({
        "name": "pulled", "structure": {"kind": "lumped", "masses": {"a": 1.0}, "springs": [
            {"between": ["a", "ground"], "k": 1.0, "c": 0.06},
        ]},
        "contacts": [{"name": "d", "between": ["a", "ground"], "kt": 0.6, "mu": 0.5, "N0": 0.8}],
        "excitation": [
            {"dof": "a", "amplitude": 1e-4 * force}, {"dof": "a", "amplitude": mean, "harmonic": 0},
        ],
        "observe": {"dof": "a", "band": [0.12, 0.3]},
        "recovery": [
            {"name": "root", "unit": "MPa", "terms": {"a": 1000.0}, "static": 0.0, "material": "steel"},
        ],
        "materials": [{**STEEL, "line": line}],
    })  # fmt: skip


ENDS = {"goodman": 0.9, "gerber": 0.9, "soderberg": 0.7}


@pytest.mark.few(9)
@pytest.mark.parametrize("line", ENDS)
@pytest.mark.parametrize("share", [1.01, 1.5, 5.0])
def test_a_mean_beyond_the_strength_leaves_no_margin(line: str, share: float) -> None:
    # The spring alone carries the force once the contact slides: its mean is that of the force or below.
    scene = beyond(share * ENDS[line], line=line)
    bounds = {"d.N0": (0.001, 0.002)}
    found = optim.design(scene, variables=bounds, min_margin=1e-6, harmonics=3)
    assert found.status is DesignStatus.INFEASIBLE
    assert all(math.isinf(row.told) for row in found.evaluation.of(UTILISATION))  # type: ignore[union-attr]
    told = found.to_json()
    assert {row["value"] for row in told["rows"] if row["quantity"] == "utilisation"} == {None}
    assert any("the mean stress alone reaches the strength" in words for words in found.warnings)
    assert "infinite" in str(found)
    goal = optim.design(scene, variables=bounds, weights={"utilisation": 1.0}, harmonics=3)
    assert goal.status is DesignStatus.INFEASIBLE
    assert goal.to_json()["objective"] is None
    light = {"light": {"d.N0": 1e-3}}
    diagram = solver.margin_diagram(scene, start=1e-3, stop=1e-2, points=2, dampers=light, harmonics=3)
    assert np.isinf(diagram.used).all()
    assert [one.end for one in diagram.allowed] == ["below"]
    assert "infinite" in str(diagram)
    assert "the mean stress alone reaches the strength" in str(diagram)


def test_what_a_search_counts_is_the_utilisation_and_continues_it() -> None:
    haigh = np.array([0.0, 300.0, 900.0, 0.0])
    rng = np.random.default_rng(3)
    for line in (0.0, 1.0):
        haigh[0] = line
        seen = []
        for amplitude, mean in zip(
            10.0 ** rng.uniform(-9, 4, 400), rng.uniform(-500, 1500, 400), strict=True
        ):
            counts = utilisation(haigh, mean + amplitude, mean - amplitude)
            left = Fraction(1) - (Fraction(max(mean, 0.0)) / 900) ** (1 + int(line))
            exact = math.inf if left <= 0 else float(Fraction(amplitude) / 300 / left)
            assert utilisation_of(counts[0]) == pytest.approx(exact, rel=1e-9)
            step = 1e-6 * max(amplitude, 1.0)  # rounding of a mean of 1500 is 2e-13
            up, down = (utilisation(haigh, mean + amplitude + s, mean - amplitude - s) for s in (step, -step))
            assert counts[1] == pytest.approx((up[0] - down[0]) / (2.0 * step), rel=1e-4, abs=1e-6)
            assert counts[3] == pytest.approx(
                (up[1] - down[1]) / (2.0 * step), rel=1e-3, abs=1e-6 * counts[1]
            )
            step = 1e-5
            up, down = (utilisation(haigh, mean + s + amplitude, mean + s - amplitude) for s in (step, -step))
            if (up[0] - counts[0]) * (counts[0] - down[0]) > 0.0 and up[1] != counts[1]:
                assert counts[2] == pytest.approx((up[0] - down[0]) / (2.0 * step), rel=1e-2)
            seen.append((exact, counts[0]))
        ordered = sorted(seen)
        assert [x for _, x in ordered if math.isfinite(_)] == sorted(
            x for _, x in ordered if math.isfinite(_)
        )
        assert min(x for e, x in seen if math.isinf(e)) > max(x for e, x in seen if math.isfinite(e))
        assert all(counted(utilisation_of(x)) == pytest.approx(x, rel=1e-9) for e, x in seen if e < 1e12)
