"""The friction work of a contact in a cycle, which wears it: its local maxima over the band.

The worst over a response is a maximum over the frequency, so its gradient is the one at that frequency
(envelope theorem), or that of a corner of the response.
"""

from __future__ import annotations

from collections.abc import Mapping
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
    from solver.response.worst_wear import Measure

    bounds = judged.limit(FRICTION_WORK) or {}
    each = {name: (bound, 1.0) for name, bound in bounds.items()}
    return worst_rows(judged, FRICTION_WORK, Measure.FRICTION_WORK, each)


def worst_rows(
    judged: Judged, criterion: Criterion, measure: Measure,
    each: Mapping[str, tuple[float | None, float]], weight: float | None = None,
) -> list[CriterionRow]:  # fmt: skip
    """Return a row for every local maximum of a measure of contacts that competes.

    Parameters
    ----------
    each : contact to its bound and to the factor on the measure.
    """
    from solver.response.worst_wear import worst_slopes, worst_wear

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
                    criterion, f"{criterion.name} of {name} at {worst.at:.6g} Hz", factor * worst.value,
                    slope, at_hz=worst.at, bound=bound, weight=weight, second=second,
                )
            )  # fmt: skip
    return rows


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
    from optim.problem.checks import positive_of_each

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
