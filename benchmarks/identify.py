"""Identification: five unknowns of the bladed disk from six responses."""

from __future__ import annotations

from typing import Any

import numpy as np

import optim
import solver
from benchmarks.harness import expect, table, timed

TRUTH = {
    "shroud.kt": 4.7e6, "shroud.mu": 0.36, "root.kt": 2.2e6, "shroud.N1_ratio": 0.2, "root.mu": 0.25,
}  # fmt: skip
BOUNDS = {
    "shroud.kt": (2e6, 2e7), "shroud.mu": (0.1, 0.8), "root.kt": (5e5, 8e6), "shroud.N1_ratio": (0.0, 0.6),
    "root.mu": (0.1, 0.8),
}  # fmt: skip
RUNS = ((20.0, 200.0), (50.0, 200.0), (120.0, 200.0), (50.0, 50.0), (50.0, 600.0), (300.0, 200.0))
POINTS, HARMONICS, TRUE_HARMONICS = 60, 7, 15
NOISE = 0.02
ALLOWED = 5.0  # s
_SIGMAS = 4.5  # largest distance from the truth of five estimates


def identify() -> None:
    """Five unknowns of the bladed disk from six responses with 2 % noise, starts and candidates included."""
    scene = solver.load_scene("bladed-disk")
    data = _data(scene)
    found, spent = timed(lambda: optim.identify(scene, data, BOUNDS, harmonics=HARMONICS), runs=3)
    expect(found.status.value, found.reached)
    rows = []
    for one in found.estimates:
        off = (one.value - TRUTH[one.name]) / one.standard_error
        expect(f"{one.name} is {off:+.1f} standard errors off", abs(off) <= _SIGMAS)
        rows.append(
            (
                one.name,
                f"{TRUTH[one.name]:.6g}",
                f"{one.value:.6g}",
                f"{one.standard_error:.2g}",
                f"{off:+.2f}",
            )
        )
    table(
        "Identification: bladed-disk, 6 responses of 60 points",
        ("unknown", "truth", "estimate", "±", "off"),
        rows,
    )
    print(f"{spent.cpu:.2f} s of the process (wanted {ALLOWED:g}), {spent.least:.2f} s on the wall, "
          f"{found.evaluations} evaluations of all points, noise {100.0 * found.noise:.2f} %")  # fmt: skip
    expect(f"{spent.cpu:.2f} s are more than {ALLOWED:g} s", spent.cpu <= ALLOWED)


def _data(scene: solver.Scene) -> list[dict[str, Any]]:
    """The runs, with more harmonics than the fit has."""
    rng, hertz, runs = np.random.default_rng(1), np.linspace(560.0, 860.0, POINTS), []
    for level, load in RUNS:
        conditions = {"excitation.amplitude": level, "shroud.N0": load}
        there = scene.with_values({**TRUTH, **conditions})
        found = [solver.solve(there, frequency_hz=f, harmonics=TRUE_HARMONICS) for f in hertz]
        x = np.array([complex(one.observed[1], -one.observed[2]) for one in found])
        x = x * (1.0 + NOISE * (rng.normal(size=POINTS) + 1j * rng.normal(size=POINTS)))
        runs.append(
            {
                "frequency": hertz.tolist(),
                "real": x.real.tolist(),
                "imag": x.imag.tolist(),
                "conditions": conditions,
            }
        )
    return runs
