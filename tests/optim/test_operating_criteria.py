"""Running amplitude, wear rate, damping and mass as what designs are judged by."""

from typing import Any

import numpy as np
import pytest
from each import each

import optim
import solver
from optim.criteria.criterion import Criterion
from optim.criteria.damping import DAMPING, QUALITY
from optim.criteria.evaluation import evaluate
from optim.criteria.frequency_ranges import RUNNING
from optim.criteria.friction_work import FRICTION_WORK, WEAR_RATE
from optim.criteria.mass import MASS
from optim.problem.checks import DesignError
from optim.problem.design_problem import pose
from optim.problem.issues import problem_issues
from solver.modes.at_amplitudes import mode_at_amplitudes
from solver.scene.scene import Scene
from stickslip.lab.wear_life.worn_peak import WORN

HARMONICS = 5
VARIABLES = {"damper.N0": (20.0, 400.0), "damper.kt": (10.0, 60.0)}
DESIGN = {"damper.N0": 105.0, "damper.kt": 30.0}
RUNNING_KEYS = {"running_rpm": [[66.0, 78.0]], "weights": {"running": 1.0}}
WEAR_KEYS = {"max_wear_rate": 1e-9, "wear_coefficient": 1e-12}
DAMPING_KEYS = {"min_damping": {"ratio": 0.02, "amplitude": 3.0}}
QUALITY_KEYS = {"quality_factor": {"amplitude": 3.0}, "weights": {"quality": 1.0}}

LIFE = {"hours": 1e-4, "coefficient": 1e-11, "area": 2e-4, "load_loss_per_depth": 4e6}
WORN_KEYS = {"worn": LIFE, "weights": {"worn": 1.0}}


def two_dof(**values: float) -> Scene:
    return solver.load_scene("two-dof").with_values({f"damper.{key}": value for key, value in values.items()})


def row_of(quantity: Criterion, keys: dict[str, Any], design: dict[str, float] = DESIGN) -> Any:
    problem = pose(two_dof(), variables=VARIABLES, harmonics=HARMONICS, **keys)
    return evaluate(problem, design).of(quantity)[0]


@pytest.mark.parametrize(
    ("quantity", "keys"),
    [
        (RUNNING, RUNNING_KEYS),
        (RUNNING, {"running_rpm": [50.0], "max_running_amplitude": 1.0}),
        (WEAR_RATE, WEAR_KEYS),
        (DAMPING, DAMPING_KEYS),
        (QUALITY, QUALITY_KEYS),
        pytest.param(WORN, WORN_KEYS, marks=pytest.mark.long),
        pytest.param(WORN, WORN_KEYS | {"worn": {**LIFE, "frequency_hz": 1.1}}, marks=pytest.mark.long),
    ],
    ids=["range", "speed", "wear", "damping", "quality", "worn", "worn at a frequency"],
)
def test_gradients_are_differences(quantity: Criterion, keys: dict[str, Any]) -> None:
    row = row_of(quantity, keys)
    for i, (path, value) in enumerate(DESIGN.items()):
        step = 1e-4 * value
        below, above = (row_of(quantity, keys, DESIGN | {path: value + s}) for s in (-step, step))
        assert row.gradient[i] == pytest.approx((above.value - below.value) / (2.0 * step), rel=1e-5)


@pytest.mark.parametrize(
    ("quantity", "keys"),
    [
        (WEAR_RATE, WEAR_KEYS),
        (FRICTION_WORK, {"max_friction_work": 1.0}),
        (DAMPING, DAMPING_KEYS),
        (QUALITY, QUALITY_KEYS),
    ],
    ids=["wear", "work", "damping", "quality"],
)
def test_second_derivatives_are_differences_of_gradients(quantity: Criterion, keys: dict[str, Any]) -> None:
    twice = row_of(quantity, keys).second()
    for i, (path, value) in enumerate(DESIGN.items()):
        step = 1e-4 * value
        below, above = (row_of(quantity, keys, DESIGN | {path: value + s}).gradient for s in (-step, step))
        assert twice[i] == pytest.approx(
            (above - below) / (2.0 * step), rel=1e-5, abs=1e-6 * abs(twice).max()
        )


@pytest.mark.long
def test_the_least_wear_rate_is_that_of_a_grid() -> None:
    keys = {"weights": {"wear": 1e9, "peak": 0.05}, "wear_coefficient": 1e-12}
    bounds = {"damper.N0": (20.0, 400.0)}
    found = optim.design(two_dof(), variables=bounds, harmonics=3, **keys)
    problem = pose(two_dof(), variables=bounds, harmonics=3, **keys)
    grid = [
        evaluate(problem, {"damper.N0": load}, gradients=False).objective
        for load in np.geomspace(20.0, 400.0, 25)
    ]
    assert found.reached, found.status
    assert found.evaluation is not None
    assert found.evaluation.objective <= min(grid) * (1.0 + 1e-9)
    (row, *_) = found.evaluation.of(WEAR_RATE)
    assert row.weight == 1e9


def test_the_running_amplitude_is_that_of_its_speeds() -> None:
    low, high = 66.0 / 60.0, 78.0 / 60.0
    dense = max(
        solver.solve(two_dof(N0=105.0), frequency_hz=float(hertz), harmonics=HARMONICS).max_abs
        for hertz in np.linspace(low, high, 200)
    )
    assert row_of(RUNNING, RUNNING_KEYS).value == pytest.approx(dense, rel=1e-4)
    assert row_of(RUNNING, RUNNING_KEYS).value >= dense
    alone = row_of(RUNNING, {"running_rpm": [50.0], "max_running_amplitude": 1.0})
    there = solver.solve(two_dof(N0=105.0), frequency_hz=50.0 / 60.0, harmonics=HARMONICS)
    assert alone.value == pytest.approx(there.max_abs, rel=1e-4)
    assert alone.bound == 1.0


def test_the_least_running_amplitude_is_not_the_least_peak() -> None:
    bounds = {"damper.N0": (20.0, 400.0)}
    found = optim.design(two_dof(), variables=bounds, harmonics=3, **RUNNING_KEYS)
    assert found.reached, found.status
    problem = pose(two_dof(), variables=bounds, harmonics=3, **RUNNING_KEYS)
    grid = [
        evaluate(problem, {"damper.N0": load}, gradients=False).of(RUNNING)[0].value
        for load in np.geomspace(20.0, 400.0, 25)
    ]
    assert found.evaluation is not None
    assert 0.95 * min(grid) <= found.evaluation.objective <= min(grid)
    least = optim.design(two_dof(), variables=bounds, harmonics=3)
    assert abs(found.optimum["damper.N0"] / least.optimum["damper.N0"] - 1.0) > 0.01


def test_the_wear_rate_is_the_coefficient_times_the_power() -> None:
    row = row_of(WEAR_RATE, WEAR_KEYS)
    grid = row.at_hz * (1.0 + np.linspace(-0.01, 0.01, 41))
    power = []
    for hertz in grid:
        there = solver.solve(two_dof(N0=105.0), frequency_hz=float(hertz), harmonics=HARMONICS)
        power.append(hertz * solver.contact_wear(there)["damper"].work.value)
    assert row.value == pytest.approx(1e-12 * max(power), rel=1e-6)
    assert row.value >= 1e-12 * max(power) * (1.0 - 1e-9)
    assert 0 < int(np.argmax(power)) < 40


def test_the_damping_is_that_of_the_mode() -> None:
    row = row_of(DAMPING, DAMPING_KEYS)
    mode = solver.nonlinear_mode(two_dof(N0=105.0), mode=1, amplitudes=(0.3, 30.0), harmonics=HARMONICS)
    found = np.interp(np.log(3.0), np.log(mode.amplitude), mode.damping_ratio)
    assert -row.value == pytest.approx(found, rel=1e-3)
    assert row.bound == -0.02


@pytest.mark.long
def test_the_best_damped_design_is_that_of_a_grid() -> None:
    """Of free decays the mode's damping is largest there, whatever the peak of the response is."""
    bounds = {"damper.N0": (20.0, 400.0)}
    found = optim.design(two_dof(), variables=bounds, harmonics=3, **QUALITY_KEYS)
    ratios = [
        mode_at_amplitudes(two_dof(N0=load), np.array([3.0]), (), harmonics=3).damping_ratio[0]
        for load in np.geomspace(20.0, 400.0, 60)
    ]
    assert found.reached, found.status
    assert found.evaluation is not None
    assert 0.999 * 0.5 / max(ratios) <= found.evaluation.objective <= 0.5 / max(ratios) * (1.0 + 1e-9)


def test_the_gradient_of_a_worn_peak_is_that_of_lives_beside() -> None:
    worn = {**LIFE, "frequency_hz": 1.1, "most": 3.0}
    problem = pose(two_dof(), variables={"damper.N0": (20.0, 400.0)}, harmonics=1, worn=worn)
    low, here, high = (evaluate(problem, {"damper.N0": load}).of(WORN)[0] for load in (104.99, 105.0, 105.01))
    assert here.gradient[0] == pytest.approx((high.value - low.value) / 0.02, rel=1e-5)
    assert here.bound == 3.0


@pytest.mark.long
@pytest.mark.parametrize("more", [{}, {"from_hours": 0.0}, {"largest_factor": 2.0}])
def test_the_best_load_for_a_life_is_that_of_a_grid_of_lives(more: dict[str, float]) -> None:
    """The loads along a life, and the peak of the scene with each of them looked at by itself."""
    bounds, hours = {"damper.N0": (100.0, 200.0)}, 2e-4
    keys = {"worn": {**LIFE, "hours": hours, **more}, "weights": {"worn": 1.0}}
    found = optim.design(two_dof(), variables=bounds, harmonics=1, **keys)
    assert found.reached, found.status
    assert found.evaluation is not None
    factors = np.linspace(1.0, more.get("largest_factor", 1.0), 4)

    def worst(load: float) -> float:
        law = solver.WearLaw(1e-11, 2e-4, load_loss_per_depth=4e6)
        mission = solver.Mission(hours * factors[-1])
        life = solver.wear_life(two_dof(N0=load), mission, law, points=9, harmonics=1)
        counts = life.hours >= more.get("from_hours", hours * (1.0 - 1e-9))
        worn = [
            solver.sweep(two_dof(N0=float(left)), harmonics=1).peak.value for left in life.loads[0][counts]
        ]
        return max(worn)

    best = found.optimum["damper.N0"]
    assert worst(best) == pytest.approx(found.evaluation.objective, rel=1e-5)
    assert all(worst(best * share) > found.evaluation.objective for share in (0.97, 1.03))


@pytest.mark.long
def test_a_limit_on_the_worn_peak_holds_a_design() -> None:
    """The least peak when new wears above the limit: the best design that does not is the one just on it."""
    bounds = {"damper.N0": (60.0, 200.0)}
    free = optim.design(two_dof(), variables=bounds, harmonics=1, worn=LIFE)
    assert free.evaluation is not None
    (worn,) = free.evaluation.of(WORN)
    most = 0.5 * (worn.value + free.evaluation.peaks[0].value)
    held = optim.design(two_dof(), variables=bounds, harmonics=1, worn={**LIFE, "most": most})
    assert held.reached, held.status
    assert held.evaluation is not None
    assert held.evaluation.of(WORN)[0].value == pytest.approx(most, rel=1e-5)
    assert any("worn peak" in one for one in held.active)


def test_the_mass_is_that_of_the_bodies() -> None:
    scene = solver.load_scene("platform-wedge")
    names = [body.name for body in scene.bodies]
    variables = {
        f"{name}.mass": (0.5 * body.mass, 2.0 * body.mass)
        for name, body in zip(names, scene.bodies, strict=True)
    }
    problem = pose(scene, variables=variables, harmonics=3, max_mass=1.0, weights={"mass": 1.0, "peak": 1.0})
    here = {path: scene.value(path) for path in variables}
    evaluation = evaluate(problem, here)
    (row,) = evaluation.of(MASS)
    assert row.value == pytest.approx(sum(here.values()), rel=1e-14)
    assert row.gradient == pytest.approx(np.ones(len(names)), rel=1e-14)
    assert not row.second().any()


@each(
    ("keys", "pointer", "message"),
    [
        ({"max_running_amplitude": 1.0}, "/running_rpm", "must be given with `max_running_amplitude`"),
        ({"running_rpm": [[2.0, 1.0]]}, "/running_rpm/0", "0 < low <= high"),
        ({"running_rpm": 50.0}, "/running_rpm", "must be a list"),
        ({"weights": {"running": 1.0}}, "/weights/running", "needs `running_rpm`"),
        ({"max_wear_rate": 1.0}, "/wear_coefficient", "must be given with `max_wear_rate`"),
        ({"weights": {"wear": 1.0}}, "/weights/wear", "needs `wear_coefficient`"),
        (
            {"max_wear_rate": {"rim": 1.0}, "wear_coefficient": 1.0},
            "/max_wear_rate/rim",
            "must name contacts",
        ),
        ({"min_damping": {"ratio": 0.1}}, "/min_damping", "must be a table with `ratio`, `amplitude`"),
        ({"min_damping": {"ratio": 0.1, "amplitude": 1.0, "mode": 9}}, "/min_damping/mode", "mode"),
        ({"min_damping": {"ratio": 0.1, "amplitude": -1.0}}, "/min_damping/amplitude", "> 0"),
        ({"weights": {"worn": 1.0}}, "/weights/worn", "needs `worn`"),
        ({"worn": {"hours": 1.0}}, "/worn", "must be a table with hours, coefficient, area"),
        ({"worn": {**LIFE, "hour": 1.0}}, "/worn/hour", "is not known"),
        ({"worn": {**LIFE, "hours": -1.0}}, "/worn/hours", "must be a number > 0"),
        ({"worn": {**LIFE, "area": {"rim": 1.0}}}, "/worn/area/rim", "rim"),
        ({"worn": {**LIFE, "from_hours": 9.0}}, "/worn/from_hours", "must be from 0 to"),
        ({"weights": {"quality": 1.0}}, "/weights/quality", "needs `quality_factor`"),
        ({"quality_factor": {"most": 9.0}}, "/quality_factor", "must be a table with `amplitude`"),
        ({"quality_factor": {"amplitude": 1.0, "ratio": 1.0}}, "/quality_factor/ratio", "is not known"),
        ({"max_mass": 1.0}, "/max_mass", "needs `bodies`"),
        ({"weights": {"mass": 1.0}}, "/weights/mass", "needs `bodies`"),
    ],
)
def test_what_is_wrong_is_told_at_its_place(keys: dict[str, Any], pointer: str, message: str) -> None:
    with pytest.raises((DesignError, solver.SettingError), match=message):
        pose(two_dof(), **keys)
    (issue,) = problem_issues(two_dof(), keys)
    assert issue.pointer == pointer
