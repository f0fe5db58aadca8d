"""What one per cent of every parameter does to the highest peak and to the band, as bars."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from service.plots import style

if TYPE_CHECKING:
    from optim.elasticities import SensitivityResult

_MOST = 20
_HALF = 0.38


def sensitivity_figure(found: SensitivityResult) -> Figure:
    """Bars of the parameters that have per cents, what matters most for the highest peak on top.

    Parameters
    ----------
    found : with at least one parameter.
    """
    shares = [(row.path, found.peak_elasticities(row)[0], found.band_elasticity(row)) for row in found.rows]
    shown = [one for one in shares if math.isfinite(one[1]) or math.isfinite(one[2])][:_MOST]
    places = list(range(len(shown)))
    with style.styled():
        page, (axes,) = style.figure(6.0, 1.4 + 0.32 * len(shown))
        bars = (
            ("highest peak", [one[1] for one in shown], style.BLUE),
            ("band", [one[2] for one in shown], style.SKY),
        )
        for offset, (name, widths, color) in zip((-0.5, 0.5), bars, strict=True):
            known = [width if math.isfinite(width) else 0.0 for width in widths]
            axes.barh([p + offset * _HALF for p in places], known, height=_HALF, color=color, label=name)
        axes.axvline(0.0, color=style.INK, linewidth=0.8)
        axes.set_yticks(places, labels=[one[0] for one in shown])
        axes.invert_yaxis()
        axes.grid(visible=False, axis="y")
        style.label(axes, "change for 1 % more of the parameter [%]", "")
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        axes.set_title(found.scene.name)
    return page
