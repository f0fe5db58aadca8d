"""Figure 5: effect of the excitation level f0."""

from look import FOUR, FREE, STUCK, curve, figure, finish, highest, linear_limits, say, shades

import stickslip

scene = stickslip.load_scene("two-dof").with_values({"damper.N0": 100.0, "damper.N1": 30.0})
levels = [5, 10, 20, 50, 100, 200, 300]  # N
responses = {f0: stickslip.sweep(scene.with_values({"excitation.amplitude": f0})) for f0 in levels}
free, stuck = linear_limits(scene, "damper")

with figure("figure05") as (left, right):
    for (f0, branch), color in zip(responses.items(), shades(len(levels)), strict=True):
        left.semilogy(*curve(branch), color=color, label=f"{f0}")
    left.axvline(highest(free).at, **FREE)
    left.axvline(highest(stuck).at, **STUCK)
    left.set_xlim(0.2, 2.6)
    finish(left, "frequency [Hz]", "max |m2| [m]", legend="f0 [N]")
    for (letter, color), at in zip(FOUR.items(), (2.328, 1.198, 0.769, 0.346), strict=True):
        branch = stickslip.sweep(scene, "excitation.amplitude", 1.0, 300.0, frequency_hz=at)
        right.plot(*curve(branch), color=color, label=f"{letter}: {at} Hz")
    finish(right, "f0 [N]", "max |m2| [m]", legend="")

say("resonance, contact stuck", f"{highest(stuck).at:.3f} Hz")
say("resonance, contact removed", f"{highest(free).at:.3f} Hz")
for f0 in (5, 10, 20, 50, 100, 300):
    peak = highest(responses[f0])
    say(f"peak at f0 = {f0} N", f"{peak.value:.3f} m at {peak.at:.3f} Hz, {1e3 * peak.value / f0:.1f} mm/N")
