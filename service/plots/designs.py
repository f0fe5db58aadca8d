"""The response of a design: what it must keep out of is shaded."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from service.plots.curves import Response
from service.plots.responses import Demands, response_figure

if TYPE_CHECKING:
    from optim.result import DesignResult


def design_figure(result: DesignResult) -> Figure:
    """The response at the optimum of the case with the highest peak, with its limits and forbidden ranges.

    Parameters
    ----------
    result : a design with at least one response.
    """
    case = result.evaluation.peaks[0].case if result.evaluation and result.evaluation.peaks else None
    branch = result.sweeps[-1]
    if result.evaluation is not None:
        branches = [r.branch for r in result.evaluation.responses if case in (None, r.case)]
        # The first response of a case is that over its band, those over forbidden ranges follow it.
        branch = branches[0] if branches else branch
    limits = result.problem.limits
    asked = Demands(
        limit=result.problem.limit,
        max_peak=limits.peak,
        forbidden=() if case is None else limits.forbidden_hz.get(case, ()),
    )
    several = len(result.problem.cases) > 1 and case is not None
    title = f"{result.scene}, {case}" if several and case != result.scene else None
    return response_figure(Response.of_branch(branch), asked=asked, title=title)
