"""What of the stress allowed is used: the alternating one over that of the Haigh diagram at its mean.

The mean is the static stress of the row with the middle of the motion's range. Where it moves with the
frequency the peak of the utilisation is not that of the stress; it is looked for as its own, with exact
gradient and second derivatives (`solver.balance.kernels.haigh`). Where the mean leaves nothing, rows count
on: what is minimised alone is then limited to what has an end, and results say inf.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from optim.criteria.criterion import Criterion, CriterionContext, CriterionRow, Form, Judged, Key
from optim.criteria.key import number_or_table
from optim.criteria.peak import maxima
from optim.criteria.stress import by_row, leading, of_row, seen_by

if TYPE_CHECKING:
    from solver.scene.parts import Recovered
    from solver.scene.scene import Scene

_KEY = "min_margin"


def _judged(scene: Scene) -> list[Recovered]:
    return [one for one in scene.recovery if one.material is not None]


def _lacking(scene: Scene) -> str:
    return "" if _judged(scene) else "needs a stress in `recovery` with a `material`"


def _rows(judged: Judged) -> list[CriterionRow]:
    """A row for every peak of every utilisation that competes."""
    # Loaded here: help of a command, which lists criteria, needs no numbers.
    from solver.scene.materials import ENDLESS, haigh_of

    bounds, scene = judged.limit(UTILISATION) or {}, judged.branch.balance.scene
    rows = _judged(scene)
    measures = {one.name: haigh_of(scene, one.name) for one in rows}
    weight = judged.weight(UTILISATION) * judged.case.weight
    found = [
        row
        for one, seen in seen_by(judged, UTILISATION, rows, measures)
        for row in maxima(
            seen, UTILISATION, f"utilisation of {one.name}", weight=weight,
            bound=bounds.get(of_row(one), ENDLESS),
        )
    ]  # fmt: skip
    return leading(found)


def _read(asked: CriterionContext) -> Any:
    from solver.scene.materials import counted

    names = [of_row(one) for one in _judged(asked.scene)]
    margins = by_row(_KEY, asked.values[_KEY], names, _lacking(asked.scene))
    return {name: counted(1.0 / margin) for name, margin in margins.items()}


def _told(value: float) -> float:
    from solver.scene.materials import utilisation_of

    return utilisation_of(value)


UTILISATION = CRITERION = Criterion(
    name="utilisation",
    unit="1",
    help="The alternating stress over what the Haigh diagram of its material allows at its mean, greatest of "
    "the [recovered rows](criteria.md) over the band of any case; its inverse is the margin.",
    rows=_rows,
    weight="utilisation",
    keys=(
        Key(
            name=_KEY, annotation=number_or_table("1", "rows"), form=Form.NUMBER_OR_TABLE,
            flag="--min-margin", metavar="M|ROW=M", example="1.5 or fillet=1.5",
            examples=(1.5, {"fillet": 1.5}),
            help="Least margin, of every recovered stress with a material or by row: how many times the "
            "alternating stress may be as large.",
            option_help="Least margin of the stresses; repeatable by row.",
        ),
    ),
    read=_read,
    lacking=_lacking,
    told=_told,
    endless="the mean stress alone reaches the strength",
)  # fmt: skip
