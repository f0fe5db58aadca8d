"""The best load for contacts that wear, against the best load that does not, and a fine grid of lives."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from solver import least_peak, load_scene
from solver.errors import SettingError
from stickslip.lab.wear_life.least_worn_peak import LeastWornPeak, WornStatus, least_worn_peak
from stickslip.lab.wear_life.life import wear_life
from stickslip.lab.wear_life.mission import Mission
from stickslip.lab.wear_life.wearing import WearLaw

SCENE, LOAD = load_scene("two-dof"), "damper.N0"
COEFFICIENT, AREA, HOURS = 1e-11, 2e-4, 3e-4
WEAR = WearLaw(COEFFICIENT, AREA, load_loss_per_depth=4e6)
GIVEN: dict[str, Any] = {"harmonics": 3}


def _best(low: float = 90.0, high: float = 300.0, **more: Any) -> LeastWornPeak:
    given = {**GIVEN, "looks": 3, **more}
    return least_worn_peak(SCENE, LOAD, low, high, Mission(given.pop("hours", HOURS)), WEAR, **given)


def test_at_the_end_of_life_the_load_is_what_is_best_without_wear() -> None:
    found, unworn = _best(110.0, 200.0), least_peak(SCENE, LOAD, 50.0, 300.0, harmonics=3)
    there = SCENE.with_values({LOAD: found.at})
    worn = wear_life(there, Mission(HOURS), WEAR, points=2, **GIVEN)
    assert found.reached
    assert found.worst == pytest.approx(unworn.peak, rel=1e-9)
    assert worn.loads[0, -1] == pytest.approx(unworn.at, rel=1e-5)


@pytest.mark.long
def test_over_the_whole_life_it_is_as_good_at_first_as_at_last() -> None:
    found = _best(from_hours=0.0)
    worn = wear_life(SCENE.with_values({LOAD: found.at}), Mission(HOURS), WEAR, points=2, **GIVEN)
    assert found.worst == pytest.approx(worn.amplitude.max(), rel=1e-9)
    assert worn.amplitude[0] == pytest.approx(worn.amplitude[-1], rel=1e-6)


@pytest.mark.long
def test_no_load_of_a_grid_is_better_whatever_the_coefficient_is() -> None:
    found = _best(factors=(0.6, 1.5))

    def worst(load: float) -> float:
        scene = SCENE.with_values({LOAD: load})
        return max(
            wear_life(
                scene, Mission(HOURS), replace(WEAR, coefficient=factor * COEFFICIENT), points=2, **GIVEN
            ).amplitude[-1]
            for factor in np.linspace(0.6, 1.5, 4)
        )

    assert worst(found.at) == pytest.approx(found.worst, rel=1e-6)
    assert all(worst(found.at * share) > found.worst for share in (0.97, 0.999, 1.001, 1.03))


def test_a_range_that_ends_too_early_says_so() -> None:
    assert _best(200.0, 300.0).status is WornStatus.AT_BOUND


@pytest.mark.long
def test_lives_that_do_not_last_are_no_answer() -> None:
    found = _best(hours=1.0)
    assert found.status is WornStatus.NO_RESPONSE
    assert np.isnan(found.at)


def test_a_search_that_is_stopped_has_the_best_so_far() -> None:
    found = _best(should_stop=lambda: True)
    assert found.status is WornStatus.STOPPED


@pytest.mark.parametrize(
    ("changes", "field"),
    [({"factors": (2.0, 1.0)}, "factors"), ({"from_hours": 2 * HOURS}, "from_hours"), ({"looks": 2}, "looks"),
     ({"low": 300.0}, "stop")],
)  # fmt: skip
def test_what_is_wrong_is_named(changes: dict[str, Any], field: str) -> None:
    with pytest.raises(SettingError) as error:
        _best(**changes)
    assert error.value.name == field
