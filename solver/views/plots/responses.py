"""Amplitude over a parameter: one response, a family of responses, the peak against a design variable."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from solver.arrays import Real
from solver.results import units
from solver.results.known import Measured
from solver.scene.parameter_paths import parameter_unit
from solver.views.plots import style
from solver.views.plots.curves import Response
from solver.views.plots.style import Into

_DOTTED = (0, (1.2, 1.8))
_DASHED = (0, (5.0, 2.5))
_MARKERS = {"fold": "o", "branch_point": "s", "period_doubling": "^", "torus": "v", "end": "X"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Family:
    """Frequency responses for several values of a variable."""

    variable: Annotated[str, "Path of the variable, for example ``shroud.N0``."]
    members: Annotated[
        tuple[tuple[float, Response], ...], "Ascending in the value; the optimum is among them."
    ]
    optimum: Annotated[float, "The best value."]
    free: Annotated[Response, "The linear limit with the contact removed."]
    stuck: Annotated[Response, "That with it stuck throughout."]
    measured: Annotated[Measured, "What the amplitudes are of."]


@dataclass(frozen=True, slots=True, kw_only=True)
class Demands:
    """What was asked of a response."""

    limit: Annotated[
        float | None,
        "Amplitude [m] at which the band is measured, and that forbidden ranges must stay below.",
    ] = None
    max_peak: Annotated[float | None, "Largest amplitude allowed [m]."] = None
    forbidden: Annotated[
        tuple[tuple[float, float], ...],
        "Ranges of the parameter in which the amplitude must stay below `limit`.",
    ] = ()


def response_figure(
    response: Response, *, asked: Demands | None = None, title: str | None = None, ax: Into = None
) -> Figure:
    """One response with its peak marked and its band shaded, and what was asked of it.

    Parameters
    ----------
    response : the curve.
    asked : limits drawn as lines, forbidden ranges shaded from the limit upwards.
    title : the scene's name if left out.
    """
    asked = asked or Demands()
    unit = response.measured.unit_for(float(response.amplitude.max()))
    with style.styled():
        page, (axes,) = style.figure(6.0, 3.4, into=ax)
        for low, high in response.intervals:
            axes.axvspan(low, high, color=style.SKY, alpha=0.18, linewidth=0.0)
        # The curve, dashed where it is not stable, with folds, branch points and ends on it.
        height = response.amplitude * unit.per_one
        unstable = np.zeros(height.size, bool) if response.unstable is None else response.unstable
        if not unstable.any():
            axes.plot(response.values, height, color=style.BLUE)
        else:
            axes.plot(response.values, np.where(unstable, np.nan, height), color=style.BLUE, label="stable")
            beside = unstable.copy()
            beside[1:] |= unstable[:-1]
            beside[:-1] |= unstable[1:]
            axes.plot(
                response.values, np.where(beside, height, np.nan), color=style.BLUE, linestyle=_DASHED,
                label="not stable",
            )  # fmt: skip
        for kind, marker in _MARKERS.items():
            places = [(at, value * unit.per_one) for name, at, value in response.marks if name == kind]
            if places:
                axes.plot(
                    *zip(*places, strict=True), color=style.INK, marker=marker, markersize=4.5,
                    markerfacecolor="white", linestyle="none", label=kind.replace("_", " "), zorder=4,
                )  # fmt: skip
        if unstable.any() or response.marks:
            axes.legend(loc="best")
        if response.peak is not None:
            _mark_peak(axes, response, response.peak, unit)
        style.label(axes, axis_name(response.parameter), response.measured.label("amplitude", unit))
        axes.margins(x=0.0, y=0.14)
        axes.set_ylim(bottom=0.0)
        _mark_demands(axes, asked, unit)
        axes.set_title(response.scene if title is None else title)
    return page


def family_figure(family: Family) -> Figure:
    """Responses for several values of a variable between the two linear limits, on a logarithmic scale."""
    unit = family.measured.unit_for(float(np.median([curve.amplitude.max() for _, curve in family.members])))
    first = family.members[0][1]
    with style.styled():
        page, (axes,) = style.figure(6.6, 4.0)
        _draw(axes, family.free, unit, "removed (linear)", color=style.GREY, dashes=_DOTTED)
        # Colours from light to dark, told apart by everybody and in grey.
        shades = [tuple(colormaps["viridis"](place)) for place in np.linspace(0.85, 0.1, len(family.members))]
        for (value, curve), shade in zip(family.members, shades, strict=True):
            if value == family.optimum:
                name = f"{units.number(value)} (optimum)"
                _draw(axes, curve, unit, name, color=style.VERMILION, width=2.2, order=3)
            else:
                _draw(axes, curve, unit, units.number(value), color=shade)
        _draw(axes, family.stuck, unit, "stuck (linear)", color=style.GREY, dashes=_DASHED)
        axes.set_yscale("log")
        style.plain_log(axes.yaxis)
        style.label(axes, axis_name(first.parameter), family.measured.label("amplitude", unit))
        axes.margins(x=0.0)
        axes.set_title(first.scene)
        title = axis_name(family.variable)
        axes.legend(title=title, loc="center left", bbox_to_anchor=(1.0, 0.5), alignment="left")
    return page


def peak_figure(
    scene: str,
    variable: str,
    values: Real,
    peaks: Real,
    *,
    optimum: tuple[float, float],
    measured: Measured,
) -> Figure:
    """Highest peak against a variable, with the optimum marked.

    Parameters
    ----------
    scene, variable : name of the scene, path of the variable.
    values, peaks : (P,) values of the variable, ascending, and the highest peak at each [m].
    optimum : the best value and its peak [m].
    measured : what the peak is of.
    """
    unit = measured.unit_for(optimum[1])
    best, least = optimum[0], optimum[1] * unit.per_one
    with style.styled():
        page, (axes,) = style.figure(6.0, 3.4)
        axes.plot(values, peaks * unit.per_one, color=style.BLUE, marker="o", markersize=3.0)
        axes.plot(
            [best], [least], color=style.VERMILION, marker="o", markersize=6.5, linestyle="none", zorder=5
        )
        text = f"optimum {style.quantity(variable, best, 4)}\npeak {unit.show(optimum[1])}"
        axes.annotate(
            text, (best, least), xytext=(0, -9), textcoords="offset points", ha="center", va="top",
            color=style.VERMILION, linespacing=1.35,
        )  # fmt: skip
        for axis, scale in ((axes.xaxis, axes.set_xscale), (axes.yaxis, axes.set_yscale)):
            scale("log")
            style.plain_log(axis)
        low, high = min(least, float(peaks.min()) * unit.per_one), float(peaks.max()) * unit.per_one
        # Room for the two lines of text below the curve, as a share of the logarithmic height.
        axes.set_ylim(low * (low / high) ** 0.35, high * (high / low) ** 0.06)
        style.label(axes, axis_name(variable), measured.label("highest peak", unit))
        axes.set_title(scene)
    return page


def axis_name(path: str) -> str:
    """A parameter path with its unit."""
    unit = parameter_unit(path)
    return f"{path} [{unit}]" if unit else path


def _draw(
    axes: Axes, curve: Response, unit: units.ShownUnit, name: str, *, color: object, width: float = 1.2,
    dashes: tuple[int, tuple[float, ...]] | str = "-", order: float = 2,
) -> None:  # fmt: skip
    height = curve.amplitude * unit.per_one
    axes.plot(curve.values, height, color=color, linewidth=width, linestyle=dashes, label=name, zorder=order)


def _mark_peak(axes: Axes, curve: Response, peak: tuple[float, float], unit: units.ShownUnit) -> None:
    """A dot at the peak, and above it what it is."""
    at, height = peak
    low, high = float(curve.values.min()), float(curve.values.max())
    place = (at - low) / (high - low) if high > low else 0.5
    side = "left" if place < 0.2 else "right" if place > 0.8 else "center"
    axes.plot([at], [height * unit.per_one], color=style.VERMILION, marker="o", markersize=5.0, zorder=5)
    text = f"{unit.show(height)} at {style.quantity(curve.parameter, at, 5)}"
    axes.annotate(
        text, (at, height * unit.per_one), xytext=(0, 7), textcoords="offset points", ha=side,
        color=style.VERMILION, bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 1.0},
    )  # fmt: skip


def _mark_demands(axes: Axes, asked: Demands, unit: units.ShownUnit) -> None:
    """Lines at the limits, named at their right ends; forbidden ranges hatched above the limit."""
    lines = [("limit", asked.limit), ("largest peak allowed", asked.max_peak)]
    heights = [height * unit.per_one for _, height in lines if height is not None]
    low, high = axes.get_xlim()
    top = max([axes.get_ylim()[1], *(1.12 * height for height in heights)])
    axes.set_ylim(top=top)
    for begin, end in asked.forbidden:
        if end <= low or begin >= high:
            continue
        bottom = 0.0 if asked.limit is None else asked.limit * unit.per_one
        axes.fill_between(
            [max(begin, low), min(end, high)], bottom, top, facecolor="none", edgecolor=style.VERMILION,
            hatch="////", alpha=0.55, linewidth=0.0, zorder=1,
        )  # fmt: skip
        axes.axvspan(max(begin, low), min(end, high), color=style.VERMILION, alpha=0.08, linewidth=0.0)
    axes.set_xlim(low, high)
    for name, height in lines:
        if height is not None:
            _mark_limit(axes, name, height, unit)


def _mark_limit(axes: Axes, name: str, limit: float, unit: units.ShownUnit) -> None:
    """A line at a limit, named at its right end."""
    height = limit * unit.per_one
    axes.axhline(height, color=style.INK, linewidth=0.9, linestyle=_DASHED)
    axes.annotate(
        f"{name} {unit.show(limit)}", (1.0, height), xycoords=("axes fraction", "data"), xytext=(0, 3),
        textcoords="offset points", ha="right", va="bottom",
    )  # fmt: skip
