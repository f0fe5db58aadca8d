"""What a case or an option sets is never overwritten without a word."""

from typing import Any

import numpy as np
import pytest

import optim
import solver
from optim.problem.checks import DesignError
from optim.problem.design_problem import pose
from optim.problem.issues import problem_issues
from optim.problem.uncertainty_input import read_uncertain

BOUNDS = {
    "N0": (20.0, 300.0), "N1": (1.0, 15.0), "N1_ratio": (0.05, 0.6), "kt": (1e3, 1e6), "mu": (0.1, 0.6),
    "amplitude": (5.0, 80.0),
}  # fmt: skip
TIED = {"N1": "N1_ratio", "N1_ratio": "N1"}  # each is another way to say the other
CONTACTS = {"two-dof": ("damper",), "bladed-disk": ("shroud", "root")}


def paths_of(name: str) -> list[str]:
    own = [f"{contact}.{key}" for contact in CONTACTS[name] for key in BOUNDS if key != "amplitude"]
    return [*own, "excitation.amplitude"]


def displaces(variable: str, own: str) -> bool:
    """Whether a variable leaves a case nothing of what it sets, by hand."""
    (owner, _, key), (other, _, its) = variable.partition("."), own.partition(".")
    return owner == other and its in (key, TIED.get(key))


def chosen_of(chance: np.random.Generator, paths: list[str], count: int) -> list[str]:
    """So many paths, none of which is another way to say another."""
    while True:
        chosen = [str(path) for path in chance.choice(paths, size=count, replace=False)]
        if not any(displaces(one, other) for one in chosen for other in chosen if one != other):
            return chosen


@pytest.mark.few(12)
@pytest.mark.parametrize("seed", range(200))
def test_a_case_that_sets_a_variable_is_refused_with_its_name(seed: int) -> None:
    chance = np.random.default_rng(seed)
    name = ("two-dof", "bladed-disk")[seed % 2]
    scene, paths = solver.load_scene(name), paths_of(name)
    chosen = chosen_of(chance, paths, 1 + seed % 3)
    wanted = chance.choice(chosen)
    others = [path for path in paths if displaces(wanted, path)] if chance.random() < 0.7 else paths
    own = str(chance.choice(others))
    value = float(chance.uniform(*BOUNDS[own.partition(".")[2]]))
    keys: dict[str, Any] = {
        "variables": {path: BOUNDS[path.partition(".")[2]] for path in chosen},
        "cases": [{"name": "plain"}, {"name": "own", "set": {own: value}, "weight": 0.5}],
    }
    if seed % 5 == 0 and len(chosen) == 1 and chosen[0].endswith(("N0", "N1", "kt")):  # that share a value
        keys["variables"] = {f"excitation.amplitude,{chosen[0]}": BOUNDS["amplitude"]}
        chosen = ["excitation.amplitude", chosen[0]]
    if not any(displaces(one, own) for one in chosen):
        case = pose(scene, **keys).cases[1].scene
        after = case.with_values({path: BOUNDS[path.partition(".")[2]][0] for path in chosen})
        assert after.value(own) == pytest.approx(value, rel=1e-12)
        return
    with pytest.raises(DesignError, match="is a variable: it has no value here") as refused:
        pose(scene, **keys)
    assert refused.value.place == ("cases", 1, "set", own)
    assert [issue.pointer for issue in problem_issues(scene, keys)] == [f"/cases/1/set/{own}"]


SCENE = solver.load_scene("two-dof")
LOADS: dict[str, Any] = {
    "variables": {"damper.N0": (20.0, 1000.0)}, "cases": [{"name": "a", "set": {"damper.N0": 50.0}}],
}  # fmt: skip


@pytest.mark.parametrize("study", ["design", "pareto_front", "robust_design", "catalogue"])
def test_every_study_of_designs_refuses_it(study: str) -> None:
    more: dict[str, Any] = {
        "robust_design": {"uncertain": {"damper.mu": [0.2, 0.3]}},
        "catalogue": {"options": {"stiff": {"damper.kt": 2e5}}},
    }.get(study, {})
    with pytest.raises(DesignError, match=r"cases\[0\].set.damper.N0. is a variable"):
        getattr(optim, study)(SCENE, **LOADS, **more)


def test_without_variables_the_default_one_counts() -> None:
    with pytest.raises(DesignError, match=r"cases\[0\].set.damper.N0. is a variable"):
        pose(SCENE, cases=LOADS["cases"])


@pytest.mark.parametrize(
    ("uncertain", "name"),
    [
        ({"damper.mu": [0.2, 0.4]}, "damper.mu"),
        ([{"damper.kt": 2e4}, {"damper.mu": 0.2}], "damper.mu"),
        ({"centre": {"damper.N1_ratio": 0.2}, "half_axes": {"damper.N1_ratio": 0.1}}, "damper.N1"),
    ],
)  # fmt: skip
def test_uncertain_values_leave_a_case_what_it_sets(uncertain: Any, name: str) -> None:
    value = 0.3 if name == "damper.mu" else 20.0
    posed = pose(SCENE, cases=[{"name": "own", "set": {name: value}}], harmonics=3)
    with pytest.raises(DesignError, match=f"sets {name}, as the case own does: give a deviation"):
        read_uncertain(SCENE, posed.variables, uncertain, posed.cases)
    read_uncertain(SCENE, posed.variables, {"damper.mu": {"deviation": 0.1}}, posed.cases)


def test_options_leave_nothing_behind_that_is_overwritten() -> None:
    from stickslip.lab.catalogue.catalogue import check_options

    options = {"tied": {"damper.N1": 20.0}}
    with pytest.raises(DesignError, match=r"does not stay as it is beside damper\.N1_ratio"):
        check_options(SCENE, options, {"variables": {"damper.N1_ratio": (0.1, 0.5)}})
    with pytest.raises(DesignError, match="is set by the case own: it has no value here"):
        check_options(SCENE, options, {"cases": [{"name": "own", "set": {"damper.N1": 5.0}}]})
    strong = [{"name": "strong", "set": {"excitation.amplitude": 80.0}}]
    assert check_options(SCENE, options, {"variables": {}, "cases": strong})["tied"].variables == ()
