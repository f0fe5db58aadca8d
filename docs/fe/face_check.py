"""The response of the blade with a face, in few motions and in all of them: a picture and the differences.

Reads face.toml and full.toml, the scene with every DOF of the face, of the folder it is run in.
"""

from __future__ import annotations

import matplotlib.pyplot as plt

import solver

HARMONICS, LOADS = 5, (0.0, 300.0, 3000.0)  # N


def main() -> None:
    """Sweep both with each load, draw face-response.png and print how far apart the peaks are."""
    scenes = {name: solver.load_scene(f"{name}.toml") for name in ("full", "face")}
    figure, axes = plt.subplots(figsize=(7.0, 4.2), layout="constrained")
    for load, colour in zip(LOADS, ("#0072b2", "#d55e00", "#009e73"), strict=True):
        found = {
            name: solver.sweep(scene.with_values({"plat.N0": load}), harmonics=HARMONICS)
            for name, scene in scenes.items()
        }
        full, few = found["full"], found["face"]
        axes.semilogy(full.values, 1e3 * full.amplitude, color=colour, lw=3.0, alpha=0.35)
        axes.semilogy(few.values, 1e3 * few.amplitude, color=colour, lw=1.0, label=f"{load:g} N")
        off = abs(few.peak.value / full.peak.value - 1.0)
        print(
            f"{load:g} N: {1e3 * few.peak.value:.5g} mm at {few.peak.at:.6g} Hz, in all motions "
            f"{1e3 * full.peak.value:.5g} mm at {full.peak.at:.6g} Hz, {off:.1e} of it apart"
        )
    axes.set(xlabel="frequency [Hz]", ylabel="amplitude of the tip [mm]")
    axes.legend(title="load on the face")
    figure.savefig("face-response.png", dpi=150)


if __name__ == "__main__":
    main()
