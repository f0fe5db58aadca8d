"""What is no periodic response: runs through frequencies, tori of two of them, hours of wear."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from solver.results import units
from solver.results.measures import Measured
from solver.views.plots import style
from solver.views.plots.style import Into
from solver.views.plots.tracks import numbers


def transient_figure(found: Mapping[str, Any], *, ax: Into = None) -> Figure:
    """Draw the extremes of the motion over time, and the amplitude over the frequency while that changes.

    The result is as its `to_json` gives it, with at least one window.
    """
    time, frequency, high, low = (numbers(found[name]) for name in ("time", "frequency_hz", "high", "low"))
    unit = units.length_unit(found["max_abs"])
    high, low = high * unit.per_metre, low * unit.per_metre
    largest = found["max_abs"] * unit.per_metre
    with style.styled():
        page, (over_time, over_frequency) = style.figure(9.2, 3.6, columns=2, into=ax)
        over_time.fill_between(time, low, high, color=style.BLUE, alpha=0.8, linewidth=0.0)
        over_time.axvline(found["at_seconds"], color=style.VERMILION, linewidth=0.8)
        rates = numbers(found.get("rates") or [])
        if rates.size:
            sizes = numbers(found["rates_max_abs"]) * unit.per_metre
            over_frequency.semilogx(rates, sizes, "o-", color=style.BLUE, markersize=4.0)
            over_frequency.set_title(f"slowest: {unit.show(found['max_abs'])} at {found['at_hz']:.5g} Hz")
            over_time.set_title(found["scene"])
            style.label(over_time, "time [s]", f"{found['dof']} [{unit.name}]")
            style.label(over_frequency, "rate [Hz/s]", f"largest |{found['dof']}| [{unit.name}]")
            return page
        ramp = time <= found["ramp_seconds"]
        over_frequency.plot(frequency[ramp], np.maximum(high, -low)[ramp], color=style.BLUE)
        over_frequency.plot([found["at_hz"]], [largest], "o", color=style.VERMILION, markersize=4.0)
        over_time.set_title(found["scene"])
        over_frequency.set_title(f"largest {unit.show(found['max_abs'])} at {found['at_hz']:.5g} Hz")
        style.label(over_time, "time [s]", f"{found['dof']} [{unit.name}]")
        style.label(
            over_frequency, "frequency [Hz]", f"{Measured(dof=found['dof']).name} in a turn [{unit.name}]"
        )
    return page
