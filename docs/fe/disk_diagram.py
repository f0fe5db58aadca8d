"""The nodal-diameter diagram of a disk: its frequencies, shrouds free and stuck, with the excitation.

Reads disk.toml in the folder it is run in, and writes disk-diameters.png.
"""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

import solver
from optim.problem.cases import with_engine_order
from optim.studies.campbell import natural_frequencies

HIGHEST = 900.0  # Hz


def main() -> None:
    """Draw."""
    disk = solver.load_scene("disk.toml")
    half = disk.structure.sector_count // 2
    figure = Figure(figsize=(6.0, 4.2), layout="constrained")
    axes = figure.subplots()
    for stuck, colour, words in ((False, "tab:blue", "shrouds free"), (True, "tab:red", "shrouds stuck")):
        found = [natural_frequencies(with_engine_order(disk, n), stuck=stuck) for n in range(half + 1)]
        families = np.array([each[:6] for each in found])
        families[families > HIGHEST] = np.nan
        axes.plot(families, "o-", color=colour, markersize=3.5, linewidth=0.9)
        axes.plot([], [], "o-", color=colour, markersize=3.5, linewidth=0.9, label=words)
    order = disk.engine_order
    low, high = disk.observe.band
    axes.plot(
        [order, order], [low, high], color="0.4", linewidth=5.0, alpha=0.35, label=f"order {order}, the band"
    )
    axes.set(
        xlabel="nodal diameter", ylabel="natural frequency [Hz]", ylim=(0.0, HIGHEST), xlim=(-0.3, half + 0.3)
    )
    axes.legend(loc="lower right", fontsize=8)
    axes.grid(alpha=0.25)
    figure.savefig("disk-diameters.png", dpi=110)
    print("disk-diameters.png")


if __name__ == "__main__":
    main()
