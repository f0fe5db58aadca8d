"""The files of a small sector of a ring of bars: matrices and labels of CalculiX, and the deck."""

import math
from itertools import combinations
from typing import Any

import numpy as np
from fe_files import coordinate

SECTORS = 6
TABLES: dict[str, Any] = {"low": "LOW", "high": "HIGH", "axis": [0, 0, 1]}
DOFS = {"rim": "6.UZ", "hub": "4.UX"}


def sector_files() -> dict[str, bytes]:
    """Nine nodes, three on each boundary; each is joined with every near one and a little with the ground."""
    pitch = 2.0 * math.pi / SECTORS
    polar = [(radius, share * pitch, z) for share in (0.0, 0.5, 1.0)
             for radius, z in ((0.1, 0.0), (0.15, 0.01), (0.2, 0.0))]  # fmt: skip
    places = np.array([(r * math.cos(a), r * math.sin(a), z) for r, a, z in polar])
    K = 2e4 * np.eye(27)
    for i, j in combinations(range(9), 2):
        bar = places[j] - places[i]
        length = float(np.linalg.norm(bar))
        if length < 0.13:
            part = 1e6 / length * np.outer(bar, bar) / length**2
            for a, b, sign in ((i, i, 1.0), (j, j, 1.0), (i, j, -1.0), (j, i, -1.0)):
                K[3 * a : 3 * a + 3, 3 * b : 3 * b + 3] += sign * part
    lines = ["*NODE, NSET=ALL", *(f"{i}, {x!r}, {y!r}, {z!r}" for i, (x, y, z) in
                                  enumerate(places.tolist(), start=1))]  # fmt: skip
    lines += ["*NSET, NSET=LOW", "1, 2, 3", "*NSET, NSET=HIGH", "7, 8, 9"]
    labels = [f"{node}.{direction}" for node in range(1, 10) for direction in (1, 2, 3)]
    return {
        "ring.mas": coordinate(np.diag(np.linspace(0.5, 1.0, 9).repeat(3))).encode(),
        "ring.sti": coordinate(K).encode(),
        "ring.dof": ("\n".join(labels) + "\n").encode(),
        "ring.inp": ("\n".join(lines) + "\n").encode(),
    }


def scene_of(structure: dict[str, Any]) -> dict[str, Any]:
    """A scene on the ring: the rim of each sector rubs on the ground, a wave of two nodal diameters."""
    return {
        "name": "ring",
        "structure": {"kind": "matrices", "sectors": SECTORS, "damping_ratio": 0.01, **structure},
        "contacts": [{"name": "rub", "between": ["rim", "ground"], "kt": 2e4, "mu": 0.3, "N0": 1.0}],
        "excitation": {"dof": "hub", "amplitude": 100.0, "engine_order": 2},
        "observe": {"dof": "rim", "band": [20.0, 60.0]},
    }
