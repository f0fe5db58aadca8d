"""The worst amplitude of contacts that wear, at the end of their life or over it: its local maxima in time.

A life is followed with its exact sensitivities (`stickslip.lab.wear_life`). A wear coefficient f times as
large is a clock that runs f times as fast, so that the worst over all factors between two is the largest
amplitude of one life between two instants. At a maximum over the time its derivative is that at a fixed time.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BeforeValidator, WithJsonSchema

from solver.results import units
from optim.criteria.criterion import Criterion, CriterionContext, CriterionRow, Form, Judged, Key
from optim.criteria.peak_criterion import COMPETES

if TYPE_CHECKING:
    from stickslip.lab.wear_life.mission import Mission
    from stickslip.lab.wear_life.wearing import WearLaw

_KEY = "worn"
_NEEDED = ("hours", "coefficient", "area")
_OF_LAW = ("coefficient", "area", "load_loss_per_depth", "stiffness_loss_per_depth")
_NUMBERS = ("hours", "frequency_hz", "from_hours", "least_factor", "largest_factor", "most")
_TOLERANCE = 1e-5  # of a step of the life, as `least_worn_peak` has it


def _table(value: object) -> object:
    """A table of the words; what they mean is looked at with the scene."""
    if isinstance(value, dict) and len(value) <= len(_OF_LAW) + len(_NUMBERS):
        return value
    raise ValueError(f"must be a table with {', '.join(_NEEDED)} and perhaps further words")


_NUMBER = {"type": "number", "minimum": 0}
_EACH = {"anyOf": [_NUMBER, {"type": "object", "additionalProperties": _NUMBER}]}
_SCHEMA = {
    "type": "object", "required": [*_NEEDED], "additionalProperties": False,
    "properties": dict.fromkeys(_NUMBERS, _NUMBER) | dict.fromkeys(_OF_LAW, _EACH),
}  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class WornLife:
    """A life of worn contacts, and from when on its amplitude counts."""

    mission: Annotated[Mission, "With the hours of the largest factor."]
    wear: WearLaw
    since: Annotated[float, "From when on [h], by the clock of the least factor."]
    most: Annotated[float | None, "Largest amplitude allowed [m]."]


def _rows(judged: Judged) -> list[CriterionRow]:
    """A row for every local maximum in time that competes; not a number where a life does not last."""
    from stickslip.lab.wear_life.life import course_of
    from stickslip.lab.wear_life.life_result import WearLifeStatus

    asked: WornLife | None = judged.limit(WORN)
    if asked is None:
        return []
    balance, end = judged.branch.balance, asked.mission.hours
    course = course_of(
        balance.scene, asked.mission, asked.wear, paths=judged.problem.paths if judged.gradients else (),
        tolerance=_TOLERANCE, harmonics=balance.n_harmonics,
    )  # fmt: skip
    course.follow()
    weight = judged.weight(WORN) * judged.case.weight
    if course.status is not WearLifeStatus.COMPLETED:
        what = f"worn peak after {units.quantity(end, 'h')}"
        return [judged.row(WORN, what, math.nan, None, bound=asked.most, weight=weight)]
    tops = course.maxima(asked.since, end)
    return [
        judged.row(
            WORN, f"worn peak, {_when(top.hours, asked)} at {units.hertz(top.motion.hertz)}", top.amplitude,
            top.gradient if judged.gradients else None, at_hz=top.motion.hertz, bound=asked.most,
            weight=weight,
        )
        for top in tops
        if top.amplitude >= COMPETES * tops[0].amplitude
    ]  # fmt: skip


def _when(hours: float, asked: WornLife) -> str:
    """Which maximum it is: of one design and of the next the same has the same name."""
    return "last" if hours >= asked.mission.hours else "first" if hours <= asked.since else "between"


def _read(asked: CriterionContext) -> WornLife:
    """The life, checked against the scene."""
    from optim.problem.checks import DesignError
    from optim.problem.checks import positive
    from solver.errors import SettingError
    from stickslip.lab.wear_life.least_worn_peak import checked_factors, checked_since
    from stickslip.lab.wear_life.life import course_of
    from stickslip.lab.wear_life.mission import Mission
    from stickslip.lab.wear_life.wearing import WearLaw

    given: Any = asked.values[_KEY]
    if not isinstance(given, Mapping) or not set(_NEEDED) <= set(given):
        raise DesignError(_KEY, given, f"must be a table with {', '.join(_NEEDED)}")
    for word in given:
        if word not in (*_NUMBERS, *_OF_LAW):
            known = ", ".join((*_NUMBERS, *_OF_LAW))
            raise DesignError((_KEY, word), given[word], f"is not known; there are {known}")
    try:
        low, high = checked_factors((given.get("least_factor", 1.0), given.get("largest_factor", 1.0)))
        hours, frequency = given["hours"], given.get("frequency_hz")
        since = checked_since(given.get("from_hours"), Mission(hours).hours)
        mission = Mission(hours * high, frequency)
        wear = WearLaw(**{word: given[word] for word in _OF_LAW if word in given})
        course_of(asked.scene, mission, wear, harmonics=1)
    except SettingError as error:
        below = error.issue.subject if error.issue.subject[:1] and error.issue.subject[0] in given else ()
        error.place = (_KEY, *below)
        raise
    most = positive((_KEY, "most"), given["most"]) if "most" in given else None
    return WornLife(mission=mission, wear=wear, since=since * low, most=most)


WORN = CRITERION = Criterion(
    name="worn peak",
    unit="m",
    help="The highest amplitude of contacts that [wear](wear.md#wear-over-life), at the end of their life or "
    "over it; minimised times its `weight`.",
    rows=_rows,
    weight="worn",
    needs=_KEY,
    keys=(
        Key(
            name=_KEY, annotation=Annotated[Any, BeforeValidator(_table), WithJsonSchema(_SCHEMA)],
            form=Form.NUMBERS_BY_WORD, flag="--worn", metavar="WORD=X", example="hours=20 and area=1e-4",
            examples=(
                {
                    "hours": 20, "coefficient": {"shroud": 1e-14}, "area": {"shroud": 1e-4},
                    "load_loss_per_depth": {"shroud": 1e6}, "largest_factor": 2, "most": 1e-4,
                },
            ),
            help="The life: `hours`, wear `coefficient` [m³/J], `area` [m²], and perhaps "
            "`load_loss_per_depth` [N/m], `stiffness_loss_per_depth` [N/m²], `frequency_hz`, `from_hours`, "
            "`least_factor`, `largest_factor` of the coefficient, `most` [m].",
            option_help="A life: hours=…, coefficient=…, area=…, perhaps load_loss_per_depth=…, most=…; "
            "repeatable.",
        ),
    ),
    read=_read,
)  # fmt: skip
