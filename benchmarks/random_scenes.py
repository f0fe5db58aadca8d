"""Random scenes, small but of every kind: chains and cyclic disks, loads that vary, separate and grow."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, Protocol, TypeVar

import numpy as np

from solver import Scene

RATIOS = (0.0, 0.3, 0.9, 1.0, 1.3, 3.0, 10.0)  # N1 over N0
HARMONICS = (3, 7, 11, 21)

_T = TypeVar("_T")


class Source(Protocol):
    """Where the choices come from: a generator of random numbers, or a tool that looks for failures."""

    def uniform(self, low: float, high: float) -> float:
        """Return a number from low to high."""
        ...

    def integer(self, low: int, high: int) -> int:
        """Return a whole number from low to high, both included."""
        ...

    def choice(self, options: Sequence[_T]) -> _T:
        """Return one of the options."""
        ...


class Seeded:
    """Choices of a seeded generator."""

    def __init__(self, seed: int) -> None:
        self._rng = np.random.default_rng(seed)

    def uniform(self, low: float, high: float) -> float:
        """Return a number from low to high."""
        return float(self._rng.uniform(low, high))

    def integer(self, low: int, high: int) -> int:
        """Return a whole number from low to high, both included."""
        return int(self._rng.integers(low, high + 1))

    def choice(self, options: Sequence[_T]) -> _T:
        """Return one of the options."""
        return options[self.integer(0, len(options) - 1)]


def _contact(source: Source, name: str, between: Sequence[str]) -> dict[str, Any]:
    return {
        "name": name, "between": list(between), "kt": 10.0 ** source.uniform(-2.0, 3.0),
        "mu": source.uniform(0.05, 1.0), "N0": 10.0 ** source.uniform(-3.0, 2.0),
        "N1_ratio": source.choice(RATIOS), "N1_phase": source.uniform(-math.pi, math.pi),
    }  # fmt: skip


def random_chain(source: Source) -> Scene:
    """One to three masses of 1 kg, each on a spring near 1 N/m, joined, with one contact or more."""
    dofs = [f"m{i}" for i in range(source.integer(1, 3))]
    damping = 10.0 ** source.uniform(-3.0, -0.7)
    springs: list[dict[str, Any]] = [
        {"between": [dof, "ground"], "k": source.uniform(0.5, 2.0), "c": damping} for dof in dofs
    ]
    pairs = [*pairwise(dofs)]
    springs += [{"between": [*pair], "k": source.uniform(0.1, 2.0), "c": damping} for pair in pairs]
    places: list[tuple[str, str]] = [*((dof, "ground") for dof in dofs), *pairs]
    first = source.integer(0, len(places) - 1)
    chosen = [places[(first + i) % len(places)] for i in range(source.integer(1, len(places)))]
    excitation: list[dict[str, Any]] = [{"dof": source.choice(dofs), "amplitude": 1.0}]
    if source.integer(0, 2) == 0:
        excitation.append({"dof": source.choice(dofs), "amplitude": 0.5, "harmonic": 3, "phase": 1.0})
    if source.integer(0, 2) == 0:
        excitation.append({"dof": source.choice(dofs), "amplitude": 0.5, "harmonic": 0})
    return Scene.from_dict(
        {
            "name": "random-chain",
            "structure": {"kind": "lumped", "masses": dict.fromkeys(dofs, 1.0), "springs": springs},
            "contacts": [_contact(source, f"c{i}", place) for i, place in enumerate(chosen)],
            "excitation": excitation,
            "observe": {"dof": dofs[-1], "band": [0.02, 0.8]},
        }
    )


def random_disk(source: Source) -> Scene:
    """A tuned disk of three to eight sectors of two masses, with a shroud and often a root contact."""
    sectors = source.integer(3, 8)
    contacts = [_contact(source, "shroud", ("tip", "tip@next"))]
    if source.integer(0, 1) == 0:
        contacts.append(_contact(source, "root", ("tip", "disk")))
    return Scene.from_dict(
        {
            "name": "random-disk",
            "structure": {
                "kind": "cyclic",
                "sectors": sectors,
                "stiffness_proportional_damping": 10.0 ** source.uniform(-3.0, -1.5),
                "masses": {"tip": 1.0, "disk": 3.0},
                "springs": [
                    {"between": ["tip", "disk"], "k": 1.0},
                    {"between": ["disk", "disk@next"], "k": source.uniform(0.2, 2.0)},
                    {"between": ["disk", "ground"], "k": source.uniform(0.5, 5.0)},
                ],
            },
            "contacts": contacts,
            "excitation": {
                "dof": source.choice(("tip", "disk")),
                "amplitude": 1.0,
                "engine_order": source.integer(0, sectors - 1),
            },
            "observe": {"dof": "tip", "band": [0.02, 0.6]},
        }
    )


def random_scene(source: Source) -> tuple[Scene, int]:
    """Return a scene and a highest harmonic."""
    scene = random_disk(source) if source.integer(0, 2) == 2 else random_chain(source)
    return scene, source.choice(HARMONICS)
