"""The front of peak against band, and the frequencies at risk along it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from solver.results import units
from solver.results.units import LengthUnit
from solver.views.plots import style
from solver.views.plots.style import Into

Point = Mapping[str, Any]
_SHOWN = 3  # variables named beside a point
_PRICED = 0.02  # share of the peak, rounded down to a power of ten, that the price is given for
_TANGENT = 0.06  # half length of a tangent, as a share of the front's width and height


def pareto_figure(answer: Mapping[str, Any], *, ax: Into = None) -> Figure:
    """The front with its slopes and its knee, and beside it the frequencies at risk of every point.

    Parameters
    ----------
    answer : the JSON of `optim.ParetoResult`, with at least one point.
    """
    points: Sequence[Point] = answer["points"]
    unit = units.length_unit(min(point["peak"] for point in points))
    with style.styled():
        page, (front, risk) = style.figure(9.2, 3.7, columns=2, into=ax)
        _draw_front(front, answer, unit)
        _draw_risk(risk, points, unit)
        dof = answer["dof"]
        style.label(front, "resonance band [Hz]", f"highest peak, max |{dof}| [{unit.name}]")
        style.label(risk, "frequency [Hz]", f"highest peak, max |{dof}| [{unit.name}]")
        limit = "half power" if answer["limit"] is None else units.length(answer["limit"])
        front.set_title(f"{answer['scene']}, band above {limit}")
        risk.set_title("frequencies at risk")
    return page


def _draw_front(axes: Axes, answer: Mapping[str, Any], unit: LengthUnit) -> None:
    """Draw the points, the slope at each, the dominated designs and the knee."""
    points = answer["points"]
    band = np.array([point["band_hz"] for point in points])
    peak = np.array([point["peak"] for point in points]) * unit.per_metre
    wide, tall = float(np.ptp(band)) or 1.0, float(np.ptp(peak)) or 1.0
    for point, x, y in zip(points, band, peak, strict=True):
        if point["slope"] is None:
            continue
        slope = point["slope"] * unit.per_metre
        reach = _TANGENT / np.hypot(1.0 / wide, slope / tall)
        axes.plot(
            [x - reach, x + reach], [y - slope * reach, y + slope * reach], color=style.SKY, linewidth=4.0,
            alpha=0.55,
        )  # fmt: skip
    axes.plot(band, peak, color=style.BLUE, marker="o", markersize=4.5)
    for point in answer["dominated"]:
        axes.plot(
            [point["band_hz"]], [point["peak"] * unit.per_metre], color=style.GREY, marker="x", markersize=4.5
        )
    knee = answer["knee"]
    if knee is not None:
        _name(axes, points[knee], unit)
    axes.margins(x=0.1, y=0.12)


def _name(axes: Axes, point: Point, unit: LengthUnit) -> None:
    """Mark the knee, with its design and its price."""
    x, y = point["band_hz"], point["peak"] * unit.per_metre
    lines = [f"{path} {style.quantity(path, value, 4)}" for path, value in point["values"].items()][:_SHOWN]
    if point["hz_per_metre"] is not None:
        step = 10.0 ** math.floor(math.log10(_PRICED * point["peak"]))
        lines.append(f"{units.length(step)} lower: {units.number(point['hz_per_metre'] * step, 3)} Hz wider")
    axes.plot([x], [y], color=style.VERMILION, marker="o", markersize=6.5, linestyle="none", zorder=5)
    axes.annotate(
        "knee: " + "\n".join(lines), (x, y), xytext=(10, 14), textcoords="offset points", va="bottom",
        color=style.VERMILION, linespacing=1.35,
    )  # fmt: skip


def _draw_risk(axes: Axes, points: Sequence[Point], unit: LengthUnit) -> None:
    """Draw the intervals of the band at the height of each point's peak, and where the peak is."""
    for point in points:
        y = point["peak"] * unit.per_metre
        for low, high in point["intervals"]:
            axes.plot([low, high], [y, y], color=style.SKY, linewidth=3.2, solid_capstyle="butt")
        axes.plot([point["at"]], [y], color=style.BLUE, marker="o", markersize=4.0, linestyle="none")
    axes.margins(x=0.06, y=0.12)
