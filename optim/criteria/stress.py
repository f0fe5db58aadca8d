"""Stresses at recovered rows over the band: the alternating one, and what of the stress allowed is used.

A row of a recovery matrix is one more observed quantity of the same response, so its peaks, their gradients
and second derivatives are those of `optim.criteria.peak_criterion`. The alternating stress is half peak to
peak of each.

Its utilisation is the alternating one over that of the Haigh diagram at its mean, the static stress of the
row with the middle of the motion's range. Where the mean moves with the frequency the peak of the utilisation
is not that of the stress; it is looked for as its own, with exact gradient and second derivatives
(`solver.balance.kernels.haigh`). Where the mean depends on the history, the worst that stuck contacts may
hold has a row of its own (`solver.response.worst_mean`). Where the mean leaves nothing, rows count on: what
is minimised alone is then limited to what has an end, and results say inf.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from optim.criteria.criterion import Criterion, CriterionContext, CriterionRow, Form, Judged, Key
from optim.criteria.key import number_or_table
from optim.criteria.peak_criterion import COMPETES, maxima
from solver.results import units
from solver.results.units import STRESS_UNITS

if TYPE_CHECKING:
    from solver.continuation.branch import Peak
    from solver.scene.materials import Haigh
    from solver.scene.scene import Scene
    from solver.scene.scene_records import Recovered


_STRESS = "max_stress"


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


def _stress_rows(judged: Judged) -> list[CriterionRow]:
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


def _read_stresses(asked: CriterionContext) -> Any:
    names = [of_row(one) for one in stresses(asked.scene)]
    return by_row(_STRESS, asked.values[_STRESS], names, without_stress(asked.scene))


STRESS = Criterion(
    name="stress",
    unit="Pa",
    help="The greatest alternating stress, half peak to peak, of the [recovered rows](criteria.md) over the "
    "band of any case; minimised times its `weight`.",
    rows=_stress_rows,
    weight="stress",
    keys=(
        Key(
            name=_STRESS, annotation=number_or_table("Pa", "rows"), form=Form.NUMBER_OR_TABLE,
            flag="--max-stress", metavar="PA|ROW=PA", example="120e6 or fillet=120e6",
            examples=(120e6, {"fillet": 120e6}),
            help="Largest alternating stress [Pa], of every recovered stress or by row.",
            option_help="Largest alternating stress [Pa]; repeatable by row.",
        ),
    ),
    read=_read_stresses,
    lacking=without_stress,
)  # fmt: skip


_MARGIN = "min_margin"


def _with_material(scene: Scene) -> list[Recovered]:
    return [one for one in scene.recovery if one.material is not None]


def _without_material(scene: Scene) -> str:
    return "" if _with_material(scene) else "needs a stress in `recovery` with a `material`"


def _utilisation_rows(judged: Judged) -> list[CriterionRow]:
    """A row for every peak of every utilisation that competes."""
    # Loaded here: help of a command, which lists criteria, needs no numbers.
    from solver.response.worst_mean import used_most
    from solver.scene.materials import ENDLESS, haigh_of

    bounds, scene = judged.limit(UTILISATION) or {}, judged.branch.balance.scene
    rows = _with_material(scene)
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
        UTILISATION, f"{what} at {units.hertz(peak.at)}, by the worst mean that stuck contacts may hold",
        peak.value, by_paths, at_hz=peak.at, bound=bound, weight=weight,
    )  # fmt: skip


def _read_margins(asked: CriterionContext) -> Any:
    from solver.scene.materials import counted

    names = [of_row(one) for one in _with_material(asked.scene)]
    margins = by_row(_MARGIN, asked.values[_MARGIN], names, _without_material(asked.scene))
    return {name: counted(1.0 / margin) for name, margin in margins.items()}


def _told_utilisation(value: float) -> float:
    from solver.scene.materials import utilisation_of

    return utilisation_of(value)


UTILISATION = Criterion(
    name="utilisation",
    unit="1",
    help="The alternating stress over what the Haigh diagram of its material allows at its mean, greatest of "
    "the [recovered rows](criteria.md) over the band of any case; its inverse is the margin.",
    rows=_utilisation_rows,
    weight="utilisation",
    keys=(
        Key(
            name=_MARGIN, annotation=number_or_table("1", "rows"), form=Form.NUMBER_OR_TABLE,
            flag="--min-margin", metavar="M|ROW=M", example="1.5 or fillet=1.5",
            examples=(1.5, {"fillet": 1.5}),
            help="Least margin, of every recovered stress with a material or by row: how many times the "
            "alternating stress may be as large.",
            option_help="Least margin of the stresses; repeatable by row.",
        ),
    ),
    read=_read_margins,
    lacking=_without_material,
    told=_told_utilisation,
    endless="the mean stress alone reaches the strength",
)  # fmt: skip

CRITERION = (STRESS, UTILISATION)
