"""A nonlinear mode: frequency and damping ratio over the amplitude, where contacts slip."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from solver.results import units
from solver.results.measures import Measured
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
    unit = units.length_unit(float(heights[good].min(initial=1.0)))
    with style.styled():
        page, (axes,) = style.figure(5.0, 3.3, into=ax)
        axes.loglog(places[good], heights[good] * unit.per_metre, color=style.BLUE, label="one mode")
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
