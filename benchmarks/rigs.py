"""Synthetic rigs: how often 90 % intervals of posteriors and of a population hold the truth."""

from __future__ import annotations

import math
import os
from concurrent.futures import ProcessPoolExecutor
from typing import Any, NamedTuple

import numpy as np

import optim
import solver
from benchmarks.harness import expect, table
from optim.identification.posterior.reassemblies import Level
from optim.identification.unknowns import read_unknowns
from solver.arrays import Real

BOUNDS = {"damper.kt": (4.0, 40.0), "damper.mu": (0.05, 1.0), "structure.k": (36.0, 44.0)}
VARIED = "damper.mu"
POPULATIONS, ASSEMBLIES = 25, 8
NOISE, HARMONICS, TRUE_HARMONICS, DRAWS = 0.03, 3, 11, 200
ALLOWED = (0.88, 0.92)
_EVERY = 5  # population whose rigs measure phase resonances; the others measure responses
_SHARP = 0.1  # noise of a frequency relative to that of an amplitude
_NORMAL = 1000  # populations of normal assemblies


class Held(NamedTuple):
    """An interval and where the truth lies in what is known."""

    of: str
    share: float
    """Of the draws below the truth; NaN where no interval is given."""

    def inside(self, level: float) -> bool:
        """Return whether the interval of a probability holds the truth."""
        return abs(self.share - 0.5) <= 0.5 * level


def rig() -> solver.Scene:
    """One mass, a spring, an elastic slider."""
    return solver.Scene.from_dict(
        {
            "name": "rig",
            "structure": {
                "kind": "lumped",
                "masses": {"m": 1.0},
                "springs": [{"name": "k", "between": ["m", "ground"], "k": 40.0, "c": 0.12}],
            },
            "contacts": [{"name": "damper", "between": ["m", "ground"], "kt": 12.0, "mu": 0.3, "N0": 10.0}],
            "excitation": {"dof": "m", "amplitude": 4.0},
            "observe": {"dof": "m", "band": [0.7, 1.6]},
        }
    )


def measured(scene: solver.Scene, kind: str, rng: np.random.Generator) -> list[dict[str, Any]]:
    """What a rig measures, with noise in proportion and more harmonics than the fit has."""

    def seen(values: Real, share: float = 1.0) -> list[float]:
        noisy = np.asarray(values) * (1.0 + share * NOISE * rng.normal(size=len(values)))
        return [float(one) for one in noisy]

    if kind == "resonance":
        found = solver.phase_resonance(scene, amplitudes=(0.08, 3.0), harmonics=TRUE_HARMONICS)
        kept = np.linspace(0, len(found.amplitude) - 1, 7).round().astype(int)
        level = found.excitation[kept] * scene.value("excitation.amplitude")
        return [
            {
                "level": level.tolist(),
                "resonance_amplitude": seen(found.amplitude[kept]),
                "resonance_frequency": seen(found.frequency_hz[kept], _SHARP),
            }
        ]
    runs = []
    for level in (0.8, 3.0):
        there, hertz = scene.with_values({"excitation.amplitude": level}), np.linspace(0.85, 1.25, 8).tolist()
        found = [solver.solve(there, frequency_hz=f, harmonics=TRUE_HARMONICS).max_abs for f in hertz]
        conditions = {"excitation.amplitude": level}
        runs.append({"frequency": hertz, "max_abs": seen(np.array(found)), "conditions": conditions})
    return runs


def population(number: int) -> list[Held]:
    """Rigs of one population: the truths in what is known of each rig, and of the population."""
    rng, scene = np.random.default_rng(1000 + number), rig()
    unknowns = read_unknowns(scene, BOUNDS, None, None)
    middle = rng.uniform(0.15, 0.85, size=3)
    at, spread = unknowns.names.index(VARIED), rng.uniform(0.02, 0.12)
    z = np.tile(middle, (ASSEMBLIES, 1))
    z[:, at] = np.clip(middle[at] + spread * rng.normal(size=ASSEMBLIES), 0.01, 0.99)
    kind = "resonance" if number % _EVERY == 0 else "response"
    data = [measured(scene.with_values(unknowns.by_path(one)), kind, rng) for one in z]
    found = optim.reassemblies(
        scene, data, BOUNDS, [VARIED], harmonics=HARMONICS, starts=2, draws=DRAWS, seed=number
    )
    held = []
    for truth, one in zip(z, found.assemblies, strict=True):
        shares = _below(one.scaled, truth) if one.reached else np.full(3, math.nan)
        held += [Held(f"{kind}: {name}", share) for name, share in zip(unknowns.names, shares, strict=True)]
    return held


def _below(draws: Real, truth: Real) -> Real:
    """Return the share of draws below the truth, on average uniform from 0 to 1."""
    return np.asarray((np.sum(draws < truth, axis=0) + 0.5) / (len(draws) + 1.0))


def normal_populations(count: int, seed: int = 0) -> list[Held]:
    """The level above normal assemblies by itself, its truths drawn from its prior but for the widest spreads."""
    rng, held = np.random.default_rng(seed), []
    for _ in range(count):
        middle, spread = rng.normal(size=2), np.array([rng.uniform(0.0, 1.0 / math.sqrt(12.0))])
        covariances = np.array([_covariance(rng) for _ in range(ASSEMBLIES)])
        z = np.tile(middle, (ASSEMBLIES, 1))
        z[:, 0] += spread[0] * rng.normal(size=ASSEMBLIES)
        means = np.array([rng.multivariate_normal(m, c) for m, c in zip(z, covariances, strict=True)])
        spreads, middles, _ = Level(means, covariances, np.array([0])).drawn(400, rng)
        shares = [*_below(middles, middle), *_below(spreads, spread)]
        names = ("median of what varies", "what does not vary", "spread")
        held += [Held(f"normal: {name}", share) for name, share in zip(names, shares, strict=True)]
    return held


def _covariance(rng: np.random.Generator) -> Real:
    root = 0.05 * rng.normal(size=(2, 2))
    return np.asarray(root @ root.T + 1e-4 * np.eye(2))


def all_held() -> list[Held]:
    """Every rig, and populations of normal assemblies."""
    with ProcessPoolExecutor(max_workers=min(os.cpu_count() or 1, POPULATIONS)) as pool:
        rigs = [one for held in pool.map(population, range(POPULATIONS)) for one in held]
    return rigs + normal_populations(_NORMAL)


def rig_coverage() -> None:
    """How often 90 % intervals hold the truth: 200 synthetic rigs, reassemblies of 25 populations."""
    report(all_held())


def report(held: list[Held]) -> None:
    """Print the shares, and expect those of all rigs between 88 and 92 %."""
    rows = []
    for name in dict.fromkeys(one.of for one in held):
        rows.append(_row(name, [one for one in held if one.of == name]))
    rigs = [one for one in held if not one.of.startswith("normal")]
    rows.append(_row("all rigs", rigs))
    table("90 % intervals that hold the truth", ("of", "intervals", "refused", "hold it", "± error"), rows)
    share = float(np.mean([one.inside(0.9) for one in rigs if math.isfinite(one.share)]))
    expect(f"{100.0 * share:.1f} % of the intervals hold the truth", ALLOWED[0] <= share <= ALLOWED[1])


def _row(name: str, held: list[Held]) -> tuple[str, ...]:
    given = [one.inside(0.9) for one in held if math.isfinite(one.share)]
    share = float(np.mean(given)) if given else math.nan
    error = math.sqrt(share * (1.0 - share) / max(len(given), 1))
    refused = len(held) - len(given)
    return name, str(len(given)), str(refused), f"{100.0 * share:.1f} %", f"{100.0 * error:.1f}"
