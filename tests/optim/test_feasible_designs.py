"""Where designs keep all limits one is found: random limits of every kind beside brute force."""

import math
from typing import Any

import pytest
from cases.limited_designs import brute_force, judged, limited_design

import optim
import solver
from optim.results.design_result import Certainty, DesignStatus
from optim.robust.robust_result import RobustStatus

KEPT = 1e-5  # relative excess over a bound, of sweeps of their own
WORSE = 1e-3  # relative, of what is minimised, than the best of the grid
TWO_DOF: dict[str, Any] = {
    "running_rpm": [[55.0, 66.0]], "max_running_amplitude": 2.3, "harmonics": 3,
}  # fmt: skip


@pytest.mark.parametrize(
    "more", [{}, {"start": {"damper.N0": 400.0}}, {"forbidden_hz": [[0.917, 1.1]], "limit": 2.3}]
)
def test_limits_kept_on_a_plateau_in_another_basin_are_found(more: dict[str, Any]) -> None:
    scene = solver.load_scene("two-dof")
    found = optim.design(scene, variables={"damper.N0": (20.0, 500.0)}, **TWO_DOF | more)
    assert found.status is DesignStatus.OPTIMAL
    # By sweeps of their own: the least load from which the contact sticks at these speeds.
    assert found.optimum["damper.N0"] == pytest.approx(327.386, rel=1e-4)
    for load, kept in ((326.0, False), (328.0, True), (500.0, True)):
        branch = solver.sweep(scene.with_values({"damper.N0": load}), start=55 / 60, stop=1.1, harmonics=3)
        assert branch.peak is not None
        assert (branch.peak.value <= 2.3) is kept


@pytest.mark.long
def test_a_robust_design_that_keeps_its_limits_is_not_left_for_one_that_breaks_them() -> None:
    """The least load sticks at the least friction; the basin of the least peak breaks the limit."""
    found = optim.robust_design(
        solver.load_scene("two-dof"), variables={"damper.N0": (20.0, 500.0)},
        uncertain={"damper.mu": [0.28, 0.32]}, samples=4, **TWO_DOF,
    )  # fmt: skip
    assert found.status is RobustStatus.OPTIMAL
    assert found.optimum["damper.N0"] == pytest.approx(327.386 * 0.3 / 0.28, rel=1e-4)


@pytest.mark.few(keep=(1, 5, 14))
@pytest.mark.parametrize("seed", range(200))
def test_infeasible_is_never_said_where_a_grid_keeps_all_limits(seed: int) -> None:
    asked, limits = limited_design(seed)
    found = optim.design(**asked)
    assert found.evaluation is not None
    best = judged(found.problem, limits, found.optimum)
    # Where nothing depends on the variables, that is the status, and what is broken is told beside it.
    if found.status is DesignStatus.INFEASIBLE or (found.status is DesignStatus.FLAT and best.excess > KEPT):
        assert best.excess > 0.0
        assert not found.reached
        assert not brute_force(found.problem, limits, math.inf)
        return
    assert best.excess <= KEPT
    # Of two of 157 the grid is better, by 0.4 and 2.3 %: pieces of what a limit of the band allows.
    better = brute_force(found.problem, limits, best.objective * (1.0 - WORSE))
    assert not better or found.certainty is not Certainty.CLOSED
