"""Figure 7: effect of the normal load N0, with N1 = 0.3 N0."""

from look import FOUR, FREE, STUCK, curve, figure, finish, highest, linear_limits, say, shades

import stickslip

scene = stickslip.load_scene("two-dof")
loads = [10, 30, 50, 100, 200, 300, 500]  # N
responses = {N0: stickslip.sweep(scene.with_values({"damper.N0": N0})) for N0 in loads}
free, stuck = linear_limits(scene, "damper")
best = stickslip.design(scene, variables={"damper.N0": (10.0, 500.0)})

with figure("figure07") as (left, right):
    left.plot(*curve(free), label="removed", **FREE)
    left.plot(*curve(stuck), label="stuck", **STUCK)
    for (N0, branch), color in zip(responses.items(), shades(len(loads)), strict=True):
        left.plot(*curve(branch), color=color, label=f"{N0}")
    left.plot([best.peak.at], [best.peak.value], "o", color="black", markersize=4.5)
    left.set_ylim(0.0, 7.0)
    finish(left, "frequency [Hz]", "max |m2| [m]", legend="N0 [N]")
    for (letter, color), at in zip(FOUR.items(), (2.328, 1.198, 0.769, 0.346), strict=True):
        branch = stickslip.sweep(scene, "damper.N0", 1.0, 500.0, frequency_hz=at)
        right.plot(*curve(branch), color=color, label=f"{letter}: {at} Hz")
    finish(right, "N0 [N]", "max |m2| [m]", legend="")

say("best of the loads drawn", f"{min(loads, key=lambda N0: highest(responses[N0]).value)} N")
say("best load of all", f"{best.optimum['damper.N0']:.1f} N, peak {best.peak.value:.3f} m")
for N0 in (10, 100, 500):
    say(f"peak at N0 = {N0} N", f"{highest(responses[N0]).value:.3f} m at {highest(responses[N0]).at:.3f} Hz")
