"""Mean loads on what contacts alone hold: within friction, above it, or creeping under what vibrates."""

import json
import math

import pytest
from floating_cases import pulled, two_blades
from floating_scenes import floating_scene
from hard_scenes import HARD
from pulled_scenes import Pulled, pulled_bar, pulled_body, pulled_mass, pulled_wedge, wedge_limit

from solver import BranchStatus, Scene, SolutionStatus, load_scene, march, solve, sweep
from solver.marching.march_result import MarchStatus

ABOVE = "mean_load_above_friction"
DRAWN = {"bar": pulled_bar, "mass": pulled_mass}
CREEPS = {
    **{f"two blades, {pull:g} N": (pulled(two_blades(), "d", pull), 317.4) for pull in (1.0, 5.0, 25.0)},
    "two blades, pressed": (pulled(two_blades(N0=500.0), "d", 290.0), 50.0),
    "loose mass": (HARD["loose mass, floor slips"].scene, HARD["loose mass, floor slips"].frequency_hz),
}  # fmt: skip


@pytest.mark.few(10)
@pytest.mark.parametrize("seed", range(40))
@pytest.mark.parametrize("kind", DRAWN)
def test_the_limit_of_friction(kind: str, seed: int) -> None:
    """A tenth below it there is a motion, a tenth above none, which is known before Newton's method."""
    below, above = (DRAWN[kind](seed, share) for share in (0.9, 1.1))
    held = solve(below.scene, frequency_hz=below.frequency_hz, harmonics=5)
    assert ABOVE not in held.flags
    assert held.converged or held.status is SolutionStatus.RATCHETS
    assert not is_held(below) or held.converged
    driven = solve(above.scene, frequency_hz=above.frequency_hz, harmonics=5)
    assert driven.status is SolutionStatus.RATCHETS
    assert driven.flags == (ABOVE,)
    assert driven.newton_iterations == 0
    assert driven.drift_per_period == math.inf  # no dashpot
    told = driven.to_json()
    assert told["drift_per_period"] is None
    assert "mean load above friction" in str(driven.summary())
    json.dumps(told, allow_nan=False)


def is_held(drawn: Pulled) -> bool:
    """Whether no load of a contact varies: then it sticks at its limit less a tenth, and nothing creeps."""
    return all(contact.N1_value == 0.0 for contact in drawn.scene.contacts)


def test_the_limit_along_the_axis_of_a_wedge() -> None:
    """Its normal loads are part of the balance of means: the largest axial force in closed form."""
    limit = wedge_limit(load_scene("platform-wedge"))
    for share in (1.02, 3.0):
        driven = solve(pulled_wedge(share * limit), frequency_hz=345.0, harmonics=3)
        assert driven.status is SolutionStatus.RATCHETS
        assert driven.flags == (ABOVE,)
        assert driven.newton_iterations == 0
    assert ABOVE not in solve(pulled_wedge(0.98 * limit, 0.1), frequency_hz=345.0, harmonics=3).flags


@pytest.mark.parametrize("name", CREEPS)
def test_what_creeps_drifts_as_the_march_does(name: str) -> None:
    scene, frequency_hz = CREEPS[name]
    found = solve(scene, frequency_hz=frequency_hz, harmonics=21)
    assert found.status is SolutionStatus.RATCHETS
    assert found.flags == ()
    marched = march(scene, frequency_hz=frequency_hz, max_periods=5_000)
    assert marched.status is MarchStatus.RATCHETS
    assert found.drift_per_period == pytest.approx(marched.drift, rel=0.02)
    assert found.to_json()["drift_per_period"] == found.drift_per_period
    assert "a period" in str(found.summary())


@pytest.mark.long
@pytest.mark.parametrize("seed", [16, 46, 50, 197])
def test_random_bodies_that_creep(seed: int) -> None:
    """Where the steady drift of a random scene is found, a march has it too."""
    scene = floating_scene(seed)
    low, high = scene.observe.band
    for share in range(9):
        at = low + share / 8.0 * (high - low)
        found = solve(scene, frequency_hz=at, harmonics=31)
        if found.status is SolutionStatus.RATCHETS and math.isfinite(found.drift_per_period):
            marched = march(scene, frequency_hz=at, max_periods=20_000)
            assert marched.drift == pytest.approx(found.drift_per_period, rel=0.05)


@pytest.mark.long
def test_a_wedge_that_nothing_holds_along_its_axis_creeps() -> None:
    """Contacts in space that slip to and fro give way to any force across."""
    scene = pulled_wedge(20.0)
    found = solve(scene, frequency_hz=345.0, harmonics=7)
    assert found.status is SolutionStatus.RATCHETS
    assert found.flags == ()
    assert found.drift_per_period == pytest.approx(march(scene, frequency_hz=345.0).drift, rel=0.05)


def test_a_wedge_that_stands_is_not_said_to_creep() -> None:
    """What its contacts do where a constant force holds it leaves some of that force; full stick stands."""
    scene = pulled_wedge(0.08048523954147624, 32.77681945965323)
    assert solve(scene, frequency_hz=310.42194540783146, harmonics=3).converged
    # A march of this one repeats after 1314 periods: slips leave forces under which all contacts stick.
    scene, frequency_hz = pulled_body(128)
    assert solve(scene, frequency_hz=frequency_hz, harmonics=3).status is not SolutionStatus.RATCHETS


@pytest.mark.few(keep=(14,))
@pytest.mark.parametrize("seed", range(250))
def test_random_bodies_in_space_that_creep(seed: int) -> None:
    """What is said to ratchet never comes to repeat in a march."""
    scene, frequency_hz = pulled_body(seed)
    if solve(scene, frequency_hz=frequency_hz, harmonics=3).status is SolutionStatus.RATCHETS:
        marched = march(scene, frequency_hz=frequency_hz, max_periods=500)
        assert marched.status in (MarchStatus.RATCHETS, MarchStatus.CHATTER, MarchStatus.MAX_PERIODS)


def test_a_branch_that_ends_as_ratcheting_says_how_far() -> None:
    scene = pulled(two_blades(), "d", 5.0)
    branch = sweep(scene, start=250.0, stop=317.4)
    assert branch.status is BranchStatus.RATCHETS
    assert branch.flags == ()
    beyond = branch.values[-1] + 1e-2 * (317.4 - 250.0)
    there = march(scene, frequency_hz=float(beyond), max_periods=5_000)
    assert 0.0 < branch.drift_per_period <= 1.05 * there.drift
    told = branch.to_json()
    assert told["drift_per_period"] == branch.drift_per_period
    over_load = sweep(pulled(two_blades(N0=300.0), "d", 200.0), "left.N0", 900.0, 100.0, frequency_hz=50.0)
    assert over_load.status is BranchStatus.RATCHETS
    assert over_load.values[-1] >= 200.0 / 0.3 - 300.0


def test_a_sweep_above_friction_ends_at_once() -> None:
    branch = sweep(pulled(two_blades(N0=500.0), "d", 310.0), start=40.0, stop=60.0)
    assert branch.status is BranchStatus.RATCHETS
    assert branch.flags == (ABOVE,)
    assert branch.peak is None
    assert branch.newton_iterations == 0
    assert branch.drift_per_period == math.inf


def test_a_dashpot_holds_a_load_above_friction_at_a_steady_speed() -> None:
    """All contacts slip one way: the excess over the dashpot is the speed."""
    raw = pulled(two_blades(N0=50.0), "d", 100.0).to_dict()
    structure = dict(raw["structure"])  # type: ignore[call-overload]
    structure["dampers"] = [{"between": ["d", "ground"], "c": 500.0}]
    scene = Scene.from_dict({**raw, "structure": structure})
    found = solve(scene, frequency_hz=150.0)
    assert found.flags == (ABOVE,)
    speed = (100.0 - 2.0 * 0.3 * 50.0) / 500.0
    assert found.drift_per_period == pytest.approx(speed / 150.0, rel=1e-3)
