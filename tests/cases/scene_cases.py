"""Scenes the tests of the balance share."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from solver.scene.scene import Scene, load_scene

DATA = Path(__file__).parent.parent / "data"
TWO_DOF_ROWS: list[dict[str, Any]] = json.loads((DATA / "two_dof.json").read_text())["rows"]
DISK_ROWS: list[dict[str, Any]] = json.loads((DATA / "bladed_disk.json").read_text())["rows"]


def two_dof(**values: float) -> Scene:
    """The shipped scene with other values of its damper."""
    return load_scene("two-dof").with_values({f"damper.{key}": value for key, value in values.items()})


def bladed_disk(**values: float) -> Scene:
    """The shipped scene with other values of its shroud contact."""
    return load_scene("bladed-disk").with_values({f"shroud.{key}": value for key, value in values.items()})


def row_scene(row: dict[str, Any]) -> Scene:
    """The scene of a row of the reference values."""
    if "engine_order" not in row:
        return two_dof(N0=row["N0"], N1=row["N1"], N1_phase=row["N1_phase"])
    obj = bladed_disk(N0=row["N0"], N1=row["N1"]).to_dict()
    obj["excitation"]["engine_order"] = row["engine_order"]  # type: ignore[index]
    return Scene.from_dict(obj)


def row_name(row: dict[str, Any]) -> str:
    return f"N0={row['N0']} N1={row['N1']} {row['frequency_hz']} Hz"


def oscillator(
    contact: dict[str, Any] | None = None, *, m: float = 1.0, k: float = 0.0, c: float = 0.0, **force: Any
) -> Scene:
    """One mass on the ground by a spring, a dashpot and a friction contact named ``damper``."""
    return Scene.from_dict(
        {
            "name": "oscillator",
            "structure": {
                "kind": "lumped",
                "masses": {"x": m},
                "springs": [{"name": "spring", "between": ["x", "ground"], "k": k, "c": c}],
            },
            "contacts": []
            if contact is None
            else [{"name": "damper", "between": ["x", "ground"], **contact}],
            "excitation": {"dof": "x", "amplitude": 1.0, **force},
            "observe": {"dof": "x", "band": [0.01, 1.0]},
        }
    )


def mixed_disk() -> Scene:
    """A disk with everything: dashpots across sectors, three forces, both contacts loaded with a phase."""
    raw = bladed_disk(N0=180.0, N1_ratio=0.5, N1_phase=0.7).to_dict()
    raw["structure"] |= {  # type: ignore[operator]
        "sectors": 6,
        "dampers": [
            {"name": "across", "between": ["root@next", "middle"], "c": 2.0},
            {"between": ["tip", "ground"], "c": 1.0},
        ],
    }
    raw["structure"]["masses"]["tip"] = {"m": 0.02, "name": "tip_mass"}  # type: ignore[index]
    raw["excitation"] = [
        {"dof": "middle", "amplitude": 400.0, "phase": 0.3, "engine_order": 2},
        {"dof": "tip", "amplitude": 8.0, "harmonic": 2, "phase": -0.4, "engine_order": 2},
        {"dof": "root", "amplitude": 30.0, "harmonic": 0, "engine_order": 2},
    ]
    return Scene.from_dict(raw)


def loose_mass(floor: float = 3000.0, **link: float) -> Scene:
    """A mass that nothing but two contacts holds, beside one that a spring holds.

    `floor` is the load of its contact with the ground, which sticks unless another one is given; `link` are
    values of the contact between the masses.
    """
    return Scene.from_dict(
        {
            "name": "loose-mass",
            "structure": {
                "kind": "lumped",
                "masses": {"held": 1.0, "loose": {"m": 0.5, "name": "loose_mass"}},
                "springs": [{"name": "k1", "between": ["held", "ground"], "k": 200.0, "c": 0.8}],
                "dampers": [{"name": "drag", "between": ["loose", "ground"], "c": 0.3}],
            },
            "contacts": [
                {
                    "name": "link",
                    "between": ["held", "loose"],
                    "kt": 60.0,
                    "mu": 0.4,
                    "N0": 20.0,
                    "N1": 5.0,
                    **link,
                },
                {"name": "floor", "between": ["loose", "ground"], "kt": 40.0, "mu": 0.3, "N0": floor},
            ],
            "excitation": {"dof": "held", "amplitude": 40.0},
            "observe": {"dof": "loose", "band": [0.5, 4.0]},
        }
    )


def joined_by_a_damper(c: float) -> Scene:
    """Two oscillators joined by a dashpot, with a contact on the second."""
    return Scene.from_dict(
        {
            "name": "joined-by-a-damper",
            "structure": {
                "kind": "lumped",
                "masses": {"a": 1.0, "b": 1.0},
                "springs": [
                    {"between": ["a", "ground"], "k": 1.0},
                    {"between": ["b", "ground"], "k": 2.0, "name": "k"},
                ],
                "dampers": [{"between": ["a", "b"], "c": c}],
            },
            "contacts": [
                {"name": "damper", "between": ["b", "ground"], "kt": 1.0, "mu": 0.5, "N0": 0.3, "N1": 0.1}
            ],
            "excitation": {"dof": "a", "amplitude": 1.0},
            "observe": {"dof": "b", "band": [0.05, 0.5]},
        }
    )


def critically_damped() -> Scene:
    """The dashpot at which two poles become one: below it they oscillate, above it they do not."""

    def creeps(c: float) -> bool:
        K, C = np.diag([1.0, 2.0]), c * np.array([[1.0, -1.0], [-1.0, 1.0]])
        poles = np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [-K, -C]]))
        return bool((np.abs(poles.imag) < 1e-12).any())

    low, high = 0.5, 5.0
    while high - low > 1e-15:
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        low, high = (low, middle) if creeps(middle) else (middle, high)
    return joined_by_a_damper(high)


def duffing(a3: float = 1.0, band: tuple[float, float] = (0.2, 0.35)) -> Scene:
    """One mass whose spring hardens by its cube, driven far beyond its resonance."""
    return Scene.from_dict(
        {
            "name": "duffing",
            "structure": {
                "kind": "lumped", "masses": {"x": 1.0},
                "springs": [{"between": ["x", "ground"], "k": 1.0, "c": 0.2}],
            },
            "contacts": [{"name": "c", "law": "polynomial", "between": ["x", "ground"], "a3": a3}],
            "excitation": {"dof": "x", "amplitude": 15.0},
            "observe": {"dof": "x", "band": list(band)},
        }
    )  # fmt: skip
