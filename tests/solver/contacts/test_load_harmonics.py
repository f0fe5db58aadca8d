"""Normal loads of any harmonics: against the march, differences, the whole annulus, and the names N0, N1."""

import math
from typing import Any

import jsonschema
import numpy as np
import pytest
from each import each
from law_cases import COULOMB_CIRCLE
from load_scenes import fourier_load, loaded, random_loads

import optim
import solver
from solver import Scene, march, solve
from solver.balance.balance import build
from solver.balance.simplifications import Effects
from solver.balance.workspace import Workspace
from solver.errors import SceneError, SettingError
from solver.scene.json_schema import scene_schema
from solver.sensitivity.gradient import Sensitivities

ALL = Effects(even_harmonics=True)
LOAD: list[Any] = [
    8.0, {"order": 1, "amplitude": 3.0, "phase": 0.2}, {"order": 2, "amplitude": 4.0},
    {"order": 3, "amplitude": -2.0, "phase": 1.1},
]  # fmt: skip


# Scenes


def test_a_list_of_mean_and_first_harmonic_is_what_their_names_say() -> None:
    by_list = loaded(LOAD[:2])
    raw = by_list.to_dict()
    raw["contacts"][0] |= {"N0": 8.0, "N1": 3.0, "N1_phase": 0.2}
    raw["contacts"][0].pop("load", None)
    assert Scene.from_dict(raw) == by_list


def test_a_load_comes_back_from_its_dictionary_and_its_row() -> None:
    found = loaded(LOAD)
    assert Scene.from_dict(found.to_dict()) == found
    (contact,) = found.contacts
    row = build(found).system.contacts[0]
    assert contact.with_numbers(row) == contact


def test_higher_harmonics_may_stand_beside_a_tied_amplitude() -> None:
    raw = loaded(LOAD[:1]).to_dict()
    raw["contacts"][0] |= {"N1_ratio": 0.5, "load": [{"order": 4, "amplitude": 1.0}]}
    found = Scene.from_dict(raw).with_values({"c.N0": 20.0})
    assert found.value("c.N1") == 10.0
    assert found.value("c.N4") == 1.0
    assert found.contacts[0].load is not None
    assert found.contacts[0].load.orders == (1, 4)


def test_every_harmonic_is_a_path() -> None:
    found = loaded(LOAD)
    assert {"c.N2", "c.N2_phase", "c.N3", "c.N3_phase"} <= set(found.parameter_paths())
    moved = found.with_values({"c.N3": 5.0, "c.N2_phase": 0.4})
    assert [moved.value(path) for path in ("c.N3", "c.N3_phase", "c.N2_phase")] == [5.0, 1.1, 0.4]
    with pytest.raises(SettingError, match="must be one of"):
        found.value("c.N9")


@each(
    ("load", "message"),
    [
        ([8.0, 5.0], r"`load` must have its mean first and then tables, got 5\.0"),
        ([8.0, {"order": 3, "amplitude": 1.0}, {"order": 3, "amplitude": 1.0}], "order 3 twice"),
        ([8.0, {"order": 0, "amplitude": 1.0}], r"`order` must be >= 1, got 0"),
        ([8.0, {"order": 3, "amplitude": "a"}], r"`amplitude` must be a number, got 'a'"),
        ([8.0, {"order": 3}], "`amplitude` is missing: a harmonic of a load needs it"),
        ([8.0, {"order": 3, "amplitude": 1.0, "phse": 1.0}], "`phse` = 1.0 is not a key of a harmonic"),
        ([{"order": 3, "amplitude": 1.0}], "`N0` is missing"),
        ([-8.0], r"`N0` must be >= 0, got -8"),
        ("8", "`load` must be a list"),
    ],
)  # fmt: skip
def test_a_bad_list_is_refused(load: Any, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        loaded(load)


def test_a_number_given_twice_is_refused() -> None:
    with pytest.raises(SceneError, match=r"has what `N0` says"):
        loaded(LOAD, N0=3.0)
    with pytest.raises(SceneError, match=r"has what `N1_ratio` says"):
        loaded(LOAD, N1_ratio=0.3)


def test_the_schema_takes_what_a_scene_takes() -> None:
    schema = jsonschema.Draft202012Validator(scene_schema())
    raw = loaded(LOAD).to_dict()
    assert schema.is_valid(raw)
    (contact,) = raw["contacts"]
    without = {key: value for key, value in contact.items() if key not in ("N0", "N1", "N1_phase")}
    for load, good in ((LOAD, True), (LOAD[1:], False), ([8.0, 5.0], False), ([8.0, {"order": 0}], False)):
        assert schema.is_valid(raw | {"contacts": [without | {"load": load}]}) == good, load


# Answers


@pytest.mark.few(10)
@pytest.mark.parametrize("seed", range(60))
def test_the_answer_is_that_of_the_march(seed: int) -> None:
    scene, hz = random_loads(seed)
    found, marched = solve(scene, frequency_hz=hz, harmonics=61), march(scene, frequency_hz=hz)
    assert found.converged
    assert found.half_peak_to_peak == pytest.approx(marched.half_peak_to_peak, rel=1e-5)


@pytest.mark.parametrize("law", ["coulomb", "box"])
def test_a_load_of_even_harmonics_keeps_the_response_half_wave_symmetric(law: str) -> None:
    scene = loaded([6.0, {"order": 2, "amplitude": 4.0, "phase": 0.3}, {"order": 4, "amplitude": 5.0}], law)
    balance = build(scene, harmonics=7)
    assert balance.system.ks.tolist() == [1, 3, 5, 7]
    few_of, all_of = (
        solve(scene, frequency_hz=1.3, harmonics=7, effects=effects) for effects in (Effects(), ALL)
    )
    assert few_of.max_abs == pytest.approx(all_of.max_abs, rel=1e-9)


def test_the_harmonics_of_a_load_are_kept() -> None:
    assert set(build(loaded([6.0, {"order": 9, "amplitude": 1.0}]), harmonics=3).system.ks) >= {0, 8, 9, 10}
    still = loaded([6.0, {"order": 7, "amplitude": 0.0}])
    assert {7} <= set(build(still, "c.N7", harmonics=3, frequency_hz=1.0).system.ks)


@pytest.mark.parametrize("pattern", ["travelling", "standing"])
def test_one_sector_answers_as_the_whole_annulus(pattern: str) -> None:
    raw = solver.load_scene("bladed-disk").to_dict()
    raw["contacts"][1] |= {"load": [{"order": 2, "amplitude": 120.0, "phase": 0.4}]}
    raw["excitation"]["pattern"] = pattern
    raw["excitation"]["engine_order"] = 2 if pattern == "travelling" else 1
    disk = Scene.from_dict(raw)
    here = solve(disk, frequency_hz=757.0, harmonics=3)
    there = solve(
        disk, frequency_hz=757.0, harmonics=3, effects=Effects(every_sector=True, even_harmonics=True)
    )
    assert here.max_abs == pytest.approx(there.max_abs, rel=1e-7)


# Derivatives


@pytest.mark.few(8)
@pytest.mark.parametrize("seed", range(30))
def test_first_and_second_derivatives_are_those_of_differences(seed: int) -> None:
    """By mean, every amplitude and every phase, stuck, slipping and open."""
    scene, hz = random_loads(seed)
    assert scene.contacts[0].load is not None
    orders = scene.contacts[0].load.orders
    paths = ("c.N0", *(f"c.N{k}" for k in orders), *(f"c.N{k}_phase" for k in orders))

    def slopes(there: Scene, guess: np.ndarray | None) -> tuple[Sensitivities, np.ndarray]:
        balance = build(there, harmonics=9, effects=ALL)
        found = Workspace.of(balance).solve(2.0 * math.pi * hz, guess)
        assert found.converged
        return Sensitivities(balance, paths), found.u

    here, u = slopes(scene, None)
    gradient, hessian = here.gradient(u, hz), here.hessian(u, hz)
    # A circular limit is integrated by collocation: its derivatives are those of the exact law.
    tolerance = 1e-4 if scene.contacts[0].kernel == COULOMB_CIRCLE else 1e-7
    for i, path in enumerate(paths):
        size = abs(scene.value(path)) or 1.0
        errors = []
        for step in (1e-3 * size, 1e-4 * size, 1e-5 * size):
            ends = []
            for way in (step, -step):
                moved, solution = slopes(scene.with_values({path: scene.value(path) + way}), u)
                ends.append(moved.gradient(solution, hz))
            first = (ends[0].value - ends[1].value) / (2.0 * step) - gradient.by_parameters[i]
            second = (ends[0].by_parameters - ends[1].by_parameters) / (2.0 * step) - hessian.hessian[i]
            scale = max(gradient.value, float(np.abs(hessian.hessian * size).max()))
            errors.append((abs(first) * size / gradient.value, float(np.abs(second).max()) * size / scale))
        assert min(first for first, _ in errors) < tolerance, path
        assert min(second for _, second in errors) < tolerance, path


@pytest.mark.parametrize("order", [2, 4])
@pytest.mark.parametrize("law", ["coulomb", "box"])
def test_an_even_harmonic_that_is_0_has_a_slope(law: str, order: int) -> None:
    """The response stays half-wave symmetric, and changes."""
    scene = loaded([8.0, {"order": order, "amplitude": 0.0, "phase": 0.4}], law)
    path = f"c.N{order}"

    def at(amplitude: float) -> float:
        return solve(scene.with_values({path: amplitude}), frequency_hz=1.0, harmonics=7).max_abs

    balance = build(scene, harmonics=7)
    found = Workspace.of(balance).solve(2.0 * math.pi)
    slope = Sensitivities(balance, (path,)).gradient(found.u, 1.0).by_parameters[0]
    difference = (at(1e-3) - at(-1e-3)) / 2e-3
    assert abs(difference) > 1e-4
    assert slope == pytest.approx(difference, abs=1e-5 * at(0.0))


@pytest.mark.parametrize("path", ["c.N3", "c.N3_phase", "c.N5"])
def test_a_branch_in_a_coefficient_passes_through_the_answers(path: str) -> None:
    scene = loaded([*LOAD, {"order": 5, "amplitude": 0.0}])
    branch = solver.sweep(scene, path, -1.0, 6.0, frequency_hz=1.3, harmonics=9)
    assert branch.reached
    for i in range(0, branch.values.size, 5):
        value = float(branch.values[i])
        there = solve(scene.with_values({path: value}), frequency_hz=1.3, harmonics=9)
        assert branch.amplitude[i] == pytest.approx(there.max_abs, rel=1e-6), value


def test_a_design_takes_a_coefficient() -> None:
    """The best amplitude of a harmonic is not beaten by its neighbours."""
    scene = loaded(LOAD)
    found = optim.design(scene, variables={"c.N2": (0.0, 8.0)}, harmonics=5)
    best = found.optimum["c.N2"]
    heights = []
    for value in (best, max(best - 0.3, 0.0), min(best + 0.3, 8.0)):
        peak = solver.sweep(scene.with_values({"c.N2": value}), harmonics=5).peak
        assert peak is not None
        heights.append(peak.value)
    assert heights[0] <= min(heights) * (1.0 + 1e-6)


# What is known of a load


@pytest.mark.parametrize("seed", range(20))
def test_the_least_load_and_its_slopes(seed: int) -> None:
    scene = loaded(fourier_load(np.random.default_rng(seed), 10.0))
    (contact,) = scene.contacts
    load = contact.load
    assert load is not None
    tau = np.linspace(0.0, 2.0 * np.pi, 20_001)
    assert load.least == pytest.approx(min(map(load.at, tau)), abs=1e-5)
    for key in contact.parameters:
        if key.startswith("N") and key != "N1_ratio":
            ends = [scene.with_values({f"c.{key}": contact.value_of(key) + h}) for h in (1e-5, -1e-5)]
            up, down = (end.contacts[0].load for end in ends)
            assert up is not None
            assert down is not None
            # Of several equal minima either may be taken: a corner, with a slope between those of its sides.
            sides = ((up.least - load.least) / 1e-5, (load.least - down.least) / 1e-5)
            assert min(sides) - 1e-3 <= contact.least_load_slope(key) <= max(sides) + 1e-3, key


def test_the_wear_s_least_load_is_that_of_the_load() -> None:
    scene = loaded(LOAD)
    least = solver.contact_wear(solve(scene, frequency_hz=1.3, harmonics=3))["c"].least_load
    assert least is not None
    assert scene.contacts[0].load is not None
    assert least.value == pytest.approx(scene.contacts[0].load.least, rel=1e-10)
