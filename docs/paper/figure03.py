"""Figure 3: a contact that separates, its response over frequency and the harmonics in it."""

import numpy as np
from look import FREE, STUCK, curve, figure, finish, harmonic, highest, letters, linear_limits, say, shades

import stickslip

scene = stickslip.load_scene("two-dof").with_values({"damper.N0": 100.0, "damper.N1": 200.0})
branch = stickslip.sweep(scene)
free, stuck = linear_limits(scene, "damper")
points = {"a": 2.328, "b": 1.198, "c": 0.769, "d": 0.346}  # Hz
solved = {letter: stickslip.solve(scene, frequency_hz=at) for letter, at in points.items()}

with figure("figure03") as (left, right):
    left.plot(*curve(free), label="removed", **FREE)
    left.plot(*curve(stuck), label="stuck", **STUCK)
    left.plot(*curve(branch), label="N1 = 200 N")
    letters(left, [(letter, points[letter], found.max_abs) for letter, found in solved.items()])
    left.set_ylim(0.0, 6.0)
    finish(left, "frequency [Hz]", "max |m2| [m]", legend="contact")
    for k, color in zip(range(1, 6), shades(5), strict=True):
        right.semilogy(branch.values, harmonic(branch, k), color=color, label=f"{k}")
    right.set_ylim(1e-3, 5.0)
    finish(right, "frequency [Hz]", "amplitude of m2 [m]", legend="harmonic")

peaks = [peak for peak in branch.peaks if peak.interior]
main = [peak.at for peak in peaks if peak.at > 0.7]
low = sorted(peak.at for peak in peaks if 0.3 < peak.at < 0.7)
say("highest peak", f"{highest(branch).value:.3f} m at {highest(branch).at:.3f} Hz")
say("resonance near a", f"{max(main):.3f} Hz")
say("resonance near b", f"{highest(branch).at:.3f} Hz")
say("super-harmonic resonances", " and ".join(f"{at:.3f}" for at in low) + " Hz")
fine = stickslip.branches.ContinuationSettings(largest_step=0.05)  # the largest of a ratio stands at a point
for phase, name in ((0.0, "in phase"), (0.25 * np.pi, "load 45° ahead")):
    other = stickslip.sweep(scene.with_values({"damper.N1_phase": phase}), settings=fine)
    ratios = [(harmonic(other, k) / harmonic(other, 1))[other.values < 0.6].max() for k in (2, 3)]
    say(f"harmonics 2 and 3 below 0.6 Hz, {name}", "up to {:.2f} and {:.2f} of the first".format(*ratios))
