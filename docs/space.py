"""Pictures and figures of the shipped scenes in space: `python docs/space.py docs/img [SCENE …]`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes

import solver
from solver.views.plots import style


class Study(NamedTuple):
    """What a picture varies: a path with its unit, values of the responses, range of the peaks, harmonics."""

    path: str
    unit: str
    shown: tuple[float, float, float]
    low: float
    high: float
    harmonics: int


STUDIES = {
    "platform-wedge": Study("wedge.mass", "kg", (0.004, 0.016, 0.064), 0.002, 0.25, 5),
    "platform-cylinder": Study("cylinder.mass", "kg", (0.004, 0.016, 0.064), 0.002, 0.25, 5),
    "shroud-3d": Study("shroud.N0", "N", (20.0, 80.0, 400.0), 15.0, 1000.0, 3),
}
COLOURS = (style.BLUE, style.GREEN, style.VERMILION)
STEPS = 13


def response(name: str, value: float) -> solver.Branch:
    """Sweep a scene with one value of what its study varies; say so where it ends early."""
    study = STUDIES[name]
    branch = solver.sweep(solver.load_scene(name).with_values({study.path: value}), harmonics=study.harmonics)
    if not branch.reached:
        print(f"{name} {study.path} {value:.4g}: {branch.status.name}", flush=True)
    return branch


def draw(name: str, left: Axes, right: Axes) -> None:
    """Draw responses for three values, and the highest peak over the value."""
    study = STUDIES[name]
    for value, colour in zip(study.shown, COLOURS, strict=True):
        branch = response(name, value)
        left.plot(
            branch.values, 1e6 * branch.half_peak_to_peak, color=colour, label=f"{value:g} {study.unit}"
        )
    left.set(xlabel="frequency in Hz", ylabel="half peak to peak in µm", yscale="log")
    left.set_title(f"{name}: {study.path}")
    left.legend(frameon=False)
    values = np.geomspace(study.low, study.high, STEPS)
    peaks = np.full(STEPS, np.nan)  # a branch that ends early has no highest point
    for i, value in enumerate(values):
        branch = response(name, float(value))
        if branch.reached:
            highest = int(branch.half_peak_to_peak.argmax())
            peaks[i] = 1e6 * branch.half_peak_to_peak[highest]
            where = f"{peaks[i]:.2f} µm at {branch.values[highest]:.2f} Hz"
            print(f"{name} {study.path} {value:.4g} {study.unit}: {where}", flush=True)
    right.plot(values, peaks, "o-", markersize=3.0, color=style.INK)
    right.set(
        xlabel=f"{study.path} in {study.unit}", ylabel="highest in the band in µm", xscale="log", yscale="log"
    )


def main(folder: Path, names: list[str]) -> None:
    """Write a picture for each scene."""
    for name in names:
        with style.styled():
            figure, axes = style.figure(7.0, 2.9, columns=2)
            draw(name, *axes)
            style.write(figure, folder / f"{name}.png", "png")


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:] or list(STUDIES))
