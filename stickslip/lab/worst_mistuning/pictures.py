"""The worst mistuning drawn."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from solver.views.plots import style
from solver.views.plots.disks import draw_blades
from solver.views.plots.style import Into

Json = Mapping[str, Any]


def worst_mistuning_figure(answer: Json, *, ax: Into = None) -> Figure:
    """The factors of the worst pattern, and the magnifications beside the bounds.

    Of the JSON of `solver.WorstMistuning`, with a worst pattern.
    """
    worst = answer["worst"]
    percent = 100.0 * (np.array(worst["factors"]) - 1.0)
    with style.styled():
        page, (blades, bars) = style.figure(8.0, 3.3, columns=2, into=ax)
        draw_blades(blades, percent, worst["blade"], f"factor of {', '.join(answer['of'])} − 1 [%]")
        blades.axhline(0.0, color=style.GREY, linewidth=0.9)
        blades.set_title(f"{answer['scene']}, worst within ± {100.0 * answer['within']:g} %")
        _draw_magnifications(bars, answer)
    return page


def _draw_magnifications(axes: Axes, answer: Json) -> None:
    """Bars of the worst pattern and of the intentional ones, and what they cannot exceed."""
    rows = [("worst", answer["worst"]["magnification"], None)] + [
        (one["pattern"], one["disk"]["magnification"], one["worst"] and one["worst"]["magnification"])
        for one in answer["patterns"]
    ]
    places = np.arange(len(rows))
    for i, (name, alone, on_top) in enumerate(rows):
        if on_top is not None:
            axes.bar(i, on_top, color=style.VERMILION, alpha=0.35, width=0.7)
        axes.bar(i, alone, color=style.VERMILION if name == "worst" else style.SKY, width=0.7)
    axes.set_title("magnification")
    for key, words, colour in (("whitehead", "Whitehead", style.INK), ("martel", "Martel", style.GREEN)):
        if answer[key] is not None and answer[key] < 2.0 * answer["whitehead"]:
            axes.axhline(answer[key], color=colour, linewidth=0.9, linestyle=(0, (5.0, 2.5)), label=words)
    axes.axhline(1.0, color=style.GREY, linewidth=0.9)
    axes.set_xticks(places, [name for name, _, _ in rows])
    axes.grid(visible=False, axis="x")
    on_top = any(one is not None for _, _, one in rows)
    style.label(axes, "pale: with the worst mistuning on top" if on_top else "", "peak / tuned peak")
    axes.set_ylim(0.0, 1.25 * axes.get_ylim()[1])
    axes.legend(loc="upper right", ncols=2)
