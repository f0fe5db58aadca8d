"""The Campbell diagram: orders over the running speed, with the peaks they meet, and their responses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator

from solver.results import units
from solver.results.measures import Measured
from solver.views.plots import style
from solver.views.plots.curves import Response
from solver.views.plots.style import Into

Json = Mapping[str, Any]

_COLOURS = (style.BLUE, style.VERMILION, style.GREEN, style.SKY)
_DOTTED, _DASHED = (0, (1.2, 1.8)), (0, (5.0, 2.5))
_BESIDE = 0.6  # speeds shown beside the running speeds, as a share of their span
_SMALL = 0.1  # share of the highest peak below which a crossing has no dot: it would hide the others
_DECADES = 0.01  # ratio of the amplitudes below which only powers of ten fit under the axis
_FAR_DOWN = 1e-3  # share of the highest amplitude at which the amplitude axis ends


@dataclass(frozen=True, slots=True, kw_only=True)
class _Order:
    """One order as it is drawn: its part of the answer, its response, its colour."""

    answer: Json
    curve: Response
    colour: str

    @property
    def number(self) -> int:
        return int(self.answer["order"])


def campbell_figure(answer: Json, curves: Sequence[Response], *, ax: Into = None) -> Figure:
    """Frequency over speed, and beside it the amplitude of every order over the same frequencies.

    Parameters
    ----------
    answer : the JSON of `optim.CampbellDiagram`.
    curves : the response of each of its orders, the same object for all without sectors; at least one has a
        point.
    ax : axes to draw into, as `solver.views.plots.style.figure`.
    """
    known = [(o, c) for o, c in zip(answer["orders"], curves, strict=True) if c.values.size]
    shown = [
        _Order(answer=order, curve=curve, colour=colour)
        for (order, curve), colour in zip(known, _colours(len(known)), strict=True)
    ]
    with style.styled():
        page, (speeds, heights) = style.figure(8.6, 4.4, columns=2, into=ax)
        grid = heights.get_gridspec()
        if grid is not None and ax is None:
            grid.set_width_ratios([2.2, 1.0])
        if ax is None:
            heights.sharey(speeds)
            heights.tick_params(labelleft=False)
        _draw_speeds(speeds, answer, shown)
        if len({id(one.curve) for one in shown}) == 1:
            # One response for all orders: of a scene without sectors.
            shown = [replace(shown[0], colour=style.INK)]
        _draw_responses(heights, answer, shown)
        speeds.set_ylim(*_frequencies(shown))
        speeds.set_title(answer["scene"])
    return page


def _draw_speeds(axes: Axes, answer: Json, shown: list[_Order]) -> None:
    """Lines of the orders, natural frequencies, peaks, and where the limit is exceeded."""
    low, high = answer["speeds_rpm"][0][0], answer["speeds_rpm"][-1][1]
    beside = _BESIDE * (high - low)
    left, right = max(low - beside, 0.0), high + beside
    for first, last in answer["speeds_rpm"]:
        axes.axvspan(first, last, color=style.SKY, alpha=0.18, linewidth=0.0)
    limit = answer["limit"]
    above = "half power" if limit is None else f"above {units.length(limit)}"
    alike = len({id(one.curve) for one in shown}) == 1
    highest = max((c["amplitude"] for one in shown for c in one.answer["crossings"]), default=0.0)
    for one in shown:
        colour, per_rpm = one.colour, one.number / 60.0
        axes.plot([left, right], [left * per_rpm, right * per_rpm], color=colour, linewidth=1.0)
        for key, dashes in (("stuck_hz", _DASHED), ("open_hz", _DOTTED)):
            for value in one.answer[key]:
                lines = style.GREY if alike else colour
                axes.axhline(value, color=lines, linewidth=0.7, linestyle=dashes, alpha=0.7)
        for first, last in one.answer["exceeded_rpm"]:
            axes.plot(
                [first, last], [first * per_rpm, last * per_rpm], color=colour, linewidth=5.0, alpha=0.45,
                solid_capstyle="butt",
            )  # fmt: skip
        for crossing in one.answer["crossings"]:
            if crossing["amplitude"] >= _SMALL * highest:
                filled = colour if crossing["inside"] else "white"
                axes.plot(
                    [crossing["speed_rpm"]], [crossing["frequency_hz"]], color=colour, marker="o",
                    markersize=5.0, markerfacecolor=filled, linestyle="none", zorder=5,
                )  # fmt: skip
    axes.set_xlim(left, right)
    _name_lines(axes, shown, right)
    style.label(axes, "speed [rpm]", "frequency [Hz]")
    keys = [
        Line2D([], [], color=style.GREY, linewidth=0.9, linestyle=_DASHED, label="all stuck"),
        Line2D([], [], color=style.GREY, linewidth=0.9, linestyle=_DOTTED, label="all open"),
        Line2D([], [], color=style.GREY, linewidth=5.0, alpha=0.45, label=above),
    ]
    axes.legend(handles=keys, loc="upper right", bbox_to_anchor=(1.0, 1.14), ncols=3)


def _name_lines(axes: Axes, shown: list[_Order], right: float) -> None:
    """The number of each order where its line leaves the picture."""
    bottom, top = _frequencies(shown)
    left = axes.get_xlim()[0]
    for one in shown:
        colour, per_rpm = one.colour, one.number / 60.0
        speed = min(right, top / per_rpm)
        if speed <= left or speed * per_rpm < bottom:
            continue
        above = speed < right
        axes.annotate(
            str(one.number), (speed, speed * per_rpm), xytext=(0, 3) if above else (3, 0),
            textcoords="offset points", ha="center" if above else "left", va="bottom" if above else "center",
            color=colour, annotation_clip=False,
        )  # fmt: skip


def _draw_responses(axes: Axes, answer: Json, shown: list[_Order]) -> None:
    """The amplitude of every order, sideways."""
    curves = [one.curve for one in shown]
    top = max(float(curve.amplitude.max()) for curve in curves)
    unit = units.length_unit(top)
    for one in shown:
        axes.plot(
            one.curve.amplitude * unit.per_metre, one.curve.values, color=one.colour, linewidth=1.1,
            label=f"order {one.number}",
        )  # fmt: skip
    if answer["limit"] is not None:
        axes.axvline(answer["limit"] * unit.per_metre, color=style.INK, linewidth=0.9, linestyle=_DASHED)
    axes.set_xscale("log")
    least = min(float(curve.amplitude.min()) for curve in curves)
    if top > 0.0:
        least = max(least, _FAR_DOWN * top)
        axes.set_xlim(least * unit.per_metre, 1.5 * top * unit.per_metre)
    style.plain_log(axes.xaxis)
    if least < _DECADES * top:
        axes.xaxis.set_major_locator(LogLocator())
    axes.set_xlabel(Measured.of_result(answer).label("", unit))
    if len(shown) > 1:
        axes.legend(loc="best")


def _frequencies(shown: list[_Order]) -> tuple[float, float]:
    """The frequencies of the picture: those the responses cover."""
    values = np.concatenate([one.curve.values for one in shown])
    return float(values.min()), float(values.max())


def _colours(count: int) -> list[str]:
    """A colour for each order; more than a few are shaded from light to dark."""
    if count <= len(_COLOURS):
        return list(_COLOURS[:count])
    from matplotlib.colors import to_hex

    return [to_hex(colormaps["viridis"](place)) for place in np.linspace(0.85, 0.05, count)]
