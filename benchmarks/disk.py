"""The bladed disk: its response, and the responses of many designs."""

from __future__ import annotations

import solver
from benchmarks.harness import check, expect, table, timed
from benchmarks.limits import HEADER, distance

FINE = 41  # harmonics at which the peak agrees with time marching
LEFT_OUT = 5e-3  # share of the peak that harmonics above 11 make


def disk_response() -> None:
    """The bladed disk from 500 to 900 Hz at 11 harmonics."""
    scene = solver.load_scene("bladed-disk")
    branch, timing = timed(lambda: solver.sweep(scene, start=500.0, stop=900.0), runs=15)
    fine = solver.sweep(scene, start=500.0, stop=900.0, harmonics=FINE)
    for one in (branch, fine):
        expect(f"{one.status.value}, residual {one.residuals.max():.0e}", one.reached)
        expect("every point converged", bool(one.residuals.max() <= 1e-9))
        expect("there is a peak", one.peak is not None)
    marched = solver.march(scene, frequency_hz=fine.peak.at)
    expect(f"march: {marched.status.value}", marched.converged)
    check("peak with 41 harmonics", fine.peak.value, marched.max_abs, 1e-5)
    peak = check("peak with 11 harmonics", branch.peak.value, fine.peak.value, LEFT_OUT)
    points = len(branch.values)
    header = ("response", "points", "ms (process)", "ms (wall)", "ms a point", "wanted", "peak")
    row = ("500 to 900 Hz, H = 11", str(points), f"{1e3 * timing.cpu:.2f}", f"{1e3 * timing.least:.2f}",
           f"{1e3 * timing.cpu / points:.4f}", "20 ms", peak)  # fmt: skip
    table("Bladed disk", header, [row])
    cells = distance(branch, timing.cpu).cells()
    table("Distance to the least a point can cost", ("response", *HEADER), [("bladed disk", *cells)])


def disk_map() -> None:
    """The map of 60 loads of the shroud and 400 frequencies, every value a converged solution."""
    scene = solver.load_scene("bladed-disk")
    rows = []
    for what, ridge in (("map alone", False), ("with the ridge of peaks", True)):
        found, timing = timed(
            lambda ridge=ridge: solver.response_map(
                scene, "shroud.N0", 20.0, 3000.0, steps=60, frequencies=400, ridge=ridge
            ),
            runs=2,
        )
        expect(f"map: {found.status.value}", found.reached)
        row, column = 17, 229
        one = solver.solve(
            scene.with_values({"shroud.N0": float(found.parameter[row])}),
            frequency_hz=float(found.frequency[column]),
        )
        value = check("a value of the map", float(found.amplitude[row, column]), one.max_abs, 1e-8)
        rows.append((what, "60 x 400", f"{timing.cpu:.2f}", f"{timing.least:.2f}", "1.5", value))
    header = ("map of the bladed disk", "points", "s (process)", "s (wall)", "wanted s", "a value, solved")
    table("Map of load and frequency", header, rows)
