"""Random problems of one variable: chains and disks, from loads that hardly matter to loads that stick.

Damping ratios are those of the first mode with the contacts open. The range of the variable is two to four
decades of a load, two of a stiffness, one and a half of a friction coefficient.
"""

import math
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import eigvalsh

from solver import Scene
from solver.linear.assembly import linear_model


class OneVariable(NamedTuple):
    """A scene, the path of the variable and its range."""

    scene: Scene
    path: str
    low: float
    high: float


def one_variable(seed: int, least_damping: float = 1e-4, most_damping: float = 0.1) -> OneVariable:
    """Return a random problem; the same seed, the same problem."""
    rng = np.random.default_rng(seed)
    ratio = math.exp(rng.uniform(math.log(least_damping), math.log(most_damping)))
    given = _disk(rng) if rng.random() < 0.35 else _chain(rng)
    plain = Scene.from_dict({**given, "contacts": []})
    first, _ = _natural(plain, np.zeros(0))
    given["structure"]["stiffness_proportional_damping"] = 2.0 * ratio / first
    scene = Scene.from_dict(given)
    kt = np.array([contact.kt for contact in scene.contacts], dtype=np.float64)
    lowest, _ = _natural(scene, np.zeros_like(kt))
    _, highest = _natural(scene, kt)
    lowest, highest = lowest / (2.0 * math.pi), highest / (2.0 * math.pi)
    band = [lowest * rng.uniform(0.4, 0.8), highest * rng.uniform(1.1, 1.4)]
    if rng.random() < 0.25:  # part of it: peaks leave and enter at its ends
        band = [lowest * rng.uniform(0.8, 1.3), lowest * rng.uniform(1.5, 2.5)]
    scene = Scene.from_dict({**given, "observe": {**given["observe"], "band": band}})
    contact = scene.contacts[int(rng.integers(len(scene.contacts)))]
    kind = str(rng.choice(["N0", "N0", "N0", "kt", "mu"]))
    decades = {"N0": rng.uniform(2.0, 4.0), "kt": 2.0, "mu": 1.5}[kind]
    middle = float(getattr(contact, kind)) * 10.0 ** rng.uniform(-0.3, 0.3)
    low, high = (middle * 10.0 ** (way * 0.5 * decades) for way in (-1.0, 1.0))
    return OneVariable(scene, f"{contact.name}.{kind}", low, high)


def _natural(scene: Scene, kt: np.ndarray) -> tuple[float, float]:
    """Lowest and highest natural frequency [rad/s], above a thousandth of the highest."""
    model = linear_model(scene)
    K = model.K0
    if kt.size:
        L = model.contact_here
        K = K + L.conj().T @ (kt[:, None] * L)
    squares = eigvalsh(K, model.M)
    squares = squares[squares > 1e-6 * squares.max()]
    return float(np.sqrt(squares.min())), float(np.sqrt(squares.max()))


def _contact(
    rng: np.random.Generator, name: str, between: tuple[str, str], stiffness: float
) -> dict[str, Any]:
    mu = float(rng.uniform(0.1, 0.6))
    contact: dict[str, Any] = {
        "name": name, "between": list(between), "kt": stiffness * 10.0 ** float(rng.uniform(-1.0, 2.0)),
        "mu": mu, "N0": float(10.0 ** rng.uniform(-0.5, 1.5)) / mu,
    }  # fmt: skip
    if rng.random() < 0.6:
        contact["N1_ratio"] = float(rng.uniform(0.0, 1.8))
        contact["N1_phase"] = 0.0 if rng.random() < 0.4 else float(rng.uniform(-math.pi, math.pi))
    return contact


def _chain(rng: np.random.Generator) -> dict[str, Any]:
    dofs = [f"m{i}" for i in range(int(rng.integers(1, 5)))]
    springs = [
        {"between": [dof, "ground"], "k": float(rng.uniform(20.0, 80.0))}
        for i, dof in enumerate(dofs)
        if i == 0 or rng.random() < 0.6
    ]
    springs += [{"between": list(pair), "k": float(rng.uniform(10.0, 80.0))} for pair in pairwise(dofs)]
    excitation: list[dict[str, Any]] = [{"dof": str(rng.choice(dofs)), "amplitude": 1.0}]
    if rng.random() < 0.3:
        excitation.append(
            {
                "dof": str(rng.choice(dofs)), "amplitude": float(rng.uniform(0.1, 1.0)),
                "harmonic": int(rng.integers(1, 4)), "phase": float(rng.uniform(-math.pi, math.pi)),
            }
        )  # fmt: skip
    places = [*((dof, "ground") for dof in dofs), *pairwise(dofs)]
    count = min(int(rng.integers(1, 4)), len(places) + 1)
    chosen = [places[int(rng.integers(len(places)))] for _ in range(count)]
    return {
        "name": "random-chain",
        "structure": {
            "kind": "lumped", "masses": {dof: float(rng.uniform(0.5, 2.0)) for dof in dofs},
            "springs": springs,
        },
        "contacts": [_contact(rng, f"c{i}", place, 40.0) for i, place in enumerate(chosen)],
        "excitation": excitation,
        "observe": {"dof": str(rng.choice(dofs)), "band": [0.1, 10.0]},
    }  # fmt: skip


def _disk(rng: np.random.Generator) -> dict[str, Any]:
    sectors = int(rng.integers(3, 13))
    contacts = [_contact(rng, "shroud", ("tip", "tip@next"), 20.0)]
    if rng.random() < 0.5:
        contacts.append(_contact(rng, "root", ("tip", "disk"), 40.0))
    return {
        "name": "random-disk",
        "structure": {
            "kind": "cyclic", "sectors": sectors, "masses": {"tip": 1.0, "disk": 3.0},
            "springs": [
                {"between": ["tip", "disk"], "k": float(rng.uniform(20.0, 60.0))},
                {"between": ["disk", "disk@next"], "k": float(rng.uniform(10.0, 80.0))},
                {"between": ["disk", "ground"], "k": float(rng.uniform(20.0, 200.0))},
            ],
        },
        "contacts": contacts,
        "excitation": {
            "dof": str(rng.choice(["tip", "disk"])), "amplitude": 1.0,
            "engine_order": int(rng.integers(0, sectors)),
        },
        "observe": {"dof": "tip", "band": [0.1, 10.0]},
    }  # fmt: skip
