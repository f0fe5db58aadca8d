"""Interference diagram and mistuned blades of disks; frequency and damping ratio of a nonlinear mode."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from solver.jit.fourier import Real
from solver.results import units
from solver.results.known import Measured
from solver.views.plots import style
from solver.views.plots.style import Into

_AMPLITUDE = "modal amplitude a [√kg m]"
_STUCK = ("stuck", "separated", "closed")


def mode_figure(answer: Mapping[str, Any], *, ax: Into = None) -> Figure:
    """Frequency beside damping ratio; the part in which every contact sticks or is open is thin.

    Of the JSON of `solver.NonlinearMode`, with at least one point.
    """
    amplitude = np.array(answer["amplitude"])
    linear = np.array([all(one in _STUCK for one in row) for row in answer["states"]], dtype=bool)
    with style.styled():
        page, (left, right) = style.figure(8.0, 3.3, columns=2, into=ax)
        for axes, key, words in (
            (left, "frequency", "frequency [Hz]"), (right, "damping_ratio", "damping ratio ζ"),
        ):  # fmt: skip
            values = np.array(answer[key])
            axes.semilogx(amplitude, values, color=style.BLUE)
            axes.semilogx(
                np.where(linear, amplitude, np.nan), values, color=style.SKY, linewidth=2.6, label="linear"
            )
            style.label(axes, _AMPLITUDE, words)
        of = "" if answer["nodal_diameter"] is None else f", nodal diameter {answer['nodal_diameter']}"
        left.set_title(f"{answer['scene']}, mode {answer['mode']}{of}")
        if linear.any():
            right.legend()
    return page


def performance_figure(answer: Mapping[str, Any], *, dof: str = "x", ax: Into = None) -> Figure:
    """The resonance peak over the factor on the loads; on the excitation where loads do not scale.

    Parameters
    ----------
    answer : the JSON of `solver.PerformanceCurve`.
    dof : name of the observed DOF.
    """
    over = "load" if answer["scales"] else "excitation"
    places = np.array(answer[over], dtype=np.float64)
    heights = np.array(answer["peak_at_load" if answer["scales"] else "peak"], dtype=np.float64)
    good = np.isfinite(places) & (places > 0.0)
    unit = units.shown_unit(float(heights[good].min(initial=1.0)))
    with style.styled():
        page, (axes,) = style.figure(5.0, 3.3, into=ax)
        axes.loglog(places[good], heights[good] * unit.per_one, color=style.BLUE, label="one mode")
        style.label(axes, f"factor on the {over}", f"peak of {Measured(dof=dof).label('', unit)}")
    return page


def held_figure(answer: Mapping[str, Any], *, ax: Into = None) -> Figure:
    """The factor on the excitation beside the phase, where one amplitude is held; what is unstable dashed.

    Of the JSON of `solver.HeldAmplitude`, with at least one point.
    """
    frequency = np.array(answer["frequency"])
    growing = np.array([one is False for one in answer["stable"]], dtype=bool)
    size = units.length(answer["amplitude"])
    with style.styled():
        page, (left, right) = style.figure(8.0, 3.3, columns=2, into=ax)
        for axes, key, words in (
            (left, "excitation", "factor on the excitation"), (right, "phase", "phase [deg]"),
        ):  # fmt: skip
            values = np.array(answer[key])
            axes.plot(frequency, np.where(growing, np.nan, values), color=style.BLUE)
            if growing.any():
                axes.plot(
                    frequency, np.where(growing, values, np.nan), "--", color=style.SKY, label="unstable"
                )
            style.label(axes, "frequency [Hz]", words)
        left.set_yscale("log")
        left.set_title(f"{answer['scene']}, |{answer['dof']}| held at {size}")
        if growing.any():
            right.legend()
    return page


def resonance_figure(answer: Mapping[str, Any], *, ax: Into = None) -> Figure:
    """The frequency of phase resonance beside the factor on the excitation it takes.

    Of the JSON of `solver.PhaseResonance`, with at least one point.
    """
    amplitude = np.array(answer["amplitude"])
    with style.styled():
        page, (left, right) = style.figure(8.0, 3.3, columns=2, into=ax)
        left.semilogx(amplitude, np.array(answer["frequency"]), color=style.BLUE)
        style.label(left, _AMPLITUDE, "frequency [Hz]")
        right.loglog(amplitude, np.abs(np.array(answer["excitation"])), color=style.BLUE)
        style.label(right, _AMPLITUDE, "factor on the excitation")
        left.set_title(f"{answer['scene']}, phase resonance of mode {answer['mode']}")
    return page


Json = Mapping[str, Any]

_SHIFT = 0.06  # of the points of both directions to either side, where their frequencies differ
_HEADROOM = 1.06
_NAMED = 40  # orders that still have room for their numbers


def interference_figure(answer: Json, *, ax: Into = None) -> Figure:
    """Frequencies with all contacts open and stuck at each nodal diameter, and the orders at the speed.

    Of the JSON of `solver.InterferenceDiagram`, with at least one nodal diameter.
    """
    half = answer["sectors"] // 2
    # To the highest family with all contacts open, and the lowest one stuck.
    free = [value for point in answer["diameters"] for value in point["open_hz"]]
    stuck = [point["stuck_hz"][0] for point in answer["diameters"] if point["stuck_hz"]]
    top = _HEADROOM * (max([*free, *stuck], default=1.0) or 1.0)
    with style.styled():
        page, (axes,) = style.figure(6.4, 4.4, into=ax)
        # What friction may move each natural frequency through.
        for x, point in zip(_places(answer), answer["diameters"], strict=True):
            for free, stuck in zip(point["open_hz"], point["stuck_hz"], strict=True):
                axes.plot([x, x], [free, stuck], color=style.GREY, linewidth=3.0, alpha=0.18)
        for key, colour, words in (
            ("open_hz", style.BLUE, "all open"), ("stuck_hz", style.VERMILION, "all stuck"),
        ):  # fmt: skip
            _draw_families(axes, answer, key, colour, words)
        if answer["speed_rpm"] is not None:
            _draw_orders(axes, answer, top)
        axes.set_xlim(-0.4, half + 0.4)
        axes.set_ylim(0.0, top)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        style.label(axes, "nodal diameter", "natural frequency [Hz]")
        at = "" if answer["speed_rpm"] is None else f" at {units.quantity(answer['speed_rpm'], 'rpm')}"
        axes.set_title(f"{answer['scene']}, {answer['sectors']} sectors{at}")
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=4)
    return page


def _places(answer: Json) -> list[float]:
    """Where each point stands: at its nodal diameter, beside it where the directions differ."""
    shift = {"forward": _SHIFT, "backward": -_SHIFT}
    return [point["diameter"] + shift.get(point["wave"], 0.0) for point in answer["diameters"]]


def _draw_families(axes: Axes, answer: Json, key: str, colour: str, words: str) -> None:
    """Lines through the i-th frequency of each nodal diameter, of each direction."""
    families = max((len(point[key]) for point in answer["diameters"]), default=0)
    label: str | None = words
    for way in ("forward", "backward"):
        pairs = [
            (x, point[key])
            for x, point in zip(_places(answer), answer["diameters"], strict=True)
            if point["wave"] in (way, "both", "standing")
        ]
        if way == "backward" and not any(point["wave"] == way for point in answer["diameters"]):
            continue
        marker = "o" if way == "forward" else "<"
        for i in range(families):
            heights = [values[i] if i < len(values) else np.nan for _, values in pairs]
            axes.plot(
                [x for x, _ in pairs], heights, color=colour, marker=marker, markersize=3.4, linewidth=0.9,
                label=label,
            )  # fmt: skip
            label = None


def _draw_orders(axes: Axes, answer: Json, top: float) -> None:
    """The folded line, and the orders on it: full where they meet a family, with their numbers."""
    shown = [one for one in answer["orders"] if one["frequency_hz"] <= top]
    per_order, half = answer["speed_rpm"] / 60.0, answer["sectors"] / 2.0
    folds = np.arange(0.0, top / per_order / half + 1.0)
    line = np.where(folds % 2 == 0, 0.0, half)
    axes.plot(line, folds * half * per_order, color=style.GREEN, linewidth=0.8, label="engine orders")
    met = {one["order"] for one in answer["crossings"] if one["inside"]}
    near = {one["order"] for one in answer["crossings"]} - met
    label: str | None = "meets a family"
    for one in shown:
        x, y = one["diameter"], one["frequency_hz"]
        hit = one["order"] in met
        axes.plot(
            [x], [y], color=style.GREEN, marker="D", markersize=5.0 if hit or one["order"] in near else 3.0,
            markerfacecolor=style.GREEN if hit else "white", linestyle="none", zorder=5,
            label=label if hit else None,
        )  # fmt: skip
        label = None if hit else label
        if len(shown) <= _NAMED:
            axes.annotate(
                str(one["order"]), (x, y), xytext=(5, 3), textcoords="offset points", fontsize=7.5,
                color=style.GREEN,
            )  # fmt: skip


def mistuning_figure(answer: Mapping[str, Any], *, ax: Into = None) -> Figure:
    """The share of disks below every magnification; beside it the peaks of the blades of the worst disk.

    Of the JSON of `solver.MistuningStudy`, with at least one disk whose peaks are known.
    """
    factors = np.sort([s["magnification"] for s in answer["samples"] if s["magnification"] is not None])
    worst, tuned = answer["worst"], answer["tuned"]["peak"]
    unit = units.shown_unit(worst["largest"])
    with style.styled():
        page, (shares, blades) = style.figure(8.0, 3.3, columns=2, into=ax)
        shares.step(
            factors, 100.0 * (np.arange(factors.size) + 1.0) / factors.size, where="post", color=style.BLUE
        )
        shares.axvline(1.0, color=style.GREY, linewidth=0.9, linestyle=(0, (5.0, 2.5)))
        style.label(shares, "magnification, peak / tuned peak", "disks at or below [%]")
        shares.set_ylim(0.0, 103.0)
        shares.set_title(f"{answer['scene']}, {factors.size} disks, spread {answer['spread']:g}")
        heights = np.array([np.nan if p is None else p for p in worst["peaks"]]) * unit.per_one
        draw_blades(
            blades, heights, worst["worst_blade"], Measured.of_result(answer).label("highest peak", unit)
        )
        blades.axhline(tuned * unit.per_one, color=style.INK, linewidth=0.9, linestyle=(0, (5.0, 2.5)))
        blades.annotate(
            f"tuned {unit.show(tuned)}", (1.0, tuned * unit.per_one),
            xycoords=("axes fraction", "data"), xytext=(0, 3), textcoords="offset points", ha="right",
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0},
        )  # fmt: skip
        blades.set_title(f"worst disk, seed {worst['seed']}")
    return page


def blades_figure(heights: Real, what: str, *, ax: Into = None) -> Figure:
    """One number of every blade of a disk, the largest in another colour.

    Parameters
    ----------
    heights : (sectors,) array [m]; NaN where it is not known.
    what : the heights in words.
    """
    known = heights[np.isfinite(heights)]
    unit = units.shown_unit(float(known.max(initial=0.0)))
    highest = int(np.nanargmax(heights)) if known.size else -1
    with style.styled():
        page, (axes,) = style.figure(5.0, 3.3, into=ax)
        draw_blades(axes, heights * unit.per_one, highest, f"{what} [{unit.name}]")
    return page


def draw_blades(axes: Axes, heights: Real, highest: int, words: str) -> None:
    """Draw a bar for every blade, the highest one apart; `words` say what is drawn, with its unit."""
    colors = [style.VERMILION if i == highest else style.SKY for i in range(heights.size)]
    axes.bar(np.arange(heights.size), heights, color=colors, width=0.7)
    axes.grid(visible=False, axis="x")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    style.label(axes, "blade", words)
