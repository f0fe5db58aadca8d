"""Random scenes whose contacts go from slipping always to sticking always, for what depends on history."""

import math
from typing import Any

import numpy as np
from scipy.linalg import eigvalsh

from solver import Scene
from solver.linear.assembly import linear_model

KINDS = ("given", "moving", "circle", "box", "box-moving")


def history_scene(seed: int, kind: str) -> tuple[Scene, float]:
    """One to four masses, one to three contacts, forces of several harmonics; with a frequency [Hz]."""
    rng = np.random.default_rng([seed, KINDS.index(kind)])
    dofs = [f"m{i}" for i in range(rng.integers(2 if kind != "given" else 1, 5))]
    force = float(10.0 ** rng.uniform(-1.0, 2.0))
    k = [float(10.0 ** rng.uniform(1.0, 2.5)) for _ in dofs]
    springs: list[dict[str, Any]] = [{"between": ["m0", "ground"], "k": k[0]}]
    for i in range(1, len(dofs)):
        springs.append({"between": [dofs[i], dofs[rng.integers(i)]], "k": k[i]})
    scene = Scene.from_dict(
        {
            "name": f"history-{kind}-{seed}",
            "structure": {
                "kind": "lumped",
                "masses": {dof: float(rng.uniform(0.3, 3.0)) for dof in dofs},
                "springs": springs,
                "stiffness_proportional_damping": float(10.0 ** rng.uniform(-2.7, -1.3)),
            },
            "contacts": [_contact(rng, f"c{i}", dofs, force, kind) for i in range(rng.integers(1, 4))],
            "excitation": _forces(rng, dofs, force),
            "observe": {"dof": str(rng.choice(dofs)), "band": [0.05, 5.0]},
        }
    )
    model = linear_model(scene)
    natural = np.sqrt(eigvalsh(model.K0, model.M)) / (2.0 * math.pi)
    return scene, float(rng.choice(natural) * 10.0 ** rng.uniform(-0.9, 0.6))


def _forces(rng: np.random.Generator, dofs: list[str], force: float) -> list[dict[str, Any]]:
    forces = [{"dof": str(rng.choice(dofs)), "amplitude": force, "phase": float(rng.uniform(-3.0, 3.0))}]
    for harmonic, share in ((2, 0.4), (0, 0.4)):
        if rng.random() < share:
            forces.append(
                {
                    "dof": str(rng.choice(dofs)),
                    "amplitude": force * float(rng.uniform(0.05, 1.0)),
                    "harmonic": harmonic,
                    "phase": 0.0 if harmonic == 0 else float(rng.uniform(-3.0, 3.0)),
                }
            )
    return forces


def _contact(rng: np.random.Generator, name: str, dofs: list[str], force: float, kind: str) -> dict[str, Any]:
    mu = float(rng.uniform(0.1, 0.6))

    def pair() -> list[str]:
        first = str(rng.choice(dofs))
        return [first, str(rng.choice([dof for dof in [*dofs, "ground"] if dof != first]))]

    contact: dict[str, Any] = {
        "name": name, "between": pair(), "kt": float(10.0 ** rng.uniform(0.5, 3.0)), "mu": mu,
        "N0": float(force / mu * 10.0 ** rng.uniform(-1.5, 1.5)),
        "N1_ratio": 0.0 if rng.random() < 0.4 else float(rng.uniform(0.0, 1.2)),
        "N1_phase": float(rng.uniform(-math.pi, math.pi)),
    }  # fmt: skip
    if kind == "moving" and (name == "c0" or rng.random() < 0.5):
        contact |= {"law": "elastic-normal", "normal_between": pair(), "kn": 10.0 ** rng.uniform(0.5, 2.5)}
    if kind == "circle" and (name == "c0" or rng.random() < 0.5):
        limit = "circle" if rng.random() < 0.7 else "box"
        contact |= {"law": "coulomb-2d", "between_second": pair(), "limit": limit}
    if kind.startswith("box"):
        contact |= {"law": "coulomb-2d", "between_second": pair(), "limit": "box"}
    if kind == "box-moving" and (name == "c0" or rng.random() < 0.5):
        contact |= {
            "law": "coulomb-3d", "normal_between": pair(), "kn": float(10.0 ** rng.uniform(0.5, 2.5)),
            "prestressed": bool(rng.random() < 0.5), "kt_second": float(10.0 ** rng.uniform(0.5, 3.0)),
        }  # fmt: skip
    return contact
