"""The greatest alternating stress at recovered rows over the band: half peak to peak of each.

A row of a recovery matrix is one more observed quantity of the same response, so its peaks, their gradients
and second derivatives are those of `optim.criteria.peak_criterion`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from optim.criteria.criterion import Criterion, CriterionContext, CriterionRow, Form, Judged, Key
from optim.criteria.key import number_or_table
from optim.criteria.peak_criterion import COMPETES, maxima
from solver.results.units import STRESS_UNITS

if TYPE_CHECKING:
    from solver.scene.materials import Haigh
    from solver.scene.scene import Scene
    from solver.scene.scene_records import Recovered

_KEY = "max_stress"


def of_row(recovered: Recovered) -> str:
    """Return the name a recovered quantity has in one sector: that of ``fillet@3`` is ``fillet``."""
    return recovered.name.partition("@")[0]


def stresses(scene: Scene) -> list[Recovered]:
    """Return the recovered quantities of a scene that are stresses."""
    return [one for one in scene.recovery if one.unit in STRESS_UNITS]


def without_stress(scene: Scene) -> str:
    """Return why a scene has no stress; empty if it has one."""
    return "" if stresses(scene) else f"needs a stress in `recovery`, in {', '.join(STRESS_UNITS)}"


def by_row(key: str, given: object, names: list[str], lacking: str) -> Mapping[str, float]:
    """Return a positive number for every row named; a single number is that of all.

    Parameters
    ----------
    key : what is read.
    given : a number or a table.
    names : the rows that may be named.
    lacking : why there is none.

    Raises
    ------
    DesignError
        What is wrong.
    """
    from optim.problem.checks import DesignError, positive_of_each

    if not names:
        raise DesignError(key, given, lacking)
    return positive_of_each(key, given, names, names, "rows of `recovery`")


def seen_by(
    judged: Judged, criterion: Criterion, rows: list[Recovered], measures: Mapping[str, str | Haigh]
) -> Iterator[tuple[Recovered, Judged]]:  # fmt: skip
    """Yield the rows that are limited, or all if the criterion is minimised, each with its own response."""
    from solver.continuation.branches.observation import observing

    bounds = judged.limit(criterion) or {}
    for one in rows:
        if judged.weight(criterion) > 0.0 or of_row(one) in bounds:
            branch = observing(judged.branch, one.name, measure=measures[one.name], peaks_alone=True)
            yield one, replace(judged, branch=branch)


def leading(rows: list[CriterionRow]) -> list[CriterionRow]:
    """Return the rows but those that are minimised alone and cannot lead within one step."""
    top = max((row.value for row in rows), default=0.0)
    return [row for row in rows if row.bound is not None or row.value >= COMPETES * top]


def _rows(judged: Judged) -> list[CriterionRow]:
    """A row for every peak of every stress that competes."""
    bounds = judged.limit(STRESS) or {}
    rows = stresses(judged.branch.balance.scene)
    measures = dict.fromkeys((one.name for one in rows), "half_peak_to_peak")
    weight = judged.weight(STRESS) * judged.case.weight
    found = [
        row
        for one, seen in seen_by(judged, STRESS, rows, measures)
        for row in maxima(
            seen, STRESS, f"stress of {one.name}", bound=bounds.get(of_row(one)), weight=weight,
            factor=STRESS_UNITS[one.unit],
        )
    ]  # fmt: skip
    return leading(found)


def _read(asked: CriterionContext) -> Any:
    names = [of_row(one) for one in stresses(asked.scene)]
    return by_row(_KEY, asked.values[_KEY], names, without_stress(asked.scene))


STRESS = CRITERION = Criterion(
    name="stress",
    unit="Pa",
    help="The greatest alternating stress, half peak to peak, of the [recovered rows](criteria.md) over the "
    "band of any case; minimised times its `weight`.",
    rows=_rows,
    weight="stress",
    keys=(
        Key(
            name=_KEY, annotation=number_or_table("Pa", "rows"), form=Form.NUMBER_OR_TABLE,
            flag="--max-stress", metavar="PA|ROW=PA", example="120e6 or fillet=120e6",
            examples=(120e6, {"fillet": 120e6}),
            help="Largest alternating stress [Pa], of every recovered stress or by row.",
            option_help="Largest alternating stress [Pa]; repeatable by row.",
        ),
    ),
    read=_read,
    lacking=without_stress,
)  # fmt: skip
