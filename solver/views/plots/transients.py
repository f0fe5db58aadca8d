"""What is no periodic response: runs through frequencies, tori of two of them, hours of wear."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from solver.results import units
from solver.results.measures import MAX_ABS, WORDS, Measured
from solver.views.plots import style
from solver.views.plots.style import Into
from solver.views.plots.tracks import numbers

_NAMED = 6  # lines of a spectrum with their sum beside them
_MOST_CONTACTS = 12  # that wear, with a line each and a name


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


def torus_figure(found: Mapping[str, Any], *, ax: Into = None) -> Figure:
    """Draw the lines k f₁ + l f₂, and displacement and velocity at each turn of the first frequency.

    The result is as its `to_json` gives it, with at least one line.
    """
    unit = units.length_unit(found["max_abs"])
    hertz, lines = numbers(found["line_hz"]), numbers(found["line_amplitude"]) * unit.per_metre
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
            numbers(found["section"]) * unit.per_metre,
            numbers(found["section_velocity"]) * unit.per_metre,
            "o" if found["repeats"] else "-", color=style.BLUE, markersize=3.0,
        )  # fmt: skip
        spectrum.set_title(f"{found['scene']}, {found['frequency_hz']:.5g} and {found['second_hz']:.5g} Hz")
        section.set_title("once in each turn of the first")
        style.label(spectrum, "frequency [Hz]", f"{found['dof']} [{unit.name}]")
        style.label(section, f"{found['dof']} [{unit.name}]", f"velocity [{unit.name}/s]")
    return page


def wear_life_figure(found: Mapping[str, Any], *, ax: Into = None) -> Figure:
    """Draw the amplitude over the hours with its limit, and the load and the depth of each contact.

    The result is as its `to_json` gives it, with at least one instant.
    """
    hours, amplitude = numbers(found["hours"]), numbers(found["amplitude"])
    measured, depths = Measured.of_result(found), np.array(found["depths"])
    length = measured.unit_for(float(amplitude.max()))
    depth = units.length_unit(float(depths.max()))
    with style.styled():
        page, (response, loads, worn) = style.figure(10.5, 3.4, columns=3, into=ax)
        response.plot(hours, amplitude * length.per_metre, color=style.BLUE)
        for at in found["switches"]:
            response.axvline(at, color=style.GREY, linewidth=0.6)
        if found["limit"] is not None:
            response.axhline(found["limit"] * length.per_metre, color=style.VERMILION, linewidth=0.8)
        if found["hours_to_limit"] is not None:
            at = found["hours_to_limit"]
            response.plot(
                [at], [found["limit"] * length.per_metre], "o", color=style.VERMILION, markersize=4.0
            )
            response.set_title(f"limit after {units.number(at, 4)} h")
        else:
            response.set_title(found["scene"])
        rows = zip(found["contacts"], found["loads"], depths, strict=True)
        for name, load, deep in list(rows)[:_MOST_CONTACTS]:
            loads.plot(hours, numbers(load), label=name)
            worn.plot(hours, deep * depth.per_metre)
        loads.legend()
        style.label(response, "running time [h]", measured.label("", length))
        style.label(loads, "running time [h]", "normal load [N]")
        style.label(worn, "running time [h]", f"depth [{depth.name}]")
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
    unit = units.length_unit(float(np.nanmax(largest)))
    tones = (
        ("first_amplitude", style.VERMILION, "at the first"),
        ("second_amplitude", style.GREEN, "at the second"),
    )
    with style.styled():
        page, (axes,) = style.figure(5.6, 3.6, columns=1, into=ax)
        axes.plot(
            hertz, largest * unit.per_metre, "o-", color=style.BLUE, markersize=2.8, label=WORDS[MAX_ABS]
        )
        for key, colour, words in tones:
            axes.plot(hertz, numbers(found[key]) * unit.per_metre, color=colour, label=f"amplitude {words}")
        axes.axvline(found["second_hz"], color=style.GREY, linewidth=0.8, linestyle=":")
        axes.set_title(f"{found['scene']} with {found['second_hz']:.5g} Hz beside")
        style.label(axes, "first frequency [Hz]", f"{found['dof']} [{unit.name}]")
        axes.set_ylim(bottom=0.0)
        axes.legend()
    return page
