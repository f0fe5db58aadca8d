"""A lumped disk as the matrices of one sector, with its disk on a boundary that the next sector shares."""

from typing import Any

import numpy as np

from solver import Scene, load_scene

ROWS = {"tip": 0, "middle": 1, "root": 2, "disk": 3}
HIGH = 4
SHARE = 0.4  # of mass and stiffness of the disk that this sector has at its low boundary


def sector_matrices() -> tuple[np.ndarray, np.ndarray]:
    """M and K of a sector of `bladed-disk` with a fifth row, the disk of the next one."""
    scene = load_scene("bladed-disk")
    K = np.zeros((5, 5))
    masses = {mass.dof: mass.m for mass in scene.structure.masses}
    M = np.diag([*(masses[dof] for dof in ("tip", "middle", "root")), SHARE * masses["disk"], 0.0])
    M[4, 4] = (1.0 - SHARE) * masses["disk"]
    for spring in scene.structure.springs:
        one, other = spring.ends
        if other.dof is None:
            K[3, 3] += SHARE * spring.k
            K[4, 4] += (1.0 - SHARE) * spring.k
            continue
        i, j = ROWS[str(one.dof)], HIGH if other.next else ROWS[str(other.dof)]
        K[[i, j], [i, j]] += spring.k
        K[[i, j], [j, i]] -= spring.k
    return M, K


def as_matrices(scene: Scene, **structure: Any) -> dict[str, Any]:
    """`bladed-disk`, or one made from it, with its structure by matrices."""
    M, K = sector_matrices()
    raw: dict[str, Any] = scene.to_dict()
    raw["structure"] = {
        "kind": "matrices", "sectors": 8, "M": M.tolist(), "K": K.tolist(), "dofs": dict(ROWS),
        "cyclic": {"low_rows": [3], "high_rows": [4]}, "stiffness_proportional_damping": 1e-6,
    } | structure  # fmt: skip
    return raw
