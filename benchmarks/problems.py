"""The problems that are timed, each defined so that other codes can be given the same one."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

from solver import Scene

K1, K2 = 4.0 * math.pi**2, 2.0 * math.pi**2  # N/m: to the ground, between neighbours
C1, C2 = 0.5, 0.5  # N s/m, likewise
KT, MU, N0, FORCE = 30.0, 0.3, 100.0, 100.0
BAND = (0.2, 2.5)  # Hz


def case_a(load: float = N0) -> Scene:
    """Two masses, each on the ground and joined, a slider on the second, the force on the first."""
    return Scene.from_dict(
        {
            "name": "case-a",
            "structure": {
                "kind": "lumped",
                "masses": {"m1": 1.0, "m2": 1.0},
                "springs": [
                    {"between": ["m1", "ground"], "k": K1, "c": C1},
                    {"between": ["m1", "m2"], "k": K2, "c": C2},
                    {"between": ["m2", "ground"], "k": K1, "c": C1},
                ],
            },
            "contacts": [{"name": "damper", "between": ["m2", "ground"], "kt": KT, "mu": MU, "N0": load}],
            "excitation": {"dof": "m1", "amplitude": FORCE},
            "observe": {"dof": "m2", "band": list(BAND)},
        }
    )


def chain(masses: int, *, sliders: bool) -> Scene:
    """Equal masses in a row; a slider and a force on each, or one slider on the last and force on the first.

    The last mass is observed.
    """
    dofs = [f"m{i + 1}" for i in range(masses)]
    last = masses - 1
    springs: list[dict[str, Any]] = [{"between": [dof, "ground"], "k": K1, "c": C1} for dof in dofs]
    springs += [{"between": [one, other], "k": K2, "c": C2} for one, other in pairwise(dofs)]
    rubbing = dofs if sliders else dofs[last:]
    return Scene.from_dict(
        {
            "name": f"chain-{masses}",
            "structure": {"kind": "lumped", "masses": dict.fromkeys(dofs, 1.0), "springs": springs},
            "contacts": [
                {"name": f"on_{dof}", "between": [dof, "ground"], "kt": KT, "mu": MU, "N0": N0}
                for dof in rubbing
            ],
            "excitation": [{"dof": dof, "amplitude": FORCE} for dof in (dofs if sliders else dofs[:1])],
            "observe": {"dof": dofs[last], "band": list(BAND)},
        }
    )


def graded_chain(masses: int) -> Scene:
    """A chain with a slider and a force on each, the loads rising along it: some slip, some stick.

    The first mass is observed, where the contacts slip: far along the chain the motion is linear.
    """
    raw = chain(masses, sliders=True).to_dict()
    scene = Scene.from_dict({**raw, "observe": {"dof": "m1", "band": list(BAND)}})
    return scene.with_values(
        {f"{contact.name}.N0": N0 * (0.2 + 8.0 * i / masses) for i, contact in enumerate(scene.contacts)}
    )
