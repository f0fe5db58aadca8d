"""What of a response depends on how it began: the flags and bounds against marches from several starts."""

import math
from pathlib import Path

import numpy as np
import pytest
from history_referee import crude_march
from history_scenes import BOX, history_scene, moving_plane, plane_scene
from scene_cases import bladed_disk, oscillator, two_dof

from solver import Effects, Scene, SettingError, Solution, load_scene, march, solve, sweep
from solver.marching.march_result import MarchResult
from solver.response.contact_response import ContactState
from solver.scene.scene import FrictionContact, Observe

DATA = Path(__file__).parent.parent.parent / "data"
MARCHED = {"tolerance": 1e-9, "max_periods": 1500}
BRIEFLY = {"tolerance": 1e-8, "max_periods": 150}


def agrees(solution: Solution, other: MarchResult) -> bool:
    """Whether max|x| is that of a march, within the error estimate and 1e-4."""
    allowed = solution.error_estimate + 1e-4 * solution.max_abs
    return abs(solution.max_abs - other.max_abs) <= allowed


def starts(scene: Scene, rng: np.random.Generator, count: int) -> list[dict[str, float]]:
    """Tractions of the contacts, anywhere up to their limits and at both ends of these."""
    names = march(scene, frequency_hz=1.0, max_periods=1, tolerance=1e-2).contacts
    ends = [dict.fromkeys(names, sign * 1e300) for sign in (1.0, -1.0)]
    frictional = [c for c in scene.contacts if isinstance(c, FrictionContact)]
    limits = [c.mu * abs(c.N0) for c in frictional for _ in c.pairs]
    while len(ends) < count:
        ends.append(dict(zip(names, (rng.uniform(-1.0, 1.0, len(limits)) * limits).tolist(), strict=False)))
    return ends[:count]


def check(seed: int, kind: str, further: int, settings: dict[str, float]) -> str:
    """Compare one scene; say what it was."""
    scene, frequency_hz = history_scene(seed, kind)
    solution = solve(scene, frequency_hz=frequency_hz, harmonics=21)
    if not solution.converged:
        return "not solved"
    rest = march(scene, frequency_hz=frequency_hz, **settings)  # type: ignore[arg-type]
    if not rest.converged:
        return "not marched"
    flagged = "mean_undetermined" in solution.flags
    assert flagged or agrees(solution, rest), f"{scene.name}: {solution.max_abs} against {rest.max_abs}"
    allowed = 5.0 * solution.error_estimate + 1e-4 * solution.max_abs
    for tractions in starts(scene, np.random.default_rng(seed), further):
        other = march(scene, frequency_hz=frequency_hz, tractions=tractions, **settings)  # type: ignore[arg-type]
        if not other.converged:
            continue
        if "history_dependent" not in solution.flags and all(c.load_is_given for c in scene.contacts):
            assert abs(other.half_peak_to_peak - solution.half_peak_to_peak) <= allowed, scene.name
        low, high = solution.mean_range
        if math.isfinite(low):
            assert low - allowed <= other.mean <= high + allowed, f"{scene.name}: {other.mean}"
    if flagged:
        return "flagged" if not agrees(solution, rest) else "flagged, agrees from rest"
    return "agrees"


@pytest.mark.few(keep=("given", "box"))
@pytest.mark.parametrize("kind", ["given", "moving", "box", "box-moving"])
def test_without_a_flag_rest_leads_to_the_answer(kind: str) -> None:
    said = [check(seed, kind, 2, BRIEFLY) for seed in range(8)]
    assert len(said) - said.count("not marched") >= 2


@pytest.mark.long
@pytest.mark.parametrize("kind", ["given", "moving", "box", "box-moving"])
@pytest.mark.parametrize("first", range(0, 200, 20))
def test_without_a_flag_rest_leads_to_the_answer_in_many_scenes(kind: str, first: int) -> None:
    said = [check(seed, kind, 4, MARCHED) for seed in range(first, first + 20)]
    assert said.count("agrees") >= 3


def test_an_estimate_covers_where_it_was_short() -> None:
    """From rest and from the answer one motion follows, though its error was 1.1 times the estimate once."""
    assert check(174, "moving", 0, MARCHED) == "agrees"


def test_one_direction_slips_and_the_other_keeps_what_it_slipped_on_its_way() -> None:
    """With a limit for each direction they are two contacts: y has a range of means, x has none."""
    scene = plane_scene({"N0": 100.0, "kt": 123.2448494}, BOX)
    solution = solve(scene, frequency_hz=2.843074977332252, harmonics=25)
    rest = march(scene, frequency_hz=2.843074977332252)
    assert solution.flags == ("mean_undetermined",)
    assert rest.max_abs > 1.5 * solution.max_abs
    assert rest.half_peak_to_peak == pytest.approx(solution.half_peak_to_peak, rel=1e-6)
    # What the slider of y carries leaves this for a constant; x has none of it.
    room = (50.0 - 123.2448494 * solution.half_peak_to_peak) / 12.0438248
    assert solution.mean_range == pytest.approx((-room, room), rel=1e-3)
    assert solution.mean_range[0] < rest.mean < solution.mean_range[1]
    seen = solve(scene.model_copy(update={"observe": Observe(dof="x", band=(0.5, 5.0))}), frequency_hz=2.843)
    assert seen.mean_range == pytest.approx((0.0, 0.0), abs=1e-12)


def test_one_direction_that_slips_under_a_moving_load_leaves_the_other_open() -> None:
    """Of 120 random scenes nine had another half peak to peak from rest, and did not say so."""
    solution = solve(moving_plane(), frequency_hz=1.02188)
    assert solution.contacts[0].state is ContactState.SLIPPING
    assert {"mean_undetermined", "history_dependent"} <= set(solution.flags)


def test_two_limits_are_two_contacts() -> None:
    """A box is the scene with a contact for each direction, in all that depends on history."""
    for N0, hertz in ((100.0, 2.843), (70.0, 2.5), (400.0, 1.2), (40.0, 0.3)):
        both = plane_scene({"N0": N0, "kt": 123.0}, BOX)
        raw = both.to_dict()
        raw["contacts"] = [
            {"name": dof, "between": [dof, "ground"], "kt": 123.0, "mu": 0.5, "N0": N0} for dof in ("x", "y")
        ]
        one, two = (solve(each, frequency_hz=hertz) for each in (both, Scene.from_dict(raw)))
        assert one.flags == two.flags
        assert one.mean_range == pytest.approx(two.mean_range, rel=1e-9, abs=1e-12)


def check_circle(seed: int) -> str:
    """Compare one scene with a march that goes on until the motion repeats."""
    scene, frequency_hz = history_scene(seed, "circle")
    solution = solve(scene, frequency_hz=frequency_hz, harmonics=21)
    if not solution.converged:
        return "not solved"
    rest = march(scene, frequency_hz=frequency_hz, tolerance=1e-8)
    if not rest.converged:
        return "not marched"
    flagged = "mean_undetermined" in solution.flags
    allowed = solution.error_estimate + 1e-3 * solution.max_abs
    near = abs(rest.max_abs - solution.max_abs) <= allowed
    assert flagged or near, f"{scene.name}: {solution.max_abs} against {rest.max_abs}"
    return "agrees" if not flagged else "flagged, agrees from rest" if near else "flagged"


def test_under_a_circular_limit_too() -> None:
    """What is lightly damped takes thousands of periods to come to its answer."""
    said = [check_circle(seed) for seed in (7, 21, 103, 123, 195)]
    assert said == ["agrees"] * 5


@pytest.mark.long
@pytest.mark.parametrize("first", range(0, 200, 20))
def test_under_a_circular_limit_in_many_scenes(first: int) -> None:
    said = [check_circle(seed) for seed in range(first, first + 20)]
    assert said.count("agrees") >= 3
    assert said.count("not marched") <= 5


def test_a_stuck_contact_that_slipped_on_its_way() -> None:
    """It uses a sixth of its limit, but more while the vibration builds up."""
    scene = load_scene(DATA / "mean_of_history_coulomb.toml")
    solution = solve(scene, frequency_hz=1.8712578498049304)
    rest = march(scene, frequency_hz=1.8712578498049304)
    assert "mean_undetermined" in solution.flags
    assert rest.half_peak_to_peak == pytest.approx(solution.half_peak_to_peak, rel=1e-8)
    assert rest.mean != pytest.approx(solution.mean, abs=1e-2 * solution.max_abs)
    assert solution.mean_range[0] < rest.mean < solution.mean_range[1]


@pytest.mark.long
def test_a_circular_limit_that_is_only_grazed() -> None:
    """In the end it sticks, along a circle that touches the limit: what is kept depends on the history."""
    scene = load_scene(DATA / "mean_of_history_circle.toml")
    solution = solve(scene, frequency_hz=1.2729937015505208)
    x, _ = crude_march(scene, 1.2729937015505208, count=1500, periods=150)
    assert "mean_undetermined" in solution.flags
    assert np.abs(x).max() == pytest.approx(0.3763, rel=2e-2)
    assert 0.5 * (x.max() - x.min()) == pytest.approx(solution.half_peak_to_peak, rel=2e-3)
    assert solution.mean_range[0] < x.mean() < solution.mean_range[1]


def test_what_certainly_sticks_from_the_start_has_its_mean() -> None:
    """A bound shows it at once for a large load; where the limit is near the way from rest is followed."""
    assert solve(two_dof(N0=1e4), frequency_hz=1.2).flags == ("all_stuck",)
    assert "mean_undetermined" not in solve(two_dof(N1=0.0), frequency_hz=0.346).flags
    assert "mean_undetermined" in solve(two_dof(), frequency_hz=0.769).flags
    root = solve(bladed_disk(), frequency_hz=755.0)
    assert "mean_undetermined" not in root.flags
    assert root.mean_range[0] < root.mean < root.mean_range[1]


def test_the_bounds_of_the_mean_are_those_of_a_spring_and_a_slider() -> None:
    """Of an oscillator a traction moves the mean by itself over k, and μ N0 − kt X is left for it."""
    scene = oscillator({"kt": 0.5, "mu": 0.3, "N0": 100.0}, k=0.5, c=0.3)
    solution = solve(scene, frequency_hz=0.08)
    room = (30.0 - 0.5 * solution.half_peak_to_peak) / 0.5
    assert solution.mean_range == pytest.approx((-room, room), rel=1e-4)
    for sign in (1.0, -1.0):
        pushed = march(scene, frequency_hz=0.08, tractions={"damper": sign * 20.0})
        # The traction acts at x = 0, and the spring of the contact helps k to carry it.
        assert pushed.mean == pytest.approx(-sign * 20.0 / 1.0, rel=1e-6)
        assert pushed.half_peak_to_peak == pytest.approx(solution.half_peak_to_peak, rel=1e-8)


def test_bounds_of_a_disk_count_every_sector() -> None:
    """One sector stands for the tuned disk, but what its neighbours keep moves its mean too."""
    scene = bladed_disk(N0=2000.0)
    one = solve(scene, frequency_hz=700.0, harmonics=1)
    whole = solve(scene, frequency_hz=700.0, harmonics=1, effects=Effects(every_sector=True))
    assert one.mean_range == pytest.approx(whole.mean_range, rel=1e-6)
    assert one.mean_range[1] > 0.0


def test_a_branch_knows_it_of_its_peak() -> None:
    """By any parameter; the flags are those of `solve` at the peak."""
    stuck = sweep(two_dof(N0=1000.0), harmonics=5)
    for branch in (stuck, sweep(two_dof(), harmonics=5)):
        assert branch.peak is not None
        there = solve(branch.balance.scene, frequency_hz=branch.peak.at, harmonics=5)
        assert branch.mean_undetermined is ("mean_undetermined" in there.flags)
        assert branch.to_json()["mean_undetermined"] is branch.mean_undetermined
    over = sweep(
        two_dof(N1=0.0), parameter="damper.N0", start=50.0, stop=150.0, frequency_hz=0.769, harmonics=5
    )
    assert over.peak is not None
    there = solve(two_dof(N1=0.0, N0=over.peak.at), frequency_hz=0.769, harmonics=5)
    assert over.mean_undetermined is ("mean_undetermined" in there.flags)


def test_the_bounds_come_with_the_flag() -> None:
    flagged = solve(two_dof(), frequency_hz=0.769).to_json()
    assert flagged["mean_range"] is not None
    assert "mean_range" not in solve(two_dof(), frequency_hz=1.2).to_json()


@pytest.mark.parametrize(
    ("tractions", "message"),
    [({"dampr": 1.0}, "dampr"), ({"damper": math.nan}, "newtons"), ({"damper": math.inf}, "newtons")],
)
def test_bad_tractions(tractions: dict[str, float], message: str) -> None:
    with pytest.raises(SettingError, match=message):
        march(two_dof(), frequency_hz=1.2, tractions=tractions)


def test_a_second_response_under_a_moving_load_is_told() -> None:
    """No contact sticks in the answer, and from rest another response is reached in which two do."""
    scene, frequency_hz = history_scene(1037, "moving")
    solution = solve(scene, frequency_hz=frequency_hz)
    assert {"mean_undetermined", "history_dependent"} <= set(solution.flags)
    assert math.isnan(solution.mean_range[0])
