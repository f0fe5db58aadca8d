"""The load that is best for a life, by the keys of the study `wear`."""

from typing import Any

import pytest
from service_helpers import Shipped

import solver
from service.errors import InvalidRequestError
from service.jobs.strict_json import validated
from service.jobs.study import Watch, resolve
from stickslip.lab.wear_life.study import Wear

BODY: dict[str, Any] = {
    "scene": "two-dof", "hours": 3e-4, "coefficient": {"damper": 1e-11}, "area": {"damper": 2e-4},
    "load_loss_per_depth": {"damper": 4e6}, "harmonics": 1, "points": 3, "tolerance": 1e-4,
}  # fmt: skip
CHOICE: dict[str, Any] = {"parameter": "damper.N0", "from": 120, "to": 160, "looks": 3, "factors": [0.5, 1.0]}


@pytest.mark.parametrize(
    ("change", "pointers"),
    [
        ({"from": 130}, ["/from"]),
        ({"from_hours": 0}, ["/from_hours"]),
        ({"parameter": "damper.N0"}, ["/parameter"]),
        ({**CHOICE, "from": 200}, ["/parameter"]),
        ({**CHOICE, "parameter": "damper.N9"}, ["/from", "/to"]),
        ({**CHOICE, "from": -1}, ["/from"]),
        ({**CHOICE, "factors": [1.0]}, ["/factors"]),
    ],
)
def test_what_is_wrong_with_a_choice_is_told_where_it_is(change: dict[str, Any], pointers: list[str]) -> None:
    with pytest.raises(InvalidRequestError) as caught:
        resolve(validated(Wear, {**BODY, **change}), Shipped())
    assert [issue.pointer for issue in caught.value.issues] == pointers


@pytest.mark.long
def test_the_life_is_that_of_the_best_load() -> None:
    spec = resolve(validated(Wear, {**BODY, **CHOICE}), Shipped()).spec
    answer = Wear.compute(*Wear.asked(spec), Watch())
    wear = solver.WearLaw({"damper": 1e-11}, {"damper": 2e-4}, {"damper": 4e6})
    best = solver.least_worn_peak(
        solver.load_scene("two-dof"), "damper.N0", 120, 160, solver.Mission(3e-4), wear, looks=3,
        factors=(0.5, 1.0), harmonics=1,
    )  # fmt: skip
    assert answer.reached
    assert answer.json["chosen"]["at"] == pytest.approx(best.at, rel=1e-9)
    assert answer.json["loads"][0][0] == pytest.approx(best.at, rel=1e-12)
    # Of the life with the coefficient as given the worst is no more than over both factors.
    assert answer.json["amplitude"][-1] <= best.worst * (1.0 + 1e-4)
