"""Scenes whose flutter friction holds: one mass, random chains, and two bodies with much friction."""

from typing import Any

import numpy as np

import solver


def chain(seed: int) -> solver.Scene:
    """The scene of `chain_body`."""
    return solver.Scene.from_dict(chain_body(seed))


def chain_body(seed: int) -> dict[str, Any]:
    """3 to 10 masses in a row, lightly damped; 2 to 5 sliders between any two, or to the ground."""
    r = np.random.default_rng(seed)
    n, sliders = r.integers(3, 11), r.integers(2, 6)
    k = r.uniform(0.5, 3.0, n + 1)
    K = np.diag(k[:-1] + k[1:]) - np.diag(k[1:-1], 1) - np.diag(k[1:-1], -1)
    M = np.diag(r.uniform(0.5, 2.0, n))
    between = []
    for _ in range(sliders):
        i, j = r.integers(0, n), r.integers(-1, n)
        between.append([f"m{i}", "ground" if j in (-1, i) else f"m{j}"])
    kt, limits = r.uniform(0.2, 2.0, sliders), r.uniform(0.2, 2.0, sliders)
    return {
        "name": f"chain-{seed}",
        "structure": {
            "kind": "matrices", "M": M.tolist(), "K": K.tolist(), "C": (0.004 * K + 0.002 * M).tolist(),
            "dofs": [f"m{i}" for i in range(n)],
        },
        "contacts": [
            {"name": f"f{i}", "between": ends, "kt": float(kt[i]), "mu": 1.0, "N0": float(limits[i])}
            for i, ends in enumerate(between)
        ],
        "excitation": {"dof": "m0", "amplitude": 1.0},
        "observe": {"dof": "m0", "band": [0.02, 0.6]},
    }  # fmt: skip


def carried_platform() -> solver.Scene:
    """A mass on a light one that slips on the ground: most damping 24 %, and slow in harmonics."""
    ground = {"mu": 0.5480934095199835}
    return solver.Scene.from_dict(
        {
            "name": "carried-platform",
            "structure": {
                "kind": "lumped",
                "masses": {"p0": 19.28205053683491, "link": 0.5816567392774972},
                "springs": [
                    {"between": ["p0", "ground"], "k": 14.76171774107484, "c": 0.3284411949789245},
                    {"between": ["link", "ground"], "k": 1.2214285033929544, "c": 0.09447637044357263},
                ],
            },
            "contacts": [
                {"name": "c0", "between": ["p0", "link"], "kt": 55.36609399389492,
                 "N0": 455.61564758431246, **ground},
                {"name": "c1", "between": ["link", "ground"], "kt": 118.88494293473431,
                 "N0": 375.91693257391546, **ground},
            ],
            "excitation": {"dof": "p0", "amplitude": 44.527058700937786},
            "observe": {"dof": "p0", "band": [0.041678287551353596, 0.30564077537659307]},
        }
    )  # fmt: skip
