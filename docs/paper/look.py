"""What the figures share: one style, where the pictures go, and how their numbers are said."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import stickslip
from solver.views.plots.style import BLUE, GREEN, GREY, INK, VERMILION, plain_log, styled

FOUR = dict(zip("abcd", (BLUE, VERMILION, GREEN, "#CC79A7"), strict=True))  # points a, b, c and d
FREE: dict[str, Any] = {"color": GREY, "linestyle": ":", "linewidth": 1.2}
STUCK: dict[str, Any] = {"color": INK, "linestyle": "--", "linewidth": 1.0}
MARCHED: dict[str, Any] = {
    "color": INK, "linestyle": "none", "marker": "o", "markersize": 3.5, "markerfacecolor": "none",
    "markeredgewidth": 0.7, "zorder": 3,
}  # fmt: skip


@contextmanager
def figure(
    name: str, columns: int = 2, rows: int = 1, height: float = 3.3, width: float = 9.6
) -> Iterator[list[Axes]]:
    """Panels to draw into, row by row; then the picture, in the folder given or docs/img/paper."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent.parent / "img" / "paper"
    with styled():
        page = Figure(figsize=(width, height * rows), layout="constrained")
        panels = list(page.subplots(rows, columns, squeeze=False).flat)
        yield panels
        for letter, axes in zip("abcdefgh", panels, strict=False):
            axes.set_title(f"({letter}) {axes.get_title(loc='left')}")
        page.savefig(folder / f"{name}.png", dpi=110)


def say(what: str, value: str) -> None:
    """One row of the table beside the figure."""
    print(f"{what}: {value}")


def shades(count: int) -> list[Any]:
    """Colours from light to dark, one for each of a family."""
    return [colormaps["viridis"](place) for place in np.linspace(0.88, 0.08, count)]


def linear_limits(scene: stickslip.Scene, contact: str) -> tuple[stickslip.Branch, stickslip.Branch]:
    """The response with a contact removed, and with it stuck throughout."""
    free = {f"{contact}.N0": 0.0, f"{contact}.N1": 0.0}
    stuck = {f"{contact}.N0": 1e9, f"{contact}.N1": 0.0}
    return stickslip.sweep(scene.with_values(free)), stickslip.sweep(scene.with_values(stuck))


def harmonic(branch: stickslip.Branch, k: int) -> np.ndarray:
    """Amplitude of a harmonic of the observed DOF along a branch [m]."""
    return np.hypot(branch.observed[:, 2 * k - 1], branch.observed[:, 2 * k])


def curve(branch: stickslip.Branch, unit: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Parameter and amplitude of a branch without folds, its polished peaks among the points."""
    at = np.append(branch.values, [peak.at for peak in branch.peaks])
    height = np.append(branch.amplitude, [peak.value for peak in branch.peaks])
    order = np.argsort(at)
    return at[order], unit * height[order]


def highest(branch: stickslip.Branch) -> stickslip.Peak:
    """The highest peak of a branch that reached its end."""
    if not branch.reached or branch.peak is None:
        raise SystemExit(branch.status.value)
    return branch.peak


def finish(axes: Axes, x: str, y: str, *, title: str = "", legend: str | None = None) -> None:
    """Name the axes, and the curves, beside them, where they need it."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.set_title(title)
    axes.margins(x=0.0)
    if legend is not None:
        axes.legend(
            title=legend, alignment="left", handlelength=1.2, borderaxespad=0.3, loc="center left",
            bbox_to_anchor=(1.0, 0.5),
        )  # fmt: skip
    for axis, scale in ((axes.xaxis, axes.get_xscale()), (axes.yaxis, axes.get_yscale())):
        if scale == "log":
            plain_log(axis)


def letters(axes: Axes, points: Sequence[tuple[str, float, float]]) -> None:
    """Mark points with their letters."""
    for letter, x, y in points:
        axes.plot([x], [y], "o", color=VERMILION, markersize=4.5, zorder=4)
        axes.annotate(
            letter, (x, y), xytext=(4, 4), textcoords="offset points", color=VERMILION, weight="bold"
        )
