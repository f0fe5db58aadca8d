"""The nodal-diameter diagram of a disk: its frequencies, shrouds free and stuck, with the excitation.

Reads disk.toml in the folder it is run in, and writes disk-diameters.png.
"""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

import solver

HIGHEST = 900.0  # Hz


def main() -> None:
    """Draw."""
    disk = solver.load_scene("disk.toml")
    half = disk.structure.sector_count // 2
    diagram = solver.interference_diagram(disk, families=6)
    figure = Figure(figsize=(6.0, 4.2), layout="constrained")
    axes = figure.subplots()
    for key, colour, words in (
        ("open_hz", "tab:blue", "shrouds free"), ("stuck_hz", "tab:red", "shrouds stuck"),
    ):  # fmt: skip
        families = np.array([getattr(point, key) for point in diagram.points])
        families[families > HIGHEST] = np.nan
        diameters = [point.diameter for point in diagram.points]
        axes.plot(diameters, families, "o-", color=colour, markersize=3.5, linewidth=0.9)
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
