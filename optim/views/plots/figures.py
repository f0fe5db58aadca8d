"""Pictures: a design, optima over an uncertainty, a front, shares, a fit, a Campbell diagram; of results."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator

from optim.criteria.frequency_ranges import FORBIDDEN
from optim.criteria.peak_criterion import PEAK
from solver.jit.fourier import Real
from solver.results import units
from solver.results.known import Measured
from solver.results.units import ShownUnit
from solver.views.plots import style
from solver.views.plots.curves import Response
from solver.views.plots.responses import Demands, response_figure
from solver.views.plots.style import Into

if TYPE_CHECKING:
    from optim.results.design_result import DesignResult
    from optim.results.studies_result import CampbellDiagram


Json = Mapping[str, Any]


def of_design(result: DesignResult, ax: Into = None) -> Figure:
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
    forbidden = limits.get(FORBIDDEN)
    asked = Demands(
        limit=result.problem.limit,
        max_peak=limits.get(PEAK),
        forbidden=() if case is None or forbidden is None else forbidden.ranges.get(case, ()),
    )
    several = len(result.problem.cases) > 1 and case is not None
    title = f"{result.scene}, {case}" if several and case != result.scene else None
    return response_figure(Response.of_branch(branch), asked=asked, title=title, ax=ax)


def robust_figure(found: Json, *, ax: Into = None) -> Figure:
    """The highest peak of both optima over the samples of the uncertainty, sorted, with the worst of all.

    Parameters
    ----------
    found : the JSON of `optim.RobustResult`, with a nominal optimum.
    """
    sides: list[tuple[str, _Peaks, str]] = []
    for name, color in (("nominal", style.BLUE), ("robust", style.VERMILION)):
        if found[name] is not None:
            sides.append((f"{name} optimum", _Peaks.of(found[name]), color))
    unit = units.shown_unit(max((float(peaks.known.max(initial=0.0)) for _, peaks, _ in sides), default=1.0))
    with style.styled():
        page, (axes,) = style.figure(6.0, 3.4, into=ax)
        for name, peaks, color in sides:
            heights = peaks.known * unit.per_one
            shares = 100.0 * (np.arange(heights.size) + 1.0) / max(heights.size, 1)
            axes.plot(shares, heights, color=color, marker="o", markersize=3.0, label=name)
            if math.isfinite(peaks.worst):
                worst = peaks.worst * unit.per_one
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
    def of(cls, side: Json) -> Self:
        """Those of a side of the JSON."""
        known = np.sort([peak for peak in side["samples"]["peaks"] if peak is not None])
        worst = math.nan if side["worst"] is None else float(side["worst"]["peak"])
        return cls(known=known.astype(np.float64), worst=worst)


MOST = 12  # parameters shown, those that matter most
_LEAST = 1e-3  # per cent below which a bar is not worth a line


def sensitivities_figure(answer: Json, *, ax: Into = None) -> Figure:
    """Bars of the per cent of the highest peak, and of the band, for one per cent of a parameter.

    Parameters
    ----------
    answer : the JSON of `optim.SensitivityResult`, with at least one row that has a per cent.
    """
    known = [row for row in answer["rows"] if row["peak_percent"] is not None]
    rows = [row for row in known if max(abs(row["peak_percent"]), abs(row["band_percent"] or 0.0)) >= _LEAST]
    rows = rows[:MOST][::-1]
    places = np.arange(len(rows), dtype=np.float64)
    with style.styled():
        page, (peaks, bands) = style.figure(9.2, 1.1 + 0.27 * max(len(rows), 3), columns=2, into=ax)
        for axes, key, color in ((peaks, "peak_percent", style.BLUE), (bands, "band_percent", style.GREEN)):
            axes.barh(places, [row[key] or 0.0 for row in rows], height=0.62, color=color)
            axes.axvline(0.0, color=style.GREY, linewidth=0.7)
            axes.set_yticks(places, [row["path"] for row in rows])
            axes.grid(visible=False, axis="y")
            axes.tick_params(axis="y", length=0)
            axes.spines["left"].set_visible(False)
            axes.margins(x=0.12)
        bands.set_yticklabels([])
        highest = answer["peaks"][0]
        peaks.set_title(
            f"{answer['scene']}: peak of {units.length(highest['value'])} at {units.hertz(highest['at'])}"
        )
        peaks.set_xlabel("change of the peak for 1 % more [%]")
        width = answer["band_hz"]
        bands.set_title("no resonance band" if width is None else f"band of {units.hertz(width)}")
        bands.set_xlabel("change of the band for 1 % more [%]")
    return page


_SHOWN = 3  # variables named beside a point
_PRICED = 0.02  # share of the peak, rounded down to a power of ten, that the price is given for
_TANGENT = 0.06  # half length of a tangent, as a share of the front's width and height


def pareto_figure(answer: Json, *, ax: Into = None) -> Figure:
    """The front with its slopes and its knee, and beside it the frequencies at risk of every point.

    Parameters
    ----------
    answer : the JSON of `optim.ParetoResult`, with at least one point.
    """
    points: Sequence[Json] = answer["points"]
    measured = Measured.of_result(answer)
    unit = measured.unit_for(min(point["peak"] for point in points))
    with style.styled():
        page, (front, risk) = style.figure(9.2, 3.7, columns=2, into=ax)
        points = answer["points"]
        band = np.array([point["band_hz"] for point in points])
        peak = np.array([point["peak"] for point in points]) * unit.per_one
        wide, tall = float(np.ptp(band)) or 1.0, float(np.ptp(peak)) or 1.0
        for point, x, y in zip(points, band, peak, strict=True):
            if point["slope"] is None:
                continue
            slope = point["slope"] * unit.per_one
            reach = _TANGENT / np.hypot(1.0 / wide, slope / tall)
            front.plot(
                [x - reach, x + reach], [y - slope * reach, y + slope * reach], color=style.SKY,
                linewidth=4.0, alpha=0.55,
            )  # fmt: skip
        front.plot(band, peak, color=style.BLUE, marker="o", markersize=4.5)
        for point in answer["dominated"]:
            x, y = point["band_hz"], point["peak"] * unit.per_one
            front.plot([x], [y], color=style.GREY, marker="x", markersize=4.5)
        knee = answer["knee"]
        if knee is not None:
            _name(front, points[knee], unit)
        front.margins(x=0.1, y=0.12)
        # The intervals of the band at the height of each point's peak, and where the peak is.
        for point in points:
            y = point["peak"] * unit.per_one
            for low, high in point["intervals"]:
                risk.plot([low, high], [y, y], color=style.SKY, linewidth=3.2, solid_capstyle="butt")
            risk.plot([point["at"]], [y], color=style.BLUE, marker="o", markersize=4.0, linestyle="none")
        risk.margins(x=0.06, y=0.12)
        named = measured.label("highest peak", unit)
        style.label(front, "resonance band [Hz]", named)
        style.label(risk, "frequency [Hz]", named)
        limit = "half power" if answer["limit"] is None else units.length(answer["limit"])
        front.set_title(f"{answer['scene']}, band above {limit}")
        risk.set_title("frequencies at risk")
    return page


def _name(axes: Axes, point: Json, unit: ShownUnit) -> None:
    """Mark the knee, with its design and its price."""
    x, y = point["band_hz"], point["peak"] * unit.per_one
    lines = [f"{path} {style.quantity(path, value, 4)}" for path, value in point["values"].items()][:_SHOWN]
    if point["hz_per_metre"] is not None:
        step = 10.0 ** math.floor(math.log10(_PRICED * point["peak"]))
        lines.append(f"{units.length(step)} lower: {units.hertz(point['hz_per_metre'] * step)} wider")
    axes.plot([x], [y], color=style.VERMILION, marker="o", markersize=6.5, linestyle="none", zorder=5)
    axes.annotate(
        "knee: " + "\n".join(lines), (x, y), xytext=(10, 14), textcoords="offset points", va="bottom",
        color=style.VERMILION, linespacing=1.35,
    )  # fmt: skip


_BAND = 1.96
_NAMED = 8  # runs up to which each is in the legend
LOOP, MODE = "loop", "mode"


def identification_figure(answer: Json, *, ax: Into = None) -> Figure:
    """Responses over frequency, and loops beside them where there are any.

    Parameters
    ----------
    answer : the JSON of `optim.Identification`, with at least one run.
    """
    runs: Sequence[Json] = answer["runs"]
    draws = {"response": _draw_responses, LOOP: _draw_loops}
    kinds = sorted(
        dict.fromkeys(run["kind"] for run in runs),
        key=lambda kind: [*draws].index(kind) if kind in draws else 2,
    )
    with style.styled():
        page, axes = style.figure(5.6 * len(kinds), 3.9, columns=len(kinds), into=ax)
        for one, kind in zip(axes, kinds, strict=False):
            draws.get(kind, _draw_curves)(one, [run for run in runs if run["kind"] == kind])
            one.set_title(f"{answer['scene']}: data, fit and 95 % band")
    return page


def _draw_responses(axes: Axes, runs: Sequence[Json]) -> None:
    """Draw amplitudes over frequency."""
    top = max(float(np.max(run["data"])) for run in runs)
    unit = units.shown_unit(top)
    for run, colour in zip(runs, _shades(len(runs)), strict=True):
        order = np.argsort(run["x"])
        _draw(axes, run, colour, unit.per_one, order, markers="o")
    axes.set_yscale("log")
    style.plain_log(axes.yaxis)
    dofs = dict.fromkeys(run["dof"] for run in runs)
    style.label(axes, "frequency [Hz]", f"amplitude of {', '.join(dofs)} [{unit.name}]")
    _legend(axes, runs)


def _draw_loops(axes: Axes, runs: Sequence[Json]) -> None:
    """Draw force over motion."""
    unit = units.shown_unit(max(float(np.abs(run["x"]).max()) for run in runs))
    for run, colour in zip(runs, _shades(len(runs)), strict=True):
        scaled = {**run, "x": (np.asarray(run["x"]) * unit.per_one).tolist()}
        _draw(axes, scaled, colour, 1.0, np.arange(len(run["x"])), markers=".")
    style.label(axes, f"motion [{unit.name}]", "force [N]")
    _legend(axes, runs)


def _draw_curves(axes: Axes, runs: Sequence[Json]) -> None:
    """Draw what was measured over what it was measured at: modes, decays, phase resonances, peaks."""
    for run, colour in zip(runs, _shades(len(runs)), strict=True):
        _draw(axes, run, colour, 1.0, np.argsort(run["x"]), markers="o")
    if runs[0]["kind"] == MODE:
        axes.set_xscale("log")
    over = runs[0].get("over", "modal amplitude a [√kg m]")
    style.label(axes, over, ", ".join(dict.fromkeys(run["quantity"] for run in runs)))
    _legend(axes, runs)


def _draw(axes: Axes, run: Json, colour: str, scale: float, order: np.ndarray, *, markers: str) -> None:
    x = np.asarray(run["x"])[order]
    data, fit, sd = (_numbers(run[key])[order] * scale for key in ("data", "fit", "fit_sd"))
    axes.plot(x, data, marker=markers, markersize=2.8, linestyle="none", color=colour, alpha=0.55)
    conditions: Mapping[str, float] = run["conditions"]
    told = [style.quantity(path, value, 4) for path, value in conditions.items()]
    axes.plot(x, fit, color=colour, linewidth=1.2, label=", ".join(told) or str(run["source"]))
    if run["kind"] != LOOP:
        low = np.maximum(fit - _BAND * sd, 1e-3 * fit)
        axes.fill_between(x, low, fit + _BAND * sd, color=colour, alpha=0.25, linewidth=0.0)


def _numbers(values: Sequence[float | None]) -> Real:
    return np.array([math.nan if value is None else value for value in values], dtype=np.float64)


def _legend(axes: Axes, runs: Sequence[Json]) -> None:
    if len(runs) <= _NAMED:
        axes.legend(loc="best", fontsize=7.5)


def _shades(count: int, first: float = 0.0, last: float = 0.85) -> list[str]:
    from matplotlib.colors import to_hex

    return [to_hex(colormaps["viridis"](place)) for place in np.linspace(first, last, max(count, 1))]


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


def of_campbell(diagram: CampbellDiagram, ax: Into = None) -> Figure:
    """Draw the diagram, and the responses beside it."""
    # One object for each branch: orders that share theirs are told by it.
    curves = {id(one.branch): Response.of_branch(one.branch) for one in diagram.orders}
    return campbell_figure(diagram.to_json(), [curves[id(one.branch)] for one in diagram.orders], ax=ax)


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
        for (order, curve), colour in zip(known, _order_colours(len(known)), strict=True)
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
        _draw_order_responses(heights, answer, shown)
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


def _draw_order_responses(axes: Axes, answer: Json, shown: list[_Order]) -> None:
    """The amplitude of every order, sideways."""
    curves = [one.curve for one in shown]
    top = max(float(curve.amplitude.max()) for curve in curves)
    unit = units.shown_unit(top)
    for one in shown:
        axes.plot(
            one.curve.amplitude * unit.per_one, one.curve.values, color=one.colour, linewidth=1.1,
            label=f"order {one.number}",
        )  # fmt: skip
    if answer["limit"] is not None:
        axes.axvline(answer["limit"] * unit.per_one, color=style.INK, linewidth=0.9, linestyle=_DASHED)
    axes.set_xscale("log")
    least = min(float(curve.amplitude.min()) for curve in curves)
    if top > 0.0:
        least = max(least, _FAR_DOWN * top)
        axes.set_xlim(least * unit.per_one, 1.5 * top * unit.per_one)
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


def _order_colours(count: int) -> list[str]:
    """A colour for each order; more than a few are shaded from light to dark."""
    return list(_COLOURS[:count]) if count <= len(_COLOURS) else _shades(count, 0.85, 0.05)
