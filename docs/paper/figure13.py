"""Figure 13: amplitude over frequency and normal load, with the highest peak as a white line."""

from look import figure, finish, say
from matplotlib.colors import LogNorm

import solver
from solver.plots.tracks import ridge_lines

scene = solver.load_scene("bladed-disk")
maps = {
    "N0": solver.response_map(scene, "shroud.N0", 20.0, 3000.0, frequencies=200, steps=50),
    "N1": solver.response_map(scene, "shroud.N1", 0.0, 500.0, frequencies=200, steps=40),
}
with figure("figure13", height=3.8) as panels:
    for (name, found), axes in zip(maps.items(), panels, strict=True):
        mesh = axes.pcolormesh(
            found.parameter,
            found.frequency,
            1e3 * found.amplitude.T,
            norm=LogNorm(5e-3, 5.0),
            shading="gouraud",
        )
        axes.plot(*ridge_lines(found.ridge), color="white")
        axes.grid(visible=False)
        axes.set_xscale("log" if name == "N0" else "linear")
        finish(axes, f"shroud.{name} [N]", "frequency [Hz]")
    panels[0].figure.colorbar(mesh, ax=panels, label="max |tip| [mm]", format="%g")

least, track = maps["N0"].ridge.optimum, maps["N1"].ridge
say("least of the highest peak over N0", f"{least.at:.1f} N, {1e3 * least.peak:.4f} mm")
say("highest peak at N0 = 20 N", f"{1e3 * maps['N0'].ridge.peak[0]:.2f} mm")
say("highest peak at N1 = 0", f"{1e3 * track.peak[0]:.4f} mm at {track.frequency[0]:.0f} Hz")
say("highest peak at N1 = 500 N", f"{1e3 * track.peak[-1]:.3f} mm at {track.frequency[-1]:.0f} Hz")
