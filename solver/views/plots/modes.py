"""A nonlinear mode: frequency and damping ratio over the amplitude, where contacts slip."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from solver.views.plots import style
from solver.views.plots.style import Into

_AMPLITUDE = "modal amplitude a [√kg m]"
_STUCK = ("stuck", "separated", "closed")


def mode_figure(answer: Mapping[str, Any], *, ax: Into = None) -> Figure:
    """Frequency beside damping ratio; the part in which every contact sticks or is open is thin.

    Parameters
    ----------
    answer : the JSON of `solver.NonlinearMode`, with at least one point.
    ax : axes to draw into, as `solver.views.plots.style.figure`.
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
