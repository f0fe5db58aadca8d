"""How many random scenes are solved, and at what cost: nothing is left out of the count."""

from __future__ import annotations

import collections
import math
import time

import numpy as np

import solver
from benchmarks.harness import WrongResultError, table
from benchmarks.random_scenes import Seeded, random_scene

SCENES = 300
TIGHT = 1e-9  # residual of every point
LOST = 1e-7  # share of the apparent power


def lost_power(solution: solver.Solution) -> float:
    """Return the power that is unaccounted for over what forces and motion could carry at most.

    Far from a resonance force and motion are in quadrature and next to nothing is dissipated, so that the
    largest of the powers would compare rounding with rounding.
    """
    power, forces = solver.power_balance(solution), solution.scene.forces
    moved = float(np.abs(solver.motion(solution)[:, 1:]).max(initial=0.0))
    reach = sum(abs(force.amplitude) * force.harmonic for force in forces) * moved
    apparent = 2.0 * math.pi * solution.frequency_hz * reach
    apparent += sum(abs(each) for each in power.contacts_w.values()) + abs(power.viscous_w)
    lost = abs(power.input_w - power.viscous_w - power.friction_w)
    return lost / apparent if apparent > 0.0 else 0.0


def robustness() -> None:
    """Share of random scenes that converge, iterations and rejected steps."""
    endings: collections.Counter[str] = collections.Counter()
    failed: list[str] = []
    points, iterations, rejected, folds, solves = 0, 0, 0, 0, []
    begun = time.process_time()
    for seed in range(SCENES):
        scene, harmonics = random_scene(Seeded(seed))
        low, high = scene.observe.band
        branch = solver.sweep(scene, harmonics=harmonics)
        middle = math.sqrt(low * high)
        solution = solver.solve(scene, frequency_hz=middle, harmonics=harmonics)
        endings[f"sweep {branch.status.name}"] += 1
        endings[f"solve {solution.status.name}"] += 1
        if not (branch.reached and solution.converged):
            failed.append(f"{seed} ({branch.status.name}, {solution.status.name})")
        worst = float(branch.residuals.max()) if len(branch.values) else 0.0
        lost = lost_power(solution) if solution.converged else 0.0
        if worst > TIGHT or lost > LOST:
            raise WrongResultError(f"seed {seed}: residual {worst:.1e}, power lost {lost:.1e}")
        points += len(branch.values)
        iterations += branch.newton_iterations
        rejected += branch.rejected_steps
        folds += branch.folds
        solves.append(solution.newton_iterations)
    rows = [(name, str(count), f"{100.0 * count / SCENES:.1f} %") for name, count in sorted(endings.items())]
    table(f"{SCENES} random scenes", ("ending", "scenes", "share"), rows)
    table(
        "Cost",
        ("points a response", "iterations a point", "rejected a 100 points", "turns", "iterations of a solve",
         "most", "s (process)"),
        [(f"{points / SCENES:.0f}", f"{iterations / points:.2f}", f"{100.0 * rejected / points:.2f}",
          str(folds), f"{np.mean(solves):.1f}", str(max(solves)), f"{time.process_time() - begun:.1f}")],
    )  # fmt: skip
    if failed:
        print("without a whole response or a solution, by seed:", ", ".join(failed))
