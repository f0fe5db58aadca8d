"""Mistuned disks: how much more their worst blades move, and every blade of the worst disk."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from solver.jit.fourier import Real
from solver.results import units
from solver.views.plots import style
from solver.views.plots.style import Into


def mistuning_figure(answer: Mapping[str, Any], *, ax: Into = None) -> Figure:
    """The share of disks below every magnification; beside it the peaks of the blades of the worst disk.

    Parameters
    ----------
    answer : the JSON of `solver.MistuningStudy`, with at least one disk whose peaks are known.
    ax : axes to draw into, as `solver.views.plots.style.figure`.
    """
    factors = np.sort([s["magnification"] for s in answer["samples"] if s["magnification"] is not None])
    worst, tuned = answer["worst"], answer["tuned"]["peak"]
    unit = units.length_unit(worst["largest"])
    with style.styled():
        page, (shares, blades) = style.figure(8.0, 3.3, columns=2, into=ax)
        shares.step(
            factors, 100.0 * (np.arange(factors.size) + 1.0) / factors.size, where="post", color=style.BLUE
        )
        shares.axvline(1.0, color=style.GREY, linewidth=0.9, linestyle=(0, (5.0, 2.5)))
        style.label(shares, "magnification, peak / tuned peak", "disks at or below [%]")
        shares.set_ylim(0.0, 103.0)
        shares.set_title(f"{answer['scene']}, {factors.size} disks, spread {answer['spread']:g}")
        heights = np.array([np.nan if p is None else p for p in worst["peaks"]]) * unit.per_metre
        colors = [style.VERMILION if i == worst["worst_blade"] else style.SKY for i in range(heights.size)]
        blades.bar(np.arange(heights.size), heights, color=colors, width=0.7)
        blades.axhline(tuned * unit.per_metre, color=style.INK, linewidth=0.9, linestyle=(0, (5.0, 2.5)))
        blades.annotate(
            f"tuned {unit.show(tuned)}", (1.0, tuned * unit.per_metre),
            xycoords=("axes fraction", "data"), xytext=(0, 3), textcoords="offset points", ha="right",
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0},
        )  # fmt: skip
        blades.grid(visible=False, axis="x")
        blades.xaxis.set_major_locator(MaxNLocator(integer=True))
        style.label(blades, "blade", f"highest peak, max |{answer['dof']}| [{unit.name}]")
        blades.set_title(f"worst disk, seed {worst['seed']}")
    return page


def blades_figure(heights: Real, what: str, *, ax: Into = None) -> Figure:
    """One number of every blade of a disk, the largest in another colour.

    Parameters
    ----------
    heights : (sectors,) array [m]; NaN where it is not known.
    what : the heights in words.
    ax : axes to draw into, as `solver.views.plots.style.figure`.
    """
    known = heights[np.isfinite(heights)]
    unit = units.length_unit(float(known.max(initial=0.0)))
    highest = int(np.nanargmax(heights)) if known.size else -1
    with style.styled():
        page, (axes,) = style.figure(5.0, 3.3, into=ax)
        colors = [style.VERMILION if i == highest else style.SKY for i in range(heights.size)]
        axes.bar(np.arange(heights.size), heights * unit.per_metre, color=colors, width=0.7)
        axes.grid(visible=False, axis="x")
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        style.label(axes, "blade", f"{what} [{unit.name}]")
    return page
