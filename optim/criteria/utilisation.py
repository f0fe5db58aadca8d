"""What of the stress allowed is used: the alternating one over that of the Haigh diagram at its mean.

The mean is the static stress of the row with the middle of the motion's range. Where it moves with the
frequency the peak of the utilisation is not that of the stress; it is looked for as its own, with exact
gradient and second derivatives (`solver.balance.kernels.haigh`). Where the mean depends on the history, the
worst that stuck contacts may hold has a row of its own (`solver.response.worst_mean`). Where the mean leaves
nothing, rows count on: what is minimised alone is then limited to what has an end, and results say inf.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from optim.criteria.criterion import Criterion, CriterionContext, CriterionRow, Form, Judged, Key
from optim.criteria.key import number_or_table
from optim.criteria.peak_criterion import maxima
from optim.criteria.stress import by_row, leading, of_row, seen_by

if TYPE_CHECKING:
    from solver.continuation.branch import Peak
    from solver.scene.scene import Scene
    from solver.scene.scene_records import Recovered

_KEY = "min_margin"


def _judged(scene: Scene) -> list[Recovered]:
    return [one for one in scene.recovery if one.material is not None]


def _lacking(scene: Scene) -> str:
    return "" if _judged(scene) else "needs a stress in `recovery` with a `material`"


def _rows(judged: Judged) -> list[CriterionRow]:
    """A row for every peak of every utilisation that competes."""
    # Loaded here: help of a command, which lists criteria, needs no numbers.
    from solver.response.worst_mean import used_most
    from solver.scene.materials import ENDLESS, haigh_of

    bounds, scene = judged.limit(UTILISATION) or {}, judged.branch.balance.scene
    rows = _judged(scene)
    measures = {one.name: haigh_of(scene, one.name) for one in rows}
    weight = judged.weight(UTILISATION) * judged.case.weight
    found = list[CriterionRow]()
    for one, seen in seen_by(judged, UTILISATION, rows, measures):
        what, bound = f"utilisation of {one.name}", bounds.get(of_row(one), ENDLESS)
        most = used_most(seen.branch)
        these = maxima(seen, UTILISATION, what, weight=weight, bound=bound)
        if most.worst is not None:
            these.append(_worst(seen, most.worst, most.free, what, bound, weight))
        found += [replace(row, flags=most.flags) for row in these]
    return leading(found)


def _worst(
    seen: Judged, peak: Peak, free: frozenset[int], what: str, bound: float, weight: float
) -> CriterionRow:  # fmt: skip
    """Return the row of the worst mean that stuck contacts may hold."""
    from solver.response.worst_mean import WorstMeanSlopes
    from solver.sensitivity.nonsmooth import peak_gradient

    by_paths = None
    if seen.gradients:
        slopes = WorstMeanSlopes(seen.branch.balance, seen.problem.paths, free)
        by_paths = peak_gradient(slopes, peak).gradient
    return seen.row(
        UTILISATION, f"{what} at {peak.at:.6g} Hz, by the worst mean that stuck contacts may hold",
        peak.value, by_paths, at_hz=peak.at, bound=bound, weight=weight,
    )  # fmt: skip


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
