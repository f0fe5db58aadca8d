"""Whether answers obey mechanics: the power balance of random scenes of all kinds, and what was refused."""

from __future__ import annotations

import collections
import math
import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

import solver
from benchmarks.harness import WrongResultError, table
from benchmarks.robustness import lost_power
from solver.response.solve import described_at
from solver.scene.scene import Scene

SCENES = int(os.environ.get("TRUTH_SCENES", "1000"))
SWEPT = 10  # one scene of so many is swept too, and its points are judged
POINTS = 20  # of a sweep
ROUNDING = 1e-6  # of the apparent power
CASES = Path(__file__).parent.parent / "tests" / "cases"

Drawn = tuple[Scene, float, int]


def _kinds() -> dict[str, Callable[[int], Drawn]]:
    """Return what draws a scene, a frequency [Hz] and harmonics for a seed, by kind."""
    sys.path.insert(0, str(CASES))
    import body_scenes
    from floating_bars import Bar
    from floating_scenes import floating_scene
    from history_modes import chain_of_history
    from history_scenes import history_scene
    from light_scenes import light_scene
    from load_scenes import random_loads
    from moving_scenes import moving_scene
    from random_scenes import random_scene as random_lumped
    from random_space import random_space

    from benchmarks.random_scenes import Seeded, random_chain, random_disk

    def bar(seed: int) -> Drawn:
        drawn = Bar.of(seed)
        return drawn.scene(), drawn.frequency_hz, 11

    def middle(scene: Scene, harmonics: int) -> Drawn:
        return scene, 0.5 * sum(scene.observe.band), harmonics

    def history(seed: int) -> Drawn:
        raw, _, _ = chain_of_history(seed)
        force = 10.0 ** np.random.default_rng(seed).uniform(-2.0, 1.0) * sum(
            float(each.get("limit", each.get("N0", 1.0))) for each in raw["contacts"]
        )
        return middle(Scene.from_dict({**raw, "excitation": {"dof": "m0", "amplitude": force}}), 11)

    def body(seed: int) -> Drawn:
        rng = np.random.default_rng(seed)
        drawn: list[dict[str, Any]] = [
            body_scenes.planar_wedge(angle=float(rng.uniform(0.2, 0.9))),
            body_scenes.sector_with_damper(sectors=int(rng.integers(5, 13))),
            body_scenes.shaped_wedge(),
            body_scenes.cylinder_in_space(),
        ]
        scene = Scene.from_dict(drawn[seed % len(drawn)])
        low, high = scene.observe.band
        scene = scene.with_values(
            {"excitation.amplitude": scene.value("excitation.amplitude") * 10.0 ** rng.uniform(-1.5, 0.5)}
        )
        return scene, float(rng.uniform(low, high)), 5

    def plain(draw: Callable[..., tuple[Scene, float]], *more: str) -> Callable[[int], Drawn]:
        return lambda seed: (*draw(seed, *more), 11)

    def light(seed: int) -> Drawn:
        found = light_scene(seed)
        return middle(found.scene, found.harmonics)

    return {
        "lumped": random_lumped,
        "chain": lambda seed: middle(random_chain(Seeded(seed)), 11),
        "cyclic disk": lambda seed: middle(random_disk(Seeded(seed)), 7),
        "light damping": light,
        "loads of many harmonics": plain(random_loads),
        "loads that move": plain(history_scene, "moving"),
        "circle": plain(history_scene, "circle"),
        "box": plain(history_scene, "box"),
        "box, loads that move": plain(history_scene, "box-moving"),
        "contact in space": random_space,
        "moving, gaps, springs": plain(moving_scene),
        "history laws": history,
        "floating body": lambda seed: middle(floating_scene(seed), 11),
        "rigid body": body,
        "floating bar": bar,
    }


@dataclass(slots=True)
class _Tally:
    """What came of the scenes of one kind."""

    endings: collections.Counter[str] = field(default_factory=collections.Counter)
    points: int = 0
    worst: float = 0.0
    wrong: list[str] = field(default_factory=list)

    def judge(self, solution: solver.Solution, name: str) -> None:
        """Hold a converged answer against the power of its full matrices."""
        lost = lost_power(solution)
        self.worst = max(self.worst, lost)
        estimate = solution.error_estimate / max(solution.max_abs, 1e-300)
        allowed = max(ROUNDING, min(1.0, estimate) if math.isfinite(estimate) else 0.0)
        if not lost <= allowed:
            self.wrong.append(f"{name}: {lost:.1e}")

    def sweep(self, scene: Scene, harmonics: int, name: str) -> None:
        """Judge points of a branch, spread over it."""
        branch = solver.sweep(scene, harmonics=harmonics)
        self.endings[f"sweep {branch.status.name}"] += 1
        n = len(branch.values)
        for i in {i * (n - 1) // (POINTS - 1) for i in range(POINTS)} if n else ():
            self.points += 1
            self.judge(described_at(branch, i), f"{name}, {branch.values[i]:g} Hz")


def truth() -> None:
    """Count the answers of random scenes that violate the power balance by more than their estimate."""
    kinds = _kinds()
    rows: list[tuple[str, ...]] = []
    wrong: list[str] = []
    number, scenes = 0, 0
    for number, (kind, draw) in enumerate(kinds.items()):
        tally, begun = _Tally(), time.process_time()
        every = SCENES * (number + 1) // len(kinds) - SCENES * number // len(kinds)
        scenes += every
        for seed in range(every):
            scene, frequency_hz, harmonics = draw(seed)
            solution = solver.solve(scene, frequency_hz=frequency_hz, harmonics=harmonics)
            tally.endings[solution.status.name] += 1
            if solution.converged:
                tally.judge(solution, f"{kind} {seed}")
            if seed % SWEPT == 0:
                tally.sweep(scene, harmonics, f"{kind} {seed}")
        usual = ("CONVERGED", "sweep COMPLETED")
        others = ", ".join(f"{n} {name}" for name, n in tally.endings.items() if name not in usual) or "none"
        rows.append(
            (kind, str(every), str(tally.endings["CONVERGED"]), str(tally.points), str(len(tally.wrong)),
             f"{tally.worst:.1e}", others, f"{time.process_time() - begun:.0f}")
        )  # fmt: skip
        wrong += tally.wrong
        print(*rows[-1], sep="  ", flush=True)
    table(
        f"{scenes} random scenes",
        ("kind", "scenes", "CONVERGED", "points of sweeps", "power violated", "most lost", "others",
         "s (process)"),
        rows,
    )  # fmt: skip
    print(f"violations of the power balance: {len(wrong)}")
    if wrong:
        raise WrongResultError("; ".join(wrong))
