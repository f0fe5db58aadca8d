"""Quasi-periodic responses drawn."""

from __future__ import annotations
from collections.abc import Mapping
from typing import Any
import numpy as np
from matplotlib.figure import Figure
from solver.results import units
from solver.results.known import MAX_ABS, WORDS
from solver.views.plots import style
from solver.views.plots.style import Into
from solver.views.plots.tracks import numbers

_NAMED = 6  # lines of a spectrum with their sum beside them


def torus_figure(found: Mapping[str, Any], *, ax: Into = None) -> Figure:
    """Draw the lines k f₁ + l f₂, and displacement and velocity at each turn of the first frequency.

    The result is as its `to_json` gives it, with at least one line.
    """
    unit = units.shown_unit(found["max_abs"])
    hertz, lines = numbers(found["line_hz"]), numbers(found["line_amplitude"]) * unit.per_one
    with style.styled():
        page, (spectrum, section) = style.figure(9.2, 3.6, columns=2, into=ax)
        spectrum.semilogy(hertz, lines, "o", color=style.BLUE, markersize=3.0)
        spectrum.vlines(hertz, lines.min(), lines, color=style.BLUE, linewidth=0.8)
        for i in range(min(_NAMED, lines.size)):
            k, l = found["line_first"][i], found["line_second"][i]  # noqa: E741
            spectrum.annotate(
                f"{k}, {l}", (hertz[i], lines[i]), xytext=(3, 3), textcoords="offset points", fontsize=7
            )
        section.plot(
            numbers(found["section"]) * unit.per_one,
            numbers(found["section_velocity"]) * unit.per_one,
            "o" if found["repeats"] else "-", color=style.BLUE, markersize=3.0,
        )  # fmt: skip
        spectrum.set_title(
            f"{found['scene']}, {units.number(found['frequency_hz'])} and {units.hertz(found['second_hz'])}"
        )
        section.set_title("once in each turn of the first")
        style.label(spectrum, "frequency [Hz]", f"{found['dof']} [{unit.name}]")
        style.label(section, f"{found['dof']} [{unit.name}]", f"velocity [{unit.name}/s]")
    return page


def torus_drawn(found: Mapping[str, Any], *, ax: Into = None) -> Figure:
    """Draw a response or a curve of them, whichever it is."""
    return (torus_curve_figure if isinstance(found["frequency_hz"], list) else torus_figure)(found, ax=ax)


def torus_curve_figure(found: Mapping[str, Any], *, ax: Into = None) -> Figure:
    """Draw the largest displacement, and the amplitudes of both tones, over the first frequency.

    Parameters
    ----------
    found : as its `to_json` gives it, with at least one response.
    """
    hertz, largest = numbers(found["frequency_hz"]), numbers(found["max_abs"])
    unit = units.shown_unit(float(np.nanmax(largest)))
    tones = (
        ("first_amplitude", style.VERMILION, "at the first"),
        ("second_amplitude", style.GREEN, "at the second"),
    )
    with style.styled():
        page, (axes,) = style.figure(5.6, 3.6, columns=1, into=ax)
        axes.plot(hertz, largest * unit.per_one, "o-", color=style.BLUE, markersize=2.8, label=WORDS[MAX_ABS])
        for key, colour, words in tones:
            axes.plot(hertz, numbers(found[key]) * unit.per_one, color=colour, label=f"amplitude {words}")
        axes.axvline(found["second_hz"], color=style.GREY, linewidth=0.8, linestyle=":")
        axes.set_title(f"{found['scene']} with {units.hertz(found['second_hz'])} beside")
        style.label(axes, "first frequency [Hz]", f"{found['dof']} [{unit.name}]")
        axes.set_ylim(bottom=0.0)
        axes.legend()
    return page
