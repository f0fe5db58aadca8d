"""Figure 4: motion and hysteresis loops at four frequencies, by harmonic balance and by time marching."""

import numpy as np
from look import FOUR, MARCHED, figure, finish, say

import stickslip

scene = stickslip.load_scene("two-dof").with_values({"damper.N0": 100.0, "damper.N1": 200.0})
points = {"a": 2.328, "b": 1.198, "c": 0.769, "d": 0.346}  # Hz
worst = 0.0

with figure("figure04", columns=4, rows=2, height=2.5, width=10.0) as panels:
    for (letter, at), motion, loop in zip(points.items(), panels[:4], panels[4:], strict=True):
        found, marched = stickslip.solve(scene, frequency_hz=at), stickslip.march(scene, frequency_hz=at)
        time, x = stickslip.solutions.time_history(found, "m2")
        slip, force = stickslip.solutions.hysteresis_loop(found, "damper", samples=2000)
        some = np.linspace(0, marched.time.size - 1, 33, dtype=int)[:-1]
        motion.plot(np.append(time, time + 1 / at), np.tile(x, 2), color=FOUR[letter])
        motion.plot(np.append(marched.time[some], marched.time[some] + 1 / at),
                    np.tile(marched.displacement[some], 2), **MARCHED)  # fmt: skip
        finish(motion, "time [s]", "m2 [m]" if letter == "a" else "", title=f"{at} Hz")
        loop.plot(slip, force, color=FOUR[letter])
        loop.plot(marched.slip[0, some], marched.contact_force[0, some], **MARCHED)
        finish(loop, "slip motion [m]", "friction force [N]" if letter == "a" else "", title=f"{at} Hz")
        loop.margins(0.08)
        worst = max(worst, abs(found.max_abs / marched.max_abs - 1.0))
        say(f"max |m2| at {at} Hz", f"{found.max_abs:.4f} m, time marching {marched.max_abs:.4f} m")
say("largest difference", f"{worst:.0e}")
