"""Scenes whose normal loads have several harmonics, for every law with a given load."""

from typing import Any

import numpy as np

from solver.scene.scene import Scene

LAWS: dict[str, dict[str, Any]] = {
    "coulomb": {},
    "elastic-normal": {"law": "elastic-normal", "normal_between": ["b", "ground"], "kn": 8.0},
    "circle": {"law": "coulomb-2d", "between_second": ["b", "ground"]},
    "box": {"law": "coulomb-2d", "between_second": ["b", "ground"], "limit": "box"},
    "in space": {
        "law": "coulomb-3d", "between_second": ["b", "a"], "normal_between": ["b", "ground"], "kn": 6.0
    },
}  # fmt: skip


def fourier_load(rng: np.random.Generator, mean: float, *, most: int = 5) -> list[Any]:
    """A load of one to three harmonics up to `most`, which opens the contact in about half of the cases."""
    orders = rng.choice(np.arange(1, most + 1), size=int(rng.integers(1, 4)), replace=False)
    swing = mean * float(10.0 ** rng.uniform(-0.7, 0.7))
    waves = [
        {"order": int(order), "amplitude": float(swing * rng.uniform(-1.0, 1.0)),
         "phase": float(rng.uniform(-4.0, 4.0))}
        for order in orders
    ]  # fmt: skip
    return [mean, *waves]


def loaded(load: list[Any], law: str = "coulomb", **changed: Any) -> Scene:
    """Two masses, the second rubbing under a load."""
    contact = {"name": "c", "between": ["a", "ground"], "kt": 30.0, "mu": 0.4, "load": load, **LAWS[law]}
    return Scene.from_dict(
        {
            "name": "loaded",
            "structure": {
                "kind": "lumped",
                "masses": {"a": 1.0, "b": 0.7},
                "springs": [
                    {"between": ["a", "ground"], "k": 40.0, "c": 0.5},
                    {"between": ["a", "b"], "k": 30.0, "c": 0.4},
                    {"between": ["b", "ground"], "k": 20.0, "c": 0.3},
                ],
            },
            "contacts": [contact | changed],
            "excitation": [{"dof": "b", "amplitude": 10.0, "phase": 0.3}],
            "observe": {"dof": "a", "band": [0.4, 2.5]},
        }
    )


def random_loads(seed: int) -> tuple[Scene, float]:
    """A scene under a random load and a frequency in its band [Hz]."""
    rng = np.random.default_rng(28_000 + seed)
    law = list(LAWS)[seed % len(LAWS)]
    load = fourier_load(rng, float(10.0 ** rng.uniform(-0.5, 1.5)))
    changed = {"mu": float(rng.uniform(0.05, 0.8)), "kt": float(10.0 ** rng.uniform(0.5, 2.5))}
    return loaded(load, law, **changed), float(rng.uniform(0.4, 2.5))
