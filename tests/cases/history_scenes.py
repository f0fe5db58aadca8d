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


def plane_scene(load: dict[str, Any], directions: dict[str, list[float]], **contact: Any) -> Scene:
    """Oscillators of 1 kg, [k, c, force, phase] each, and a contact along x and y with a limit for each."""
    ends = {"between": "x", "between_second": "y"} | ({"normal_between": "z"} if "kn" in contact else {})
    law = "coulomb-3d" if "kn" in contact else "coulomb-2d"
    return Scene.from_dict(
        {
            "name": "plane",
            "structure": {
                "kind": "lumped",
                "masses": dict.fromkeys(directions, 1.0),
                "springs": [
                    {"between": [dof, "ground"], "k": k, "c": c} for dof, (k, c, _, _) in directions.items()
                ],
            },
            "contacts": [
                {"name": "c", "law": law, "limit": "box", "mu": 0.5, **load, **contact}
                | {key: [dof, "ground"] for key, dof in ends.items()}
            ],
            "excitation": [
                {"dof": dof, "amplitude": force, "phase": phase}
                for dof, (_, _, force, phase) in directions.items()
            ],
            "observe": {"dof": "y", "band": [0.5, 5.0]},
        }
    )


BOX = {"x": [95.9420458, 0.42562, 66.652313, 0.0], "y": [12.0438248, 0.2104916, 53.7568487, 2.4016075]}


def moving_plane() -> Scene:
    """One direction slips under a load that moves, and the other sticks."""
    directions = {
        "x": [101.741, 0.552604, 67.831882, 0.664438], "y": [44.603, 0.528111, 104.322701, 1.270637],
        "z": [223.707, 0.125813, 99.640687, 4.364217],
    }  # fmt: skip
    return plane_scene({"N0": 147.137634}, directions, kt=216.934905, kn=93.490037, prestressed=True)
