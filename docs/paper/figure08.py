"""Figure 8: effect of the fluctuation N1 of the normal load, N0 = 100 N."""

from look import FOUR, curve, figure, finish, highest, say, shades

import stickslip

scene = stickslip.load_scene("two-dof")
values = [0, 50, 100, 150, 200, 300, 500]  # N
responses = {N1: stickslip.sweep(scene.with_values({"damper.N1": N1})) for N1 in values}

with figure("figure08") as (left, right):
    for (N1, branch), color in zip(responses.items(), shades(len(values)), strict=True):
        left.plot(*curve(branch), color=color, label=f"{N1}")
    finish(left, "frequency [Hz]", "max |m2| [m]", legend="N1 [N]")
    for (letter, color), at in zip(FOUR.items(), (2.328, 1.198, 0.769, 0.346), strict=True):
        branch = stickslip.sweep(scene, "damper.N1", 0.0, 500.0, frequency_hz=at)
        right.plot(*curve(branch), color=color, label=f"{letter}: {at} Hz")
    finish(right, "N1 [N]", "max |m2| [m]", legend="")

for N1 in (0, 50, 100, 200, 500):
    branch = responses[N1]
    low = sum(peak.interior and peak.at < 0.7 for peak in branch.peaks)
    peak = highest(branch)
    say(f"N1 = {N1} N", f"{peak.value:.3f} m at {peak.at:.3f} Hz, {low} peaks below 0.7 Hz")
