"""Wedges so light that some of their points slip and others stick: responses that fold where a point begins
to slip, and branches that pass there."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import solver
from solver import BranchStatus, ContinuationSettings, start_of
from solver.balance.balance import build
from solver.balance.workspace import PointSolution, Workspace
from solver.continuation.stretches import Stretch, ahead_of, comes_back, control_of, rows_of

AXIAL = slice(1, None, 3)  # ports of the second tangential direction, along the wedge


def wedge(grams: float, **values: float) -> solver.Scene:
    changed = {f"wedge.{key}": value for key, value in values.items()}
    return solver.load_scene("platform-wedge").with_values({"wedge.mass": 1e-3 * grams, **changed})


def random_wedge(seed: int) -> solver.Scene:
    """A wedge between slipping all the time and sticking all the time."""
    rng = np.random.default_rng(seed)
    return wedge(
        rng.uniform(4.0, 12.0), angle=rng.uniform(0.2, 0.6), mu=rng.uniform(0.2, 0.4),
        kt=10.0 ** rng.uniform(7.0, 7.6),
    )  # fmt: skip


def test_a_sweep_passes_folds_where_points_begin_to_slip() -> None:
    """With 8 g the branch turns in its frequency at 314.66 Hz, on the way to a stuck wedge."""
    branch = solver.sweep(wedge(8.0), start=312.0, stop=317.0, harmonics=5)
    assert branch.status is BranchStatus.COMPLETED
    assert np.any(np.diff(branch.values) < 0.0)
    assert len({tuple(states) for states in branch.states.tolist()}) > 2
    # Nothing moves along the wedge, and what slips leaves its place there where nothing pulls.
    motions = branch.solutions[:, :-1].reshape(len(branch.values), 12, -1)
    assert np.abs(motions[:, AXIAL]).max() <= 1e-6 * np.abs(motions[:, 0]).max()


def test_a_response_is_found_beyond_a_fold_of_the_level() -> None:
    """Every way by steps fails; the response found along the arc is one that a march stays in."""
    solution = solver.solve(wedge(5.5), frequency_hz=300.0, harmonics=5)
    assert solution.converged
    marched = solver.march(wedge(5.5), frequency_hz=300.0, start=start_of(solution), max_periods=2)
    assert marched.half_peak_to_peak == pytest.approx(solution.half_peak_to_peak, rel=0.02)


def assert_followed(seed: int) -> None:
    """The branch comes to an end of its range, through solutions alone."""
    branch = solver.sweep(random_wedge(seed), start=310.0, stop=330.0, harmonics=3)
    assert branch.status in (BranchStatus.COMPLETED, BranchStatus.TURNED_BACK), seed
    if branch.status is BranchStatus.TURNED_BACK:
        assert abs(branch.values[-1] - 310.0) < 2.0, seed


@pytest.mark.few(40)
@pytest.mark.parametrize("seed", range(40))
def test_random_wedges_are_followed(seed: int) -> None:
    assert_followed(seed)


def shipped(name: str, mass: float, **values: float) -> solver.Scene:
    return solver.load_scene(f"platform-{name}").with_values(
        {f"{name}.mass": mass} | {path.replace("__", "."): value for path, value in values.items()}
    )


@pytest.mark.parametrize("mass", [0.0049, 0.00453])
def test_a_first_point_is_found_from_few_harmonics_upward(mass: float) -> None:
    """Neither from stuck contacts nor by half as many harmonics again: by one or two more at a time."""
    solution = solver.solve(shipped("wedge", mass), frequency_hz=300.0, harmonics=11)
    assert solution.converged
    # By the other ways thousands; rounding decides by some tens.
    assert solution.newton_iterations < 1000
    marched = solver.march(
        shipped("wedge", mass), frequency_hz=300.0, start=start_of(solution), max_periods=3
    )
    assert marched.half_peak_to_peak == pytest.approx(solution.half_peak_to_peak, rel=0.05)


LIGHTEST, HEAVIEST = 4e-4, 6e-2  # kg, bounds of the design of the shipped ones


# Of 12, 2.4 g at 315 Hz, no way finds a point.
@pytest.mark.few(4)
@pytest.mark.parametrize("seed", [*range(12), *range(13, 25)])
def test_first_points_of_random_dampers_are_motions_that_a_march_stays_in(seed: int) -> None:
    rng = np.random.default_rng(seed)
    name = ("wedge", "cylinder")[seed % 2]
    mass = np.exp(rng.uniform(np.log(2.0 * LIGHTEST), np.log(HEAVIEST)))
    if seed < 4:
        mass = HEAVIEST if seed >= 2 else 2.0 * LIGHTEST
    scene = shipped(
        name, float(mass), excitation__amplitude=60.0 * np.exp(rng.uniform(-1.5, 1.5)),
        **{f"{name}__mu": rng.uniform(0.1, 0.6)},
    )  # fmt: skip
    hertz = rng.uniform(290.0, 430.0)
    solution = solver.solve(scene, frequency_hz=hertz, harmonics=11)
    assert solution.converged
    marched = solver.march(scene, frequency_hz=hertz, start=start_of(solution), max_periods=3)
    assert marched.half_peak_to_peak == pytest.approx(solution.half_peak_to_peak, rel=0.05)


def test_a_branch_is_given_up_where_it_is_far_higher_than_what_it_is_compared_with() -> None:
    scene = shipped("wedge", 0.001)
    settings = solver.ContinuationSettings(highest=1e-3, unfinished_peaks=False)
    branch = solver.sweep(scene, settings=settings)
    assert branch.status is BranchStatus.TOO_HIGH
    assert not branch.peaks
    assert branch.amplitude.max() > 1e-3
    whole = solver.sweep(shipped("wedge", 0.012), settings=settings)
    assert whole.reached


def test_what_lies_behind_the_end_of_a_branch_is_solved_once(monkeypatch: pytest.MonkeyPatch) -> None:
    balance = build(wedge(12.0), harmonics=3)
    workspace, inside = Workspace.of(balance), balance.parameter.inside
    control = control_of(ContinuationSettings(), inside(300.0), inside(420.0), ContinuationSettings().pace)
    here = workspace.solve(inside(419.0)).u
    tried, solve = list[float](), Workspace.solve

    def counted(self: Workspace, p: float, *more: Any, **ways: Any) -> PointSolution:
        tried.append(p)
        return solve(self, p, *more, **ways)

    monkeypatch.setattr(Workspace, "solve", counted)
    ahead = ahead_of(workspace, np.append(here, inside(419.0))[None, :], control)
    assert ahead(1e-3) is ahead(1e-3)
    assert tried == [inside(419.0) + 1e-3 * (inside(420.0) - inside(300.0))]
    assert ahead(1e-2) is None


def closes(turns: float, drift: float = 0.0) -> bool:
    """Whether a way to λ = 1 and round a circle there, in stretches of 16 points, is told to close."""
    angle = 2.0 * np.pi * np.arange(round(80 * turns)) / 80.3
    way = np.stack([np.full(30, 0.5), np.linspace(0.0, 0.97, 30)], axis=1)
    circle = np.stack([1.0 - 0.5 * np.cos(angle) + drift * angle, 1.0 + 0.3 * np.sin(angle)], axis=1)
    points, rows = np.concatenate([way, circle]), rows_of(build(wedge(12.0), harmonics=3), 0)
    none = Stretch(
        **rows, status=None, newton_iterations=0, rejected_steps=0, stepped_over=0, seconds=0.0,
        walk=np.zeros(0),
    )  # fmt: skip
    stretches = [replace(none, solutions=points[i : i + 16]) for i in range(0, len(points), 16)]
    return any(comes_back(stretches[: i + 1]) for i in range(len(stretches)))


def test_a_branch_that_goes_round_a_closed_curve_is_told_from_one_that_goes_on() -> None:
    assert closes(2.0)
    assert not closes(0.95)
    assert not closes(3.0, drift=0.05)


@pytest.mark.long
def test_a_cylinder_whose_branch_closes_is_followed_from_above() -> None:
    """All points that a look may have were spent on the circle from 369.96 to 375.15 Hz."""
    light = solver.load_scene("platform-cylinder").with_values({"cylinder.mass": 0.005215629842616768})
    light = light.model_copy(
        update={"observe": light.observe.model_copy(update={"measure": "half_peak_to_peak"})}
    )
    branch = solver.sweep(light, settings=ContinuationSettings(most_points=1200, peaks=False, errors=False))
    assert branch.reached
    assert branch.values[0] == 420.0
    assert len(branch.values) < 600
