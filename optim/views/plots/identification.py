"""Measured data with the fit drawn over them, and its 95 % band."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from solver.jit.fourier import Real
from solver.results import units
from solver.views.plots import style
from solver.views.plots.style import Into

Run = Mapping[str, Any]
_BAND = 1.96
_NAMED = 8  # runs up to which each is in the legend
LOOP, MODE = "loop", "mode"


def identification_figure(answer: Mapping[str, Any], *, ax: Into = None) -> Figure:
    """Responses over frequency, and loops beside them where there are any.

    Parameters
    ----------
    answer : the JSON of `optim.Identification`, with at least one run.
    """
    runs: Sequence[Run] = answer["runs"]
    loops = [run for run in runs if run["kind"] == LOOP]
    modes = [run for run in runs if run["kind"] == MODE]
    responses = [run for run in runs if run["kind"] not in (LOOP, MODE)]
    panels = [shown for shown in (responses, loops, modes) if shown]
    with style.styled():
        page, axes = style.figure(5.6 * len(panels), 3.9, columns=len(panels), into=ax)
        for one, shown in zip(axes, panels, strict=False):
            draw = _draw_responses if shown is responses else _draw_modes if shown is modes else _draw_loops
            draw(one, shown)
            one.set_title(f"{answer['scene']}: data, fit and 95 % band")
    return page


def _draw_responses(axes: Axes, runs: Sequence[Run]) -> None:
    """Draw amplitudes over frequency."""
    top = max(float(np.max(run["data"])) for run in runs)
    unit = units.length_unit(top)
    for run, colour in zip(runs, _colours(len(runs)), strict=True):
        order = np.argsort(run["x"])
        _draw(axes, run, colour, unit.per_metre, order, markers="o")
    axes.set_yscale("log")
    style.plain_log(axes.yaxis)
    dofs = dict.fromkeys(run["dof"] for run in runs)
    style.label(axes, "frequency [Hz]", f"amplitude of {', '.join(dofs)} [{unit.name}]")
    _legend(axes, runs)


def _draw_loops(axes: Axes, runs: Sequence[Run]) -> None:
    """Draw force over motion."""
    unit = units.length_unit(max(float(np.abs(run["x"]).max()) for run in runs))
    for run, colour in zip(runs, _colours(len(runs)), strict=True):
        scaled = {**run, "x": (np.asarray(run["x"]) * unit.per_metre).tolist()}
        _draw(axes, scaled, colour, 1.0, np.arange(len(run["x"])), markers=".")
    style.label(axes, f"motion [{unit.name}]", "force [N]")
    _legend(axes, runs)


def _draw_modes(axes: Axes, runs: Sequence[Run]) -> None:
    """Draw damping ratios, or frequencies, over the modal amplitude."""
    for run, colour in zip(runs, _colours(len(runs)), strict=True):
        _draw(axes, run, colour, 1.0, np.argsort(run["x"]), markers="o")
    axes.set_xscale("log")
    style.label(axes, "modal amplitude a [√kg m]", ", ".join(dict.fromkeys(run["quantity"] for run in runs)))
    _legend(axes, runs)


def _draw(axes: Axes, run: Run, colour: str, scale: float, order: np.ndarray, *, markers: str) -> None:
    x = np.asarray(run["x"])[order]
    data, fit, sd = (_numbers(run[key])[order] * scale for key in ("data", "fit", "fit_sd"))
    axes.plot(x, data, marker=markers, markersize=2.8, linestyle="none", color=colour, alpha=0.55)
    axes.plot(x, fit, color=colour, linewidth=1.2, label=_name(run))
    if run["kind"] != LOOP:
        low = np.maximum(fit - _BAND * sd, 1e-3 * fit)
        axes.fill_between(x, low, fit + _BAND * sd, color=colour, alpha=0.25, linewidth=0.0)


def _numbers(values: Sequence[float | None]) -> Real:
    return np.array([math.nan if value is None else value for value in values], dtype=np.float64)


def _name(run: Run) -> str:
    conditions: Mapping[str, float] = run["conditions"]
    told = [style.quantity(path, value, 4) for path, value in conditions.items()]
    return ", ".join(told) or str(run["source"])


def _legend(axes: Axes, runs: Sequence[Run]) -> None:
    if len(runs) <= _NAMED:
        axes.legend(loc="best", fontsize=7.5)


def _colours(count: int) -> list[str]:
    from matplotlib.colors import to_hex

    return [to_hex(colormaps["viridis"](place)) for place in np.linspace(0.0, 0.85, max(count, 1))]
