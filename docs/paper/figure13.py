"""Figure 13: amplitude over frequency and normal load, with the highest peak as a white line."""

from look import figure, say

import stickslip

scene = stickslip.load_scene("bladed-disk")
mean = stickslip.response_map(scene, "shroud.N0", 20.0, 3000.0, frequencies=200)
fluctuation = stickslip.response_map(scene, "shroud.N1", 0.0, 500.0, frequencies=200)

with figure("figure13", height=3.6, width=10.5) as (left, right):
    mean.plot(ax=left)
    fluctuation.plot(ax=right)

least, track = mean.ridge.optimum, fluctuation.ridge
say("least of the highest peak over N0", f"{least.at:.1f} N, {1e3 * least.peak:.4f} mm")
say("highest peak at N0 = 20 N", f"{1e3 * mean.ridge.peak[0]:.2f} mm")
say("highest peak at N1 = 0", f"{1e3 * track.peak[0]:.4f} mm at {track.frequency[0]:.0f} Hz")
say("highest peak at N1 = 500 N", f"{1e3 * track.peak[-1]:.3f} mm at {track.frequency[-1]:.0f} Hz")
