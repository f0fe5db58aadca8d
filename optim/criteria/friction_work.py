"""The friction work of a contact in a cycle, which wears it: its local maxima over the band.

The worst over a response is a maximum over the frequency, so its gradient is the one at that frequency
(envelope theorem), or that of a corner of the response.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING

from optim.criteria.criterion import Criterion, CriterionContext, CriterionRow, Form, Judged, Key, of_sector
from optim.criteria.key import number_or_table

if TYPE_CHECKING:
    from optim.criteria.response_gradients import Sensitivity
    from optim.problem.variables import Real
    from solver.response.worst_wear import Measure, WorstWear
    from solver.scene.scene import Scene

_KEY = "max_friction_work"


def _rows(judged: Judged) -> list[CriterionRow]:
    """A row for every local maximum that competes, of every contact that is limited."""
    from solver.response.worst_wear import Measure, worst_slopes, worst_wear

    bounds = judged.limit(FRICTION_WORK) or {}
    return [
        judged.row(
            FRICTION_WORK, f"friction work of {contact.name} at {worst.at:.6g} Hz", worst.value,
            None if judged.wear is None else worst_slopes(judged.wear, worst, contact.name).gradient,
            at_hz=worst.at, bound=bounds[of_sector(contact)],
            second=second_of(judged, worst, contact.name, Measure.FRICTION_WORK),
        )
        for contact in judged.contacts(bounds)
        for worst in worst_wear(judged.branch, contact.name, Measure.FRICTION_WORK)
    ]  # fmt: skip


def second_of(
    judged: Judged, worst: WorstWear, contact: str, measure: Measure, factor: float = 1.0
) -> Callable[[], Real] | None:
    """Return what computes the second derivatives of a worst work or power, times `factor`, if there are."""
    if judged.sensitivity is None or not judged.sensitivity.has_second:
        return None
    return partial(_times, factor, judged.sensitivity, worst, contact, measure)


def _times(factor: float, sensitivity: Sensitivity, worst: WorstWear, contact: str, measure: Measure) -> Real:
    from solver.response.worst_wear import worst_hessian

    return factor * worst_hessian(sensitivity.amplitudes, worst, contact, measure)


def _read(asked: CriterionContext) -> Mapping[str, float]:
    return by_contact(_KEY, asked.values[_KEY], asked.scene)


def by_contact(key: str, limits: object, scene: Scene) -> Mapping[str, float]:
    """Return a positive number of every contact named; a single one is that of every friction contact.

    Raises
    ------
    DesignError
        What is wrong with the value `limits` of the key.
    """
    from optim.problem.numbers import positive_of_each

    rubbing = [contact.name for contact in scene.contacts if contact.RUBBING]
    return positive_of_each(key, limits, [contact.name for contact in scene.contacts], rubbing, "contacts")


FRICTION_WORK = CRITERION = Criterion(
    name="friction work",
    unit="J",
    help="The [friction work](wear.md) of a contact in a cycle, at any frequency of the band.",
    rows=_rows,
    keys=(
        Key(
            name=_KEY, annotation=number_or_table("J", "contacts"), form=Form.NUMBER_OR_TABLE,
            flag="--max-work", metavar="J|CONTACT=J", example="0.02 or shroud=0.02",
            examples=(0.02, {"shroud": 0.02}),
            help="Largest friction work in a cycle [J], of every friction contact or by contact (wear).",
            option_help="Largest friction work in a cycle [J]; repeatable by contact.",
        ),
    ),
    read=_read,
)  # fmt: skip
