"""What makes the numbers of a design doubtful, in words."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from solver.results import units
from solver.results.known import Known, flag_words, notes_of_all

if TYPE_CHECKING:
    from optim.criteria.constraint_rows import DesignEvaluation
    from optim.results.design_result import Checked

DOUBTFUL = 0.1  # estimated error of a peak, relative, from which its harmonics are too few
WELL_KNOWN = 0.05  # relative error of the highest peak up to which a design may be called the best


def doubts_of(
    evaluation: DesignEvaluation | None,
    *,
    harmonics: int,
    optimum: Mapping[str, float],
    checked: Sequence[Checked],
    feasible: bool,
) -> tuple[str, ...]:
    """What makes the numbers of a design doubtful.

    Parameters
    ----------
    evaluation : of the optimum; None if there is none.
    harmonics : highest harmonic kept in the search.
    optimum : variable name to value.
    checked : the local optima again with more harmonics.
    feasible : whether the optimum keeps its limits.
    """
    if evaluation is None:
        return ()
    rows = (row for row in evaluation.rows if math.isinf(row.told))
    found = {f"{row.what.partition(' at ')[0]} is infinite: {row.quantity.endless}" for row in rows}
    endless = sorted(found)
    # Of the responses and the rows, each once.
    own = (flag for one in evaluation.responses for flag in one.branch.flags)
    at_peaks = (flag for _, known in evaluation.known_parts for flag in known.flags)
    of_rows = (flag for row in evaluation.rows for flag in row.flags)
    flags = flag_words(dict.fromkeys((*own, *at_peaks, *of_rows)))
    return (
        *endless,
        *_few_harmonics(evaluation, harmonics),
        *_checked(checked, optimum, feasible=feasible),
        *open_peaks(evaluation),
        *flags,
        *(note.words for note in notes_of_all(known.notes for _, known in evaluation.known_parts)),
    )


def open_peaks(evaluation: DesignEvaluation) -> list[str]:
    """For each case of which that is so: why it is not known that no peak hides between points."""
    return [
        f"the response of {one.case} may have a higher peak between its points. {certificate.reason}"
        for one in evaluation.responses
        if not (certificate := one.branch.peak_certificate).known
    ]


def _few_harmonics(evaluation: DesignEvaluation, harmonics: int) -> list[str]:
    return [
        f"too few harmonics: the estimated error of the peak of {case} is {_share(known)} with {harmonics}: "
        "ask for more harmonics"
        for case, known in evaluation.known_parts
        if known.relative > WELL_KNOWN
    ]


def _share(known: Known) -> str:
    return f"{units.number(100.0 * known.relative, 2)} %" if math.isfinite(known.relative) else "not known"


def _checked(checked: Sequence[Checked], optimum: Mapping[str, float], *, feasible: bool) -> list[str]:
    """What the local optima with more harmonics say."""
    known = [one for one in checked if math.isfinite(one.objective)]
    if not known:
        return []
    found: list[str] = []
    best = min(known, key=lambda one: (not one.feasible, one.objective))
    own = next((one for one in known if dict(one.values) == dict(optimum)), None)
    if own is not None and not own.feasible and feasible:
        found.append(f"with {own.harmonics} harmonics this design does not keep the limits")
    if best is not own and best.feasible:
        where = ", ".join(f"{name} = {units.number(value)}" for name, value in best.values.items())
        found.append(f"with {best.harmonics} harmonics another local optimum is better: {where}")
    return found


def doubt_of(known_parts: Iterable[tuple[str, Known]], weights: Mapping[str, float]) -> float:
    """Return by which share the highest weighted peak may be higher than it is, by the estimated errors.

    Parameters
    ----------
    known_parts : of a design, each with the name of its case.
    weights : of the cases.
    """
    parts = [(weights[case], known) for case, known in known_parts]
    # Each in its own measure; a case far below the highest may be wrong by more.
    top = max((weight * known.value for weight, known in parts), default=math.nan)
    if not top > 0.0:
        return 0.0
    reached = max(weight * known.value * (1.0 + known.relative) for weight, known in parts)
    return reached / top - 1.0
