"""The pictures of docs/modes.md: `python docs/modes.py docs/img`; it sweeps for some minutes."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import solver
from benchmarks.modes import CASES, Case
from solver.views.plots import style

PATH = "excitation.amplitude"
LEVELS = 33
COLOURS = (style.BLUE, style.VERMILION, style.GREEN, "#7a4fa3")


def compared(case: Case) -> tuple[solver.PerformanceCurve, NDArray[np.float64], NDArray[np.float64]]:
    """Return the curve from the mode, factors on the excitation, and the peaks of whole responses there."""
    scene = solver.load_scene(case.scene)
    found = solver.nonlinear_mode(
        scene, case.mode, amplitudes=case.amplitudes, harmonics=case.harmonics, errors=False
    )
    levels = np.geomspace(*case.factors, LEVELS)
    peaks = np.full(LEVELS, np.nan)
    for i, level in enumerate(levels):
        there = scene.with_values({PATH: scene.value(PATH) * float(level)})
        branch = solver.sweep(there, harmonics=case.harmonics)
        if branch.reached and branch.peak is not None:
            peaks[i] = branch.peak.value
        else:
            print(f"{case.scene} at {level:.4g} times its excitation: {branch.status.value}")
    return solver.performance_curve(found), levels, peaks


def two_masses(
    folder: Path, curve: solver.PerformanceCurve, levels: NDArray[np.float64], peaks: NDArray[np.float64]
) -> None:
    """Damping curve of the two masses, and the performance curve beside peaks of whole responses."""
    found = curve.mode
    with style.styled():
        page, (left, right) = style.figure(8.0, 3.3, columns=2)
        left.semilogx(found.amplitude, 100.0 * found.damping_ratio, color=style.BLUE)
        left.set_xlim(0.1, 300.0)
        style.label(left, "modal amplitude a [√kg m]", "damping ratio [%]")
        left.yaxis.label.set_color(style.BLUE)
        twin = left.twinx()
        twin.semilogx(found.amplitude, found.frequency_hz, color=style.GREEN)
        twin.set_ylabel("frequency [Hz]", color=style.GREEN)
        twin.grid(visible=False)
        left.set_title("two-dof, mode 1")
        right.loglog(curve.load, curve.peak_at_load, color=style.BLUE, label="one nonlinear mode")
        exact = peaks / levels
        right.loglog(1.0 / levels, exact, "o", color=style.VERMILION, markersize=3.5, label="whole responses")
        right.set_xlim(0.125, 20.0)
        right.set_ylim(1.5, 20.0)
        style.label(right, "factor on the load", "peak of max |m2| [m]")
        style.plain_log(right.xaxis)
        style.plain_log(right.yaxis)
        right.legend()
        style.write(page, folder / "modes.png", "png")


def main(folder: Path) -> None:
    """Compute and draw."""
    with style.styled():
        page, (axes,) = style.figure(8.0, 3.6, columns=1)
        axes.axhline(0.0, color="0.6", linewidth=0.8)
        for case, colour in zip(CASES, COLOURS, strict=True):
            curve, levels, peaks = compared(case)
            estimates = np.array([curve.at_excitation(float(level))[0] for level in levels])
            errors = 100.0 * (estimates / peaks - 1.0)
            axes.semilogx(levels, errors, "o-", color=colour, markersize=3.0, label=case.scene)
            if case.scene == "two-dof":
                two_masses(folder, curve, levels, peaks)
        style.label(axes, "factor on the excitation", "error of the peak [%]")
        style.plain_log(axes.xaxis)
        axes.legend()
        style.write(page, folder / "modes-error.png", "png")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
