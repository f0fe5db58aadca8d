"""Which super-harmonic resonance is at 0.769 Hz: the third of the second mode, 2 % of the motion here."""

from look import curve, figure, finish, harmonic, linear_limits, say, shades

import stickslip

C = 0.769  # Hz, the paper's point c
two = stickslip.load_scene("two-dof")
scene = two.with_values({"damper.N0": 100.0, "damper.N1": 200.0})
first = stickslip.Scene.from_dict({**scene.to_dict(), "observe": {"dof": "m1", "band": [0.2, 2.6]}})
modes = [max(p.at for p in limit.peaks) for limit in linear_limits(first, "damper")]
stiffness = (30.0, 60.0, 100.0)  # N/m, the first as given
swept = {kt: stickslip.sweep(scene.with_values({"damper.kt": kt})) for kt in stiffness}
moved = {kt: stickslip.sweep(first.with_values({"damper.kt": kt})) for kt in stiffness}

with figure("superharmonics") as (left, right):
    for kt, color in zip(stiffness, shades(3), strict=True):
        left.plot(*curve(swept[kt]), color=color, label=f"{kt:g} N/m")
        right.semilogy(moved[kt].values, harmonic(moved[kt], 3), color=color)
    for axes, bounds in ((left, (0.0, 2.5)), (right, (1e-3, 0.3))):
        axes.axvline(C, color="#7A7A7A", linewidth=0.8, linestyle=":")
        axes.set(xlim=(0.3, 1.0), ylim=bounds)
    finish(left, "frequency [Hz]", "max |m2| [m]", legend="kt")
    finish(right, "frequency [Hz]", "harmonic 3 of m1 [m]")

small_steps = stickslip.branches.ContinuationSettings(largest_step=0.01)
near = stickslip.sweep(first, "frequency", 0.7, 0.85, settings=small_steps)
top = harmonic(near, 3).argmax()
three, one, at = harmonic(near, 3)[top], harmonic(near, 1)[top], near.values[top]
say("second mode, removed and stuck", " and ".join(f"{f:.3f}" for f in modes) + " Hz")
say("a third of it", " and ".join(f"{f / 3:.3f}" for f in modes) + " Hz")
say("harmonic 3 of m1, highest", f"{three:.3f} m, {100.0 * three / one:.1f} % of 1, at {at:.3f} Hz")
for at in (0.517, C):
    found, marched = stickslip.solve(scene, frequency_hz=at), stickslip.march(scene, frequency_hz=at)
    say(f"max |m2| at {at} Hz", f"{found.max_abs:.4f} m, time marching {marched.max_abs:.4f} m")
for kt, branch in swept.items():
    peaks = [f"{p.at:.3f} Hz" for p in branch.peaks if p.interior and abs(p.at / C - 1.0) < 0.03]
    best = stickslip.design(two.with_values({"damper.kt": kt}), variables={"damper.N0": (20.0, 500.0)})
    load = best.optimum["damper.N0"]
    say(f"resonance near, kt = {kt:g} N/m", f"{', '.join(peaks) or 'none'}; best load {load:.1f} N")
