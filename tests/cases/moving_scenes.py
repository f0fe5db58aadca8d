"""Random scenes in space whose contacts have loads that move, open, slide in circles, or bend."""

from itertools import pairwise
from typing import Any

import numpy as np

from solver import Scene

KINDS = ("elastic-normal", "circle", "box", "gap", "polynomial", "mixed")


def _contact(rng: np.random.Generator, kind: str, name: str, ends: list[list[str]]) -> dict[str, Any]:
    here: dict[str, Any] = {"name": name, "between": ends[0]}
    if kind == "gap":
        return {**here, "law": "gap", "k": rng.uniform(0.5, 6.0), "gap": rng.uniform(-0.3, 0.8)}
    if kind == "polynomial":
        return {**here, "law": "polynomial", "a2": rng.uniform(-0.2, 0.2), "a3": rng.uniform(0.05, 0.6)}
    friction = {
        "kt": rng.uniform(0.5, 4.0), "mu": rng.uniform(0.15, 0.7), "kn": rng.uniform(0.5, 4.0),
        "N0": rng.uniform(-0.3, 1.5), "prestressed": bool(rng.random() < 0.5),
        "N1": rng.uniform(0.0, 0.4), "N1_phase": rng.uniform(-3.0, 3.0), "normal_between": ends[2],
    }  # fmt: skip
    if kind == "elastic-normal":
        return {**here, "law": "elastic-normal", **friction}
    second = {"kt_second": rng.uniform(0.5, 4.0)} if rng.random() < 0.5 else {}
    return {**here, "law": "coulomb-3d", "limit": kind, "between_second": ends[1], **friction, **second}


def moving_scene(seed: int, kind: str | None = None) -> tuple[Scene, float]:
    """Three directions of one or two masses, coupled, all driven; one or two contacts; with a frequency."""
    rng = np.random.default_rng([9, seed])
    kind = KINDS[seed % len(KINDS)] if kind is None else kind
    masses = 1 + int(rng.random() < 0.4)
    dofs = [f"{way}{i}" for i in range(masses) for way in "xyz"]
    springs: list[dict[str, Any]] = [
        {"between": [dof, "ground"], "k": rng.uniform(0.7, 2.0), "c": rng.uniform(0.02, 0.12)} for dof in dofs
    ]
    springs += [{"between": [a, b], "k": rng.uniform(0.1, 0.6), "c": 0.02} for a, b in pairwise(dofs)]
    ends = [[dof, "ground"] for dof in dofs[:3]]
    between = [[a, b] for a, b in zip(dofs[:3], dofs[3:], strict=False)] or ends
    names = [str(rng.choice(KINDS[:-1])) for _ in range(2)] if kind == "mixed" else [kind]
    contacts = [_contact(rng, each, f"c{i}", ends if i == 0 else between) for i, each in enumerate(names)]
    forces = [
        {"dof": dof, "amplitude": rng.uniform(0.2, 1.5), "phase": rng.uniform(-3.0, 3.0)} for dof in dofs[:3]
    ]
    frequency = float(np.sqrt(rng.uniform(0.5, 2.5)) / (2.0 * np.pi) * rng.choice([0.5, 0.8, 1.0, 1.2, 1.4]))
    scene = Scene.from_dict(
        {
            "name": f"moving-{kind}-{seed}",
            "structure": {
                "kind": "lumped", "masses": {dof: rng.uniform(0.7, 1.5) for dof in dofs}, "springs": springs,
            },
            "contacts": contacts, "excitation": forces, "observe": {"dof": "x0", "band": [0.05, 0.5]},
        }
    )  # fmt: skip
    return scene, frequency


def bending_scene(seed: int) -> Scene:
    """A rubbing part pressed by a load that opens: its response bends over to lower frequencies."""
    rng = np.random.default_rng([10, seed])
    law = ("elastic-normal", "circle", "box")[seed % 3]
    dofs = ["x", "y"] if law == "elastic-normal" else ["x", "z", "y"]
    rub: dict[str, Any] = {
        "name": "rub", "between": ["x", "ground"], "normal_between": ["y", "ground"], "prestressed": True,
        "kt": rng.uniform(0.5, 2.0), "mu": rng.uniform(0.1, 0.4), "kn": rng.uniform(2.0, 4.0),
        "N0": rng.uniform(0.4, 0.9), "law": "elastic-normal",
    }  # fmt: skip
    if law != "elastic-normal":
        rub |= {"law": "coulomb-3d", "limit": law, "between_second": ["z", "ground"]}
    pull = rng.uniform(0.15, 0.3)
    springs = [{"between": [dof, "ground"], "k": rng.uniform(0.9, 1.2), "c": 0.03} for dof in dofs]
    return Scene.from_dict(
        {
            "name": f"bending-{law}-{seed}",
            "structure": {"kind": "lumped", "masses": dict.fromkeys(dofs, 1.0), "springs": springs},
            "contacts": [rub],
            "excitation": [
                {"dof": "y", "amplitude": pull},
                {"dof": "x", "amplitude": 0.4 * pull, "phase": 0.7},
            ],
            "observe": {"dof": "y", "band": [0.16, 0.45]},
        }
    )
