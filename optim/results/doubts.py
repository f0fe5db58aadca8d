"""What makes the numbers of a design doubtful, in words."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from optim.criteria.rows import Evaluation
from optim.results.json import errors_of
from solver.views.notes import flag_words

if TYPE_CHECKING:
    from optim.results.design import DesignResult

DOUBTFUL = 0.1  # estimated error of a peak, relative, from which its harmonics are too few


def doubts_of(result: DesignResult) -> tuple[str, ...]:
    """What makes the numbers of a design doubtful."""
    evaluation = result.evaluation
    if evaluation is None:
        return ()
    return (
        *_few_harmonics(result, evaluation),
        *_checked(result),
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


def _few_harmonics(result: DesignResult, evaluation: Evaluation) -> list[str]:
    return [
        f"too few harmonics: the estimated error of the peak of {case} is {100.0 * error / peak:.2g} % "
        f"with {result.problem.harmonics}: ask for more harmonics"
        for case, peak, error in errors_of(evaluation)
        if error > DOUBTFUL * peak
    ]


def _checked(result: DesignResult) -> list[str]:
    """What the local optima with more harmonics say."""
    known = [one for one in result.checked if math.isfinite(one.objective)]
    if not known:
        return []
    found: list[str] = []
    best = min(known, key=lambda one: (not one.feasible, one.objective))
    own = next((one for one in known if dict(one.values) == dict(result.optimum)), None)
    if own is not None and not own.feasible and not result.broken:
        found.append(f"with {own.harmonics} harmonics this design does not keep the limits")
    if best is not own and best.feasible:
        where = ", ".join(f"{name} = {value:.6g}" for name, value in best.values.items())
        found.append(f"with {best.harmonics} harmonics another local optimum is better: {where}")
    return found


def _flags(evaluation: Evaluation) -> list[str]:
    """The flags of the responses, each once."""
    flags = dict.fromkeys(flag for one in evaluation.responses for flag in one.branch.flags)
    return flag_words(flags)
