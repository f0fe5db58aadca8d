"""Figure 11: the disk under different normal loads N0 of the shrouds, N1 = 0.3 N0."""

from look import FOUR, FREE, STUCK, curve, figure, finish, highest, linear_limits, say, shades

import stickslip

scene = stickslip.load_scene("bladed-disk")
loads = [80, 90, 100, 200, 500, 1000, 3000]  # N
responses = {N0: stickslip.sweep(scene.with_values({"shroud.N0": N0}), limit=0.08e-3) for N0 in loads}
free, stuck = linear_limits(scene, "shroud")
best = stickslip.design(scene, variables={"shroud.N0": (20.0, 3000.0)})

with figure("figure11") as (left, right):
    left.semilogy(*curve(free, 1e3), label="removed", **FREE)
    left.semilogy(*curve(stuck, 1e3), label="stuck", **STUCK)
    for (N0, branch), color in zip(responses.items(), shades(len(loads)), strict=True):
        left.semilogy(*curve(branch, 1e3), color=color, label=f"{N0}")
    left.set_ylim(4e-3, 10.0)
    finish(left, "frequency [Hz]", "max |tip| [mm]", legend="N0 [N]")
    for (letter, color), at in zip(FOUR.items(), (575.0, 700.0, 755.0, 785.0), strict=True):
        branch = stickslip.sweep(scene, "shroud.N0", 20.0, 3000.0, frequency_hz=at)
        right.loglog(*curve(branch, 1e3), color=color, label=f"{letter}: {at:.0f} Hz")
    finish(right, "N0 [N]", "max |tip| [mm]", legend="")

say("resonance, shroud removed", f"{highest(free).at:.1f} Hz")
say("resonance, shroud stuck", f"{highest(stuck).at:.1f} Hz")
say("best load", f"{best.optimum['shroud.N0']:.1f} N, peak {1e3 * best.peak.value:.4f} mm")
for N0, branch in responses.items():
    peak, band = highest(branch), branch.band
    say(
        f"N0 = {N0} N",
        f"{1e3 * peak.value:.4f} mm at {peak.at:.1f} Hz, {band.width:.0f} Hz above 0.08 mm",
    )
