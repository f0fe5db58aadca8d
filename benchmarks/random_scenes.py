"""Random scenes, small but of every kind: chains and cyclic disks, loads that vary, separate and grow."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np

from solver import Scene

Spread = tuple[float, float]
RATIOS = (0.0, 0.3, 0.9, 1.0, 1.3, 3.0, 10.0)  # N1 over N0
HARMONICS = (3, 7, 11, 21)


def _log(rng: np.random.Generator, ends: Spread) -> float:
    return float(10.0 ** rng.uniform(*ends))


def _contact(rng: np.random.Generator, name: str, between: list[str]) -> dict[str, Any]:
    return {
        "name": name, "between": between, "kt": _log(rng, (-2.0, 3.0)), "mu": float(rng.uniform(0.05, 1.0)),
        "N0": _log(rng, (-3.0, 2.0)), "N1_ratio": float(rng.choice(RATIOS)),
        "N1_phase": float(rng.uniform(-math.pi, math.pi)),
    }  # fmt: skip


def random_chain(rng: np.random.Generator) -> Scene:
    """One to three masses near 1 kg, each on a spring near 1 N/m, joined, with one contact or more."""
    n = int(rng.integers(1, 4))
    dofs = [f"m{i}" for i in range(n)]
    damping = _log(rng, (-3.0, -0.7))
    springs: list[dict[str, Any]] = [
        {"between": [dof, "ground"], "k": float(rng.uniform(0.5, 2.0)), "c": damping} for dof in dofs
    ]
    pairs = [*pairwise(dofs)]
    springs += [{"between": [*pair], "k": float(rng.uniform(0.1, 2.0)), "c": damping} for pair in pairs]
    places = [[dof, "ground"] for dof in dofs] + [[*pair] for pair in pairs]
    chosen = rng.permutation(len(places))[: int(rng.integers(1, len(places) + 1))]
    excitation: list[dict[str, Any]] = [{"dof": str(rng.choice(dofs)), "amplitude": 1.0}]
    if rng.random() < 0.3:
        excitation.append({"dof": str(rng.choice(dofs)), "amplitude": 0.5, "harmonic": 3, "phase": 1.0})
    if rng.random() < 0.3:
        excitation.append({"dof": str(rng.choice(dofs)), "amplitude": 0.5, "harmonic": 0})
    return Scene.from_dict(
        {
            "name": "random-chain",
            "structure": {"kind": "lumped", "masses": dict.fromkeys(dofs, 1.0), "springs": springs},
            "contacts": [_contact(rng, f"c{i}", places[j]) for i, j in enumerate(chosen)],
            "excitation": excitation,
            "observe": {"dof": dofs[-1], "band": [0.02, 0.8]},
        }
    )


def random_disk(rng: np.random.Generator) -> Scene:
    """A tuned disk of three to eight sectors of two masses, with a shroud and often a root contact."""
    sectors = int(rng.integers(3, 9))
    contacts = [_contact(rng, "shroud", ["tip", "tip@next"])]
    if rng.random() < 0.5:
        contacts.append(_contact(rng, "root", ["tip", "disk"]))
    return Scene.from_dict(
        {
            "name": "random-disk",
            "structure": {
                "kind": "cyclic",
                "sectors": sectors,
                "stiffness_proportional_damping": _log(rng, (-3.0, -1.5)),
                "masses": {"tip": 1.0, "disk": 3.0},
                "springs": [
                    {"between": ["tip", "disk"], "k": 1.0},
                    {"between": ["disk", "disk@next"], "k": float(rng.uniform(0.2, 2.0))},
                    {"between": ["disk", "ground"], "k": float(rng.uniform(0.5, 5.0))},
                ],
            },
            "contacts": contacts,
            "excitation": {
                "dof": str(rng.choice(["tip", "disk"])),
                "amplitude": 1.0,
                "engine_order": int(rng.integers(0, sectors)),
            },
            "observe": {"dof": "tip", "band": [0.02, 0.6]},
        }
    )


def random_scene(seed: int) -> tuple[Scene, int]:
    """Return the scene of a seed and a highest harmonic."""
    rng = np.random.default_rng(seed)
    scene = random_disk(rng) if seed % 3 == 2 else random_chain(rng)
    return scene, int(rng.choice(HARMONICS))
