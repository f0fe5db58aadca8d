"""Random scenes whose highest peak may stand elsewhere with few harmonics than with many.

Damping ratios from 1e-5 to 0.1, loads from slipping always to sticking always, constant ones, ones that vary
and ones that open, bands down to a tenth of the lowest resonance: super-harmonic resonances included.
"""

import math
from typing import Any

import numpy as np
from random_scenes import K0
from scipy.linalg import eigvalsh

from solver import Scene
from solver.linear.assembly import linear_model


def branch_scene(seed: int) -> Scene:
    """One to three masses, one or two contacts."""
    rng = np.random.default_rng(70_000 + seed)
    dofs = [f"m{i}" for i in range(rng.integers(1, 4))]
    springs: list[dict[str, Any]] = []
    for i, dof in enumerate(dofs):
        if i == 0 or rng.random() < 0.5:
            springs.append({"between": [dof, "ground"], "k": float(K0 * rng.uniform(0.3, 2.0))})
        if i > 0:
            springs.append({"between": [dof, dofs[i - 1]], "k": float(K0 * rng.uniform(0.3, 2.0))})
    force = float(10.0 ** rng.uniform(-1.0, 2.0))
    raw: dict[str, Any] = {
        "name": f"branch-{seed}",
        "structure": {"kind": "lumped", "masses": {d: float(rng.uniform(0.3, 2.0)) for d in dofs},
                      "springs": springs},
        "contacts": [_contact(rng, f"c{i}", dofs, force) for i in range(rng.integers(1, 3))],
        "excitation": [{"dof": str(rng.choice(dofs)), "amplitude": force}],
        "observe": {"dof": str(rng.choice(dofs)), "band": [0.1, 1.0]},
    }  # fmt: skip
    free, stuck = _natural(Scene.from_dict(raw))
    zeta = 10.0 ** rng.uniform(-5.0, -1.0)
    raw["structure"]["stiffness_proportional_damping"] = zeta / (math.pi * free[0])
    low, high = rng.uniform(0.1, 0.6) * free[0], rng.uniform(1.05, 1.4) * stuck[rng.integers(stuck.size)]
    raw["observe"]["band"] = [float(low), float(max(high, 1.2 * free[0]))]
    return Scene.from_dict(raw)


def _contact(rng: np.random.Generator, name: str, dofs: list[str], force: float) -> dict[str, Any]:
    first = str(rng.choice(dofs))
    mu = float(rng.uniform(0.1, 0.7))
    return {
        "name": name,
        "between": [first, str(rng.choice([dof for dof in [*dofs, "ground"] if dof != first]))],
        "kt": float(K0 * 10.0 ** rng.uniform(-1.0, 1.5)),
        "mu": mu,
        "N0": float(force / mu * 10.0 ** rng.uniform(-1.5, 1.3)),
        "N1_ratio": 0.0 if rng.random() < 0.3 else float(rng.uniform(0.0, 2.0)),
        "N1_phase": 0.0 if rng.random() < 0.5 else float(rng.uniform(-math.pi, math.pi)),
    }


def _natural(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Natural frequencies [Hz] with the contacts free and stuck."""
    model = linear_model(scene)
    L = np.real(model.contact_here)
    kt = np.array([contact.kt for contact in scene.contacts])
    stiffness = (model.K0, model.K0 + L.T @ (kt[:, None] * L))
    free, stuck = (np.sqrt(eigvalsh(K, model.M)) / (2.0 * math.pi) for K in stiffness)
    return free, stuck
