"""Pictures of designs: the response with what it must keep, and both optima over an uncertainty."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from solver import units
from solver.plots import style
from solver.plots.curves import Response
from solver.plots.responses import Demands, response_figure

if TYPE_CHECKING:
    from optim.result import DesignResult
    from optim.robust_result import RobustResult, Side


def design_figure(result: DesignResult, *, ax: style.Into = None) -> Figure:
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
    return response_figure(Response.of_branch(branch), asked=asked, title=title, ax=ax)


def robust_figure(result: RobustResult, *, ax: style.Into = None) -> Figure:
    """The highest peak of both optima over the samples of the uncertainty, sorted, with the worst of all.

    Parameters
    ----------
    result : a robust design whose nominal optimum is known.
    """
    sides: list[tuple[str, Side, str]] = []
    if result.nominal is not None:
        sides.append(("nominal optimum", result.nominal, style.BLUE))
    if result.robust is not None:
        sides.append(("robust optimum", result.robust, style.VERMILION))
    known = [peak for _, side, _ in sides for peak in side.spread.peaks if np.isfinite(peak)]
    unit = units.length_unit(max(known, default=1.0))
    with style.styled():
        page, (axes,) = style.figure(6.0, 3.4, into=ax)
        for name, side, color in sides:
            peaks = np.sort([peak for peak in side.spread.peaks if np.isfinite(peak)]) * unit.per_metre
            shares = 100.0 * (np.arange(peaks.size) + 1.0) / max(peaks.size, 1)
            axes.plot(shares, peaks, color=color, marker="o", markersize=3.0, label=name)
            if np.isfinite(side.worst_peak):
                worst = side.worst_peak * unit.per_metre
                axes.axhline(worst, color=color, linewidth=0.9, linestyle=(0, (5.0, 2.5)))
                above = all(not other.worst_peak > side.worst_peak for _, other, _ in sides)
                axes.annotate(
                    f"worst {unit.show(side.worst_peak)}", (0.02, worst), xycoords=("axes fraction", "data"),
                    xytext=(0, 3 if above else -3), textcoords="offset points",
                    va="bottom" if above else "top", color=color,
                )  # fmt: skip
        style.label(axes, "share of the samples [%]", f"highest peak at most [{unit.name}]")
        axes.margins(y=0.14)
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        axes.set_title(f"{result.problem.scene.name}, {result.aim.value}")
    return page
