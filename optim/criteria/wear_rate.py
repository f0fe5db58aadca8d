"""The wear rate of a contact: a coefficient times the friction power, its local maxima over the band.

Archard's law in the form of energy: the worn volume is k times the friction work, k = K / (μ H) of Archard's
K and the hardness H. Fouvry, Liskiewicz, Kapsa, Hannel, Sauger, Wear 255 (2003) 287-298.
"""

from __future__ import annotations

from collections.abc import Mapping

from optim.criteria.criterion import Criterion, CriterionContext, CriterionRow, Form, Judged, Key
from optim.criteria.friction_work import by_contact, worst_rows
from optim.criteria.key import number_or_table

_RATE, _COEFFICIENT = "max_wear_rate", "wear_coefficient"


def _rows(judged: Judged) -> list[CriterionRow]:
    """A row for every local maximum that competes, of every contact that is limited."""
    from solver.response.worst_wear import Measure

    weight = judged.weight(WEAR_RATE) * judged.case.weight
    each = judged.limit(WEAR_RATE) or {}
    return worst_rows(judged, WEAR_RATE, Measure.FRICTION_POWER, each, weight)


def _read(asked: CriterionContext) -> Mapping[str, tuple[float | None, float]]:
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


WEAR_RATE = CRITERION = Criterion(
    name="wear rate",
    unit="m³/s",
    help="The volume that wears off a contact in a second, a coefficient times its friction power, at any "
    "frequency of the band; minimised times its `weight`.",
    rows=_rows,
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
    read=_read,
)  # fmt: skip
