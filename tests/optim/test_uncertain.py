"""What is not known: the sets read from a description, their samples, bad input."""

import math

import numpy as np
import pytest
from each import each

import optim
import solver
from optim.problem.design_problem import pose
from optim.problem.uncertainty_input import read_uncertain
from optim.problem.uncertainty_set import UncertainSet, UncertaintyShape

N0 = {"damper.N0": (60.0, 300.0)}
TWO = solver.load_scene("two-dof")
DISK = solver.load_scene("bladed-disk")


@each(
    ("uncertain", "words"),
    [
        ({}, ["uncertain"]),
        (3.0, ["uncertain", "3.0"]),
        ({"damper.N0": [90.0, 110.0]}, ["damper.N0", "variable", "deviation"]),
        ({"dumper.mu": [0.2, 0.4]}, ["dumper.mu", "damper.mu"]),
        ({"frequency": [1.0, 2.0]}, ["frequency"]),
        ({"damper.mu": [0.4, 0.2]}, ["uncertain.damper.mu", "low < high"]),
        ({"damper.mu": [-0.1, 0.2]}, ["uncertain.damper.mu", ">= 0", "-0.1"]),
        ({"damper.mu": {"deviation": -0.1}}, ["uncertain.damper.mu.deviation", "-0.1"]),
        ({"damper.mu": {"spread": 0.1}}, ["uncertain.damper.mu", "spread"]),
        ({"damper.mu": {"deviation": 1.5}}, ["uncertain.damper.mu", ">= 0"]),
        ({"damper.N1": {"deviation": 0.1}}, ["damper.N1", "tied", "N1_ratio"]),
        ({"damper.mu": [0.2, 0.4], "damper.mu,damper.kt": {"deviation": 0.1}}, ["damper.mu", "twice"]),
        ({"half_axes": {"damper.mu": 0.0}}, ["half_axes", "> 0"]),
        ({"half_axes": {"damper.mu": 0.1}, "shape": [[1.0]]}, ["half_axes", "covariance"]),
        ({"covariance": [[1e-4]]}, ["uncertain.paths"]),
        ({"paths": ["damper.mu"], "covariance": [[-1.0]]}, ["uncertain.covariance", "positive definite"]),
        ({"paths": ["damper.mu"], "shape": [[1e-4, 0.0]]}, ["uncertain.shape", "symmetric"]),
        (
            {"paths": ["damper.mu"], "covariance": [[1e-4]], "confidence": 2.0},
            ["uncertain.confidence", "2.0"],
        ),
        ({"mistuning": {"of": "m1", "spread": 0.1}}, ["two-dof", "cyclic"]),
        ({"mistuning": {"of": "m1", "within": 0.1}}, ["two-dof", "cyclic"]),
        ([{"damper.mu": 0.3}, 3.0], ["uncertain[1]", "3.0"]),
        ([{"damper.mu": math.nan}], ["uncertain[0].damper.mu", "nan"]),
        ([{"damper.N0": 100.0}], ["damper.N0", "deviation"]),
    ],
)
def test_bad_uncertainty_is_named(uncertain: object, words: list[str]) -> None:
    with pytest.raises((optim.DesignError, solver.SettingError)) as caught:
        optim.robust_design(TWO, uncertain=uncertain, variables=N0)
    for word in words:
        assert word in str(caught.value)


def test_a_covariance_reaches_as_far_as_its_confidence_says() -> None:
    over = read_uncertain(
        TWO, (), {"centre": {"damper.mu": 0.3, "damper.kt": 30.0}, "covariance": [[1e-4, 0.0], [0.0, 1.0]]}
    )
    assert over.shape is UncertaintyShape.NORMAL
    assert over.reach() == pytest.approx(np.array([0.01, 1.0]) * math.sqrt(5.991464547))
    drawn = np.array([[delta for _, delta in scenario.settings] for scenario in over.draw(2000, 1)])
    assert drawn.mean(axis=0) == pytest.approx([0.3, 30.0], rel=1e-3)
    assert np.cov(drawn.T)[[0, 1], [0, 1]] == pytest.approx([1e-4, 1.0], rel=0.05)
    assert over.draw(5, 1) == over.draw(5, 1)


def test_the_set_without_numbers_has_one_scenario_for_each_disk() -> None:
    over = UncertainSet(shape=UncertaintyShape.BOX)
    assert over.finite
    assert over.all() == ()


@pytest.mark.parametrize(
    ("mistuning", "words"),
    [
        ({"of": "tip_middle", "within": 1.5}, ["within", "0.9", "1.5"]),
        ({"of": "tip_middle", "within": 0.1, "seeds": [1]}, ["mistuning", "alone"]),
        ({"of": "tip_middle", "within": 0.1}, ["mistuning.of", "variable", "tip_middle"]),
        ({"of": "nothing", "within": 0.1}, ["nothing"]),
    ],
)
def test_bad_bounds_of_blades_are_named(mistuning: dict[str, object], words: list[str]) -> None:
    variables = pose(DISK, variables={"structure.tip_middle": (4e5, 6e5)}).variables
    with pytest.raises((optim.DesignError, solver.SettingError, solver.SceneError)) as caught:
        read_uncertain(DISK, variables, {"mistuning": mistuning})
    for word in words:
        assert word in str(caught.value)
