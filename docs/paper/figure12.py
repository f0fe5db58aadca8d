"""Figure 12: the disk under different fluctuations N1 of the normal load of the shrouds, N0 = 200 N."""

from look import FOUR, curve, figure, finish, highest, say, shades

import stickslip

scene = stickslip.load_scene("bladed-disk")
values = [0, 50, 100, 200, 300, 400, 500]  # N
responses = {N1: stickslip.sweep(scene.with_values({"shroud.N1": N1}), limit=0.08e-3) for N1 in values}

with figure("figure12") as (left, right):
    for (N1, branch), color in zip(responses.items(), shades(len(values)), strict=True):
        left.plot(*curve(branch, 1e3), color=color, label=f"{N1}")
    finish(left, "frequency [Hz]", "max |tip| [mm]", legend="N1 [N]")
    for (letter, color), at in zip(FOUR.items(), (530.0, 700.0, 755.0, 785.0), strict=True):
        branch = stickslip.sweep(scene, "shroud.N1", 0.0, 500.0, frequency_hz=at)
        right.plot(*curve(branch, 1e3), color=color, label=f"{letter}: {at:.0f} Hz")
    finish(right, "N1 [N]", "max |tip| [mm]", legend="")

for N1, branch in responses.items():
    peak, band = highest(branch), branch.band
    say(
        f"N1 = {N1} N",
        f"{1e3 * peak.value:.3f} mm at {peak.at:.1f} Hz, {band.width:.0f} Hz above 0.08 mm",
    )
