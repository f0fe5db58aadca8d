"""What one per cent of each parameter does to the highest peak and to the band, as bars."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from solver.results import units
from solver.views.plots import style
from solver.views.plots.style import Into

MOST = 12  # parameters shown, those that matter most
_LEAST = 1e-3  # per cent below which a bar is not worth a line


def sensitivities_figure(answer: Mapping[str, Any], *, ax: Into = None) -> Figure:
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
            f"{answer['scene']}: peak of {units.length(highest['value'])} at {highest['at']:.4g} Hz"
        )
        peaks.set_xlabel("change of the peak for 1 % more [%]")
        width = answer["band_hz"]
        bands.set_title("no resonance band" if width is None else f"band of {width:.4g} Hz")
        bands.set_xlabel("change of the band for 1 % more [%]")
    return page
