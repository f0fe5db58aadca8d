"""Wear over life drawn."""

from __future__ import annotations
from collections.abc import Mapping
from typing import Any
import numpy as np
from matplotlib.figure import Figure
from solver.results import units
from solver.results.known import Measured
from solver.views.plots import style
from solver.views.plots.style import Into
from solver.views.plots.tracks import numbers

_MOST_CONTACTS = 12  # that wear, with a line each and a name


def wear_life_figure(found: Mapping[str, Any], *, ax: Into = None) -> Figure:
    """Draw the amplitude over the hours with its limit, and the load and the depth of each contact.

    The result is as its `to_json` gives it, with at least one instant.
    """
    hours, amplitude = numbers(found["hours"]), numbers(found["amplitude"])
    measured, depths = Measured.of_result(found), np.array(found["depths"])
    length = measured.unit_for(float(amplitude.max()))
    depth = units.shown_unit(float(depths.max()))
    with style.styled():
        page, (response, loads, worn) = style.figure(10.5, 3.4, columns=3, into=ax)
        response.plot(hours, amplitude * length.per_one, color=style.BLUE)
        for at in found["switches"]:
            response.axvline(at, color=style.GREY, linewidth=0.6)
        if found["limit"] is not None:
            response.axhline(found["limit"] * length.per_one, color=style.VERMILION, linewidth=0.8)
        if found["hours_to_limit"] is not None:
            at = found["hours_to_limit"]
            response.plot([at], [found["limit"] * length.per_one], "o", color=style.VERMILION, markersize=4.0)
            response.set_title(f"limit after {units.quantity(at, 'h')}")
        else:
            response.set_title(found["scene"])
        rows = zip(found["contacts"], found["loads"], depths, strict=True)
        for name, load, deep in list(rows)[:_MOST_CONTACTS]:
            loads.plot(hours, numbers(load), label=name)
            worn.plot(hours, deep * depth.per_one)
        loads.legend()
        style.label(response, "running time [h]", measured.label("", length))
        style.label(loads, "running time [h]", "N0 [N]")
        style.label(worn, "running time [h]", f"depth [{depth.name}]")
    return page
