"""Designs whose mean stress depends on the history: judged by the worst mean that stuck contacts may hold."""

import math

import numpy as np
import pytest
from stress_scenes import STEEL

import optim
import solver
from optim.criteria.evaluation import evaluate
from optim.criteria.stress import UTILISATION
from optim.problem.design_problem import pose
from optim.results.design_result import DesignStatus
from solver.scene.scene import Scene


def pulled(mean: float, force: float, fatigue: float = 400e6, **contact: object) -> Scene:
    """A mass on a spring of 1 N/m that a constant force pulls, with a stress of 1000 MPa/m."""
    return Scene.from_dict({
        "name": "pulled", "structure": {"kind": "lumped", "masses": {"a": 1.0, "b": 1.0}, "springs": [
            {"between": ["a", "ground"], "k": 1.0, "c": 0.06},
            {"between": ["b", "ground"], "k": 40.0, "c": 0.1},
        ]},
        "contacts": [{"name": "d", "between": ["a", "ground"], "kt": 0.6, "mu": 0.5, "N0": 0.8, **contact}],
        "excitation": [
            {"dof": "a", "amplitude": force}, {"dof": "a", "amplitude": mean, "harmonic": 0},
        ],
        "observe": {"dof": "a", "band": [0.12, 0.3]},
        "recovery": [
            {"name": "root", "unit": "MPa", "terms": {"a": 1000.0}, "static": 0.0, "material": "steel"},
        ],
        "materials": [{**STEEL, "fatigue_strength": fatigue}],
    })  # fmt: skip


def test_friction_is_not_counted_on_to_hold_a_mean_beyond_the_strength() -> None:
    # Whatever the contact holds from rest: 625 MPa are seen where it sticks, 1000 MPa where it has slipped.
    problem = pose(pulled(1.0, 1e-4), variables={"d.N0": (0.1, 3.0)}, min_margin=1.5, harmonics=3)
    for load in (0.21, 3.0):
        row = evaluate(problem, {"d.N0": load}).of(UTILISATION)[0]
        assert math.isinf(row.told)
        assert row.excess(1.0) > 0.0
    found = solver.margin_diagram(problem.scene, start=1e-5, stop=1e-4, points=2, harmonics=3)
    # The level is that of all forces: of 0.1 N friction may hold nothing, 1 N is beyond the strength.
    share = 1e-6 * found.stress[0][0] / 400.0
    assert found.used[0][0] == pytest.approx(share / (1.0 - 0.1 / 0.9), rel=1e-3)
    assert math.isinf(found.used[0][1])
    assert "worst_mean" in found.known.flags


@pytest.mark.long
def test_no_design_keeps_a_margin_where_the_mean_is_beyond_the_strength() -> None:
    scene, bounds = pulled(1.0, 1e-4), {"d.N0": (0.1, 3.0)}
    found = optim.design(scene, variables=bounds, weights={"peak": 1.0}, min_margin=1.5, harmonics=3)
    assert found.status is DesignStatus.INFEASIBLE
    assert any("the mean stress alone reaches the strength" in words for words in found.warnings)


@pytest.mark.long
def test_a_design_keeps_the_margin_of_the_worst_mean() -> None:
    # At 0.3 Hz the contact sticks and may push with what vibration leaves of its limit, for a load N
    # m = 0.82 + N/2 − 0.6 a [GPa], which U = a/30/(1 − m/0.9) = 1 bounds; the least peak is at a larger load.
    scene = pulled(0.82, 0.1, fatigue=30e9)
    omega = 2.0 * math.pi * 0.3
    a = 0.1 / abs(1.6 - omega**2 + 0.06j * omega)
    load = 2.0 * (0.9 * (1.0 - a / 30.0) - 0.82 + 0.6 * a)
    bounds = {"d.N0": (0.2, 0.25)}
    free = optim.design(scene, variables=bounds, harmonics=3)
    assert free.optimum["d.N0"] > 1.05 * load
    found = optim.design(scene, variables=bounds, min_margin=1.0, harmonics=3)
    assert found.status is DesignStatus.OPTIMAL
    assert found.optimum["d.N0"] == pytest.approx(load, rel=1e-4)
    assert any("by the worst mean that stuck contacts may hold" in words for words in found.active)
    assert any("worst mean" in words for words in found.warnings)


def test_the_row_of_the_worst_mean_has_slopes() -> None:
    scene = pulled(0.5, 0.1)
    variables = {"d.N0": (0.5, 2.0), "d.kt": (0.3, 1.0), "d.mu": (0.2, 0.9)}
    problem, here = pose(scene, variables=variables, min_margin=0.01, harmonics=3), {
        "d.N0": 1.1, "d.kt": 0.6, "d.mu": 0.5,
    }  # fmt: skip
    row = evaluate(problem, here).of(UTILISATION)[0]
    assert "worst mean" in row.what
    for i, (path, value) in enumerate(here.items()):
        step = 1e-4 * value
        below, above = (evaluate(problem, here | {path: value + s}).of(UTILISATION)[0] for s in (-step, step))
        assert row.gradient[i] == pytest.approx((above.value - below.value) / (2.0 * step), rel=1e-3)


def test_a_mean_that_is_not_known_is_no_optimum() -> None:
    rubs = {"law": "elastic-normal", "normal_between": ["b", "ground"], "kn": 0.1}
    scene = pulled(0.3, 0.1, **rubs)
    found = optim.design(scene, variables={"d.N0": (0.5, 1.0)}, min_margin=0.01, harmonics=3)
    assert found.status is DesignStatus.NOT_KNOWN
    assert any("is not known: margins are those of an unloaded start" in words for words in found.warnings)
    told = solver.margin_diagram(scene, start=0.01, stop=0.02, points=2, harmonics=3)
    assert "mean_stress_open" in told.known.flags
    assert np.isfinite(told.used).all()
