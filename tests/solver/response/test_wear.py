"""Wear: friction work, least load and travel against power balance, time march and the whole solve."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from each import each
from law_scene_cases import CUBIC, GAP, PLANE, RUB, scene
from random_scenes import random_scene
from scene_cases import bladed_disk, mixed_disk, two_dof

from solver import (
    Branch,
    ContactWear,
    Measure,
    Measured,
    Scene,
    SettingError,
    WearSensitivity,
    WorstWear,
    contact_wear,
    hysteresis_loop,
    march,
    power_balance,
    solve,
    sweep,
    worst_friction_work,
    worst_slopes,
    worst_wear,
)
from solver.balance.simplifications import Effects
from solver.balance.workspace import Workspace
from solver.jit.fourier import derivative

RUB_LIFTING = {**RUB, "N0": -0.1, "N1": 0.3, "N1_phase": 0.5}
BOX = {**PLANE, "limit": "box", "N1_ratio": 0.4}
EVERY_LAW = scene(RUB, PLANE, BOX, GAP, CUBIC, {"kt": 1.0, "mu": 0.2, "N0": 1.0, "N1": 1.4})

# scene, frequency [Hz], contact, paths.
CASES: dict[str, tuple[Scene, float, str, tuple[str, ...]]] = {
    "two-dof": (
        two_dof(),
        1.198,
        "damper",
        ("damper.N0", "damper.kt", "damper.mu", "damper.N1_ratio", "damper.N1_phase", "structure.k1",
         "excitation.amplitude"),
    ),
    "two-dof, constant load": (two_dof(N1=0.0), 1.198, "damper", ("damper.N0", "damper.kt", "damper.mu")),
    "two-dof, separating": (
        two_dof(N1=200.0, N1_phase=0.4),
        1.198,
        "damper",
        ("damper.N0", "damper.N1", "damper.kt", "damper.mu", "damper.N1_phase"),
    ),
    "bladed-disk": (bladed_disk(), 755.0, "shroud", ("shroud.N0", "shroud.kt", "shroud.N1_ratio")),
    "bladed-disk, separating": (
        bladed_disk(N1=400.0),
        640.0,
        "shroud",
        ("shroud.N0", "shroud.N1", "shroud.mu"),
    ),
    "mixed disk": (mixed_disk(), 540.0, "shroud", ("shroud.N0", "root.mu", "structure.tip_mass")),
    "rubbing": (scene(RUB), 0.2, "c0", ("c0.N0", "c0.kn", "c0.kt", "c0.mu", "c0.N1")),
    "rubbing, separating": (scene(RUB_LIFTING), 0.2, "c0", ("c0.N0", "c0.kn", "c0.kt", "c0.mu", "c0.N1")),
    "box": (scene(BOX), 0.2, "c0", ("c0.N0", "c0.kt", "c0.mu")),
}  # fmt: skip
MEASURES: dict[str, Callable[[ContactWear], Measured | None]] = {
    "work": lambda wear: wear.work,
    "least load": lambda wear: wear.least_load,
    "travel": lambda wear: wear.travel,
}


def wear_at(here: Scene, frequency: float, contact: str, paths: tuple[str, ...] = ()) -> ContactWear:
    solution = solve(here, frequency_hz=frequency)
    assert solution.converged
    return contact_wear(solution, paths)[contact]


@each("name", CASES)
def test_work_is_the_power_of_the_contact_times_the_period(name: str) -> None:
    here, frequency, contact, _ = CASES[name]
    solution = solve(here, frequency_hz=frequency)
    power = power_balance(solution).contacts_w[contact]
    work = contact_wear(solution)[contact].work.value
    if name == "rubbing, separating":
        # A varying load does work along the normal as well, which rubs nothing.
        found = solution.contacts[0]
        assert found.second_motion is not None
        assert found.second_force is not None
        work += math.pi * float(found.second_force @ derivative(found.second_motion))
    assert work == pytest.approx(power / frequency, rel=1e-11)


def test_every_law_has_its_measures() -> None:
    solution = solve(EVERY_LAW, frequency_hz=0.2)
    wear = contact_wear(solution, ("c0.kn", "c3.gap"))
    power = power_balance(solution).contacts_w
    for name in ("c0", "c1", "c2", "c5"):
        assert wear[name].work.value == pytest.approx(power[name] / 0.2, rel=1e-9)
        assert wear[name].work.value > 0.0
        assert wear[name].least_load is not None
    for name in ("c3", "c4"):
        assert wear[name].work.value == 0.0
        np.testing.assert_array_equal(wear[name].work.gradient, 0.0)
        assert wear[name].least_load is None
    assert [wear[f"c{i}"].travel is None for i in range(6)] == [False, True, True, True, True, False]
    assert [wear[f"c{i}"].shares is None for i in range(6)] == [False] * 4 + [True, False]
    for one in wear.values():
        if one.shares is not None:
            assert sum(one.shares) == pytest.approx(1.0, abs=1e-12)
            assert min(one.shares) >= -1e-15


def test_without_contacts_there_is_no_wear() -> None:
    raw = {**two_dof().to_dict(), "contacts": []}
    solution = solve(Scene.from_dict(raw), frequency_hz=1.0, harmonics=3)
    assert contact_wear(solution) == {}


def test_a_spring_on_one_side_sticks_while_it_is_closed() -> None:
    solution = solve(scene(GAP), frequency_hz=0.13)
    _, force = hysteresis_loop(solution, "c0", samples=100_000)
    shares = contact_wear(solution)["c0"].shares
    assert shares is not None
    assert shares.slip == 0.0
    assert 0.0 < shares.stick < 1.0
    assert shares.stick == pytest.approx(float((force > 0.0).mean()), abs=1e-4)


@pytest.mark.parametrize(
    ("name", "harmonics", "accuracy"),
    [("two-dof", 31, 1e-5), ("two-dof, separating", 41, 3e-4), ("rubbing", 41, 3e-4)],
)
def test_measures_of_a_marched_cycle(name: str, harmonics: int, accuracy: float) -> None:
    here, frequency, contact, _ = CASES[name]
    wear = contact_wear(solve(here, frequency_hz=frequency, harmonics=harmonics))[contact]
    run = march(here, frequency_hz=frequency)
    assert run.converged
    u, force, load = run.slip[0], run.contact_force[0], run.normal_load[0]
    du = np.roll(u, -1) - u
    area = float(np.sum(0.5 * (force + np.roll(force, -1)) * du))
    law: Any = here.contacts[0]
    rubbing = (np.abs(force) >= law.mu * load * (1.0 - 1e-9)) & (load > 0.0)
    moved = np.abs(np.diff(u - force / law.kt, append=(u - force / law.kt)[0]))
    touching = (load > 0.0) & (np.roll(load, -1) > 0.0)
    assert wear.work.value == pytest.approx(area, rel=accuracy)
    assert wear.travel is not None
    # The samples between which a contact opens or closes are left out, though it rubs for a part of them.
    at_edges = 4e-3 if wear.shares is not None and wear.shares.separation > 0.0 else 0.0
    assert wear.travel.value == pytest.approx(float(moved[touching].sum()), rel=3.0 * accuracy + at_edges)
    assert wear.shares is not None
    assert wear.shares.slip == pytest.approx(float(rubbing.mean()), abs=2e-3)
    assert wear.shares.separation == pytest.approx(float((load <= 0.0).mean()), abs=1e-3)


def test_work_is_the_area_of_the_hysteresis_loop() -> None:
    solution = solve(bladed_disk(), frequency_hz=755.0)
    u, force = hysteresis_loop(solution, "shroud", samples=20_000)
    area = float(np.sum(0.5 * (force + np.roll(force, -1)) * (np.roll(u, -1) - u)))
    assert contact_wear(solution)["shroud"].work.value == pytest.approx(area, rel=1e-6)


def test_least_load_of_a_given_load_is_its_mean_less_its_swing() -> None:
    for N1 in (-40.0, 0.0, 40.0, 200.0):
        least = wear_at(two_dof(N1=N1, N1_phase=0.8), 1.2, "damper", ("damper.N0", "damper.N1")).least_load
        assert least is not None
        assert least.value == pytest.approx(100.0 - abs(N1), rel=1e-14)
        rise = -1.0 if N1 >= 0.0 else 1.0
        np.testing.assert_allclose(least.gradient, [1.0, rise], rtol=1e-14)
        assert least.by_frequency == 0.0


def test_least_load_of_a_rubbing_contact_is_the_least_of_its_load() -> None:
    solution = solve(scene(RUB_LIFTING), frequency_hz=0.2)
    tau = np.linspace(0.0, 2.0 * math.pi, 200_001)
    load = solution.contacts[0].load
    orders = np.arange(1, (load.size + 1) // 2)[:, None]
    N = load[0] + load[1::2] @ np.cos(orders * tau) + load[2::2] @ np.sin(orders * tau)
    least = contact_wear(solution)["c0"].least_load
    assert least is not None
    assert least.value == pytest.approx(N.min(), abs=1e-9)


@pytest.mark.few(3)
@pytest.mark.parametrize("measure", MEASURES)
@pytest.mark.parametrize("name", CASES)
def test_derivatives_equal_differences_of_the_whole_solve(name: str, measure: str) -> None:
    here, frequency, contact, paths = CASES[name]
    found = MEASURES[measure](wear_at(here, frequency, contact, paths))
    if found is None:
        assert (name, measure) == ("box", "travel")
        return

    def at(path: str | None, move: float) -> float:
        moved = here if path is None else here.with_values({path: here.value(path) + move})
        there = MEASURES[measure](wear_at(moved, frequency + move if path is None else frequency, contact))
        assert there is not None
        return there.value

    for path, exact in [(None, found.by_frequency), *zip(paths, found.gradient, strict=True)]:
        value = frequency if path is None else here.value(path)
        # A variation begins at 0 with a corner in the least load: its slope is the one of a rise.
        if measure == "least load" and value == 0.0:
            continue
        step = 2e-5 * max(abs(value), 0.1)
        coarse = (at(path, step) - at(path, -step)) / (2.0 * step)
        fine = (at(path, 0.5 * step) - at(path, -0.5 * step)) / step
        difference = (4.0 * fine - coarse) / 3.0
        scale = max(abs(difference), 1e-3 * abs(found.value / value) if value else 0.0)
        assert abs(exact - difference) <= 1e-6 * scale + 0.05 * abs(fine - coarse), (path, exact, difference)


def test_the_many_contacts_of_an_annulus_rub_alike() -> None:
    whole = solve(bladed_disk(), frequency_hz=755.0, effects=Effects(every_sector=True))
    wear = contact_wear(whole, ("shroud.kt",))
    one = wear_at(bladed_disk(), 755.0, "shroud", ("shroud.kt",))
    shrouds = [w for name, w in wear.items() if name.startswith("shroud")]
    assert len(shrouds) == 8
    for other in shrouds:
        assert other.work.value == pytest.approx(one.work.value, rel=1e-8)
    # The path moves all sectors' contacts together.
    np.testing.assert_allclose(shrouds[3].work.gradient, one.work.gradient, rtol=1e-6)


def test_bad_arguments_are_named() -> None:
    solution = solve(two_dof(), frequency_hz=1.0)
    with pytest.raises(SettingError, match=r"damper\.nu"):
        contact_wear(solution, ("damper.nu",))
    branch = sweep(two_dof(), "damper.N0", 90.0, 110.0, frequency_hz=1.2)
    with pytest.raises(SettingError, match="must be `frequency`"):
        WearSensitivity(branch.balance)
    with pytest.raises(SettingError, match="must be one of damper"):
        worst_friction_work(branch, "dumper")
    springs = sweep(scene(GAP), start=0.1, stop=0.12, harmonics=3)
    with pytest.raises(SettingError, match="slip travel"):
        worst_wear(springs, "c0", Measure.SLIP_TRAVEL)


WORST: dict[str, tuple[Scene, str, tuple[float, float], str]] = {
    "two-dof": (two_dof(), "damper", (0.6, 2.6), "damper.N0"),
    "two-dof, separating": (two_dof(N1=200.0), "damper", (0.6, 2.6), "damper.N0"),
    "bladed-disk": (bladed_disk(), "shroud", (500.0, 900.0), "shroud.N0"),
    "bladed-disk, separating": (bladed_disk(N1=400.0), "shroud", (500.0, 900.0), "shroud.mu"),
    "rubbing": (scene(RUB), "c0", (0.1, 0.4), "c0.kn"),
}


@pytest.mark.few(6)
@pytest.mark.parametrize("name", WORST)
def test_the_worst_of_a_response_is_that_of_a_dense_grid(name: str) -> None:
    here, contact, (low, high), _ = WORST[name]
    found = worst_wear(sweep(here, start=low, stop=high), contact)
    worst = found[0]
    grid = np.linspace(low, high, 100)
    works = [wear_at(here, f, contact).work.value for f in grid]
    assert worst.value >= max(works) * (1.0 - 1e-12)
    assert abs(worst.at - grid[int(np.argmax(works))]) <= 1.5 * (grid[1] - grid[0])
    assert wear_at(here, worst.at, contact).work.value == pytest.approx(worst.value, rel=1e-9)
    # Every maximum of the grid that competes is there.
    for i in range(1, 99):
        if works[i] > max(works[i - 1], works[i + 1]) and works[i] > 0.62 * worst.value:
            assert min(abs(one.at - grid[i]) for one in found) <= 2.0 * (grid[1] - grid[0])


@pytest.mark.parametrize("name", WORST)
def test_the_worst_moves_as_at_its_fixed_frequency(name: str) -> None:
    here, contact, (low, high), path = WORST[name]
    branch = sweep(here, start=low, stop=high)
    worst = worst_friction_work(branch, contact)
    slope = WearSensitivity(branch.balance, (path,)).at(worst.at, worst.solution).work(contact)
    assert slope.value == pytest.approx(worst.value, rel=1e-12)
    assert abs(slope.by_frequency) * (high - low) <= 1e-6 * worst.value
    step = 1e-4 * here.value(path)

    def at(move: float) -> float:
        moved = here.with_values({path: here.value(path) + move})
        return worst_friction_work(sweep(moved, start=low, stop=high), contact).value

    coarse, fine = (at(step) - at(-step)) / (2.0 * step), (at(0.5 * step) - at(-0.5 * step)) / step
    difference = (4.0 * fine - coarse) / 3.0
    scale = max(abs(difference), worst.value / here.value(path))
    assert abs(slope.gradient[0] - difference) <= 1e-6 * scale + 0.05 * abs(fine - coarse)


@pytest.mark.few(3)
@pytest.mark.parametrize(("seed", "contact", "key"), [(46, "c0", "N0"), (105, "c1", "kt"), (15, "c1", "kt")])
def test_the_worst_at_a_corner_moves_with_the_corner(seed: int, contact: str, key: str) -> None:
    """Where another contact changes its state the slope jumps over 0: one side at least is far off."""
    here, _, harmonics = random_scene(seed)
    path = f"{contact}.{key}"

    def worst_of(moved: Scene) -> tuple[WorstWear, Branch]:
        branch = sweep(moved, start=0.3, stop=3.0, harmonics=harmonics)
        assert branch.reached
        return worst_friction_work(branch, contact), branch

    worst, branch = worst_of(here)
    sensitivity = WearSensitivity(branch.balance, (path,))
    workspace = Workspace.of(branch.balance)
    sides = []
    for way in (-1.0, 1.0):
        at = worst.at * (1.0 + way * 1e-7)
        beside = workspace.solve_from(branch.balance.parameter.inside(at), worst.solution)
        assert beside.converged
        sides.append(sensitivity.at(at, beside.u).work(contact))
    exact = worst_slopes(sensitivity, worst, contact)
    assert sides[0].by_frequency * worst.at > 0.1 * worst.value
    assert sides[1].by_frequency * worst.at < -0.1 * worst.value
    value = here.value(path)
    step = 3e-5 * value
    high, low = (worst_of(here.with_values({path: value + way * step}))[0].value for way in (1.0, -1.0))
    difference = (high - low) / (2.0 * step)
    scale = max(abs(difference), worst.value / value)
    assert abs(exact.gradient[0] - difference) <= 5e-6 * scale
    assert max(abs(side.gradient[0] - difference) for side in sides) > 0.1 * scale


def test_slopes_of_a_smooth_worst_and_of_an_end_are_those_at_their_frequency() -> None:
    for stop in (900.0, 750.0):
        branch = sweep(bladed_disk(), start=700.0, stop=stop)
        worst = worst_friction_work(branch, "shroud")
        sensitivity = WearSensitivity(branch.balance, ("shroud.N0",))
        plain = sensitivity.at(worst.at, worst.solution).work("shroud")
        np.testing.assert_array_equal(worst_slopes(sensitivity, worst, "shroud").gradient, plain.gradient)
    gap = sweep(scene(GAP), start=0.1, stop=0.12, harmonics=3)
    least = worst_friction_work(gap, "c0")
    with pytest.raises(SettingError, match="least normal load"):
        worst_slopes(WearSensitivity(gap.balance), least, "c0", Measure.LEAST_LOAD)


def test_the_worst_at_an_end_of_the_range() -> None:
    worst = worst_friction_work(sweep(bladed_disk(), start=700.0, stop=750.0), "shroud")
    assert (worst.at, worst.interior) == (pytest.approx(750.0), False)


def test_the_other_measures_over_a_response() -> None:
    here = scene(RUB)
    branch = sweep(here, start=0.1, stop=0.4)
    grid = np.linspace(0.1, 0.4, 75)
    wears = [wear_at(here, f, "c0") for f in grid]
    least = worst_wear(branch, "c0", Measure.LEAST_LOAD)[0]
    loads = np.array([w.least_load.value for w in wears if w.least_load is not None])
    assert least.value <= loads.min() + 1e-12
    assert least.value == pytest.approx(loads.min(), rel=2e-2)
    travel = worst_wear(branch, "c0", Measure.SLIP_TRAVEL)[0]
    travels = np.array([w.travel.value for w in wears if w.travel is not None])
    assert travel.value >= travels.max() * (1.0 - 1e-12)
    assert travel.value == pytest.approx(travels.max(), rel=1e-2)


def test_the_work_of_a_contact_is_that_of_its_loop() -> None:
    """A slider to the ground takes out 4 μN (A − μN/kt) a period; exact motions know it to many digits."""
    scene = Scene.from_dict({
        "name": "one", "structure": {"kind": "lumped",
            "masses": {"x": 1.0}, "springs": [{"between": ["x", "ground"], "k": 1.0, "c": 0.1}],
        },
        "contacts": [
            {"name": "f", "law": "coulomb", "between": ["x", "ground"], "kt": 2.0, "mu": 0.5, "N0": 1.0}
        ],
        "excitation": [{"dof": "x", "amplitude": 1.0}], "observe": {"dof": "x", "band": [0.1, 0.3]},
    })  # fmt: skip
    for harmonics, exact, error in ((41, False, 1e-5), (161, True, 1e-11)):
        found = solve(scene, frequency_hz=0.175, harmonics=harmonics, exact=exact)
        (contact,) = found.contacts
        assert contact.work == pytest.approx(4.0 * 0.5 * (found.max_abs - 0.25), rel=error)
        if not exact:
            assert contact.work == pytest.approx(contact_wear(found)["f"].work.value, rel=1e-12)
