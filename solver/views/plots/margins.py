"""The designer's diagram: stress over the excitation for several dampers, and the excitation allowed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from matplotlib.figure import Figure

from solver.results import units
from solver.views.plots import style
from solver.views.plots.style import Into
from solver.views.plots.tracks import numbers

_COLOURS = (style.BLUE, style.VERMILION, style.GREEN, style.SKY, style.INK, style.GREY)


def margin_figure(found: Mapping[str, Any], *, ax: Into = None) -> Figure:
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
