"""The friction work of a contact in a cycle, which wears it, and its wear rate: local maxima over the band.

The worst over a response is a maximum over the frequency, so its gradient is the one at that frequency
(envelope theorem), or that of a corner of the response. The wear rate is a coefficient times the friction
power: Archard's law in the form of energy, the worn volume is k times the friction work, k = K / (μ H) of
Archard's K and the hardness H. Fouvry, Liskiewicz, Kapsa, Hannel, Sauger, Wear 255 (2003) 287-298.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING

from optim.criteria.criterion import Criterion, CriterionContext, CriterionRow, Form, Judged, Key, of_sector
from optim.criteria.key import number_or_table
from solver.results import units

if TYPE_CHECKING:
    from optim.criteria.response_gradients import Sensitivity
    from optim.problem.variables import Real
    from solver.response.worst_wear import Measure, WorstWear
    from solver.scene.scene import Scene


_WORK = "max_friction_work"
Read = Mapping[str, tuple[float | None, float]]
"""Contact to its bound, if it has one, and to the factor on the measure."""


def _rows(judged: Judged, criterion: Criterion, measured: str) -> list[CriterionRow]:
    """Return a row for every local maximum of a measure that competes, of every contact asked for."""
    from solver.response.worst_wear import Measure, worst_slopes, worst_wear

    measure, each = Measure[measured], judged.limit(criterion) or {}
    weight = judged.weight(criterion) * judged.case.weight
    rows, sensitivity = [], judged.sensitivity
    if sensitivity is not None and not sensitivity.has_second:
        sensitivity = None
    for contact in judged.contacts(each):
        name, (bound, factor) = contact.name, each[of_sector(contact)]
        for worst in worst_wear(judged.branch, name, measure):
            slope = second = None
            if judged.wear is not None:
                slope = factor * worst_slopes(judged.wear, worst, name, measure).gradient
            if sensitivity is not None:
                second = partial(_times, factor, sensitivity, worst, name, measure)
            rows.append(
                judged.row(
                    criterion, f"{criterion.name} of {name} at {units.hertz(worst.at)}", factor * worst.value,
                    slope, at_hz=worst.at, bound=bound, weight=weight, second=second,
                )
            )  # fmt: skip
    return rows


def _times(factor: float, sensitivity: Sensitivity, worst: WorstWear, contact: str, measure: Measure) -> Real:
    from solver.response.worst_wear import worst_hessian

    return factor * worst_hessian(sensitivity.amplitudes, worst, contact, measure)


def _read_work(asked: CriterionContext) -> Read:
    return {name: (most, 1.0) for name, most in by_contact(_WORK, asked.values[_WORK], asked.scene).items()}


def by_contact(key: str, limits: object, scene: Scene) -> Mapping[str, float]:
    """Return a positive number of every contact named; a single one is that of every friction contact.

    Raises
    ------
    DesignError
        What is wrong with the value `limits` of the key.
    """
    from optim.problem.checks import positive_of_each

    rubbing = [contact.name for contact in scene.contacts if contact.RUBBING]
    return positive_of_each(key, limits, [contact.name for contact in scene.contacts], rubbing, "contacts")


FRICTION_WORK: Criterion = Criterion(
    name="friction work",
    unit="J",
    help="The [friction work](wear.md) of a contact in a cycle, at any frequency of the band.",
    rows=lambda judged: _rows(judged, FRICTION_WORK, "FRICTION_WORK"),
    keys=(
        Key(
            name=_WORK, annotation=number_or_table("J", "contacts"), form=Form.NUMBER_OR_TABLE,
            flag="--max-work", metavar="J|CONTACT=J", example="0.02 or shroud=0.02",
            examples=(0.02, {"shroud": 0.02}),
            help="Largest friction work in a cycle [J], of every friction contact or by contact (wear).",
            option_help="Largest friction work in a cycle [J]; repeatable by contact.",
        ),
    ),
    read=_read_work,
)  # fmt: skip


_RATE, _COEFFICIENT = "max_wear_rate", "wear_coefficient"


def _read_wear(asked: CriterionContext) -> Read:
    """The limit, if there is one, and the coefficient of every contact named."""
    from optim.problem.checks import DesignError

    if _COEFFICIENT not in asked.values:
        raise DesignError(_COEFFICIENT, None, f"must be given with `{_RATE}` [m³/J]")
    each = by_contact(_COEFFICIENT, asked.values[_COEFFICIENT], asked.scene)
    if _RATE not in asked.values:
        return {name: (None, coefficient) for name, coefficient in each.items()}
    bounds = by_contact(_RATE, asked.values[_RATE], asked.scene)
    for name in bounds:
        if name not in each:
            raise DesignError(_COEFFICIENT, asked.values[_COEFFICIENT], f"must have one of {name!r} too")
    return {name: (bound, each[name]) for name, bound in bounds.items()}


WEAR_RATE: Criterion = Criterion(
    name="wear rate",
    unit="m³/s",
    help="The volume that wears off a contact in a second, a coefficient times its friction power, at any "
    "frequency of the band; minimised times its `weight`.",
    rows=lambda judged: _rows(judged, WEAR_RATE, "FRICTION_POWER"),
    weight="wear",
    needs=_COEFFICIENT,
    keys=(
        Key(
            name=_RATE, annotation=number_or_table("m³/s", "contacts"), form=Form.NUMBER_OR_TABLE,
            flag="--max-wear-rate", metavar="R|CONTACT=R", example="1e-15 or shroud=1e-15",
            examples=(1e-15, {"shroud": 1e-15}), beside=_COEFFICIENT,
            help="Largest wear rate [m³/s], of every friction contact or by contact.",
            option_help="Largest wear rate [m³/s]; repeatable by contact.",
        ),
        Key(
            name=_COEFFICIENT, annotation=number_or_table("m³/J", "contacts"), form=Form.NUMBER_OR_TABLE,
            flag="--wear-coefficient", metavar="K|CONTACT=K", example="1e-13 or shroud=1e-13",
            examples=(1e-13, {"shroud": 1e-13}), beside=_RATE,
            help="Volume worn off by a unit of friction work [m³/J], of every contact limited or by contact.",
            option_help="Volume worn off by friction work [m³/J]; repeatable by contact.",
        ),
    ),
    read=_read_wear,
)  # fmt: skip

CRITERION = (FRICTION_WORK, WEAR_RATE)
