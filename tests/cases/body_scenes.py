"""Scenes with rigid bodies between platforms."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from solver import Scene
from solver.linear.assembly import linear_model


def planar_wedge(angle: float = math.radians(30.0), **extra: Any) -> dict[str, Any]:
    """A wedge of 5 g under two platforms, pressed against them by rotation, two points a face."""
    c, s = math.cos(angle), math.sin(angle)
    faces = [("left", "a", -1.0), ("right", "b", 1.0)]
    contacts = [
        {
            "name": f"{name}-{i}",
            "law": "elastic-normal",
            "between": ["damper", node],
            "at": [side * (0.005 + along * c), 0.002 - along * s, 0.0],
            "normal": [side * s, c, 0.0],
            "kt": 1e6,
            "kn": 1.5e6,
            "mu": 0.3,
            "N0": 0.0,
        }
        for name, node, side in faces
        for i, along in enumerate((-0.001, 0.001))
    ]
    masses = {"ax": 0.1, "ay": 0.1, "bx": 0.12, "by": 0.12}
    stiff = {"ax": 4e5, "ay": 6e5, "bx": 4.4e5, "by": 6e5}
    return {
        "name": "planar-wedge",
        "structure": {
            "kind": "lumped",
            "masses": masses,
            "springs": [{"between": [dof, "ground"], "k": k, "c": 1.0} for dof, k in stiff.items()],
            "dampers": [
                {"between": [f"damper.{component}", "ground"], "c": c}
                for component, c in (("x", 2.0), ("y", 2.0), ("rz", 2e-5))
            ],
        },
        "nodes": [
            {"name": name, "at": [x, 0.003, 0.0], "dofs": {"x": f"{name}x", "y": f"{name}y"}}
            for name, x in (("a", -0.01), ("b", 0.01))
        ],
        "bodies": [
            {
                "name": "damper",
                "mass": 0.005,
                "inertia": 1e-7,
                "plane": "xy",
                "radius_of_rotation": 0.3,
                "out": [0.0, 1.0, 0.0],
            }
        ],
        "speed": 3000.0,
        "contacts": contacts,
        "excitation": {"dof": "ax", "amplitude": 20.0},
        "observe": {"dof": "ax", "band": [200.0, 600.0]},
        **extra,
    }


def block_in_space(turn: NDArray[np.float64] | None = None, **contact: Any) -> dict[str, Any]:
    """A block of 20 g between two masses with x, y and z, held by four circular contacts.

    Everything is turned by `turn`, which has to map axes onto axes.
    """
    R = np.eye(3) if turn is None else turn

    def turned(vector: list[float]) -> list[float]:
        return [float(value) for value in R @ np.array(vector)]

    masses, springs, nodes = {}, [], []
    for name, side in (("a", -1.0), ("b", 1.0)):
        dofs = dict(zip("xyz", _turned_names(R, [f"{name}{axis}" for axis in "123"]), strict=True))
        for i, axis in enumerate("123"):
            masses[f"{name}{axis}"] = 0.2
            springs.append({"between": [f"{name}{axis}", "ground"], "k": (3.0 + i) * 1e5, "c": 3.0})
        nodes.append({"name": name, "at": turned([0.02 * side, 0.0, 0.0]), "dofs": dofs})
    contacts = [
        {
            "name": f"{name}{i}",
            "law": "coulomb-2d",
            "between": ["block", name],
            "at": turned([0.01 * side, y, z]),
            "normal": turned([side, 0.0, 0.0]),
            "kt": 2e6,
            "mu": 0.3,
            "N0": 30.0,
            **contact,
        }
        for name, side in (("a", -1.0), ("b", 1.0))
        for i, (y, z) in enumerate(((0.004, -0.003), (-0.005, 0.006)))
    ]
    inertia = R @ np.diag([3e-6, 2e-6, 4e-6]) @ R.T
    return {
        "name": "block",
        "structure": {
            "kind": "lumped",
            "masses": masses,
            "springs": springs,
            "dampers": [
                {"between": [f"block.{way}{axis}", "ground"], "c": c}
                for way, c in (("", 10.0), ("r", 1e-3))
                for axis in "xyz"
            ],
        },
        "nodes": nodes,
        "bodies": [{"name": "block", "mass": 0.02, "inertia": inertia.tolist()}],
        "contacts": contacts,
        "excitation": [{"dof": "a2", "amplitude": 30.0}, {"dof": "b3", "amplitude": 20.0, "phase": 1.0}],
        "observe": {"dof": "a2", "band": [150.0, 400.0]},
    }


def _turned_names(R: NDArray[np.float64], names: list[str]) -> list[str]:
    """The DOF along each axis after the turn; every mass is moved so that none needs a sign."""
    return [names[int(np.argmax(np.abs(R[row])))] for row in range(3)]


def sector_with_damper(sectors: int = 6, **contact: Any) -> dict[str, Any]:
    """A blade with two motions, and a body held between it and the next one, on a ring."""
    turn = 2.0 * math.pi / sectors
    radius = 0.3
    middle = [radius * math.cos(turn / 2.0), radius * math.sin(turn / 2.0), 0.0]
    along = [-math.sin(turn / 2.0), math.cos(turn / 2.0), 0.0]
    back = [-value for value in along]
    common = {"law": "elastic-normal", "kt": 1e6, "kn": 2e6, "mu": 0.3, "N0": 40.0, "prestressed": True}
    return {
        "name": "sector",
        "structure": {
            "kind": "cyclic",
            "sectors": sectors,
            "axis": [0.0, 0.0, 1.0],
            "masses": {"bx": 0.1, "by": 0.1, "disk": 0.5},
            "springs": [
                {"between": ["bx", "disk"], "k": 5e5, "c": 1.0},
                {"between": ["by", "ground"], "k": 4e5, "c": 1.0},
                {"between": ["disk", "disk@next"], "k": 2e5},
                {"between": ["disk", "ground"], "k": 3e6, "c": 5.0},
                {"between": ["damper.x", "ground"], "k": 1e3, "c": 1.0},
                {"between": ["damper.y", "ground"], "k": 1e3, "c": 1.0},
                {"between": ["damper.rz", "ground"], "k": 1.0, "c": 1e-4},
            ],
        },
        "nodes": [{"name": "tip", "at": [radius, 0.0, 0.0], "dofs": {"x": "bx", "y": "by"}}],
        "bodies": [{"name": "damper", "mass": 0.01, "inertia": 2e-6, "plane": "xy", "at": middle}],
        "contacts": [
            {
                "name": "ahead",
                "between": ["damper", "tip@next"],
                "at": middle,
                "normal": along,
                **common,
                **contact,
            },
            {
                "name": "behind",
                "between": ["damper", "tip"],
                "at": middle,
                "normal": back,
                **common,
                **contact,
            },
        ],
        "excitation": {"dof": "by", "amplitude": 10.0, "engine_order": 2},
        "observe": {"dof": "by", "band": [200.0, 500.0]},
    }


def shaped_wedge(**change: Any) -> dict[str, Any]:
    """The planar wedge by its shape."""
    wedge = {
        "name": "damper", "shape": "wedge", "between": ["a", "b"], "law": "elastic-normal",
        "angle": math.radians(30.0), "width": 0.01, "length": 0.004, "points": 2,
        "kt": 2e6, "kn": 3e6, "mu": 0.3, "N0": 1.0,
        "mass": 0.005, "inertia": 1e-7, "plane": "xy", "radius_of_rotation": 0.3, **change,
    }  # fmt: skip
    return {**planar_wedge(), "bodies": [], "contacts": [], "dampers": [wedge]}


def cylinder_in_space(**change: Any) -> dict[str, Any]:
    """A cylinder in the place of the block."""
    cylinder = {
        "name": "roll", "shape": "cylinder", "between": ["a", "b"], "law": "elastic-normal",
        "angle": 0.6, "radius": 0.005, "length": 0.012, "points": 3,
        "kt": 2e6, "kn": 3e6, "mu": 0.9,
        "mass": 0.02, "inertia": [3e-6, 2e-6, 4e-6], "radius_of_rotation": 0.3, **change,
    }  # fmt: skip
    raw = block_in_space()
    dampers = [
        {**damper, "between": [end.replace("block", "roll") for end in damper["between"]]}
        for damper in raw["structure"]["dampers"]
    ]
    # This law has one tangent, across the axis, along which something else has to hold the cylinder.
    springs = [*raw["structure"]["springs"], {"between": ["roll.z", "ground"], "k": 1e4}]
    structure = {**raw["structure"], "springs": springs, "dampers": dampers}
    return {
        **raw, "structure": structure, "bodies": [], "contacts": [], "dampers": [cylinder], "speed": 3000.0,
        "excitation": [{"dof": "a2", "amplitude": 10.0}, {"dof": "b3", "amplitude": 8.0, "phase": 1.0}],
    }  # fmt: skip


def as_matrices(raw: dict[str, Any], form: str = "matrices") -> dict[str, Any]:
    """A lumped scene with its own structure as matrices or modes, without what joins bodies to the ground."""
    plain = {key: value for key, value in raw["structure"].items() if key != "dampers"}
    left_out = ("bodies", "contacts", "nodes", "speed", "dampers")
    own = {**{key: value for key, value in raw.items() if key not in left_out}, "structure": plain}
    model = linear_model(Scene.from_dict(own))
    structure: dict[str, Any] = {"kind": "matrices"}
    if form == "modes":
        omega2, modes = eigh(model.K0, model.M)
        damping = np.diag(modes.T @ model.C0 @ modes) / (2.0 * np.sqrt(omega2))
        structure["modes"] = {
            "omega2": omega2.tolist(), "modes": modes.tolist(), "damping_ratio": damping.tolist(),
        }  # fmt: skip
        structure["dofs"] = list(model.dofs)
    else:
        structure |= {
            name: matrix.tolist() for name, matrix in (("M", model.M), ("K", model.K0), ("C", model.C0))
        }
        structure["dofs"] = {dof: i for i, dof in enumerate(model.dofs)}
    return {**raw, "structure": structure}
