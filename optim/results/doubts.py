"""What makes the numbers of a design doubtful, in words."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from optim.criteria.rows import Evaluation
from optim.results.basins import Checked
from optim.results.json import errors_of
from solver.results.notes import flag_words

DOUBTFUL = 0.1  # estimated error of a peak, relative, from which its harmonics are too few


def doubts_of(
    evaluation: Evaluation | None,
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
    return (
        *_few_harmonics(evaluation, harmonics),
        *_checked(checked, optimum, feasible=feasible),
        *open_peaks(evaluation),
        *_flags(evaluation),
    )


def open_peaks(evaluation: Evaluation) -> list[str]:
    """For each case of which that is so: why it is not known that no peak hides between points."""
    return [
        f"the response of {one.case} may have a higher peak between its points. {certificate.reason}"
        for one in evaluation.responses
        if not (certificate := one.branch.peak_certificate).known
    ]


def _few_harmonics(evaluation: Evaluation, harmonics: int) -> list[str]:
    return [
        f"too few harmonics: the estimated error of the peak of {case} is {100.0 * error / peak:.2g} % "
        f"with {harmonics}: ask for more harmonics"
        for case, peak, error in errors_of(evaluation)
        if error > DOUBTFUL * peak
    ]


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
        where = ", ".join(f"{name} = {value:.6g}" for name, value in best.values.items())
        found.append(f"with {best.harmonics} harmonics another local optimum is better: {where}")
    return found


def _flags(evaluation: Evaluation) -> list[str]:
    """The flags of the responses, each once."""
    flags = dict.fromkeys(flag for one in evaluation.responses for flag in one.branch.flags)
    return flag_words(flags)
