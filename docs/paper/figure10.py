"""Figure 10: harmonics in the response of the blade tip, and how the motion converges with their number."""

import numpy as np
from look import MARCHED, figure, finish, harmonic, say, shades

import stickslip

scene = stickslip.load_scene("bladed-disk").with_values({"shroud.N0": 200.0, "shroud.N1": 400.0})
branch = stickslip.sweep(scene)
marched = stickslip.march(scene, frequency_hz=755.0, tolerance=1e-6)
kept = {H: stickslip.solve(scene, frequency_hz=755.0, harmonics=H) for H in (1, 3, 5, 11)}

with figure("figure10") as (left, right):
    for k, color in zip(range(1, 6), shades(5), strict=True):
        left.semilogy(branch.values, 1e3 * harmonic(branch, k), color=color, label=f"{k}")
    left.set_ylim(1e-4, 1.0)
    finish(left, "frequency [Hz]", "amplitude of tip [mm]", legend="harmonic")
    for (H, found), color in zip(kept.items(), shades(len(kept)), strict=True):
        time, x = stickslip.solutions.time_history(found, "tip")
        right.plot(1e3 * time, 1e3 * x, color=color, label=f"{H} harmonics" if H > 1 else "1 harmonic")
    some = np.linspace(0, marched.time.size - 1, 41, dtype=int)[:-1]
    right.plot(1e3 * marched.time[some], 1e3 * marched.displacement[some], label="marched", **MARCHED)
    finish(right, "time [ms]", "tip [mm]", title="755 Hz", legend="")

for H, found in kept.items():
    say(f"max |tip| at 755 Hz, harmonics 1 to {H}", f"{1e6 * found.max_abs:.1f} µm")
say("max |tip| at 755 Hz, time marching", f"{1e6 * marched.max_abs:.1f} µm")
share = (harmonic(branch, 2) / harmonic(branch, 1)).max()
say("largest ratio of harmonic 2 to 1", f"{share:.2f}")
