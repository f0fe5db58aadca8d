"""Figure 6: effect of the tangential stiffness kt."""

from look import FOUR, curve, figure, finish, say, shades

import stickslip

scene = stickslip.load_scene("two-dof").with_values({"damper.N0": 100.0, "damper.N1": 30.0})
values = [5, 10, 20, 30, 45, 60]  # N/m
responses = {kt: stickslip.sweep(scene.with_values({"damper.kt": kt})) for kt in values}
track = stickslip.peaks.track_peak(scene, "damper.kt", 5.0, 60.0)
first = track.frequency < 2.0  # Hz; beyond it the peak of the second mode is higher

with figure("figure06") as (left, right):
    for (kt, branch), color in zip(responses.items(), shades(len(values)), strict=True):
        left.plot(*curve(branch), color=color, label=f"{kt}")
    left.plot(track.frequency[first], track.peak[first], color="black", linestyle="--", label="peaks")
    finish(left, "frequency [Hz]", "max |m2| [m]", legend="kt [N/m]")
    for (letter, color), at in zip(FOUR.items(), (2.328, 1.198, 0.769, 0.346), strict=True):
        branch = stickslip.sweep(scene, "damper.kt", 1.0, 100.0, frequency_hz=at)
        right.plot(*curve(branch), color=color, label=f"{letter}: {at} Hz")
    finish(right, "kt [N/m]", "max |m2| [m]", legend="")

for kt in (5, 10, 30, 60):
    peak = max((p for p in responses[kt].peaks if p.at < 1.5), key=lambda p: p.value)
    say(f"first peak at kt = {kt} N/m", f"{peak.value:.3f} m at {peak.at:.3f} Hz")
