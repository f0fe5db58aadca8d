"""Random scenes in every regime: stuck, slipping, separating, resonant, at a fraction of a resonance."""

import math
from typing import Any

import numpy as np
from scipy.linalg import eigvalsh

from solver import Scene
from solver.linear.assembly import linear_model

K0 = (2.0 * math.pi) ** 2  # N/m: about 1 Hz with 1 kg


def random_scene(seed: int) -> tuple[Scene, float, int]:
    """One to four masses, one to three contacts; with a frequency [Hz] and a number of harmonics, 3 to 15."""
    rng = np.random.default_rng(seed)
    dofs = [f"x{i}" for i in range(rng.integers(1, 5))]
    masses = {dof: float(rng.uniform(0.5, 2.0)) for dof in dofs}
    springs = _springs(rng, dofs)
    force = float(10.0 ** rng.uniform(-1.0, 2.0))
    contacts = [_contact(rng, f"c{i}", dofs, force) for i in range(rng.integers(1, 4))]
    damping = 10.0 ** rng.uniform(-3.0, -1.3) / math.pi
    scene = Scene.from_dict(
        {
            "name": f"random-{seed}",
            "structure": {
                "kind": "lumped",
                "masses": masses,
                "springs": springs,
                "stiffness_proportional_damping": damping,
            },
            "contacts": contacts,
            "excitation": {"dof": str(rng.choice(dofs)), "amplitude": force},
            "observe": {"dof": str(rng.choice(dofs)), "band": [0.05, 5.0]},
        }
    )
    return scene, _frequency(rng, scene), int(rng.integers(3, 16))


def _springs(rng: np.random.Generator, dofs: list[str]) -> list[dict[str, Any]]:
    springs: list[dict[str, Any]] = []
    for i, dof in enumerate(dofs):
        if i == 0 or rng.random() < 0.6:
            springs.append({"between": [dof, "ground"], "k": float(K0 * rng.uniform(0.3, 2.0))})
        if i > 0:
            springs.append({"between": [dof, dofs[i - 1]], "k": float(K0 * rng.uniform(0.3, 2.0))})
    return springs


def _contact(rng: np.random.Generator, name: str, dofs: list[str], force: float) -> dict[str, Any]:
    """From loads that hardly matter to loads that stick; seven in ten vary, half of these open."""
    first = str(rng.choice(dofs))
    mu = float(rng.uniform(0.1, 0.6))
    return {
        "name": name,
        "between": [first, str(rng.choice([dof for dof in [*dofs, "ground"] if dof != first]))],
        "kt": float(K0 * 10.0 ** rng.uniform(-0.5, 1.7)),
        "mu": mu,
        "N0": float(force / mu * 10.0 ** rng.uniform(-1.0, 0.7)),
        "N1_ratio": 0.0 if rng.random() < 0.3 else float(rng.uniform(0.0, 2.0)),
        "N1_phase": 0.0 if rng.random() < 0.5 else float(rng.uniform(-math.pi, math.pi)),
    }


def _frequency(rng: np.random.Generator, scene: Scene) -> float:
    """Near a resonance with the contacts free or stuck, near a fraction of one, or anywhere below."""
    model = linear_model(scene)
    L = np.real(model.contact_here)
    kt = np.array([contact.kt for contact in scene.contacts]) * (rng.random() < 0.5)
    natural = np.sqrt(eigvalsh(model.K0 + L.T @ (kt[:, None] * L), model.M)) / (2.0 * math.pi)
    near = float(rng.choice(natural))
    frequencies = [rng.uniform(0.15, 1.5) * natural[0], near / rng.integers(2, 8), near, near]
    return float(frequencies[rng.integers(4)] * rng.uniform(0.9, 1.1))
