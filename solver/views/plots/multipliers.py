"""Floquet multipliers in the complex plane."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from solver.views.plots import style
from solver.views.plots.style import Into

if TYPE_CHECKING:
    from solver.response.stability.floquet import Stability


def multipliers_figure(found: Stability, *, ax: Into = None) -> Figure:
    """The multipliers and the unit circle, inside which perturbations die out.

    Parameters
    ----------
    found : of one response.
    ax : axes to draw into, as `solver.views.plots.style.figure`.
    """
    around = np.linspace(0.0, 2.0 * np.pi, 361)
    outside = np.abs(found.multipliers) > 1.0
    with style.styled():
        page, (axes,) = style.figure(3.8, 3.6, into=ax)
        axes.plot(np.cos(around), np.sin(around), color=style.GREY, linewidth=0.9)
        for these, color, marker in ((~outside, style.BLUE, "o"), (outside, style.VERMILION, "D")):
            some = found.multipliers[these]
            axes.plot(some.real, some.imag, color=color, marker=marker, markersize=4.0, linestyle="none")
        axes.set_aspect("equal", adjustable="datalim")
        style.label(axes, "real part of the multiplier", "imaginary part")
        words = "stable" if found.stable else "not stable"
        axes.set_title(f"{found.frequency_hz:.6g} Hz, {words}")
    return page
