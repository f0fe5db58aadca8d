"""Whether answers obey mechanics: the power balance of random scenes of all kinds, and what was refused."""

from __future__ import annotations

import collections
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

import solver
from benchmarks.harness import WrongResultError, table
from solver.response.power_balance import power_lost
from solver.scene.scene import Scene

SCENES = int(os.environ.get("TRUTH_SCENES", "1000"))
ROUNDING = 1e-6  # of the apparent power
CASES = Path(__file__).parent.parent / "tests" / "cases"

Drawn = tuple[Scene, float, int]


def _kinds() -> dict[str, Callable[[int], Drawn]]:
    """Return what draws a scene, a frequency [Hz] and harmonics for a seed, by kind."""
    sys.path.insert(0, str(CASES))
    from floating_bars import Bar
    from floating_scenes import floating_scene
    from random_scenes import random_scene as random_lumped

    from benchmarks.random_scenes import Seeded, random_chain, random_disk

    def bar(seed: int) -> Drawn:
        drawn = Bar.of(seed)
        return drawn.scene(), drawn.frequency_hz, 11

    def middle(scene: Scene, harmonics: int) -> Drawn:
        return scene, 0.5 * sum(scene.observe.band), harmonics

    return {
        "lumped": random_lumped,
        "chain": lambda seed: middle(random_chain(Seeded(seed)), 11),
        "disk": lambda seed: middle(random_disk(Seeded(seed)), 7),
        "floating body": lambda seed: middle(floating_scene(seed), 11),
        "floating bar": bar,
    }


def truth() -> None:
    """Count the answers of random scenes that violate the power balance by more than their estimate."""
    kinds = _kinds()
    rows: list[tuple[str, ...]] = []
    wrong, every = [], SCENES // len(kinds)
    for kind, draw in kinds.items():
        endings: collections.Counter[str] = collections.Counter()
        worst, violations, begun = 0.0, 0, time.process_time()
        for seed in range(every):
            scene, frequency_hz, harmonics = draw(seed)
            solution = solver.solve(scene, frequency_hz=frequency_hz, harmonics=harmonics)
            endings[solution.status.name] += 1
            if not solution.converged:
                continue
            lost = power_lost(solution)
            worst = max(worst, lost)
            if lost > max(ROUNDING, min(1.0, solution.error_estimate / max(solution.max_abs, 1e-300))):
                violations += 1
                wrong.append(f"{kind} {seed}: {lost:.1e}")
        refused = ", ".join(f"{n} {name}" for name, n in endings.items() if name != "CONVERGED") or "none"
        rows.append(
            (kind, str(every), str(endings["CONVERGED"]), str(violations), f"{worst:.1e}", refused,
             f"{time.process_time() - begun:.0f}")
        )  # fmt: skip
    table(
        f"{every * len(kinds)} random scenes",
        ("kind", "scenes", "CONVERGED", "power violated", "most lost", "refused", "s (process)"),
        rows,
    )
    print(f"violations of the power balance: {len(wrong)}")
    if wrong:
        raise WrongResultError("; ".join(wrong))
