"""One variable with limits or several cases: the tracked optimum of each case without limits, to begin from.

Where that of a single case keeps all limits it is the optimum with them as well, and as well proven.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated

from optim.criteria.criterion import Limits
from optim.methods.afterwards import of_one
from optim.methods.evaluator import DesignSearch, SearchStoppedError
from optim.problem.design_problem import Method, Problem
from optim.results.design_result import DesignStatus

if TYPE_CHECKING:
    from optim.results.design_result import DesignResult

NO_LIMITS = Limits()
MOST_CASES = 4
_OPTIMAL = (DesignStatus.OPTIMAL, DesignStatus.AT_BOUND)


@dataclass(frozen=True, slots=True, kw_only=True)
class Eased:
    """What a problem without its limits says about it."""

    starts: Annotated[
        tuple[dict[str, float], ...],
        "The one asked for, and the local optima of single cases without limits.",
    ]
    proven: Annotated[DesignResult | None, "The optimum without limits, if it keeps them all."] = None

    @classmethod
    def of(cls, search: DesignSearch, plain: DesignResult | None = None) -> Eased:
        """Return it; tracking goes on for `search` and is counted by it.

        `plain`: what tracking the problem itself came to, where that was tried.
        """
        problem = search.problem
        starts = [] if problem.start is None else [dict(problem.start)]
        if problem.method is not Method.AUTO or len(problem.cases) > MOST_CASES:
            return cls(starts=tuple(starts))
        # Loaded here: problems that cannot be tracked do without it.
        from optim.methods.peak_tracking import tracked_optimum

        for eased in _cases(problem):
            tracked = plain or tracked_optimum(
                eased, on_progress=search.easing, should_stop=search.should_stop
            )  # fmt: skip
            search.eased(tracked.evaluations)
            starts += [dict(basin.values) for basin in tracked.basins]
            if len(problem.cases) == 1 and tracked.status in _OPTIMAL and starts:
                proven = _kept(search, tracked)
                if proven is not None:
                    return cls(starts=tuple(starts), proven=proven)
        return cls(starts=tuple(starts))


def _cases(problem: Problem) -> list[Problem]:
    """Return the plain problems of the single cases that can be tracked."""
    if not problem.peak_alone:
        return []
    plain = [
        replace(problem, cases=(case,), limits=NO_LIMITS, start=None, limit=None) for case in problem.cases
    ]
    return [one for one in plain if one.why_not_tracked is None]


def _kept(search: DesignSearch, tracked: DesignResult) -> DesignResult | None:
    """Return the tracked optimum with the rows of its limits if it keeps them all."""
    if tracked.evaluation is None:
        return None
    try:
        evaluation = search(tracked.evaluation.values)
    except SearchStoppedError:
        return None
    if not evaluation.good or evaluation.violation(search.scales) > 0.0:
        return None
    responses = evaluation.computed
    return of_one(
        search.problem, Method.TRACKED, DesignStatus.OPTIMAL, evaluation, basins=tracked.basins,
        evaluations=tracked.evaluations + responses, work=tracked.work + responses, seconds=tracked.seconds,
    )  # fmt: skip
