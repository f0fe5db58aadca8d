"""The values that a scene of somebody's own matrices begins with: its band, and those of its contacts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from solver.scene.scene import Scene

FORCE = 1.0
FRICTION = 0.3
_FORCE_AT_OPTIMUM = 1.3
"""Friction over excitation, both in the mode: near the least peak of one mode with a stiff contact."""


def started(asked: Mapping[str, Any], structure: Mapping[str, Any]) -> tuple[Scene, NDArray[np.float64]]:
    """A scene on a structure, and the squares of its natural frequencies without contacts [rad²/s²].

    The band is an octave on each side of the first elastic frequency. A contact begins as stiff as the
    structure is where it acts, under a load whose friction is of the size of the excitation in that mode:
    values to begin a search from.

    Parameters
    ----------
    asked : `name`, `contacts` (each `name` and `between`), `excitation` and `observe` (each its `dof`). Of
        a sector the excitation also has its `engine_order`, whose nodal diameter counts.
    structure : its tables, files read.

    Raises
    ------
    SceneError
        Lists everything that is wrong.
    """
    from solver.linear.assembly import linear_model
    from solver.matrices.diagnostics import rigid_body_modes
    from solver.matrices.normal_modes import undamped_modes
    from solver.scene.parts import MatricesStructure
    from solver.scene.scene import Scene

    given = {key: value for key, value in asked["excitation"].items() if value is not None}
    raw = {
        "name": asked["name"], "structure": dict(structure),
        "contacts": [{**contact, "kt": 1.0, "mu": FRICTION, "N0": 1.0} for contact in asked["contacts"]],
        "excitation": {**given, "amplitude": FORCE},
        "observe": {**asked["observe"], "band": [1.0, 2.0]},
    }  # fmt: skip
    scene = Scene.from_dict(raw)
    if not isinstance(scene.structure, MatricesStructure):
        raise TypeError(f"the structure is of kind {scene.structure.kind}")
    model = linear_model(scene)
    at = model.diameters(np.ones(1, np.int64))
    K, _, M = (each[0] for each in model.plain(at))
    found = undamped_modes(K, M)
    order = np.argsort(found.omega2)
    omega2 = found.omega2[order]
    moving = dict(zip(scene.structure.dofs, model.shapes @ found.psi[:, order], strict=True))
    rigid = rigid_body_modes(omega2)
    first = min(rigid, omega2.size - 1)
    hz = math.sqrt(max(float(omega2[first]), 0.0)) / (2.0 * math.pi) or 1.0
    pushed = float(abs(moving[given["dof"]][first]))
    rubbing = model.ports_at(at)[0] @ found.psi[:, order]
    contacts = [
        {
            **contact, "kt": _digits(1.0 / float(np.sum(np.abs(moved[rigid:]) ** 2) or 1.0)), "mu": FRICTION,
            "N0": _digits(_load(pushed, float(abs(moved[first])))),
        }
        for contact, moved in zip(asked["contacts"], rubbing, strict=True)
    ]  # fmt: skip
    raw |= {"contacts": contacts}
    raw["observe"] = {**asked["observe"], "band": [_digits(0.5 * hz, 6), _digits(2.0 * hz, 6)]}
    return Scene.from_dict(raw), omega2


def _load(pushed: float, moved: float) -> float:
    """The normal load whose friction is of the size of the excitation, both in one mode [N]."""
    ratio = pushed / moved if moved > 1e-3 * pushed else 10.0
    return _FORCE_AT_OPTIMUM * FORCE * max(ratio, 0.1) / FRICTION


def _digits(value: float, digits: int = 3) -> float:
    return float(f"{value:.{digits}g}")
