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
from optim.identification.fit import read_unknowns
from solver.arrays import Real
from stickslip.lab.posterior.reassemblies import Level

BOUNDS = {"damper.kt": (4.0, 40.0), "damper.mu": (0.05, 1.0)}
VARIED = "damper.mu"
POPULATIONS, ASSEMBLIES = 25, 8
NOISE, HARMONICS, TRUE_HARMONICS, DRAWS = 0.03, 3, 7, 400
ALLOWED = (0.88, 0.92)
_NORMAL = 300  # populations of normal assemblies


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


def measured(scene: solver.Scene, rng: np.random.Generator) -> list[dict[str, Any]]:
    """Two responses of a rig, with noise in proportion and more harmonics than the fit has."""
    runs, hertz = [], np.linspace(0.85, 1.25, 8).tolist()
    for level in (0.8, 3.0):
        there = scene.with_values({"excitation.amplitude": level})
        found = [solver.solve(there, frequency_hz=f, harmonics=TRUE_HARMONICS).max_abs for f in hertz]
        noisy = np.array(found) * (1.0 + NOISE * rng.normal(size=len(hertz)))
        conditions = {"excitation.amplitude": level}
        runs.append({"frequency": hertz, "max_abs": noisy.tolist(), "conditions": conditions})
    return runs


def population(number: int) -> list[Held]:
    """Rigs of one population: the truths in what is known of each rig, and of the population."""
    rng, scene = np.random.default_rng(1000 + number), rig()
    unknowns = read_unknowns(scene, BOUNDS, None, None)
    middle = rng.uniform(0.15, 0.85, size=2)
    at, spread = unknowns.names.index(VARIED), rng.uniform(0.02, 0.12)
    z = np.tile(middle, (ASSEMBLIES, 1))
    z[:, at] = np.clip(middle[at] + spread * rng.normal(size=ASSEMBLIES), 0.01, 0.99)
    data = [measured(scene.with_values(unknowns.by_path(one)), rng) for one in z]
    found = optim.reassemblies(
        scene,
        data,
        BOUNDS,
        [VARIED],
        sampling=optim.Sampling(harmonics=HARMONICS, starts=1, draws=DRAWS, seed=number),
    )
    held = []
    for truth, one in zip(z, found.assemblies, strict=True):
        shares = _below(one.scaled, truth) if one.reached else np.full(2, math.nan)
        held += [Held(f"rigs: {name}", share) for name, share in zip(unknowns.names, shares, strict=True)]
    medians = [one.interval for one in found.middles]
    values = unknowns.values(middle)
    width = math.log(BOUNDS[VARIED][1] / BOUNDS[VARIED][0])
    truths = [*values.tolist(), spread * width]
    intervals = [*medians, found.spreads[0].interval]
    names = [f"median of {name}" for name in unknowns.names] + [f"spread of {VARIED}"]
    for name, truth, (low, high) in zip(names, truths, intervals, strict=True):
        share = 0.5 if low <= truth <= high else 1.0
        held.append(Held(f"populations: {name}", share if math.isfinite(low) else math.nan))
    return held


def _below(draws: Real, truth: Real) -> Real:
    """Return the share of draws below the truth, on average uniform from 0 to 1."""
    return np.asarray((np.sum(draws < truth, axis=0) + 0.5) / (len(draws) + 1.0))


def normal_populations(count: int, seed: int = 0) -> list[Held]:
    """The level above normal assemblies by itself, its truths drawn from its prior."""
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
    rigs = [one for one in held if one.of.startswith("rigs")]
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
