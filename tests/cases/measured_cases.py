"""Measurements made by computation: responses with far more harmonics than a fit keeps, and noise on them."""

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np

import solver

Table = dict[str, Any]
HARMONICS = 25  # of the truth
TWO_DOF = {"damper.kt": 33.0, "damper.mu": 0.27}
LEVELS = ((40.0, 100.0), (100.0, 100.0), (100.0, 40.0), (250.0, 100.0))  # N of excitation, N of load


@cache
def true_amplitudes(name: str, values: tuple[tuple[str, float], ...], hertz: tuple[float, ...]) -> np.ndarray:
    """Complex amplitudes of the first harmonic of a shipped scene."""
    scene = solver.load_scene(name).with_values(dict(values))
    found = [solver.solve(scene, frequency_hz=f, harmonics=HARMONICS) for f in hertz]
    assert all(one.converged for one in found)
    return np.array([complex(one.observed[1], -one.observed[2]) for one in found])


def table(
    name: str, truth: Mapping[str, float], conditions: Mapping[str, float], hertz: Sequence[float],
    rng: np.random.Generator, noise: float, *, phase: bool = True,
) -> Table:  # fmt: skip
    """A run with noise in proportion to the amplitude, of the same size on its real and imaginary part."""
    values = tuple({**truth, **conditions}.items())
    clean = true_amplitudes(name, values, tuple(map(float, hertz)))
    wobble = rng.normal(size=len(hertz)) + 1j * rng.normal(size=len(hertz))
    seen = clean * (1.0 + noise * wobble)
    told: Table = {"frequency": list(map(float, hertz)), "conditions": dict(conditions)}
    if phase:
        return {**told, "real": seen.real.tolist(), "imag": seen.imag.tolist()}
    return {**told, "amplitude": np.abs(clean * (1.0 + noise * wobble.real)).tolist()}


def two_dof_runs(rng: np.random.Generator, noise: float, **how: bool) -> list[Table]:
    """Four runs of `two-dof`, 16 points each."""
    hertz = np.linspace(0.85, 1.6, 16).tolist()
    return [
        table("two-dof", TWO_DOF, {"excitation.amplitude": f, "damper.N0": n}, hertz, rng, noise, **how)
        for f, n in LEVELS
    ]


def incremental_loop(
    kt: float, limit: float, amplitude: float, samples: int
) -> tuple[np.ndarray, np.ndarray]:
    """Motion and force of an elastic Coulomb slider, by increments of a fine path over two periods."""
    fine = 64
    tau = 2.0 * np.pi * np.arange(2 * samples * fine) / (samples * fine)
    motion = amplitude * (np.sin(tau) + 0.2 * np.cos(3.0 * tau))
    force = np.empty(motion.size)
    held = 0.0
    for i, step in enumerate(np.diff(motion, prepend=0.0)):
        held = min(max(held + kt * step, -limit), limit)
        force[i] = held
    return motion[samples * fine :: fine], force[samples * fine :: fine]
