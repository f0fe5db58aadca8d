"""Pictures of designs: the response with what it must keep, and both optima over an uncertainty."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from matplotlib.figure import Figure

from optim.criteria.forbidden import FORBIDDEN
from optim.criteria.peak import PEAK
from solver.jit.fourier import Real
from solver.results import units
from solver.views.plots import style
from solver.views.plots.curves import Response
from solver.views.plots.responses import Demands, response_figure
from solver.views.plots.style import Into

if TYPE_CHECKING:
    from optim.results.design import DesignResult


def design_figure(result: DesignResult, *, ax: Into = None) -> Figure:
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
        max_peak=limits.of(PEAK),
        forbidden=() if case is None else (limits.of(FORBIDDEN) or {}).get(case, ()),
    )
    several = len(result.problem.cases) > 1 and case is not None
    title = f"{result.scene}, {case}" if several and case != result.scene else None
    return response_figure(Response.of_branch(branch), asked=asked, title=title, ax=ax)


def robust_figure(found: Mapping[str, Any], *, ax: Into = None) -> Figure:
    """The highest peak of both optima over the samples of the uncertainty, sorted, with the worst of all.

    Parameters
    ----------
    found : the JSON of `optim.RobustResult`, with a nominal optimum.
    """
    sides: list[tuple[str, _Peaks, str]] = []
    for name, color in (("nominal", style.BLUE), ("robust", style.VERMILION)):
        if found[name] is not None:
            sides.append((f"{name} optimum", _Peaks.of(found[name]), color))
    unit = units.length_unit(max((float(peaks.known.max(initial=0.0)) for _, peaks, _ in sides), default=1.0))
    with style.styled():
        page, (axes,) = style.figure(6.0, 3.4, into=ax)
        for name, peaks, color in sides:
            heights = peaks.known * unit.per_metre
            shares = 100.0 * (np.arange(heights.size) + 1.0) / max(heights.size, 1)
            axes.plot(shares, heights, color=color, marker="o", markersize=3.0, label=name)
            if math.isfinite(peaks.worst):
                worst = peaks.worst * unit.per_metre
                axes.axhline(worst, color=color, linewidth=0.9, linestyle=(0, (5.0, 2.5)))
                above = all(not other.worst > peaks.worst for _, other, _ in sides)
                axes.annotate(
                    f"worst {unit.show(peaks.worst)}", (0.02, worst), xycoords=("axes fraction", "data"),
                    xytext=(0, 3 if above else -3), textcoords="offset points",
                    va="bottom" if above else "top", color=color,
                )  # fmt: skip
        style.label(axes, "share of the samples [%]", f"highest peak at most [{unit.name}]")
        axes.margins(y=0.14)
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        axes.set_title(f"{found['scene']}, {found['aim']}")
    return page


@dataclass(frozen=True, slots=True, kw_only=True)
class _Peaks:
    """The peaks of one design: those of the samples that are known, sorted, and the worst (NaN: unknown)."""

    known: Real
    worst: float

    @classmethod
    def of(cls, side: Mapping[str, Any]) -> Self:
        """Those of a side of the JSON."""
        known = np.sort([peak for peak in side["samples"]["peaks"] if peak is not None])
        worst = math.nan if side["worst"] is None else float(side["worst"]["peak"])
        return cls(known=known.astype(np.float64), worst=worst)
