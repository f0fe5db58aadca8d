"""The least normal load of a contact in a cycle, which must not fall to 0 where it must not separate.

Of a given load it is N0 − |N1| at every frequency; of one that moves with the parts the least over the band,
a minimum over the frequency, whose gradient is the one at that frequency (envelope theorem).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from optim.criteria.criterion import Criterion, CriterionContext, CriterionRow, Form, Judged, Key
from optim.criteria.key import Name
from solver.results import units

if TYPE_CHECKING:
    from solver.scene.scene import AnyContact, Scene

NEVER_SEPARATES = "never-separates"
_KEY = "contact_states"


def _rows(judged: Judged) -> list[CriterionRow]:
    return [row for one in judged.contacts(judged.limit(SEPARATION) or ()) for row in _of(judged, one)]


def _of(judged: Judged, contact: AnyContact) -> list[CriterionRow]:
    import numpy as np

    from solver.response.worst_wear import Measure, worst_slopes, worst_wear

    what = f"least load of {contact.name}"
    if contact.load is not None and contact.load_is_given:
        slope = None
        if judged.gradients:
            slope = np.array([_load_slope(contact, path) for path in judged.problem.paths])
        return [judged.row(SEPARATION, what, contact.load.least, slope, bound=0.0)]
    least = Measure.LEAST_LOAD
    return [
        judged.row(
            SEPARATION, f"{what} at {units.hertz(worst.at)}", worst.value,
            None
            if judged.wear is None
            else worst_slopes(judged.wear, worst, contact.name, least).gradient,
            at_hz=worst.at, bound=0.0,
        )
        for worst in worst_wear(judged.branch, contact.name, least)
    ]  # fmt: skip


def _load_slope(contact: AnyContact, path: str) -> float:
    """Return the derivative of the least load of a given one by a parameter."""
    owner, _, key = path.rpartition(".")
    return contact.least_load_slope(key) if owner in (contact.name, contact.group) else 0.0


def _read(asked: CriterionContext) -> tuple[str, ...]:
    """The contacts that must never separate."""
    from optim.problem.checks import DesignError

    states = asked.values[_KEY]
    if not isinstance(states, Mapping):
        raise DesignError(_KEY, states, f'must be a table such as {{"damper": "{NEVER_SEPARATES}"}}')
    names = [contact.name for contact in asked.scene.contacts if contact.load is not None]
    for name, state in states.items():
        if name not in names:
            wanted = f"must name friction contacts: {', '.join(names)}"
            raise DesignError(_KEY, name, wanted, place=(_KEY, name))
        if state != NEVER_SEPARATES:
            raise DesignError((_KEY, name), state, f"must be {NEVER_SEPARATES}")
    return tuple(states)


def _load(scene: Scene) -> float:
    """The largest normal load of the scene."""
    loads = [contact.load.mean for contact in scene.contacts if contact.load is not None]
    return max((load for load in loads if load > 0.0), default=1.0)


SEPARATION = CRITERION = Criterion(
    name="separation",
    unit="N",
    help="The least normal load of a contact in a cycle, at any frequency of the band; rows have its "
    "negative.",
    rows=_rows,
    smaller_is_better=False,
    keys=(
        Key(
            name=_KEY, annotation=Annotated[dict[Name, Literal["never-separates"]], Field(max_length=1000)],
            form=Form.NAMES, flag="--never-separates", metavar="CONTACT", word=NEVER_SEPARATES,
            examples=({"shroud": NEVER_SEPARATES},),
            help="What a contact must never do: contact to `never-separates`.",
            option_help="A contact that must stay closed; repeatable.",
        ),
    ),
    read=_read,
    scale=_load,
)  # fmt: skip
