"""Random piecewise linear scenes for certificates: 1 to 20 masses, 1 to 8 contacts of laws with events."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

import stickslip


def random_scene(
    seed: int, masses: int | None = None, contacts: int | None = None
) -> tuple[stickslip.Scene, float]:
    """Return a scene and a frequency [Hz]; loads vary and separate, some contacts are stiff or gaps."""
    rng = np.random.default_rng(seed)
    n = masses or int(rng.choice([1, 1, 2, 2, 3, 4, 5, 6, 8, 10, 15, 20]))
    count = contacts or int(rng.choice([1, 1, 2, 2, 3, 4, 6, 8]))
    names = [f"x{i}" for i in range(n)]
    zeta, ratio = (
        10.0 ** rng.uniform(-3.5, -1.0),
        10.0 ** rng.uniform(-0.5, 1.5 if rng.random() < 0.8 else 4.0),
    )

    def spring(ends: list[str], k: float) -> dict[str, Any]:
        return {"between": ends, "k": k, "c": 2.0 * zeta * k}

    springs = [spring(["x0", "ground"], rng.uniform(0.5, 1.5))]
    springs += [spring([a, b], rng.uniform(0.5, 1.5)) for a, b in pairwise(names)]
    springs += [spring([names[-1], "ground"], rng.uniform(0.2, 1.0))] if n > 2 else []
    mass = {name: float(rng.uniform(0.5, 2.0)) for name in names}
    index = {name: i for i, name in enumerate(names)}
    K = np.zeros((n, n))
    for each in springs:
        row = np.zeros(n)
        for end, sign in zip(each["between"], (1.0, -1.0), strict=True):
            if end != "ground":
                row[index[end]] += sign
        K += each["k"] * np.outer(row, row)
    roots = 1.0 / np.sqrt(list(mass.values()))
    lowest = float(np.sqrt(np.linalg.eigvalsh(roots[:, None] * K * roots)[0]))
    hz = (
        lowest
        * float(rng.uniform(0.9, 1.15) * rng.choice([1.0, 1.0, 1.0, 0.5, 1.0 / 3.0, 1.7]))
        / (2.0 * np.pi)
    )
    forces = [{"dof": str(rng.choice(names)), "amplitude": float(rng.uniform(0.5, 1.0))}]
    if rng.random() < 0.25:
        order, phase = int(rng.choice([2, 3, 5])), float(rng.uniform(0.0, 6.0))
        further = {"dof": str(rng.choice(names)), "amplitude": float(rng.uniform(0.2, 0.5))}
        forces.append(further | {"harmonic": order, "phase": phase})
    drive = np.zeros(n)
    drive[index[forces[0]["dof"]]] = forces[0]["amplitude"]
    omega = 2.0 * np.pi * hz
    moved = np.linalg.solve(K - omega**2 * np.diag(list(mass.values())) + 0.1j * omega * np.eye(n), drive)
    largest = float(np.abs(moved).max())
    kinds = rng.choice(["constant"] * 2 + ["varies", "separates", "moves", "gap"], size=count)
    rubbing = []
    for j, kind in enumerate(kinds.tolist()):
        a = str(rng.choice(names))
        others = [name for name in names if name != a]
        b = "ground" if not others or rng.random() < 0.6 else str(rng.choice(others))
        each: dict[str, Any] = {"name": f"c{j}", "between": [a, b]}
        stiffness = ratio * float(rng.uniform(0.5, 1.5))
        if kind == "gap":
            rubbing.append(
                each | {"law": "gap", "k": stiffness, "gap": largest * float(rng.uniform(0.2, 0.8))}
            )
            continue
        mu = float(rng.uniform(0.1, 0.6))
        each |= {"kt": stiffness, "mu": mu, "N0": float(rng.uniform(0.05, 0.6)) / mu / count**0.5}
        if kind in ("varies", "separates"):
            span = (0.3, 0.8) if kind == "varies" else (1.2, 3.0)
            each |= {"N1": each["N0"] * float(rng.uniform(*span)), "N1_phase": float(rng.uniform(0.0, 6.0))}
        if kind == "moves" and others:
            kn = float(rng.uniform(0.1, 0.5))
            each |= {"law": "elastic-normal", "kn": kn, "normal_between": [str(rng.choice(others)), "ground"],
                     "N0": kn * largest * float(rng.uniform(0.2, 1.0))}  # fmt: skip
        rubbing.append(each)
    raw = {"name": f"random-{seed}", "contacts": rubbing, "excitation": forces,
           "structure": {"kind": "lumped", "masses": mass, "springs": springs},
           "observe": {"dof": str(rng.choice(names)), "band": [hz / 3.0, hz * 3.0]}}  # fmt: skip
    return stickslip.Scene.from_dict(raw), hz
