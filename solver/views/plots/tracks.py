"""Tracked peaks, the response over frequency and a parameter with their ridge, stress over the excitation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from solver.jit.fourier import Real
from solver.results import units
from solver.results.known import Measured
from solver.views.plots import style
from solver.views.plots.responses import axis_name
from solver.views.plots.style import Into

Json = Mapping[str, Any]

_LOGARITHMIC_FROM = 5.0  # ratio of the ends from which an axis is logarithmic
_COLOURS = (style.BLUE, style.VERMILION, style.GREEN, style.SKY, style.INK, style.GREY)
_SAME_FREQUENCY = 2e-3  # relative distance from a tracked peak within which a point lies on it


def track_figure(track: Json, *, ax: Into = None) -> Figure:
    """The highest peak and its frequency over the parameter, competing peaks thin, the optimum marked.

    Parameters
    ----------
    track : as its `to_json` gives it, with at least one point.
    """
    parameter, peak = numbers(track["parameter"]), numbers(track["peak"])
    measured = Measured.of_result(track)
    unit = measured.unit_for(float(peak.min()))
    with style.styled():
        page, (heights, places) = style.figure(9.2, 3.6, columns=2, into=ax)
        for line in track["competing"]:
            higher = numbers(line["peak"]) * unit.per_one
            heights.plot(line["parameter"], higher, color=style.GREY, linewidth=0.8)
            places.plot(line["parameter"], line["frequency"], color=style.GREY, linewidth=0.8)
        heights.plot(parameter, peak * unit.per_one, color=style.BLUE)
        places.plot(*ridge_lines(track), color=style.BLUE)
        at, least = track["optimum"]["at"], track["optimum"]["peak"]
        if at is not None:
            heights.plot([at], [least * unit.per_one], **_DOT)
            for one in track["optimum"]["active"]:
                places.plot([at], [one["frequency"]], **_DOT)
            # At an end of the range the text stands inside.
            side = {float(parameter.min()): "left", float(parameter.max()): "right"}.get(at, "center")
            text = f"least at {style.quantity(track['parameter_path'], at, 5)}\n{unit.show(least)}"
            heights.annotate(
                text, (at, least * unit.per_one), xytext=(0, -10), textcoords="offset points",
                ha=side, va="top", color=style.VERMILION, linespacing=1.35,
            )  # fmt: skip
        for axes in (heights, places):
            if _is_wide(parameter):
                axes.set_xscale("log")
                style.plain_log(axes.xaxis)
            axes.margins(x=0.0)
        heights.set_yscale("log")
        style.plain_log(heights.yaxis)
        low, high = peak.min() * unit.per_one, peak.max() * unit.per_one
        heights.set_ylim(low * (low / high) ** 0.35, high * (high / low) ** 0.06)
        style.label(heights, axis_name(track["parameter_path"]), measured.label("highest peak", unit))
        style.label(places, axis_name(track["parameter_path"]), "frequency of the peak [Hz]")
        heights.set_title(track["scene"])
    return page


def map_figure(found: Json, *, ax: Into = None) -> Figure:
    """The amplitude in colours over frequency and parameter; the ridge of the highest peak on it.

    Parameters
    ----------
    found : as its `to_json` gives it, with at least one solved point.
    """
    parameter, frequency = numbers(found["parameter"]), numbers(found["frequency"])
    amplitude = numbers(found["amplitude"])
    known = amplitude[np.isfinite(amplitude) & (amplitude > 0.0)]
    measured = Measured.of_result(found)
    unit = measured.unit_for(float(np.median(known)))
    scale = LogNorm(float(known.min()) * unit.per_one, float(known.max()) * unit.per_one)
    with style.styled():
        page, (axes,) = style.figure(6.8, 4.2, into=ax)
        mesh = axes.pcolormesh(
            frequency, parameter, amplitude * unit.per_one, norm=scale, cmap="viridis",
            shading="nearest", rasterized=True,
        )  # fmt: skip
        axes.grid(visible=False)
        if found["ridge"] is not None and found["ridge"]["parameter"]:
            ridge = found["ridge"]
            for line in ridge["competing"]:
                axes.plot(line["frequency"], line["parameter"], color="white", linewidth=0.7, linestyle=":")
            along, at = ridge_lines(ridge)
            axes.plot(at, along, color="white", linewidth=1.4)
            for peak in ridge["optimum"]["active"]:
                axes.plot([peak["frequency"]], [ridge["optimum"]["at"]], **_DOT)
        if _is_wide(parameter):
            axes.set_yscale("log")
            style.plain_log(axes.yaxis)
        low, high = sorted((float(parameter[0]), float(parameter[-1])))
        axes.set_ylim(low, high)
        axes.set_xlim(float(frequency[0]), float(frequency[-1]))
        style.label(axes, axis_name("frequency"), axis_name(found["parameter_path"]))
        bar = page.colorbar(mesh, ax=axes)
        bar.set_label(measured.label("amplitude", unit))
        axes.set_title(found["scene"])
    return page


def margin_figure(found: Json, *, ax: Into = None) -> Figure:
    """Draw stress, and its share of what is allowed, over the excitation.

    The result is as its `to_json` gives it, with at least one level.
    """
    level, stresses = numbers(found["level"]), found["unit"] == "Pa"
    unit = "MPa" if stresses else found["unit"]
    with style.styled():
        page, (of_stress, of_share) = style.figure(9.2, 3.6, columns=2, into=ax)
        for i, one in enumerate(found["allowed"]):
            colour = _COLOURS[i % len(_COLOURS)]
            stress = numbers(found["stress"][i]) * (1e-6 if stresses else 1.0)
            of_stress.loglog(level, stress, color=colour, label=one["name"])
            of_share.loglog(level, numbers(found["used"][i]), color=colour)
            if one["allowed"] is not None:
                words = f"{units.number(one['allowed'], digits=4)} {found['level_unit']}"
                of_share.plot([one["allowed"]], [1.0], "o", color=colour, markersize=4.0, label=words)
        of_share.axhline(1.0, color=style.GREY, linewidth=0.8)
        for axis in (of_stress.xaxis, of_stress.yaxis, of_share.xaxis, of_share.yaxis):
            style.plain_log(axis)
        of_stress.set_title(found["scene"])
        what = "alternating stress" if stresses else "amplitude"
        style.label(of_stress, f"excitation [{found['level_unit']}]", f"{what} [{unit}]")
        style.label(of_share, f"excitation [{found['level_unit']}]", "share of what is allowed")
        of_stress.legend()
        if any(one["allowed"] is not None for one in found["allowed"]):
            of_share.legend(title="allowed")
    return page


def numbers(values: Sequence[Any]) -> Real:
    """Numbers of a JSON object as an array; NaN for null."""
    return np.array(values, dtype=np.float64)


def ridge_lines(track: Json) -> tuple[Real, Real]:
    """Return parameter and frequency of the highest peak, with a NaN where another peak becomes the highest.

    However fast a peak moves, it is one line: two points are joined if one tracked peak passes through both.
    """
    p, f = numbers(track["parameter"]), numbers(track["frequency"])
    joined = np.zeros(max(p.size - 1, 0), bool)
    for line in track["competing"]:
        order = np.argsort(line["parameter"])
        known, place = numbers(line["parameter"])[order], numbers(line["frequency"])[order]
        inside = (p >= known[0]) & (p <= known[-1])
        on = inside & (np.abs(np.interp(p, known, place) - f) <= _SAME_FREQUENCY * f)
        joined |= on[:-1] & on[1:] & (np.diff(p) != 0.0)
    gaps = np.flatnonzero(~joined) + 1
    return np.insert(p, gaps, np.nan), np.insert(f, gaps, np.nan)


_DOT: dict[str, Any] = {
    "color": style.VERMILION,
    "marker": "o",
    "markersize": 5.5,
    "linestyle": "none",
    "zorder": 5,
}


def _is_wide(values: np.ndarray) -> bool:
    low, high = float(values.min()), float(values.max())
    return low > 0.0 and high / low >= _LOGARITHMIC_FROM
